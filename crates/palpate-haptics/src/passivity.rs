//! Passivity observer and controller of a device's port.
//!
//! A zero-order hold and a delayed reply make a port active: it generates energy, the more, the stiffer the coupling, the lower the
//! rate and the longer the delay. Two controllers act against it.
//!
//! **The energy tank** bounds the output. Its level E [J] is the work that the hand has done against the held force F [N] over its
//! displacements Δx [m], less what the scene has given out by its own energy ledger (A = [`crate::Effort::absorbed_j`], where it is
//! negative: energy of another hand). A force that drains the tank is scaled so that one update takes at most a share Δt/T, where
//! T [s] is the delay with which the hand's velocity ẋ is known. So E decays and never becomes negative, not even in the first swing.
//!
//! ```text
//! E = Σ −F·Δx − min(0, A)        F ← F·min(1, E / (F·ẋ·T))
//! ```
//!
//! **Damping** removes oscillations. The observer identifies the negative damping n [N·s/m] of the port: the energy that the scene
//! absorbed beyond the work of the wanted force. The coupling's damper does not count as absorbed: it pays for the port's activity, and
//! a coupling within its stability bound shows no n. The controller damps the hand by n. A device tolerates only a limited damping b of
//! a velocity that is known late; beyond it the force is scaled by s < 1. Where the tank acts, s falls too, until the tank need not act.
//! n is kept during contact, which avoids limit cycles. It is not identified across a gap between updates ([`PassivityController::skip_gap`]).
//!
//! ```text
//! n = (Σ ΔA − Σ −F_wanted·Δx − noise) / Σ ẋ²·Δt        F = s·F_wanted − s·n·ẋ/η        s = min(1, η·b/n)
//! ```
//!
//! The noise is the energy that one encoder step hides: its length times the force. η is the effectiveness of damping by a late
//! velocity. (After Hannaford & Ryu 2002, IEEE Trans. Robot. Autom. 18, 1, with the ledger in place of their estimate, as in Ryu et
//! al. 2005, IEEE Trans. Robot. 21, 750; the energy tank is that of Franken et al. 2011, IEEE Trans. Robot. 27, 741.)

use crate::port::Effort;
use glam::DVec3;

/// Capacity of the tank beyond the energy that is stored in the scene [J]: energy that was dissipated long ago pays for nothing.
const TANK_CAPACITY_J: f64 = 1e-3;

/// Time constant of the velocity filter for an encoder step of [`COARSE_M`] [s]; it scales with the root of the step.
const FILTER_S: f64 = 4e-3;

/// Encoder step from which on the velocity filter is slowest [m].
const COARSE_M: f64 = 50e-6;

/// Largest delay of the velocity, as a share of the time in which the damper stops the mass.
const DELAY_SHARE: f64 = 0.25;

/// Effectiveness η of damping by a late velocity.
const EFFECTIVENESS: f64 = 0.5;

/// Time constant of the identification of n [s].
const MEMORY_S: f64 = 0.05;

/// Time constant with which an energy surplus of the balance is forgotten [s].
const SURPLUS_S: f64 = 0.1;

/// Time within which an energy deficit is dissipated [s].
const RECOVER_DEFICIT_S: f64 = 0.02;

/// Deficit at which half of the recovery damping acts, as a share of the energy flow.
const DEFICIT_SHARE: f64 = 0.01;

/// Time constant with which the force scale s falls [s].
const SOFTER_S: f64 = 1e-3;

/// Time constant with which the force scale s rises [s].
const STIFFER_S: f64 = 1.0;

/// Time constant with which n is forgotten out of contact [s].
const FORGET_S: f64 = 1.0;

/// Time in which n grows by a factor e while the tank withholds all force [s].
const WITHHELD_S: f64 = 0.1;

/// Capacity of the history [motions]: 1 s at 1 kHz. A motion that is replied to later counts as the oldest one.
const HISTORY: usize = 1024;

