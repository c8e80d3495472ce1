//! Direct convolution of a recorded table with the history of forces: equations (2), (4) to (10) of the paper.
//!
//! ```text
//! ũ_c[t] = Σ_{s=1}^{T−1} R_cc[s]·f[t−s]        O(n_c²·T), points in contact only
//! u[t]   = Σ_{s=0}^{T−1} R[s]·f[t−s]           O(n·n_c·T), all observed nodes, on demand
//! ```
//!
//! The history holds the loaded surface points of each of the last T steps, so contacts may appear, vanish and move over the
//! surface. In the table, successive samples of one number lie far apart (all observed degrees of freedom lie between).
//! The series R[0], R[1], … between a point in contact and a loaded point is therefore copied into one block when the two
//! first meet, weighted with their corners. Without room for a copy the table itself is read: equal numbers, more slowly.
//!
//! Equations: docs/theory.md (C8).

use super::ContactPoint;
use super::force_history::ForceHistory;
use crate::error::ModelError;
use crate::recording::{ImpulseResponse, Recording};
use crate::surface::SurfacePoint;
use alloc::format;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Recorded table in use by one object of a scene; immutable.
#[derive(Debug, Clone)]
pub(crate) struct Fir {
    recording: Arc<Recording>,
    table: Arc<ImpulseResponse>,
    /// Columns of each surface node's three axes.
    touchable: Vec<Option<[u32; 3]>>,
    /// Rows of each surface node's three axes among the observed degrees of freedom.
    observed: Vec<Option<[u32; 3]>>,
    /// Displacement per unit acceleration since the start [s²], laid out like `ImpulseResponse::gravity`.
    gravity: Option<Arc<[f64]>>,
}

/// Memory for copies of series between two points, per object [bytes].
const COPIES_BYTES: usize = 64 << 20;

/// Mark of an entry without copy.
const NONE: u32 = u32::MAX;

/// State of one object; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct FirState {
    pub(super) history: ForceHistory,
    /// Surface point of each slot.
    contacts: Vec<Option<SurfacePoint>>,
    /// Copies of series, T 3×3 blocks each; free copies; the copy of each (slot, source).
    copies: Vec<[f64; 9]>,
    unused: Vec<u32>,
    copy_of: Vec<u32>,
    /// Work [J] of forces on the deformation since the start.
    work: f64,
}

impl Fir {
    pub(crate) fn new(
        recording: Arc<Recording>,
        table: Arc<ImpulseResponse>,
        step_s: f64,
    ) -> Result<Self, ModelError> {
        table.validate(&recording.surface)?;
        if libm::fabs(table.step_s - step_s) > 1e-9 * step_s {
            let recorded_s = table.step_s;
            return Err(ModelError::ImpulseResponse {
                what: format!(
                    "the impulse response was recorded with a step of {recorded_s} s, the scene's step is {step_s} s"
                ),
            });
        }
        let touchable = ImpulseResponse::dof_indices(&recording.surface, &table.touchable_dofs);
        let observed = ImpulseResponse::dof_indices(&recording.surface, &table.observed_dofs);
        let gravity = table.gravity.as_ref().map(|response| {
            let mut sums = response.clone();
            let n = table.observed_dofs.len();
            for axis in sums.chunks_exact_mut(table.samples * n) {
                for at in n..axis.len() {
                    axis[at] += axis[at - n];
                }
            }
            sums.into()
        });
        Ok(Self { recording, table, touchable, observed, gravity })
    }

    /// Whether the table holds the response to acceleration of the whole body.
    pub(crate) fn has_gravity_response(&self) -> bool {
        self.gravity.is_some()
    }

    /// Whether forces may enter at all corners that carry weight.
    pub(crate) fn accepts(&self, point: &SurfacePoint) -> bool {
        let corners = self.recording.surface.corners(point);
        corners.iter().all(|&(node, weight)| weight == 0.0 || self.touchable[node].is_some())
    }

    /// Whether a surface point that forces may enter at can move.
    ///
    /// # Real time
    pub(crate) fn is_movable(&self, point: &SurfacePoint) -> bool {
        self.table.moves(self.recording.surface.corners(point), &self.touchable, &self.observed)
    }

