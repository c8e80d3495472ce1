//! Mid-edge nodes of quadratic tetrahedra, and the curved elements that they make.
//!
//! With barycentric coordinates λ_a, corners x_a and mid-edge nodes m_ab, a quadratic tetrahedron is the image
//!
//! ```text
//! x(λ) = Σ_a λ_a(2λ_a − 1)·x_a + Σ_{a<b} 4λ_aλ_b·m_ab
//! ```
//!
//! Its Jacobian ∂x/∂(λ1, λ2, λ3) is linear in λ and the determinant cubic. A straight edge has m_ab = (x_a + x_b)/2.
//!
//! References: Zienkiewicz, Taylor & Zhu, *The Finite Element Method*, 5; Johnen, Remacle & Geuzaine, Geometrical validity of curvilinear
//! finite elements (2013), for the bound of the determinant.

use crate::error::MeshError;
use crate::faces::EDGES;
use crate::volume_mesh::{Mesh, MidEdgeNode};
use glam::{DMat3, DVec3};
use std::collections::{HashMap, HashSet};

/// Distance of a mid-edge node from the middle of its edge below which the edge is straight, as a share of its length: the rounding of
/// coordinates that were scaled.
const STRAIGHT: f64 = 1e-12;

/// Smallest determinant of the Jacobian, as a share of the longest edge cubed: as for the volume of straight elements.
const SMALLEST_DETERMINANT: f64 = 6e-10;

/// Divisions of an edge between the points at which a determinant is looked at that its bound leaves open.
const DIVISIONS: u32 = 8;

/// Quadratic tetrahedron: four corners, and nodes on the edges 01, 12, 02, 03, 13, 23 [m].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct QuadraticTet(pub [DVec3; 10]);

impl QuadraticTet {
    /// Whether all mid-edge nodes are in the middle.
    pub fn is_straight(&self) -> bool {
        EDGES.iter().zip(&self.0[4..]).all(|(&[a, b], &middle)| is_middle(self.0[a], self.0[b], middle))
    }

    /// Columns of the Jacobian at the four corners, between which it is linear [m].
    fn corner_jacobians(&self) -> [DMat3; 4] {
        // ∂x/∂λ_a = Σ_b λ_b·(4·m_ab − x_a), and 3·x_a in place of the term of b = a.
        let mut rows = [[DVec3::ZERO; 4]; 4];
        for (a, row) in rows.iter_mut().enumerate() {
            row.fill(-self.0[a]);
            row[a] = 3.0 * self.0[a];
        }
        for (&[a, b], &middle) in EDGES.iter().zip(&self.0[4..]) {
            rows[a][b] += 4.0 * middle;
            rows[b][a] += 4.0 * middle;
        }
        [0, 1, 2, 3].map(|b| {
            DMat3::from_cols(rows[1][b] - rows[0][b], rows[2][b] - rows[0][b], rows[3][b] - rows[0][b])
        })
    }

    /// Jacobian ∂x/∂(λ1, λ2, λ3) [m] at barycentric coordinates.
    pub fn jacobian(&self, at: [f64; 4]) -> DMat3 {
        let jacobians = self.corner_jacobians();
        jacobians[0] * at[0] + jacobians[1] * at[1] + jacobians[2] * at[2] + jacobians[3] * at[3]
    }

    /// Position [m] at barycentric coordinates.
    pub fn position(&self, at: [f64; 4]) -> DVec3 {
        let corners: DVec3 = (0..4).map(|a| self.0[a] * (at[a] * (2.0 * at[a] - 1.0))).sum();
        let middles: DVec3 =
            EDGES.iter().zip(&self.0[4..]).map(|(&[a, b], &m)| m * (4.0 * at[a] * at[b])).sum();
        corners + middles
    }

    /// Signed volume [m³]: ∫ det/6, by the mean of the 20 Bernstein coefficients of the cubic determinant.
    pub fn volume(&self) -> f64 {
        self.bernstein_coefficients().iter().sum::<f64>() / 120.0
    }

    /// Bernstein coefficients of the determinant of the Jacobian [m³]: none is above its maximum or below its minimum bound.
    fn bernstein_coefficients(&self) -> Vec<f64> {
        let jacobians = self.corner_jacobians();
        let mut coefficients = Vec::with_capacity(20);
        for a in 0..4 {
            for b in a..4 {
                for c in b..4 {
                    // Mean over the six orders in which the columns take the three coordinates.
                    let orders = [[a, b, c], [a, c, b], [b, a, c], [b, c, a], [c, a, b], [c, b, a]];
                    let determinant = |[a, b, c]: [usize; 3]| {
                        let (x, y, z) = (jacobians[a].x_axis, jacobians[b].y_axis, jacobians[c].z_axis);
                        x.cross(y).dot(z)
                    };
                    coefficients.push(orders.map(determinant).iter().sum::<f64>() / 6.0);
                }
            }
        }
        coefficients
    }

