//! Tables of impulse responses R[s] for direct convolution, column by column (section 3.1 of the paper).
//!
//! Two independent methods: *closed form*, from the recording's modes and residual compliance, R[s] = Φ·g(s)·Φᵀ with S
//! added to R[0] and g(s) the exact response of each mode to a force that is constant over one step; and *transient*, time
//! integration of the whole finite element system (see `transient.rs`). Columns are independent of each other.
//! `palpate-store` writes them to disk.

use crate::body::RecordedBody;
use crate::kernels::multiply;
use crate::residual::truncated_displacements;
use crate::solve_error::SolveError;
use crate::transient::{Transient, TransientState, resolved_frequency_hz};
use faer::{Accum, Mat, MatMut};
use palpate::{Damping, OscillatorState, ResidualCompliance, SampledOscillator, SampledResidual, Sampling};
use rayon::prelude::*;

/// Parameters of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableParameters {
    /// Step h of the table [s].
    pub step_s: f64,
    /// Number of samples T.
    pub samples: usize,
    /// Meaning of a sample.
    pub sampling: Sampling,
    /// Method of computation.
    pub method: TableMethod,
    /// Touchable nodes, where forces may act, ascending; numbered as in [`RecordedBody`].
    pub touchable_nodes: Vec<u32>,
    /// Observed nodes, whose displacement is recorded, ascending.
    pub observed_nodes: Vec<u32>,
}

/// Method that a table is computed by.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableMethod {
    /// Closed form, from the modes and the residual compliance of the recording: the numbers of the modal response.
    ClosedForm,
    /// Time integration of the whole finite element system.
    Transient {
        /// Integration steps per sample, at least 1; per half sample with [`Sampling::Mean`].
        substeps: u32,
    },
}

/// A table that cannot be computed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// The step is out of range.
    #[error("the table's step is {step_s} s, expected above 0 and at most 1")]
    Step {
        /// The given step [s].
        step_s: f64,
    },
    /// The table has no sample.
    #[error("the table has 0 samples: the duration is shorter than a step")]
    NoSamples,
    /// The surface is embedded: a table is between nodes of the finite elements.
    #[error("a table has no embedded surface: record the boundary of the tetrahedra")]
    EmbeddedSurface,
    /// The integrator has no step per sample.
    #[error("the integrator needs at least 1 step per sample")]
    NoSubsteps,
    /// Time integration needs a damping matrix, which a damping ratio is not.
    #[error(
        "the same damping ratio for every mode is no damping matrix that can be integrated: use Rayleigh damping \
         (--rayleigh), or the closed form"
    )]
    DampingRatio,
    /// The factor of the integrator failed.
    #[error(transparent)]
    Solve(#[from] SolveError),
}

/// Number of columns per thread at which the time integration is fastest.
pub const COLUMN_BLOCK: usize = 48;

/// Computes the columns of a table.
pub struct TableRecorder<'a> {
    body: &'a RecordedBody,
    parameters: &'a TableParameters,
    method: Evaluation<'a>,
}

enum Evaluation<'a> {
    ClosedForm(ClosedForm),
    Transient { integrator: Transient<'a>, substeps: u32 },
}

struct ClosedForm {
    /// Response g(s) [s²] of each mode to a unit modal force that is constant over the first step, s·m + mode.
    modal_responses: Vec<f64>,
    /// Mode shapes Φ at the observed degrees of freedom, a row each.
    observed: Mat<f64>,
    /// Index of each node on the recording's surface.
    surface_index: Vec<Option<u32>>,
    /// Whether interior nodes are observed.
    observes_interior: bool,
    /// Response of the residual compliance in each sample, as a share of it.
    residual_shares: Vec<f64>,
}

