//! Finite element nodes and elements of a mesh: its corner nodes, and mid-edge nodes for order 2.

use crate::element::{EDGES, Order};
use crate::mesh::{Mesh, boundary};
use glam::DVec3;
use std::collections::HashMap;

/// A mesh as the elements see it. Edges are straight.
#[derive(Debug, Clone)]
pub struct Discretisation {
    /// Polynomial order.
    pub order: Order,
    /// Positions [m]: used corner nodes in the mesh's order, then mid-edge nodes.
    pub nodes: Vec<DVec3>,
    /// Nodes of each element, `order.nodes()` apiece.
    pub elements: Vec<u32>,
    /// Region of each element.
    pub regions: Vec<u32>,
    /// Boundary triangles, counter-clockwise seen from outside; order 2 has four per face.
    pub triangles: Vec<[u32; 3]>,
    /// Number of each node: of corners in the mesh, of mid-edge nodes counted on from the mesh's nodes.
    pub source_nodes: Vec<u32>,
    /// For each node of the mesh, its number here.
    pub node_of_mesh: Vec<Option<u32>>,
}

impl Discretisation {
    /// Build from a checked mesh.
    pub fn new(mesh: &Mesh, order: Order) -> Self {
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
        let corners_used = nodes.len();
        let corner = |node: u32| node_of_mesh[node as usize].unwrap_or_default();

        let mut middles: HashMap<[u32; 2], u32> = HashMap::new();
        let mut elements = Vec::with_capacity(mesh.tets.len() * order.nodes());
        for tet in &mesh.tets {
            let corners = tet.map(corner);
            elements.extend(corners);
            if order == Order::Quadratic {
                for [a, b] in EDGES.map(|edge| edge.map(|at| corners[at])) {
                    let middle = *middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                        source_nodes.push((mesh.nodes.len() + nodes.len() - corners_used) as u32);
                        nodes.push((nodes[a as usize] + nodes[b as usize]) * 0.5);
                        nodes.len() as u32 - 1
                    });
                    elements.push(middle);
                }
            }
        }

        let mut triangles = Vec::new();
        for face in boundary(&mesh.tets) {
            let [a, b, c] = face.map(corner);
            match order {
                Order::Linear => triangles.push([a, b, c]),
                Order::Quadratic => {
                    let middle = |p: u32, q: u32| middles[&[p.min(q), p.max(q)]];
                    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                    triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
                }
            }
        }
        let regions = mesh.tet_regions.clone();
        Self { order, nodes, elements, regions, triangles, source_nodes, node_of_mesh }
    }

    /// Degrees of freedom, fixed ones included.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Nodes of each element.
    pub fn element_nodes(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.elements.chunks_exact(self.order.nodes())
    }

    /// Whether each node is among some nodes of the mesh; a mid-edge node is when both ends of its edge are.
    pub fn among(&self, mesh_nodes: &[u32]) -> Vec<bool> {
        let mut chosen = vec![false; self.nodes.len()];
        for &node in mesh_nodes {
            if let Some(Some(node)) = self.node_of_mesh.get(node as usize) {
                chosen[*node as usize] = true;
            }
        }
        if self.order == Order::Quadratic {
            let ends = chosen.clone();
            for nodes in self.element_nodes() {
                for (middle, [a, b]) in nodes[4..].iter().zip(EDGES) {
                    if ends[nodes[a] as usize] && ends[nodes[b] as usize] {
                        chosen[*middle as usize] = true;
                    }
                }
            }
        }
        chosen
    }

    /// The node nearest to a position [m].
    pub fn node_at(&self, position: DVec3) -> usize {
        let off = |node: &usize| (self.nodes[*node] - position).length();
        (0..self.nodes.len()).min_by(|a, b| off(a).total_cmp(&off(b))).unwrap_or(0)
    }

    /// Nodes on the boundary, ascending.
    pub fn surface_nodes(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self.triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }
}
