//! Friction of an elastic ball on a floor: it spins on the spot, slides until it rolls, and rolls on.
//!
//! Pivot friction of a Hertz contact of radius a under a force N, all of which slips, p = p₀·√(1 − r²/a²):
//!
//! ```text
//! T = ∫μ·p·r dA = 3π/16·μ·N·a        a³ = 3NR/(4E*)        ω̇ = −T/(2mR²/5)
//! ```
//!
//! A ball that slides with speed v and does not spin keeps its angular momentum about the line of its contacts, whatever the friction:
//! m·v·R = m·v'·R + 2mR²/5·(v'/R), so v' = 5/7·v. After that an elastic ball without damping rolls on: what the front of the contact
//! takes, its back gives.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Input, Model, ModelParameters, Recording, State, Twist, step};
use palpate_fem::ElementOrder;
use palpate_mesh::ball_mesh;
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, floor, object_at, smoothstep, with_stiffness_damping};
use std::f64::consts::PI;
use std::sync::Arc;

const RADIUS: f64 = 0.05;
const LAYERS: u32 = 8;
const MODES: usize = 200;
const STEP: f64 = 1e-3;

/// Light foam: under its own weight the contact radius is a fifth of the ball's.
const FOAM: ElasticMaterial =
    ElasticMaterial { young_pa: 2e4, poisson: 0.45, density_kg_m3: 110.0, stiffness_damping_s: 0.0 };

/// Contact radius [m] by Hertz's law under a force [N].
fn contact_radius(force: f64) -> f64 {
    let stiffness = FOAM.young_pa / (1.0 - FOAM.poisson.powi(2));
    (0.75 * force * RADIUS / stiffness).cbrt()
}

fn on_floor(
    ball: &Arc<Recording>,
    friction: f64,
    twist: Twist,
    gravity: f64,
    max_contact_samples: usize,
) -> Result<Model, VerifyError> {
    let mut object = object_at(ball, DVec3::Y * RADIUS, DVec3::ZERO);
    object.start.twist = twist;
    let parameters = ModelParameters {
        step_s: STEP,
        gravity: DVec3::Y * -gravity,
        obstacles: vec![floor(friction)],
        max_contact_samples,
        ..ModelParameters::for_reference()
    };
    Ok(Model::new(parameters, vec![object])?)
}

/// Angular deceleration [rad/s²] of a damped ball that spins about the vertical, after it has settled.
fn pivot(
    ball: &Arc<Recording>,
    friction: f64,
    samples: usize,
    invariants: &mut RunInvariants,
) -> Result<f64, VerifyError> {
    /// Steps until it has settled, and of the measurement.
    const SETTLED: usize = 800;
    const MEASURED: usize = 1000;
    let spin = Twist { linear: DVec3::ZERO, angular: DVec3::Y * 20.0 };
    let model = on_floor(ball, friction, spin, GRAVITY_M_S2, samples)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut speeds = Vec::new();
    for _ in 0..SETTLED + MEASURED {
        let output = step(&model, &mut state, &Input::default());
        invariants.observe(output);
        speeds.push(output.objects[0].twist.angular.y);
    }
    Ok((speeds[SETTLED - 1] - speeds[SETTLED + MEASURED - 1]) / (MEASURED as f64 * STEP))
}

/// A ball without damping that begins to slide while its weight grows from nothing, so that it hardly vibrates.
struct Rolling {
    /// Speed [m/s] when it rolls, over a tenth of a second; and two seconds later.
    speeds: [f64; 2],
    /// Energy [J] that friction takes until it rolls.
    friction: f64,
    /// Kinetic energy at the start [J].
    kinetic: f64,
    /// Energy [J] that the residual compliance and impacts take in the two seconds.
    lost: f64,
}

