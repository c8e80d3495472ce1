//! Queue of commands to the manager: bounded, and paced.
//!
//! At most one command of a kind waits; a newer one takes its place (newest wins). However many commands pages send, a
//! scene restarts no more often than [`RESTART_INTERVAL`] allows, and after the last of them it is as the last of them says.

use super::command::{Command, Pace};
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

/// Shortest time between two restarts: a person sees none that is shorter, and a slider sends one at each frame.
pub(crate) const RESTART_INTERVAL: Duration = Duration::from_millis(100);

/// Shortest time between two status messages that pages ask for.
const STATUS_INTERVAL: Duration = Duration::from_millis(50);

/// Commands that wait, in the order of their arrival.
#[derive(Default)]
struct Waiting {
    commands: Vec<Command>,
    /// Time of the next restart.
    restart_at: Duration,
    /// Time of the next status message.
    status_at: Duration,
}

impl Waiting {
    fn push(&mut self, command: Command) {
        let older = self.commands.iter().position(|older| command.replaces(older));
        let command = match older {
            Some(index) => command.in_place_of(self.commands.remove(index)),
            None => command,
        };
        self.commands.push(command);
    }

    /// Earliest time of a command.
    fn due(&self, command: &Command) -> Duration {
        match command.pace() {
            Some(Pace::Restart) => self.restart_at,
            Some(Pace::Status) => self.status_at,
            None => Duration::ZERO,
        }
    }

    /// Time at which the next command is due.
    fn next_due(&self) -> Option<Duration> {
        self.commands.iter().map(|command| self.due(command)).min()
    }

    /// First command that is due.
    fn take(&mut self, now: Duration) -> Option<Command> {
        let index = self.commands.iter().position(|command| self.due(command) <= now)?;
        let command = self.commands.remove(index);
        match command.pace() {
            Some(Pace::Restart) => self.restart_at = now + RESTART_INTERVAL,
            Some(Pace::Status) => self.status_at = now + STATUS_INTERVAL,
            None => {}
        }
        Some(command)
    }
}

/// Queue between many senders and the manager.
pub(crate) struct CommandQueue {
    start: Instant,
    waiting: Mutex<Waiting>,
    arrived: Condvar,
}

impl CommandQueue {
    /// Empty queue.
    pub fn new() -> Self {
        Self { start: Instant::now(), waiting: Mutex::default(), arrived: Condvar::new() }
    }

    fn lock(&self) -> MutexGuard<'_, Waiting> {
        self.waiting.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a command.
    pub fn push(&self, command: Command) {
        self.lock().push(command);
        self.arrived.notify_one();
    }

    /// Next command, if one is due before `until`.
    pub(super) fn next(&self, until: Instant) -> Option<Command> {
        let mut waiting = self.lock();
        loop {
            let now = Instant::now();
            if let Some(command) = waiting.take(now - self.start) {
                return Some(command);
            }
            let due = waiting.next_due().map_or(until, |due| until.min(self.start + due));
            if due <= now && until <= now {
                return None;
            }
            let time = due.saturating_duration_since(now);
            waiting = self.arrived.wait_timeout(waiting, time).unwrap_or_else(PoisonError::into_inner).0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::protocol::PhysicsSettings;

    #[test]
    fn thousands_of_resets_are_a_few_restarts_and_the_last_one_is_executed() {
        let mut waiting = Waiting::default();
        let (mut executed, mut last) = (0, Duration::ZERO);
        // 300 resets a second from each of 32 pages, for ten seconds.
        for number in 0..96_000_u64 {
            let now = Duration::from_nanos(number * 104_167);
            waiting.push(Command::Reset);
            assert_eq!(waiting.commands.len(), 1);
            while let Some(command) = waiting.take(now) {
                assert!(matches!(command, Command::Reset));
                assert!(executed == 0 || now - last >= RESTART_INTERVAL, "{now:?} after {last:?}");
                (executed, last) = (executed + 1, now);
            }
        }
        assert!((95..=101).contains(&executed), "{executed} in 10 s");
        let due = waiting.next_due().expect("the last reset");
        assert!(matches!(waiting.take(due), Some(Command::Reset)) && waiting.commands.is_empty());
    }

    #[test]
    fn the_newest_of_each_kind_wins_in_the_order_of_arrival_and_settings_are_merged() {
        let mut waiting = Waiting::default();
        let settings = |gravity: Option<f64>, friction| {
            let gravity = gravity.map(|gravity| [0.0, gravity, 0.0]);
            Command::ChangePhysics(PhysicsSettings { gravity, friction, ..PhysicsSettings::default() })
        };
        waiting.push(settings(Some(-1.0), None));
        waiting.push(Command::Open("a".into(), 1));
        waiting.push(settings(None, Some(0.5)));
        waiting.push(Command::SendStatus);
        waiting.push(Command::Open("b".into(), 2));
        waiting.push(settings(Some(-2.0), None));
        let mut now = Duration::ZERO;
        let mut order = Vec::new();
        while let Some(due) = waiting.next_due() {
            now = now.max(due);
            order.extend(waiting.take(now));
        }
        let [Command::SendStatus, Command::Open(id, 2), Command::ChangePhysics(settings)] = &order[..] else {
            panic!("{} commands, or others", order.len())
        };
        assert_eq!(
            (id.as_str(), settings.gravity, settings.friction),
            ("b", Some([0.0, -2.0, 0.0]), Some(0.5))
        );
        assert_eq!(now, RESTART_INTERVAL);
    }

    #[test]
    fn the_end_of_a_scene_waits_for_no_pace() {
        let mut waiting = Waiting::default();
        waiting.push(Command::Reset);
        assert!(matches!(waiting.take(Duration::ZERO), Some(Command::Reset)));
        waiting.push(Command::Reset);
        waiting.push(Command::End);
        assert!(matches!(waiting.take(Duration::ZERO), Some(Command::End)));
    }
}