/// Sums over all updates up to a motion.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    /// Work of the hand against the held force [J].
    work: f64,
    /// Work of the hand against the wanted force [J].
    wanted_work: f64,
    /// Σ ẋ²·Δt [m²/s].
    motion: f64,
    /// Scale of the force at that motion.
    scale: f64,
}

/// Sums over the last [`MEMORY_S`], with exponential forgetting.
#[derive(Debug, Clone, Copy, Default)]
struct Window {
    /// Generated energy [J].
    generated: f64,
    /// Energy flow, regardless of its direction [J].
    flow: f64,
    /// Σ ẋ²·Δt [m²/s].
    motion: f64,
    /// Largest force [N].
    force: f64,
}

/// Passivity observer and controller of one device's port.
#[derive(Debug, Clone)]
pub struct PassivityController {
    /// Largest damping b that the device tolerates [N·s/m].
    max_damping: f64,
    /// Encoder step [m].
    resolution: f64,
    /// Time constant of the velocity filter [s].
    filter_s: f64,
    /// Delay T with which the velocity is known [s]: filter and two updates.
    delay_s: f64,
    /// Velocity [m/s], filtered with a constant time constant.
    velocity: DVec3,
    /// Velocity [m/s], filtered less while it is fast.
    fast_velocity: DVec3,
    /// Sums at each motion, by sequence number modulo [`HISTORY`].
    history: Box<[Sums]>,
    /// Sums now.
    now: Sums,
    /// Motion that was replied to last, and the absorbed energy of that reply [J].
    replied: Option<(u64, f64)>,
    window: Window,
    /// Negative damping n of the port [N·s/m].
    negative_damping: f64,
    /// Energy balance [J]: work of the hand less absorbed energy.
    balance: f64,
    /// Level E of the tank [J].
    tank: f64,
    /// Work that no longer counts: beyond the tank's capacity, or below zero [J].
    written_off: f64,
    last_position: Option<DVec3>,
    wanted: DVec3,
    held: DVec3,
    /// Force that the controller added [N].
    added: DVec3,
    /// Scale s of the force.
    scale: f64,
    /// Absorbed energy in the first reply [J].
    absorbed_at_start: f64,
    /// Absorbed energy when there was no force last [J].
    absorbed_unloaded: f64,
    /// Duration of the contact, short interruptions included [s].
    contact_s: f64,
    /// Duration of the interruption [s].
    interruption_s: f64,
    /// Motion of the last update.
    sequence: u64,
    /// Last motion before a gap between updates.
    before_gap: u64,
    active_updates: u64,
    max_deficit: f64,
}

impl PassivityController {
    /// Controller for a device with an effective mass [kg] and an encoder step [m], updated every `dt_s` [s].
    pub fn new(mass_kg: f64, resolution_m: f64, dt_s: f64) -> Self {
        let filter_s = FILTER_S * (resolution_m / COARSE_M).clamp(0.0, 1.0).sqrt();
        let delay_s = filter_s + 2.0 * dt_s;
        Self {
            max_damping: DELAY_SHARE * mass_kg / delay_s,
            resolution: resolution_m,
            filter_s,
            delay_s,
            velocity: DVec3::ZERO,
            fast_velocity: DVec3::ZERO,
            history: vec![Sums::default(); HISTORY].into_boxed_slice(),
            now: Sums { scale: 1.0, ..Sums::default() },
            replied: None,
            window: Window::default(),
            negative_damping: 0.0,
            balance: 0.0,
            tank: 0.0,
            written_off: 0.0,
            last_position: None,
            wanted: DVec3::ZERO,
            held: DVec3::ZERO,
            added: DVec3::ZERO,
            scale: 1.0,
            absorbed_at_start: 0.0,
            absorbed_unloaded: 0.0,
            contact_s: 0.0,
            interruption_s: 0.0,
            sequence: 0,
            before_gap: 0,
            active_updates: 0,
            max_deficit: 0.0,
        }
    }

    /// Number of updates in which the controller changed the force.
    pub fn active_updates(&self) -> u64 {
        self.active_updates
    }

