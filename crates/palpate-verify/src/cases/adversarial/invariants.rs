//! Invariants that every step of a random scene is held to, and their violations.

use super::random_device::RandomDevice;
use crate::check::Check;
use crate::run_invariants::ROUND_OFF;
use glam::DVec3;
use palpate::{Collider, DeviceInput, Input, Model, ObjectOutput, Output};

/// The solver's loosest tolerance, as a share of the object's size (docs/contact.md); what is worse is reported in the status.
const LOOSE: f64 = 1e-5;

/// Force that an open contact may keep, as a share of the step's largest: what remains where many are solved loosely.
const RESIDUAL_FORCE: f64 = 1e-3;

/// Rounding of a force over its bound, as a share of it.
const COUPLING: f64 = 1e-9;

/// Share of steps that may be unsolved: devices without coupling that jump by the size of a body pose problems without solution.
const UNSOLVED: f64 = 0.02;

/// Energy below which shares are not counted [J]: no hand feels a nanojoule.
const NEGLIGIBLE_J: f64 = 1e-9;

/// Violations in one scene or in many.
#[derive(Debug, Clone, Default)]
pub struct Violations {
    /// Steps that were observed.
    pub steps: u64,
    /// Steps with a contact.
    pub touching: u64,
    /// Outputs with a number that is not finite.
    pub not_finite: Occurrences,
    /// Energy beyond what was put in, as a share of the energy exchanged.
    pub gained: Largest,
    /// Energy that no term of the ledger explains, as a share of the energy exchanged.
    pub unexplained: Largest,
    /// Steps that were not solved.
    pub unsolved: Occurrences,
    /// Steps that were not solved and do not report it.
    pub unreported: Occurrences,
    /// Force over the bound that the coupling sets for its stretch.
    pub ratio: Largest,
    /// Work of the devices that the ledger lacks, as a share of the energy exchanged.
    pub unbooked: Largest,
    /// Forces on hands that are not the reaction of their contacts.
    pub one_sided: Occurrences,
    /// Devices without force whose proxy is not where their coupling leads it.
    pub left_behind: Occurrences,
    /// Steps of devices whose proxy has left the body.
    pub steps_after_leaving: u64,
    /// Steps of those in which a force was still there.
    pub stuck: Occurrences,
}

/// Number of violations of one kind, and the first of them.
#[derive(Debug, Clone, Copy, Default)]
pub struct Occurrences {
    pub count: u64,
    /// Scene and step.
    pub first: Option<[usize; 2]>,
}

/// The largest value of one kind.
#[derive(Debug, Clone, Copy, Default)]
pub struct Largest {
    pub value: f64,
    /// Scene and step.
    pub at: [usize; 2],
}

impl Occurrences {
    fn count_if(&mut self, happened: bool, at: [usize; 2]) {
        if happened {
            self.count += 1;
            self.first.get_or_insert(at);
        }
    }

    fn join(&mut self, other: Self) {
        self.count += other.count;
        self.first = self.first.or(other.first);
    }
}

impl Largest {
    fn take(&mut self, value: f64, at: [usize; 2]) {
        if value > self.value {
            *self = Self { value, at };
        }
    }
}

impl Violations {
    /// Violations of both; the other's scenes come after these.
    pub fn join(mut self, other: Self) -> Self {
        self.steps += other.steps;
        self.touching += other.touching;
        self.steps_after_leaving += other.steps_after_leaving;
        for (own, others) in [
            (&mut self.not_finite, other.not_finite),
            (&mut self.unsolved, other.unsolved),
            (&mut self.unreported, other.unreported),
            (&mut self.one_sided, other.one_sided),
            (&mut self.left_behind, other.left_behind),
            (&mut self.stuck, other.stuck),
        ] {
            own.join(others);
        }
        for (own, others) in [
            (&mut self.gained, other.gained),
            (&mut self.unexplained, other.unexplained),
            (&mut self.ratio, other.ratio),
            (&mut self.unbooked, other.unbooked),
        ] {
            own.take(others.value, others.at);
        }
        self
    }
}

/// Checks the invariants of a scene, step by step.
pub struct InvariantChecker<'a> {
    model: &'a Model,
    scene: usize,
    size: f64,
    start: f64,
    last_input: f64,
    /// Energy exchanged until now [J].
    exchanged: f64,
    /// Work of the devices, and on the weight of objects that are moved out of others without velocity, until now [J].
    work: f64,
    /// Pose and velocity of each object after the last step.
    objects: Vec<ObjectOutput>,
    /// Position and stretch of each device after the last step [m]; `None` when it was inactive.
    before: Vec<Option<[DVec3; 2]>>,
    pub violations: Violations,
}

