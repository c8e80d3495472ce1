//! Built-in scenes for a minute without anybody, and for one with random pointers, as the page runs them: 48 contact samples, 1 ms,
//! touches with the pointers' own coupling.
//!
//! Objects stay in reach and in shape, come back to rest where nothing drives them, flat where the scene needs it, and not inside what they lie
//! on. The ledger is exact, no energy is gained, and contacts give back a share of the losses at most, by (C38) and of tips alone:
//!
//! ```text
//! stored − stored at the start ≤ input        Σ max(0, −Δimpact) ≤ share·(dissipated + friction + impact)
//! ```
//!
//! Equations: docs/theory.md (C38), (C47).

mod observer;

use crate::check::Check;
use crate::error::VerifyError;
use glam::DVec3;
use observer::Observer;
use palpate::{DeviceInput, State, step};
use palpate_scene::{OpenedScene, SceneLibrary, SilentProgress};
use palpate_testkit::{Random, RandomPointer};
use rayon::prelude::*;

/// Time without anybody [s]: a whole number of periods of all paths, so that fingers are open at the end.
const ALONE_S: f64 = 64.0;

/// Time with pointers, and without them at the end [s]; together as above.
const POINTERS_S: [f64; 2] = [26.0, 38.0];

/// Seed of the pointers.
const SEED: u64 = 7;

/// Expectations of a scene.
struct BuiltIn {
    id: &'static str,
    /// Middle of the region in which centres of mass are at the end, and its half extent [m].
    middle: [f64; 3],
    reach: [f64; 3],
    /// Whether paths or fingers move it for ever.
    is_driven: bool,
    /// Whether cubes lie on one of their faces at the end.
    lies_flat: bool,
}

const SCENES: [BuiltIn; 10] = [
    BuiltIn {
        id: "bounce",
        middle: [0.0, 0.05, 0.0],
        reach: [0.25, 0.06, 0.25],
        is_driven: false,
        lies_flat: false,
    },
    BuiltIn { id: "shake", middle: [0.0; 3], reach: [0.03; 3], is_driven: true, lies_flat: false },
    BuiltIn {
        id: "pinch",
        middle: [0.0, 0.1, 0.0],
        reach: [0.03, 0.1, 0.03],
        is_driven: true,
        lies_flat: true,
    },
    BuiltIn {
        id: "stack",
        middle: [0.0, 0.08, 0.0],
        reach: [0.3, 0.1, 0.3],
        is_driven: false,
        lies_flat: false,
    },
    BuiltIn {
        id: "ball",
        middle: [0.03, 0.1, 0.0],
        reach: [0.28, 0.12, 0.16],
        is_driven: false,
        lies_flat: false,
    },
    BuiltIn { id: "slab", middle: [0.0; 3], reach: [0.1; 3], is_driven: true, lies_flat: false },
    BuiltIn {
        id: "liver",
        middle: [0.008, 0.019, 0.004],
        reach: [1e-3; 3],
        is_driven: false,
        lies_flat: false,
    },
    BuiltIn {
        id: "jelly",
        middle: [0.0, 0.0262, 0.0],
        reach: [0.013, 1e-3, 1e-3],
        is_driven: true,
        lies_flat: false,
    },
    BuiltIn {
        id: "gripper",
        middle: [0.0, 0.07, 0.0],
        reach: [0.06, 0.07, 0.03],
        is_driven: true,
        lies_flat: true,
    },
    BuiltIn {
        id: "duck",
        middle: [0.0, 0.05, 0.0],
        reach: [0.25, 0.03, 0.25],
        is_driven: false,
        lies_flat: false,
    },
];

/// Checks of all scenes.
pub fn built_in_scenes() -> Result<Vec<Check>, VerifyError> {
    let library = SceneLibrary::new(None)?;
    let runs = SCENES.iter().flat_map(|scene| [(scene, false), (scene, true)]);
    let opened = runs.map(|(scene, with_pointers)| {
        Ok((scene, with_pointers, library.open_built_in(scene.id, &mut SilentProgress)?))
    });
    let opened: Vec<(&BuiltIn, bool, OpenedScene)> = opened.collect::<Result<_, VerifyError>>()?;
    let checks =
        opened.par_iter().map(|(built_in, with_pointers, opened)| run(built_in, *with_pointers, opened));
    Ok(checks.collect::<Vec<_>>().into_iter().flatten().collect())
}

/// One scene from its start to its end.
fn run(built_in: &BuiltIn, with_pointers: bool, opened: &OpenedScene) -> Vec<Check> {
    let scene = &opened.scene;
    let model = &scene.model;
    let h = model.parameters().step_s;
    let [active_s, rest_s] = if with_pointers { POINTERS_S } else { [0.0, ALONE_S] };
    let steps = ((active_s + rest_s) / h) as u64;
    let mut state = State::new(model);
    let mut observer = Observer::new(&state);
    let mut random = Random::from_pair(built_in.id.len() as u64, SEED);
    let slots = scene.devices.iter().enumerate().filter(|(_, device)| device.pointer);
    let mut pointers: Vec<(usize, RandomPointer)> =
        slots.map(|(slot, device)| (slot, RandomPointer::new(device.parameters.tip_radius))).collect();
    let mut input = scene.input_at(0.0);
    for number in 1..=steps {
        let time = number as f64 * h;
        scene.follow_paths(time, &mut input);
        for (slot, _) in scene.devices.iter().enumerate().filter(|(_, device)| device.pointer) {
            input.devices[slot] = DeviceInput::inactive();
        }
        if time < active_s {
            for (slot, pointer) in &mut pointers {
                input.devices[*slot] = pointer.next(&mut random, model, state.output(), h);
            }
        }
        step(model, &mut state, &input);
        observer.observe(model, &state, number);
    }
    let of = format!("{}, {}", built_in.id, if with_pointers { "pointers" } else { "alone" });
    let centre = DVec3::from(built_in.middle);
    let reach = DVec3::from(built_in.reach);
    observer.checks(&of, model, &state, (centre, reach), (built_in.is_driven, built_in.lies_flat))
}
