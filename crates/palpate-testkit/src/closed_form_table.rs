//! Tables of impulse responses from the modes and the residual compliance of a recording, in memory. A column is computed when it is first
//! used.

use glam::DVec3;
use palpate::{
    Column, ImpulseColumns, ImpulseResponse, OscillatorState, Recording, SampledOscillator, Sampling,
    arrange_column,
};
use std::fmt;
use std::sync::{Arc, OnceLock};

/// R[s] = Φ·g(s)·Φᵀ + ((1 − e)·eˢ + c·(δ₀ − δ₁))·S of a recording's own modes, e = exp(−h/τ), c = ½·(1 + e)/(1 − e) − τ/h.
pub fn closed_form_table(recording: &Arc<Recording>, samples: usize, step_s: f64) -> ImpulseResponse {
    let dofs = 3 * recording.surface.positions.len();
    let columns = ClosedForm {
        responses: modal_responses(recording, samples, step_s),
        shares: residual_shares(recording.residual_relaxation_s() / step_s, samples),
        columns: (0..dofs).map(|_| OnceLock::new()).collect(),
        recording: recording.clone(),
    };
    let gravity = recording.gravity.as_ref().map(|gravity| {
        let m = recording.modes.len();
        let along = |axis: usize| {
            let unit = DVec3::from_array(std::array::from_fn(|a| f64::from(u8::from(a == axis))));
            let forces = &gravity.modal_forces[axis * m..(axis + 1) * m];
            let sag = |dof: usize| gravity.residual_displacement(dof / 3, unit)[dof % 3];
            let at = |sample: usize, dof: usize| {
                columns.modal(sample, dof, forces) + if sample == 0 { sag(dof) } else { 0.0 }
            };
            (0..samples)
                .flat_map(|sample| (0..dofs).map(move |dof| (sample, dof)))
                .map(|(s, i)| at(s, i))
                .collect()
        };
        (0..3).flat_map(|axis| -> Vec<f64> { along(axis) }).collect()
    });
    let dof_numbers: Vec<u32> =
        recording.surface.source_nodes.iter().flat_map(|&n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    ImpulseResponse {
        step_s,
        samples,
        sampling: Sampling::End,
        touchable_dofs: dof_numbers.clone(),
        observed_dofs: dof_numbers,
        gravity,
        columns: Box::new(columns),
    }
}

/// A table in single precision.
pub fn in_single_precision(table: ImpulseResponse) -> ImpulseResponse {
    let columns = table.touchable_dofs.iter().map(|_| OnceLock::new()).collect();
    ImpulseResponse { columns: Box::new(SinglePrecision { exact: table.columns, columns }), ..table }
}

/// Responses of all modes at each sample to a unit modal force that is held for the first step [s²].
fn modal_responses(recording: &Recording, samples: usize, step_s: f64) -> Vec<Vec<f64>> {
    let pairs = recording.modes.angular_frequencies.iter().zip(&recording.modes.damping_ratios);
    let mut oscillators: Vec<(SampledOscillator, OscillatorState)> = pairs
        .map(|(&omega, &zeta)| (SampledOscillator::new(omega, zeta, step_s), OscillatorState::default()))
        .collect();
    let sample = |s: usize| {
        let advance = |(oscillator, state): &mut (SampledOscillator, OscillatorState)| {
            *state = oscillator.advance(*state, if s == 0 { 1.0 } else { 0.0 });
            state.q
        };
        oscillators.iter_mut().map(advance).collect()
    };
    (0..samples).map(sample).collect()
}

/// Share of the residual compliance in each sample [1], by its relaxation time in steps.
fn residual_shares(relaxation: f64, samples: usize) -> Vec<f64> {
    let decay = (-1.0 / relaxation).exp();
    let lead = 0.5 * (1.0 + decay) / (1.0 - decay) - relaxation;
    let share = |s: usize| {
        let last = match s {
            0 => lead,
            1 => -lead,
            _ => 0.0,
        };
        (1.0 - decay) * decay.powi(s as i32) + last
    };
    (0..samples).map(share).collect()
}

/// Columns of the closed form.
struct ClosedForm {
    recording: Arc<Recording>,
    responses: Vec<Vec<f64>>,
    shares: Vec<f64>,
    columns: Vec<OnceLock<Box<[f64]>>>,
}

impl ClosedForm {
    fn row(&self, dof: usize) -> &[f64] {
        self.recording.modes.row(dof / 3, dof % 3)
    }

    /// Displacement of a degree of freedom in a sample, by the modes under modal forces [m].
    fn modal(&self, sample: usize, dof: usize, forces: &[f64]) -> f64 {
        let terms = self.row(dof).iter().zip(&self.responses[sample]).zip(forces);
        terms.map(|((phi, response), force)| phi * response * force).sum()
    }
}

impl ImpulseColumns for ClosedForm {
    fn column_length(&self) -> usize {
        self.shares.len() * self.columns.len()
    }

    fn prepare(&self, _touchable: usize) -> Result<(), String> {
        Ok(())
    }

    fn missing_bytes(&self) -> u64 {
        0
    }

    fn column(&self, j: usize) -> Column<'_> {
        Column::F64(self.columns[j].get_or_init(|| {
            let beyond = |i: usize| self.recording.residual_between(i / 3, j / 3).col(j % 3)[i % 3];
            let beyond: Vec<f64> = (0..self.columns.len()).map(beyond).collect();
            let sample = |(s, share): (usize, &f64)| -> Vec<f64> {
                let at = |(i, beyond): (usize, &f64)| self.modal(s, i, self.row(j)) + beyond * share;
                beyond.iter().enumerate().map(at).collect()
            };
            let numbers: Vec<f64> = self.shares.iter().enumerate().flat_map(sample).collect();
            arrange_column(&numbers, self.shares.len())
        }))
    }
}

impl fmt::Debug for ClosedForm {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "ClosedForm({} columns)", self.columns.len())
    }
}

/// Columns of another table, rounded.
#[derive(Debug)]
struct SinglePrecision {
    exact: Box<dyn ImpulseColumns>,
    columns: Vec<OnceLock<Box<[f32]>>>,
}

impl ImpulseColumns for SinglePrecision {
    fn column_length(&self) -> usize {
        self.exact.column_length()
    }

    fn prepare(&self, touchable: usize) -> Result<(), String> {
        self.exact.prepare(touchable)
    }

    fn missing_bytes(&self) -> u64 {
        self.exact.missing_bytes()
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        Column::F32(self.columns[touchable].get_or_init(|| match self.exact.column(touchable) {
            Column::F32(numbers) => numbers.into(),
            Column::F64(numbers) => numbers.iter().map(|&number| number as f32).collect(),
        }))
    }
}