    /// Lower bound of the determinant of the Jacobian [m³].
    pub(crate) fn least_determinant(&self) -> f64 {
        self.bernstein_coefficients().into_iter().fold(f64::INFINITY, f64::min)
    }

    /// Whether the determinant of the Jacobian is positive: by its bound, or else at the points of a lattice.
    fn is_positive(&self) -> bool {
        let longest = EDGES.iter().map(|&[a, b]| (self.0[a] - self.0[b]).length()).fold(0.0, f64::max);
        let smallest = SMALLEST_DETERMINANT * longest.powi(3);
        if self.bernstein_coefficients().iter().all(|value| *value > smallest) {
            return true;
        }
        let n = DIVISIONS;
        let share = |i: u32| f64::from(i) / f64::from(n);
        (0..=n).all(|i| {
            (0..=n - i).all(|j| {
                (0..=n - i - j).all(|k| {
                    let at = [share(n - i - j - k), share(i), share(j), share(k)];
                    self.jacobian(at).determinant() > smallest
                })
            })
        })
    }
}

fn is_middle(a: DVec3, b: DVec3, middle: DVec3) -> bool {
    (middle - (a + b) * 0.5).length() <= STRAIGHT * (b - a).length()
}

/// Sorts the last six of ten nodes by the edges whose middles they are nearest to; false if two are nearest to one.
pub(crate) fn sort_by_edges(positions: &[DVec3], nodes: &mut [u32; 10]) -> bool {
    let at = |node: u32| positions[node as usize];
    let mut sorted = [None; 6];
    for &node in &nodes[4..] {
        let distance = |edge: &usize| {
            let [a, b] = EDGES[*edge].map(|corner| at(nodes[corner]));
            (at(node) - (a + b) * 0.5).length_squared()
        };
        let nearest = (0..6).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0);
        sorted[nearest] = Some(node);
    }
    let found: Vec<u32> = sorted.into_iter().flatten().collect();
    let is_whole = found.len() == 6;
    if is_whole {
        nodes[4..].copy_from_slice(&found);
    }
    is_whole
}

/// Nodes of the edges of quadratic tetrahedra, ascending by edge, and the number of nodes that can't be used: a corner elsewhere, the
/// node of another edge, or a second one of an edge.
pub(crate) fn unique_mid_edge_nodes(
    mut nodes: Vec<MidEdgeNode>,
    is_corner: &[bool],
) -> (Vec<MidEdgeNode>, Vec<u32>) {
    nodes.sort_unstable();
    nodes.dedup();
    let (mut last, mut used, mut unusable) = (None, HashSet::with_capacity(nodes.len()), Vec::new());
    nodes.retain(|found| {
        let is_kept = last != Some(found.ends)
            && found.ends[0] != found.ends[1]
            && !is_corner[found.node as usize]
            && used.insert(found.node);
        if is_kept {
            last = Some(found.ends);
        } else {
            unusable.push(found.node);
        }
        is_kept
    });
    (nodes, unusable)
}

impl Mesh {
    /// Node on the edge between two corners, if the mesh has one.
    pub fn mid_edge_node(&self, a: u32, b: u32) -> Option<u32> {
        let ends = [a.min(b), a.max(b)];
        let at = self.mid_edge_nodes.binary_search_by_key(&ends, |found| found.ends).ok()?;
        Some(self.mid_edge_nodes[at].node)
    }

    /// A tetrahedron with its mid-edge nodes; in the middle of edges without one.
    pub fn quadratic_tet(&self, tet: &[u32; 4]) -> QuadraticTet {
        let corner = |at: usize| self.nodes[tet[at] as usize];
        let middle = |[a, b]: [usize; 2]| match self.mid_edge_node(tet[a], tet[b]) {
            Some(node) => self.nodes[node as usize],
            None => (corner(a) + corner(b)) * 0.5,
        };
        let [ab, bc, ac, ad, bd, cd] = EDGES.map(middle);
        QuadraticTet([corner(0), corner(1), corner(2), corner(3), ab, bc, ac, ad, bd, cd])
    }

