//! Modal form of a body's response: u = Φ·q + S·d.
//!
//! Each modal coordinate q [m·√kg] is an oscillator under a held force (`oscillator`). The residual compliance S [m/N] is the
//! static compliance of the modes that are not kept (`sampled_residual`), d the forces whose static displacement it has.
//!
//! Equations: docs/theory.md (C3), (C7), (C55) to (C57), (C92).

use super::ContactPoint;
use super::modal_deformation::ModalDeformation;
use super::nodal_compliance::NodalCompliance;
use super::nodal_forces::NodalForces;
use super::oscillator::{OscillatorState, SampledOscillator};
use super::residual_fields::ResidualFields;
use super::sampled_residual::{Products, SampledResidual};
use super::spring_forces::RELAXING;
use super::{Body, ContactLocation, LocationState, SpringForce};
use crate::bounded_vec::BoundedVec;
use crate::dot_products::{dot, dot3, dot9, dots};
use crate::recording::Recording;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// States below this size [√J] are set to zero: denormal numbers cost 40 times as much.
const FLUSH_BELOW: f64 = 1e-150;

/// Modes of one object at the scene's step.
#[derive(Debug, Clone)]
pub(crate) struct SampledModes {
    step_s: f64,
    pub(super) residual: SampledResidual,
    oscillators: Vec<SampledOscillator>,
    /// Precomputed R[0] between nodes and contact samples.
    pub(super) nodal_compliance: Option<Arc<NodalCompliance>>,
}

/// State of one object in modal form.
#[derive(Debug, Clone)]
pub(crate) struct ModalState {
    pub(crate) modes: Vec<OscillatorState>,
    /// Modal coordinates at the start of the step, and at its end without contact force.
    pub(super) q: Vec<f64>,
    pub(super) free: Vec<f64>,
    /// Gravity [m/s², body] and step [s] of the latter; none before the prediction.
    predicted: Option<(DVec3, f64)>,
    /// Modal forces of the step [N/√kg], and those that were held over the last one.
    forces: Vec<f64>,
    pub(super) held_forces: Vec<f64>,
    /// Three rows J·Φ per contact point, by its slot.
    rows: Vec<f64>,
    /// Three rows J·Φ·B.
    weighted: Vec<f64>,
    /// Forces of the residual compliance with their locations.
    pub(super) spring_forces: BoundedVec<SpringForce>,
    /// Indices of those on patches of tips, which displace nothing else.
    pub(super) tip_springs: BoundedVec<u32>,
    /// Spring forces at points, distributed to nodes.
    pub(super) nodal: NodalForces,
    /// Products of the parts of the residual compliance's state, over all locations.
    pub(super) products: Products,
    /// Elastic energy of the residual compliance [J], and √(dᵀ·S·d) of the forces d whose static displacement it has [√J].
    pub(super) residual_energy: f64,
    pub(super) residual_norm: f64,
    /// Upper bounds of the residual displacement of any node: at points and contact samples, and at patches of tips, which they do not couple to.
    pub(super) residual_bounds: [ResidualBound; 2],
}

/// Largest residual displacement of any node over that at contacts and in their patches [1]: forces of several patches add up, and the ratio
/// within a patch depends on their directions. Of some 12,000 states of `palpate bench` two are above.
pub(super) const BEYOND_CONTACTS: f64 = 1.25;

/// Upper bounds of the displacements of any node by relaxed forces, by the held ones of the last step, and in all [m].
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct ResidualBound {
    relaxed: f64,
    held: f64,
    pub(super) total: f64,
}

impl ResidualBound {
    /// Advance over a step with the largest residual displacements of contact points and of the nodes in their patches, and those by held
    /// forces [m]. They are largest at the contacts, and where they have been.
    fn advance(&mut self, (largest, largest_held): (f64, f64), has_left: bool, residual: &SampledResidual) {
        let (decay, lead) = (residual.decay(), residual.lead());
        let [largest, largest_held] =
            [largest, largest_held].map(|of_contacts| BEYOND_CONTACTS * of_contacts);
        let left = if has_left { decay * self.relaxed + lead * self.held } else { 0.0 };
        self.total = largest + left;
        self.relaxed = decay * self.relaxed + (1.0 - decay) * largest_held;
        self.held = largest_held;
    }
}

