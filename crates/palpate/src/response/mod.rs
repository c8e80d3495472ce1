//! Impulse response of a body: displacement under contact forces, in modal form with residual compliance, or by direct
//! convolution of the paper's recorded table.

mod blocked_convolution;
mod body;
mod contact_location;
mod contact_points;
mod convolution;
mod fir;
mod force_history;
mod level_residual;
mod modal;
mod modal_deformation;
mod modal_distances;
mod nodal_compliance;
mod nodal_forces;
mod oscillator;
mod patch_field;
mod point_displacement;
mod residual_fields;
mod residual_kernel;
mod sample_surface;
mod sampled_residual;
mod spring_forces;
mod subtree_compliance;

pub(crate) use body::{Body, ContactLimits};
pub(crate) use contact_location::{ContactLocation, Footprint, LocationState, SpringForce};
pub(crate) use contact_points::{ContactPoint, ContactPoints};

pub(crate) use nodal_forces::NodalForces;
pub use oscillator::{OscillatorState, SampledOscillator};
pub(crate) use residual_fields::ResidualFields;
pub use sampled_residual::SampledResidual;
pub(crate) use subtree_compliance::SubtreeCompliance;

use crate::error::ModelError;
use crate::recording::{ImpulseResponse, Recording};
use crate::surface::SurfacePoint;
use alloc::boxed::Box;
use alloc::sync::Arc;
use convolution::FirState;
use fir::Fir;
use force_history::ForceHistory;
use glam::{DMat3, DVec3};
use modal::{ModalState, SampledModes};
use modal_deformation::ModalDeformation;
use nodal_compliance::NodalCompliance;

/// Form of an object's response.
#[derive(Debug, Clone, Default)]
pub enum ResponseForm {
    /// Modes and residual compliance of the recording: no time window; a step costs the modes.
    #[default]
    Modal,
    /// Direct convolution of the paper's recorded table; a step costs its samples.
    Fir(Arc<ImpulseResponse>),
}

/// Response of one object at the scene's step; immutable.
#[derive(Debug, Clone)]
pub(crate) enum Response {
    Modal(SampledModes),
    Fir(Fir),
}

/// State of a response between steps.
#[derive(Debug, Clone)]
pub(crate) enum ResponseState {
    Modal(Box<ModalState>),
    Fir(Box<FirState>),
}

/// Energies of a response [J].
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct ResponseEnergy {
    pub(crate) kinetic: f64,
    pub(crate) elastic: f64,
    pub(crate) residual: f64,
}

impl ResponseEnergy {
    fn sum(&self) -> f64 {
        self.kinetic + self.elastic + self.residual
    }
}

impl Response {
    pub(crate) fn new(
        recording: &Arc<Recording>,
        form: ResponseForm,
        step_s: f64,
    ) -> Result<Self, ModelError> {
        Ok(match form {
            ResponseForm::Modal => Self::Modal(SampledModes::new(recording, step_s)),
            ResponseForm::Fir(table) => Self::Fir(Fir::new(recording.clone(), table, step_s)?),
        })
    }

    /// Modal form: the response itself, or, of a table, the motion of the surface that contacts are searched for on.
    fn modal(&self) -> &SampledModes {
        match self {
            Self::Modal(modes) => modes,
            Self::Fir(fir) => &fir.modes,
        }
    }

    /// Recorded table, if the response is one.
    pub(crate) fn table(&self) -> Option<&ImpulseResponse> {
        match self {
            Self::Modal(_) => None,
            Self::Fir(fir) => Some(fir.table()),
        }
    }

    /// Number of modes.
    pub(crate) fn modes(&self) -> usize {
        self.modal().len()
    }

    /// Whether the sag of a body with fixed nodes is known.
    pub(crate) fn has_gravity_response(&self) -> bool {
        match self {
            Self::Modal(_) => true,
            Self::Fir(fir) => fir.has_gravity_response(),
        }
    }

    /// Whether a force may act on a surface point.
    pub(crate) fn accepts(&self, point: &SurfacePoint) -> bool {
        match self {
            Self::Modal(_) => true,
            Self::Fir(fir) => fir.accepts(point),
        }
    }

    /// Whether a surface point that a force may act on can move.
    ///
    /// # Real time
    pub(crate) fn is_movable(&self, body: &Body, point: &SurfacePoint) -> bool {
        match self {
            Self::Modal(_) => body.recording.is_movable(point),
            Self::Fir(fir) => fir.is_movable(point),
        }
    }

