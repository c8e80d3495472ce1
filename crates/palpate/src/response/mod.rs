//! How a body answers forces, in one of two forms behind one small interface: modal with residual compliance,
//! or the paper's recorded table.

mod body;
mod contact_points;
mod dot_products;
mod fir;
mod force_history;
mod modal;
mod nodal_compliance;
mod nodal_forces;
mod oscillator;
mod patch_field;
mod residual_fields;

pub(crate) use body::{AppliedForce, Body, ContactLocation, Footprint, LocationState};
pub(crate) use contact_points::{ContactPoint, ContactPoints};
pub(crate) use dot_products::dot;
pub(crate) use nodal_forces::NodalForces;
pub use oscillator::{OscillatorState, SampledOscillator};
pub(crate) use residual_fields::ResidualFields;

use crate::error::Error;
use crate::recording::{ImpulseResponse, Recording};
use crate::surface::SurfacePoint;
use alloc::boxed::Box;
use alloc::sync::Arc;
use fir::{Fir, FirState};
use force_history::ForceHistory;
use glam::{DMat3, DVec3};
use modal::{ModalDeformation, ModalState, SampledModes};
use nodal_compliance::NodeCompliance;

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

    /// Know R[0] between all surface nodes, or the places that stand for them, before the first step, where there are not too
    /// many; `others` are objects that may know it already.
    pub(crate) fn precompute_nodal_compliance<'r>(
        &mut self,
        body: &Body,
        others: impl Iterator<Item = (&'r Body, &'r Self)>,
    ) {
        let Self::Modal(modes) = self else { return };
        let same = others.filter(|(other, _)| Arc::ptr_eq(&other.recording, &body.recording));
        let known = |response: &Self| match response {
            Self::Modal(modes) => Some(modes.known.clone()),
            Self::Fir(_) => None,
        };
        let same = same.filter_map(|(_, response)| known(response)).next();
        let levels = (0..=body.coarsest_level()).map(|level| body.footprint_at_level(level));
        let find = |footprint| NodeCompliance::new(body, modes, footprint).map(Arc::new);
        let all = same.unwrap_or_else(|| levels.filter_map(find).collect());
        modes.known = all;
    }

    /// The state at rest of a body with so many surface nodes, with room for so many contact points.
    pub(crate) fn at_rest(&self, nodes: usize, capacity: usize) -> ResponseState {
        match self {
            Self::Modal(modes) => ResponseState::Modal(ModalState::new(modes.len(), nodes, capacity)),
            Self::Fir(fir) => ResponseState::Fir(FirState::new(fir, capacity)),
        }
    }
}

/// An object's response with its state, for one step.
pub(crate) struct ResponseView<'a> {
    pub(crate) response: &'a Response,
    pub(crate) body: &'a Body,
    pub(crate) state: &'a mut ResponseState,
    /// Gravity [m/s², body].
    pub(crate) gravity: DVec3,
}

impl ResponseView<'_> {
    /// Let a slot stand for a place; gives where the place is now.
    ///
    /// # Real time
    /// Costs modes, or for a table samples × sources of force; only when the place is new.
    pub(crate) fn assign(&mut self, slot: usize, location: &ContactLocation) -> LocationState {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.assign(self.body, state, slot, location, self.gravity)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.release(slot);
                let displacement = state.hold(fir, slot, &location.point, self.gravity);
                LocationState { displacement, ..LocationState::default() }
            }
            _ => LocationState::default(),
        }
    }

    /// R[0] [m/N, body] between the place of a slot and every contact point: displacement there per force on the point.
    /// Given with where the point stands.
    ///
    /// # Real time
    pub(crate) fn compliance(
        &mut self,
        (slot, location): (usize, &ContactLocation),
        points: &[ContactPoint],
        mut give: impl FnMut(usize, DMat3),
    ) {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.compliance(self.body, state, (slot, location), points, give);
            }
            (Response::Fir(fir), _) => {
                for (at, point) in points.iter().enumerate() {
                    give(at, fir.compliance(&location.point, &point.location.point));
                }
            }
            _ => {}
        }
    }

    /// Prepare the step: what happens without contact force. Says whether the last step has done so, for its points too.
    ///
    /// # Real time
    pub(crate) fn predict(&mut self) -> bool {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.predict(&self.body.recording, state, self.gravity)
            }
            _ => false,
        }
    }

    /// ũ of a slot's place: where it is at the end of the step without contact force [m, body].
    ///
    /// # Real time
    pub(crate) fn free(&mut self, slot: usize, state_at: &LocationState) -> DVec3 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => modes.free(state, slot) + state_at.sag,
            (Response::Fir(fir), ResponseState::Fir(state)) => state.free(fir, slot, self.gravity),
            _ => DVec3::ZERO,
        }
    }

    /// Hold forces over the step, with gravity at its end; gives the energy [J] that is known to be lost in it.
    ///
    /// # Real time
    pub(crate) fn advance(&mut self, applied_forces: &mut [ContactPoint]) -> f64 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.advance(self.body, state, applied_forces, self.gravity)
            }
            (Response::Fir(_), ResponseState::Fir(state)) => {
                state.advance(applied_forces);
                0.0
            }
            _ => 0.0,
        }
    }
}

