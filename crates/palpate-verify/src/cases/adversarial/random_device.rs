//! Devices that move at random: phases of some steps each.

use glam::{DVec3, Vec3Swizzles};
use palpate::{DeviceInput, Pose};
use palpate_testkit::Random;

/// Longest phase [steps].
const LONGEST_PHASE: f64 = 150.0;

/// Distance at which the proxy has left the body, in body radii.
const FAR: f64 = 20.0;

/// Steps for which the device stays there.
const STAY: u32 = 3;

/// A pattern of motion about an object; `goal` is a place relative to it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// Smooth motion with a tremor.
    Wander,
    /// Jumps now and then.
    Teleport,
    /// Alternation between two places at the Nyquist rate.
    Shake,
    /// Inside the undeformed body.
    Inside,
    /// Positions that are not finite.
    NotFinite,
    /// Inactive now and then.
    AwayAndBack,
    /// Slowly into the object and through it.
    Press,
    /// Through the object, farther in a step than a plate is thick.
    Sweep,
    /// Away from the body, where nothing is in the way of the proxy.
    Leave,
}

const PHASES: [Phase; 9] = [
    Phase::Wander,
    Phase::Teleport,
    Phase::Shake,
    Phase::Inside,
    Phase::NotFinite,
    Phase::AwayAndBack,
    Phase::Press,
    Phase::Sweep,
    Phase::Leave,
];

/// The scene before a step.
pub struct View<'a> {
    /// Poses of the objects.
    pub poses: &'a [Pose],
    /// Radius of the body [m].
    pub size: f64,
    /// Number of the step.
    pub step: usize,
    /// A direction in which nothing is in the way of the proxy, where there is one, the proxy, and the offset of the interface point from the
    /// device [m].
    pub exit_direction: &'a dyn Fn() -> Option<[DVec3; 3]>,
    /// Share of the stretch that the coupling's damper leaves after a step without force.
    pub lag: f64,
}

/// A device that moves at random.
pub struct RandomDevice {
    phase: Phase,
    /// Steps that remain of the phase.
    left: u32,
    object: usize,
    goal: DVec3,
    rate: f64,
    position: DVec3,
    /// Whether the proxy has left the body, so that no contact may hold it.
    pub has_left: bool,
}

impl RandomDevice {
    /// A device at the origin, which may be inside an object.
    pub fn new() -> Self {
        let zero = DVec3::ZERO;
        Self {
            phase: Phase::Wander,
            left: 0,
            object: 0,
            goal: zero,
            rate: 0.0,
            position: zero,
            has_left: false,
        }
    }

    /// Input of the next step.
    pub fn next(&mut self, random: &mut Random, view: &View) -> DeviceInput {
        if self.left == 0 {
            self.begin(random, view);
        }
        self.left -= 1;
        self.go(random, view)
    }

    fn begin(&mut self, random: &mut Random, view: &View) {
        self.phase = random.one_of(PHASES);
        self.left = 1 + (random.unit() * LONGEST_PHASE) as u32;
        self.object = (random.unit() * view.poses.len() as f64) as usize;
        self.goal = random.vector() * view.size;
        self.rate = random.within(0.002, 0.2);
        self.has_left = false;
        if self.phase == Phase::Leave {
            self.left = STAY;
            if let Some([direction, proxy, offset]) = (view.exit_direction)() {
                // With this position the coupling leads the proxy in that direction.
                let stretch = self.position + offset - proxy;
                self.position = proxy + direction * (FAR * view.size) + stretch * view.lag - offset;
                self.has_left = true;
            }
        }
    }

    fn go(&mut self, random: &mut Random, view: &View) -> DeviceInput {
        let pose = &view.poses[self.object];
        let centre = pose.position;
        let (size, odd) = (view.size, view.step % 2 == 1);
        match self.phase {
            Phase::Wander => {
                let tremor = random.vector() * (1e-3 * size);
                self.position += (centre + self.goal - self.position) * self.rate + tremor;
            }
            Phase::Teleport if random.chance(0.2) => self.position = centre + random.vector() * (1.5 * size),
            Phase::Shake => {
                self.position = centre + self.goal * if odd { 1.0 } else { 1.0 - 5.0 * self.rate };
            }
            Phase::Inside => self.position = pose.world_from_body(self.goal * 0.3) + random.vector() * 1e-4,
            Phase::NotFinite if random.chance(0.3) => return not_finite(random, self.position),
            Phase::NotFinite => self.position = centre + self.goal,
            Phase::AwayAndBack if random.chance(0.3) => return DeviceInput::inactive(),
            Phase::AwayAndBack => self.position = centre + self.goal * random.within(0.0, 2.0),
            Phase::Press => self.position += (centre - self.goal * 0.5 - self.position) * self.rate,
            Phase::Sweep => {
                // There and back through the centre, off it by a share of the size.
                let way = self.left as f64 * 5.0 * self.rate % 4.0 - 2.0;
                self.position = centre + self.goal * (way.abs() - 1.0) + self.goal.yzx() * (0.3 * self.rate);
            }
            Phase::Teleport | Phase::Leave => {}
        }
        DeviceInput::touching(self.position)
    }
}

/// A position of which one coordinate, or all, are not finite.
fn not_finite(random: &mut Random, position: DVec3) -> DeviceInput {
    let what = random.one_of([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
    let mut position = position;
    match random.one_of([0, 1, 2, 3]) {
        3 => position = DVec3::splat(what),
        axis => position[axis] = what,
    }
    DeviceInput::touching(position)
}
