//! The energy of a device's port: observed, and never negative.
//!
//! A force is held while the hand goes on, and answers a position that is old: so a port makes energy, the more the
//! stiffer, the slower and the later. Two things are done about it.
//!
//! **A guard** never gives out what did not come in. What the hand has given, −Σ F·Δx with the force that was really held,
//! less what the scene gave out by its own ledger ([`crate::Effort::taken_j`], where it is below 0: another hand's energy), is what is
//! left. A force that gives it back is scaled so that it takes no more than a share Δt/T of it in an update, T being how
//! late the hand's movement is known: what is left falls off, and does not go below 0, also in the first swing.
//!
//! ```text
//! left = Σ −F·Δx − min(0, taken)        F ← F·min(1, left / (F·ẋ·T))
//! ```
//!
//! **Damping** takes away what swings. From the same numbers it is learned how much negative damping the port has, n [N·s/m]: the scene
//! takes in more than the force that was wanted has given. A coupling's damper is not counted as taken: it pays for what
//! the port makes, and a coupling within its bound shows no n. The hand is damped by it. A device bears only so much
//! damping of a movement that is known late; beyond that the force is given with a share s < 1 of its stiffness. Also where the
//! guard has to act the share goes down, until it need not. n is kept while there is contact, so nothing hunts.
//!
//! ```text
//! n = (Σ Δtaken − Σ −F_wanted·Δx − noise) / Σ ẋ²·Δt        F = s·F_wanted − s·n·ẋ/η        s = min(1, η·b/n)
//! ```
//!
//! The noise is what a step of the encoder can hide: its length times the force. (After Hannaford & Ryu 2002, IEEE Trans. Robot.
//! Autom. 18, 1, with the ledger in the place of their estimate, as in Ryu et al. 2005, IEEE Trans. Robot. 21, 750; the guard is the
//! tank of Franken et al. 2011, IEEE Trans. Robot. 27, 741.)

use crate::port::Effort;
use glam::DVec3;

/// Energy [J] that is kept for later, at most, beyond what is stored: what was lost long ago pays for nothing.
const MOST_KEPT: f64 = 1e-3;

/// Time [s] over which the hand's movement is smoothed where the encoder tells of slow movements in jumps of
/// [`COARSE_M`]; less for finer ones.
const SMOOTH_S: f64 = 4e-3;
const COARSE_M: f64 = 50e-6;

/// Of the time in which the damper would stop the mass, the share that may be known late.
const BORNE: f64 = 0.25;

/// η: damping that makes up for what comes late is by so much less effective.
const EFFECTIVE: f64 = 0.5;

/// Time [s] over which the port's damping is looked at, and over which a surplus is forgotten.
const MEMORY_S: f64 = 0.05;
const SURPLUS_S: f64 = 0.1;

/// Time [s] in which what is missing is to be taken back.
const TAKE_BACK_S: f64 = 0.02;

/// A share of the energy that goes to and fro which may be missing before all is done about it.
const UNFELT: f64 = 0.01;

/// Times [s] over which the share of the force goes down, and up again.
const SOFTER_S: f64 = 1e-3;
const STIFFER_S: f64 = 1.0;

/// Time [s] out of contact over which n is forgotten, and in which it grows by e where the guard holds all force back.
const FORGET_S: f64 = 1.0;
const GUARDED_S: f64 = 0.1;

/// Motions that are remembered: a second at 1 kHz. A motion that is answered later counts as the oldest of them.
const REMEMBERED: usize = 1024;

/// What had happened with a motion, since the start.
#[derive(Debug, Clone, Copy, Default)]
struct Told {
    /// What the hand had given [J], by the force that was held and by the one that was wanted.
    given: f64,
    wanted: f64,
    /// Σ ẋ²·Δt [m²/s].
    moved: f64,
    /// The share of the force that was given.
    share: f64,
}

/// What the port did in the last moments.
#[derive(Debug, Clone, Copy, Default)]
struct Lately {
    /// Energy made, and gone to and fro [J].
    made: f64,
    flow: f64,
    /// Σ ẋ²·Δt [m²/s].
    moved: f64,
    /// Largest force [N].
    force: f64,
}

/// Observer and controller of one device's port.
#[derive(Debug, Clone)]
pub struct PassivityController {
    /// Most damping [N·s/m] that the device bears with what is known late of its movement.
    most_damping: f64,
    /// Step of the encoder [m], and how late movements are known [s]: smoothed, and all of it.
    resolution: f64,
    smooth_s: f64,
    late_s: f64,
    /// Velocity [m/s], smoothed evenly, and less where it is fast.
    velocity: DVec3,
    fast: DVec3,
    /// What had happened with each motion, by its sequence; and now.
    told: Box<[Told]>,
    now: Told,
    /// The motion that was answered last, and what was taken then [J].
    answered: Option<(u64, f64)>,
    lately: Lately,
    /// n [N·s/m].
    negative: f64,
    balance: f64,
    /// What the guard may give [J]; what was given and counts no more.
    left: f64,
    written_off: f64,
    last: Option<DVec3>,
    wanted: DVec3,
    held: DVec3,
    /// What the controller added [N].
    added: DVec3,
    share: f64,
    /// What was taken at the start, and when there was no force last [J].
    start: f64,
    unloaded: f64,
    /// How long there has been contact, with breaks; and the break [s].
    contact_s: f64,
    break_s: f64,
    /// Updates in which it acted, and the most that was ever missing [J].
    acted: u64,
    worst: f64,
}

