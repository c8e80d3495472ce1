//! Contact points of one object, and their compliance within a step.
//!
//! C [m/N] in body axes, R_cc[0] of equation (9), depends on the locations of the points, not on time: a block is computed
//! when a point gets its location.
//!
//! Equations: docs/theory.md (C31), (C32), (C34).

use super::{ContactLocation, Footprint, LocationState, ResponseView};
use crate::dot_products::dot;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Contact point of an object during a step.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ContactPoint {
    pub(crate) location: ContactLocation,
    /// Slot of its rows in the response; constant while the point lasts.
    pub(crate) slot: usize,
    /// Surface node at the location, if it is one.
    pub(crate) node: Option<usize>,
    /// Whether its location is new in this step.
    pub(crate) is_new: bool,
    /// Rest position [m, body].
    pub(crate) rest: DVec3,
    /// State of the location at the start of the step.
    pub(crate) state: LocationState,
    /// Displacement at the end of the step without contact force [m, body].
    pub(crate) free: DVec3,
    /// Displacement at the end of the step [m, body].
    pub(crate) displacement: DVec3,
    /// Prescribed force [N, world]; none at contacts.
    pub(crate) prescribed: Option<DVec3>,
    /// Force on the object, held over the step [N, world], and in body axes.
    pub(crate) force: DVec3,
    pub(crate) force_in_body: DVec3,
    /// Arm from the centre of mass at the start and at the end of the step [m, world].
    pub(crate) start_arm: DVec3,
    pub(crate) end_arm: DVec3,
}

impl ContactPoint {
    /// Surface node of a point without patch, if the location is a node.
    pub(crate) fn single_node(&self) -> Option<usize> {
        self.node.filter(|_| self.location.footprint == Footprint::Point)
    }
}

/// Contact points of one object; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct ContactPoints {
    pub(crate) points: Vec<ContactPoint>,
    /// C, row-major, with rows `stride` numbers apart.
    compliance: Vec<f64>,
    stride: usize,
    /// Forces g [N, body] and displacements C·g [m, body], three numbers per point.
    forces: Vec<f64>,
    moved: Vec<f64>,
    unused: Vec<usize>,
    /// Index in `points` of each slot's point.
    at: Vec<usize>,
}

impl ContactPoints {
    pub(crate) fn new(capacity: usize) -> Self {
        let stride = 3 * capacity;
        Self {
            points: Vec::with_capacity(capacity),
            compliance: vec![0.0; stride * stride],
            stride,
            forces: vec![0.0; stride],
            moved: vec![0.0; stride],
            unused: (0..capacity).rev().collect(),
            at: vec![0; capacity],
        }
    }

    /// Upper limit of points.
    pub(crate) fn capacity(&self) -> usize {
        self.at.len()
    }

    /// Index of a slot's point.
    pub(crate) fn index(&self, slot: usize) -> usize {
        self.at[slot]
    }

    pub(crate) fn of(&self, slot: usize) -> &ContactPoint {
        &self.points[self.at[slot]]
    }

    /// Set the prescribed force of a slot's point [N, world].
    pub(crate) fn prescribe(&mut self, slot: usize, force: DVec3) {
        self.points[self.at[slot]].prescribed = Some(force);
    }

    /// Add a point at a location. Gives its slot, or none at capacity.
    ///
    /// # Real time
    /// Costs modes × points.
    pub(crate) fn add(&mut self, view: &mut ResponseView, location: ContactLocation) -> Option<usize> {
        let slot = self.unused.pop()?;
        let at = self.points.len();
        self.at[slot] = at;
        self.forces[3 * at..3 * at + 3].fill(0.0);
        self.moved[3 * at..3 * at + 3].fill(0.0);
        self.points.push(ContactPoint {
            location,
            slot,
            node: None,
            is_new: true,
            rest: DVec3::ZERO,
            state: LocationState::default(),
            free: DVec3::ZERO,
            displacement: DVec3::ZERO,
            prescribed: None,
            force: DVec3::ZERO,
            force_in_body: DVec3::ZERO,
            start_arm: DVec3::ZERO,
            end_arm: DVec3::ZERO,
        });
        self.set_location(view, slot, location);
        Some(slot)
    }

    /// Move a point to another location.
    ///
    /// # Real time
    /// Costs modes × points.
    pub(crate) fn set_location(&mut self, view: &mut ResponseView, slot: usize, location: ContactLocation) {
        let at = self.at[slot];
        self.push(at, DVec3::ZERO);
        let start = view.assign(slot, &location);
        let rest = view.body.rest_position(&location);
        let point = &mut self.points[at];
        (point.location, point.rest, point.state, point.is_new) = (location, rest, start, true);
        let corners = view.body.corners(&location);
        point.node = corners.into_iter().find(|(_, weight)| *weight == 1.0).map(|(node, _)| node);
        let Self { points, compliance, stride, .. } = self;
        view.compliance((slot, &location), points, |other, block| {
            write(compliance, *stride, (at, other), &block);
            write(compliance, *stride, (other, at), &block.transpose());
        });
        let force = DVec3::from_slice(&self.forces[3 * at..]);
        debug_assert_eq!(force, DVec3::ZERO);
        let forces = &self.forces[..3 * self.points.len()];
        for axis in 0..3 {
            self.moved[3 * at + axis] =
                dot(&self.compliance[(3 * at + axis) * self.stride..][..forces.len()], forces);
        }
    }

