//! Residual compliance that relaxes as the material is damped: held points of a free cube that are moved quickly, by 200 of its
//! modes and S, against all its modes.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, Recording, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, PAPER_MATERIAL, object_at, smoothstep};
use std::sync::Arc;

const HALF: f64 = 0.05;
const CELLS: u32 = 6;

/// Steps of the motion, and of the whole run.
const RISE: usize = 50;
const STEPS: usize = 150;

/// Held points of the cube and their displacements [m]: one point in and to the side, two that pinch, three.
const HANDS: [(DVec3, DVec3); 3] = [
    (DVec3::new(-HALF, 0.0, 0.0), DVec3::new(0.005, 0.001, 0.0)),
    (DVec3::new(HALF, 0.0, 0.0), DVec3::new(-0.005, 0.0, 0.001)),
    (DVec3::new(0.0, HALF, 0.0), DVec3::new(0.0, -0.004, 0.0)),
];

/// Force [N] on every hand in every step.
fn forces(
    body: &Arc<Recording>,
    hands: usize,
    invariants: &mut RunInvariants,
) -> Result<Vec<DVec3>, VerifyError> {
    let hands = &HANDS[..hands];
    let nearest = |at: DVec3| body.surface.nearest(at).ok_or(VerifyError::NotReached("a surface"));
    let grasps: Vec<(Grasp, DVec3)> = hands
        .iter()
        .map(|(at, _)| {
            let (point, _) = nearest(*at)?;
            Ok((Grasp { object: 0, point }, body.surface.rest_position(&point)))
        })
        .collect::<Result<_, VerifyError>>()?;
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); hands.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object_at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut all = Vec::with_capacity(STEPS * hands.len());
    for number in 1..=STEPS {
        let share = smoothstep(number as f64 / RISE as f64);
        let hand = |((grasp, at), (_, by)): (&(Grasp, DVec3), &(DVec3, DVec3))| DeviceInput {
            position: *at + *by * share,
            mode: Some(*grasp).into(),
        };
        let input = Input { devices: grasps.iter().zip(hands).map(hand).collect(), ..Input::default() };
        let output = step(&model, &mut state, &input);
        invariants.observe(output);
        all.extend(output.devices.iter().map(|device| device.force_on_hand));
    }
    Ok(all)
}

/// Peak of the force error during the whole run, as a share of the peak force.
pub fn residual_relaxation() -> Result<Vec<Check>, VerifyError> {
    /// Dampings β [s] with the peak errors that are allowed: the inertia of the truncated modes remains, and without damping they vibrate.
    const CASES: [(f64, f64); 4] = [(1e-2, 5e-3), (2e-3, 5e-3), (2e-4, 5e-3), (0.0, 1e-2)];
    let all_modes = 3 * (CELLS as usize + 1).pow(3) - 6;
    let mut checks = Vec::new();
    for (damping, allowed) in CASES {
        let material = ElasticMaterial { stiffness_damping_s: damping, ..PAPER_MATERIAL };
        let body = |modes: usize| -> Result<Arc<Recording>, VerifyError> {
            let mesh = box_mesh([2.0 * HALF; 3], [CELLS; 3])?;
            Ok(material.free_body(mesh, ElementOrder::Linear, modes)?)
        };
        let (exact, reduced) = (body(all_modes)?, body(200)?);
        for hands in 1..=HANDS.len() {
            let mut invariants = RunInvariants::default();
            let reference = forces(&exact, hands, &mut RunInvariants::default())?;
            let reduced = forces(&reduced, hands, &mut invariants)?;
            let peak = reference.iter().map(|force| force.length()).fold(0.0, f64::max);
            let off = reduced.iter().zip(&reference).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
            let name = format!("{hands} held points, β = {damping:.0e} s");
            checks.push(Check::new(format!("{name}: peak force error"), off / peak, 0.0, allowed));
            checks.extend(invariants.checks(&name));
        }
    }
    Ok(checks)
}