    /// J_a·R[sample]·J_bᵀ between two surface points, row by row [m/N]; R_cc[0] of equation (9) for sample 0.
    ///
    /// # Real time
    pub(super) fn block(&self, sample: usize, a: &SurfacePoint, b: &SurfacePoint) -> [f64; 9] {
        let base = sample * self.table.observed_dofs.len();
        let mut sum = [0.0; 9];
        for (source, wb) in self.recording.surface.corners(b).into_iter().filter(|(_, w)| *w != 0.0) {
            let Some(columns) = self.touchable[source] else { continue };
            let columns = columns.map(|column| self.table.columns.column(column as usize));
            for (node, wa) in self.recording.surface.corners(a).into_iter().filter(|(_, w)| *w != 0.0) {
                let Some(rows) = self.observed[node] else { continue };
                for (at, value) in sum.iter_mut().enumerate() {
                    *value += wa * wb * columns[at % 3].at(base + rows[at / 3] as usize);
                }
            }
        }
        sum
    }

    /// R[0] between two surface points, R_cc[0] of equation (9).
    ///
    /// # Real time
    pub(crate) fn compliance(&self, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        DMat3::from_cols_array(&self.block(0, a, b)).transpose()
    }

    /// Displacement of a point under an acceleration that has acted for `steps` steps [m, body].
    pub(super) fn sag_of_point(&self, point: &SurfacePoint, acceleration: DVec3, steps: u64) -> DVec3 {
        let corners = self.recording.surface.corners(point);
        corners.iter().map(|&(node, weight)| self.sag(node, acceleration, steps) * weight).sum()
    }

    /// Rows of the table.
    pub(super) fn observed_dofs(&self) -> usize {
        self.table.observed_dofs.len()
    }

    /// Add R[age]·Jᵀ·f to all rows [m, body].
    pub(super) fn add(&self, age: usize, point: &SurfacePoint, force: DVec3, sum: &mut [f64]) {
        for (node, weight) in self.recording.surface.corners(point) {
            let Some(columns) = self.touchable[node].filter(|_| weight != 0.0) else { continue };
            for (column, force) in columns.into_iter().zip(force.to_array()) {
                self.table.columns.column(column as usize).add_to(age * sum.len(), weight * force, sum);
            }
        }
    }

    /// Displacement of a node by all rows; zero where it is not observed.
    pub(super) fn observed(&self, node: usize, rows: &[f64]) -> DVec3 {
        let own = self.observed[node];
        own.map_or(DVec3::ZERO, |own| DVec3::from_array(own.map(|row| rows[row as usize])))
    }

    /// Displacement of a node under an acceleration that has acted for `steps` steps [m, body].
    pub(super) fn sag(&self, node: usize, acceleration: DVec3, steps: u64) -> DVec3 {
        let (Some(sums), Some(rows), true) = (&self.gravity, self.observed[node], steps > 0) else {
            return DVec3::ZERO;
        };
        let (samples, n) = (self.table.samples, self.table.observed_dofs.len());
        let sample = (steps.min(samples as u64) - 1) as usize;
        let part = |row: u32| {
            let at = |axis: usize| sums[(axis * samples + sample) * n + row as usize];
            acceleration.dot(DVec3::new(at(0), at(1), at(2)))
        };
        DVec3::from_array(rows.map(part))
    }
}

impl FirState {
    pub(crate) fn new(fir: &Fir, slots: usize) -> Self {
        let samples = fir.table.samples;
        let history = ForceHistory::new(samples, slots);
        let sources = history.sources();
        let copies = (slots * sources).min(COPIES_BYTES / (72 * samples));
        Self {
            history,
            contacts: vec![None; slots],
            copies: vec![[0.0; 9]; copies * samples],
            unused: (0..copies as u32).rev().collect(),
            copy_of: vec![NONE; slots * sources],
            work: 0.0,
        }
    }

    /// Assign a surface point to a slot. Gives its displacement at the start of the step [m, body].
    ///
    /// # Real time
    /// Copies the series between the point and all sources, T samples each.
    pub(crate) fn assign(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, gravity: DVec3) -> DVec3 {
        self.contacts[slot] = Some(*point);
        self.convolve(fir, slot, point, 0) + fir.sag_of_point(point, gravity, self.history.steps())
    }

