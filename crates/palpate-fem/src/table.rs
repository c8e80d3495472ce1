//! The paper's table R[s], column by column (section 3.1 of the paper), in two independent ways.
//!
//! *Closed form*, from the recording's modes and residual compliance: R[s] = Φ·g(s)·Φᵀ, and S added to R[0],
//! with g(s) the exact answer of each mode to a force held for one step. *Transient*, by time integration of
//! the whole finite element system (see `transient`). Columns are independent of each other.

use crate::factor::FactorError;
use crate::record::Recorded;
use crate::residual::missed;
use crate::transient::{Motion, Transient};
use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatMut, Par};
use palpate::{Damping, OscillatorState, ResidualCompliance, SampledOscillator, Sampling};
use rayon::prelude::*;

/// What is put into a table.
#[derive(Debug, Clone, PartialEq)]
pub struct TableParameters {
    /// Step h [s] of the table.
    pub step_s: f64,
    /// Samples T.
    pub samples: usize,
    /// What a sample is.
    pub sampling: Sampling,
    /// How it is computed.
    pub method: Method,
    /// Nodes of the discretisation where force may enter, ascending.
    pub touchable_nodes: Vec<u32>,
    /// Nodes of the discretisation whose displacement is recorded, ascending.
    pub observed_nodes: Vec<u32>,
}

/// How a table is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// From the modes and the residual compliance of the recording: what `response = "modal"` computes.
    ClosedForm,
    /// By time integration of the whole system, with this many integration steps per sample.
    Transient {
        /// At least 1; with [`Sampling::Mean`] per half sample.
        substeps: u32,
    },
}

/// Why no table can be made.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// A parameter.
    #[error("{0}")]
    Parameter(String),
    /// The integrator's factor.
    #[error(transparent)]
    Factor(#[from] FactorError),
}

/// Columns that are best integrated together on one core: wide enough for the solves to run at full speed.
pub const BLOCK: usize = 48;

/// Makes the columns of a table.
pub struct TableRecorder<'a> {
    recorded: &'a Recorded,
    parameters: &'a TableParameters,
    way: Way<'a>,
}

enum Way<'a> {
    ClosedForm(ClosedForm),
    Transient { integrator: Transient<'a>, substeps: u32 },
}

struct ClosedForm {
    /// Answer g(s) [s²] of each mode to a unit modal force held for one step: s·m + mode.
    answers: Vec<f64>,
    /// Φ at the observed degrees of freedom, a row each.
    observed: Mat<f64>,
    /// For each node of the discretisation, its place on the recording's surface.
    on_surface: Vec<Option<u32>>,
    /// Whether nodes inside the body are observed.
    sees_inside: bool,
}

impl<'a> TableRecorder<'a> {
    /// Prepare a table of a recorded body.
    ///
    /// # Errors
    /// Says which parameter is out of range; and when the integrator's factor fails.
    pub fn new(recorded: &'a Recorded, parameters: &'a TableParameters) -> Result<Self, TableError> {
        let fail = |what: String| Err(TableError::Parameter(what));
        let h = parameters.step_s;
        if !(h > 0.0 && h <= 1.0) {
            return fail(format!("the table's step is {h} s, expected above 0 and at most 1"));
        }
        if parameters.samples == 0 {
            return fail("the table has 0 samples: the duration is shorter than a step".into());
        }
        let damping = recorded.recording.metadata.damping;
        let way = match (parameters.method, damping) {
            (Method::ClosedForm, _) => Way::ClosedForm(ClosedForm::new(recorded, parameters, damping)),
            (Method::Transient { substeps: 0 }, _) => {
                return fail("the integrator needs at least 1 step per sample".into());
            }
            (Method::Transient { .. }, Damping::Ratio(zeta)) if zeta > 0.0 => {
                return fail(
                    "the same damping ratio for every mode is no damping matrix that can be integrated: use Rayleigh \
                     damping (--rayleigh), or the closed form"
                        .into(),
                );
            }
            (Method::Transient { substeps }, damping) => {
                let (alpha, beta) = match damping {
                    Damping::Rayleigh { alpha, beta } => (alpha, beta),
                    Damping::Ratio(_) => (0.0, 0.0),
                };
                let step = between_looks(parameters) / f64::from(substeps);
                let integrator = Transient::new(&recorded.system, alpha, beta, step)?;
                Way::Transient { integrator, substeps }
            }
        };
        Ok(Self { recorded, parameters, way })
    }