    /// Largest energy deficit of the balance [J].
    pub fn max_deficit_j(&self) -> f64 {
        self.max_deficit
    }

    /// Energy balance [J]: recent work of the hand less absorbed energy, up to the last reply.
    pub fn balance_j(&self) -> f64 {
        self.balance
    }

    /// Scale s of the force: below 1 where damping alone is not enough.
    pub fn force_scale(&self) -> f64 {
        self.scale
    }

    /// Learns nothing from the time until the next motion, which comes after a gap between updates: the force over a gap is not the port's,
    /// and is taken away by the safety. The tank still counts its energy.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn skip_gap(&mut self) {
        self.before_gap = self.sequence;
    }

    /// Passive force [N] for the newest effort, at the hand's position [m] with its motion number `sequence`, `dt_s` [s] after the
    /// last update.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn control(&mut self, sequence: u64, position: DVec3, effort: &Effort, dt_s: f64) -> DVec3 {
        let wanted = effort.force;
        let moved = self.last_position.map_or(DVec3::ZERO, |last| position - last);
        if !moved.is_finite() {
            return wanted;
        }
        self.last_position = Some(position);
        self.now.work -= self.held.dot(moved);
        self.now.wanted_work -= self.wanted.dot(moved);
        if dt_s > 0.0 {
            self.filter_velocity(moved, dt_s);
        }
        self.sequence = sequence;
        self.history[index(sequence)] = self.now;
        self.window.force = self.window.force.max(self.wanted.length());
        self.observe(effort, dt_s);
        self.wanted = if wanted.is_finite() { wanted } else { DVec3::ZERO };
        self.added = DVec3::ZERO;
        if dt_s <= 0.0 || !wanted.is_finite() {
            return wanted;
        }
        self.identify(effort, dt_s);

        // s → min(1, η·b/n): the activity that damping can't remove is avoided by a softer force.
        let removable = EFFECTIVENESS * self.max_damping;
        let scale = if self.negative_damping > removable { removable / self.negative_damping } else { 1.0 };
        let time_constant = if scale < self.scale { SOFTER_S } else { STIFFER_S };
        self.scale += (scale - self.scale) * (dt_s / (time_constant + dt_s));
        if 1.0 - self.scale < 1e-6 {
            self.scale = 1.0;
        }
        if wanted == DVec3::ZERO {
            self.active_updates += u64::from(self.scale < 1.0);
            return DVec3::ZERO;
        }

        // F = s·F_wanted − (s·n/η + recovery)·ẋ, then the tank.
        let damping = self.scale * self.negative_damping / EFFECTIVENESS + self.recovery_damping();
        self.added = -self.velocity * damping.min(self.max_damping);
        let force = wanted * self.scale + self.added;
        let tank_scale = self.tank_scale(force);
        if tank_scale < 1.0 {
            let growth = 1.0 + (1.0 - tank_scale) * dt_s / WITHHELD_S;
            self.negative_damping = self.negative_damping.max(removable) * growth;
        }
        let active = self.added != DVec3::ZERO || self.scale < 1.0 || tank_scale < 1.0;
        self.active_updates += u64::from(active);
        force * tank_scale
    }

    /// Filters the velocity. The fast filter follows one encoder step: the slower the hand, the longer a step lasts.
    fn filter_velocity(&mut self, moved: DVec3, dt_s: f64) {
        let speed = self.fast_velocity.length();
        let filter_s = if speed > 0.0 { self.filter_s.min(self.resolution / speed) } else { self.filter_s };
        self.fast_velocity += (moved / dt_s - self.fast_velocity) * (dt_s / (filter_s + dt_s));
        self.velocity += (moved / dt_s - self.velocity) * (dt_s / (self.filter_s + dt_s));
        self.now.motion += self.velocity.length_squared() * dt_s;
    }

    /// Identifies the negative damping n of the port, from the deficit beyond what the encoder hides.
    fn identify(&mut self, effort: &Effort, dt_s: f64) {
        if effort.force == DVec3::ZERO {
            // Out of contact: nothing is stored, and n is forgotten.
            self.absorbed_unloaded = effort.absorbed_j;
            self.negative_damping *= 1.0 - (dt_s / FORGET_S).min(1.0);
            self.interruption_s += dt_s;
            if self.interruption_s > MEMORY_S {
                self.contact_s = 0.0;
            }
        } else {
            self.interruption_s = 0.0;
        }
        if self.contact_s > 0.0 || effort.force != DVec3::ZERO {
            self.contact_s += dt_s;
        }
        // The first force of a contact replies to a motion without force: the damper has not paid yet.
        if self.contact_s < (self.sequence.saturating_sub(effort.in_reply_to) + 1) as f64 * dt_s {
            self.forget();
        }
        let Window { generated, motion, force, .. } = self.window;
        let noise = self.resolution * force.max(effort.force.length());
        if effort.force != DVec3::ZERO && -self.balance > noise && motion > 0.0 {
            self.negative_damping = self.negative_damping.max((generated - noise) / motion);
        }
    }

    /// Forgets the energies of the window and the balance.
    fn forget(&mut self) {
        self.window = Window { force: self.window.force, ..Window::default() };
        self.balance = 0.0;
    }

    /// Damping that dissipates the energy deficit [N·s/m].
    fn recovery_damping(&self) -> f64 {
        let deficit = (-self.balance).max(0.0);
        let mean_square = self.window.motion / MEMORY_S;
        if deficit == 0.0 || mean_square == 0.0 {
            return 0.0;
        }
        let urgency = deficit / (deficit + DEFICIT_SHARE * self.window.flow);
        urgency * deficit / (RECOVER_DEFICIT_S * mean_square)
    }

    /// Scale of a force [N] that drains at most the tank within the delay of the velocity: min(1, E/(F·ẋ·T)).
    fn tank_scale(&self, force: DVec3) -> f64 {
        let power = force.dot(self.velocity).max(force.dot(self.fast_velocity));
        if power > 0.0 { (self.tank / (power * self.delay_s)).clamp(0.0, 1.0) } else { 1.0 }
    }

    /// Updates balance, window and tank with the newest effort.
    fn observe(&mut self, effort: &Effort, dt_s: f64) {
        let oldest = (self.sequence + 1).saturating_sub(HISTORY as u64).max(1);
        let valid =
            effort.in_reply_to > 0 && effort.in_reply_to <= self.sequence && effort.absorbed_j.is_finite();
        if valid && self.replied.is_none() {
            (self.absorbed_at_start, self.replied) =
                (effort.absorbed_j, Some((effort.in_reply_to, effort.absorbed_j)));
        }
        let Some((before, absorbed)) = self.replied else { return };
        let before = before.max(oldest);
        if valid && effort.in_reply_to > before {
            self.replied = Some((effort.in_reply_to, effort.absorbed_j));
            let span_s = (effort.in_reply_to - before) as f64 * dt_s;
            self.account(self.history[index(before)], effort, span_s, absorbed);
            if before <= self.before_gap {
                self.forget();
            }
        }
        // Energy of another hand may pass through.
        let passed = self.replied.map_or(0.0, |(_, absorbed)| (absorbed - self.absorbed_at_start).min(0.0));
        self.tank = self.now.work - passed - self.written_off;
        if self.tank < 0.0 {
            // At most what an encoder step hides; the force scale falls for it.
            (self.written_off, self.tank) = (self.written_off + self.tank, 0.0);
        }
    }

    /// Updates the balance and the window with the motions of the last `span_s` [s], since the sums `old` and the absorbed energy
    /// `absorbed` [J].
    fn account(&mut self, old: Sums, effort: &Effort, span_s: f64, absorbed: f64) {
        let new = self.history[index(effort.in_reply_to)];
        let change = effort.absorbed_j - absorbed;
        let balance = self.balance + (new.work - old.work) - old.scale * change;
        self.balance = if balance > 0.0 { balance * (1.0 - (span_s / SURPLUS_S).min(1.0)) } else { balance };
        self.max_deficit = self.max_deficit.max(-self.balance);
        let passed = (effort.absorbed_j - self.absorbed_at_start).min(0.0);
        let stored = (effort.absorbed_j - self.absorbed_unloaded).max(0.0);
        let level = new.work - passed - self.written_off;
        self.written_off += (level - stored - TANK_CAPACITY_J).max(0.0);
        let wanted = new.wanted_work - old.wanted_work;
        if change == 0.0 && wanted == 0.0 {
            // Out of contact the window neither learns nor forgets.
            return;
        }
        let forget = 1.0 - (span_s / MEMORY_S).min(1.0);
        let Window { generated, flow, motion, force } = self.window;
        self.window = Window {
            generated: generated * forget + (change - wanted),
            flow: flow * forget + change.abs() + wanted.abs(),
            motion: motion * forget + (new.motion - old.motion),
            force: force * forget,
        };
    }

    /// Notes the force that is held from now on [N], after all limits.
    ///
    /// # Real time
    /// No allocation, lock or system call.
    pub fn hold(&mut self, force: DVec3) {
        self.held = force;
        let square = self.wanted.length_squared();
        let scale = (force - self.added).dot(self.wanted) / square;
        self.now.scale = if square > 0.0 { scale.clamp(0.0, 1.0) } else { self.scale };
        self.history[index(self.sequence)].scale = self.now.scale;
    }
}

