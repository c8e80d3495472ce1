//! Built-in scenes of bodies that ring: a bar, a tuning fork and a bell, each struck by a mallet every three seconds.
//!
//! The step is a quarter of a millisecond, since a force that is held longer has no bright sound (docs/sound.md).

use super::built_in::BuiltInScene;
use crate::recipe::RecordingRecipe;
use palpate::{Damping, Material};
use palpate_fem::{ElementOrder, Precision};

/// Time from blow to blow, and of the first [s].
const PERIOD_S: f64 = 3.0;
const BLOW_AT_S: f64 = 0.1;

/// Speed of a mallet [m/s], depth to which it would go without resistance, and distance at which it waits [m].
const SPEED: f64 = 1.0;
const DEPTH: f64 = 0.0006;
const AWAY: f64 = 0.03;

/// Distance of a mallet's tip from the surface at a time [m]: it comes, strikes for a millisecond, and goes.
fn mallet_distance(t: f64) -> f64 {
    (SPEED * (t - BLOW_AT_S).abs() - DEPTH).min(AWAY)
}

pub(super) const BAR: BuiltInScene = BuiltInScene {
    id: "bar",
    title: "A bar that rings",
    about: "A bar of a vibraphone on soft cords, A4, struck every three seconds. Turn on the sound; strike it yourself, and hold it: at a cord it rings on, in the middle it is quiet.",
    text: r#"
step = 0.00025
[[object]]
name = "bar"
recording = "@bar"
[[device]]
name = "cord1"
mode = "held"
attach = { object = "bar", point = [-0.0767, 0.0, -0.02] }
coupling = { stiffness = 300.0, damping = 0.3 }
path = { file = "cord1.csv", repeat = true }
[[device]]
name = "cord2"
mode = "held"
attach = { object = "bar", point = [-0.0767, 0.0, 0.02] }
coupling = { stiffness = 300.0, damping = 0.3 }
path = { file = "cord2.csv", repeat = true }
[[device]]
name = "cord3"
mode = "held"
attach = { object = "bar", point = [0.0767, 0.0, -0.02] }
coupling = { stiffness = 300.0, damping = 0.3 }
path = { file = "cord3.csv", repeat = true }
[[device]]
name = "cord4"
mode = "held"
attach = { object = "bar", point = [0.0767, 0.0, 0.02] }
coupling = { stiffness = 300.0, damping = 0.3 }
path = { file = "cord4.csv", repeat = true }
[[device]]
name = "mallet"
mode = "touch"
tip_radius = 0.008
friction = 0.3
coupling = { stiffness = 10000.0, damping = 0.5 }
path = { file = "mallet.csv", repeat = true }
[[device]]
name = "finger1"
mode = "touch"
pointer = true
tip_radius = 0.006
friction = 0.5
coupling = { stiffness = 2000.0, damping = 2.0 }
[[device]]
name = "finger2"
mode = "touch"
pointer = true
tip_radius = 0.006
friction = 0.5
coupling = { stiffness = 2000.0, damping = 2.0 }
"#,
    paths: &[
        ("cord1.csv", |_| [-0.0767, 0.0, -0.02]),
        ("cord2.csv", |_| [-0.0767, 0.0, 0.02]),
        ("cord3.csv", |_| [0.0767, 0.0, -0.02]),
        ("cord4.csv", |_| [0.0767, 0.0, 0.02]),
        // Upper side, 1.05 mm nearer to the centre of mass than to the middle of the box.
        ("mallet.csv", |t| [0.01, 0.00545 + 0.008 + mallet_distance(t), 0.005]),
    ],
    period_s: PERIOD_S,
};

