//! Built-in scenes of soft bodies: a liver with a lump to be found, a jelly that wobbles, a gripper of two soft fingers, and a duck.

use super::built_in::{BuiltInScene, between};
use crate::recipe::RecordingRecipe;
use palpate::{Damping, Material};
use palpate_fem::{ElementOrder, Precision};

pub(super) const LIVER: BuiltInScene = BuiltInScene {
    id: "liver",
    title: "A liver with a lump",
    about: "Somewhere in this liver is a lump, ten times as stiff. Press with a finger and find it: the force at the top tells, where the eye does not.",
    text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "liver"
recording = "@liver"
position = [0.00827, 0.0191, 0.00435]
start = "equilibrium"
[[plane]]
name = "table"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 0.5
"#,
    paths: &[],
    period_s: 0.0,
};

pub(super) const JELLY: BuiltInScene = BuiltInScene {
    id: "jelly",
    title: "A jelly on a plate",
    about: "A jelly fresh out of its mould, on a plate that gets a nudge every six seconds. Tap it and watch it wobble; press it flat; pull at it.",
    text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "jelly"
recording = "@pudding"
path = { file = "jelly.csv", repeat = true }
start = "equilibrium"
[[plane]]
name = "table"
point = [0.0, -0.0104, 0.0]
normal = [0.0, 1.0, 0.0]
[[obstacle]]
name = "plate"
box = { half_extents = [0.075, 0.005, 0.075] }
path = { file = "plate.csv", repeat = true }
"#,
    paths: &[("jelly.csv", |t| [nudge(t), JELLY_HEIGHT, 0.0]), ("plate.csv", |t| [nudge(t), -0.0052, 0.0])],
    period_s: 6.0,
};

/// Height of the jelly's centre of mass above its underside [m].
const JELLY_HEIGHT: f64 = 0.0262;

/// Nudge of the plate along x [m]: there and back.
fn nudge(t: f64) -> f64 {
    0.012 * between(t, 0.5, 0.62) * between(t, 0.9, 0.78)
}

pub(super) const GRIPPER: BuiltInScene = BuiltInScene {
    id: "gripper",
    title: "A gripper of two soft fingers",
    about: "Two fingers of silicone close on a soft cube, lift it and set it down, every eight seconds. Push the cube while it hangs, bend a finger, or take the cube away: it slides back.",
    text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "cube"
recording = "@morsel"
position = [0.0, 0.025, 0.0]
friction = 0.9
[[object]]
name = "left-finger"
recording = "@finger"
path = { file = "left.csv", repeat = true }
start = "equilibrium"
friction = 0.9
[[object]]
name = "right-finger"
recording = "@finger"
path = { file = "right.csv", repeat = true }
start = "equilibrium"
friction = 0.9
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 0.1
[[plane]]
name = "left-bank"
point = [-0.036, 0.0, 0.0]
normal = [0.342, 0.9397, 0.0]
friction = 0.1
[[plane]]
name = "right-bank"
point = [0.036, 0.0, 0.0]
normal = [-0.342, 0.9397, 0.0]
friction = 0.1
[[plane]]
name = "front-bank"
point = [0.0, 0.0, 0.036]
normal = [0.0, 0.9397, -0.342]
friction = 0.1
[[plane]]
name = "back-bank"
point = [0.0, 0.0, -0.036]
normal = [0.0, 0.9397, 0.342]
friction = 0.1
"#,
    paths: &[("left.csv", |t| gripping(-1.0, t)), ("right.csv", |t| gripping(1.0, t))],
    period_s: 8.0,
};

/// Half of the cube's side, half of a finger's thickness, and height of its middle above the floor while it closes [m].
const HALF_CUBE: f64 = 0.025;
const HALF_FINGER: f64 = 0.012;
const FINGER_HEIGHT: f64 = 0.056;

/// Middle of the finger on one side (−1 left, 1 right): down, closed, up with the cube, down again, open, up.
fn gripping(side: f64, t: f64) -> [f64; 3] {
    let away = 0.012 - 0.019 * between(t, 1.5, 2.1) * between(t, 6.6, 6.0);
    // Up for long enough that a cube beside them slides back.
    let above = 0.06 * (1.0 - between(t, 0.7, 1.4) * between(t, 7.3, 6.7));
    let lift = 0.06 * between(t, 2.3, 3.3) * between(t, 5.9, 4.9);
    [side * (HALF_CUBE + HALF_FINGER + away), FINGER_HEIGHT + above + lift, 0.0]
}

pub(super) const DUCK: BuiltInScene = BuiltInScene {
    id: "duck",
    title: "A rubber duck",
    about: "A bath duck of foam rubber. Squeeze it between two fingers, bend its neck, stroke its head, throw it: it slides back.",
    text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "duck"
recording = "@duck"
position = [0.0, 0.07, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 1.0
[[plane]]
name = "left-bank"
point = [-0.15, 0.0, 0.0]
normal = [0.5, 0.866, 0.0]
friction = 0.2
[[plane]]
name = "right-bank"
point = [0.15, 0.0, 0.0]
normal = [-0.5, 0.866, 0.0]
friction = 0.2
[[plane]]
name = "front-bank"
point = [0.0, 0.0, 0.15]
normal = [0.0, 0.866, -0.5]
friction = 0.2
[[plane]]
name = "back-bank"
point = [0.0, 0.0, -0.15]
normal = [0.0, 0.866, 0.5]
friction = 0.2
"#,
    paths: &[],
    period_s: 0.0,
};

/// Recipe of a soft body by its name in a built-in scene.
pub(super) fn recipe(name: &str) -> Option<RecordingRecipe> {
    let of = |source: &str, (young, poisson, density), modes: usize, (alpha, beta)| RecordingRecipe {
        precision: Precision::Compact,
        ..RecordingRecipe::new(
            source,
            Material::isotropic(young, poisson, density),
            ElementOrder::Linear,
            modes,
            Damping::Rayleigh { alpha, beta },
        )
    };
    Some(match name {
        "liver" => RecordingRecipe {
            inclusion_stiffness: 10.0,
            fix: vec!["underside".into()],
            ..of("body:liver", (4000.0, 0.45, 1060.0), 100, (4.0, 2e-3))
        },
        // A damping ratio of 4 %.
        "pudding" => RecordingRecipe {
            order: ElementOrder::Quadratic,
            fix: vec!["underside".into()],
            ..of("body:jelly", (4000.0, 0.45, 1010.0), 80, (1.0, 1e-3))
        },
        "duck" => of("body:duck", (3e4, 0.3, 100.0), 80, (4.0, 5e-4)),
        "morsel" => of("box:0.05x0.05x0.05/8x8x8", (5000.0, 0.4, 200.0), 60, (2.0, 1e-3)),
        "finger" => RecordingRecipe {
            fix: vec!["y>0.0399".into()],
            ..of("box:0.024x0.08x0.034/4x12x6", (1.5e5, 0.45, 1070.0), 60, (4.0, 3e-3))
        },
        _ => return None,
    })
}