impl<'a> InvariantChecker<'a> {
    /// A checker before the first step of a scene.
    pub fn new(model: &'a Model, scene: usize, start: &Output) -> Self {
        let energy = &start.energy;
        let size = model.recordings().map(|r| r.surface.radius()).fold(f64::INFINITY, f64::min);
        Self {
            model,
            scene,
            size,
            start: energy.stored(),
            last_input: 0.0,
            exchanged: NEGLIGIBLE_J + energy.kinetic + energy.potential.abs(),
            work: 0.0,
            objects: start.objects.clone(),
            before: vec![None; start.devices.len()],
            violations: Violations::default(),
        }
    }

    /// Observes a step; false when its numbers are not finite and the scene has to end.
    pub fn observe(&mut self, input: &Input, randoms: &[RandomDevice], output: &Output) -> bool {
        let at = [self.scene, self.violations.steps as usize];
        self.violations.steps += 1;
        let sound = is_finite(output);
        self.violations.not_finite.count_if(!sound, at);
        if !sound {
            return false;
        }
        self.violations.touching += u64::from(!output.contacts.is_empty());
        for (device, (given, random)) in input.devices.iter().zip(randoms).enumerate() {
            self.device(device, given, random, output, at);
        }
        self.depenetration(output);
        self.energy(output, at);
        self.status(output, at);
        true
    }

    /// Work on the weight of objects that move farther than by their velocity, whose mean holds over a step.
    fn depenetration(&mut self, output: &Output) {
        let parameters = self.model.parameters();
        let bodies = self.model.recordings().zip(self.objects.iter().zip(&output.objects));
        for (recording, (before, after)) in bodies {
            let by_velocity = 0.5 * parameters.step_s * (before.twist.linear + after.twist.linear);
            let shift = after.pose.position - before.pose.position - by_velocity;
            self.work -= recording.mass() * parameters.gravity.dot(shift);
        }
        self.objects.clone_from(&output.objects);
    }

    fn energy(&mut self, output: &Output, at: [usize; 2]) {
        let energy = &output.energy;
        self.exchanged += (energy.input - self.last_input).abs();
        self.last_input = energy.input;
        let exchanged = self.exchanged.max(energy.kinetic + energy.elastic + energy.potential.abs());
        let share = |joules: f64| if joules > 0.0 { joules / exchanged } else { 0.0 };
        self.violations.gained.take(share(energy.stored() - self.start - energy.input), at);
        self.violations.unexplained.take(share(energy.defect.abs()), at);
        self.violations.unbooked.take(share((energy.input - self.work).abs()), at);
    }

    /// Violated contact laws: by the solver's own residual, and by open contacts that carry force.
    fn status(&mut self, output: &Output, at: [usize; 2]) {
        let status = &output.status;
        self.violations.unsolved.count_if(status.unsolved_islands > 0, at);
        let largest = output.contacts.iter().map(|contact| contact.force.length()).fold(0.0, f64::max);
        let pushing =
            output.contacts.iter().filter(|contact| contact.force.length() > RESIDUAL_FORCE * largest);
        let apart = pushing.map(|contact| contact.gap).fold(0.0, f64::max);
        // What the last sweep changes comes on top of the residual that it reports.
        let violated = status.solver_residual_m.max(0.5 * apart) > LOOSE * self.size;
        self.violations
            .unreported
            .count_if(violated && status.unsolved_islands + status.islands_out_of_budget == 0, at);
    }

