//! Finite element nodes and elements of a mesh: corner nodes, and mid-edge nodes for quadratic elements.

use crate::element::{EDGES, ElementOrder};
use crate::mesh::Mesh;
use glam::DVec3;
use std::collections::HashMap;

/// Nodes and elements of the finite element model. Edges are straight.
#[derive(Debug, Clone)]
pub struct Discretisation {
    /// Polynomial order.
    pub order: ElementOrder,
    /// Positions [m]: used corner nodes in the mesh's order, then mid-edge nodes.
    pub nodes: Vec<DVec3>,
    /// Nodes of each element, `order.nodes()` apiece.
    pub elements: Vec<u32>,
    /// Region of each element.
    pub regions: Vec<u32>,
    /// Boundary triangles, counter-clockwise seen from outside; order 2 has four per face.
    pub triangles: Vec<[u32; 3]>,
    /// Number of each node in the mesh; mid-edge nodes are numbered on from the mesh's last node.
    pub source_nodes: Vec<u32>,
    /// Number of each node of the mesh in [`Self::nodes`]; none for nodes without elements.
    pub node_of_mesh: Vec<Option<u32>>,
}

impl Discretisation {
    /// Discretises a checked mesh.
    pub fn new(mesh: &Mesh, order: ElementOrder) -> Self {
        let mut node_of_mesh = vec![None; mesh.nodes.len()];
        for &node in mesh.tets.iter().flatten() {
            node_of_mesh[node as usize] = Some(0);
        }
        let (mut nodes, mut source_nodes) = (Vec::new(), Vec::new());
        for (at, slot) in node_of_mesh.iter_mut().enumerate().filter(|(_, slot)| slot.is_some()) {
            *slot = Some(nodes.len() as u32);
            nodes.push(mesh.nodes[at]);
            source_nodes.push(at as u32);
        }
        let corner_count = nodes.len();
        let corner = |node: u32| node_of_mesh[node as usize].unwrap_or_default();

        let mut mid_edge_nodes: HashMap<[u32; 2], u32> = HashMap::new();
        let mut elements = Vec::with_capacity(mesh.tets.len() * order.nodes());
        for tet in &mesh.tets {
            let corners = tet.map(corner);
            elements.extend(corners);
            if order == ElementOrder::Quadratic {
                for [a, b] in EDGES.map(|edge| edge.map(|at| corners[at])) {
                    let middle = *mid_edge_nodes.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                        source_nodes.push((mesh.nodes.len() + nodes.len() - corner_count) as u32);
                        nodes.push((nodes[a as usize] + nodes[b as usize]) * 0.5);
                        nodes.len() as u32 - 1
                    });
                    elements.push(middle);
                }
            }
        }

        let mut triangles = Vec::new();
        for face in mesh.boundary() {
            let [a, b, c] = face.map(corner);
            match order {
                ElementOrder::Linear => triangles.push([a, b, c]),
                ElementOrder::Quadratic => {
                    let middle = |p: u32, q: u32| mid_edge_nodes[&[p.min(q), p.max(q)]];
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
            }
        }
        let regions = mesh.tet_regions.clone();
        Self { order, nodes, elements, regions, triangles, source_nodes, node_of_mesh }
    }

    /// Number of degrees of freedom, fixed ones included.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Nodes of each element.
    pub fn element_nodes(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.elements.chunks_exact(self.order.nodes())
    }

    /// Whether each node is in a set of nodes of the mesh; a mid-edge node is if both ends of its edge are.
    pub fn in_set(&self, mesh_nodes: &[u32]) -> Vec<bool> {
        let mut selected = vec![false; self.nodes.len()];
        for &node in mesh_nodes {
            if let Some(Some(node)) = self.node_of_mesh.get(node as usize) {
                selected[*node as usize] = true;
            }
        }
        if self.order == ElementOrder::Quadratic {
            let ends = selected.clone();
            for nodes in self.element_nodes() {
                for (middle, [a, b]) in nodes[4..].iter().zip(EDGES) {
                    if ends[nodes[a] as usize] && ends[nodes[b] as usize] {
                        selected[*middle as usize] = true;
                    }
                }
            }
        }
        selected
    }

    /// Number of the node nearest to a position [m].
    pub fn nearest_node(&self, position: DVec3) -> usize {
        let distance = |node: &usize| (self.nodes[*node] - position).length();
        (0..self.nodes.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }

    /// Numbers of the nodes on the boundary, ascending.
    pub fn surface_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