impl PassivityController {
    /// Of a device with an effective mass [kg] and a resolution [m], updated every `dt_s` [s].
    pub fn new(mass_kg: f64, resolution_m: f64, dt_s: f64) -> Self {
        let smooth_s = SMOOTH_S * (resolution_m / COARSE_M).clamp(0.0, 1.0).sqrt();
        let late_s = smooth_s + 2.0 * dt_s;
        Self {
            most_damping: BORNE * mass_kg / late_s,
            resolution: resolution_m,
            smooth_s,
            late_s,
            velocity: DVec3::ZERO,
            fast: DVec3::ZERO,
            told: vec![Told::default(); REMEMBERED].into_boxed_slice(),
            now: Told { share: 1.0, ..Told::default() },
            answered: None,
            lately: Lately::default(),
            negative: 0.0,
            balance: 0.0,
            left: 0.0,
            written_off: 0.0,
            last: None,
            wanted: DVec3::ZERO,
            held: DVec3::ZERO,
            added: DVec3::ZERO,
            share: 1.0,
            start: 0.0,
            unloaded: 0.0,
            contact_s: 0.0,
            break_s: 0.0,
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

    /// Energy [J] that the hand has given lately and the scene has not taken, as far as answers tell.
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
            self.follow(moved, dt_s);
        }
        self.told[place(sequence)] = self.now;
        self.lately.force = self.lately.force.max(self.wanted.length());
        self.observe(sequence, effort, dt_s);
        self.wanted = if wanted.is_finite() { wanted } else { DVec3::ZERO };
        self.added = DVec3::ZERO;
        if dt_s <= 0.0 || !wanted.is_finite() {
            return wanted;
        }
        self.learn(sequence, effort, dt_s);

        // What it makes beyond what damping can take is not given.
        let bearable = EFFECTIVE * self.most_damping;
        let share = if self.negative > bearable { bearable / self.negative } else { 1.0 };
        let over = if share < self.share { SOFTER_S } else { STIFFER_S };
        self.share += (share - self.share) * (dt_s / (over + dt_s));
        if 1.0 - self.share < 1e-6 {
            self.share = 1.0;
        }
        if wanted == DVec3::ZERO {
            self.acted += u64::from(self.share < 1.0);
            return DVec3::ZERO;
        }
        let damping = self.share * self.negative / EFFECTIVE + self.taking_back();
        self.added = -self.velocity * damping.min(self.most_damping);
        let force = wanted * self.share + self.added;
        let guard = self.guard(force);
        if guard < 1.0 {
            let grown = 1.0 + (1.0 - guard) * dt_s / GUARDED_S;
            self.negative = self.negative.max(bearable) * grown;
        }
        self.acted += u64::from(self.added != DVec3::ZERO || self.share < 1.0 || guard < 1.0);
        force * guard
    }

    /// How the hand moves, smoothed: the slower it is, the longer a step of the encoder takes.
    fn follow(&mut self, moved: DVec3, dt_s: f64) {
        let speed = self.fast.length();
        let smooth_s = if speed > 0.0 { self.smooth_s.min(self.resolution / speed) } else { self.smooth_s };
        self.fast += (moved / dt_s - self.fast) * (dt_s / (smooth_s + dt_s));
        self.velocity += (moved / dt_s - self.velocity) * (dt_s / (self.smooth_s + dt_s));
        self.now.moved += self.velocity.length_squared() * dt_s;
    }

    /// The negative damping of the port, from what is missing beyond what the encoder hides.
    fn learn(&mut self, sequence: u64, effort: &Effort, dt_s: f64) {
        if effort.force == DVec3::ZERO {
            // Nothing is stored, and nothing known of the next contact.
            self.unloaded = effort.taken_j;
            self.negative *= 1.0 - (dt_s / FORGET_S).min(1.0);
            self.break_s += dt_s;
            if self.break_s > MEMORY_S {
                self.contact_s = 0.0;
            }
        } else {
            self.break_s = 0.0;
        }
        if self.contact_s > 0.0 || effort.force != DVec3::ZERO {
            self.contact_s += dt_s;
        }
        // The first force of a contact answers a motion that was not pushed: the damper has not paid yet.
        if self.contact_s < (sequence.saturating_sub(effort.answers) + 1) as f64 * dt_s {
            self.lately = Lately { force: self.lately.force, ..Lately::default() };
            self.balance = 0.0;
        }
        let Lately { made, moved, force, .. } = self.lately;
        let noise = self.resolution * force.max(effort.force.length());
        if effort.force != DVec3::ZERO && -self.balance > noise && moved > 0.0 {
            self.negative = self.negative.max((made - noise) / moved);
        }
    }