    fn device(
        &mut self,
        device: usize,
        given: &DeviceInput,
        random: &RandomDevice,
        output: &Output,
        at: [usize; 2],
    ) {
        let out = &output.devices[device];
        let force = out.force_on_hand.length();
        let present = given.mode.is_active() && given.position.is_finite();
        if !present {
            self.violations.stuck.count_if(force != 0.0, at);
            self.before[device] = None;
            return;
        }
        // A tip that is let out has its interface point beside the device.
        let stretch = given.position + out.offset[1] - out.proxy;
        let [place, last] = self.before[device].unwrap_or([given.position, DVec3::ZERO]);
        let motion = given.position - place + (out.offset[1] - out.offset[0]);
        self.work -= out.force_on_hand.dot(motion);
        self.violations.one_sided.count_if(is_one_sided(device, output), at);
        let tiny = 8.0 * f64::EPSILON * (given.position.length() + out.proxy.length());
        let parameters = &self.model.parameters().devices[device];
        // Without force the coupling leads the proxy: f = k·e + d·ė = 0.
        let mut left_behind = stretch.length() > tiny;
        if let Some(coupling) = parameters.coupling {
            let rate = coupling.damping / self.model.parameters().step_s;
            let bound = coupling.stiffness * stretch.length() + rate * (stretch - last).length();
            let slack = (coupling.stiffness + 2.0 * rate) * tiny;
            self.violations.ratio.take(force / (bound + slack), at);
            let free = last * super::lag(self.model, device);
            left_behind = force == 0.0 && (stretch - free).length() > tiny;
        }
        self.violations.left_behind.count_if(left_behind, at);
        if random.has_left {
            self.violations.steps_after_leaving += 1;
            self.violations.stuck.count_if(left_behind || force != 0.0, at);
        }
        self.before[device] = Some([given.position, stretch]);
    }
}

/// Whether the force on a hand differs from the reaction of its contacts by more than the rounding of their sum.
fn is_one_sided(device: usize, output: &Output) -> bool {
    let own = output.contacts.iter().filter(|contact| contact.against == Collider::Device(device));
    let (mut sum, mut size) = (output.devices[device].force_on_hand, 0.0);
    for contact in own {
        sum += contact.force;
        size += contact.force.length();
    }
    sum.length() > ROUND_OFF * size
}

fn is_finite(output: &Output) -> bool {
    let energy = &output.energy;
    let bodies = output.objects.iter().all(|object| {
        let pose = &object.pose;
        let twist = &object.twist;
        pose.position.is_finite()
            && pose.orientation.is_finite()
            && twist.linear.is_finite()
            && twist.angular.is_finite()
    });
    let hands = output.devices.iter().all(|d| d.force_on_hand.is_finite() && d.proxy.is_finite());
    let contacts = output.contacts.iter().all(|contact| {
        let places = contact.point.is_finite() && contact.normal.is_finite() && contact.force.is_finite();
        places && contact.gap.is_finite() && contact.slip_speed.is_finite()
    });
    let ledger = [energy.stored(), energy.input, energy.lost(), energy.defect];
    bodies && hands && contacts && ledger.iter().all(|e| e.is_finite())
}

/// Text for a scene and a step.
fn place([scene, step]: [usize; 2]) -> String {
    format!("scene {scene}, step {step}")
}

impl Violations {
    /// The checks of a body.
    pub fn checks(&self, of: &str) -> Vec<Check> {
        let none = |what: &str, seen: &Occurrences| {
            let first = seen.first.map_or(String::new(), |at| format!(", first in {}", place(at)));
            Check::new(format!("{of}: {what}{first}"), seen.count as f64, 0.0, 0.0)
        };
        let share = |what: &str, worst: &Largest, allowed: f64| {
            let at = if worst.value > allowed { format!(", {}", place(worst.at)) } else { String::new() };
            Check::new(format!("{of}: {what}{at}"), worst.value, 0.0, allowed)
        };
        let unsolved = self.unsolved.count as f64 / self.steps as f64;
        vec![
            none(
                &format!(
                    "of {} steps, {} of them in touch, with numbers not finite",
                    self.steps, self.touching
                ),
                &self.not_finite,
            ),
            share("energy beyond what was put in, share", &self.gained, ROUND_OFF),
            // Where many contacts are solved loosely, the turn of their body is off by as much.
            share("energy that no term explains, share", &self.unexplained, LOOSE),
            share("work of the hands that is not booked, share", &self.unbooked, ROUND_OFF),
            none("forces on hands that objects do not feel", &self.one_sided),
            Check::new(
                format!("{of}: steps unsolved ({}), share", self.unsolved.count),
                unsolved,
                0.0,
                UNSOLVED,
            ),
            none("steps unsolved that don't say so", &self.unreported),
            Check::new(format!("{of}: force over what its coupling gives"), self.ratio.value, 1.0, COUPLING),
            none("proxies without force that do not go as their coupling", &self.left_behind),
            none(
                &format!("of {} steps of devices that left, with force", self.steps_after_leaving),
                &self.stuck,
            ),
        ]
    }
}
