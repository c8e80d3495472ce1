//! Recorded table of impulse responses R[s] in use by one object: equations (2), (4) to (10) of the paper.
//!
//! ```text
//! ũ_c[t] = Σ_{s=1}^{T−1} R_cc[s]·f[t−s]        O(n_c²·T), nodes in contact only
//! u[t]   = Σ_{s=0}^{T−1} R[s]·f[t−s]           O(n·n_c·T), all observed nodes, on demand
//! ```
//!
//! Forces at points and patches are distributed to nodes; displacements of points and patches are averages of those of nodes. So
//! contacts may appear, vanish and slide, and the series between two nodes serves them all.
//!
//! Equations: docs/theory.md (C8).

use super::force_history::ForceSeries;
use super::modal::SampledModes;
use super::{Body, ContactLocation, OscillatorState};
use crate::dot_products::BLOCK;
use crate::error::ModelError;
use crate::recording::{ImpulseResponse, Recording, ResponseSeries, has_weight};
use crate::surface::SurfacePoint;
use alloc::format;
use alloc::sync::Arc;
use alloc::vec::Vec;
use core::ops::Range;
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
    /// Modal form, by which the surface moves where contacts are searched for.
    pub(super) modes: SampledModes,
    /// State of each mode T − 1 steps after the one in which a unit modal force was held.
    pub(super) last_states: Vec<OscillatorState>,
}

impl Fir {
    pub(crate) fn new(
        recording: Arc<Recording>,
        table: Arc<ImpulseResponse>,
        step_s: f64,
    ) -> Result<Self, ModelError> {
        table.validate(&recording.surface)?;
        if recording.embedding.is_some() {
            let what = "an impulse response is between the nodes of the finite elements: record the body without an embedded surface";
            return Err(ModelError::ImpulseResponse { what: what.into() });
        }
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
        let modes = SampledModes::new(&recording, step_s);
        let last_states = modes.states_after(table.samples - 1);
        Ok(Self { recording, table, touchable, observed, gravity, modes, last_states })
    }

    /// Table.
    pub(super) fn table(&self) -> &ImpulseResponse {
        &self.table
    }

    /// Number of samples T.
    pub(super) fn samples(&self) -> usize {
        self.table.samples
    }

    /// Whether forces may enter at each surface node.
    pub(super) fn touchable_nodes(&self) -> impl Iterator<Item = bool> {
        self.touchable.iter().map(Option::is_some)
    }

    /// Whether the table holds the response to acceleration of the whole body.
    pub(crate) fn has_gravity_response(&self) -> bool {
        self.gravity.is_some()
    }

    /// Whether forces may enter at all corners that carry weight.
    pub(crate) fn accepts(&self, point: &SurfacePoint) -> bool {
        let corners = self.recording.surface.corners(point);
        corners.into_iter().filter(has_weight).all(|(node, _)| self.touchable[node].is_some())
    }

    /// Whether a surface point that forces may enter at can move.
    ///
    /// # Real time
    pub(crate) fn is_movable(&self, point: &SurfacePoint) -> bool {
        self.table.moves(self.recording.surface.corners(point), &self.touchable, &self.observed)
    }

    /// Responses of an observed degree of freedom to a touchable one [m/N].
    fn series(&self, column: u32, row: u32) -> ResponseSeries<'_> {
        self.table.columns.column(column as usize).series(row as usize, self.table.samples)
    }

    /// R[sample] between two surface nodes, row by row [m/N]; zero unless displacement is observed at the first, and force can enter at
    /// the second.
    ///
    /// # Real time
    pub(super) fn block(&self, sample: usize, node: usize, source: usize) -> [f64; 9] {
        let (Some(rows), Some(columns)) = (self.observed[node], self.touchable[source]) else {
            return [0.0; 9];
        };
        core::array::from_fn(|at| self.series(columns[at % 3], rows[at / 3]).at(sample))
    }

    /// Σ R[age + ahead]·f of a force series at a surface node, over a range of ages [m, body].
    ///
    /// # Real time
    /// Costs the samples.
    pub(super) fn convolve(
        &self,
        (node, ahead): (usize, usize),
        forces: &ForceSeries,
        ages: Range<usize>,
    ) -> DVec3 {
        let ages = forces.ages(ahead, ages);
        let (Some(rows), Some(columns), false) =
            (self.observed[node], self.touchable[forces.node], ages.is_empty())
        else {
            return DVec3::ZERO;
        };
        let mut sum = [0.0; 3];
        for (axis, column) in columns.into_iter().enumerate() {
            let forces = &forces.along(axis)[ages.clone()];
            for (sum, row) in sum.iter_mut().zip(rows) {
                *sum += self.series(column, row).dot(ahead + ages.start, forces);
            }
        }
        DVec3::from_array(sum)
    }

    /// Add Σ R[age + ahead + k]·f of a force series at a surface node, over the ages from one on, to the outputs k of a block, along each axis [m,
    /// body].
    ///
    /// # Real time
    /// Costs the samples times the block.
    pub(super) fn correlate(
        &self,
        (node, ahead): (usize, usize),
        forces: &ForceSeries,
        from: usize,
        sums: &mut [[f64; BLOCK]; 3],
    ) {
        let ages = forces.ages(ahead, from..self.table.samples);
        let (Some(rows), Some(columns), false) =
            (self.observed[node], self.touchable[forces.node], ages.is_empty())
        else {
            return;
        };
        for (axis, column) in columns.into_iter().enumerate() {
            let forces = &forces.along(axis)[ages.clone()];
            let column = self.table.columns.column(column as usize);
            column.correlate((rows, self.table.samples), ahead + ages.start, forces, sums);
        }
    }

    /// J_a·R[0]·J_bᵀ between two contact locations [m/N], R_cc[0] of equation (9).
    ///
    /// # Real time
    /// Costs the nodes of one location times those of the other.
    pub(super) fn compliance(&self, body: &Body, a: &ContactLocation, b: &ContactLocation) -> DMat3 {
        let mut sum = [0.0; 9];
        body.distribute(b, |source, of_source| {
            body.distribute(a, |node, of_node| {
                let block = self.block(0, node, source);
                sum.iter_mut().zip(block).for_each(|(sum, r)| *sum += of_node * of_source * r);
            });
        });
        DMat3::from_cols_array(&sum).transpose()
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
