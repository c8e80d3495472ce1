//! The closed loop of a body, a coupling, a device and a hand, in simulated time: three materials, four rates, four delays.
//!
//! Where it begins to swing is found in three ways: by the bound that `palpate inspect --device` gives (the Nyquist criterion, see
//! `palpate_haptics::stability`), by the largest eigenvalue of the loop's state matrix, and by the force process and the haptic update
//! themselves with a simulated device in the worst of hands. Beyond that bound it is let swing, with and without the controller; what
//! comes out and what goes on is counted with the true motion of the device, not with its encoder's.

mod simulation;
mod spectrum;

use crate::check::Check;
use crate::error::VerifyError;
use glam::DVec3;
use palpate::{Recording, SurfacePoint};
use palpate_fem::ElementOrder;
use palpate_haptics::device::{DeviceSpec, Hand};
use palpate_haptics::stability::{ClosedLoop, LoopTiming, PointResponse};
use palpate_mesh::box_mesh;
use palpate_testkit::ElasticMaterial;
use rayon::prelude::*;
use simulation::{LoopRun, diverges, press_with_fingertip};
use spectrum::disagreements;
use std::sync::Arc;

/// Young's moduli [Pa]: fat, muscle, rubber.
const YOUNG_PA: [f64; 3] = [2e3, 5e4, 1e6];
const RATES_HZ: [f64; 4] = [500.0, 1000.0, 2000.0, 4000.0];
const DELAYS_S: [f64; 4] = [0.0, 0.005, 0.02, 0.05];

/// Sides of the block [m].
const SIZE: [f64; 3] = [0.1, 0.05, 0.1];

/// Damping ratio of the lowest modes, about.
const DAMPED: f64 = 0.05;

/// The least favourable hand: a spring, with no damping but the device's own.
const HAND: Hand = Hand::FINGERTIP;

/// Damping of the coupling, as a share of the device's mass over the age of the motion that a force answers. Near it the stable
/// stiffness is largest.
const DAMPING: f64 = 0.2;

/// Stiffness [N/m] up to which couplings are tried.
const STIFFEST: f64 = 1e5;

/// Share to which the simulated onset of instability is bracketed.
const BRACKET: f64 = 0.04;

/// Tolerance of the onset: an oscillation that hardly grows takes longer to be seen than the run.
const ONSET: f64 = 0.1;

/// Depth of the interface point below the face [m].
const DEPTH: f64 = 0.01;

/// Energy [J] that half a step of the encoder hides at the largest force: ½·Δx·k·depth = 5.5 µJ.
const HIDDEN_J: f64 = 0.5 * DeviceSpec::TOUCH.resolution_m * HAND.stiffness_n_m * DEPTH;

/// Stiffness with which the controller is tried, over the stable bound.
const BEYOND: f64 = 3.0;

/// One combination of material, rate and delay.
#[derive(Clone)]
struct Cell {
    young: f64,
    body: Arc<Recording>,
    point: SurfacePoint,
    rate_hz: f64,
    delay_s: f64,
}

/// A block that stands on its lower face.
fn standing_block(young: f64) -> Result<Arc<Recording>, VerifyError> {
    let speed = (young / 3.0 / 1000.0_f64).sqrt();
    let omega = 0.5 * std::f64::consts::PI * speed / SIZE[1];
    let material = ElasticMaterial {
        young_pa: young,
        poisson: 0.45,
        density_kg_m3: 1000.0,
        stiffness_damping_s: 2.0 * DAMPED / omega,
    };
    Ok(material.fixed_body(box_mesh(SIZE, [4, 2, 4])?, ElementOrder::Quadratic, 40, |node| {
        node.y < -0.499 * SIZE[1]
    })?)
}

impl Cell {
    fn timing(&self) -> LoopTiming {
        LoopTiming::new(1.0 / self.rate_hz, self.delay_s)
    }

    fn damping(&self) -> f64 {
        DAMPING * DeviceSpec::TOUCH.mass_kg / self.timing().age_s()
    }

    /// Responses of the touched point along the axes, which are uncoupled in the middle of the face.
    fn places(&self) -> [PointResponse; 3] {
        DVec3::AXES.map(|axis| PointResponse::new(&self.body, &self.point, 0.0, axis))
    }

    fn loops(&self) -> [ClosedLoop; 3] {
        self.places().map(|place| ClosedLoop::new(&place, DeviceSpec::TOUCH, Some(HAND), self.timing()))
    }

