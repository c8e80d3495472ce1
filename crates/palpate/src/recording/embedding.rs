//! Embedding of a surface in the finite elements below it: what is seen and touched may be finer than what is simulated.
//!
//! ```text
//! u_v = Σₐ w_va·u_a        f_a = Σ_v w_va·f_v
//! ```
//!
//! A surface node v moves with nodes a of the finite element model, by the shape functions of the element that it lies in. A force on it is
//! distributed to them by the same weights, so that the work is the same on both sides. Mode shapes, residual compliance and sag are recorded at
//! the model's nodes: their size does not depend on the surface.
//!
//! Equations: docs/theory.md (C89).

use super::{GravityResponse, LARGEST, Recording};
use crate::error::{RecordingError, RecordingPart};
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::{iter::once, mem::take};
use glam::{DMat3, DVec3};

/// Embedding of the surface nodes in the nodes of a finite element model. It holds what is recorded at these nodes; mode shapes and
/// sag of [`Recording`] are those at the surface nodes, made of them by [`Recording::embed`].
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Embedding {
    /// Number of the model's nodes that carry the surface.
    pub model_nodes: usize,
    /// Mean edge between the model's nodes on its boundary [m].
    pub mean_edge: f64,
    /// Index of each surface node's first weight; length surface nodes + 1.
    pub offsets: Vec<u32>,
    /// Model node of each weight.
    pub nodes: Vec<u32>,
    /// Weights [1]; those of a surface node sum to 1.
    pub weights: Vec<f32>,
    /// Mode shapes Φ at the model's nodes [1/√kg]: (3·node + axis)·m + mode.
    pub mode_shapes: Vec<f64>,
    /// Sag beyond the modes at the model's nodes [s²], as in [`GravityResponse`]; empty for a free body.
    pub residual_displacements: Vec<f64>,
}

/// Upper limit of a weight [1]: a surface node an element's size outside of it has some.
const LARGEST_WEIGHT: f32 = 100.0;

/// Difference from 1 of the sum of a surface node's weights [1]: their rounding to single precision.
const SUM_TOLERANCE: f64 = 1e-4;

/// Upper limit of the numbers of mode shapes at the surface nodes: 1.2 GB, 100,000 nodes with 500 modes. A file of some kilobytes could ask for
/// any number.
const MAX_SHAPES: usize = 150_000_000;

impl Embedding {
    /// Model nodes of a surface node, with their weights.
    pub fn of(&self, surface_node: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let range = self.offsets[surface_node] as usize..self.offsets[surface_node + 1] as usize;
        let nodes = self.nodes[range.clone()].iter().map(|&node| node as usize);
        nodes.zip(self.weights[range].iter().map(|&weight| f64::from(weight)))
    }

    /// Values of the surface nodes, `width` numbers each, from those of the model's nodes.
    fn at_surface(&self, values: &[f64], width: usize) -> Vec<f64> {
        let surface_nodes = self.offsets.len().saturating_sub(1);
        let mut out = alloc::vec![0.0; surface_nodes * width];
        for (node, sums) in out.chunks_exact_mut(width.max(1)).enumerate() {
            for (model_node, weight) in self.of(node) {
                let from = &values[width * model_node..width * (model_node + 1)];
                sums.iter_mut().zip(from).for_each(|(sum, value)| *sum += weight * value);
            }
        }
        out
    }

    /// Check lengths, indices and weights.
    pub(super) fn validate(&self, surface_nodes: usize) -> Result<(), RecordingError> {
        self.problem(surface_nodes)
            .map_or(Ok(()), |what| Err(RecordingError::Inconsistent { part: RecordingPart::Surface, what }))
    }

    fn problem(&self, surface_nodes: usize) -> Option<String> {
        let Self { model_nodes, mean_edge, offsets, nodes, weights, .. } = self;
        if !(1.0 / LARGEST..LARGEST).contains(mean_edge) {
            return Some(format!("embedding.mean_edge is {mean_edge:e} m, expected the edge of a body"));
        }
        if offsets.len() != surface_nodes + 1
            || offsets[0] != 0
            || offsets[surface_nodes] as usize != nodes.len()
            || !offsets.is_sorted()
        {
            let count = nodes.len();
            return Some(format!(
                "embedding.offsets do not divide {count} weights between {surface_nodes} nodes"
            ));
        }
        if weights.len() != nodes.len() {
            let (found, expected) = (weights.len(), nodes.len());
            return Some(format!("embedding.weights holds {found} numbers, expected {expected}"));
        }
        if let Some(node) = nodes.iter().find(|node| **node as usize >= *model_nodes) {
            return Some(format!("embedding.nodes name node {node}, beyond the model's {model_nodes} nodes"));
        }
        if let Some(at) = weights.iter().position(|weight| weight.is_nan() || weight.abs() > LARGEST_WEIGHT) {
            let weight = weights[at];
            return Some(format!(
                "embedding.weights[{at}] is {weight:e}, expected -{LARGEST_WEIGHT} to {LARGEST_WEIGHT}"
            ));
        }
        let sum = |node: &usize| self.of(*node).map(|(_, weight)| weight).sum::<f64>();
        (0..surface_nodes)
            .find(|node| libm::fabs(sum(node) - 1.0) > SUM_TOLERANCE)
            .map(|node| format!("embedding.weights of surface node {node} sum to {}, expected 1", sum(&node)))
    }
}

