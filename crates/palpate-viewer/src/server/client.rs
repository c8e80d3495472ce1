//! Client of a connection, and the share of the connections that it has.

use std::collections::HashMap;
use std::net::IpAddr;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::OwnedSemaphorePermit;

/// Client of a request, with the place that its connection takes.
#[derive(Clone)]
pub(super) struct Client {
    pub address: IpAddr,
    /// Given back when the connection has ended, and the session on it.
    pub place: Arc<Place>,
}

/// Place of a connection.
pub(super) struct Place {
    /// Among all.
    pub _permit: OwnedSemaphorePermit,
    /// Among those of the client's network.
    pub _share: Share,
}

/// Network that stands for a client: whoever has an IPv6 address has its /64.
pub(super) fn network(address: IpAddr) -> IpAddr {
    match address.to_canonical() {
        IpAddr::V6(address) => IpAddr::V6((address.to_bits() >> 64 << 64).into()),
        address => address,
    }
}

/// Connections of each network.
#[derive(Default)]
pub(super) struct Shares(Mutex<HashMap<IpAddr, usize>>);

/// One connection of a network, counted until dropped.
pub(super) struct Share {
    shares: Arc<Shares>,
    network: IpAddr,
}

impl Shares {
    /// Counts a connection, if its network has fewer than `most`.
    pub fn take(self: &Arc<Self>, address: IpAddr, most: usize) -> Option<Share> {
        let network = network(address);
        let mut counts = self.lock();
        let count = counts.entry(network).or_default();
        if *count >= most {
            return None;
        }
        *count += 1;
        Some(Share { shares: self.clone(), network })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<IpAddr, usize>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Share {
    fn drop(&mut self) {
        let mut counts = self.shares.lock();
        if let Some(count) = counts.get_mut(&self.network) {
            *count -= 1;
            if *count == 0 {
                counts.remove(&self.network);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_network_takes_its_share_and_leaves_the_rest_to_others() {
        let shares = Arc::new(Shares::default());
        let attacker = |number: u16| IpAddr::V6([0xfd00, 0, 0, 0, 0, 0, 0, number].into());
        let mut taken: Vec<_> = (0..300).filter_map(|number| shares.take(attacker(number), 128)).collect();
        assert_eq!(taken.len(), 128);
        let holder = IpAddr::V4([10, 0, 0, 7].into());
        assert!(shares.take(holder, 128).is_some() && shares.take(attacker(0), 128).is_none());
        taken.pop();
        assert!(shares.take(attacker(0), 128).is_some());
        drop(taken);
        assert!(shares.lock().is_empty(), "an address that has left is not kept");
    }
}