pub(super) const FORK: BuiltInScene = BuiltInScene {
    id: "fork",
    title: "A tuning fork",
    about: "A tuning fork of 440 Hz whose stem is clamped, struck every three seconds. Turn on the sound; touch a tine and it is quiet.",
    text: r#"
step = 0.00025
[[object]]
name = "fork"
recording = "@fork"
[[clamp]]
name = "grip"
object = "fork"
face = { point = [0.0, -0.0648, 0.0] }
max_cells = 4
[[device]]
name = "mallet"
mode = "touch"
tip_radius = 0.004
friction = 0.3
coupling = { stiffness = 2000.0, damping = 0.1 }
path = { file = "mallet.csv", repeat = true }
[[device]]
name = "finger1"
mode = "touch"
pointer = true
tip_radius = 0.003
friction = 0.5
coupling = { stiffness = 500.0, damping = 0.5 }
[[device]]
name = "finger2"
mode = "touch"
pointer = true
tip_radius = 0.003
friction = 0.5
coupling = { stiffness = 500.0, damping = 0.5 }
"#,
    paths: &[("mallet.csv", |t| [0.008 + 0.004 + mallet_distance(t), 0.06, 0.0005])],
    period_s: PERIOD_S,
};

pub(super) const BELL: BuiltInScene = BuiltInScene {
    id: "bell",
    title: "A bell",
    about: "A hand bell of bronze, hung at its crown and struck every three seconds. Turn on the sound; strike it anywhere, and take it by its lip.",
    text: r#"
step = 0.00025
[[object]]
name = "bell"
recording = "@bell"
[[device]]
name = "cord1"
mode = "held"
attach = { object = "bell", point = [-0.02, 0.038, 0.0] }
coupling = { stiffness = 1000.0, damping = 1.0 }
path = { file = "cord1.csv", repeat = true }
[[device]]
name = "cord2"
mode = "held"
attach = { object = "bell", point = [0.02, 0.038, 0.0] }
coupling = { stiffness = 1000.0, damping = 1.0 }
path = { file = "cord2.csv", repeat = true }
[[device]]
name = "cord3"
mode = "held"
attach = { object = "bell", point = [0.0, 0.038, -0.02] }
coupling = { stiffness = 1000.0, damping = 1.0 }
path = { file = "cord3.csv", repeat = true }
[[device]]
name = "cord4"
mode = "held"
attach = { object = "bell", point = [0.0, 0.038, 0.02] }
coupling = { stiffness = 1000.0, damping = 1.0 }
path = { file = "cord4.csv", repeat = true }
[[device]]
name = "mallet"
mode = "touch"
tip_radius = 0.004
friction = 0.3
coupling = { stiffness = 10000.0, damping = 0.5 }
path = { file = "mallet.csv", repeat = true }
[[device]]
name = "finger1"
mode = "touch"
pointer = true
tip_radius = 0.005
friction = 0.5
coupling = { stiffness = 2000.0, damping = 2.0 }
[[device]]
name = "finger2"
mode = "touch"
pointer = true
tip_radius = 0.005
friction = 0.5
coupling = { stiffness = 2000.0, damping = 2.0 }
"#,
    paths: &[
        ("cord1.csv", |_| [-0.02, 0.038, 0.0]),
        ("cord2.csv", |_| [0.02, 0.038, 0.0]),
        ("cord3.csv", |_| [0.0, 0.038, -0.02]),
        ("cord4.csv", |_| [0.0, 0.038, 0.02]),
        // The wall leans outwards: a tip of 4 mm meets it 4.4 mm before its place along x.
        ("mallet.csv", |t| [0.04995 + 0.0044 + mallet_distance(t), -0.0251, 0.0]),
    ],
    period_s: PERIOD_S,
};

/// Recipe of an instrument by its name in a built-in scene. Loss factors of metals are 10⁻⁴ to 10⁻³, twice the damping ratio (Cremer, Heckl,
/// Petersson, Structure-Borne Sound, 2005).
pub(super) fn recipe(name: &str) -> Option<RecordingRecipe> {
    let aluminium = Material::isotropic(6.9e10, 0.33, 2700.0);
    // Tin bronze: Rossing, Science of Percussion Instruments, 2000.
    let bronze = Material::isotropic(1.05e11, 0.34, 8700.0);
    let (material, modes, ratio) = match name {
        "bar" => (aluminium, 40, 3e-4),
        "fork" => (aluminium, 24, 2e-4),
        "bell" => (bronze, 40, 2e-4),
        _ => return None,
    };
    let (source, damping) = (format!("instrument:{name}"), Damping::Ratio(ratio));
    let recipe = RecordingRecipe::new(source, material, ElementOrder::Quadratic, modes, damping);
    Some(RecordingRecipe { precision: Precision::Compact, ..recipe })
}