impl<'a> TableRecorder<'a> {
    /// Prepares the table of a recorded body.
    ///
    /// # Errors
    /// [`TableError`] when a parameter is out of range, or the factor of the integrator fails.
    pub fn new(body: &'a RecordedBody, parameters: &'a TableParameters) -> Result<Self, TableError> {
        let h = parameters.step_s;
        if !(h > 0.0 && h <= 1.0) {
            return Err(TableError::Step { step_s: h });
        }
        if parameters.samples == 0 {
            return Err(TableError::NoSamples);
        }
        if body.recording.embedding.is_some() {
            return Err(TableError::EmbeddedSurface);
        }
        let damping = body.recording.metadata.damping;
        let method = match (parameters.method, damping) {
            (TableMethod::ClosedForm, _) => {
                Evaluation::ClosedForm(ClosedForm::new(body, parameters, damping))
            }
            (TableMethod::Transient { substeps: 0 }, _) => {
                return Err(TableError::NoSubsteps);
            }
            (TableMethod::Transient { .. }, Damping::Ratio(zeta)) if zeta > 0.0 => {
                return Err(TableError::DampingRatio);
            }
            (TableMethod::Transient { substeps }, damping) => {
                let (alpha, beta) = match damping {
                    Damping::Rayleigh { alpha, beta } => (alpha, beta),
                    Damping::Ratio(_) => (0.0, 0.0),
                };
                let step = evaluation_interval_s(parameters) / f64::from(substeps);
                let integrator = Transient::new(&body.system, alpha, beta, step)?;
                Evaluation::Transient { integrator, substeps }
            }
        };
        Ok(Self { body, parameters, method })
    }

    /// Touchable degrees of freedom, 3·node + axis, nodes numbered as in the input mesh.
    pub fn touchable_dofs(&self) -> Vec<u32> {
        dofs(self.body, &self.parameters.touchable_nodes)
    }

    /// Observed degrees of freedom, numbered alike.
    pub fn observed_dofs(&self) -> Vec<u32> {
        dofs(self.body, &self.parameters.observed_nodes)
    }

    /// Length of a column: T × observed degrees of freedom.
    pub fn column_length(&self) -> usize {
        self.parameters.samples * 3 * self.parameters.observed_nodes.len()
    }

    /// Frequency [Hz] up to which the time integration follows an oscillation to 1 % over 0.1 s; none for the closed form.
    pub fn resolved_frequency_hz(&self) -> Option<f64> {
        match &self.method {
            Evaluation::ClosedForm(_) => None,
            Evaluation::Transient { substeps, .. } => {
                Some(resolved_frequency_hz(evaluation_interval_s(self.parameters) / f64::from(*substeps)))
            }
        }
    }

    /// Working memory [bytes] for columns in blocks of some width, in addition to the columns themselves.
    pub fn working_bytes(&self, columns: usize, block: usize) -> usize {
        let dofs = self.body.system.discretisation.dofs();
        match &self.method {
            Evaluation::ClosedForm(_) => {
                8 * rayon::current_num_threads()
                    * (self.parameters.samples * self.body.modes.squares.len() + dofs)
            }
            Evaluation::Transient { .. } => {
                8 * 12 * dofs * block * columns.div_ceil(block).min(rayon::current_num_threads())
            }
        }
    }

    /// Columns [m/N] of a range of touchable degrees of freedom, sample after sample.
    ///
    /// All threads of rayon compute a `block` of columns at a time; the last bits of integrated columns depend on its
    /// width, and on nothing else. `done` is called with the number of newly finished columns.
    pub fn columns(
        &self,
        range: std::ops::Range<usize>,
        block: usize,
        done: &(dyn Fn(usize) + Sync),
    ) -> Vec<Vec<f64>> {
        match &self.method {
            Evaluation::ClosedForm(form) => range
                .into_par_iter()
                .map(|touchable| {
                    let column = form.column(self.body, self.parameters, touchable);
                    done(1);
                    column
                })
                .collect(),
            Evaluation::Transient { integrator, substeps } => {
                let starts: Vec<usize> = range.clone().step_by(block).collect();
                let of_block = |&start: &usize| {
                    let part = start..(start + block).min(range.end);
                    let columns = self.integrate(integrator, *substeps, part.clone(), block);
                    done(part.len());
                    columns
                };
                starts.par_iter().flat_map_iter(of_block).collect()
            }
        }
    }

    /// Response [s²] of a body with fixed nodes to a uniform acceleration along each axis that is constant over the first
    /// step, (axis·T + sample)·observed + dof; none for a free body.
    pub fn gravity(&self) -> Option<Vec<f64>> {
        let system = &self.body.system;
        (system.supported_nodes > 0).then(|| self.responses_to(system.uniform_weight()).concat())
    }

    /// Responses [m] to loads [N] on all degrees of freedom that are constant over the first step: T × observed
    /// displacements per load, sample after sample.
    pub fn responses(&self, loads: &[Vec<f64>]) -> Vec<Vec<f64>> {
        self.responses_to(Mat::from_fn(self.body.dofs(), loads.len(), |row, column| loads[column][row]))
    }

