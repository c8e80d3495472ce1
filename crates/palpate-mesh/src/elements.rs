//! Elements of a file on their way to tetrahedra: counts, corner nodes, and the split of other solids.
//!
//! A pyramid, wedge or hexahedron is pulled at its corner with the smallest node number: that corner makes a tetrahedron with each
//! triangle of the faces that it is not on, and these faces are cut along the diagonal from their own smallest node. Both neighbours of a
//! face so cut it along one diagonal, and the mesh is conforming.
//!
//! Reference: Dompierre, Labbé, Vallet, Camarero, How to Subdivide Pyramids, Prisms and Hexahedra into Tetrahedra (1999).

use crate::faces::{EDGES, tet_volume};
use crate::mid_edge::unique_mid_edge_nodes;
use crate::scan::regions;
use crate::volume_mesh::{Mesh, MidEdgeNode, NodeGroup, VolumeFile};
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Shape of an element, whatever its order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Shape {
    Point,
    Line,
    Triangle,
    Quadrilateral,
    /// A face or an edge of any other kind.
    OtherFlat,
    Tetrahedron,
    Hexahedron,
    Wedge,
    Pyramid,
}

impl Shape {
    pub fn dimension(self) -> u8 {
        match self {
            Self::Point => 0,
            Self::Line => 1,
            Self::Triangle | Self::Quadrilateral | Self::OtherFlat => 2,
            Self::Tetrahedron | Self::Hexahedron | Self::Wedge | Self::Pyramid => 3,
        }
    }

    /// The shape's plural.
    pub fn name(self) -> &'static str {
        match self {
            Self::Point => "points",
            Self::Line => "lines",
            Self::Triangle => "triangles",
            Self::Quadrilateral => "quadrilaterals",
            Self::OtherFlat => "other faces and edges",
            Self::Tetrahedron => "tetrahedra",
            Self::Hexahedron => "hexahedra",
            Self::Wedge => "wedges",
            Self::Pyramid => "pyramids",
        }
    }

    /// Number of corners of a solid.
    pub fn corners(self) -> usize {
        match self {
            Self::Tetrahedron => 4,
            Self::Pyramid => 5,
            Self::Wedge => 6,
            Self::Hexahedron => 8,
            _ => 0,
        }
    }

    /// Faces of a solid that is split, by its corners.
    fn faces(self) -> &'static [&'static [usize]] {
        match self {
            Self::Pyramid => &[&[0, 3, 2, 1], &[0, 1, 4], &[1, 2, 4], &[2, 3, 4], &[3, 0, 4]],
            Self::Wedge => &[&[0, 2, 1], &[3, 4, 5], &[0, 1, 4, 3], &[0, 3, 5, 2], &[1, 2, 5, 4]],
            Self::Hexahedron => {
                &[&[0, 3, 2, 1], &[0, 1, 5, 4], &[0, 4, 7, 3], &[1, 2, 6, 5], &[2, 3, 7, 6], &[4, 5, 6, 7]]
            }
            _ => &[],
        }
    }
}

/// Solids of a file with their corners, and counts of all its elements.
#[derive(Debug, Default)]
pub(crate) struct Elements {
    shapes: Vec<Shape>,
    /// Corners of the solids, one after another.
    corners: Vec<u32>,
    /// Number of each solid, as the reader counts.
    owners: Vec<u32>,
    counts: BTreeMap<Shape, usize>,
    /// Nodes on the edges of tetrahedra of ten nodes.
    mid_edge_nodes: Vec<MidEdgeNode>,
    /// Number of other solids with more nodes than corners.
    higher_order: usize,
    mid_side_nodes: Vec<u32>,
}

impl Elements {
    /// Number of solids.
    pub fn len(&self) -> usize {
        self.shapes.len()
    }

    /// Number of elements that are no solids.
    pub fn flat(&self) -> usize {
        self.counts.iter().filter(|(shape, _)| shape.dimension() < 3).map(|(_, count)| count).sum()
    }

