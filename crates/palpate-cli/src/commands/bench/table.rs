//! Steps of an object on a recorded table, each beside the modal form of the same body.

use super::touch::{FINGER, HALF, on_a_floor};
use super::{Case, timed_step};
use crate::failure::Failure;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, Recording,
    ResponseForm, State,
};
use palpate_testkit::{closed_form_table, in_single_precision, start_at};
use std::f64::consts::TAU;
use std::sync::{Arc, OnceLock};

/// Samples T of the table, and the step [s]: the paper's.
const SAMPLES: usize = 500;
const STEP_S: f64 = 2e-3;

/// Steps in which the histories fill.
const FILLING: usize = SAMPLES;

/// Motion of the object, and of a finger or hands.
#[derive(Debug, Clone, Copy)]
enum Event {
    /// Motion by two held points within triangles.
    Held,
    /// Rest on a floor, on all nodes of a face.
    Lies,
    /// Rest on a floor while a finger slides over the object.
    Stroked,
    /// Fall from 5 cm and bounces on a floor, from the first step on.
    Falls,
}

const EVENTS: [(Event, &str); 4] = [
    (Event::Held, "2 points held within triangles"),
    (Event::Lies, "lies on a floor, all nodes of a face"),
    (Event::Stroked, "lies on a floor, a finger slides over it"),
    (Event::Falls, "falls on a floor from 5 cm, all steps"),
];

/// Cases with a cube of few cells.
pub fn cases(cube: Arc<Recording>) -> impl Iterator<Item = Case> {
    let table = Arc::new(OnceLock::new());
    EVENTS.into_iter().flat_map(move |(event, what)| {
        let case = |on_table: bool| -> Case {
            let (cube, table) = (cube.clone(), table.clone());
            let form = if on_table { "R[s], T = 500" } else { "modal form" };
            let run = move |steps| {
                let on_table = on_table.then(|| table.get_or_init(|| recorded_table(&cube)).clone());
                event_steps(&cube, on_table.unwrap_or_default(), event, steps)
            };
            (format!("table: 4³ cells, {what}, {form}"), Box::new(run))
        };
        [case(false), case(true)]
    })
}

/// Table in single precision, all of whose columns are computed.
fn recorded_table(cube: &Arc<Recording>) -> ResponseForm {
    let table = in_single_precision(closed_form_table(cube, SAMPLES, STEP_S));
    for column in 0..table.touchable_dofs.len() {
        table.columns.column(column);
    }
    ResponseForm::Fir(Arc::new(table))
}

/// Compute times of steps [ns].
fn event_steps(
    cube: &Arc<Recording>,
    response: ResponseForm,
    event: Event,
    steps: usize,
) -> Result<Vec<u32>, Failure> {
    let sides = [-HALF, HALF].map(|x| DVec3::new(x, 0.004, 0.006));
    let grasps: Vec<Grasp> = (sides.iter())
        .filter_map(|side| Some(Grasp { object: 0, point: cube.surface.nearest(*side)?.0 }))
        .collect();
    let parameters = match event {
        Event::Held => ModelParameters {
            devices: vec![DeviceParameters::default(); grasps.len()],
            ..ModelParameters::for_real_time()
        },
        Event::Stroked => ModelParameters { devices: vec![FINGER], ..on_a_floor(usize::MAX) },
        Event::Lies | Event::Falls => on_a_floor(usize::MAX),
    };
    let height = if matches!(event, Event::Falls) { 0.05 } else { 0.0 };
    let start = start_at(DVec3::Y * (HALF + height));
    let object = ModelObject { response, ..ModelObject::new(cube.clone(), start) };
    let parameters = ModelParameters { step_s: STEP_S, sleep_after_s: f64::INFINITY, ..parameters };
    let model = Model::new(parameters, vec![object])?;
    let mut state = State::new(&model);
    let filling = if matches!(event, Event::Falls) { 0 } else { FILLING };
    let mut times = Vec::new();
    for number in 0..filling + steps.min(2000) {
        let t = number as f64 * STEP_S;
        let devices = match event {
            Event::Held => {
                let sway = DVec3::new(0.006 * (12.0 * t).sin(), 0.004 * (5.0 * t).sin(), 0.0);
                let hand = |(grasp, side): (&Grasp, &DVec3)| {
                    DeviceInput::held(DVec3::Y * HALF + *side * 0.98 + sway, *grasp)
                };
                grasps.iter().zip(&sides).map(hand).collect()
            }
            Event::Stroked => {
                let across = DVec3::new(0.03 * (TAU * t).sin(), 0.0, 0.02 * (0.7 * TAU * t).sin());
                let top = 2.0 * HALF + FINGER.tip_radius - 0.003 * (t / 0.1).min(1.0);
                vec![DeviceInput::touching(across + DVec3::Y * top)]
            }
            Event::Lies | Event::Falls => vec![],
        };
        let time = timed_step(&model, &mut state, &Input { devices, ..Input::default() });
        if number >= filling {
            times.push(time);
        }
    }
    Ok(times)
}
