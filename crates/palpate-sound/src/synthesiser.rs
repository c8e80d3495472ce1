//! Synthesiser: samples of the sound of a scene, step by step.

use crate::SoundParameters;
use crate::oscillator_bank::{LaneSums, OscillatorBank};
use crate::output_stage::OutputStage;
use crate::radiation::Radiator;
use crate::step_record::{BodyRecord, StepRecord};
use alloc::vec::Vec;
use palpate::{Model, OscillatorState, State};

/// Share of a sample up to which instants are taken for equal: far above the round-off of a day of samples, far below what one hears.
const SAME_INSTANT: f64 = 1e-4;

/// Synthesiser of the sound of a scene.
#[derive(Debug, Clone)]
pub struct Synthesiser {
    sample_rate_hz: f64,
    step_s: f64,
    banks: Vec<OscillatorBank>,
    was_asleep: Vec<bool>,
    output: OutputStage,
    samples: LaneSums,
    /// Last step that was taken.
    step: u64,
}

impl Synthesiser {
    /// Synthesiser of a scene, from a state on. Objects that use a table are silent.
    pub fn new(model: &Model, state: &State, parameters: &SoundParameters) -> Self {
        let mut radiators: Vec<_> =
            model.recordings().map(|recording| Radiator::new(recording, parameters)).collect();
        for (object, radiator) in radiators.iter_mut().enumerate() {
            if state.modal_state(object).is_empty() {
                radiator.truncate(0);
            }
        }
        keep_lowest(&mut radiators, parameters.max_modes);
        let interval = 1.0 / parameters.sample_rate_hz;
        let banks: Vec<_> = radiators.into_iter().map(|own| OscillatorBank::new(own, interval)).collect();
        let was_asleep = state.output().objects.iter().map(|object| object.is_asleep).collect();
        let mut synthesiser = Self {
            sample_rate_hz: parameters.sample_rate_hz,
            step_s: model.parameters().step_s,
            banks,
            was_asleep,
            output: OutputStage::new(parameters),
            samples: Vec::new(),
            step: 0,
        };
        let mut start = StepRecord::new(&synthesiser);
        start.capture(state);
        synthesiser.follow(&start);
        synthesiser
    }

    /// Audible modes of every body, in the model's order.
    pub fn radiators(&self) -> impl Iterator<Item = &Radiator> {
        self.banks.iter().map(OscillatorBank::radiator)
    }

    /// Append the samples of a step, −[`CEILING`](crate::CEILING) to [`CEILING`](crate::CEILING). Of a step whose predecessor is missing the
    /// start is not known: it gives no sample, and the next one goes on without a click.
    pub fn synthesise(&mut self, record: &StepRecord, samples: &mut Vec<f32>) {
        if record.step != self.step + 1 {
            self.output.note_gap();
            self.follow(record);
            return;
        }
        let (first, end) = (self.first_sample(self.step), self.first_sample(record.step));
        let offset_s = (first as f64 / self.sample_rate_hz - self.step as f64 * self.step_s).max(0.0);
        self.samples.clear();
        self.samples.resize((end - first) as usize, Default::default());
        for ((bank, body), was_asleep) in self.banks.iter_mut().zip(&record.bodies).zip(&mut self.was_asleep)
        {
            // What sleeps was stopped at the end of the step in which it fell asleep.
            if body.is_asleep != *was_asleep {
                self.output.note_gap();
                *was_asleep = body.is_asleep;
            }
            if !body.is_asleep {
                bank.add_step(&body.forces, offset_s, &mut self.samples);
            }
        }
        samples.extend(self.samples.iter().map(|lanes| self.output.sample(lanes.iter().sum())));
        self.follow(record);
    }

    /// Number of the first sample that is not before the end of a step.
    fn first_sample(&self, step: u64) -> u64 {
        libm::ceil(step as f64 * self.step_s * self.sample_rate_hz - SAME_INSTANT) as u64
    }

    /// Take the end of a step for the start of the next one.
    fn follow(&mut self, record: &StepRecord) {
        self.step = record.step;
        for (bank, body) in self.banks.iter_mut().zip(&record.bodies) {
            bank.states.copy_from_slice(&body.states);
        }
    }
}

impl StepRecord {
    /// Record with room for the steps that a synthesiser takes.
    pub fn new(synthesiser: &Synthesiser) -> Self {
        let bodies = synthesiser.radiators().map(|radiator| BodyRecord {
            first: radiator.first,
            states: alloc::vec![OscillatorState::default(); radiator.len()],
            forces: alloc::vec![0.0; radiator.len()],
            is_asleep: false,
        });
        Self { step: 0, bodies: bodies.collect() }
    }
}

/// Truncate the modes of all bodies to the lowest ones.
fn keep_lowest(radiators: &mut [Radiator], max_modes: usize) {
    let mut all: Vec<f64> =
        radiators.iter().flat_map(|own| own.angular_frequencies.iter().copied()).collect();
    if all.len() <= max_modes {
        return;
    }
    all.sort_unstable_by(f64::total_cmp);
    let limit = all[max_modes];
    for radiator in radiators {
        let kept = radiator.angular_frequencies.partition_point(|omega| *omega < limit);
        radiator.truncate(kept);
    }
}
