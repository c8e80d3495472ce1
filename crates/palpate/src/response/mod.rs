//! How a body answers forces, in one of two forms behind one small interface: modal with residual compliance,
//! or the paper's recorded table.

mod fir;
mod modal;
mod oscillator;

pub(crate) use modal::{Acting, ModalPoints};
pub use oscillator::{HeldOscillator, Oscillation};

use crate::error::Error;
use crate::recording::{ImpulseResponse, Recording};
use crate::surface::SurfacePoint;
use alloc::sync::Arc;
use fir::{Fir, FirState};
use glam::{DMat3, DVec3};
use modal::{ModalState, SampledModes};

/// Which form of its response an object uses.
#[derive(Debug, Clone, Default)]
pub enum ResponseForm {
    /// The recording's modes and residual compliance: no window, cost by the modes.
    #[default]
    Modal,
    /// The paper's direct convolution with a recorded table: cost by its samples.
    Fir(Arc<ImpulseResponse>),
}

/// The response of one object at the scene's step; immutable.
#[derive(Debug, Clone)]
pub(crate) enum Response {
    Modal(SampledModes),
    Fir(Fir),
}

/// What the response remembers.
#[derive(Debug, Clone)]
pub(crate) enum ResponseState {
    Modal(ModalState),
    Fir(FirState),
}

/// Energies [J] that a response knows of.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ResponseEnergy {
    pub(crate) kinetic: f64,
    pub(crate) elastic: f64,
    pub(crate) residual: f64,
}

impl Response {
    pub(crate) fn new(recording: &Arc<Recording>, form: ResponseForm, step_s: f64) -> Result<Self, Error> {
        Ok(match form {
            ResponseForm::Modal => Self::Modal(SampledModes::new(&recording.modes, step_s)),
            ResponseForm::Fir(table) => Self::Fir(Fir::new(recording.clone(), table, step_s)?),
        })
    }

    /// Modes that it computes with.
    pub(crate) fn modes(&self) -> usize {
        match self {
            Self::Modal(modes) => modes.len(),
            Self::Fir(_) => 0,
        }
    }

    /// Whether it can tell how a body with fixed nodes sags.
    pub(crate) fn knows_gravity(&self) -> bool {
        match self {
            Self::Modal(_) => true,
            Self::Fir(fir) => fir.knows_gravity(),
        }
    }

    /// Whether a force may act on a surface point.
    pub(crate) fn accepts(&self, point: &SurfacePoint) -> bool {
        match self {
            Self::Modal(_) => true,
            Self::Fir(fir) => fir.accepts(point),
        }
    }

    /// The state at rest.
    pub(crate) fn at_rest(&self, devices: usize) -> ResponseState {
        match self {
            Self::Modal(modes) => ResponseState::Modal(ModalState::new(modes.len(), devices)),
            Self::Fir(fir) => ResponseState::Fir(FirState::new(fir, devices)),
        }
    }

    /// R[0] between the points of two devices that hold the object [m/N, body]: displacement of `a` per force on `b`.
    ///
    /// # Real time
    pub(crate) fn compliance(
        &self,
        recording: &Recording,
        points: &mut ModalPoints,
        a: (usize, &SurfacePoint),
        b: (usize, &SurfacePoint),
    ) -> DMat3 {
        match self {
            Self::Modal(modes) => modes.compliance(recording, points, a, b),
            Self::Fir(fir) => fir.compliance(a.1, b.1),
        }
    }
}

/// An object's response with its state, for one step.
pub(crate) struct Responding<'a> {
    pub(crate) response: &'a Response,
    pub(crate) recording: &'a Recording,
    pub(crate) state: &'a mut ResponseState,
    /// Gravity [m/s², body].
    pub(crate) gravity: DVec3,
}

impl Responding<'_> {
    /// Let a device hold a point; gives where the point is now [m, body].
    ///
    /// # Real time
    /// Costs modes, or for a table samples × sources of force; only when the grasp is new.
    pub(crate) fn hold(&mut self, points: &mut ModalPoints, device: usize, point: &SurfacePoint) -> DVec3 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.hold(self.recording, state, points, device, point, self.gravity)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => state.hold(fir, device, point, self.gravity),
            _ => DVec3::ZERO,
        }
    }

    /// Prepare the step: what happens without new force. `any_held` says whether a point is held.
    ///
    /// # Real time
    pub(crate) fn predict(&mut self, points: &mut ModalPoints, any_held: bool) {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.predict(self.recording, state, points, self.gravity, any_held);
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => state.predict(fir, self.gravity),
            _ => {}
        }
    }

    /// ũ of a device's point: where it is at the end of the step without new force [m, body].
    ///
    /// # Real time
    pub(crate) fn free(&self, points: &ModalPoints, device: usize) -> DVec3 {
        match (self.response, &*self.state) {
            (Response::Modal(modes), _) => modes.free(points, device),
            (_, ResponseState::Fir(state)) => state.free(device),
            _ => DVec3::ZERO,
        }
    }

    /// Hold forces over the step; gives the energy [J] that is known to be lost in it.
    ///
    /// # Real time
    pub(crate) fn advance<'a>(
        &mut self,
        points: &mut ModalPoints,
        acting: impl Iterator<Item = Acting<'a>> + Clone,
    ) -> f64 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => modes.advance(state, points, acting),
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.advance(fir, acting);
                0.0
            }
            _ => 0.0,
        }
    }
}

impl ResponseState {
    /// Let a device hold nothing.
    ///
    /// # Real time
    pub(crate) fn release(&mut self, device: usize) {
        if let Self::Fir(state) = self {
            state.release(device);
        }
    }

    /// Energies [J]. A table does not tell what is stored from what is lost: all the work that went in and has not
    /// come back counts as elastic.
    ///
    /// # Real time
    pub(crate) fn energy(&self, response: &Response) -> ResponseEnergy {
        match (response, self) {
            (Response::Modal(modes), Self::Modal(state)) => {
                let [kinetic, elastic, residual] = modes.energy(state);
                ResponseEnergy { kinetic, elastic, residual }
            }
            (_, Self::Fir(state)) => ResponseEnergy { elastic: state.work(), ..ResponseEnergy::default() },
            _ => ResponseEnergy::default(),
        }
    }

    /// Modal coordinates; none where a table is used.
    pub(crate) fn modes(&self) -> &[Oscillation] {
        match self {
            Self::Modal(state) => &state.modes,
            Self::Fir(_) => &[],
        }
    }

    /// Displacement of every surface node [m, body].
    pub(crate) fn surface_displacement(
        &self,
        response: &Response,
        recording: &Recording,
        gravity: DVec3,
        out: &mut [DVec3],
    ) {
        match (response, self) {
            (Response::Modal(modes), Self::Modal(state)) => {
                modes.surface_displacement(recording, state, gravity, out);
            }
            (Response::Fir(fir), Self::Fir(state)) => state.surface_displacement(fir, gravity, out),
            _ => {}
        }
    }
}
