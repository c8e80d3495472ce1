//! Narrow phase: contact candidates of tips, obstacles and other objects with the deformed surface of an object.

mod obstacle;
mod pair;
mod phong_projection;
mod point_surface;
mod tip;

pub(super) use point_surface::{APPROACH_FACTOR, MARGIN};
pub(crate) use tip::TipPair;

/// Barycentric weight below which a point counts as lying on the opposite edge.
const ON_EDGE: f64 = 0.02;