    /// [`Self::responses`] to loads that are columns.
    fn responses_to(&self, mut loads: Mat<f64>) -> Vec<Vec<f64>> {
        let (system, modes) = (&self.body.system, &self.body.modes);
        match &self.method {
            Evaluation::ClosedForm(form) => {
                let gains = modes.shapes.transpose() * &loads;
                let residual = truncated_displacements(system, modes, loads, &gains);
                // A body that starts under gravity has the part of its sag beyond the modes at once, as in modal form.
                let respond =
                    |j| form.response(self.parameters, |i| gains[(i, j)], |dof| residual[(dof, j)], &[1.0]);
                (0..gains.ncols()).map(respond).collect()
            }
            Evaluation::Transient { integrator, substeps } => {
                system.balance(&mut loads);
                self.integrate_loads(integrator, *substeps, loads)
            }
        }
    }

    /// Columns of a part, padded with zero loads to the width of the block.
    fn integrate(
        &self,
        integrator: &Transient<'_>,
        substeps: u32,
        part: std::ops::Range<usize>,
        block: usize,
    ) -> Vec<Vec<f64>> {
        let system = &self.body.system;
        let mut loads = Mat::zeros(system.discretisation.dofs(), block);
        for (column, touchable) in part.clone().enumerate() {
            loads[(dof(&self.parameters.touchable_nodes, touchable), column)] = 1.0;
        }
        system.balance(&mut loads);
        let mut columns = self.integrate_loads(integrator, substeps, loads);
        columns.truncate(part.len());
        columns
    }

    fn integrate_loads(&self, integrator: &Transient<'_>, substeps: u32, loads: Mat<f64>) -> Vec<Vec<f64>> {
        let TableParameters { samples, sampling, observed_nodes, .. } = self.parameters;
        let width = 3 * observed_nodes.len();
        let mut columns = vec![vec![0.0; samples * width]; loads.ncols()];
        // The mean takes the middle and the end of a step; the force acts through both halves.
        let evaluations = evaluations_per_sample(*sampling);
        let mut motion: Option<TransientState> = None;
        for evaluation in 0..samples * evaluations {
            for _ in 0..substeps {
                match &mut motion {
                    None => motion = Some(integrator.start(&loads)),
                    Some(motion) if evaluation < evaluations => integrator.advance_loaded(motion, &loads),
                    Some(motion) => integrator.advance(motion),
                }
            }
            let Some(motion) = &motion else { continue };
            let mut displacement = motion.displacement();
            self.body.system.remove_rigid(&mut displacement);
            for (j, column) in columns.iter_mut().enumerate() {
                let sample = &mut column[evaluation / evaluations * width..][..width];
                for (at, value) in sample.iter_mut().enumerate() {
                    *value += displacement[(dof(observed_nodes, at), j)] / evaluations as f64;
                }
            }
        }
        columns
    }
}

impl ClosedForm {
    fn new(body: &RecordedBody, parameters: &TableParameters, damping: Damping) -> Self {
        let modes = &body.modes;
        let m = modes.squares.len();
        let mut modal_responses = vec![0.0; parameters.samples * m];
        let evaluations = evaluations_per_sample(parameters.sampling);
        for (i, square) in modes.squares.iter().enumerate() {
            let omega = square.sqrt();
            let oscillator =
                SampledOscillator::new(omega, damping.ratio(omega), evaluation_interval_s(parameters));
            let mut state = OscillatorState::default();
            for evaluation in 0..parameters.samples * evaluations {
                state = oscillator.advance(state, if evaluation < evaluations { 1.0 } else { 0.0 });
                modal_responses[evaluation / evaluations * m + i] += state.q / evaluations as f64;
            }
        }
        let rows = 3 * parameters.observed_nodes.len();
        let observed =
            Mat::from_fn(rows, m, |row, i| modes.shapes[(dof(&parameters.observed_nodes, row), i)]);
        let mut surface_index = vec![None; body.system.discretisation.nodes.len()];
        for (at, &node) in body.system.discretisation.surface_nodes().iter().enumerate() {
            surface_index[node as usize] = Some(at as u32);
        }
        let is_interior = |node: &u32| surface_index[*node as usize].is_none();
        let observes_interior = parameters.observed_nodes.iter().any(is_interior);
        let highest = modes.squares.last().map_or(f64::INFINITY, |square| square.sqrt());
        let relaxation_s = damping.residual_relaxation_s(highest);
        let residual = SampledResidual::new(relaxation_s, evaluation_interval_s(parameters));
        let mut residual_shares = vec![0.0; parameters.samples];
        if evaluations == 1 {
            residual_shares.iter_mut().enumerate().for_each(|(s, share)| *share = residual.share(s));
        } else {
            // A mean over the step does not lead: nothing is extrapolated to its end.
            let (decay, mut share) = (residual.decay(), 0.0);
            for evaluation in 0..parameters.samples * evaluations {
                share = decay * share + if evaluation < evaluations { 1.0 - decay } else { 0.0 };
                residual_shares[evaluation / evaluations] += share / evaluations as f64;
            }
        }
        Self { modal_responses, observed, surface_index, observes_interior, residual_shares }
    }