impl ModalState {
    /// State at rest, with a capacity of contact points.
    pub(crate) fn new(recording: &Recording, capacity: usize) -> Self {
        let modes = recording.modes.len();
        Self {
            modes: vec![OscillatorState::default(); modes],
            q: vec![0.0; modes],
            free: vec![0.0; modes],
            predicted: None,
            forces: vec![0.0; modes],
            held_forces: vec![0.0; modes],
            rows: vec![0.0; 3 * modes * capacity],
            weighted: vec![0.0; 3 * modes],
            spring_forces: BoundedVec::new(capacity + RELAXING),
            tip_springs: BoundedVec::new(capacity + RELAXING),
            nodal: NodalForces::new(recording.model_nodes(), recording.surface.positions.len()),
            products: Products::default(),
            residual_energy: 0.0,
            residual_norm: 0.0,
            residual_bounds: [ResidualBound::default(); 2],
        }
    }

    /// Set the modal states.
    pub(super) fn resume_from(&mut self, modes: &[OscillatorState]) {
        self.modes.copy_from_slice(modes);
        self.q.iter_mut().zip(modes).for_each(|(q, mode)| *q = mode.q);
    }

    /// Set the rates of all modes to zero.
    pub(super) fn stop(&mut self) {
        self.modes.iter_mut().for_each(|mode| mode.v = 0.0);
        self.predicted = None;
    }

    /// Set the modal states to the static equilibrium with a gravity, q = p/ω² [m/s², body].
    pub(super) fn start_at_equilibrium(&mut self, recording: &Recording, gravity: DVec3) {
        recording.add_gravity_load(gravity, &mut self.forces);
        let loads = self.forces.iter().zip(&recording.modes.angular_frequencies);
        for ((mode, q), (p, omega)) in self.modes.iter_mut().zip(&mut self.q).zip(loads) {
            *q = p / (omega * omega);
            *mode = OscillatorState { q: *q, v: 0.0 };
        }
    }

    /// Set the products of the residual compliance's state, with its energy and norm.
    pub(super) fn set_products(&mut self, products: Products, residual: &SampledResidual) {
        self.products = products;
        self.residual_energy = residual.energy(&products);
        self.residual_norm = libm::sqrt(residual.effective_square(&products).max(0.0));
    }

    fn rows(&self, slot: usize) -> &[f64] {
        let m = self.modes.len();
        &self.rows[3 * m * slot..3 * m * (slot + 1)]
    }
}

impl SampledModes {
    pub(crate) fn new(recording: &Recording, step_s: f64) -> Self {
        let modes = &recording.modes;
        let pairs = modes.angular_frequencies.iter().zip(&modes.damping_ratios);
        let oscillators = pairs.map(|(&omega, &zeta)| SampledOscillator::new(omega, zeta, step_s)).collect();
        let residual = SampledResidual::new(recording.residual_relaxation_s(), step_s);
        Self { step_s, residual, oscillators, nodal_compliance: None }
    }

    /// Share of the residual compliance that answers within a step.
    pub(super) fn residual_share(&self) -> f64 {
        self.residual.share(0)
    }

    /// Number of modes.
    pub(crate) fn len(&self) -> usize {
        self.oscillators.len()
    }

    /// Multiply three rows by B.
    pub(super) fn weigh(&self, rows: &[f64], weighted: &mut [f64]) {
        let m = self.len().max(1);
        for (weighted, row) in weighted.chunks_exact_mut(m).zip(rows.chunks_exact(m)) {
            for ((w, phi), oscillator) in weighted.iter_mut().zip(row).zip(&self.oscillators) {
                *w = oscillator.b * phi;
            }
        }
    }