fn roll(
    ball: &Arc<Recording>,
    speed: f64,
    samples: usize,
    invariants: &mut RunInvariants,
) -> Result<Rolling, VerifyError> {
    const RISE: usize = 400;
    const ROLLS: usize = 1000;
    const LATER: usize = 2000;
    const MEAN: usize = 100;
    let twist = Twist { linear: DVec3::X * speed, angular: DVec3::ZERO };
    let model = on_floor(ball, 0.3, twist, 0.0, samples)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut speeds = [0.0; 2];
    let (mut friction, mut lost) = (0.0, 0.0);
    for number in 1..=ROLLS + LATER + MEAN {
        let weight = GRAVITY_M_S2 * smoothstep(number as f64 / RISE as f64);
        let input = Input { gravity: Some(DVec3::Y * -weight), ..Input::default() };
        let output = step(&model, &mut state, &input);
        invariants.observe(output);
        for (speed, from) in speeds.iter_mut().zip([ROLLS, ROLLS + LATER]) {
            if (from + 1..=from + MEAN).contains(&number) {
                *speed += output.objects[0].twist.linear.x / MEAN as f64;
            }
        }
        if number == ROLLS {
            friction = output.energy.friction;
            lost = output.energy.lost();
        }
    }
    let lost = state.output().energy.lost() - lost;
    let kinetic = 0.5 * ball.mass() * speed * speed;
    Ok(Rolling { speeds, friction, kinetic, lost })
}

/// Pivot friction, the speed after sliding, and rolling, by all nodes and by 48 contact samples.
pub fn rolling_ball() -> Result<Vec<Check>, VerifyError> {
    const FRICTION: f64 = 0.1;
    const SPEED: f64 = 0.3;
    const ALLOWED: f64 = 0.05;
    /// Energy that is lost where the speed is within that.
    const LOST: f64 = 2.0 * ALLOWED;
    let ball = FOAM.free_body(ball_mesh(RADIUS, LAYERS)?, ElementOrder::Quadratic, MODES)?;
    let damped = with_stiffness_damping(&ball, 4e-3);
    // Mass and inertia of the continuum: those of the mesh, whose chords cut a part off, are 1 % smaller.
    let mass = FOAM.density_kg_m3 * 4.0 / 3.0 * PI * RADIUS.powi(3);
    let weight = mass * GRAVITY_M_S2;
    let deceleration =
        3.0 * PI / 16.0 * FRICTION * weight * contact_radius(weight) / (0.4 * mass * RADIUS * RADIUS);
    let mut checks = Vec::new();
    for (name, samples) in [("all nodes", usize::MAX), ("48 contact samples", 48)] {
        let mut invariants = RunInvariants::default();
        let measured = pivot(&damped, FRICTION, samples, &mut invariants)?;
        let quantity = format!("{name}: angular deceleration of a ball that spins on the spot [rad/s²]");
        checks.push(Check::new(quantity, measured, deceleration, ALLOWED));
        checks.extend(invariants.checks(&format!("{name}, spinning")));
        let mut invariants = RunInvariants::default();
        let rolling = roll(&ball, SPEED, samples, &mut invariants)?;
        let quantity = format!("{name}: speed of a ball that slid with 0.3 m/s and rolls [m/s]");
        checks.push(Check::new(quantity, rolling.speeds[0], 5.0 / 7.0 * SPEED, ALLOWED));
        let quantity = format!("{name}: energy that friction takes until then, of all [1]");
        checks.push(Check::new(quantity, rolling.friction / rolling.kinetic, 2.0 / 7.0, ALLOWED));
        let quantity = format!("{name}: speed after 2 s of rolling [m/s]");
        checks.push(Check::new(quantity, rolling.speeds[1], rolling.speeds[0], ALLOWED));
        let quantity = format!("{name}: energy lost in 2 s of rolling, of all [1]");
        checks.push(Check::new(quantity, rolling.lost / rolling.kinetic, 0.0, LOST));
        checks.extend(invariants.checks(&format!("{name}, rolling")));
    }
    Ok(checks)
}
