//! Wrong tokens by address, and the delay after them.
//!
//! ```text
//! delay after the n-th wrong token = 0 for n ≤ FREE, then 1 s·2^(n − FREE − 1), at most MAX_DELAY
//! ```
//!
//! During a delay no token of that address is compared, so that guesses in parallel gain nothing; other addresses are not
//! affected. A token that was refused before is not another guess: a page that was left open repeats it.

use super::client::network;
use super::token::TokenHash;
use std::collections::{HashMap, VecDeque};
use std::net::IpAddr;
use std::time::{Duration, Instant};

/// Wrong tokens without delay: a person mistypes.
const FREE: u32 = 5;

/// First delay.
const FIRST_DELAY: Duration = Duration::from_secs(1);

/// Longest delay: 1,440 guesses a day.
const MAX_DELAY: Duration = Duration::from_secs(60);

/// Time after the last wrong token at which an address is forgotten.
const FORGET_AFTER: Duration = Duration::from_secs(600);

/// Addresses that are remembered; beyond, the one whose last wrong token is oldest is forgotten.
const MAX_ADDRESSES: usize = 1024;

/// Refused tokens that are remembered by address: those of pages left open while a server restarted.
const REMEMBERED: usize = 4;

/// Wrong tokens of all addresses.
#[derive(Debug, Default)]
pub(super) struct WrongTokens(HashMap<IpAddr, Guesses>);

#[derive(Debug)]
struct Guesses {
    count: u32,
    last: Instant,
    refused: VecDeque<TokenHash>,
}

impl Guesses {
    fn delay(&self) -> Duration {
        match self.count.checked_sub(FREE + 1) {
            None => Duration::ZERO,
            Some(doublings) => FIRST_DELAY.saturating_mul(1 << doublings.min(16)).min(MAX_DELAY),
        }
    }
}

impl WrongTokens {
    /// Time for which an address must wait.
    pub fn wait(&self, address: IpAddr, now: Instant) -> Option<Duration> {
        let guesses = self.0.get(&network(address))?;
        let until = guesses.last + guesses.delay();
        (until > now).then(|| until - now)
    }

    /// Counts a wrong token of an address.
    pub fn count(&mut self, address: IpAddr, token: TokenHash, now: Instant) {
        self.0.retain(|_, guesses| now < guesses.last + FORGET_AFTER);
        let address = network(address);
        if self.0.len() >= MAX_ADDRESSES && !self.0.contains_key(&address) {
            let oldest = self.0.iter().min_by_key(|(_, guesses)| guesses.last).map(|(address, _)| *address);
            oldest.map(|oldest| self.0.remove(&oldest));
        }
        let guesses = self.0.entry(address).or_insert(Guesses {
            count: 0,
            last: now,
            refused: VecDeque::with_capacity(REMEMBERED),
        });
        if guesses.refused.contains(&token) {
            return;
        }
        if guesses.refused.len() == REMEMBERED {
            guesses.refused.pop_front();
        }
        guesses.refused.push_back(token);
        (guesses.count, guesses.last) = (guesses.count.saturating_add(1), now);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ATTACKER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 66));

    fn token(number: u32) -> TokenHash {
        TokenHash::of(&number.to_string())
    }

    #[test]
    fn delays_double_to_a_cap_for_the_guessing_address_alone_and_are_forgotten() {
        let start = Instant::now();
        let mut wrong = WrongTokens::default();
        let (mut now, mut delays) = (start, Vec::new());
        for guess in 0..14 {
            let wait = wrong.wait(ATTACKER, now);
            delays.push(wait.map_or(0, |wait| wait.as_secs()));
            now += wait.unwrap_or_default();
            wrong.count(ATTACKER, token(guess), now);
        }
        assert_eq!(delays, [0, 0, 0, 0, 0, 0, 1, 2, 4, 8, 16, 32, 60, 60]);
        let holder: IpAddr = [10, 0, 0, 7].into();
        assert_eq!(wrong.wait(holder, now), None);
        let mapped: IpAddr = "::ffff:10.0.0.66".parse().expect("an address");
        assert_eq!(wrong.wait(mapped, now), Some(MAX_DELAY));
        now += FORGET_AFTER;
        wrong.count(holder, token(0), now);
        assert_eq!(wrong.0.len(), 1);
    }

    #[test]
    fn guesses_in_a_day_are_few_and_a_repeated_token_is_no_guess() {
        let mut now = Instant::now();
        let end = now + Duration::from_secs(86_400);
        let mut wrong = WrongTokens::default();
        let mut guesses = 0;
        while now < end {
            wrong.count(ATTACKER, token(guesses), now);
            guesses += 1;
            now += wrong.wait(ATTACKER, now).unwrap_or_default();
        }
        assert!(guesses < 1_500, "{guesses}");
        let page: IpAddr = [10, 0, 0, 8].into();
        (0..1000).for_each(|again| wrong.count(page, token(again % 3), now));
        assert_eq!(wrong.wait(page, now), None);
    }

    #[test]
    fn the_table_is_bounded_and_an_ipv6_network_is_one_guesser() {
        let mut now = Instant::now();
        let mut wrong = WrongTokens::default();
        for number in 0..5000_u32 {
            now += Duration::from_micros(1);
            wrong.count(IpAddr::V4(number.into()), token(number), now);
            wrong.count(IpAddr::V6((0xfd00_u128 << 112 | u128::from(number)).into()), token(number), now);
        }
        assert_eq!(wrong.0.len(), MAX_ADDRESSES);
        assert_eq!(wrong.wait("fd00::1:2:3".parse().expect("an address"), now), Some(MAX_DELAY));
    }
}
