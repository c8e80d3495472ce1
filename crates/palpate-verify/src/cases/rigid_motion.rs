//! Rigid motion, momentum and energy of the stepped scene.

use crate::check::Check;
use crate::error::VerifyError;
use glam::{DMat3, DQuat, DVec3};
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters,
    ObjectStart, Pose, Recording, State, Twist, inertia_in_world, step,
};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{Random, recorded, undamped};
use std::sync::Arc;

/// A brick with three different principal inertias.
fn brick() -> Result<Arc<Recording>, VerifyError> {
    let parameters = undamped(5e4, 0.3, 1000.0, ElementOrder::Quadratic, 30);
    Ok(Arc::new(recorded(box_mesh([0.2, 0.12, 0.06], [3, 2, 2])?, &parameters)?.recording))
}

fn model(
    recording: &Arc<Recording>,
    step_s: f64,
    devices: usize,
    twist: Twist,
    gravity: DVec3,
) -> Result<Model, VerifyError> {
    let start = ObjectStart { pose: Pose::IDENTITY, twist };
    let parameters = ModelParameters {
        step_s,
        devices: vec![DeviceParameters::default(); devices],
        gravity,
        ..ModelParameters::for_reference()
    };
    Ok(Model::new(parameters, vec![ModelObject::new(recording.clone(), start)])?)
}

fn angular_momentum(recording: &Recording, pose: &Pose, twist: &Twist) -> DVec3 {
    inertia_in_world(recording.inertia(), DMat3::from_quat(pose.orientation)) * twist.angular
}

/// Free flight under gravity, and the spin of a brick about its middle axis, which tumbles.
pub fn flight() -> Result<Vec<Check>, VerifyError> {
    /// A thousand steps of sums that round by half an ulp each.
    const ROUND_OFF: f64 = 1e-12;
    /// Error of second order in the step over two turns: some (ωh)² = 1.4e-4 of 12 rad.
    const ORIENTATION_RAD: f64 = 2e-3;
    let recording = brick()?;
    let twist = Twist { linear: DVec3::new(0.3, 2.0, -0.1), angular: DVec3::new(0.05, 12.0, 0.08) };
    let gravity = DVec3::new(0.0, -9.81, 0.0);
    let end = |step_s: f64| -> Result<(Pose, f64, f64), VerifyError> {
        let model = model(&recording, step_s, 0, twist, gravity)?;
        let mut state = State::new(&model);
        let energy = state.output().energy.stored();
        let before = angular_momentum(&recording, &state.output().objects[0].pose, &twist);
        let none = Input { devices: Vec::new(), ..Input::default() };
        (0..(1.0 / step_s).round() as usize).for_each(|_| {
            step(&model, &mut state, &none);
        });
        let out = &state.output().objects[0];
        let after = angular_momentum(&recording, &out.pose, &out.twist);
        let turned = (after - before).length() / before.length();
        Ok((out.pose, (out.energy.stored() / energy - 1.0).abs(), turned))
    };
    let (pose, energy, spin) = end(1e-3)?;
    let fall = twist.linear + gravity / 2.0;
    let (exact, ..) = end(1e-5)?;
    let (coarse, ..) = end(2e-3)?;
    let angle = |pose: &Pose| pose.orientation.angle_between(exact.orientation);
    Ok(vec![
        Check::new("energy after 1 s of tumbling fall, change", energy, 0.0, ROUND_OFF),
        Check::new("angular momentum, change", spin, 0.0, ROUND_OFF),
        Check::new(
            "place after 1 s, distance from v·t + g·t²/2 [m]",
            (pose.position - fall).length(),
            0.0,
            ROUND_OFF,
        ),
        Check::new("orientation of the tumbling brick, angle [rad]", angle(&pose), 0.0, ORIENTATION_RAD)
            .with_order(angle(&coarse), angle(&pose), 2.0, 2.0),
    ])
}

