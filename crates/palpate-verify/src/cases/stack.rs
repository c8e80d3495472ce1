//! Two cubes rest on one another on a floor for a minute.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::{DQuat, DVec3};
use palpate::{Collider, Input, Output, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, floor, object_at, scene};

const SIDE: f64 = 0.1;
const STEP: f64 = 2e-3;

/// Soft, and damped so that it is at rest within ten seconds: the upper cube sways at 1 Hz, where βK damps little.
const JELLY: ElasticMaterial =
    ElasticMaterial { young_pa: 5000.0, poisson: 0.4, density_kg_m3: 110.0, stiffness_damping_s: 1e-2 };

/// Vertical force [N] on an object from its support.
fn carried(output: &Output, object: usize, by: Collider) -> f64 {
    let under = |c: &&palpate::ContactOutput| c.object == object && c.against == by;
    // A pair has one row: the force on the other is the opposite.
    let over = |c: &&palpate::ContactOutput| {
        Collider::Object(c.object) == by && c.against == Collider::Object(object)
    };
    output.contacts.iter().filter(under).map(|c| c.force.y).sum::<f64>()
        - output.contacts.iter().filter(over).map(|c| c.force.y).sum::<f64>()
}

/// Position and orientation after 60 s against those after 10 s; the upper cube is off-centre and rotated a little.
pub fn stack() -> Result<Vec<Check>, VerifyError> {
    /// Motion that may remain, as a share of the size, and rotation [rad].
    const STILL: f64 = 1e-5;
    /// The cubes are at rest after a minute, but for the solver's tolerance.
    const WEIGHT: f64 = 1e-6;
    let cube = JELLY.free_body(box_mesh([SIDE; 3], [3; 3])?, ElementOrder::Linear, 60)?;
    let lower = object_at(&cube, DVec3::Y * (0.5 * SIDE + 1e-4), DVec3::ZERO);
    let mut upper = object_at(&cube, DVec3::new(0.013, 1.5 * SIDE + 2e-4, 0.007), DVec3::ZERO);
    upper.start.pose.orientation = DQuat::from_rotation_y(0.2);
    let model = scene(STEP, DVec3::Y * -GRAVITY_M_S2, vec![floor(0.5)], Vec::new(), vec![lower, upper])?;
    let mut state = State::new(&model);
    let (mut invariants, mut settled) = (RunInvariants::default(), Vec::new());
    invariants.observe(state.output());
    for number in 1..=(60.0 / STEP).round() as usize {
        invariants.observe(step(&model, &mut state, &Input::default()));
        if number == (10.0 / STEP).round() as usize {
            settled = state.output().objects.iter().map(|object| object.pose).collect();
        }
    }
    let output = state.output();
    let mut checks = Vec::new();
    for (name, before, object) in [("lower", 0, &output.objects[0]), ("upper", 1, &output.objects[1])] {
        let (before, now) = (settled[before], object.pose);
        let moved = (now.position - before.position).length() / SIDE;
        let turned = now.orientation.angle_between(before.orientation);
        checks.push(Check::new(
            format!("{name} cube moves from 10 s to 60 s, share of its size"),
            moved,
            0.0,
            STILL,
        ));
        checks.push(Check::new(format!("{name} cube turns from 10 s to 60 s [rad]"), turned, 0.0, STILL));
    }
    let weight = cube.mass() * GRAVITY_M_S2;
    let floor = carried(output, 0, Collider::Obstacle(0));
    checks.push(Check::new("what the floor carries after 60 s [N]", floor, 2.0 * weight, WEIGHT));
    let pair = carried(output, 1, Collider::Object(0));
    checks.push(Check::new("what the lower cube carries after 60 s [N]", pair, weight, WEIGHT));
    checks.extend(invariants.checks("stack"));
    Ok(checks)
}
