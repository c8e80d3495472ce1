//! Built-in scenes, as scene files with recipes for their recordings and functions for their paths.

use super::{instruments, soft_scenes};
use crate::recipe::RecordingRecipe;
use palpate::{Damping, Material};
use palpate_fem::paper_cube::CELLS;
use palpate_fem::{ElementOrder, Precision, paper_cube};
use std::f64::consts::TAU;

/// Built-in scene.
pub struct BuiltInScene {
    /// Identifier.
    pub id: &'static str,
    /// Title.
    pub title: &'static str,
    /// Description, with what one can do.
    pub about: &'static str,
    /// Scene file; a recording that begins with `@` names a recipe.
    pub(super) text: &'static str,
    /// Path files and their functions, over one period.
    pub(super) paths: &'static [(&'static str, Path)],
    /// Period of the paths [s].
    pub(super) period_s: f64,
}

/// Position at a time [s] [m, world].
type Path = fn(f64) -> [f64; 3];

/// Interval of the rows of paths [s].
const ROW_INTERVAL_S: f64 = 0.002;

/// All built-in scenes; the first is the default.
pub const BUILT_IN_SCENES: [BuiltInScene; 13] = [
    BuiltInScene {
        id: "bounce",
        title: "A soft cube falls and bounces",
        about: "The paper's cube falls from 5 cm (figure 5a). Poke it, squeeze it with two fingers, throw it: it slides back.",
        text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "cube"
recording = "@cube"
position = [0.0, 0.1, 0.0]
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
    },
    BuiltInScene {
        id: "shake",
        title: "Two hands shake a cube",
        about: "Two hands hold the middles of two faces and shake it at 2 Hz, free of gravity (figure 5b). Touch it meanwhile.",
        text: r#"
[[object]]
name = "cube"
recording = "@cube"
[[device]]
name = "left"
mode = "held"
attach = { object = "cube", point = [-0.05, 0.0, 0.0] }
path = { file = "left.csv", repeat = true }
[[device]]
name = "right"
mode = "held"
attach = { object = "cube", point = [0.05, 0.0, 0.0] }
path = { file = "right.csv", repeat = true }
"#,
        paths: &[("left.csv", |t| shaking(-1.0, t)), ("right.csv", |t| shaking(1.0, t))],
        period_s: 10.0,
    },
    BuiltInScene {
        id: "pinch",
        title: "Two fingers pinch and lift",
        about: "Two fingers squeeze the cube, lift it by friction alone, shake it and put it down into a hollow, again and again.",
        text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "cube"
recording = "@jelly"
position = [0.0, 0.05, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 1.0
[[plane]]
name = "left-bank"
point = [-0.058, 0.0, 0.0]
normal = [0.7071, 0.7071, 0.0]
friction = 0.1
[[plane]]
name = "right-bank"
point = [0.058, 0.0, 0.0]
normal = [-0.7071, 0.7071, 0.0]
friction = 0.1
[[plane]]
name = "front-bank"
point = [0.0, 0.0, 0.058]
normal = [0.0, 0.7071, -0.7071]
friction = 0.1
[[plane]]
name = "back-bank"
point = [0.0, 0.0, -0.058]
normal = [0.0, 0.7071, 0.7071]
friction = 0.1
[[device]]
name = "left"
mode = "touch"
tip_radius = 0.005
patch_radius = 0.03
friction = 0.8
coupling = { stiffness = 500.0, damping = 1.0 }
path = { file = "left.csv", repeat = true }
[[device]]
name = "right"
mode = "touch"
tip_radius = 0.005
patch_radius = 0.03
friction = 0.8
coupling = { stiffness = 500.0, damping = 1.0 }
path = { file = "right.csv", repeat = true }
"#,
        paths: &[("left.csv", |t| pinching(-1.0, t)), ("right.csv", |t| pinching(1.0, t))],
        period_s: 8.0,
    },
    BuiltInScene {
        id: "stack",
        title: "A stack of two",
        about: "A soft cube lands on a larger, firmer block. Push the tower over, or pull the block away.",
        text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "block"
recording = "@block"
position = [0.0, 0.04, 0.0]
[[object]]
name = "cube"
recording = "@small"
position = [0.0, 0.14, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
friction = 1.0
[[plane]]
name = "left-bank"
point = [-0.2, 0.0, 0.0]
normal = [0.5, 0.866, 0.0]
friction = 0.2
[[plane]]
name = "right-bank"
point = [0.2, 0.0, 0.0]
normal = [-0.5, 0.866, 0.0]
friction = 0.2
[[plane]]
name = "front-bank"
point = [0.0, 0.0, 0.2]
normal = [0.0, 0.866, -0.5]
friction = 0.2
[[plane]]
name = "back-bank"
point = [0.0, 0.0, -0.2]
normal = [0.0, 0.866, 0.5]
friction = 0.2
"#,
        paths: &[],
        period_s: 0.0,
    },
    BuiltInScene {
        id: "ball",
        title: "A soft ball among obstacles",
        about: "A ball rolls down a ramp into a hollow with a post and a rail. Catch it, press it through, send it back.",
        text: r#"
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "ball"
recording = "@ball"
position = [-0.16, 0.19, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
[[obstacle]]
name = "ramp"
box = { half_extents = [0.12, 0.01, 0.08] }
position = [-0.12, 0.07, 0.0]
orientation = [0.9781476007338057, 0.0, 0.0, -0.20791169081775934]
[[obstacle]]
name = "post"
sphere = { radius = 0.03 }
position = [0.13, 0.03, 0.03]
[[obstacle]]
name = "rail"
capsule = { radius = 0.012, half_length = 0.12 }
position = [0.22, 0.02, 0.0]
orientation = [0.7071067811865476, 0.7071067811865476, 0.0, 0.0]
[[plane]]
name = "left-bank"
point = [-0.005, 0.0, 0.0]
normal = [0.5, 0.866, 0.0]
friction = 0.5
[[plane]]
name = "right-bank"
point = [0.3, 0.0, 0.0]
normal = [-0.5, 0.866, 0.0]
friction = 0.5
[[plane]]
name = "front-bank"
point = [0.0, 0.0, 0.1]
normal = [0.0, 0.866, -0.5]
friction = 0.5
[[plane]]
name = "back-bank"
point = [0.0, 0.0, -0.1]
normal = [0.0, 0.866, 0.5]
friction = 0.5
"#,
        paths: &[],
        period_s: 0.0,
    },
    BuiltInScene {
        id: "slab",
        title: "A slab in weightlessness",
        about: "A thin slab that floats: flick its edge and watch the waves run through it. Four soft threads bring it back.",
        text: r#"
[[object]]
name = "slab"
recording = "@slab"
angular_velocity = [0.0, 0.4, 0.0]
[[device]]
name = "left"
mode = "held"
attach = { object = "slab", point = [-0.12, 0.0, 0.0] }
coupling = { stiffness = 2.0, damping = 0.1 }
path = { file = "left.csv", repeat = true }
[[device]]
name = "right"
mode = "held"
attach = { object = "slab", point = [0.12, 0.0, 0.0] }
coupling = { stiffness = 2.0, damping = 0.1 }
path = { file = "right.csv", repeat = true }
[[device]]
name = "front"
mode = "held"
attach = { object = "slab", point = [0.0, 0.0, 0.06] }
coupling = { stiffness = 2.0, damping = 0.1 }
path = { file = "front.csv", repeat = true }
[[device]]
name = "back"
mode = "held"
attach = { object = "slab", point = [0.0, 0.0, -0.06] }
coupling = { stiffness = 2.0, damping = 0.1 }
path = { file = "back.csv", repeat = true }
"#,
        paths: &[
            ("left.csv", |_| [-0.12, 0.0, 0.0]),
            ("right.csv", |_| [0.12, 0.0, 0.0]),
            ("front.csv", |_| [0.0, 0.0, 0.06]),
            ("back.csv", |_| [0.0, 0.0, -0.06]),
        ],
        period_s: 1.0,
    },
    soft_scenes::LIVER,
    soft_scenes::JELLY,
    soft_scenes::GRIPPER,
    soft_scenes::DUCK,
    instruments::BAR,
    instruments::FORK,
    instruments::BELL,
];

/// The paper's cube with a number of cells along each side, and of modes.
pub fn paper_cube_recipe(cells: u32, modes: usize) -> RecordingRecipe {
    let (source, material) = (paper_cube::source(cells), paper_cube::material());
    RecordingRecipe::new(source, material, ElementOrder::Linear, modes, paper_cube::DAMPING)
}

/// Recipe by its name for a small file: at most 3 MB for 100 modes, most of which is the compliance between all surface nodes. The paper's cube
/// has 10 cells along a side in place of 12.
pub(super) fn small_recipe(name: &str, modes: usize) -> Option<RecordingRecipe> {
    let recipe = recipe(name)?;
    let source =
        if recipe.source == paper_cube::source(CELLS) { paper_cube::source(10) } else { recipe.source };
    Some(RecordingRecipe { source, modes: recipe.modes.min(modes), precision: Precision::Compact, ..recipe })
}

/// Names of the recipes in the text of a built-in scene, each once.
pub(super) fn recipe_names(text: &str) -> Vec<&str> {
    let mut names: Vec<&str> = text.split("\"@").skip(1).filter_map(|rest| rest.split('"').next()).collect();
    names.sort_unstable();
    names.dedup();
    names
}

/// Recipe by its name in a built-in scene.
pub(super) fn recipe(name: &str) -> Option<RecordingRecipe> {
    let cube = || paper_cube_recipe(CELLS, 200);
    let of =
        |source: &str, young: f64, poisson: f64, density: f64, modes: usize, beta: f64| RecordingRecipe {
            source: source.into(),
            material: Material::isotropic(young, poisson, density),
            modes,
            damping: Damping::Rayleigh { alpha: 2.0, beta },
            ..cube()
        };
    Some(match name {
        "cube" => cube(),
        "jelly" => {
            RecordingRecipe { modes: 100, damping: Damping::Rayleigh { alpha: 2.0, beta: 1e-3 }, ..cube() }
        }
        "block" => of("box:0.14x0.08x0.14/12x7x12", 6000.0, 0.45, 200.0, 120, 5e-4),
        "small" => of("box:0.08x0.08x0.08/8x8x8", 2500.0, 0.45, 110.0, 120, 1e-3),
        "ball" => of("sphere:0.05/8", 4000.0, 0.45, 150.0, 150, 5e-4),
        "slab" => of("box:0.24x0.02x0.12/24x2x12", 8000.0, 0.4, 150.0, 150, 2e-4),
        _ => return soft_scenes::recipe(name).or_else(|| instruments::recipe(name)),
    })
}

/// Path over one period as CSV.
pub(super) fn path_text(at: Path, period_s: f64) -> String {
    let mut text = String::from("t,x,y,z\n");
    for row in 0..=(period_s / ROW_INTERVAL_S).round() as u32 {
        let t = f64::from(row) * ROW_INTERVAL_S;
        let [x, y, z] = at(t);
        text += &format!("{t:.3},{x:.7},{y:.7},{z:.7}\n");
    }
    text
}

/// The hand on one side (−1 left, 1 right): 3 mm in, 1 cm to either side at 2 Hz, and a rest in which the cube can be looked at.
fn shaking(side: f64, t: f64) -> [f64; 3] {
    let squeeze = 0.003 * between(t, 0.0, 0.2) * between(t, 10.0, 9.6);
    let swing = 0.01 * between(t, 0.2, 0.5) * between(t, 7.5, 7.0) * (TAU * 2.0 * (t - 0.2)).sin();
    [side * (0.05 - squeeze) + swing, 0.0, 0.0]
}

/// The finger on one side: closes, lifts, shakes, puts down and opens. It takes the cube a centimetre above its centre of mass, so that it
/// hangs, and opens so far that a finger slips off where it has come behind the cube.
fn pinching(side: f64, t: f64) -> [f64; 3] {
    let squeeze = 0.015 * between(t, 0.6, 1.2) * between(t, 7.2, 6.6);
    let height = 0.05 * between(t, 1.4, 2.4) * between(t, 6.4, 5.4);
    let swing = 0.01 * between(t, 2.6, 3.0) * between(t, 5.2, 4.8) * (TAU * 2.0 * (t - 2.6)).sin();
    let away = 0.08 * (1.0 - between(t, 0.0, 0.5) * between(t, 7.7, 7.2));
    [side * (0.05 + 0.005 + 0.004 + away - squeeze), 0.06 + height + swing, 0.0]
}

/// Smooth ramp from 0 at `from` to 1 at `to`, in either order.
pub(super) fn between(t: f64, from: f64, to: f64) -> f64 {
    let share = ((t - from) / (to - from)).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}
