//! Rows of a step: where objects are held, what their points see, and the forces that solve them.

mod held;
mod rows;

pub(crate) use held::HeldSystem;
pub(crate) use rows::{HeldPoint, HeldPoints};

use crate::surface::SurfacePoint;

/// A surface point of an object that a device holds in all three directions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grasp {
    /// Position of the object in the model.
    pub object: usize,
    /// The material point.
    pub point: SurfacePoint,
}