    /// Signed volume of a tetrahedron [m³], with its mid-edge nodes.
    pub fn quadratic_volume(&self, tet: &[u32; 4]) -> f64 {
        self.quadratic_tet(tet).volume()
    }

    /// Makes all edges straight: nodes on them are left out.
    pub fn straighten(&mut self) {
        self.mid_side_nodes.extend(self.mid_edge_nodes.drain(..).map(|found| found.node));
        self.mid_side_nodes.sort_unstable();
    }

    /// Whether any edge is curved.
    pub fn is_curved(&self) -> bool {
        let at = |node: u32| self.nodes[node as usize];
        self.mid_edge_nodes
            .iter()
            .any(|&MidEdgeNode { ends: [a, b], node }| !is_middle(at(a), at(b), at(node)))
    }

    /// Whether each node is in the middle of its edge, as [`Mesh::add_mid_edge_nodes`] makes it.
    pub fn straight_mid_edge_nodes(&self) -> Vec<bool> {
        let mut is_straight = vec![false; self.nodes.len()];
        let at = |node: u32| self.nodes[node as usize];
        for &MidEdgeNode { ends: [a, b], node } in &self.mid_edge_nodes {
            is_straight[node as usize] = at(node) == (at(a) + at(b)) * 0.5;
        }
        is_straight
    }

    /// Refuses curved tetrahedra that are folded.
    ///
    /// # Errors
    /// [`MeshError::FoldedCurve`] when the Jacobian of a curved tetrahedron is not positive.
    pub fn check_curved(&self) -> Result<(), MeshError> {
        if !self.is_curved() {
            return Ok(());
        }
        let is_folded = |tet: &[u32; 4]| {
            let element = self.quadratic_tet(tet);
            !element.is_straight() && !element.is_positive()
        };
        let folded: Vec<usize> = (0..self.tets.len()).filter(|&at| is_folded(&self.tets[at])).collect();
        let Some(&first) = folded.first() else { return Ok(()) };
        let nodes = self.tets[first];
        let near = nodes.iter().map(|&node| self.nodes[node as usize]).sum::<DVec3>() * 0.25;
        Err(MeshError::FoldedCurve { count: folded.len(), first: first as u32, nodes, near })
    }

