//! Simulated device in a simulated hand, which closes the haptic loop.
//!
//! ```text
//! (m_device + m_hand)·ẍ = F + k·(x_target(t) − x) − (b_hand + b_device)·ẋ − friction
//! ```
//!
//! F [N] is held from one command to the next (zero-order hold), and limited. The position x [m] is read in whole steps of the
//! encoder. Time integration: implicit Euler, with Coulomb friction as an impulse that at most stops the motion.

use super::{Device, DeviceSpec, Reading};
use crate::error::Error;
use crate::motion_path::MotionPath;
use glam::DVec3;

/// Integration step [s].
const STEP_S: f64 = 20e-6;

/// Longest time between two readings that is simulated [s]: beyond it the process was stopped.
const LONGEST_S: f64 = 1.0;

/// Hand that holds a device: a mass on a spring and a damper to its target position.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// Mass [kg].
    pub mass_kg: f64,
    /// Stiffness [N/m].
    pub stiffness_n_m: f64,
    /// Damping [N·s/m].
    pub damping_n_s_m: f64,
}

impl Hand {
    /// Firm grip, as of a pen that should stay where it is.
    pub const FIRM: Self = Self { mass_kg: 0.15, stiffness_n_m: 500.0, damping_n_s_m: 5.0 };
    /// Light grip, as of a pen that may move.
    pub const LIGHT: Self = Self { mass_kg: 0.05, stiffness_n_m: 100.0, damping_n_s_m: 0.5 };
    /// Fingertip that leans on the device without damping it: the worst case for stability.
    pub const FINGERTIP: Self = Self { mass_kg: 0.0, stiffness_n_m: 20.0, damping_n_s_m: 0.0 };
}

/// Simulated device in a simulated hand.
pub struct SimulatedDevice {
    spec: DeviceSpec,
    hand: Hand,
    target: MotionPath,
    time_s: f64,
    position: DVec3,
    velocity: DVec3,
    force: DVec3,
    /// Work of the device on hand and handle [J].
    work_on_hand: f64,
}

impl SimulatedDevice {
    /// Device in a hand whose target follows a path, initially at rest at the target.
    pub fn new(spec: DeviceSpec, hand: Hand, target: MotionPath) -> Self {
        let position = target.at(0.0).position;
        Self {
            spec,
            hand,
            target,
            time_s: 0.0,
            position,
            velocity: DVec3::ZERO,
            force: DVec3::ZERO,
            work_on_hand: 0.0,
        }
    }

    /// Exact position of the handle [m, device frame], without encoder steps.
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Work of the device on the hand since the start [J].
    pub fn work_on_hand_j(&self) -> f64 {
        self.work_on_hand
    }

    fn advance(&mut self, dt: f64) {
        let Self { hand, spec, .. } = *self;
        let mass = spec.mass_kg + hand.mass_kg;
        let target = self.target.at(self.time_s + dt).position;
        let damping = hand.damping_n_s_m + spec.damping_n_s_m;
        let pull = self.force + (target - self.position) * hand.stiffness_n_m;
        let effective = mass + dt * damping + dt * dt * hand.stiffness_n_m;
        let free = (self.velocity * mass + pull * dt) / effective;
        // Friction takes away at most all of the velocity.
        let speed = free.length();
        let kept =
            if speed > 0.0 { (1.0 - dt * spec.friction_n / (effective * speed)).max(0.0) } else { 0.0 };
        self.velocity = free * kept;
        let moved = self.velocity * dt;
        self.position += moved;
        self.work_on_hand += self.force.dot(moved);
        self.time_s += dt;
    }
}

impl Device for SimulatedDevice {
    fn spec(&self) -> DeviceSpec {
        self.spec
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        self.time_s = self.time_s.max(now_s - LONGEST_S);
        let steps = ((now_s - self.time_s) / STEP_S).ceil().max(0.0);
        let dt = (now_s - self.time_s) / steps;
        (0..steps as u64).for_each(|_| self.advance(dt));
        let resolution = self.spec.resolution_m;
        let position =
            if resolution > 0.0 { (self.position / resolution).round() * resolution } else { self.position };
        Ok(Reading { position, orientation: None, buttons: 0 })
    }

    fn set_force(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        self.force = force.clamp_length_max(self.spec.force_n);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion_path::Columns;

    fn still() -> MotionPath {
        MotionPath::parse("0,0,0,0\n", Columns::Position).expect("a path")
    }

    #[test]
    fn a_push_moves_the_hand_by_its_stiffness_and_friction() {
        let spec = DeviceSpec { friction_n: 0.2, ..DeviceSpec::TOUCH };
        let mut device = SimulatedDevice::new(spec, Hand::FIRM, still());
        device.set_force(DVec3::X * 0.19, 0.0).expect("it is there");
        assert_eq!(device.read(1.0).expect("it reads").position, DVec3::ZERO, "friction holds it");
        device.set_force(DVec3::X * 100.0, 1.0).expect("it is there");
        let position = device.read(3.0).expect("it reads").position.x;
        // The amplifier gives 3.3 N, of which friction may hold 0.2 N, in steps of the encoder.
        let (least, most) = ((3.3 - 0.2) / 500.0, (3.3 + 0.2) / 500.0);
        assert!(position > least - 55e-6 && position < most + 55e-6, "{position}");
        assert!((position / 55e-6 - (position / 55e-6).round()).abs() < 1e-9);
    }

    #[test]
    fn without_losses_it_swings_at_its_own_frequency_and_keeps_its_energy() {
        let spec = DeviceSpec { friction_n: 0.0, damping_n_s_m: 0.0, resolution_m: 0.0, ..DeviceSpec::TOUCH };
        let hand = Hand { damping_n_s_m: 0.0, mass_kg: 0.055, stiffness_n_m: 100.0 };
        let mut device = SimulatedDevice::new(spec, hand, still());
        device.set_force(DVec3::Y, 0.0).expect("it is there");
        // About F/k, with ω = √(k/m): back at 0 after a whole turn.
        let period = std::f64::consts::TAU * (0.1_f64 / 100.0).sqrt();
        let half = device.read(0.5 * period).expect("it reads").position.y;
        assert!((half - 0.02).abs() < 1e-4, "{half}");
        assert!((device.work_on_hand_j() - 0.02).abs() < 1e-4);
        assert!(device.read(period).expect("it reads").position.y.abs() < 3e-4);
    }
}