    /// Stiffness [N/m] up to which all axes are stable, if it is below the stiffest coupling.
    fn bound(&self) -> Option<f64> {
        let damping = self.damping();
        let most = |closed: &ClosedLoop| {
            closed.stable_stiffness(damping, STIFFEST).first().map_or(0.0, |[_, most]| *most)
        };
        let least = self.loops().iter().map(most).fold(STIFFEST, f64::min);
        (least < STIFFEST).then_some(least)
    }

    fn name(&self) -> String {
        let Self { young, rate_hz, delay_s, .. } = self;
        format!("{:.0} kPa, {rate_hz:.0} Hz, {:.0} ms", 1e-3 * young, 1e3 * delay_s)
    }
}

/// Stiffness [N/m] at which the simulated loop begins to diverge.
fn onset(cell: &Cell, bound: f64) -> Result<f64, VerifyError> {
    let (mut low, mut high) = (bound / 1.15, bound * 1.15);
    while high / low > 1.0 + BRACKET {
        let middle = (low * high).sqrt();
        *(if diverges(cell, middle)? { &mut high } else { &mut low }) = middle;
    }
    Ok((low * high).sqrt())
}

/// Results of one combination.
struct Found {
    /// Stable stiffness by the Nyquist criterion [N/m].
    bound: Option<f64>,
    /// Stiffness from which the simulated loop diverges [N/m].
    onset: Option<f64>,
    /// Couplings that eigenvalues and the Nyquist criterion judge differently.
    differ: u32,
    /// Beyond the bound without the controller.
    free: LoopRun,
    /// Runs with the controller: with the device's own losses, and without.
    controlled: [LoopRun; 2],
}

fn evaluate(cell: &Cell) -> Result<Found, VerifyError> {
    let bound = cell.bound();
    let onset = bound.map(|bound| onset(cell, bound)).transpose()?;
    let differ = disagreements(cell);
    let stiffness = bound.map_or(STIFFEST, |bound| BEYOND * bound);
    let own = DeviceSpec::TOUCH.damping_n_s_m;
    let free = press_with_fingertip(cell, stiffness, own, false)?;
    let controlled = [
        press_with_fingertip(cell, stiffness, own, true)?,
        press_with_fingertip(cell, stiffness, 0.0, true)?,
    ];
    Ok(Found { bound, onset, differ, free, controlled })
}

/// Three materials, four rates, four delays.
pub fn study() -> Result<Vec<Check>, VerifyError> {
    let mut cells = Vec::new();
    for young in YOUNG_PA {
        let body = standing_block(young)?;
        let Some((point, _)) = body.surface.nearest(DVec3::new(0.0, 0.5 * SIZE[1], 0.0)) else {
            return Err(VerifyError::NotReached("the block has no surface"));
        };
        for (rate_hz, delay_s) in RATES_HZ.into_iter().flat_map(|rate| DELAYS_S.map(|delay| (rate, delay))) {
            cells.push(Cell { young, body: body.clone(), point, rate_hz, delay_s });
        }
    }
    let looked: Result<Vec<Found>, VerifyError> = cells.par_iter().map(evaluate).collect();
    let mut checks = Vec::new();
    for (cell, found) in cells.iter().zip(looked?) {
        let name = cell.name();
        if let (Some(bound), Some(onset)) = (found.bound, found.onset) {
            checks.push(Check::new(
                format!("{name}: swings from [N/m], against the bound"),
                onset,
                bound,
                ONSET,
            ));
        }
        checks.push(Check::new(
            format!("{name}: couplings that eigenvalues judge otherwise"),
            f64::from(found.differ),
            0.0,
            0.0,
        ));
        let Found { free, controlled, .. } = &found;
        for (losses, with) in ["", ", no losses"].into_iter().zip(controlled) {
            let without = format!("{:.2e} without the controller", free.energy_out_j);
            let out = format!("{name}{losses}: energy out [J] ({without})");
            checks.push(Check::new(out, with.energy_out_j, 0.0, HIDDEN_J));
            let without = format!("{:.2e} without the controller", free.kinetic_at_end_j);
            let moves = format!("{name}{losses}: kinetic energy at rest [J] ({without})");
            checks.push(Check::new(moves, with.kinetic_at_end_j, 0.0, HIDDEN_J));
        }
    }
    Ok(checks)
}
