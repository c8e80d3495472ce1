//! The energy of a device's port: observed, and never negative.
//!
//! A force is held while the hand goes on, and answers a position that is old: so a port makes energy, the more the
//! stiffer, the slower and the later. The observer counts what the hand has given, −Σ F·Δx with the force that was really
//! held, less what the scene has taken in by its own ledger ([`crate::Effort::taken_j`]), both up to the same motion of the hand, so
//! that nothing that is under way counts. What the virtual coupling's damper takes is not counted as taken: it pays for
//! what the port makes.
//!
//! ```text
//! balance = Σ −F·Δx − Σ s·Δtaken        n = (Σ Δtaken − Σ −F_wanted·Δx) / Σ Δx²/Δt        F = s·F_wanted − b·ẋ
//! ```
//!
//! Where the balance goes below zero the controller damps the hand, by what it has seen the port make: n [N·s/m] is the negative
//! damping of the last moments, and with b of its size nothing is made any more. A device bears only so much damping of
//! what is known late of its movement. If the port makes more, its force is given with a share s < 1 of its
//! stiffness, for which that damping is enough (after Hannaford & Ryu 2002, IEEE Trans. Robot. Autom. 18, 1, with the ledger in the
//! place of their estimate, as in Ryu et al. 2005, "energy reference following", IEEE Trans. Robot. 21, 750).

use crate::port::Effort;
use glam::DVec3;

/// Energy [J] that is kept for later, at most: what was lost long ago pays for nothing.
const MOST_KEPT: f64 = 1e-3;

/// Time [s] over which the hand's movement is smoothed where the encoder tells of slow movements in jumps of
/// [`COARSE_M`]; less for finer ones.
const SMOOTH_S: f64 = 4e-3;
const COARSE_M: f64 = 50e-6;

/// Of the time in which the damper would stop the mass, the share that may be known late.
const BORNE: f64 = 0.25;

/// Damping that makes up for what comes late is by so much less effective.
const EFFECTIVE: f64 = 0.5;

/// Time [s] over which the port's damping is looked at.
const MEMORY_S: f64 = 0.05;

/// Time [s] in which what is missing is to be taken back.
const TAKE_BACK_S: f64 = 0.02;

/// A share of the energy that goes to and fro which may be missing before all is done about it.
const UNFELT: f64 = 0.01;

/// Times [s] over which the share of the force goes down, and up again.
const SOFTER_S: f64 = 1e-3;
const STIFFER_S: f64 = 1.0;

/// Motions that are remembered: a second at 1 kHz. A motion that is answered later counts as the oldest of them.
const REMEMBERED: usize = 1024;

/// What had happened with a motion, since the start.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    /// What the hand had given [J], by the force that was held and by the one that was wanted.
    given: f64,
    wanted: f64,
    /// Σ Δx²/Δt [m²/s].
    moved: f64,
    /// The share of the force that was given.
    share: f64,
}

/// Observer and controller of one device's port.
#[derive(Debug, Clone)]
pub struct PassivityController {
    /// Most damping [N·s/m] that the device bears with what is known late of its movement.
    most_damping: f64,
    /// Movement [m] below which its direction is not known, and the time [s] over which it is smoothed.
    resolution: f64,
    smooth_s: f64,
    /// Smoothed velocity [m/s].
    velocity: DVec3,
    /// What had happened with each motion, by its sequence; and now.
    told: Box<[Told]>,
    now: Told,
    /// The motion that was answered last, and what was taken then [J].
    answered: Option<(u64, f64)>,
    /// Of the last moments: energy made [J], gone to and fro [J], Σ Δx²/Δt [m²/s].
    made: f64,
    flow: f64,
    moved: f64,
    balance: f64,
    last: Option<DVec3>,
    wanted: DVec3,
    held: DVec3,
    /// What the controller added [N].
    added: DVec3,
    share: f64,
    /// What was taken when there was no force last [J].
    unloaded: f64,
    /// Updates in which it acted, and the most that was ever missing [J].
    acted: u64,
    worst: f64,
}

