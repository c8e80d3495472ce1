//! A simulated device in a simulated hand, which closes the loop: what it is pushed with moves it.
//!
//! ```text
//! (m_device + m_hand)·ẍ = F + k·(x_wanted(t) − x) − (b_hand + b_device)·ẋ − friction
//! ```
//!
//! F is held from one push to the next, as the amplifiers of a device do, and limited as they are. The position is read in
//! whole steps of the encoder. Integrated by the implicit rule with Coulomb friction as an impulse that can only stop.

use super::{Device, Reading, Traits};
use crate::error::Error;
use crate::motion_path::MotionPath;
use glam::DVec3;

/// Integration step [s].
const STEP_S: f64 = 20e-6;

/// A longer time [s] than this between two calls is not simulated: the process was stopped.
const LONGEST_S: f64 = 1.0;

/// The hand that holds a device: a mass on a spring and a damper to where it wants to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// [kg]
    pub mass_kg: f64,
    /// [N/m]
    pub stiffness_n_m: f64,
    /// [N·s/m]
    pub damping_n_s_m: f64,
}

impl Hand {
    /// A grip as one holds a pen that should stay where it is.
    pub const FIRM: Self = Self { mass_kg: 0.15, stiffness_n_m: 500.0, damping_n_s_m: 5.0 };
    /// A grip as one holds a pen that may go.
    pub const LIGHT: Self = Self { mass_kg: 0.05, stiffness_n_m: 100.0, damping_n_s_m: 0.5 };
    /// Hardly a finger: it leans on the device, and damps nothing. The worst case for stability.
    pub const FINGERTIP: Self = Self { mass_kg: 0.0, stiffness_n_m: 20.0, damping_n_s_m: 0.0 };
}

/// A simulated device in a simulated hand.
pub struct Simulated {
    traits: Traits,
    hand: Hand,
    wanted: MotionPath,
    time_s: f64,
    position: DVec3,
    velocity: DVec3,
    force: DVec3,
    /// Work [J] of the device on the hand and the handle.
    given: f64,
}

impl Simulated {
    /// The hand wants to be where the path is, and begins there, at rest.
    pub fn new(traits: Traits, hand: Hand, wanted: MotionPath) -> Self {
        let position = wanted.at(0.0).position;
        Self {
            traits,
            hand,
            wanted,
            time_s: 0.0,
            position,
            velocity: DVec3::ZERO,
            force: DVec3::ZERO,
            given: 0.0,
        }
    }

    /// Where the handle really is [m, device frame].
    pub fn position(&self) -> DVec3 {
        self.position
    }

    /// Work [J] that the device has done on the hand since the start.
    pub fn given_j(&self) -> f64 {
        self.given
    }

    fn advance(&mut self, dt: f64) {
        let Self { hand, traits, .. } = *self;
        let mass = traits.mass_kg + hand.mass_kg;
        let wanted = self.wanted.at(self.time_s + dt).position;
        let damping = hand.damping_n_s_m + traits.damping_n_s_m;
        let pull = self.force + (wanted - self.position) * hand.stiffness_n_m;
        let effective = mass + dt * damping + dt * dt * hand.stiffness_n_m;
        let free = (self.velocity * mass + pull * dt) / effective;
        // Friction takes away at most all of it.
        let speed = free.length();
        let kept =
            if speed > 0.0 { (1.0 - dt * traits.friction_n / (effective * speed)).max(0.0) } else { 0.0 };
        self.velocity = free * kept;
        let moved = self.velocity * dt;
        self.position += moved;
        self.given += self.force.dot(moved);
        self.time_s += dt;
    }
}

impl Device for Simulated {
    fn traits(&self) -> Traits {
        self.traits
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        self.time_s = self.time_s.max(now_s - LONGEST_S);
        let steps = ((now_s - self.time_s) / STEP_S).ceil().max(0.0);
        let dt = (now_s - self.time_s) / steps;
        (0..steps as u64).for_each(|_| self.advance(dt));
        let resolution = self.traits.resolution_m;
        let position =
            if resolution > 0.0 { (self.position / resolution).round() * resolution } else { self.position };
        Ok(Reading { position, orientation: None, buttons: 0 })
    }

    fn push(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        self.force = force.clamp_length_max(self.traits.force_n);
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
        let traits = Traits { friction_n: 0.2, ..Traits::TOUCH };
        let mut device = Simulated::new(traits, Hand::FIRM, still());
        device.push(DVec3::X * 0.19, 0.0).expect("it is there");
        assert_eq!(device.read(1.0).expect("it reads").position, DVec3::ZERO, "friction holds it");
        device.push(DVec3::X * 100.0, 1.0).expect("it is there");
        let position = device.read(3.0).expect("it reads").position.x;
        // The amplifier gives 3.3 N, of which friction may hold 0.2 N, in steps of the encoder.
        let (least, most) = ((3.3 - 0.2) / 500.0, (3.3 + 0.2) / 500.0);
        assert!(position > least - 55e-6 && position < most + 55e-6, "{position}");
        assert!((position / 55e-6 - (position / 55e-6).round()).abs() < 1e-9);
    }

    #[test]
    fn without_losses_it_swings_at_its_own_frequency_and_keeps_its_energy() {
        let traits = Traits { friction_n: 0.0, damping_n_s_m: 0.0, resolution_m: 0.0, ..Traits::TOUCH };
        let hand = Hand { damping_n_s_m: 0.0, mass_kg: 0.055, stiffness_n_m: 100.0 };
        let mut device = Simulated::new(traits, hand, still());
        device.push(DVec3::Y, 0.0).expect("it is there");
        // About F/k, with ω = √(k/m): back at 0 after a whole turn.
        let period = std::f64::consts::TAU * (0.1_f64 / 100.0).sqrt();
        let half = device.read(0.5 * period).expect("it reads").position.y;
        assert!((half - 0.02).abs() < 1e-4, "{half}");
        assert!((device.given_j() - 0.02).abs() < 1e-4);
        assert!(device.read(period).expect("it reads").position.y.abs() < 3e-4);
    }
}
