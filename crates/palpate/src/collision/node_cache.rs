//! Node positions of one object, computed on demand and kept for a moment of the step.

use super::residual_bounds::ResidualBounds;
use crate::response::{Body, ContactPoints, Footprint};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Values per surface node that are valid while their stamp is that of the cache.
#[derive(Debug, Clone)]
struct Stamped<T> {
    values: Vec<T>,
    stamps: Vec<u64>,
    now: u64,
}

impl<T: Copy> Stamped<T> {
    fn new(zero: T, count: usize) -> Self {
        Self { values: vec![zero; count], stamps: vec![0; count], now: 0 }
    }

    /// Forget all values.
    fn clear(&mut self) {
        self.now += 1;
    }

    fn get(&self, at: usize) -> Option<T> {
        (self.stamps[at] == self.now).then(|| self.values[at])
    }

    fn set(&mut self, at: usize, value: T) {
        (self.values[at], self.stamps[at]) = (value, self.now);
    }
}

/// Node positions of one object [m, body]; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct NodePositionCache {
    /// By the modes, now.
    modal: Stamped<DVec3>,
    /// By the modes, at the end of the step without contact force.
    predicted: Stamped<DVec3>,
    /// With residual displacement, now.
    total: Stamped<DVec3>,
    /// Residual displacement of the model's nodes, of an embedded surface.
    carriers: Stamped<DVec3>,
    /// Whether `total` leaves out the residual displacement of some contacts.
    excludes_own: bool,
    /// Step and footprint for which positions are kept; none within a step.
    key: Option<(u64, Footprint)>,
    /// Modal coordinates in single precision, now and at the end of the step without contact force, for patches.
    single: [Vec<f32>; 2],
    /// Nodes that the present traversal has reached.
    marks: Vec<u32>,
    mark: u32,
    /// Bounds of the residual displacement of subtrees.
    pub(super) residual_bounds: ResidualBounds,
}

impl NodePositionCache {
    pub(crate) fn new(body: &Body) -> Self {
        let nodes = body.max_vertices();
        let positions = || Stamped::new(DVec3::ZERO, nodes);
        Self {
            modal: positions(),
            predicted: positions(),
            total: positions(),
            carriers: Stamped::new(
                DVec3::ZERO,
                body.recording.embedding.as_ref().map_or(0, |e| e.model_nodes),
            ),
            excludes_own: false,
            key: None,
            single: [(); 2].map(|()| vec![0.0; body.recording.modes.len()]),
            marks: vec![0; nodes],
            mark: 0,
            residual_bounds: ResidualBounds::new(body),
        }
    }

    /// Select a step and footprint, with all residual displacement. Positions of the same key stay; gives whether it is
    /// another one.
    pub(super) fn select(&mut self, key: Option<(u64, Footprint)>) -> bool {
        let same = key.is_some() && self.key == key;
        if !same {
            [&mut self.modal, &mut self.predicted, &mut self.carriers].into_iter().for_each(Stamped::clear);
            self.key = key;
        }
        if !same || self.excludes_own {
            self.total.clear();
            self.excludes_own = false;
        }
        !same
    }

    /// Forget the positions of the step.
    pub(super) fn forget(&mut self) {
        self.key = None;
        self.residual_bounds.forget();
    }

    /// Leave out the residual displacement of some contacts from now on.
    pub(super) fn exclude_own(&mut self) {
        self.total.clear();
        self.excludes_own = true;
    }

    /// Round modal coordinates, now and predicted, to single precision.
    pub(super) fn set_single(&mut self, coordinates: [&[f64]; 2]) {
        for (single, q) in self.single.iter_mut().zip(coordinates) {
            single.iter_mut().zip(q).for_each(|(single, q)| *single = *q as f32);
        }
    }

    pub(super) fn single(&self, moment: usize, modes: usize) -> &[f32] {
        &self.single[moment][..modes]
    }

    /// Take over the positions of contact points that are nodes.
    pub(super) fn take_contact_points(&mut self, points: &ContactPoints, footprint: Footprint) {
        for point in points.points.iter().filter(|point| point.location.footprint == footprint) {
            let Some(node) = point.node else { continue };
            let by_modes = point.state.displacement - point.state.residual;
            self.modal.set(node, point.rest + by_modes);
            self.predicted.set(node, point.rest + point.free - point.state.sag);
            self.total.set(node, point.rest + point.state.displacement);
        }
    }

    pub(super) fn modal(&self, node: usize) -> Option<DVec3> {
        self.modal.get(node)
    }

    pub(super) fn set_modal(&mut self, node: usize, position: DVec3) {
        self.modal.set(node, position);
    }

    pub(super) fn predicted(&self, node: usize) -> Option<DVec3> {
        self.predicted.get(node)
    }

    pub(super) fn set_predicted(&mut self, node: usize, position: DVec3) {
        self.predicted.set(node, position);
    }

    pub(super) fn total(&self, node: usize) -> Option<DVec3> {
        self.total.get(node)
    }

    pub(super) fn set_total(&mut self, node: usize, position: DVec3) {
        self.total.set(node, position);
    }

    /// Residual displacement [m] of a model node of an embedded surface, computed once.
    pub(super) fn carrier(&mut self, node: usize, compute: impl FnOnce() -> DVec3) -> DVec3 {
        let known = self.carriers.get(node);
        known.unwrap_or_else(|| {
            let displacement = compute();
            self.carriers.set(node, displacement);
            displacement
        })
    }

    /// Begin a traversal: no node is marked.
    pub(super) fn clear_marks(&mut self) {
        self.mark = self.mark.wrapping_add(1);
    }

    /// Mark a node; gives whether it was unmarked.
    pub(super) fn mark(&mut self, node: usize) -> bool {
        core::mem::replace(&mut self.marks[node], self.mark) != self.mark
    }
}