    /// Release a slot.
    ///
    /// # Real time
    pub(crate) fn release(&mut self, slot: usize) {
        self.contacts[slot] = None;
        (0..self.history.sources()).for_each(|source| self.drop_copy(slot, source));
    }

    fn drop_copy(&mut self, slot: usize, source: usize) {
        let copy = &mut self.copy_of[slot * self.history.sources() + source];
        if *copy != NONE {
            self.unused.push(*copy);
            *copy = NONE;
        }
    }

    /// Start of the copy of the series between a slot's point and a source, made now if there is memory.
    fn copy(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, source: usize) -> Option<usize> {
        let samples = fir.table.samples;
        let entry = slot * self.history.sources() + source;
        if self.copy_of[entry] == NONE {
            let copy = self.unused.pop()?;
            self.copy_of[entry] = copy;
            let series = &mut self.copies[copy as usize * samples..][..samples];
            for (sample, block) in series.iter_mut().enumerate() {
                *block = fir.block(sample, point, &self.history.point(source));
            }
        }
        Some(self.copy_of[entry] as usize * samples)
    }

    /// Σ R[age + ahead]·f over the history at a slot's point [m, body]; age 0 is the last step.
    fn convolve(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, ahead: usize) -> DVec3 {
        let samples = fir.table.samples;
        let mut sum = [0.0; 3];
        let add = |sum: &mut [f64; 3], block: &[f64; 9], force: &DVec3| {
            sum[0] += block[0] * force.x + block[1] * force.y + block[2] * force.z;
            sum[1] += block[3] * force.x + block[4] * force.y + block[5] * force.z;
            sum[2] += block[6] * force.x + block[7] * force.y + block[8] * force.z;
        };
        for source in 0..self.history.sources() {
            if self.history.window(source).is_none() {
                continue;
            }
            let copy = self.copy(fir, slot, point, source);
            let Some((forces, ages)) = self.history.window(source) else { continue };
            let ages = ages.start..ages.end.min(samples - ahead);
            match copy {
                Some(start) => {
                    let series = &self.copies[start + ahead..start + samples];
                    for (block, force) in series.iter().zip(forces).take(ages.end).skip(ages.start) {
                        add(&mut sum, block, force);
                    }
                }
                None => {
                    for age in ages {
                        let block = fir.block(age + ahead, point, &self.history.point(source));
                        add(&mut sum, &block, &forces[age]);
                    }
                }
            }
        }
        for (age, stray) in self.history.strays().filter(|(age, _)| age + ahead < samples) {
            add(&mut sum, &fir.block(age + ahead, point, &stray.point), &stray.force);
        }
        DVec3::from_array(sum)
    }

    /// ũ of equation (5) for a slot's point [m, body].
    ///
    /// # Real time
    /// Costs the forces of the last T steps.
    pub(crate) fn free(&mut self, fir: &Fir, slot: usize, gravity: DVec3) -> DVec3 {
        let Some(point) = self.contacts[slot] else { return DVec3::ZERO };
        self.convolve(fir, slot, &point, 1) + fir.sag_of_point(&point, gravity, self.history.steps() + 1)
    }

    /// Write the step's forces into the history, and drop those older than T steps.
    ///
    /// # Real time
    pub(crate) fn advance(&mut self, points: &[ContactPoint]) {
        let (sources, slots) = (self.history.sources(), self.contacts.len());
        for source in 0..sources {
            if self.history.ages(source) {
                (0..slots).for_each(|slot| self.drop_copy(slot, source));
            }
        }
        self.history.begin_step();
        for point in points {
            let force = point.force_in_body;
            self.work += force.dot(point.displacement - point.state.displacement);
            if force != DVec3::ZERO {
                self.history.add(&point.location.point, force);
            }
        }
    }

    /// Net work on the deformation since the start [J]: stored or dissipated energy, which a table does not separate.
    pub(crate) fn work(&self) -> f64 {
        self.work
    }
}
