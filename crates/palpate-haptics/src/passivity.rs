//! The energy of a device's port: observed, and never negative.
//!
//! A force is held while the hand goes on, and answers a position that is old: so a port makes energy, the more the
//! stiffer, the slower and the later. The observer counts what the hand has given, −Σ F·Δx with the force that was really
//! held, less what the scene has taken in by its own ledger ([`crate::Effort::taken_j`]), both up to the same motion of the hand, so
//! that nothing that is under way counts. What the virtual coupling's damper takes is not counted as taken: it pays for
//! what the port makes. Where the balance goes below zero, the controller takes what is missing by damping, and gives back
//! less than is wanted (after Hannaford & Ryu 2002, IEEE Trans. Robot. Autom. 18, 1, with the ledger in the place of their
//! estimate).

use crate::port::Effort;
use glam::DVec3;

/// Energy [J] that is kept for later, at most: what was lost long ago pays for nothing.
const MOST_KEPT: f64 = 1e-3;

/// Time [s] over which the hand's movement is smoothed: encoders tell of slow movements in jumps.
const SMOOTH_S: f64 = 4e-3;

/// Motions that are remembered: a second at 1 kHz. A motion that is answered later counts as the oldest of them.
const REMEMBERED: usize = 1024;

/// Observer and controller of one device's port.
#[derive(Debug, Clone)]
pub struct PassivityController {
    /// Most damping [N·s/m] that the device bears with what is known late of its movement.
    most_damping: f64,
    /// Movement [m] below which its direction is not known.
    resolution: f64,
    /// Smoothed movement of an update [m]: what the hand is likely to do next.
    likely: DVec3,
    /// What the hand had given [J] with each motion, by its sequence; and what it has given now.
    given: Box<[f64]>,
    given_now: f64,
    /// What was lost and does not pay any more [J]; none before the first answer, from which it counts.
    written_off: Option<f64>,
    balance: f64,
    last: Option<DVec3>,
    held: DVec3,
    /// Updates in which it acted, and the most that was ever missing [J].
    acted: u64,
    worst: f64,
}

impl PassivityController {
    /// Of a device with an effective mass [kg] and a resolution [m], updated every `dt_s` [s].
    pub fn new(mass_kg: f64, resolution_m: f64, dt_s: f64) -> Self {
        Self {
            // The time m/b in which the damper stops the mass is long against what it knows late.
            most_damping: 0.25 * mass_kg / (SMOOTH_S + 2.0 * dt_s),
            resolution: resolution_m,
            likely: DVec3::ZERO,
            given: vec![0.0; REMEMBERED].into_boxed_slice(),
            given_now: 0.0,
            written_off: None,
            balance: 0.0,
            last: None,
            held: DVec3::ZERO,
            acted: 0,
            worst: 0.0,
        }
    }

    /// Updates in which it changed the force.
    pub fn acted(&self) -> u64 {
        self.acted
    }

    /// The most energy [J] that was missing at once.
    pub fn worst_j(&self) -> f64 {
        self.worst
    }

    /// Energy [J] that the hand has given and the scene has not taken, as far as answers tell.
    pub fn balance_j(&self) -> f64 {
        self.balance
    }