    /// Assign a contact location to a slot. Gives its state at the start of the step [m, body].
    ///
    /// # Real time
    pub(crate) fn assign(
        &self,
        body: &Body,
        state: &mut ModalState,
        slot: usize,
        location: &ContactLocation,
        gravity: DVec3,
    ) -> LocationState {
        let m = self.len();
        let corners = body.corners(location);
        // J·Φ: the weighted rows of the triangle's corners.
        let rows = &mut state.rows[3 * m * slot..3 * m * (slot + 1)];
        rows.fill(0.0);
        for (node, weight) in corners.into_iter().filter(|(_, w)| *w != 0.0) {
            body.add_rows(location.footprint, node, weight, rows);
        }
        let sag = body.sag(location, gravity);
        let memory = state.displacements_by_memory(body, location);
        let residual = sag + self.residual.effective(&memory);
        LocationState { displacement: dot3(state.rows(slot), &state.q) + residual, residual, sag, memory }
    }

    /// R[0] = J_a·Φ·B·Φᵀ·J_bᵀ + (1 − e + c)·S [m/N] between the location of a slot and every contact point.
    ///
    /// # Real time
    /// Costs modes × points, or points where it is precomputed.
    pub(crate) fn compliance(
        &self,
        body: &Body,
        state: &mut ModalState,
        (slot, location): (usize, &ContactLocation),
        points: &[ContactPoint],
        mut give: impl FnMut(usize, DMat3),
    ) {
        let m = self.len();
        let ModalState { rows, weighted, .. } = state;
        let of = |slot: usize| &rows[3 * m * slot..3 * m * (slot + 1)];
        let level = body.level_of(location.footprint);
        let own = body.corners(location);
        let mut weighed = false;
        for (index, point) in points.iter().enumerate() {
            let known = self.nodal_compliance.as_deref().and_then(|nodal| {
                let levels = [level, body.level_of(point.location.footprint)];
                nodal.between(levels, [&own, &body.corners(&point.location)])
            });
            if let Some(block) = known {
                give(index, block);
                continue;
            }
            if !weighed {
                self.weigh(of(slot), weighted);
                weighed = true;
            }
            let residual = body.residual(location, &point.location) * self.residual_share();
            give(index, dot9(weighted, of(point.slot)) + residual);
        }
    }

    /// Predict the modal coordinates at the end of the step without contact force. Gives whether they were computed already.
    ///
    /// # Real time
    pub(crate) fn predict(&self, recording: &Recording, state: &mut ModalState, gravity: DVec3) -> bool {
        let predicted = Some((gravity, self.step_s));
        if state.predicted == predicted {
            return true;
        }
        state.predicted = predicted;
        state.forces.fill(0.0);
        recording.add_gravity_load(gravity, &mut state.forces);
        let pairs = self.oscillators.iter().zip(&state.modes).zip(&state.forces);
        for (((oscillator, &mode), &p), free) in pairs.zip(&mut state.free) {
            *free = oscillator.advance(mode, p).q;
        }
        false
    }

    /// Displacement of a slot's location at the end of the step without contact force [m, body].
    ///
    /// # Real time
    pub(crate) fn free(&self, state: &ModalState, slot: usize, start: &LocationState) -> DVec3 {
        dot3(state.rows(slot), &state.free) + start.sag + self.residual.free(&start.memory)
    }

    /// Advance over the predicted step under the held forces of the contact points, and predict the next step with its
    /// gravity in the same pass over the points. Gives the dissipated energy [J].
    ///
    /// # Real time
    pub(crate) fn advance(
        &self,
        body: &Body,
        state: &mut ModalState,
        points: &mut [ContactPoint],
        next_gravity: DVec3,
    ) -> f64 {
        // S·f, from the displacement that the contact problem has found.
        self.advance_with(body, state, points, next_gravity, |_, point, by_modes| {
            let residual = point.displacement - by_modes;
            let LocationState { sag, memory, .. } = &point.state;
            (residual, (residual - *sag - self.residual.free(memory)) / self.residual_share())
        })
    }