    /// Room for this many more tetrahedra.
    pub fn reserve(&mut self, more: usize) {
        self.shapes.reserve(more);
        self.corners.reserve(4 * more);
        self.owners.reserve(more);
    }

    /// Counts an element that is no solid.
    pub fn count(&mut self, shape: Shape) {
        *self.counts.entry(shape).or_default() += 1;
    }

    /// Adds a solid with its corners first, and those of ten nodes on the edges 01, 12, 02, 03, 13, 23; false if it has too few nodes.
    /// `owner` is its number.
    pub fn add(&mut self, shape: Shape, nodes: &[u32], owner: u32) -> bool {
        let Some((corners, others)) = nodes.split_at_checked(shape.corners()) else { return false };
        self.count(shape);
        match others {
            [] => {}
            &[_, _, _, _, _, _] if shape == Shape::Tetrahedron => {
                let node = |(&node, [a, b]): (&u32, [usize; 2])| {
                    let [a, b] = [corners[a], corners[b]];
                    MidEdgeNode { ends: [a.min(b), a.max(b)], node }
                };
                self.mid_edge_nodes.extend(others.iter().zip(EDGES).map(node));
            }
            _ => {
                self.higher_order += 1;
                self.mid_side_nodes.extend(others);
            }
        }
        self.shapes.push(shape);
        self.corners.extend(corners);
        self.owners.push(owner);
        true
    }

    /// Keeps the solids for which `keep(corners, owner)` holds.
    pub fn retain(&mut self, mut keep: impl FnMut(&[u32], u32) -> bool) {
        let mut all = std::mem::take(self);
        let mut rest = all.corners.as_slice();
        for (&shape, &owner) in all.shapes.iter().zip(&all.owners) {
            let (corners, after) = rest.split_at(shape.corners());
            rest = after;
            if keep(corners, owner) {
                self.shapes.push(shape);
                self.corners.extend(corners);
                self.owners.push(owner);
                self.count(shape);
            }
        }
        all.counts.retain(|shape, _| shape.dimension() < 3);
        self.counts.append(&mut all.counts);
        (self.higher_order, self.mid_side_nodes) = (all.higher_order, all.mid_side_nodes);
        self.mid_edge_nodes = all.mid_edge_nodes;
    }

    /// Mesh of these elements; `tag` is the region of an element, `name` that of a region.
    pub fn into_file(
        self,
        format: String,
        nodes: Vec<DVec3>,
        groups: Vec<NodeGroup>,
        tag: impl Fn(u32) -> i64,
        name: impl Fn(i64) -> Option<String>,
    ) -> VolumeFile {
        let mut warnings = Vec::new();
        let is_split = self.shapes.iter().any(|shape| *shape != Shape::Tetrahedron);
        let (tets, tags) = if is_split {
            let (tets, tags) = self.split(&nodes, tag);
            let solids = [Shape::Hexahedron, Shape::Wedge, Shape::Pyramid].into_iter();
            let split: Vec<_> = solids
                .filter_map(|shape| self.counts.get(&shape).map(|n| format!("{} ({n})", shape.name())))
                .collect();
            let own = self.counts.get(&Shape::Tetrahedron).copied().unwrap_or(0);
            warnings.push(format!("{} were split into {} tetrahedra", split.join(", "), tets.len() - own));
            (tets, tags)
        } else {
            let tets = self.corners.chunks_exact(4).map(|tet| [tet[0], tet[1], tet[2], tet[3]]).collect();
            (tets, self.owners.iter().map(|&owner| tag(owner)).collect())
        };
        let (mut mid_side_nodes, mut mid_edge_nodes) = (self.mid_side_nodes, self.mid_edge_nodes);
        if self.higher_order > 0 || !mid_edge_nodes.is_empty() {
            let mut is_used = vec![false; nodes.len()];
            self.corners.iter().for_each(|&node| is_used[node as usize] = true);
            let unusable;
            (mid_edge_nodes, unusable) = unique_mid_edge_nodes(mid_edge_nodes, &is_used);
            mid_edge_nodes.iter().for_each(|found| is_used[found.node as usize] = true);
            if !unusable.is_empty() {
                warnings.push(format!(
                    "{} nodes on edges are a corner, the node of another edge or the second one of theirs: these edges are taken straight",
                    unusable.len()
                ));
                mid_side_nodes.extend(unusable);
            }
            mid_side_nodes.retain(|&node| !is_used[node as usize]);
            mid_side_nodes.sort_unstable();
            mid_side_nodes.dedup();
        }
        if self.higher_order > 0 {
            warnings.push(format!(
                "{} elements are of third or higher order, or quadratic and split: only their corner nodes are used and their edges are \
                 taken straight; their {} other nodes are left out",
                self.higher_order,
                mid_side_nodes.len()
            ));
        }
        let (regions, tet_regions) = regions(&tags, name);
        let elements = self.counts.into_iter().map(|(shape, count)| (shape.name(), count)).collect();
        let mesh = Mesh {
            nodes,
            tets,
            tet_regions,
            regions,
            groups,
            mid_edge_nodes,
            mid_side_nodes,
            is_unit_asked: false,
            warnings,
        };
        VolumeFile { format, elements, mesh }
    }

