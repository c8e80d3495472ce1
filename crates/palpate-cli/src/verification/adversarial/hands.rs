//! What random hands do: phases of some steps each, picked at random.

use super::super::random::Random;
use glam::{DVec3, Vec3Swizzles};
use palpate::{DeviceInput, Pose};

/// Longest phase [steps].
const LONGEST: f64 = 150.0;

/// An escape goes as far as this, in sizes of the body, and stays there for so many steps.
const FAR: f64 = 20.0;
const STAY: u32 = 3;

/// What a hand does for a while, about an object; `goal` is a place relative to it.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    /// It goes smoothly, with a tremor.
    Wander,
    /// It jumps now and then.
    Teleport,
    /// It alternates between two places, at the Nyquist rate.
    Shake,
    /// It is inside, or where the inside would be.
    Inside,
    /// It gives positions that are no numbers.
    NoNumber,
    /// It goes away and comes back.
    AwayAndBack,
    /// It goes into the object and on.
    Press,
    /// It passes through, farther in a step than a plate is thick.
    Sweep,
    /// It leaves, and nothing is in its way.
    Escape,
}

const PHASES: [Phase; 9] = [
    Phase::Wander,
    Phase::Teleport,
    Phase::Shake,
    Phase::Inside,
    Phase::NoNumber,
    Phase::AwayAndBack,
    Phase::Press,
    Phase::Sweep,
    Phase::Escape,
];

/// What a hand sees before a step.
pub struct View<'a> {
    /// Where the objects are.
    pub poses: &'a [Pose],
    /// Radius of the body [m].
    pub size: f64,
    /// The number of the step.
    pub step: usize,
    /// A direction in which nothing is in the way of the proxy, and the proxy [m], if asked for and if there is one.
    pub way_out: &'a dyn Fn() -> Option<(DVec3, DVec3)>,
    /// The share of what the proxy is behind the hand that it is behind after a step in which nothing holds it.
    pub lag: f64,
}

/// A random hand.
pub struct Hand {
    phase: Phase,
    /// Steps that are left of it.
    left: u32,
    object: usize,
    goal: DVec3,
    rate: f64,
    position: DVec3,
    /// Whether it is where nothing can be in touch with it.
    pub escaped: bool,
}

impl Hand {
    /// It begins anywhere, also inside.
    pub fn new() -> Self {
        let zero = DVec3::ZERO;
        Self {
            phase: Phase::Wander,
            left: 0,
            object: 0,
            goal: zero,
            rate: 0.0,
            position: zero,
            escaped: false,
        }
    }

    /// What it does in the next step.
    pub fn next(&mut self, random: &mut Random, view: &View) -> DeviceInput {
        if self.left == 0 {
            self.begin(random, view);
        }
        self.left -= 1;
        self.go(random, view)
    }

    fn begin(&mut self, random: &mut Random, view: &View) {
        self.phase = random.one_of(PHASES);
        self.left = 1 + (random.unit() * LONGEST) as u32;
        self.object = (random.unit() * view.poses.len() as f64) as usize;
        self.goal = random.vector() * view.size;
        self.rate = random.within(0.002, 0.2);
        self.escaped = false;
        if self.phase == Phase::Escape {
            self.left = STAY;
            if let Some((direction, proxy)) = (view.way_out)() {
                // The proxy goes in that direction.
                self.position = proxy + direction * (FAR * view.size) + (self.position - proxy) * view.lag;
                self.escaped = true;
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
            Phase::NoNumber if random.chance(0.3) => return no_number(random, self.position),
            Phase::NoNumber => self.position = centre + self.goal,
            Phase::AwayAndBack if random.chance(0.3) => return DeviceInput::inactive(),
            Phase::AwayAndBack => self.position = centre + self.goal * random.within(0.0, 2.0),
            Phase::Press => self.position += (centre - self.goal * 0.5 - self.position) * self.rate,
            Phase::Sweep => {
                // There and back through the centre, beside it by a share of the size.
                let way = self.left as f64 * 5.0 * self.rate % 4.0 - 2.0;
                self.position = centre + self.goal * (way.abs() - 1.0) + self.goal.yzx() * (0.3 * self.rate);
            }
            Phase::Teleport | Phase::Escape => {}
        }
        DeviceInput::touching(self.position)
    }
}

/// A position with one coordinate, or all, that is no number.
fn no_number(random: &mut Random, position: DVec3) -> DeviceInput {
    let what = random.one_of([f64::NAN, f64::INFINITY, f64::NEG_INFINITY]);
    let mut position = position;
    match random.one_of([0, 1, 2, 3]) {
        3 => position = DVec3::splat(what),
        axis => position[axis] = what,
    }
    DeviceInput::touching(position)
}