    /// Touchable degrees of freedom, 3·node + axis, nodes as in the input mesh.
    pub fn touchable_dofs(&self) -> Vec<u32> {
        dofs(self.recorded, &self.parameters.touchable_nodes)
    }

    /// Observed degrees of freedom, numbered alike.
    pub fn observed_dofs(&self) -> Vec<u32> {
        dofs(self.recorded, &self.parameters.observed_nodes)
    }

    /// Numbers in one column: T × observed degrees of freedom.
    pub fn column_length(&self) -> usize {
        self.parameters.samples * 3 * self.parameters.observed_nodes.len()
    }

    /// Time [s] between two integration steps, of a table by time integration.
    pub fn integration_step_s(&self) -> Option<f64> {
        match &self.way {
            Way::ClosedForm(_) => None,
            Way::Transient { substeps, .. } => Some(between_looks(self.parameters) / f64::from(*substeps)),
        }
    }

    /// Working memory [bytes] for columns in blocks of some width, beside the columns themselves.
    pub fn working_bytes(&self, columns: usize, block: usize) -> usize {
        let dofs = self.recorded.system.discretisation.dofs();
        match &self.way {
            Way::ClosedForm(_) => {
                8 * rayon::current_num_threads()
                    * (self.parameters.samples * self.recorded.modes.squares.len() + dofs)
            }
            Way::Transient { .. } => {
                8 * 12 * dofs * block * columns.div_ceil(block).min(rayon::current_num_threads())
            }
        }
    }

