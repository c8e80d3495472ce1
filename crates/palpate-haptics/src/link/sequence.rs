//! Filter for datagrams that arrive late, twice or out of order.

/// Sequence number of the newest message of a connection. Messages count from 1.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SequenceFilter {
    newest: u64,
}

impl SequenceFilter {
    /// Whether a message is newer than all before it. If so, it is the newest now.
    pub fn is_newer(&mut self, sequence: u64) -> bool {
        let newer = sequence > self.newest;
        self.newest = self.newest.max(sequence);
        newer
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{DeviceSpec, Hand, Mount, SimulatedDevice};
    use crate::link_messages::{effort, effort_bytes, motion, motion_bytes};
    use crate::{
        Columns, DevicePort, Effort, ForcePort, HapticUpdate, Motion, MotionPath, Safety, SafetyLimits, port,
    };
    use glam::DVec3;
    use palpate_testkit::Random;
    use std::collections::BTreeMap;

    /// Round-off of a force that is ramped [N].
    const CLAMPED_N: f64 = 1e-9;

    /// Wire in simulated time [ms] that loses, duplicates and delays datagrams.
    struct Wire {
        /// Datagrams by arrival time and order of sending.
        under_way: BTreeMap<(u64, u64), Vec<u8>>,
        sent: u64,
        random: Random,
        cut: bool,
    }

    impl Wire {
        fn new(seed: u64) -> Self {
            Self { under_way: BTreeMap::new(), sent: 0, random: Random::new(seed), cut: false }
        }

        /// A fifth is lost, a tenth comes twice, all are late by up to 12 ms each, so that they overtake one another.
        fn send(&mut self, tick: u64, bytes: &[u8]) {
            let lost = self.cut || self.random.chance(0.2);
            let copies = if lost { 0 } else { 1 + u64::from(self.random.chance(0.1)) };
            for _ in 0..copies {
                let arrival = tick + self.random.within(0.0, 12.0) as u64;
                self.sent += 1;
                self.under_way.insert((arrival, self.sent), bytes.to_vec());
            }
        }

        fn receive(&mut self, tick: u64) -> Vec<Vec<u8>> {
            let later = self.under_way.split_off(&(tick + 1, 0));
            std::mem::replace(&mut self.under_way, later).into_values().collect()
        }
    }

    /// Both ends of a link without QUIC: the receivers' filters, ports and clocks are those of client and server.
    struct Link {
        motions: Wire,
        efforts: Wire,
        /// Link's end of the haptic update's port, and of the force process's.
        device_side: ForcePort,
        force_side: DevicePort,
        motion_filter: SequenceFilter,
        effort_filter: SequenceFilter,
        dropped: u64,
        newest: (u64, u64),
    }

    impl Link {
        fn tick(&mut self, tick: u64) {
            let now_s = tick as f64 * 1e-3;
            let sent = self.device_side.newest();
            if sent.sequence > self.newest.0 {
                self.newest.0 = sent.sequence;
                self.motions.send(tick, &motion_bytes(&sent));
            }
            for bytes in self.motions.receive(tick) {
                let received = motion(&bytes, now_s).expect("a motion");
                if self.motion_filter.is_newer(received.sequence) {
                    self.force_side.send(received);
                } else {
                    self.dropped += 1;
                }
            }
            let sent = self.force_side.newest();
            if sent.sequence > self.newest.1 {
                self.newest.1 = sent.sequence;
                self.efforts.send(tick, &effort_bytes(&sent));
            }
            for bytes in self.efforts.receive(tick) {
                let received = effort(&bytes, now_s).expect("an effort");
                if self.effort_filter.is_newer(received.sequence) {
                    self.device_side.send(received);
                } else {
                    self.dropped += 1;
                }
            }
        }
    }

    #[test]
    fn a_bad_link_passes_only_newer_messages_and_a_cut_one_takes_the_force_away_in_40_ms() {
        /// Beginning of the cut [ms].
        const CUT_AT: u64 = 3000;
        let (device_port, device_side) = port();
        let (force_side, mut force_port) = port();
        let mut link = Link {
            motions: Wire::new(1),
            efforts: Wire::new(2),
            device_side,
            force_side,
            motion_filter: SequenceFilter::default(),
            effort_filter: SequenceFilter::default(),
            dropped: 0,
            newest: (0, 0),
        };
        let path = MotionPath::parse("0,0.01,0,0\n", Columns::Position).expect("a path");
        let spec = DeviceSpec { resolution_m: 0.0, ..DeviceSpec::TOUCH };
        let device = Box::new(SimulatedDevice::new(spec, Hand::FIRM, path));
        let limits = SafetyLimits { ramp_up_s: 0.05, recovery_s: 0.05, ..SafetyLimits::default() };
        let mut update =
            HapticUpdate::new(device, device_port, Mount::default(), Safety::new(limits), None, false);

        let (mut last_motion, mut gone_at) = (Motion::default(), None);
        for tick in 1..=6000_u64 {
            let now_s = tick as f64 * 1e-3;
            // A cut of 400 ms in the middle.
            let cut = (CUT_AT..CUT_AT + 400).contains(&tick);
            (link.motions.cut, link.efforts.cut) = (cut, cut);
            update.cycle(now_s);
            link.tick(tick);
            let received = force_port.newest();
            assert!(received.sequence >= last_motion.sequence, "{tick}: never an older one");
            last_motion = received;
            let force = DVec3::X * 0.5;
            let absorbed_j = 0.0;
            force_port.send(Effort {
                sequence: tick,
                in_reply_to: received.sequence,
                time_s: now_s,
                force,
                absorbed_j,
            });
            if cut && gone_at.is_none() && update.held_force() == DVec3::ZERO {
                gone_at = Some(tick);
            }
            if cut && gone_at.is_some() {
                assert_eq!(update.held_force(), DVec3::ZERO, "{tick}: nothing while the link is cut");
            }
        }
        // Under way for up to 12 ms, then the watchdog's 20 ms and 20 ms of ramp.
        let took = gone_at.expect("it goes") - CUT_AT;
        assert!((20..=12 + 40 + 1).contains(&took), "{took} ms");
        assert_eq!(update.held_force().x, 0.5, "and it comes back by itself");
        assert!(link.dropped > 500, "{} late or doubled messages", link.dropped);
        let safety = update.counts().safety;
        assert!(safety.trips >= 1 && update.counts().force_max_n <= 0.5 + CLAMPED_N, "{safety:?}");
    }
}
