//! Undamped blocks with ν = 0 dropped flat on a frictionless plane with the usual number of modes: their energy stays.
//!
//! A block is a bar that meets a wall: for 2L/c the plane pushes with ρ·c·v·A, then the block leaves with the speed v at which it came, and
//! nothing is lost (see `drop_block`, with half of all modes). With the lowest 200 modes of the body only a few are those of the bar.
//! The others are the residual compliance, a spring without mass that loses ¼·Δ²f·S·Δ²f of the second difference Δ²f of the force (docs/theory.md,
//! C56), so half of f·S·f when the force jumps to f, and as much when it jumps back. With
//! m of the bar's modes, S = L/(3EA)·(6/π²)·Σ_{n>m} 1/n², and the loss of two jumps as a share of the energy is
//!
//! ```text
//! f²·S/(½ρALv²) = 4/π²·Σ_{n>m} 1/n²        f = ρcvA
//! ```
//!
//! The contact spreads over a few steps, which loses less.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Input, Recording, State, step};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, floor, object_at, scene};
use std::sync::Arc;

/// The paper's cube's stiffness and density, without its Poisson's ratio.
const FOAM: ElasticMaterial =
    ElasticMaterial { young_pa: 5e3, poisson: 0.0, density_kg_m3: 110.0, stiffness_damping_s: 0.0 };
const SPEED: f64 = 0.1;
const MODES: usize = 200;

/// Energy and speed after a fall.
struct Left {
    /// Energy over that at the start.
    energy: f64,
    /// Speed over that at the start.
    speed: f64,
}

/// Gap [m] at the end of the first step.
const EARLY: f64 = 1e-9;

/// A block of a height [m] meets the plane at the end of the first step of h [s] but for a gap [m]; for three times the time that a wave takes.
fn drop(
    block: &Arc<Recording>,
    height: f64,
    step_s: f64,
    early: f64,
    invariants: &mut RunInvariants,
) -> Result<Left, VerifyError> {
    let start = DVec3::Y * (0.5 * height + SPEED * step_s + early);
    let objects = vec![object_at(block, start, DVec3::Y * -SPEED)];
    let model = scene(step_s, DVec3::ZERO, vec![floor(0.0)], Vec::new(), objects)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let before = state.output().energy.stored();
    let wave = 2.0 * height / (FOAM.young_pa / FOAM.density_kg_m3).sqrt();
    for _ in 0..(3.0 * wave / step_s) as usize {
        invariants.observe(step(&model, &mut state, &Input::default()));
    }
    let output = state.output();
    Ok(Left { energy: output.energy.stored() / before, speed: output.objects[0].twist.linear.y / SPEED })
}

/// An upright block, a cube and a flat block at two steps.
pub fn block_impact() -> Result<Vec<Check>, VerifyError> {
    /// Energy that is lost in the residual compliance: 4 to 6 % with 200 modes at 1 ms, by how many of them run along the
    /// block, and 1 to 3 % at 0.5 ms. All modes of these meshes lose 0.5 to 4 % at 1 ms and 3 to 6 % at 0.5 ms, where they do not end the contact in one step.
    const ENERGY: f64 = 0.06;
    // The front spreads over (1/2n)^(2/3) of a height of n cells (see `drop_block`): what lies in it stays as vibration.
    let front = |cells: u32| (0.5 / f64::from(cells)).powf(2.0 / 3.0);
    let mut checks = Vec::new();
    for (name, size, cells) in [
        ("upright block", [0.1, 0.2, 0.1], [6, 12, 6]),
        ("cube", [0.1, 0.1, 0.1], [8, 8, 8]),
        ("flat block", [0.2, 0.1, 0.1], [12, 6, 6]),
    ] {
        let block = FOAM.free_body(box_mesh(size, cells)?, ElementOrder::Linear, MODES)?;
        for (step_name, step_s) in [("1 ms", 1e-3), ("0.5 ms", 5e-4)] {
            let mut invariants = RunInvariants::default();
            let left = drop(&block, size[1], step_s, EARLY, &mut invariants)?;
            let of = format!("{name}, {step_name}");
            checks.push(Check::new(format!("{of}: energy that stays"), left.energy, 1.0, ENERGY));
            let quantity = format!("{of}: speed after the contact over that before");
            checks.push(Check::new(quantity, left.speed, 1.0, front(cells[1])));
            checks.extend(invariants.checks(&of));
        }
    }
    checks.extend(arrival()?);
    Ok(checks)
}

/// A block that comes to the plane within a step, up to round-off, rebounds as any other.
fn arrival() -> Result<Vec<Check>, VerifyError> {
    /// Of the speed: the contact begins by as much of a step earlier or later.
    const SPEEDS: f64 = 1e-3;
    let size = [0.1, 0.2, 0.1];
    let block = FOAM.free_body(box_mesh(size, [6, 12, 6])?, ElementOrder::Linear, 50)?;
    let speed = |early: f64| -> Result<f64, VerifyError> {
        Ok(drop(&block, size[1], 2e-3, early, &mut RunInvariants::default())?.speed)
    };
    let expected = speed(EARLY)?;
    let mut checks = Vec::new();
    for early in [0.0, 1e-12, -1e-12, -EARLY] {
        let quantity =
            format!("speed after a contact that begins with a gap of {early:.0e} m, as with {EARLY:.0e} m");
        checks.push(Check::new(quantity, speed(early)?, expected, SPEEDS));
    }
    Ok(checks)
}
