//! Clamps: parts of surfaces that are held in all directions and go where rigid frames go.
//!
//! The part is divided into cells (`surface::cells`). The mean position of each is a bilateral constraint to a point that is fixed in
//! the frame,
//!
//! ```text
//! p + R·Σᵢ wᵢ·(Xᵢ + uᵢ) = T·T₀⁻¹·(p₀ + R₀·Σᵢ wᵢ·Xᵢ)
//! ```
//!
//! with T₀ and T [m, world] the frame at the start and at the end of the step, and p₀, R₀ the object at the start.
//!
//! Equations: docs/theory.md (C35), (C63).

use crate::error::ModelError;
use crate::recording::Recording;
use crate::spatial::Pose;
use crate::surface::{Cell, cells};
use alloc::format;
use alloc::vec::Vec;
use glam::DVec3;

/// Part of an object's surface that is held in all directions, and moved by a rigid frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Clamp {
    /// Number of the object in the model; one in modal form.
    pub object: usize,
    /// Triangles of the object's surface that it holds.
    pub triangles: Vec<u32>,
    /// Frame at the start [m, world]; torques are about its origin.
    pub frame: Pose,
    /// Upper limit of cells; each is three held directions.
    pub max_cells: usize,
}

/// Default number of cells of a clamp: four by four on a square face.
pub(crate) const MAX_CELLS: usize = 16;

/// Upper limit of `max_cells`: the factor of the held directions takes their cube.
const MOST_CELLS: usize = 256;

impl Clamp {
    /// Clamp with the default number of cells.
    pub fn new(object: usize, triangles: Vec<u32>, frame: Pose) -> Self {
        Self { object, triangles, frame, max_cells: MAX_CELLS }
    }

    /// Check numbers, with those of the objects' triangles.
    pub(crate) fn check(&self, clamp: usize, triangles: &[usize]) -> Result<(), ModelError> {
        let fail = |what| Err(ModelError::Clamp { clamp, what });
        let Some(&count) = triangles.get(self.object) else {
            return fail(format!("object is {}, expected below {}", self.object, triangles.len()));
        };
        if self.triangles.is_empty() || self.triangles.iter().any(|t| *t as usize >= count) {
            return fail(format!("triangles must be one or more, with numbers below {count}"));
        }
        if !(1..=MOST_CELLS).contains(&self.max_cells) {
            return fail(format!("max_cells is {}, expected 1 to {MOST_CELLS}", self.max_cells));
        }
        let length = self.frame.orientation.length();
        if !(self.frame.position.is_finite() && (0.99..=1.01).contains(&length)) {
            return fail("frame needs a finite position and a unit quaternion".into());
        }
        Ok(())
    }

    /// Cells of its part of the surface.
    pub(crate) fn cells(&self, recording: &Recording) -> Vec<Cell> {
        cells(&recording.surface, recording.surface_order(), &self.triangles, self.max_cells)
    }
}

/// Clamp of a model: its cells on the object, and the points of its frame that they are held at.
#[derive(Debug, Clone)]
pub(crate) struct PlacedClamp {
    pub(crate) object: usize,
    /// Number of the first of its cells among those of the object.
    pub(crate) first_cell: usize,
    /// Points of the frame [m, frame].
    pub(crate) points: Vec<DVec3>,
}

/// State of a clamp between steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ClampState {
    /// Frame at the start and at the end of the step [m, world].
    pub(crate) start: Pose,
    pub(crate) end: Pose,
}

impl ClampState {
    pub(crate) fn new(frame: Pose) -> Self {
        let frame = Pose { orientation: frame.orientation.normalize(), ..frame };
        Self { start: frame, end: frame }
    }
}
