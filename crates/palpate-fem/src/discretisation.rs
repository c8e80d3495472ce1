//! Finite element nodes and elements of a mesh: corner nodes, and mid-edge nodes for quadratic elements.

use crate::element::{EDGES, ElementOrder};
use glam::DVec3;
use palpate_mesh::Mesh;
use std::collections::HashMap;

/// Nodes and elements of the finite element model.
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
    /// Number of each node in the mesh; mid-edge nodes that it lacks are numbered on from its last node.
    pub source_nodes: Vec<u32>,
    /// Number of each node of the mesh in [`Self::nodes`]; none for nodes that are not used.
    pub node_of_mesh: Vec<Option<u32>>,
    /// Whether each node is a mid-edge node that the mesh lacks.
    is_added: Vec<bool>,
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
        let corner = |node: u32| node_of_mesh[node as usize].unwrap_or_default();
        let mut is_added = vec![false; nodes.len()];

        let mut mid_edge_nodes: HashMap<[u32; 2], u32> = HashMap::new();
        let mut elements = Vec::with_capacity(mesh.tets.len() * order.nodes());
        let mut added = mesh.nodes.len() as u32;
        for tet in &mesh.tets {
            let corners = tet.map(corner);
            elements.extend(corners);
            if order == ElementOrder::Quadratic {
                for edge in EDGES {
                    let [a, b] = edge.map(|at| corners[at]);
                    let middle = *mid_edge_nodes.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                        let known = mesh.mid_edge_node(tet[edge[0]], tet[edge[1]]);
                        source_nodes.push(known.unwrap_or(added));
                        is_added.push(known.is_none());
                        added += u32::from(known.is_none());
                        let middle = || (nodes[a as usize] + nodes[b as usize]) * 0.5;
                        nodes.push(known.map_or_else(middle, |node| mesh.nodes[node as usize]));
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
        for (at, &source) in (0..).zip(&source_nodes) {
            node_of_mesh.get_mut(source as usize).into_iter().for_each(|slot| *slot = Some(at));
        }
        let regions = mesh.tet_regions.clone();
        Self { order, nodes, elements, regions, triangles, source_nodes, node_of_mesh, is_added }
    }

    /// Number of degrees of freedom, fixed ones included.
    pub fn dofs(&self) -> usize {
        3 * self.nodes.len()
    }

    /// Nodes of each element.
    pub fn element_nodes(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.elements.chunks_exact(self.order.nodes())
    }

    /// Whether each node is in a set of nodes of the mesh; a mid-edge node that the mesh lacks is if both ends of its edge are.
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
                    let is_added = self.is_added[*middle as usize];
                    if is_added && ends[nodes[a] as usize] && ends[nodes[b] as usize] {
                        selected[*middle as usize] = true;
                    }
                }
            }
        }
        selected
    }

    /// Nodes of each boundary face: three corners, and the nodes between them in their order for quadratic elements.
    pub fn faces(&self) -> Vec<Vec<u32>> {
        match self.order {
            ElementOrder::Linear => self.triangles.iter().map(|face| face.to_vec()).collect(),
            ElementOrder::Quadratic => {
                let face = |four: &[[u32; 3]]| {
                    vec![four[0][0], four[1][1], four[2][2], four[0][1], four[1][2], four[0][2]]
                };
                self.triangles.chunks_exact(4).map(face).collect()
            }
        }
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
