//! What is looked at in every step of a random scene, and what was seen.

use super::super::Check;
use super::super::scene::ROUND_OFF;
use super::hands::Hand;
use glam::DVec3;
use palpate::{Collider, DeviceInput, DeviceMode, Input, Model, Output};

/// The solver may miss a contact's law by this share of the object's size (docs/contact.md); beyond it the status says so.
const LOOSE: f64 = 1e-5;

/// A contact beyond this gap must not push more than this share of the step's largest force: what is left where many are
/// solved loosely.
const LEFT: f64 = 1e-3;

/// Hands without coupling that jump by the size of a body ask for what can't be solved; this share of all steps at most.
const UNSOLVED: f64 = 0.02;

/// Energies below this [J] are of no account: no hand feels a nanojoule.
const NOTHING: f64 = 1e-9;

/// What was seen in one scene or in many.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Steps, and those in which something touched.
    pub steps: u64,
    pub touching: u64,
    /// Outputs with something that is not finite.
    pub unfinite: Seen,
    /// Energy beyond what was put in, and energy that no term explains, as shares of what went round.
    pub gained: Worst,
    pub unexplained: Worst,
    /// Steps that were not solved, and those that were not and don't say so.
    pub unsolved: Seen,
    pub silent: Seen,
    /// Force over what the coupling gives for its stretch.
    pub ratio: Worst,
    /// Work of the hands that the ledger does not have, as a share of the energy that went round.
    pub unbooked: Worst,
    /// Forces on hands that are not what their contacts do to the objects.
    pub one_sided: Seen,
    /// Devices without force whose proxy is not where their coupling lets it be.
    pub left_behind: Seen,
    /// Steps of devices that have escaped, and those in which something still held them.
    pub escapes: u64,
    pub stuck: Seen,
}

/// How often something was seen, and where first: scene and step.
#[derive(Debug, Clone, Copy, Default)]
pub struct Seen {
    pub count: u64,
    pub first: Option<[usize; 2]>,
}

/// The largest of something, and where.
#[derive(Debug, Clone, Copy, Default)]
pub struct Worst {
    pub value: f64,
    pub at: [usize; 2],
}