    /// Advance beside another response, which the displacements of the points are of, with their static displacements S·f. Gives the
    /// largest distance between the points' displacements by both [m].
    ///
    /// # Real time
    pub(super) fn advance_beside(
        &self,
        body: &Body,
        state: &mut ModalState,
        points: &mut [ContactPoint],
        next_gravity: DVec3,
        held: &[DVec3],
    ) -> f64 {
        let mut apart = 0.0_f64;
        self.advance_with(body, state, points, next_gravity, |at, point, by_modes| {
            let LocationState { sag, memory, .. } = &point.state;
            let residual = *sag + self.residual.free(memory) + held[at] * self.residual_share();
            apart = apart.max((point.displacement - by_modes - residual).length());
            (residual, held[at])
        });
        apart
    }

    /// State of each mode some steps after the one in which a unit modal force was held.
    pub(super) fn states_after(&self, steps: usize) -> Vec<OscillatorState> {
        let after = |oscillator: &SampledOscillator| {
            let held = oscillator.advance(OscillatorState::default(), 1.0);
            (0..steps).fold(held, |state, _| oscillator.advance(state, 0.0))
        };
        self.oscillators.iter().map(after).collect()
    }

    /// Subtract what a past force on a node [N, body] has left, by the states that unit modal forces of its age have left.
    ///
    /// # Real time
    pub(super) fn forget(
        &self,
        recording: &Recording,
        state: &mut ModalState,
        (node, force): (usize, DVec3),
        left: &[OscillatorState],
    ) {
        for (axis, force) in force.to_array().into_iter().enumerate() {
            let modes = state.modes.iter_mut().zip(recording.modes.row(node, axis)).zip(left);
            for ((mode, phi), left) in modes {
                mode.q -= left.q * phi * force;
                mode.v -= left.v * phi * force;
            }
        }
    }

    /// Advance, with the residual displacement [m] and S·f [m] of each point by its index and its displacement by the modes.
    fn advance_with(
        &self,
        body: &Body,
        state: &mut ModalState,
        points: &mut [ContactPoint],
        next_gravity: DVec3,
        mut residual_of: impl FnMut(usize, &ContactPoint, DVec3) -> (DVec3, DVec3),
    ) -> f64 {
        let m = self.len();
        // p = Φᵀ·Jᵀ·g.
        for point in points.iter().filter(|point| point.force_in_body != DVec3::ZERO) {
            let rows = &state.rows[3 * m * point.slot..3 * m * (point.slot + 1)];
            let g = point.force_in_body;
            let (x, rest) = rows.split_at(m);
            let (y, z) = rest.split_at(m);
            for (((p, x), y), z) in state.forces.iter_mut().zip(x).zip(y).zip(z) {
                *p += g.x * x + g.y * y + g.z * z;
            }
        }
        let mut dissipated = 0.0;
        let pairs = self.oscillators.iter().zip(&mut state.modes).zip(&state.forces);
        for (((oscillator, mode), &p), q) in pairs.zip(&mut state.q) {
            dissipated += oscillator.dissipation(*mode, p);
            let next = oscillator.advance(*mode, p);
            let quiet = libm::fabs(next.q) + libm::fabs(next.v) < FLUSH_BELOW;
            *mode = if quiet { OscillatorState::default() } else { next };
            *q = mode.q;
        }
        core::mem::swap(&mut state.forces, &mut state.held_forces);
        state.predicted = None;
        self.predict(&body.recording, state, next_gravity);

        // The residual compliance dissipates the work that it does not store.
        let (mut work, mut products) = (0.0, [0.0; 3]);
        let mut largest = [(0.0_f64, 0.0_f64); 2];
        state.relax(&self.residual);
        for (at, point) in points.iter_mut().enumerate() {
            let rows = &state.rows[3 * m * point.slot..3 * m * (point.slot + 1)];
            let [modal, free] = dots(rows, [&state.q, &state.free]);
            let (residual, held) = residual_of(at, point, modal);
            let LocationState { residual: start, sag, memory, .. } = &mut point.state;
            let force = point.force_in_body;
            work += force.dot(residual - *start);
            for (sum, displacement) in products.iter_mut().zip([memory.relaxed, memory.held, held]) {
                *sum += force.dot(displacement);
            }
            self.residual.relax(memory);
            memory.add(&self.residual.of_force(held));
            point.free = free + *sag + self.residual.free(memory);
            let (of_total, of_held) = &mut largest[usize::from(body.is_tip(point.location.footprint))];
            let peak = body.residual_peak(&point.location);
            *of_total = of_total.max(peak * (residual - *sag).length());
            *of_held = of_held.max(peak * held.length());
            *start = residual;
            let sag = *sag;
            if let Some(node) = point.single_node() {
                state.nodal.store(node, residual - sag);
            }
            if force != DVec3::ZERO {
                let memory = self.residual.of_force(force);
                state.add_spring_force(body.spring_force(point.location, memory, &self.residual));
                state.add_at_nodes(body, &point.location, &memory, &self.residual);
            }
        }
        state.index_tip_springs(body);
        let has_left = state.spring_forces.iter().any(|spring| spring.memory.held == DVec3::ZERO);
        for (bound, largest) in state.residual_bounds.iter_mut().zip(largest) {
            bound.advance(largest, has_left, &self.residual);
        }
        let products = self.residual.advance(&state.products, products);
        let before = state.residual_energy;
        state.set_products(products, &self.residual);
        dissipated + work - (state.residual_energy - before)
    }

