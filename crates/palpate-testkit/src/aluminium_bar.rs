//! Bar of aluminium that is struck to hear its modes.

use crate::material::undamped;
use crate::recording_cache::recorded_once;
use palpate::{Damping, Recording};
use palpate_fem::{ElementOrder, RecordError, RecordExtent, RecordParameters};
use palpate_mesh::{CellSplit, split_box_mesh};
use std::sync::Arc;

/// Sides of the bar along x, y and z [m]: flexural modes of the plane x, y from 580 Hz on.
pub const BAR_SIZE_M: [f64; 3] = [0.3, 0.01, 0.03];

/// Young's modulus [Pa], Poisson's ratio and density [kg/m³] of the bar.
pub const BAR_MATERIAL: (f64, f64, f64) = (6.9e10, 0.33, 2700.0);

/// Damping ratio of all modes of the bar [1].
pub const BAR_DAMPING: f64 = 1e-3;

/// Free bar with its 30 lowest modes, with quadratic elements and without certificate.
///
/// # Errors
/// As [`palpate_fem::record`].
pub fn aluminium_bar() -> Result<Arc<Recording>, RecordError> {
    let mesh = split_box_mesh(BAR_SIZE_M, [30, 2, 3], CellSplit::Six)?;
    let (young, poisson, density) = BAR_MATERIAL;
    let parameters = RecordParameters {
        damping: Damping::Ratio(BAR_DAMPING),
        extent: RecordExtent::NoCertificate,
        ..undamped(young, poisson, density, ElementOrder::Quadratic, 30)
    };
    recorded_once(mesh, &parameters)
}