/// Index of a motion in the history.
fn index(sequence: u64) -> usize {
    (sequence % HISTORY as u64) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Energy gained by a mass that bounces on a stiff spring behind a port with a delay [J].
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
                let in_reply_to = (k + 1).saturating_sub(delay as u64);
                let effort = Effort {
                    sequence: k,
                    in_reply_to,
                    time_s: 0.0,
                    force: DVec3::X * wanted,
                    absorbed_j: taken,
                };
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
        // A damper that replies at once: the hand does more work than is absorbed.
        let mut controller = PassivityController::new(0.1, 0.0, 1e-3);
        let mut taken = 0.0;
        let mut force = DVec3::ZERO;
        for k in 0..1000_u32 {
            let position = DVec3::X * 0.01 * (f64::from(k) * 0.02).sin();
            let next = DVec3::X * 0.01 * (f64::from(k + 1) * 0.02).sin();
            let wanted = (position - next) * 5.0;
            let sequence = u64::from(k) + 1;
            let effort =
                Effort { sequence, in_reply_to: sequence, time_s: 0.0, force: wanted, absorbed_j: taken };
            force = controller.control(sequence, position, &effort, 1e-3);
            assert_eq!(force, wanted);
            controller.hold(force);
            taken += 0.9 * -force.dot(next - position);
        }
        assert!(controller.active_updates() == 0 && controller.balance_j() > 0.0, "{force}");
    }

    #[test]
    fn the_tank_gives_no_more_than_came_in_whatever_is_wanted() {
        // A hand that is moved to and fro, and a force that always wants to push it on: nothing has come in.
        let (mut controller, mut out, mut force) =
            (PassivityController::new(0.1, 0.0, 1e-3), 0.0_f64, DVec3::ZERO);
        let mut last = DVec3::ZERO;
        for k in 1..1000_u64 {
            let position = DVec3::X * 0.01 * (k as f64 * 0.02).sin();
            out += force.dot(position - last);
            assert!(out < 1e-9, "{k}: {out} J");
            // The velocity is known from the second reading on.
            let wanted = if k > 1 { (position - last).normalize_or_zero() * 3.0 } else { DVec3::ZERO };
            last = position;
            let effort = Effort { sequence: k, in_reply_to: k, time_s: 0.0, force: wanted, absorbed_j: 0.0 };
            force = controller.control(k, position, &effort, 1e-3);
            controller.hold(force);
        }
        assert!(
            controller.active_updates() > 900 && controller.force_scale() < 0.5,
            "{} {}",
            controller.active_updates(),
            controller.force_scale()
        );
    }
}