impl Recording {
    /// Embeds the surface: the recording's mode shapes and sag, so far those of the model's nodes, become the embedding's, and those at the surface nodes
    /// are made of them.
    ///
    /// # Errors
    /// [`RecordingError::Inconsistent`] where lengths, indices or weights do not fit.
    pub fn embed(&mut self, mut embedding: Embedding) -> Result<(), RecordingError> {
        embedding.validate(self.surface.positions.len())?;
        let (modes, model_nodes) = (self.modes.len(), embedding.model_nodes);
        let check = |name: &str, found: usize, expected: usize| {
            let what = format!("{name} holds {found} numbers, expected {expected}");
            let part = RecordingPart::Surface;
            if found == expected { Ok(()) } else { Err(RecordingError::Inconsistent { part, what }) }
        };
        check("modes.mode_shapes", self.modes.mode_shapes.len(), 3 * model_nodes * modes)?;
        let shapes = (3 * modes).saturating_mul(self.surface.positions.len());
        if shapes > MAX_SHAPES {
            let what = format!(
                "surface.positions need {shapes} numbers of mode shapes, expected {MAX_SHAPES} at most on an embedded surface"
            );
            return Err(RecordingError::Inconsistent { part: RecordingPart::Surface, what });
        }
        embedding.mode_shapes = take(&mut self.modes.mode_shapes);
        self.modes.mode_shapes = embedding.at_surface(&embedding.mode_shapes, 3 * modes);
        if let Some(gravity) = &mut self.gravity {
            let name = "gravity.residual_displacements";
            check(name, gravity.residual_displacements.len(), 9 * model_nodes)?;
            embedding.residual_displacements = take(&mut gravity.residual_displacements);
            gravity.residual_displacements = embedding.at_surface(&embedding.residual_displacements, 9);
        }
        self.embedding = Some(embedding);
        Ok(())
    }

    /// Number of nodes of the residual compliance: surface nodes, or those of the model that carry an embedded surface.
    pub fn model_nodes(&self) -> usize {
        self.embedding.as_ref().map_or(self.surface.positions.len(), |embedding| embedding.model_nodes)
    }

    /// Model nodes that a surface node moves with, and their weights [1]: itself, but for an embedded surface.
    ///
    /// # Real time
    pub fn model_nodes_of(&self, surface_node: usize) -> impl Iterator<Item = (usize, f64)> + Clone + '_ {
        let own = once((surface_node, 1.0)).take(usize::from(self.embedding.is_none()));
        own.chain(self.embedding.iter().flat_map(move |embedding| embedding.of(surface_node)))
    }

    /// Residual compliance between two surface nodes [m/N]: displacement of node i per force on node j.
    ///
    /// # Real time
    /// Costs the product of the numbers of their model nodes: 1, or 16 to 100 on an embedded surface.
    pub fn residual_between(&self, i: usize, j: usize) -> DMat3 {
        if self.embedding.is_none() {
            return self.residual.block(i, j);
        }
        self.model_nodes_of(j).map(|(node, weight)| self.residual_by_model_node(i, node) * weight).sum()
    }

    /// Residual displacement of a surface node per force on a model node [m/N].
    ///
    /// # Real time
    pub(crate) fn residual_by_model_node(&self, surface_node: usize, model_node: usize) -> DMat3 {
        if self.embedding.is_none() {
            return self.residual.block(surface_node, model_node);
        }
        let of = |(node, weight): (usize, f64)| self.residual.block(node, model_node) * weight;
        self.model_nodes_of(surface_node).map(of).sum()
    }

    /// Mean edge between nodes of the finite element model at the surface [m]: below it the recording resolves nothing.
    pub fn mean_element_edge(&self) -> f64 {
        self.embedding.as_ref().map_or_else(|| self.surface.mean_edge(), |embedding| embedding.mean_edge)
    }

    /// Mode shapes at the nodes of the residual compliance [1/√kg], by rows as those of [`super::ModalBasis`].
    pub(crate) fn model_mode_shapes(&self) -> &[f64] {
        self.embedding.as_ref().map_or(&self.modes.mode_shapes, |embedding| &embedding.mode_shapes)
    }

    /// Displacement of a model node beyond the modes [m], under an acceleration [m/s²].
    pub(crate) fn model_sag(&self, response: &GravityResponse, node: usize, acceleration: DVec3) -> DVec3 {
        let displacements = match &self.embedding {
            None => &response.residual_displacements,
            Some(embedding) => &embedding.residual_displacements,
        };
        super::sag_at(displacements, node, acceleration)
    }
}