impl PassivityController {
    /// Of a device with an effective mass [kg] and a resolution [m], updated every `dt_s` [s].
    pub fn new(mass_kg: f64, resolution_m: f64, dt_s: f64) -> Self {
        let smooth_s = SMOOTH_S * (resolution_m / COARSE_M).clamp(0.0, 1.0).sqrt();
        Self {
            most_damping: BORNE * mass_kg / (smooth_s + 2.0 * dt_s),
            resolution: resolution_m,
            smooth_s,
            velocity: DVec3::ZERO,
            told: vec![Told::default(); REMEMBERED].into_boxed_slice(),
            now: Told { share: 1.0, ..Told::default() },
            answered: None,
            made: 0.0,
            flow: 0.0,
            moved: 0.0,
            balance: 0.0,
            last: None,
            wanted: DVec3::ZERO,
            held: DVec3::ZERO,
            added: DVec3::ZERO,
            share: 1.0,
            unloaded: 0.0,
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

    /// The share of the force that is given: below 1 where damping alone is not enough.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// Observe: the hand is at a place [m] with its motion number `sequence`, and this is the newest effort. Gives the force [N]
    /// in the place of the one that is wanted; `dt_s` [s] have passed since the last time.
    ///
    /// # Real time
    pub fn control(&mut self, sequence: u64, position: DVec3, effort: &Effort, dt_s: f64) -> DVec3 {
        let wanted = effort.force;
        let moved = self.last.map_or(DVec3::ZERO, |last| position - last);
        if !moved.is_finite() {
            return wanted;
        }
        self.last = Some(position);
        self.now.given -= self.held.dot(moved);
        self.now.wanted -= self.wanted.dot(moved);
        if dt_s > 0.0 {
            self.now.moved += moved.length_squared() / dt_s;
        }
        self.told[place(sequence)] = self.now;
        self.observe(sequence, effort, dt_s);
        self.wanted = if wanted.is_finite() { wanted } else { DVec3::ZERO };
        self.added = DVec3::ZERO;
        if dt_s <= 0.0 || !wanted.is_finite() {
            return wanted;
        }
        self.velocity += (moved / dt_s - self.velocity) * (dt_s / (self.smooth_s + dt_s));
        let missing = (-self.balance).max(0.0);
        let urgent = if missing > 0.0 { missing / (missing + UNFELT * self.flow) } else { 0.0 };
        let made = if self.moved > 0.0 { (self.made / self.moved).max(0.0) } else { 0.0 };

        // What it makes beyond what damping can take is not given.
        let bearable = if made > 0.0 { (EFFECTIVE * self.most_damping / made).min(1.0) } else { 1.0 };
        let share = 1.0 - urgent * (1.0 - bearable);
        if wanted == DVec3::ZERO {
            // Nothing is stored that a stiffer force would give back.
            (self.unloaded, self.share) = (effort.taken_j, 1.0);
        }
        if share < self.share {
            self.share += (share - self.share) * (dt_s / (SOFTER_S + dt_s));
        } else {
            // A spring that is loaded takes energy to become stiffer: as far as there is some.
            let stored = (effort.taken_j - self.unloaded).max(0.0);
            let affordable = if stored > 0.0 { self.balance.max(0.0) / stored } else { 1.0 };
            let change = ((share - self.share) * (dt_s / (STIFFER_S + dt_s))).min(affordable);
            self.share += change;
            self.balance -= change * stored;
        }
        if 1.0 - self.share < 1e-6 {
            self.share = 1.0;
        }
        // Slower than a step of the encoder in a tenth of a second is standing still.
        let speed = self.velocity.length();
        if missing > 0.0 && wanted != DVec3::ZERO && speed > self.resolution / 0.1 {
            let mean_square = self.moved / MEMORY_S;
            let back = if mean_square > 0.0 { missing / (TAKE_BACK_S * mean_square) } else { 0.0 };
            let damping = (urgent * self.share * made / EFFECTIVE + back).min(self.most_damping);
            self.added = -self.velocity * damping;
        }
        self.acted += u64::from(self.added != DVec3::ZERO || self.share < 1.0);
        wanted * self.share + self.added
    }

    /// What has been answered since: balance, and what the port made.
    fn observe(&mut self, sequence: u64, effort: &Effort, dt_s: f64) {
        let oldest = (sequence + 1).saturating_sub(REMEMBERED as u64).max(1);
        if effort.answers == 0 || effort.answers > sequence || !effort.taken_j.is_finite() {
            return;
        }
        let answers = effort.answers.max(oldest);
        let Some((before, taken)) = self.answered.replace((answers, effort.taken_j)) else { return };
        let before = before.max(oldest);
        if answers <= before {
            return;
        }
        let [old, new] = [before, answers].map(|at| self.told[place(at)]);
        let taken = effort.taken_j - taken;
        let balance = self.balance + (new.given - old.given) - old.share * taken;
        self.balance = balance.min(MOST_KEPT);
        self.worst = self.worst.max(-self.balance);
        let forget = 1.0 - ((answers - before) as f64 * dt_s / MEMORY_S).clamp(0.0, 1.0);
        let wanted = new.wanted - old.wanted;
        if taken == 0.0 && wanted == 0.0 {
            // Out of contact nothing is learned, and nothing forgotten.
            return;
        }
        self.made = self.made * forget + (taken - wanted);
        self.flow = self.flow * forget + taken.abs() + wanted.abs();
        self.moved = self.moved * forget + (new.moved - old.moved);
    }

    /// What was really held from now on [N], after all limits.
    ///
    /// # Real time
    pub fn hold(&mut self, force: DVec3) {
        self.held = force;
        let square = self.wanted.length_squared();
        let share = (force - self.added).dot(self.wanted) / square;
        self.now.share = if square > 0.0 { share.clamp(0.0, 1.0) } else { self.share };
    }
}

fn place(sequence: u64) -> usize {
    (sequence % REMEMBERED as u64) as usize
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
            assert!(without > 10.0, "{delay}: {without}");
            assert!(with < 1e-5, "{delay}: {with}");
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
