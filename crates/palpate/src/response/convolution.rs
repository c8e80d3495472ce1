//! State of an object whose response is a recorded table: the force history, and the surface that contacts are searched for on.
//!
//! Displacements of contact points are convolutions with the table. The surface between them moves by the modal form, which the same
//! forces advance beside it and which forgets them after T steps as the table does: the role of the deformation process in the paper. The
//! difference between both at the contact points bounds that of the surface.
//!
//! Equations: docs/theory.md (C8).

use super::blocked_convolution::BlockedConvolution;
use super::fir::Fir;
use super::force_history::ForceHistory;
use super::modal::ModalState;
use super::{Body, ContactLocation, ContactPoint, LocationState, ResponseEnergy};
use crate::recording::Recording;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Displacement of a node [m, body], with the step that it is of.
type NodeDisplacement = Option<(u64, DVec3)>;

/// State of one object; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct FirState {
    pub(super) history: ForceHistory,
    /// Tails of the displacements of nodes in contact.
    blocks: BlockedConvolution,
    /// Modal form under the same forces.
    pub(super) surface: ModalState,
    /// Upper bound of the distance of its nodes from those of the table [m].
    pub(super) surface_error: f64,
    /// Displacements of nodes at the start of the step, and at its end without contact force.
    displacements: [Vec<NodeDisplacement>; 2],
    /// Static displacements of the contact points by the residual compliance [m, body].
    held: Vec<DVec3>,
    /// Work [J] of forces on the deformation since the start.
    work: f64,
}

/// Start of a step, or its end without contact force.
#[derive(Debug, Clone, Copy)]
enum StepEnd {
    Start,
    Free,
}

impl FirState {
    pub(crate) fn new(fir: &Fir, recording: &Recording, slots: usize) -> Self {
        let nodes = recording.surface.positions.len();
        let history = ForceHistory::new(fir.samples(), fir.touchable_nodes());
        Self {
            surface: ModalState::new(recording, slots),
            surface_error: 0.0,
            blocks: BlockedConvolution::new(nodes),
            displacements: [(); 2].map(|()| vec![None; nodes]),
            held: vec![DVec3::ZERO; slots],
            work: 0.0,
            history,
        }
    }

    /// Assign a contact location to a slot. Gives its state at the start of the step [m, body].
    ///
    /// # Real time
    /// Costs the forces of the last T steps.
    pub(super) fn assign(
        &mut self,
        (fir, body): (&Fir, &Body),
        slot: usize,
        location: &ContactLocation,
        gravity: DVec3,
    ) -> LocationState {
        let of_surface = fir.modes.assign(body, &mut self.surface, slot, location, gravity);
        let displacement = self.displacement((fir, body), location, StepEnd::Start, gravity);
        LocationState { displacement, ..of_surface }
    }

    /// ũ of equation (5) for a location [m, body].
    ///
    /// # Real time
    /// Costs the forces of the last T steps.
    pub(super) fn free(
        &mut self,
        object: (&Fir, &Body),
        location: &ContactLocation,
        gravity: DVec3,
    ) -> DVec3 {
        self.displacement(object, location, StepEnd::Free, gravity)
    }

    fn displacement(
        &mut self,
        (fir, body): (&Fir, &Body),
        location: &ContactLocation,
        end: StepEnd,
        gravity: DVec3,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        body.distribute(location, |node, weight| {
            sum += self.node_displacement(fir, node, end, gravity) * weight;
        });
        sum
    }

    /// Displacement of a node [m, body], kept for the step.
    fn node_displacement(&mut self, fir: &Fir, node: usize, end: StepEnd, gravity: DVec3) -> DVec3 {
        let (step, ahead) = (self.history.steps(), end as usize);
        if let Some((known, displacement)) = self.displacements[ahead][node]
            && known == step
        {
            return displacement;
        }
        let by_forces = self.blocks.displacement((fir, &self.history), (node, ahead));
        let displacement = by_forces + fir.sag(node, gravity, step + ahead as u64);
        self.displacements[ahead][node] = Some((step, displacement));
        displacement
    }

    /// Advance over the step: its forces enter the history and move the surface, forces older than T steps leave. Gives the energy [J]
    /// that is dissipated: work that the surface does not store.
    ///
    /// # Real time
    /// Costs modes × points, and the square of the points.
    pub(super) fn advance(
        &mut self,
        (fir, body): (&Fir, &Body),
        points: &mut [ContactPoint],
        gravity: DVec3,
    ) -> f64 {
        let stored = self.energy(fir).sum();
        let Self { history, surface, held, surface_error, .. } = self;
        for (held, point) in held.iter_mut().zip(&*points) {
            let loaded = points.iter().filter(|other| other.force_in_body != DVec3::ZERO);
            let by =
                |other: &ContactPoint| body.residual(&point.location, &other.location) * other.force_in_body;
            *held = loaded.map(by).sum();
        }
        for (node, force) in history.leaving() {
            fir.modes.forget(&body.recording, surface, (node, force), &fir.last_states);
        }
        let work_of =
            |point: &ContactPoint| point.force_in_body.dot(point.displacement - point.state.displacement);
        let work: f64 = points.iter().map(work_of).sum();
        self.work += work;
        let apart = fir.modes.advance_beside(body, surface, points, gravity, held);
        let kept = 1.0 - 1.0 / fir.samples() as f64;
        // As for the residual compliance: twice the largest at the contacts, and where they have been in the last T steps.
        *surface_error = (kept * *surface_error).max(2.0 * apart);
        history.begin_step();
        for point in points.iter().filter(|point| point.force_in_body != DVec3::ZERO) {
            body.distribute(&point.location, |node, weight| {
                history.add(node, point.force_in_body * weight);
            });
        }
        self.blocks.advance((fir, &self.history));
        work - (self.energy(fir).sum() - stored)
    }

    /// Energies [J]: those of the surface in modal form. Where they are not known, because the recording has no modes or the body sags by its
    /// table, all net work counts as elastic.
    pub(super) fn energy(&self, fir: &Fir) -> ResponseEnergy {
        if fir.modes.len() == 0 || fir.has_gravity_response() {
            return ResponseEnergy { elastic: self.work, ..ResponseEnergy::default() };
        }
        let [kinetic, elastic, residual] = fir.modes.energy(&self.surface);
        ResponseEnergy { kinetic, elastic, residual }
    }
}
