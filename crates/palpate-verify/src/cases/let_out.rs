//! Tips that appear inside five bodies at rest: none stays inside, and none is struck.
//!
//! The hand is still. The work W of the offset, o at the start, is all that the body gets; with a coupling (k, d) it is no more than that of
//! the offset's decay on a body that does not give way, and the force rises no faster:
//!
//! ```text
//! W ≤ ½·k·|o|² + d·|o|²/(4·T)        |f⁺ − f| ≤ h·(k/(e·T) + d/T²)·|o|
//! ```
//!
//! Equations: docs/theory.md (C70), (C71), (C72).

use super::adversarial::bodies;
use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::ROUND_OFF;
use glam::DVec3;
use palpate::{Coupling, DeviceParameters, Model, ModelParameters, Recording, State, step};
use palpate_testkit::{Random, energy_imbalance, finger, model_and_state, object_at, touching};
use std::f64::consts::{E, PI};
use std::sync::Arc;

/// Places in each body, for each tip and coupling.
const PLACES: u64 = 20;

/// Steps of 1 ms after which the offset is 1e-9 of what it was.
const STEPS: usize = 500;

/// Steps after which surfaces are looked at.
const LOOKS: [usize; 4] = [0, 10, 100, STEPS - 1];

/// Time constant of the offset [s].
const LET_OUT_S: f64 = 0.02;

/// Excess over a body that does not give way: surfaces swing against the tip.
const SWING: f64 = 0.05;

/// Largest values over all tips in a body.
#[derive(Default)]
struct Findings {
    tips: u32,
    unexplained: f64,
    inside: u32,
    rise: f64,
    work: f64,
    still_offset: f64,
}

/// Checks of every body.
pub fn let_out() -> Result<Vec<Check>, VerifyError> {
    let mut checks = Vec::new();
    for (number, (name, body)) in bodies()?.into_iter().enumerate() {
        let mut findings = Findings::default();
        for radius in [0.0, 0.003, 0.01] {
            for coupling in [None, Some(Coupling { stiffness: 100.0, damping: 0.3 })] {
                for place in 0..PLACES {
                    let mut random = Random::from_pair(number as u64, place);
                    let device = DeviceParameters { coupling, ..finger(radius, 0.0, 0.5) };
                    observe(&body, device, inner_point(&body, &mut random), &mut findings);
                }
            }
        }
        let Findings { tips, unexplained, inside, rise, work, still_offset } = findings;
        checks.extend([
            Check::new(format!("{name}: of {tips} tips, inside without force"), f64::from(inside), 0.0, 0.0),
            Check::new(format!("{name}: rise of the force in a step over its bound"), rise, 0.0, 1.0 + SWING),
            Check::new(format!("{name}: work of the offset over its bound"), work, 0.0, 1.0 + SWING),
            Check::new(format!("{name}: offset at the end, share"), still_offset, 0.0, 1e-6),
            Check::new(format!("{name}: energy that no term explains [J]"), unexplained, 0.0, ROUND_OFF),
        ]);
    }
    Ok(checks)
}

/// A point inside a body [m]: below a triangle, within half the way to the other side.
fn inner_point(body: &Recording, random: &mut Random) -> DVec3 {
    let surface = &body.surface;
    let triangle = surface.triangles[(random.unit() * surface.triangles.len() as f64) as usize];
    let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
    let inwards = -(b - a).cross(c - a).normalize();
    let centre = (a + b + c) / 3.0;
    let is_inside =
        |depth: &f64| winding_number(&surface.triangles, &surface.positions, centre + inwards * *depth) > 0.5;
    let thickness = (1..200).map(|k| f64::from(k) * 1e-3).take_while(is_inside).last().unwrap_or(5e-4);
    centre + inwards * (thickness * random.within(0.1, 0.5))
}

/// Let one tip appear and stay.
fn observe(body: &Arc<Recording>, device: DeviceParameters, hand: DVec3, findings: &mut Findings) {
    let parameters = ModelParameters { devices: vec![device], ..ModelParameters::for_reference() };
    let (model, mut state) = model_and_state(parameters, vec![object_at(body, DVec3::ZERO, DVec3::ZERO)]);
    let (mut last, mut rise, mut has_left) = (DVec3::ZERO, 0.0_f64, false);
    let (mut offset, mut work) = (0.0, 0.0);
    findings.tips += 1;
    for number in 0..STEPS {
        let output = step(&model, &mut state, &touching(&[hand]));
        let out = &output.devices[0];
        let force = out.force_on_hand;
        // Until the body has left the tip: it may strike it again as it swings.
        has_left |= last != DVec3::ZERO && force == DVec3::ZERO;
        if !has_left {
            rise = rise.max(force.length() - last.length());
        }
        last = force;
        if number == 0 {
            offset = out.offset[0].length();
        }
        work -= out.force_on_hand.dot(out.offset[1] - out.offset[0]);
        let open = energy_imbalance(output, 0.0).abs() + (work - output.energy.input).abs();
        findings.unexplained = findings.unexplained.max(open);
        findings.still_offset = out.offset[1].length() / offset;
        if LOOKS.contains(&number) && force == DVec3::ZERO && state.output().status.unsolved_islands == 0 {
            findings.inside += u32::from(is_inside(&model, &state));
        }
    }
    if let Some(Coupling { stiffness, damping }) = device.coupling {
        let bound = (0.5 * stiffness + damping / (4.0 * LET_OUT_S)) * offset * offset;
        findings.work = findings.work.max(work / bound);
        let fastest = stiffness / (E * LET_OUT_S) + damping / (LET_OUT_S * LET_OUT_S);
        findings.rise = findings.rise.max(rise / (model.parameters().step_s * fastest * offset));
    }
}

/// Whether the proxy is inside the deformed surface.
fn is_inside(model: &Model, state: &State) -> bool {
    let surface = &model.recordings().next().expect("one object").surface;
    let mut positions = vec![DVec3::ZERO; surface.positions.len()];
    state.surface_displacement(model, 0, &mut positions);
    positions.iter_mut().zip(&surface.positions).for_each(|(moved, rest)| *moved += *rest);
    let proxy = state.output().objects[0].pose.body_from_world(state.output().devices[0].proxy);
    winding_number(&surface.triangles, &positions, proxy) > 0.5
}

/// Winding number of a closed surface around a point: 1 inside, 0 outside, by the solid angles of its triangles (van Oosterom &
/// Strackee 1983, IEEE Trans. Biomed. Eng. 30, 125).
fn winding_number(triangles: &[[u32; 3]], positions: &[DVec3], point: DVec3) -> f64 {
    let solid_angle = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|node| positions[node as usize] - point);
        let (x, y, z) = (a.length(), b.length(), c.length());
        2.0 * a.dot(b.cross(c)).atan2(x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y)
    };
    triangles.iter().map(solid_angle).sum::<f64>() / (4.0 * PI)
}
