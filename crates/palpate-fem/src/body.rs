//! A recorded body: the recording with the finite element model that it was made from.

use crate::modes::ElasticModes;
use crate::system::System;
use glam::DVec3;
use palpate::Recording;

/// A recording together with its finite element model: nodes, factor and modes.
///
/// Tables ([`crate::table`]) and the unreduced solution ([`crate::reference`]) are computed from it. Node numbers are
/// those of the finite element model: the used nodes of the mesh in its order, then the mid-edge nodes of quadratic
/// elements. Degree of freedom 3·node + axis is a node's displacement along an axis.
pub struct RecordedBody {
    /// The recording.
    pub recording: Recording,
    pub(crate) system: System,
    pub(crate) modes: ElasticModes,
}

impl RecordedBody {
    /// Node positions [m], in the frame of the mesh.
    pub fn nodes(&self) -> &[DVec3] {
        &self.system.discretisation.nodes
    }

    /// Number of degrees of freedom, fixed ones included.
    pub fn dofs(&self) -> usize {
        self.system.discretisation.dofs()
    }

    /// Number of elements.
    pub fn element_count(&self) -> usize {
        self.system.discretisation.regions.len()
    }

    /// Nodes on the boundary, ascending: in the order of the surface positions of the recording.
    pub fn surface_nodes(&self) -> Vec<u32> {
        self.system.discretisation.surface_nodes()
    }

    /// Boundary triangles of nodes, counter-clockwise seen from outside; a face of a quadratic element has four.
    pub fn surface_triangles(&self) -> &[[u32; 3]] {
        &self.system.discretisation.triangles
    }

    /// Node nearest to a position [m].
    pub fn nearest_node(&self, position: DVec3) -> usize {
        self.system.discretisation.nearest_node(position)
    }

    /// Whether each node is in a set of nodes of the mesh; a mid-edge node that the mesh lacks is if both ends of its
    /// edge are.
    pub fn nodes_in_set(&self, mesh_nodes: &[u32]) -> Vec<bool> {
        self.system.discretisation.in_set(mesh_nodes)
    }
}