    /// One column [m/N]: the response of the modes, and the relaxation of the residual compliance.
    fn column(&self, body: &RecordedBody, parameters: &TableParameters, touchable: usize) -> Vec<f64> {
        let load = dof(&parameters.touchable_nodes, touchable);
        let shapes = &body.modes.shapes;
        // Between surface nodes the recording's own rounded and tapered values, so that both forms of the response are
        // equal; elsewhere S = G − Φ·Λ⁻¹·Φᵀ is computed.
        let interior = self.observes_interior || self.surface_index[load / 3].is_none();
        let computed =
            (interior && !matches!(body.recording.residual, ResidualCompliance::None)).then(|| {
                let mut unit = Mat::zeros(body.system.discretisation.dofs(), 1);
                unit[(load, 0)] = 1.0;
                let gains = shapes.subrows(load, 1).transpose().to_owned();
                truncated_displacements(&body.system, &body.modes, unit, &gains)
            });
        let residual = |row: usize| match (self.surface_index[row / 3], self.surface_index[load / 3]) {
            (Some(i), Some(j)) => {
                body.recording.residual_between(i as usize, j as usize).col(load % 3)[row % 3]
            }
            _ => computed.as_ref().map_or(0.0, |computed| computed[(row, 0)]),
        };
        self.response(parameters, |i| shapes[(load, i)], residual, &self.residual_shares)
    }

    /// Response Φ·g(s)·gain in every sample, and a share of the residual displacement.
    fn response(
        &self,
        parameters: &TableParameters,
        gain: impl Fn(usize) -> f64,
        residual: impl Fn(usize) -> f64,
        shares: &[f64],
    ) -> Vec<f64> {
        let (rows, m) = (self.observed.nrows(), self.observed.ncols());
        let coordinates =
            Mat::from_fn(m, parameters.samples, |i, sample| self.modal_responses[sample * m + i] * gain(i));
        let mut values = vec![0.0; rows * parameters.samples];
        let target = MatMut::from_column_major_slice_mut(&mut values, rows, parameters.samples);
        multiply(target, Accum::Replace, self.observed.as_ref(), coordinates.as_ref(), 1.0);
        let residuals: Vec<f64> =
            (0..rows).map(|row| residual(dof(&parameters.observed_nodes, row))).collect();
        for (values, share) in values.chunks_exact_mut(rows.max(1)).zip(shares) {
            values.iter_mut().zip(&residuals).for_each(|(value, residual)| *value += residual * share);
        }
        values
    }
}

/// Number of evaluations of the displacement per sample.
fn evaluations_per_sample(sampling: Sampling) -> usize {
    match sampling {
        Sampling::End => 1,
        Sampling::Mean => 2,
    }
}

/// Time between two evaluations [s].
fn evaluation_interval_s(parameters: &TableParameters) -> f64 {
    parameters.step_s / evaluations_per_sample(parameters.sampling) as f64
}

/// Degree of freedom of the system for an index into the degrees of freedom of some nodes.
fn dof(nodes: &[u32], index: usize) -> usize {
    3 * nodes[index / 3] as usize + index % 3
}

/// Degrees of freedom of some nodes, numbered as in the input mesh.
fn dofs(body: &RecordedBody, nodes: &[u32]) -> Vec<u32> {
    let source = &body.system.discretisation.source_nodes;
    nodes.iter().flat_map(|&node| (0..3).map(move |axis| 3 * source[node as usize] + axis)).collect()
}
