//! A body that is struck and held, with the samples of its sound.

use palpate::glam::DVec3;
use palpate::{
    AppliedForce, Coupling, DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, Recording,
    State, step,
};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use palpate_testkit::{model_and_state, object_at};
use std::sync::Arc;

/// Force that strikes for a time.
pub struct Strike {
    pub at: DVec3,
    /// Force [N].
    pub force: DVec3,
    /// Duration [s].
    pub duration_s: f64,
}

/// Hand that holds a place softly from a time [s] on.
pub struct Hold {
    pub at: DVec3,
    pub from_s: f64,
}

/// A model of one body without gravity, with the samples of a run.
pub struct Studio {
    pub model: Model,
    pub state: State,
    pub synthesiser: Synthesiser,
    pub samples: Vec<f32>,
}

impl Studio {
    pub fn new(
        body: &Arc<Recording>,
        step_s: f64,
        parameters: &SoundParameters,
        coupling: Option<Coupling>,
    ) -> Self {
        let held = DeviceParameters { coupling, ..DeviceParameters::default() };
        let devices = vec![DeviceParameters::default(), held];
        let scene = ModelParameters { step_s, devices, ..ModelParameters::for_reference() };
        let (model, state) = model_and_state(scene, vec![object_at(body, DVec3::ZERO, DVec3::ZERO)]);
        let synthesiser = Synthesiser::new(&model, &state, parameters);
        Self { model, state, synthesiser, samples: Vec::new() }
    }

    pub fn grasp(body: &Recording, at: DVec3) -> Grasp {
        let (point, _) = body.surface.nearest(at).expect("a surface");
        Grasp { object: 0, point }
    }

    /// Runs for a duration [s]; `each` sees every state.
    pub fn run(
        &mut self,
        body: &Recording,
        strike: &Strike,
        hold: Option<&Hold>,
        duration_s: f64,
        mut each: impl FnMut(&State),
    ) {
        let h = self.model.parameters().step_s;
        let mut record = StepRecord::new(&self.synthesiser);
        let (struck, held) = (Self::grasp(body, strike.at), hold.map(|hold| Self::grasp(body, hold.at)));
        for number in 1..=(duration_s / h).round() as u32 {
            let begun = f64::from(number - 1) * h;
            let mut input = Input { devices: vec![DeviceInput::inactive(); 2], ..Input::default() };
            if begun < strike.duration_s - 1e-9 {
                input.devices[0] = DeviceInput::exerting(AppliedForce { grasp: struck, force: strike.force });
            }
            if let (Some(hold), Some(grasp)) = (hold, held)
                && begun >= hold.from_s
            {
                input.devices[1] = DeviceInput::held(hold.at, grasp);
            }
            step(&self.model, &mut self.state, &input);
            record.capture(&self.state);
            self.synthesiser.synthesise(&record, &mut self.samples);
            each(&self.state);
        }
    }
}