    /// Adds a node in the middle of every edge that has none: nodes of quadratic elements. They are numbered on from the last node, in the
    /// order of the tetrahedra, and belong to the groups of both ends; where all nodes of a group are on the boundary, on edges of
    /// boundary triangles only.
    pub fn add_mid_edge_nodes(&mut self) {
        let mut known: HashMap<[u32; 2], u32> =
            self.mid_edge_nodes.iter().map(|found| (found.ends, found.node)).collect();
        let first = self.nodes.len() as u32;
        for tet in &self.tets {
            for [a, b] in EDGES.map(|edge| edge.map(|corner| tet[corner])) {
                known.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    self.nodes.push((self.nodes[a as usize] + self.nodes[b as usize]) * 0.5);
                    self.nodes.len() as u32 - 1
                });
            }
        }
        self.mid_edge_nodes = known.into_iter().map(|(ends, node)| MidEdgeNode { ends, node }).collect();
        self.mid_edge_nodes.sort_unstable();
        if !self.groups.is_empty() {
            self.extend_groups(first);
        }
    }

    /// Adds mid-edge nodes from a number on to the groups of their ends.
    fn extend_groups(&mut self, first: u32) {
        let mut on_boundary = vec![false; self.nodes.len()];
        let mut boundary_edges = HashSet::new();
        for [a, b, c] in self.boundary() {
            for [a, b] in [[a, b], [b, c], [c, a]] {
                on_boundary[a as usize] = true;
                boundary_edges.insert([a.min(b), a.max(b)]);
            }
        }
        self.mid_edge_nodes.iter().filter(|found| boundary_edges.contains(&found.ends)).for_each(|found| {
            on_boundary[found.node as usize] = true;
        });
        for group in &mut self.groups {
            let mut is_in = vec![false; self.nodes.len()];
            group.nodes.iter().for_each(|&node| is_in[node as usize] = true);
            let is_flat = group.nodes.iter().all(|&node| on_boundary[node as usize]);
            let added = self.mid_edge_nodes.iter().filter(|found| {
                found.node >= first
                    && found.ends.iter().all(|&end| is_in[end as usize])
                    && (!is_flat || boundary_edges.contains(&found.ends))
            });
            group.nodes.extend(added.map(|found| found.node));
            group.nodes.sort_unstable();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives::{ball_mesh, box_mesh};
    use std::f64::consts::PI;

    /// A tetrahedron whose points are moved by a quadratic map, and the map.
    fn curved() -> (QuadraticTet, impl Fn(DVec3) -> DVec3) {
        let map = |p: DVec3| p + 0.2 * DVec3::new(p.y * p.z, p.x * p.x, p.x * p.y);
        let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
        let mut nodes = [DVec3::ZERO; 10];
        nodes[..4].copy_from_slice(&corners);
        EDGES.iter().zip(4..).for_each(|(&[a, b], at)| nodes[at] = (corners[a] + corners[b]) * 0.5);
        (QuadraticTet(nodes.map(map)), map)
    }

    #[test]
    fn the_image_of_a_quadratic_map_has_its_positions_jacobian_and_volume() {
        let (tet, map) = curved();
        let at = [0.1, 0.2, 0.3, 0.4];
        let point = DVec3::new(0.2, 0.3, 0.4);
        assert!((tet.position(at) - map(point)).length() < 1e-15);
        let exact = DMat3::from_cols(
            DVec3::new(1.0, 0.4 * point.x, 0.2 * point.y),
            DVec3::new(0.2 * point.z, 1.0, 0.2 * point.x),
            DVec3::new(0.2 * point.y, 0.0, 1.0),
        );
        assert!((tet.jacobian(at) - exact).to_cols_array().iter().all(|entry| entry.abs() < 1e-14));
        // det = 1 − 0.08·x·z − 0.04·y² + 0.016·x²·y by hand; over the unit tetrahedron ∫xz = 1/120, ∫y² = 1/60, ∫x²y = 1/360.
        let volume = 1.0 / 6.0 - 0.08 / 120.0 - 0.04 / 60.0 + 0.016 / 360.0;
        assert!((tet.volume() - volume).abs() < 1e-15, "{} {volume}", tet.volume());
        assert!(!tet.is_straight() && tet.is_positive());
    }

    #[test]
    fn curved_balls_fill_their_volume_with_the_fourth_order() {
        let missing = |layers: u32| {
            let mesh = ball_mesh(0.5, layers).expect("a good ball").checked().expect("a sound mesh");
            mesh.check_curved().expect("no fold");
            1.0 - mesh.tets.iter().map(|tet| mesh.quadratic_volume(tet)).sum::<f64>() / (PI / 6.0)
        };
        let order = (missing(3) / missing(6)).log2();
        assert!((order - 4.0).abs() < 0.2, "observed order {order}");
        assert!(missing(6).abs() < 2e-4, "{}", missing(6));
    }

    #[test]
    fn folded_elements_are_named() {
        let mut mesh = box_mesh([1.0; 3], [1; 3]).expect("a good box");
        mesh.add_mid_edge_nodes();
        assert!(!mesh.is_curved());
        mesh.check_curved().expect("straight elements");
        let found = mesh.mid_edge_nodes[0];
        mesh.nodes[found.node as usize] = mesh.nodes[found.ends[0] as usize];
        let error = mesh.check_curved().expect_err("a fold").to_string();
        assert!(
            error.starts_with("the mid-edge nodes of ") && error.contains("(first tetrahedron "),
            "{error}"
        );
    }

    #[test]
    fn groups_on_the_boundary_get_nodes_of_boundary_edges_only() {
        // Opposite edges of a tetrahedron beside another: the inner edges between them are no part of the group.
        let mut mesh = box_mesh([1.0; 3], [2; 3]).expect("a good box");
        let rim = |p: &DVec3| p.x.abs() > 0.4 && p.y.abs() > 0.4;
        let low = |p: &DVec3| p.x < -0.4;
        for (name, is_in) in [("rim", &rim as &dyn Fn(&DVec3) -> bool), ("low", &low)] {
            let nodes = (0_u32..).zip(&mesh.nodes).filter(|(_, p)| is_in(p)).map(|(at, _)| at).collect();
            mesh.groups.push(crate::NodeGroup { name: name.into(), nodes });
        }
        mesh.add_mid_edge_nodes();
        for (group, is_in) in mesh.groups.iter().zip([&rim as &dyn Fn(&DVec3) -> bool, &low]) {
            let expected: Vec<u32> =
                (0_u32..).zip(&mesh.nodes).filter(|(_, p)| is_in(p)).map(|(at, _)| at).collect();
            assert_eq!(group.nodes, expected, "{}", group.name);
        }
        assert_eq!(mesh.groups.iter().map(|group| group.nodes.len()).collect::<Vec<_>>(), [20, 25]);
    }
}
