//! A set of bodies in contact, coarse and fine, by all nodes and by the contact samples of a run in real time: nothing sinks, forces are
//! weights, a contact at rest takes no energy, and samples press as nodes do.

mod motions;

use crate::check::Check;
use crate::error::VerifyError;
use motions::{ALL_NODES, Motion, Outcome};
use palpate::Recording;
use palpate_testkit::{BodyShape, Fineness, GRAVITY_M_S2};
use std::sync::Arc;

/// Contact samples of a run in real time.
const SAMPLES: usize = 48;

/// Penetration that is allowed at rest, as a share of the diagonal, and at least [m].
const PENETRATION: f64 = 0.01;
const LEAST_PENETRATION: f64 = 2e-4;

/// Largest penetration in a blow, over that which is allowed at rest: a cube that lands on a corner.
const IN_A_BLOW: f64 = 1.5;

/// Tolerances at rest: force as a share of the weight, lateral force as a share of the weight, and the force of a punch in time: 0.03 % at most. On
/// a sheet with contact samples nodes come and go: 0.2 to 0.4 % in eleven of twelve runs that differ by round-off, 0.7 % in the twelfth.
const FORCE: f64 = 1e-3;
const LATERAL: f64 = 1e-3;
const FLICKER: f64 = 1e-3;
const FLICKER_OF_SHEET_BY_SAMPLES: f64 = 1e-2;

/// Energy that is lost within half a second at rest, as a share of weight times diagonal: nodes come and go.
const LOST: f64 = 2e-4;

/// Force of a punch by samples against all nodes: 0.7 % at most, and 8.4 to 9.1 % of a sheet that is thinner than the samples are apart: which
/// nodes are added, and how deep, hangs on round-off.
const BY_SAMPLES: f64 = 0.01;
const BY_SAMPLES_ON_SHEET: f64 = 0.12;

/// Kinetic energy, as a share of weight times diagonal, below which a body is at rest: it falls by so much of its size.
const AT_REST: f64 = 1e-8;

/// Motions by all nodes, by samples on coarse meshes, and on the fine cube and ball. Stacks by all nodes take minutes: `faces` has them.
const BY_NODES: &[Motion] = &[Motion::Rest, Motion::Slide, Motion::Land, Motion::Punch];
const ON_COARSE: &[Motion] =
    &[Motion::Rest, Motion::Slide, Motion::Roll, Motion::Land, Motion::Punch, Motion::Pinch, Motion::Stack];
const ON_FINE: &[Motion] = &[Motion::Rest, Motion::Punch];

/// Bodies of the set in all motions.
pub fn bodies() -> Result<Vec<Check>, VerifyError> {
    let mut checks = Vec::new();
    let block = BodyShape::Cube.recording(Fineness::Coarse)?;
    for shape in BodyShape::ALL {
        let body = shape.recording(Fineness::Coarse)?;
        let name = format!("{shape:?}");
        let mut punch = 0.0;
        for &motion in BY_NODES {
            let outcome = motion.run(&body, &block, ALL_NODES)?;
            punch = if motion == Motion::Punch { outcome.punch } else { punch };
            checks.extend(outcome.checks(&format!("{name}, {motion:?}, all nodes"), &body, motion, FLICKER));
        }
        for &motion in ON_COARSE {
            let outcome = motion.run(&body, &block, SAMPLES)?;
            let of = format!("{name}, {motion:?}, {SAMPLES} samples");
            let flicker = if shape == BodyShape::Sheet { FLICKER_OF_SHEET_BY_SAMPLES } else { FLICKER };
            checks.extend(outcome.checks(&of, &body, motion, flicker));
            if motion == Motion::Punch {
                let tolerance = if shape == BodyShape::Sheet { BY_SAMPLES_ON_SHEET } else { BY_SAMPLES };
                checks.push(Check::new(
                    format!("{of}: force, by all nodes [N]"),
                    outcome.punch,
                    punch,
                    tolerance,
                ));
            }
        }
        if matches!(shape, BodyShape::Cube | BodyShape::Ball) {
            let body = shape.recording(Fineness::Fine)?;
            for &motion in ON_FINE {
                let outcome = motion.run(&body, &block, SAMPLES)?;
                let of = format!("{name}, fine, {motion:?}, {SAMPLES} samples");
                checks.extend(outcome.checks(&of, &body, motion, FLICKER));
            }
        }
    }
    Ok(checks)
}

impl Outcome {
    /// Checks of a run of that name; `flicker` is the tolerance of the force of a punch in time.
    fn checks(&self, of: &str, body: &Arc<Recording>, motion: Motion, flicker: f64) -> Vec<Check> {
        let (weight, size) = (body.mass() * GRAVITY_M_S2, body.surface.diagonal());
        let allowed = (PENETRATION * size).max(LEAST_PENETRATION);
        let share = |what: &str, value: f64, tolerance: f64| {
            Check::new(format!("{of}: {what}"), value, 0.0, tolerance)
        };
        let mut checks = vec![
            share("penetration at rest, of 1 % of the size", self.penetration_at_rest / allowed, 1.0),
            share("penetration on the way, of 1 % of the size", self.penetration / allowed, IN_A_BLOW),
        ];
        let is_held = motion == Motion::Punch;
        if is_held || self.kinetic < AT_REST * weight * size {
            checks.push(Check::new(format!("{of}: force of all contacts [N]"), self.force.y, weight, FORCE));
            let lateral = self.force.x.hypot(self.force.z) / weight;
            checks.push(share("lateral force, share of the weight", lateral, LATERAL));
        }
        if matches!(motion, Motion::Rest | Motion::Punch) {
            checks.push(share("energy that is lost at rest", self.lost_at_rest / (weight * size), LOST));
        }
        if is_held {
            checks.push(share("deviation of the force that punches", self.flicker / self.punch, flicker));
        }
        checks.extend(self.invariants.checks(of));
        checks
    }
}