    /// Observe: the hand is at a place [m] with its motion number `sequence`, and this is the newest effort. Gives the force [N]
    /// in the place of the one that is wanted; `dt_s` [s] have passed since the last time.
    ///
    /// # Real time
    pub fn control(&mut self, sequence: u64, position: DVec3, effort: &Effort, dt_s: f64) -> DVec3 {
        let wanted = effort.force;
        let place = |sequence: u64| (sequence % REMEMBERED as u64) as usize;
        let moved = self.last.map_or(DVec3::ZERO, |last| position - last);
        if !moved.is_finite() {
            return wanted;
        }
        self.last = Some(position);
        self.given_now -= self.held.dot(moved);
        self.given[place(sequence)] = self.given_now;
        if effort.answers > 0 && effort.answers <= sequence && effort.taken_j.is_finite() {
            let answered = effort.answers.max((sequence + 1).saturating_sub(REMEMBERED as u64));
            let kept = self.given[place(answered)] - effort.taken_j;
            let written_off = self.written_off.get_or_insert(kept);
            let balance = kept - *written_off;
            self.balance = balance.min(MOST_KEPT);
            *written_off += balance - self.balance;
            self.worst = self.worst.max(-self.balance);
        }
        if dt_s <= 0.0 || !wanted.is_finite() {
            return wanted;
        }
        self.likely += (moved - self.likely) * (dt_s / (SMOOTH_S + dt_s));
        let way = self.likely.length();
        // Slower than a step of the encoder in a tenth of a second is standing still.
        if self.balance >= 0.0 || way <= self.resolution * dt_s / 0.1 {
            return wanted;
        }
        self.acted += 1;
        let missing = -self.balance;
        let damping = (missing * dt_s / (way * way)).min(self.most_damping);
        let gives = wanted.dot(self.likely).max(0.0);
        let kept_back = gives * missing / (missing + MOST_KEPT);
        wanted - self.likely * (kept_back / (way * way) + damping / dt_s)
    }

    /// What was really held from now on [N], after all limits.
    ///
    /// # Real time
    pub fn hold(&mut self, force: DVec3) {
        self.held = force;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A mass that bounces on a stiff spring behind a port with a delay of some updates: energy [J] that it has gained.
    fn gain(controlled: bool, delay: usize) -> f64 {
        let (mass, stiffness, dt) = (0.1, 4000.0, 1e-3);
        let mut controller = PassivityController::new(mass, 0.0, dt);
        let (mut x, mut v) = (0.0_f64, 0.5_f64);
        let mut line = vec![(0.0, 0.0); delay + 1];
        let start = 0.5 * mass * v * v;
        let mut most = 0.0_f64;
        for k in 0..4000_u64 {
            // A wall on each side: penetration, and the energy that it holds.
            let deep = x.signum() * (x.abs() - 0.01).max(0.0);
            line.rotate_right(1);
            line[0] = (-stiffness * deep, 0.5 * stiffness * deep * deep);
            let (wanted, taken) = line[delay.min(k as usize)];
            let position = DVec3::X * x;
            let force = if controlled {
                let answers = (k + 1).saturating_sub(delay as u64);
                let effort =
                    Effort { sequence: k, answers, time_s: 0.0, force: DVec3::X * wanted, taken_j: taken };
                let force = controller.control(k + 1, position, &effort, dt);
                controller.hold(force);
                force.x
            } else {
                wanted
            };
            v += force / mass * dt;
            x += v * dt;
            if deep == 0.0 {
                most = most.max(0.5 * mass * v * v - start);
            }
        }
        most
    }

    #[test]
    fn a_port_that_makes_energy_gives_none_with_the_controller() {
        for delay in [1, 3, 10] {
            let (without, with) = (gain(false, delay), gain(true, delay));
            assert!(without > 0.05, "{delay}: {without}");
            assert!(with < 2e-3, "{delay}: {with}");
        }
    }

    #[test]
    fn a_passive_port_is_left_alone() {
        // A damper that answers at once: the hand gives more than is taken.
        let mut controller = PassivityController::new(0.1, 0.0, 1e-3);
        let mut taken = 0.0;
        let mut force = DVec3::ZERO;
        for k in 0..1000_u32 {
            let position = DVec3::X * 0.01 * (f64::from(k) * 0.02).sin();
            let next = DVec3::X * 0.01 * (f64::from(k + 1) * 0.02).sin();
            let wanted = (position - next) * 5.0;
            let sequence = u64::from(k) + 1;
            let effort = Effort { sequence, answers: sequence, time_s: 0.0, force: wanted, taken_j: taken };
            force = controller.control(sequence, position, &effort, 1e-3);
            assert_eq!(force, wanted);
            controller.hold(force);
            taken += 0.9 * -force.dot(next - position);
        }
        assert!(controller.acted() == 0 && controller.balance_j() > 0.0, "{force}");
    }
}
