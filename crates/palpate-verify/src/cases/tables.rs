//! Recorded tables against the modal form: bodies that fall, tumble, lie on one another and are pressed by fingers, by convolution with
//! tables that hold the modal form's own responses.

use crate::check::Check;
use crate::error::VerifyError;
use glam::{DQuat, DVec3};
use palpate::{
    DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, Output, Recording,
    ResponseForm, State, step,
};
use palpate_fem::ElementOrder;
use palpate_testkit::{
    BodyShape, Fineness, GRAVITY_M_S2, SOFT, closed_form_table, floor, half_extent, in_single_precision,
    object_at, smoothstep,
};
use std::sync::Arc;

const STEP_S: f64 = 1e-3;

/// Steps of a scene, and samples of its tables.
const STEPS: usize = 250;

const MODES: usize = 60;

/// Largest difference of a force from the modal form's, relative to the largest force, with tables in double and in single precision [1]:
/// what is left of their round-off after contacts have come, gone and slid.
const DOUBLE: f64 = 1e-9;
const SINGLE: f64 = 1e-4;

/// Amplification of the round-off of single precision by two thin sheets on one another, beyond that of the others.
const SHEET_ON_SHEET: f64 = 10.0;

/// Two thin sheets on one another have more contacts than modes and amplify round-off: a table may differ from the modal form by so many times what
/// gravity that differs by two units of the last place changes the modal form's own forces.
const OF_ROUND_OFF: f64 = 4.0;

/// Tip radius of the fingers [m].
const TIP_RADIUS: f64 = 5e-3;

/// A scene: objects, devices, and what the devices do.
struct Scene {
    name: &'static str,
    objects: Vec<ModelObject>,
    devices: Vec<DeviceParameters>,
    input: fn(height: f64, t: f64) -> Input,
}

/// Touch on tables.
pub fn tables() -> Result<Vec<Check>, VerifyError> {
    let mut checks = Vec::new();
    for shape in [
        BodyShape::Cube,
        BodyShape::Ball,
        BodyShape::Torus,
        BodyShape::Blob,
        BodyShape::Sheet,
        BodyShape::Rod,
    ] {
        let body = SOFT.free_body(shape.mesh(Fineness::Coarse)?, ElementOrder::Linear, MODES)?;
        for scene in scenes(&body) {
            let is_amplified = shape == BodyShape::Sheet && scene.objects.len() > 1;
            checks.extend(compare(&format!("{shape:?}, {}", scene.name), &body, &scene, is_amplified)?);
        }
    }
    Ok(checks)
}

fn scenes(body: &Arc<Recording>) -> [Scene; 3] {
    let half = half_extent(body, 1);
    let finger = DeviceParameters { tip_radius: TIP_RADIUS, friction: 0.4, ..DeviceParameters::default() };
    let mut thrown = object_at(body, DVec3::Y * (half + 0.02), DVec3::new(0.3, -0.4, 0.0));
    thrown.start.pose.orientation = DQuat::from_rotation_z(0.2);
    thrown.start.pose.position.y += 0.02;
    thrown.start.twist.angular = DVec3::new(2.0, 1.0, -3.0);
    let lower = object_at(body, DVec3::Y * half, DVec3::ZERO);
    let mut upper = object_at(body, DVec3::new(0.004, 3.0 * half + 2e-3, 0.002), DVec3::ZERO);
    upper.start.pose.orientation = DQuat::from_rotation_y(0.2);
    [
        Scene { name: "thrown", objects: vec![thrown], devices: vec![], input: |_, _| Input::default() },
        Scene {
            name: "two on one another",
            objects: vec![lower.clone(), upper],
            devices: vec![],
            input: |_, _| Input::default(),
        },
        Scene {
            name: "a finger presses and slides",
            objects: vec![lower],
            devices: vec![finger],
            input: |height, t| {
                let depth = 2e-3 * (smoothstep(t / 0.1) - smoothstep((t - 0.15) / 0.08)) - 5e-4;
                let across = 0.01 * smoothstep((t - 0.08) / 0.1);
                let position = DVec3::new(across - 0.004, height + TIP_RADIUS - depth, 0.001);
                Input { devices: vec![DeviceInput::touching(position)], ..Input::default() }
            },
        },
    ]
}

fn compare(
    name: &str,
    body: &Arc<Recording>,
    scene: &Scene,
    is_amplified: bool,
) -> Result<Vec<Check>, VerifyError> {
    let parameters = ModelParameters {
        step_s: STEP_S,
        gravity: DVec3::NEG_Y * GRAVITY_M_S2,
        devices: scene.devices.clone(),
        obstacles: vec![floor(0.5)],
        ..ModelParameters::for_reference()
    };
    let run_with = |parameters: &ModelParameters, form: ResponseForm| -> Result<Vec<Output>, VerifyError> {
        let with_form = |object: &ModelObject| ModelObject { response: form.clone(), ..object.clone() };
        let model = Model::new(parameters.clone(), scene.objects.iter().map(with_form).collect())?;
        let mut state = State::new(&model);
        let height = 2.0 * half_extent(body, 1);
        Ok((0..STEPS)
            .map(|number| step(&model, &mut state, &(scene.input)(height, number as f64 * STEP_S)).clone())
            .collect())
    };
    let run = |form| run_with(&parameters, form);
    let table = || closed_form_table(body, STEPS, STEP_S);
    let modal = run(ResponseForm::Modal)?;
    let double = run(ResponseForm::Fir(Arc::new(table())))?;
    let single = run(ResponseForm::Fir(Arc::new(in_single_precision(table()))))?;
    let (mut most_double, mut most_single) = (DOUBLE, SINGLE);
    if is_amplified {
        let gravity = parameters.gravity * (1.0 + 2.0 * f64::EPSILON);
        let nearly = run_with(&ModelParameters { gravity, ..parameters.clone() }, ResponseForm::Modal)?;
        (most_double, most_single) =
            (DOUBLE.max(OF_ROUND_OFF * difference(&modal, &nearly)), SHEET_ON_SHEET * SINGLE);
    }
    Ok(vec![
        Check::new(format!("{name}: force by a table in f64"), difference(&modal, &double), 0.0, most_double),
        Check::new(format!("{name}: force by a table in f32"), difference(&modal, &single), 0.0, most_single),
    ])
}

/// Largest difference of the total force on an object and of that on a hand, relative to the largest [1]; NaN without force.
fn difference(modal: &[Output], other: &[Output]) -> f64 {
    let (mut apart, mut largest) = (0.0_f64, 0.0_f64);
    let total = |output: &Output| output.contacts.iter().map(|contact| contact.force).sum::<DVec3>();
    for (a, b) in modal.iter().zip(other) {
        apart = apart.max((total(a) - total(b)).length());
        largest = largest.max(total(a).length());
        for (a, b) in a.devices.iter().zip(&b.devices) {
            apart = apart.max((a.force_on_hand - b.force_on_hand).length());
        }
    }
    apart / largest
}