    /// Precompute R[0] between all surface nodes and between contact samples, up to a number of nodes.
    /// `others` are earlier objects: those of the same recording share theirs.
    pub(crate) fn precompute_nodal_compliance<'r>(
        &mut self,
        body: &Body,
        others: impl Iterator<Item = (&'r Body, &'r Self)>,
    ) {
        let Self::Modal(modes) = self else { return };
        let same = others.filter(|(other, _)| Arc::ptr_eq(&other.recording, &body.recording));
        let precomputed = |response: &Self| match response {
            Self::Modal(modes) => modes.nodal_compliance.clone(),
            Self::Fir(_) => None,
        };
        let known = same.filter_map(|(_, response)| precomputed(response)).next();
        modes.nodal_compliance = Some(known.unwrap_or_else(|| Arc::new(NodalCompliance::new(body, modes))));
    }

    /// State at rest, with a capacity of contact points.
    pub(crate) fn at_rest(&self, recording: &Recording, capacity: usize) -> ResponseState {
        match self {
            Self::Modal(_) => ResponseState::Modal(Box::new(ModalState::new(recording, capacity))),
            Self::Fir(fir) => ResponseState::Fir(Box::new(FirState::new(fir, recording, capacity))),
        }
    }
}

/// Response of an object with its state, for one step.
pub(crate) struct ResponseView<'a> {
    pub(crate) response: &'a Response,
    pub(crate) body: &'a Body,
    pub(crate) state: &'a mut ResponseState,
    /// Gravity [m/s², body].
    pub(crate) gravity: DVec3,
}

impl ResponseView<'_> {
    /// Assign a contact location to a slot. Gives its state at the start of the step.
    ///
    /// # Real time
    /// Costs modes, or for a table samples × sources of force.
    pub(crate) fn assign(&mut self, slot: usize, location: &ContactLocation) -> LocationState {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.assign(self.body, state, slot, location, self.gravity)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.assign((fir, self.body), slot, location, self.gravity)
            }
            _ => LocationState::default(),
        }
    }

    /// Move the spring forces of locations to others, where contacts take their place. Gives the energy [J] that is dissipated; with a table
    /// none, since its forces stay where they were.
    ///
    /// # Real time
    /// Costs the square of the number of spring forces.
    pub(crate) fn move_spring_forces(
        &mut self,
        from: impl Iterator<Item = ContactLocation>,
        to: impl Iterator<Item = ContactLocation> + Clone,
    ) -> f64 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                state.move_spring_forces(self.body, &modes.residual, from, to)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.surface.move_spring_forces(self.body, &fir.modes.residual, from, to);
                0.0
            }
            _ => 0.0,
        }
    }

    /// R[0] [m/N, body] between the location of a slot and every contact point: displacement at the location per force on
    /// the point. `give` takes the index of the point and the block.
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
                for (index, point) in points.iter().enumerate() {
                    give(index, fir.compliance(self.body, location, &point.location));
                }
            }
            _ => {}
        }
    }

    /// Prediction of the step without contact force. Gives whether the last step has computed it already, for its points
    /// too.
    ///
    /// # Real time
    pub(crate) fn predict(&mut self) -> bool {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.predict(&self.body.recording, state, self.gravity)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                fir.modes.predict(&self.body.recording, &mut state.surface, self.gravity);
                false
            }
            _ => false,
        }
    }

    /// Free displacement ũ of a slot's location at the end of the step without contact force [m, body].
    ///
    /// # Real time
    pub(crate) fn free(
        &mut self,
        (slot, location): (usize, &ContactLocation),
        start: &LocationState,
    ) -> DVec3 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => modes.free(state, slot, start),
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.free((fir, self.body), location, self.gravity)
            }
            _ => DVec3::ZERO,
        }
    }

    /// Advance over the step under the held forces of the contact points, with gravity at its end. Gives the energy [J] that
    /// is dissipated.
    ///
    /// # Real time
    pub(crate) fn advance(&mut self, points: &mut [ContactPoint]) -> f64 {
        match (self.response, &mut *self.state) {
            (Response::Modal(modes), ResponseState::Modal(state)) => {
                modes.advance(self.body, state, points, self.gravity)
            }
            (Response::Fir(fir), ResponseState::Fir(state)) => {
                state.advance((fir, self.body), points, self.gravity)
            }
            _ => 0.0,
        }
    }
}

impl ResponseState {
    /// Modal form: the response itself, or, of a table, the surface that contacts are searched for on.
    fn modal(&self) -> &ModalState {
        match self {
            Self::Modal(state) => state,
            Self::Fir(state) => &state.surface,
        }
    }