    /// Remove a point.
    ///
    /// # Real time
    pub(crate) fn remove(&mut self, slot: usize) {
        let (at, last) = (self.at[slot], self.points.len() - 1);
        self.push(at, DVec3::ZERO);
        if at != last {
            // The last point takes the free index.
            for other in 0..last {
                if other != at {
                    let block = self.block(last, other);
                    write(&mut self.compliance, self.stride, (at, other), &block);
                    write(&mut self.compliance, self.stride, (other, at), &block.transpose());
                }
            }
            let own = self.block(last, last);
            write(&mut self.compliance, self.stride, (at, at), &own);
            self.forces.copy_within(3 * last..3 * last + 3, 3 * at);
            self.moved.copy_within(3 * last..3 * last + 3, 3 * at);
            self.at[self.points[last].slot] = at;
        }
        self.points.swap_remove(at);
        self.unused.push(slot);
    }

    /// Block of C between two points, by their indices [m/N].
    pub(crate) fn block(&self, row: usize, column: usize) -> DMat3 {
        let part =
            |axis: usize| DVec3::from_slice(&self.compliance[(3 * row + axis) * self.stride + 3 * column..]);
        DMat3::from_cols(part(0), part(1), part(2)).transpose()
    }

    /// Set the force on a point [N, body].
    ///
    /// # Real time
    /// Costs the number of points, unless it stays as it is.
    pub(crate) fn push(&mut self, at: usize, force_in_body: DVec3) {
        let change = force_in_body - DVec3::from_slice(&self.forces[3 * at..]);
        self.points[at].force_in_body = force_in_body;
        if change == DVec3::ZERO {
            return;
        }
        force_in_body.write_to_slice(&mut self.forces[3 * at..]);
        // C is symmetric: its rows are its columns.
        let n = 3 * self.points.len();
        let row = |axis: usize| &self.compliance[(3 * at + axis) * self.stride..][..n];
        let rows = row(0).iter().zip(row(1)).zip(row(2));
        for (moved, ((x, y), z)) in self.moved[..n].iter_mut().zip(rows) {
            *moved += x * change.x + y * change.y + z * change.z;
        }
    }

    /// Set all forces to zero.
    ///
    /// # Real time
    pub(crate) fn release_forces(&mut self) {
        let n = 3 * self.points.len();
        self.forces[..n].fill(0.0);
        self.moved[..n].fill(0.0);
        for point in &mut self.points {
            (point.force, point.force_in_body) = (DVec3::ZERO, DVec3::ZERO);
        }
    }

    /// Displacement of a point under the present forces [m, body].
    ///
    /// # Real time
    pub(crate) fn displaced(&self, at: usize) -> DVec3 {
        self.points[at].free + DVec3::from_slice(&self.moved[3 * at..])
    }

    /// Sum C·g of one point again, in turn, so that round-off does not grow.
    ///
    /// # Real time
    /// Costs the number of points.
    pub(crate) fn resum_next(&mut self, step: u64) {
        let count = self.points.len() as u64;
        let Some(at) = step.checked_rem(count).map(|at| at as usize) else { return };
        for row in 3 * at..3 * at + 3 {
            let length = 3 * self.points.len();
            self.moved[row] = dot(&self.compliance[row * self.stride..][..length], &self.forces[..length]);
        }
    }

    /// Predict the displacement of every point without contact force.
    ///
    /// # Real time
    pub(crate) fn predict(&mut self, view: &mut ResponseView) {
        for point in &mut self.points {
            point.free = view.free((point.slot, &point.location), &point.state);
        }
    }

    /// Read the state of every point's location again.
    ///
    /// # Real time
    pub(crate) fn read_state(&mut self, view: &mut ResponseView) {
        for point in &mut self.points {
            point.state = view.assign(point.slot, &point.location);
            point.free = view.free((point.slot, &point.location), &point.state);
        }
    }

    /// Let the sag of all points follow a change of gravity.
    ///
    /// # Real time
    pub(crate) fn change_gravity(&mut self, view: &mut ResponseView) {
        if view.body.recording.gravity.is_some() {
            for point in &mut self.points {
                let change = view.body.sag(&point.location, view.gravity) - point.state.sag;
                let LocationState { displacement, residual, sag, .. } = &mut point.state;
                [displacement, residual, sag].into_iter().for_each(|value| *value += change);
            }
        }
    }

    /// Predict the displacement of points that are new since then.
    ///
    /// # Real time
    pub(crate) fn predict_new(&mut self, view: &mut ResponseView) {
        for point in self.points.iter_mut().filter(|point| point.is_new) {
            point.free = view.free((point.slot, &point.location), &point.state);
            point.is_new = false;
        }
    }
}

/// Write the block of a row and a column.
fn write(compliance: &mut [f64], stride: usize, (row, column): (usize, usize), block: &DMat3) {
    for axis in 0..3 {
        block.row(axis).write_to_slice(&mut compliance[(3 * row + axis) * stride + 3 * column..]);
    }
}