    /// All solids as tetrahedra, with the tags of each.
    fn split(&self, nodes: &[DVec3], tag: impl Fn(u32) -> i64) -> (Vec<[u32; 4]>, Vec<i64>) {
        // Nodes at one position count as one, so that neighbours that share none are cut alike and can be joined.
        let mut first_at = HashMap::with_capacity(nodes.len());
        let ranks: Vec<u32> = (0..)
            .zip(nodes)
            .map(|(node, position)| {
                let key = (*position + DVec3::ZERO).to_array().map(f64::to_bits);
                *first_at.entry(key).or_insert(node)
            })
            .collect();
        let (mut tets, mut tags) = (Vec::new(), Vec::new());
        let mut rest = self.corners.as_slice();
        for (&shape, &owner) in self.shapes.iter().zip(&self.owners) {
            let (corners, after) = rest.split_at(shape.corners());
            rest = after;
            let first = tets.len();
            match corners.first_chunk() {
                Some(&tet) if shape == Shape::Tetrahedron => tets.push(tet),
                _ => {
                    split_solid(shape, corners, &ranks, &mut tets);
                    // Formats differ in the orientation of wedges, so parts are oriented without a warning.
                    for tet in &mut tets[first..] {
                        if tet_volume(nodes, tet) < 0.0 {
                            tet.swap(2, 3);
                        }
                    }
                }
            }
            tags.resize(tets.len(), tag(owner));
        }
        (tets, tags)
    }
}

/// Tetrahedra of a solid. Those that repeat a node are left out: a solid with repeated corners is a smaller one.
fn split_solid(shape: Shape, corners: &[u32], ranks: &[u32], tets: &mut Vec<[u32; 4]>) {
    let rank = |node: u32| ranks[node as usize];
    let lowest = corners.iter().copied().min_by_key(|&node| rank(node)).unwrap_or(0);
    for face in shape.faces() {
        let mut nodes = [0; 4];
        let nodes = &mut nodes[..face.len()];
        nodes.iter_mut().zip(*face).for_each(|(node, &corner)| *node = corners[corner]);
        if nodes.contains(&lowest) {
            continue;
        }
        let smallest = (0..nodes.len()).min_by_key(|&at| rank(nodes[at])).unwrap_or(0);
        nodes.rotate_left(smallest);
        for pair in nodes[1..].windows(2) {
            let (a, b, c) = (nodes[0], pair[0], pair[1]);
            if a != b && b != c && c != a {
                tets.push([lowest, a, b, c]);
            }
        }
    }
}
