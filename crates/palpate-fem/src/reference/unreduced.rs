//! Unreduced model, and the response of the truncated modes.

use crate::body::RecordedBody;
use crate::krylov::{KrylovSpaces, LoadedMode};
use crate::modes::{ElasticModes, all_modes, orthonormality_error};
use crate::progress::Progress;
use crate::solve_error::SolveError;
use faer::Mat;

/// Unreduced finite element model of a recorded body.
#[derive(Clone, Copy)]
pub struct UnreducedModel<'a> {
    body: &'a RecordedBody,
}

/// Substitutes for the truncated modes at some nodes, from rational Krylov spaces (Grimme 1997).
pub struct TruncatedResponse<'a> {
    body: &'a RecordedBody,
    spaces: KrylovSpaces,
}

impl RecordedBody {
    /// Unreduced finite element model.
    pub fn unreduced(&self) -> UnreducedModel<'_> {
        UnreducedModel { body: self }
    }
}

impl<'a> UnreducedModel<'a> {
    /// Number of elastic modes of the body.
    pub fn elastic_mode_count(self) -> usize {
        self.body.system.elastic_modes()
    }

    /// Kept modes of the recording, at all nodes.
    pub fn kept_modes(self) -> &'a ElasticModes {
        &self.body.modes
    }

    /// The lowest modes by a dense decomposition, in O(dofs³): the second route to the modes of the recording.
    ///
    /// # Errors
    /// [`SolveError::DenseEigenproblem`].
    pub fn dense_modes(self, count: usize, progress: &mut dyn Progress) -> Result<ElasticModes, SolveError> {
        all_modes(&self.body.system, count, progress)
    }

    /// Orthonormality error of modes: the largest entry of |ΦᵀMΦ − I|.
    pub fn orthonormality_error(self, modes: &ElasticModes) -> f64 {
        orthonormality_error(&self.body.system, modes.shapes.as_ref())
    }

    /// Static elastic displacements [m] under loads [N], by inertia relief for a free body: a field per load.
    pub fn static_displacements(self, loads: &[Vec<f64>]) -> Vec<Vec<f64>> {
        fields(&self.body.system.elastic_compliance(matrix(self.body, loads)))
    }

    /// Products M·u of the mass matrix with fields.
    pub fn mass_times(self, fields_in: &[Vec<f64>]) -> Vec<Vec<f64>> {
        fields(&self.body.system.mass_times(matrix(self.body, fields_in).as_ref()))
    }

    /// Fields without their rigid motion, which is orthogonal in M; zero at fixed nodes.
    pub fn without_rigid_motion(self, fields_in: &[Vec<f64>]) -> Vec<Vec<f64>> {
        let mut columns = matrix(self.body, fields_in);
        self.body.system.remove_rigid(&mut columns);
        fields(&columns)
    }

    /// Response of the truncated modes at some nodes, for steps of `step_s` [s]. The certificate uses 18 Krylov
    /// `blocks`; an undamped body needs up to 40.
    ///
    /// # Errors
    /// [`SolveError`] when a shifted factor fails, or on interruption.
    pub fn truncated_response(
        self,
        nodes: &[usize],
        step_s: f64,
        blocks: usize,
        progress: &mut dyn Progress,
    ) -> Result<TruncatedResponse<'a>, SolveError> {
        let body = self.body;
        let mut loads = Mat::zeros(body.dofs(), 3 * nodes.len());
        for (at, axis) in (0..nodes.len()).flat_map(|at| (0..3).map(move |axis| (at, axis))) {
            loads[(3 * nodes[at] + axis, 3 * at + axis)] = 1.0;
        }
        let spaces = KrylovSpaces::new(&body.system, &body.modes, loads, step_s, blocks, progress)?;
        Ok(TruncatedResponse { body, spaces })
    }
}

impl TruncatedResponse<'_> {
    /// Substitute modes at a node, given by its index in the list of nodes, from the first `blocks` Krylov blocks.
    ///
    /// # Errors
    /// [`SolveError::DenseEigenproblem`].
    pub fn modes(&self, index: usize, blocks: usize) -> Result<Vec<LoadedMode>, SolveError> {
        let modes = self.spaces.projected(&self.body.system, index..index + 1).truncated_modes(blocks)?;
        Ok(modes.iter().map(|mode| mode.at(0)).collect())
    }
}

/// Fields as columns.
fn matrix(body: &RecordedBody, fields: &[Vec<f64>]) -> Mat<f64> {
    Mat::from_fn(body.dofs(), fields.len(), |row, column| fields[column][row])
}

/// Columns as fields.
fn fields(matrix: &Mat<f64>) -> Vec<Vec<f64>> {
    (0..matrix.ncols()).map(|column| matrix.col_as_slice(column).to_vec()).collect()
}