    /// Damping [N·s/m] that takes back what is missing.
    fn taking_back(&self) -> f64 {
        let missing = (-self.balance).max(0.0);
        let mean_square = self.lately.moved / MEMORY_S;
        if missing == 0.0 || mean_square == 0.0 {
            return 0.0;
        }
        let urgent = missing / (missing + UNFELT * self.lately.flow);
        urgent * missing / (TAKE_BACK_S * mean_square)
    }

    /// The share of a force [N] that gives no more than what is left, as late as the hand's movement is known.
    fn guard(&self, force: DVec3) -> f64 {
        let power = force.dot(self.velocity).max(force.dot(self.fast));
        if power > 0.0 { (self.left / (power * self.late_s)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// What has been answered since: what is left, the balance, and what the port made.
    fn observe(&mut self, sequence: u64, effort: &Effort, dt_s: f64) {
        let oldest = (sequence + 1).saturating_sub(REMEMBERED as u64).max(1);
        let of_use = effort.answers > 0 && effort.answers <= sequence && effort.taken_j.is_finite();
        if of_use && self.answered.is_none() {
            (self.start, self.answered) = (effort.taken_j, Some((effort.answers, effort.taken_j)));
        }
        let Some((before, taken)) = self.answered else { return };
        let before = before.max(oldest);
        if of_use && effort.answers > before {
            self.answered = Some((effort.answers, effort.taken_j));
            self.account(self.told[place(before)], effort, (effort.answers - before) as f64 * dt_s, taken);
        }
        // Another hand's energy may go through.
        let through = self.answered.map_or(0.0, |(_, taken)| (taken - self.start).min(0.0));
        self.left = self.now.given - through - self.written_off;
        if self.left < 0.0 {
            // More than a step of the encoder can hide this is not, and the share goes down for it.
            (self.written_off, self.left) = (self.written_off + self.left, 0.0);
        }
    }

    /// Balance, and what the port made, over the motions that were answered now: `span_s` [s] of them since `old`.
    fn account(&mut self, old: Told, effort: &Effort, span_s: f64, taken: f64) {
        let new = self.told[place(effort.answers)];
        let change = effort.taken_j - taken;
        let balance = self.balance + (new.given - old.given) - old.share * change;
        self.balance = if balance > 0.0 { balance * (1.0 - (span_s / SURPLUS_S).min(1.0)) } else { balance };
        self.worst = self.worst.max(-self.balance);
        let through = (effort.taken_j - self.start).min(0.0);
        let stored = (effort.taken_j - self.unloaded).max(0.0);
        let kept = new.given - through - self.written_off;
        self.written_off += (kept - stored - MOST_KEPT).max(0.0);
        let wanted = new.wanted - old.wanted;
        if change == 0.0 && wanted == 0.0 {
            // Out of contact nothing is learned, and nothing forgotten.
            return;
        }
        let forget = 1.0 - (span_s / MEMORY_S).min(1.0);
        let Lately { made, flow, moved, force } = self.lately;
        self.lately = Lately {
            made: made * forget + (change - wanted),
            flow: flow * forget + change.abs() + wanted.abs(),
            moved: moved * forget + (new.moved - old.moved),
            force: force * forget,
        };
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

    #[test]
    fn the_guard_gives_no_more_than_came_in_whatever_is_wanted() {
        // A hand that is moved to and fro, and a force that always wants to push it on: nothing has come in.
        let (mut controller, mut out, mut force) =
            (PassivityController::new(0.1, 0.0, 1e-3), 0.0_f64, DVec3::ZERO);
        let mut last = DVec3::ZERO;
        for k in 1..1000_u64 {
            let position = DVec3::X * 0.01 * (k as f64 * 0.02).sin();
            out += force.dot(position - last);
            assert!(out < 1e-9, "{k}: {out} J");
            // How it moves is known from the second reading on.
            let wanted = if k > 1 { (position - last).normalize_or_zero() * 3.0 } else { DVec3::ZERO };
            last = position;
            let effort = Effort { sequence: k, answers: k, time_s: 0.0, force: wanted, taken_j: 0.0 };
            force = controller.control(k, position, &effort, 1e-3);
            controller.hold(force);
        }
        assert!(
            controller.acted() > 900 && controller.share() < 0.5,
            "{} {}",
            controller.acted(),
            controller.share()
        );
    }
}
