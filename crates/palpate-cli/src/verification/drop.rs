//! A block with ν = 0 that falls flat on a frictionless plane: a bar that meets a wall.
//!
//! A wave runs up the bar at c = √(E/ρ), turns at the free end and comes back. Until then, for 2L/c, the force is
//! ρ·c·v·A, and after it the bar leaves with the speed v at which it came (Timoshenko & Goodier, *Theory of
//! Elasticity*, article 168).

use super::Check;
use super::scene::{Stuff, Watch, at, floor, scene};
use crate::Failure;
use glam::DVec3;
use palpate::{Input, State, step};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;

const LENGTH: f64 = 0.1;
const WIDTH: f64 = 0.02;
const BAR: Stuff = Stuff { young: 1e5, poisson: 0.0, density: 1000.0, beta: 0.0 };
const SPEED: f64 = 0.1;

/// What comes out of a fall.
struct Fall {
    /// Force [N] in the middle of the contact, mean.
    force: f64,
    /// ∫|F − ρcvA| dt over that of ρcvA.
    off: f64,
    /// From the first to the last force [s].
    duration: f64,
    /// Speed after it [m/s].
    speed: f64,
}

/// A step takes the wave through half a cell. Half of the modes are kept, and S for the rest: with all of them, undamped,
/// the nodes of the lower face are free masses within such a step, and their force alternates about its mean for as
/// long as the contact lasts (±75 % here; the mean, the duration and the speed are the same).
fn fall(cells: u32, watch: &mut Watch) -> Result<Fall, Failure> {
    let c = (BAR.young / BAR.density).sqrt();
    let half = 6 * (cells as usize + 1) - 3;
    let body = BAR.body(box_mesh([WIDTH, LENGTH, WIDTH], [1, cells, 1])?, Order::Linear, half)?;
    let step_s = 0.5 * LENGTH / c / f64::from(cells);
    // The block meets the plane at the end of the first step.
    let start = DVec3::Y * (0.5 * LENGTH + SPEED * step_s);
    let objects = vec![at(&body, start, DVec3::Y * -SPEED)];
    let model = scene(step_s, DVec3::ZERO, vec![floor(0.0)], Vec::new(), objects)?;
    let mut state = State::new(&model);
    watch.look(state.output());
    let [exact, lasts, _] = exact();
    let (mut force, mut off, mut counted, mut first, mut last) = (0.0, 0.0, 0.0, None, 0.0);
    for _ in 0..(2.0 * lasts / step_s) as usize {
        let output = step(&model, &mut state, &Input::default());
        watch.look(output);
        let now: f64 = output.contacts.iter().map(|contact| contact.force.y).sum();
        // The force is the mean over its step.
        let t = output.time_s - 1.5 * step_s;
        if (0.2 * lasts..0.8 * lasts).contains(&t) {
            force += now;
            counted += 1.0;
        }
        let expected = if (0.0..lasts).contains(&t) { exact } else { 0.0 };
        off += (now - expected).abs() * step_s / (exact * lasts);
        if now > 0.0 {
            first.get_or_insert(output.time_s - step_s);
            last = output.time_s;
        }
    }
    let duration = last - first.unwrap_or(f64::NAN);
    Ok(Fall { force: force / counted, off, duration, speed: state.output().objects[0].twist.linear.y })
}

/// Force, duration, speed.
fn exact() -> [f64; 3] {
    let c = (BAR.young / BAR.density).sqrt();
    [BAR.density * c * SPEED * WIDTH * WIDTH, 2.0 * LENGTH / c, SPEED]
}

/// Mesh and step refined together. A front is not sharp on a mesh: waves shorter than a few cells h lag, and it spreads
/// over L·(h/L)^(2/3) on its way. What lies in it is late, and stays in the bar as vibration: so speed and force go with
/// the power 2/3 of the mesh. What they may miss at 80 cells is that, (1/160)^(2/3) = 3.4 %; the mean of the force has
/// no front in it.
pub fn drop_block() -> Result<Vec<Check>, Failure> {
    const FRONT: f64 = 0.034;
    let [force, lasts, speed] = exact();
    let mut watch = Watch::default();
    let coarse = fall(10, &mut watch)?;
    let mut checks = Vec::from(watch.checks("10 cells"));
    let mut watch = Watch::default();
    let fine = fall(80, &mut watch)?;
    checks.extend(watch.checks("80 cells"));
    let slow = |fall: &Fall| (fall.speed / speed - 1.0).abs();
    checks.push(Check::new(
        "force, mean of the middle of the contact, 80 cells [N]",
        fine.force,
        force,
        1e-3,
    ));
    let off = Check::new("force curve, ∫|F − ρcvA|dt, share, 80 cells", fine.off, 0.0, 3.0 * FRONT);
    checks.push(off.with_order(coarse.off, fine.off, 8.0, 2.0 / 3.0));
    checks.push(Check::new("duration against 2L/c, 80 cells [s]", fine.duration, lasts, FRONT));
    let left = Check::new("speed after the contact, 80 cells [m/s]", fine.speed, speed, FRONT);
    checks.push(left.with_order(slow(&coarse), slow(&fine), 8.0, 2.0 / 3.0));
    Ok(checks)
}