    /// Modal coordinates q at the start of the step.
    pub(crate) fn coordinates(&self) -> &[f64] {
        &self.modal().q
    }

    /// Start at the static equilibrium with a gravity [m/s², body]; a table starts undeformed.
    pub(crate) fn start_at_equilibrium(&mut self, body: &Body, gravity: DVec3) {
        if let Self::Modal(state) = self {
            state.start_at_equilibrium(&body.recording, gravity);
        }
    }

    /// Modal coordinates at the end of the step without contact force.
    pub(crate) fn free_coordinates(&self) -> &[f64] {
        &self.modal().free
    }

    /// Spring forces of the residual compliance with their locations.
    pub(crate) fn spring_forces(&self) -> &[SpringForce] {
        &self.modal().spring_forces
    }

    /// Indices of the spring forces on patches of tips.
    pub(crate) fn tip_springs(&self) -> &[u32] {
        &self.modal().tip_springs
    }

    /// Spring forces at points, distributed to nodes.
    pub(crate) fn nodal(&self) -> &NodalForces {
        &self.modal().nodal
    }

    /// √(dᵀ·S·d) of the forces d whose static displacement the residual one is [√J].
    pub(crate) fn residual_norm(&self) -> f64 {
        self.modal().residual_norm
    }

    /// Upper bound of the displacement of any node beyond the modes [m]: at points and contact samples, or at patches of tips.
    pub(crate) fn max_residual(&self, of_tips: bool) -> f64 {
        self.modal().residual_bounds[usize::from(of_tips)].total + self.surface_error()
    }

    /// Upper bound of the distance between a table's surface and that of its modes [m].
    pub(crate) fn surface_error(&self) -> f64 {
        match self {
            Self::Modal(_) => 0.0,
            Self::Fir(state) => state.surface_error,
        }
    }

    /// Energies [J].
    ///
    /// # Real time
    pub(crate) fn energy(&self, response: &Response) -> ResponseEnergy {
        match (response, self) {
            (Response::Modal(modes), Self::Modal(state)) => {
                let [kinetic, elastic, residual] = modes.energy(state);
                ResponseEnergy { kinetic, elastic, residual }
            }
            (Response::Fir(fir), Self::Fir(state)) => state.energy(fir),
            _ => ResponseEnergy::default(),
        }
    }

    /// Resume from modal states [m·√kg], if their number fits. Gives whether it does.
    pub(crate) fn resume_from(&mut self, modes: &[OscillatorState]) -> bool {
        match self {
            Self::Modal(own) if own.modes.len() == modes.len() => {
                own.resume_from(modes);
                true
            }
            _ => false,
        }
    }

    /// Stop the modes; a table has none.
    pub(crate) fn stop(&mut self) {
        if let Self::Modal(state) = self {
            state.stop();
        }
    }

    /// Modal states; none with a table.
    pub(crate) fn modes(&self) -> &[OscillatorState] {
        match self {
            Self::Modal(state) => &state.modes,
            Self::Fir(_) => &[],
        }
    }

    /// Modal forces that were held over the last step [N/√kg]; none with a table.
    pub(crate) fn held_modal_forces(&self) -> &[f64] {
        match self {
            Self::Modal(state) => &state.held_forces,
            Self::Fir(_) => &[],
        }
    }

    /// Copy of the data that determine the deformation.
    pub(crate) fn deformation(&self) -> DeformationData {
        match self {
            Self::Modal(state) => DeformationData::Modal(ModalDeformation::new(state)),
            Self::Fir(state) => DeformationData::Fir(Box::new(state.history.clone())),
        }
    }
}

/// Data that determine the displacement of an object's surface; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) enum DeformationData {
    Modal(ModalDeformation),
    Fir(Box<ForceHistory>),
}

impl DeformationData {
    /// Copy the present data of the same object.
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

    /// Modal coordinates q [m·√kg]; none with a table.
    pub(crate) fn coordinates(&self) -> &[f64] {
        match self {
            Self::Modal(deformed) => deformed.coordinates(),
            Self::Fir(_) => &[],
        }
    }

    /// Displacement of every surface node beyond the modes [m, body]; with a table, all of it.
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
            (Response::Fir(fir), Self::Fir(history)) => {
                for (node, u) in out.iter_mut().enumerate() {
                    *u = history.displacement(fir, (node, 0), gravity);
                }
            }
            _ => {}
        }
    }
}