    /// Kinetic, elastic and residual energy [J].
    ///
    /// # Real time
    pub(crate) fn energy(&self, state: &ModalState) -> [f64; 3] {
        let mut sum = [0.0, 0.0, state.residual_energy];
        for (oscillator, &mode) in self.oscillators.iter().zip(&state.modes) {
            let (kinetic, elastic) = oscillator.energy(mode);
            sum[0] += kinetic;
            sum[1] += elastic;
        }
        sum
    }

    /// Displacement of every surface node [m, body], u = Φ·q + S·d.
    pub(crate) fn surface_displacement(
        &self,
        body: &Body,
        deformed: &ModalDeformation,
        gravity: DVec3,
        residual_fields: &mut ResidualFields,
        out: &mut [DVec3],
    ) {
        let modes = &body.recording.modes;
        self.residual_displacements(body, deformed, gravity, residual_fields, out);
        for (node, u) in out.iter_mut().enumerate() {
            let row = |axis: usize| modes.row(node, axis);
            *u += DVec3::new(dot(row(0), &deformed.q), dot(row(1), &deformed.q), dot(row(2), &deformed.q));
        }
    }

    /// Displacement of every surface node beyond the modes [m, body]: S·d, and the sag of a fixed body.
    pub(crate) fn residual_displacements(
        &self,
        body: &Body,
        deformed: &ModalDeformation,
        gravity: DVec3,
        residual_fields: &mut ResidualFields,
        out: &mut [DVec3],
    ) {
        let recording = &body.recording;
        match &recording.gravity {
            Some(response) => {
                let sag = |node: usize| response.residual_displacement(node, gravity);
                out.iter_mut().enumerate().for_each(|(node, u)| *u = sag(node));
            }
            None => out.fill(DVec3::ZERO),
        }
        let Some(embedding) = &recording.embedding else {
            return add_spring_displacements(body, deformed, residual_fields, out);
        };
        let mut of_model = vec![DVec3::ZERO; embedding.model_nodes];
        add_spring_displacements(body, deformed, residual_fields, &mut of_model);
        for (node, u) in out.iter_mut().enumerate() {
            *u += embedding.of(node).map(|(node, weight)| of_model[node] * weight).sum::<DVec3>();
        }
    }
}

/// Add S·d at the nodes of the model [m, body].
fn add_spring_displacements(
    body: &Body,
    deformed: &ModalDeformation,
    residual_fields: &mut ResidualFields,
    out: &mut [DVec3],
) {
    let mut loads = deformed.loaded.clone();
    if !residual_fields.add(body, &deformed.patches, out) {
        // All forces as nodal forces, since patches overlap.
        for SpringForce { location, force, .. } in &deformed.patches {
            body.distribute(location, |node, weight| loads.push((node as u32, *force * weight)));
        }
        // Stable: the order of a node's forces is that of their sum.
        loads.sort_by_key(|(node, _)| *node);
        loads.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
    }
    body.recording.residual.add_displacements(&loads, out);
}
