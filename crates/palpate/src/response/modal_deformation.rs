//! Deformation of a body in modal form for pictures: displacement of every surface node.
//!
//! Equations: docs/theory.md (C3).

use super::body::used;
use super::modal::{ModalState, SampledModes};
use super::residual_fields::ResidualFields;
use super::residual_loads::{VertexLoad, add_residual_displacements};
use super::tip_springs::TipSpring;
use super::{Body, ContactLocation, Footprint};
use crate::dot_products::dot;
use alloc::vec::Vec;
use glam::DVec3;

/// Data that determine the displacement of an object in modal form; buffers are made once.
#[derive(Debug)]
pub(crate) struct ModalDeformation {
    q: Vec<f64>,
    /// Loads at vertices.
    loads: Vec<VertexLoad>,
    /// Forces on patches of tips [N, body].
    tips: Vec<(ContactLocation, DVec3)>,
}

impl Clone for ModalDeformation {
    /// Clone of equal capacity: later copies into it do not allocate.
    fn clone(&self) -> Self {
        let mut loads = Vec::with_capacity(self.loads.capacity());
        loads.extend_from_slice(&self.loads);
        let mut tips = Vec::with_capacity(self.tips.capacity());
        tips.extend_from_slice(&self.tips);
        Self { q: self.q.clone(), loads, tips }
    }
}

impl ModalDeformation {
    pub(super) fn new(state: &ModalState) -> Self {
        let mut new = Self {
            q: state.q.clone(),
            loads: Vec::with_capacity(state.loads.room()),
            tips: Vec::with_capacity(state.tip_springs.room()),
        };
        new.copy_from(state);
        new
    }

    /// Modal coordinates q [m·√kg].
    pub(super) fn coordinates(&self) -> &[f64] {
        &self.q
    }

    /// Copy the present data of the same object.
    ///
    /// # Real time
    pub(super) fn copy_from(&mut self, state: &ModalState) {
        self.q.copy_from_slice(&state.q);
        self.loads.clear();
        self.loads.extend(state.loads.iter());
        self.tips.clear();
        let tip = |TipSpring { location, force, .. }: &TipSpring| (*location, *force);
        self.tips.extend(state.tip_springs.iter().map(tip));
    }
}

impl SampledModes {
    /// Displacement of every surface node [m, body], u = Φ·q + S·d.
    pub(super) fn surface_displacement(
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
    pub(super) fn residual_displacements(
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
        let mut all = deformed.loads.clone();
        for (location, force) in &deformed.tips {
            let of_corner = |(vertex, weight): (usize, f64)| VertexLoad {
                footprint: location.footprint,
                vertex: vertex as u32,
                force: *force * weight,
            };
            all.extend(used(body.corners(location)).map(of_corner));
        }
        let are_added = residual_fields.add(body, &all, out);
        // What is left as nodal forces, since patches overlap.
        let mut loads = Vec::with_capacity(all.len());
        for VertexLoad { footprint, vertex, force } in all {
            if footprint == Footprint::Point || !are_added {
                let vertex = (footprint, vertex as usize);
                body.distribute_vertex(vertex, 1.0, |node, weight| loads.push((node as u32, force * weight)));
            }
        }
        if !are_added {
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
        add_residual_displacements(&recording.residual, &loads, out);
    }
}