impl ResponseState {
    /// Let a slot stand for nothing.
    ///
    /// # Real time
    pub(crate) fn release(&mut self, slot: usize) {
        if let Self::Fir(state) = self {
            state.release(slot);
        }
    }

    /// q of the modes at the start of the step; none where a table is used.
    pub(crate) fn coordinates(&self) -> &[f64] {
        match self {
            Self::Modal(state) => &state.q,
            Self::Fir(_) => &[],
        }
    }

    /// q at the end of the step without contact force.
    pub(crate) fn free_coordinates(&self) -> &[f64] {
        match self {
            Self::Modal(state) => &state.free,
            Self::Fir(_) => &[],
        }
    }

    /// Forces [N, body] of the last step with their places.
    pub(crate) fn applied_forces(&self) -> &[AppliedForce] {
        match self {
            Self::Modal(state) => &state.applied_forces,
            Self::Fir(_) => &[],
        }
    }

    /// Those of them that act at points, as forces on nodes; none where a table is used.
    pub(crate) fn nodal(&self) -> Option<&NodalForces> {
        match self {
            Self::Modal(state) => Some(&state.nodal),
            Self::Fir(_) => None,
        }
    }

    /// Energy [J] of the residual compliance.
    pub(crate) fn residual_energy(&self) -> f64 {
        match self {
            Self::Modal(state) => state.residual_energy,
            Self::Fir(_) => 0.0,
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

    /// Whether it has as many modes, and if so let them move so.
    pub(crate) fn resume_from(&mut self, modes: &[OscillatorState]) -> bool {
        match self {
            Self::Modal(own) if own.modes.len() == modes.len() => {
                own.resume_from(modes);
                true
            }
            _ => false,
        }
    }

    /// Modal coordinates; none where a table is used.
    pub(crate) fn modes(&self) -> &[OscillatorState] {
        match self {
            Self::Modal(state) => &state.modes,
            Self::Fir(_) => &[],
        }
    }

    /// Copy of all data that the deformation follows from.
    pub(crate) fn deformation(&self) -> DeformationData {
        match self {
            Self::Modal(state) => DeformationData::Modal(ModalDeformation::new(state)),
            Self::Fir(state) => DeformationData::Fir(Box::new(state.history.clone())),
        }
    }
}

/// What deforms an object: all that its surface takes; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) enum DeformationData {
    Modal(ModalDeformation),
    Fir(Box<ForceHistory>),
}

impl DeformationData {
    /// Take over what deforms the same object now.
    ///
    /// # Real time
    /// Costs modes and contacts; for a table the forces of the last T steps.
    pub(crate) fn copy_from(&mut self, state: &ResponseState) {
        match (self, state) {
            (Self::Modal(own), ResponseState::Modal(state)) => own.copy_from(state),
            (Self::Fir(own), ResponseState::Fir(state)) => own.copy_from(&state.history),
            _ => {}
        }
    }

    /// q [m·√kg] of the modes; none where a table is used.
    pub(crate) fn coordinates(&self) -> &[f64] {
        match self {
            Self::Modal(deformed) => deformed.coordinates(),
            Self::Fir(_) => &[],
        }
    }

    /// The part of the surface's displacement that is not the modes' [m, body].
    pub(crate) fn residual_displacements(
        &self,
        (response, body): (&Response, &Body),
        gravity: DVec3,
        residual_fields: &mut ResidualFields,
        out: &mut [DVec3],
    ) {
        match (response, self) {
            (Response::Modal(modes), Self::Modal(deformed)) => {
                modes.residual_displacements(body, deformed, gravity, residual_fields, out)
            }
            _ => self.surface_displacement((response, body), gravity, residual_fields, out),
        }
    }

    /// Displacement of every surface node [m, body].
    pub(crate) fn surface_displacement(
        &self,
        (response, body): (&Response, &Body),
        gravity: DVec3,
        residual_fields: &mut ResidualFields,
        out: &mut [DVec3],
    ) {
        match (response, self) {
            (Response::Modal(modes), Self::Modal(deformed)) => {
                modes.surface_displacement(body, deformed, gravity, residual_fields, out);
            }
            (Response::Fir(fir), Self::Fir(history)) => history.surface_displacement(fir, gravity, out),
            _ => {}
        }
    }
}
