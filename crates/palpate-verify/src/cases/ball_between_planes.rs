//! Elastic ball with straight edges and the smooth surface over them (docs/theory.md, C80) between two rigid frictionless planes, against
//! Hertz's law for a ball of finite size.
//!
//! With E* = E/(1 − ν²), R the radius, δ the depth of each plane, s = √(δ/R), ν = 0.45:
//!
//! ```text
//! F = 4/3·E*·√R·δ^(3/2) · (1 + c₁·s + c₂·s²)        c₁ = 0.4627, c₂ = 0.0852
//! ```
//!
//! Hertz's law takes each contact for one of a half-space. In a ball the planes bring each other's pole nearer, and the surface is curved:
//! the bracket is 1.036 at δ/R = 0.006 and 1.118 at 0.06. It is the exact solution of linear elasticity for the ball by Legendre
//! series, with vertical pressure where p ≥ 0 keeps the surface out of the planes; `reference/ball_between_planes.py` computes and fits it,
//! to 1.3·10⁻⁴ for δ/R from 0.001 to 0.07.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Collider, Input, Model, ModelParameters, Obstacle, Pose, Recording, Shape, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::ball_mesh;
use palpate_testkit::{ElasticMaterial, object_at, smoothstep, with_stiffness_damping};
use std::sync::Arc;

const RADIUS: f64 = 0.05;
const LAYERS: u32 = 8;
const MODES: usize = 200;

/// Light foam, the same as in `rolling_ball`.
const FOAM: ElasticMaterial =
    ElasticMaterial { young_pa: 2e4, poisson: 0.45, density_kg_m3: 110.0, stiffness_damping_s: 0.0 };

/// Damping β [s] with which a press settles within tenths of a second.
const CALM_S: f64 = 1e-2;

/// Coefficients of the finite ball for ν = 0.45.
const FINITE: [f64; 2] = [0.4627, 0.0852];

/// Force [N] at a depth of each plane [m].
fn hertz_of_ball(depth: f64) -> f64 {
    let s = (depth / RADIUS).sqrt();
    let stiffness = FOAM.young_pa / (1.0 - FOAM.poisson.powi(2));
    4.0 / 3.0 * stiffness * RADIUS.sqrt() * depth.powf(1.5) * (1.0 + FINITE[0] * s + FINITE[1] * s * s)
}

/// Forces [N] of both planes at each depth [m], at rest, and the number of contacts with the upper one.
fn pressed(
    ball: &Arc<Recording>,
    depths: &[f64],
    max_contact_samples: usize,
    invariants: &mut RunInvariants,
) -> Result<Vec<([f64; 2], usize)>, VerifyError> {
    const STEP: f64 = 1e-3;
    /// Steps of the motion from one depth to the next, and of the rest after it.
    const MOTION: usize = 100;
    const REST: usize = 250;
    let plane = |normal: DVec3, depth: f64| Obstacle {
        shape: Shape::Plane { normal },
        pose: Pose { position: -normal * (RADIUS - depth), ..Pose::IDENTITY },
        friction: 0.0,
    };
    let pair = |depth: f64| [DVec3::Y, DVec3::NEG_Y].map(|normal| plane(normal, depth));
    let parameters = ModelParameters {
        step_s: STEP,
        obstacles: pair(0.0).to_vec(),
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object_at(ball, DVec3::ZERO, DVec3::ZERO)])?;
    let (mut state, mut before) = (State::new(&model), 0.0);
    invariants.observe(state.output());
    let mut results = Vec::new();
    for &depth in depths {
        for number in 1..=MOTION + REST {
            let now = before + (depth - before) * smoothstep(number as f64 / MOTION as f64);
            let obstacles = pair(now).map(|plane| plane.pose).to_vec();
            invariants.observe(step(&model, &mut state, &Input { obstacles, ..Input::default() }));
        }
        before = depth;
        let on = |at: usize| {
            let contacts = state.output().contacts.iter();
            contacts.filter(move |contact| contact.against == Collider::Obstacle(at))
        };
        let force = |at: usize| on(at).map(|contact| contact.force.y.abs()).sum::<f64>();
        results.push(([force(0), force(1)], on(1).count()));
    }
    Ok(results)
}

/// Depths from a tenth of a millimetre to 6 % of the radius, by all nodes and by 48 contact samples.
pub fn ball_between_planes() -> Result<Vec<Check>, VerifyError> {
    const DEPTHS: [f64; 6] = [1e-4, 3e-4, 6e-4, 1e-3, 2e-3, 3e-3];
    /// Of the force: where the contact radius is more than two edges of the surface (from 1 mm on), where it is one to two, and at 0.1 mm,
    /// where a single node touches.
    const RESOLVED: f64 = 0.01;
    const COARSE: f64 = 0.04;
    const ONE_NODE: f64 = 0.25;
    /// Of the two planes' forces, equal by symmetry: the ball stays where it is.
    const SYMMETRY: f64 = 1e-3;
    let mut mesh = ball_mesh(RADIUS, LAYERS)?;
    // With curved edges nothing would stand over them.
    mesh.straighten();
    let ball = FOAM.free_body(mesh, ElementOrder::Quadratic, MODES)?;
    let ball = with_stiffness_damping(&ball, CALM_S);
    let mut checks = Vec::new();
    for (name, samples) in [("all nodes", usize::MAX), ("48 contact samples", 48)] {
        let mut invariants = RunInvariants::default();
        for (depth, ([lower, upper], contacts)) in
            DEPTHS.into_iter().zip(pressed(&ball, &DEPTHS, samples, &mut invariants)?)
        {
            let tolerance = match depth {
                depth if depth < 2e-4 => ONE_NODE,
                depth if depth < 8e-4 => COARSE,
                _ => RESOLVED,
            };
            let at = format!("{name}, depth {:.1} mm", 1e3 * depth);
            checks.push(Check::new(
                format!("{at}, {contacts} contacts: force [N]"),
                upper,
                hertz_of_ball(depth),
                tolerance,
            ));
            checks.push(Check::new(format!("{at}: force of the other plane [N]"), lower, upper, SYMMETRY));
        }
        checks.extend(invariants.checks(name));
    }
    Ok(checks)
}
