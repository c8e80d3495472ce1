//! Sharp edges and corners of a surface, and the move of boundary nodes onto them: a lattice alone would chamfer them.

use super::smoothing::{Freedom, Stars};
use super::tree::SurfaceTree;
use super::walls::Walls;
use crate::surface_mesh::SurfaceMesh;
use glam::DVec3;
use std::collections::{BTreeMap, HashMap};

/// Cosine of the angle between the normals of two triangles, beyond which their edge is sharp: 40°, where a box has 90° and a ball of
/// 200 triangles 25°.
const SHARP: f64 = 0.766;

/// Distance that a node may go to a corner and to a sharp edge, in cells: nodes of a chamfer may be 0.7 from its edge.
const TO_CORNER: f64 = 0.8;
const TO_EDGE: f64 = 0.9;

/// Worst quality that a node may get by its move: smoothing comes after.
const LEAST_QUALITY: f64 = 0.12;

/// Sharp edges, in cells per area of a cell's face, beyond which a surface is rough everywhere, as one of voxels.
const ROUGH: f64 = 0.7;

/// Sharp edges and corners.
pub(super) struct Creases {
    /// Edges, as triangles without area.
    pub edges: SurfaceTree,
    /// Corners that no node has.
    corners: Vec<DVec3>,
    /// Length of the edges over the area of the surface [1/m].
    density: f64,
}

impl Creases {
    /// Creases of a welded surface; none if it has none.
    pub fn of(surface: &SurfaceMesh) -> Option<Self> {
        let normals: Vec<DVec3> =
            surface.corners().iter().map(|[a, b, c]| (*b - *a).cross(*c - *a) * 0.5).collect();
        let mut edges: HashMap<[u32; 2], Vec<u32>> = HashMap::new();
        for (number, &[a, b, c]) in (0..).zip(&surface.triangles) {
            for [from, to] in [[a, b], [b, c], [c, a]] {
                edges.entry([from.min(to), from.max(to)]).or_default().push(number);
            }
        }
        let unit = |triangle: u32| normals[triangle as usize].normalize_or_zero();
        let is_sharp = |own: &[u32]| matches!(own, &[a, b] if unit(a).dot(unit(b)) < SHARP);
        let mut sharp: Vec<[u32; 2]> =
            edges.into_iter().filter(|(_, own)| is_sharp(own)).map(|(edge, _)| edge).collect();
        sharp.sort_unstable();
        if sharp.is_empty() {
            return None;
        }
        let at = |node: u32| surface.positions[node as usize];
        let mut of_node: BTreeMap<u32, Vec<DVec3>> = BTreeMap::new();
        for &[a, b] in &sharp {
            let along = (at(b) - at(a)).normalize_or_zero();
            of_node.entry(a).or_default().push(along);
            of_node.entry(b).or_default().push(-along);
        }
        let is_corner = |ways: &[DVec3]| match ways {
            [_] => false,
            [a, b] => -a.dot(*b) < SHARP,
            _ => true,
        };
        let corners = of_node.iter().filter(|(_, ways)| is_corner(ways)).map(|(node, _)| at(*node)).collect();
        let length: f64 = sharp.iter().map(|[a, b]| (at(*b) - at(*a)).length()).sum();
        let area: f64 = normals.iter().map(|area| area.length()).sum();
        let segments = sharp.iter().map(|[a, b]| [at(*a), at(*b), at(*b)]).collect();
        Some(Self { edges: SurfaceTree::new(segments), corners, density: length / area })
    }

    /// Moves nodes onto corners and edges as far as their tetrahedra allow; returns their number.
    ///
    /// A corner takes the node nearby whose tetrahedra suffer least; edges take the nearest first.
    pub fn snap(&mut self, stars: &mut Stars, freedoms: &mut [Freedom], walls: &Walls) -> usize {
        let cell = walls.cell;
        if self.density * cell > ROUGH {
            return 0;
        }
        let mut moved = 0;
        self.corners.retain(|corner| {
            let is_near = |(node, freedom): &(u32, &Freedom)| {
                matches!(freedom, Freedom::OnSurface | Freedom::OnCrease)
                    && (stars.nodes[*node as usize] - *corner).length() < TO_CORNER * cell
            };
            let near = (0..).zip(freedoms.iter()).filter(is_near).map(|(node, _)| node);
            let near: Vec<u32> = near.filter(|&node| walls.are_at(node, *corner)).collect();
            let qualities = near.into_iter().map(|node| (stars.worst_at(node, *corner), node));
            let best = qualities.max_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)));
            let Some((_, node)) = best.filter(|(quality, _)| *quality > LEAST_QUALITY) else { return true };
            stars.nodes[node as usize] = *corner;
            freedoms[node as usize] = Freedom::Fixed;
            moved += 1;
            false
        });
        let mut moves: Vec<(f64, u32, DVec3)> = Vec::new();
        for (node, _) in (0..).zip(freedoms.iter()).filter(|(_, freedom)| **freedom == Freedom::OnSurface) {
            let (place, distance) = self.edges.closest(stars.nodes[node as usize]);
            if distance < TO_EDGE * cell && walls.are_at(node, place) {
                moves.push((distance, node, place));
            }
        }
        moves.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        for (_, node, place) in moves {
            if stars.worst_at(node, place) > LEAST_QUALITY {
                stars.nodes[node as usize] = place;
                freedoms[node as usize] = Freedom::OnCrease;
                moved += 1;
            }
        }
        moved
    }
}
