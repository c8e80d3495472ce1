//! Bounds of the residual displacement of one object's subtrees in a step, computed on demand.
//!
//! Equations: docs/theory.md (C93).

use crate::response::{Body, Footprint, ResponseState, SubtreeCompliance};
use alloc::vec;
use alloc::vec::Vec;

/// Bounds of one level of detail.
#[derive(Debug, Clone)]
struct LevelBounds {
    is_known: bool,
    /// Of every subtree [m].
    of: Vec<f32>,
}

/// Bounds of all levels of detail; buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct ResidualBounds {
    step: Option<u64>,
    /// Sum of the sizes of the forces [N] on every node of the model, and the nodes that have one.
    sizes: Vec<f32>,
    loaded: Vec<u32>,
    levels: Vec<LevelBounds>,
}

impl ResidualBounds {
    pub(super) fn new(body: &Body) -> Self {
        let footprints = (0..=body.coarsest_level()).map(|level| body.footprint_at_level(level));
        let count = |footprint| body.subtrees(footprint).map_or(0, |subtrees| subtrees.len());
        let level = |footprint| LevelBounds { is_known: false, of: vec![0.0; count(footprint)] };
        let nodes = body.recording.model_nodes();
        Self {
            step: None,
            sizes: vec![0.0; nodes],
            loaded: Vec::with_capacity(nodes),
            levels: footprints.map(level).collect(),
        }
    }

    /// Forget the step.
    pub(super) fn forget(&mut self) {
        self.step = None;
    }

    /// Compute the bounds of a level's subtrees under the forces of a step, if they are not known.
    pub(super) fn compute(
        &mut self,
        (level, subtrees): (usize, &SubtreeCompliance),
        body: &Body,
        state: &ResponseState,
        step: u64,
    ) {
        if self.step != Some(step) {
            self.step = Some(step);
            self.levels.iter_mut().for_each(|level| level.is_known = false);
            self.collect_sizes(body, state);
        }
        let Self { sizes, loaded, levels, .. } = self;
        let bounds = &mut levels[level];
        if !bounds.is_known {
            bounds.is_known = true;
            let loads = loaded.iter().map(|&node| (node as usize, sizes[node as usize]));
            subtrees.displacements(loads, &mut bounds.of);
        }
    }

    /// Collect the forces of the residual compliance by the model's nodes; those of tips' patches move no other footprint.
    fn collect_sizes(&mut self, body: &Body, state: &ResponseState) {
        let Self { sizes, loaded, .. } = self;
        loaded.drain(..).for_each(|node| sizes[node as usize] = 0.0);
        let mut add = |node: usize, size: f64| {
            let size = size as f32;
            if sizes[node] == 0.0 && size > 0.0 {
                loaded.push(node as u32);
            }
            sizes[node] += size;
        };
        for (node, force) in state.nodal().loaded() {
            add(*node as usize, force.length());
        }
        let of_patches = state.spring_forces().iter().filter(|s| s.location.footprint != Footprint::Point);
        for spring in of_patches.filter(|s| !body.is_tip(s.location.footprint)) {
            let size = spring.force.length();
            body.distribute(&spring.location, |node, weight| add(node, weight.abs() * size));
        }
    }

    /// Bound of the residual displacement of a level's subtree in the step for which it was computed [m].
    pub(super) fn of(&self, level: usize, subtree: usize) -> f64 {
        self.levels[level].of[subtree].into()
    }
}