impl Seen {
    fn take(&mut self, happened: bool, at: [usize; 2]) {
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

impl Worst {
    fn take(&mut self, value: f64, at: [usize; 2]) {
        if value > self.value {
            *self = Self { value, at };
        }
    }
}

impl Tally {
    /// Both together; the other's scenes come later.
    pub fn join(mut self, other: Self) -> Self {
        self.steps += other.steps;
        self.touching += other.touching;
        self.escapes += other.escapes;
        for (own, others) in [
            (&mut self.unfinite, other.unfinite),
            (&mut self.unsolved, other.unsolved),
            (&mut self.silent, other.silent),
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

/// Looks at a scene.
pub struct Witness<'a> {
    model: &'a Model,
    scene: usize,
    size: f64,
    start: f64,
    last_input: f64,
    /// Energy that went round until now [J].
    moved: f64,
    /// Work of the hands until now [J].
    work: f64,
    /// Each device's place, and its stretch, after the last step; none when it was away.
    before: Vec<Option<[DVec3; 2]>>,
    pub tally: Tally,
}

impl<'a> Witness<'a> {
    /// Before the first step of a scene.
    pub fn new(model: &'a Model, scene: usize, start: &Output) -> Self {
        let energy = &start.energy;
        let size = model.recordings().map(|r| r.surface.radius()).fold(f64::INFINITY, f64::min);
        Self {
            model,
            scene,
            size,
            start: energy.stored(),
            last_input: 0.0,
            moved: NOTHING + energy.kinetic + energy.potential.abs(),
            work: 0.0,
            before: vec![None; start.devices.len()],
            tally: Tally::default(),
        }
    }

    /// Look at a step; says whether its numbers can be gone on with.
    pub fn look(&mut self, input: &Input, hands: &[Hand], output: &Output) -> bool {
        let at = [self.scene, self.tally.steps as usize];
        self.tally.steps += 1;
        let sound = is_finite(output);
        self.tally.unfinite.take(!sound, at);
        if !sound {
            return false;
        }
        self.tally.touching += u64::from(!output.contacts.is_empty());
        for (device, (given, hand)) in input.devices.iter().zip(hands).enumerate() {
            self.device(device, given, hand, output, at);
        }
        self.energy(output, at);
        self.status(output, at);
        true
    }

    fn energy(&mut self, output: &Output, at: [usize; 2]) {
        let energy = &output.energy;
        self.moved += (energy.input - self.last_input).abs();
        self.last_input = energy.input;
        let moved = self.moved.max(energy.kinetic + energy.elastic + energy.potential.abs());
        let share = |joules: f64| if joules > 0.0 { joules / moved } else { 0.0 };
        self.tally.gained.take(share(energy.stored() - self.start - energy.input), at);
        self.tally.unexplained.take(share(energy.defect.abs()), at);
        self.tally.unbooked.take(share((energy.input - self.work).abs()), at);
    }

    /// Misses of the laws: as the solver sees them, and as contacts that push from afar show them.
    fn status(&mut self, output: &Output, at: [usize; 2]) {
        let status = &output.status;
        self.tally.unsolved.take(status.unsolved_islands > 0, at);
        let largest = output.contacts.iter().map(|contact| contact.force.length()).fold(0.0, f64::max);
        let pushing = output.contacts.iter().filter(|contact| contact.force.length() > LEFT * largest);
        let apart = pushing.map(|contact| contact.gap).fold(0.0, f64::max);
        // What the last sweep moves comes on top of the miss that it sees.
        let missed = status.solver_residual_m.max(0.5 * apart) > LOOSE * self.size;
        self.tally.silent.take(missed && status.unsolved_islands == 0, at);
    }

    fn device(&mut self, device: usize, given: &DeviceInput, hand: &Hand, output: &Output, at: [usize; 2]) {
        let out = &output.devices[device];
        let force = out.force_on_hand.length();
        let present = given.mode != DeviceMode::Inactive && given.position.is_finite();
        if !present {
            self.tally.stuck.take(force != 0.0, at);
            self.before[device] = None;
            return;
        }
        let stretch = given.position - out.proxy;
        let [place, last] = self.before[device].unwrap_or([given.position, DVec3::ZERO]);
        self.work -= out.force_on_hand.dot(given.position - place);
        self.tally.one_sided.take(is_one_sided(device, output), at);
        let tiny = 8.0 * f64::EPSILON * (given.position.length() + out.proxy.length());
        let parameters = &self.model.parameters().devices[device];
        // Without force a proxy goes as its coupling lets it: f = k·e + d·ė = 0.
        let mut left_behind = stretch.length() > tiny;
        if let Some(coupling) = parameters.coupling {
            let rate = coupling.damping / self.model.parameters().step_s;
            let bound = coupling.stiffness * stretch.length() + rate * (stretch - last).length();
            let slack = (coupling.stiffness + 2.0 * rate) * tiny;
            self.tally.ratio.take(force / (bound + slack), at);
            let free = last * super::lag(self.model, device);
            left_behind = force == 0.0 && (stretch - free).length() > tiny;
        }
        self.tally.left_behind.take(left_behind, at);
        if hand.escaped {
            self.tally.escapes += 1;
            self.tally.stuck.take(left_behind || force != 0.0, at);
        }
        self.before[device] = Some([given.position, stretch]);
    }
}

/// Whether the force on a hand is other than what its contacts do to the objects, by more than the rounding of their sum.
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

/// Where something was seen.
fn place([scene, step]: [usize; 2]) -> String {
    format!("scene {scene}, step {step}")
}

impl Tally {
    /// The checks of a body.
    pub fn checks(&self, of: &str) -> Vec<Check> {
        let none = |what: &str, seen: &Seen| {
            let first = seen.first.map_or(String::new(), |at| format!(", first in {}", place(at)));
            Check::new(format!("{of}: {what}{first}"), seen.count as f64, 0.0, 0.0)
        };
        let share = |what: &str, worst: &Worst, allowed: f64| {
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
                &self.unfinite,
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
            none("steps unsolved that don't say so", &self.silent),
            Check::new(format!("{of}: force over what its coupling gives"), self.ratio.value, 1.0, 1e-9),
            none("proxies without force that do not go as their coupling", &self.left_behind),
            none(&format!("of {} steps of devices that left, with force", self.escapes), &self.stuck),
        ]
    }
}