/// One step with a held force, from rest: the force is that of a hand that moves the point.
pub fn momentum() -> Result<Vec<Check>, VerifyError> {
    /// Sums of some ten terms, each rounded.
    const ROUND_OFF: f64 = 1e-12;
    /// Some ulps of a tenth of a metre.
    const ULPS_M: f64 = 1e-15;
    let recording = brick()?;
    let (h, mass) = (1e-3, recording.mass());
    let Some((point, _)) = recording.surface.nearest(DVec3::new(0.1, 0.05, 0.02)) else {
        return Err(VerifyError::NotReached("the brick has no surface"));
    };
    let model = model(&recording, h, 1, Twist::ZERO, DVec3::ZERO)?;
    let mut state = State::new(&model);
    let rest = recording.surface.rest_position(&point);
    let hand = rest + DVec3::new(1e-3, -2e-3, 5e-4);
    let grasp = Some(Grasp { object: 0, point });
    let output = step(
        &model,
        &mut state,
        &Input { devices: vec![DeviceInput { position: hand, mode: grasp.into() }], ..Input::default() },
    );
    let force = -output.devices[0].force_on_hand;
    let object = &output.objects[0];
    // The deformed arm, in the mean over the step.
    let arm = 0.5 * (rest + hand - object.pose.position);
    let spin = angular_momentum(&recording, &object.pose, &object.twist);
    let (p, l) = (object.twist.linear * mass, arm.cross(force) * h);
    Ok(vec![
        Check::new("momentum against f·h, share", (p - force * h).length() / p.length(), 0.0, ROUND_OFF),
        Check::new("angular momentum against r×f·h, share", (spin - l).length() / l.length(), 0.0, ROUND_OFF),
        Check::new("held point against hand [m]", (output.devices[0].proxy - hand).length(), 0.0, ULPS_M),
    ])
}

/// Random jumps, Nyquist shaking, letting go and grasping elsewhere, undamped, while the body spins.
pub fn energy() -> Result<Vec<Check>, VerifyError> {
    /// A step's sums have terms of the size of all energy moved so far; some hundred of them round.
    const ROUND_OFF: f64 = 1e-12;
    /// The quaternion is normalised in every step.
    const UNIT: f64 = 1e-14;
    let recording = brick()?;
    let spin = Twist { linear: DVec3::ZERO, angular: DVec3::new(1.0, -2.0, 3.0) };
    let model = model(&recording, 1e-3, 3, spin, DVec3::new(0.0, -9.81, 0.0))?;
    let mut state = State::new(&model);
    let triangles = recording.surface.triangles.len() as u64;
    let mut numbers = Random::new(0x2545_f491_4f6c_dd1d);
    let mut random = || numbers.unit();
    let mut input = Input { devices: vec![DeviceInput::inactive(); 3], ..Input::default() };
    let start = state.output().energy.stored();
    let (mut gained, mut unexplained, mut backwards, mut moved) = (0.0_f64, 0.0_f64, 0.0_f64, 1e-9_f64);
    for number in 0..4000 {
        let pose = state.output().objects[0].pose;
        for (device, entry) in input.devices.iter_mut().enumerate() {
            // Now and then let go or take another point.
            if random() < 0.02 {
                let triangle = (random() * triangles as f64) as u32;
                let weights = [0.2, 0.3, 0.5];
                let point = palpate::SurfacePoint { triangle, weights };
                entry.mode = (random() < 0.7).then_some(Grasp { object: 0, point }).into();
            }
            if let DeviceMode::Held(grasp) = entry.mode {
                let at = pose.world_from_body(recording.surface.rest_position(&grasp.point));
                let jump = DVec3::new(random() - 0.5, random() - 0.5, random() - 0.5) * 0.01;
                let shake = if device == 0 && number % 2 == 0 { 1.0 } else { -1.0 };
                entry.position = at + jump + DVec3::X * (0.002 * shake);
            }
        }
        let before = state.output().energy;
        let now = step(&model, &mut state, &input).energy;
        moved = moved.max(now.stored().abs() + now.input.abs() + now.dissipated.abs());
        gained = gained.max((now.stored() - start - now.input) / moved);
        unexplained = unexplained.max(now.defect.abs() / moved);
        backwards = backwards.max((before.dissipated - now.dissipated) / moved);
    }
    Ok(vec![
        Check::new(
            "energy taken out of the object beyond what was put in, share",
            gained.max(0.0),
            0.0,
            ROUND_OFF,
        ),
        Check::new("balance of every step, largest defect, share", unexplained, 0.0, ROUND_OFF),
        Check::new("energy that dissipation gave back in a step, share", backwards.max(0.0), 0.0, ROUND_OFF),
        Check::new(
            "orientation stays a unit quaternion",
            norm_error(state.output().objects[0].pose.orientation),
            0.0,
            UNIT,
        ),
    ])
}

fn norm_error(orientation: DQuat) -> f64 {
    (orientation.length() - 1.0).abs()
}