    /// A range of touchable degrees of freedom: for each its column [m/N], sample after sample. All cores are used, a
    /// `block` of columns on each; the last bits of integrated columns depend on its width, and on nothing else.
    /// `done` is called as columns are finished.
    pub fn columns(
        &self,
        range: std::ops::Range<usize>,
        block: usize,
        done: &(dyn Fn(usize) + Sync),
    ) -> Vec<Vec<f64>> {
        match &self.way {
            Way::ClosedForm(form) => range
                .into_par_iter()
                .map(|touchable| {
                    let column = form.column(self.recorded, self.parameters, touchable);
                    done(1);
                    column
                })
                .collect(),
            Way::Transient { integrator, substeps } => {
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

    /// Response to a uniform acceleration held for one step along each axis [s²], for a body with fixed nodes;
    /// (axis·T + sample)·observed + dof.
    pub fn gravity(&self) -> Option<Vec<f64>> {
        let system = &self.recorded.system;
        (!system.fixed_nodes.is_empty()).then(|| self.responses(system.uniform_weight()).concat())
    }

    /// Response to loads [N] on all degrees of freedom, each held for one step: for each column of loads T × observed
    /// displacements [m], sample after sample.
    pub fn responses(&self, mut loads: Mat<f64>) -> Vec<Vec<f64>> {
        let (system, modes) = (&self.recorded.system, &self.recorded.modes);
        match &self.way {
            Way::ClosedForm(form) => {
                let gains = modes.shapes.transpose() * &loads;
                let residual = missed(system, modes, loads, &gains);
                (0..gains.ncols())
                    .map(|j| form.response(self.parameters, |i| gains[(i, j)], |dof| residual[(dof, j)]))
                    .collect()
            }
            Way::Transient { integrator, substeps } => {
                system.balance(&mut loads);
                self.integrate_loads(integrator, *substeps, loads)
            }
        }
    }

    /// Columns of a part, filled up with zeros to the width of the block.
    fn integrate(
        &self,
        integrator: &Transient<'_>,
        substeps: u32,
        part: std::ops::Range<usize>,
        block: usize,
    ) -> Vec<Vec<f64>> {
        let system = &self.recorded.system;
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
        // With the mean, two halves of a step are looked at; the force is held through both.
        let looks = looks(*sampling);
        let mut motion: Option<Motion> = None;
        for look in 0..samples * looks {
            for _ in 0..substeps {
                match &mut motion {
                    None => motion = Some(integrator.push(&loads)),
                    Some(motion) if look < looks => integrator.push_on(motion, &loads),
                    Some(motion) => integrator.advance(motion),
                }
            }
            let Some(motion) = &motion else { continue };
            let mut displacement = motion.displacement();
            self.recorded.system.remove_rigid(&mut displacement);
            for (j, column) in columns.iter_mut().enumerate() {
                let sample = &mut column[look / looks * width..][..width];
                for (at, value) in sample.iter_mut().enumerate() {
                    *value += displacement[(dof(observed_nodes, at), j)] / looks as f64;
                }
            }
        }
        columns
    }
}

impl ClosedForm {
    fn new(recorded: &Recorded, parameters: &TableParameters, damping: Damping) -> Self {
        let modes = &recorded.modes;
        let m = modes.squares.len();
        let mut answers = vec![0.0; parameters.samples * m];
        let looks = looks(parameters.sampling);
        for (i, square) in modes.squares.iter().enumerate() {
            let omega = square.sqrt();
            let oscillator = SampledOscillator::new(omega, damping.ratio(omega), between_looks(parameters));
            let mut state = OscillatorState::default();
            for look in 0..parameters.samples * looks {
                state = oscillator.advance(state, if look < looks { 1.0 } else { 0.0 });
                answers[look / looks * m + i] += state.q / looks as f64;
            }
        }
        let rows = 3 * parameters.observed_nodes.len();
        let observed =
            Mat::from_fn(rows, m, |row, i| modes.shapes[(dof(&parameters.observed_nodes, row), i)]);
        let mut on_surface = vec![None; recorded.system.discretisation.nodes.len()];
        for (at, &node) in recorded.system.discretisation.surface_nodes().iter().enumerate() {
            on_surface[node as usize] = Some(at as u32);
        }
        let inside = |node: &u32| on_surface[*node as usize].is_none();
        let sees_inside = parameters.observed_nodes.iter().any(inside);
        Self { answers, observed, on_surface, sees_inside }
    }

    /// One column: the modes' part, and the residual compliance in the first sample.
    fn column(&self, recorded: &Recorded, parameters: &TableParameters, touchable: usize) -> Vec<f64> {
        let load = dof(&parameters.touchable_nodes, touchable);
        let shapes = &recorded.modes.shapes;
        // Between surface nodes the recording's own numbers, rounded and tapered as they are, so that both forms of the
        // response are one; elsewhere S = G − Φ·Λ⁻¹·Φᵀ afresh.
        let inside = self.sees_inside || self.on_surface[load / 3].is_none();
        let fresh = (inside && !matches!(recorded.recording.residual, ResidualCompliance::None)).then(|| {
            let mut unit = Mat::zeros(recorded.system.discretisation.dofs(), 1);
            unit[(load, 0)] = 1.0;
            let gains = shapes.subrows(load, 1).transpose().to_owned();
            missed(&recorded.system, &recorded.modes, unit, &gains)
        });
        let residual = |row: usize| match (self.on_surface[row / 3], self.on_surface[load / 3]) {
            (Some(i), Some(j)) => {
                recorded.recording.residual.block(i as usize, j as usize).col(load % 3)[row % 3]
            }
            _ => fresh.as_ref().map_or(0.0, |fresh| fresh[(row, 0)]),
        };
        self.response(parameters, |i| shapes[(load, i)], residual)
    }

    /// Φ·g(s)·gain for every sample, and the residual in the first.
    fn response(
        &self,
        parameters: &TableParameters,
        gain: impl Fn(usize) -> f64,
        residual: impl Fn(usize) -> f64,
    ) -> Vec<f64> {
        let (rows, m) = (self.observed.nrows(), self.observed.ncols());
        let coordinates =
            Mat::from_fn(m, parameters.samples, |i, sample| self.answers[sample * m + i] * gain(i));
        let mut values = vec![0.0; rows * parameters.samples];
        let target = MatMut::from_column_major_slice_mut(&mut values, rows, parameters.samples);
        matmul(target, Accum::Replace, self.observed.as_ref(), coordinates.as_ref(), 1.0, Par::Seq);
        for (row, value) in values[..rows].iter_mut().enumerate() {
            *value += residual(dof(&parameters.observed_nodes, row));
        }
        values
    }
}

/// How often the motion is looked at for a sample.
fn looks(sampling: Sampling) -> usize {
    match sampling {
        Sampling::End => 1,
        Sampling::Mean => 2,
    }
}

/// Time [s] between two looks.
fn between_looks(parameters: &TableParameters) -> f64 {
    parameters.step_s / looks(parameters.sampling) as f64
}

/// Row of the system for a place among the degrees of freedom of some nodes.
fn dof(nodes: &[u32], place: usize) -> usize {
    3 * nodes[place / 3] as usize + place % 3
}

fn dofs(recorded: &Recorded, nodes: &[u32]) -> Vec<u32> {
    let source = &recorded.system.discretisation.source_nodes;
    nodes.iter().flat_map(|&node| (0..3).map(move |axis| 3 * source[node as usize] + axis)).collect()
}
