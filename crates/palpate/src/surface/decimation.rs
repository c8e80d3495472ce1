//! Decimation: a surface between some of a surface's nodes, by edge collapse.
//!
//! The other nodes are merged into a neighbour, one after the other: the one for which the surrounding triangles best keep
//! their directions and shapes. A closed surface stays closed, and sharp edges with samples are preserved.
//!
//! Equations: docs/theory.md (C30).

use super::{Surface, area_normal, triangles_around};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Lower limit of the cosine by which a collapse turns a triangle [1].
const MIN_TURN_COSINE: f64 = 0.3;

/// Lower limit of a triangle's shape quality after a collapse [1]; 1 for an equilateral one.
const MIN_SHAPE: f64 = 0.02;

/// Exponent of the turn's cosine in the quality of a collapse, relative to the shape.
const TURN_EXPONENT: i32 = 8;

/// Triangles between the nodes that stay; none where not all others can be collapsed.
pub(crate) fn decimate(surface: &Surface, nodes: &[u32]) -> Option<Vec<[u32; 3]>> {
    let mut stays = vec![false; surface.positions.len()];
    nodes.iter().for_each(|&node| stays[node as usize] = true);
    let mut mesh = CollapsingMesh {
        positions: &surface.positions,
        triangles: surface.triangles.clone(),
        around: triangles_around(surface),
    };
    let is_used = |node: &u32| !mesh.around[*node as usize].is_empty();
    let mut left: Vec<u32> =
        (0..stays.len() as u32).filter(|n| !stays[*n as usize]).filter(is_used).collect();
    // One node of a neighbourhood in a pass, for even triangles.
    let mut waits = vec![0; stays.len()];
    let mut pass = 0;
    while !left.is_empty() {
        pass += 1;
        let before = left.len();
        left.retain(|&node| {
            if waits[node as usize] == pass {
                return true;
            }
            let ring = mesh.ring(node);
            let merged = mesh.collapse(node, &ring);
            if merged {
                ring.iter().for_each(|&other| waits[other as usize] = pass);
            }
            !merged
        });
        if left.len() == before {
            return None;
        }
    }
    let whole = (0..mesh.triangles.len()).filter(|&t| mesh.triangles[t] != REMOVED);
    Some(whole.map(|t| mesh.triangles[t]).collect())
}

/// Corners of a removed triangle.
const REMOVED: [u32; 3] = [u32::MAX; 3];

/// Surface during decimation.
struct CollapsingMesh<'a> {
    positions: &'a [DVec3],
    triangles: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
}

impl CollapsingMesh<'_> {
    /// Nodes around a node in order; none where the triangles around it are no fan.
    fn ring(&self, node: u32) -> Vec<u32> {
        let own = &self.around[node as usize];
        let side = |t: &u32| {
            let corners = self.triangles[*t as usize];
            let at = corners.iter().position(|c| *c == node).unwrap_or_default();
            (corners[(at + 1) % 3], corners[(at + 2) % 3])
        };
        let sides: Vec<(u32, u32)> = own.iter().map(side).collect();
        let Some(&(first, mut next)) = sides.first() else { return Vec::new() };
        let mut ring = vec![first];
        while next != first && ring.len() < sides.len() {
            ring.push(next);
            let mut on = sides.iter().filter(|(from, _)| *from == next);
            match (on.next(), on.next()) {
                (Some(&(_, to)), None) => next = to,
                _ => return Vec::new(),
            }
        }
        if next == first && ring.len() == sides.len() { ring } else { Vec::new() }
    }

    /// Collapse the best edge of a node. Gives whether there is one.
    fn collapse(&mut self, node: u32, ring: &[u32]) -> bool {
        let quality = |&into: &u32| self.collapse_quality(node, into, ring);
        let best = ring.iter().filter_map(|into| quality(into).map(|quality| (quality, *into)));
        let Some((_, into)) = best.max_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        for t in core::mem::take(&mut self.around[node as usize]) {
            let corners = &mut self.triangles[t as usize];
            if corners.contains(&into) {
                for corner in core::mem::replace(corners, REMOVED) {
                    self.around[corner as usize].retain(|other| *other != t);
                }
            } else {
                corners.iter_mut().filter(|corner| **corner == node).for_each(|corner| *corner = into);
                self.around[into as usize].push(t);
            }
        }
        true
    }

    /// Quality of the collapse of a node into one of its ring; none where it is not possible.
    fn collapse_quality(&self, node: u32, into: u32, ring: &[u32]) -> Option<f64> {
        // Link condition: the two nodes have exactly two common neighbours.
        let beside = |other: &&u32| {
            **other != into
                && self.around[**other as usize].iter().any(|t| self.triangles[*t as usize].contains(&into))
        };
        if ring.iter().filter(beside).count() != 2 {
            return None;
        }
        let mut least = f64::INFINITY;
        for t in &self.around[node as usize] {
            let corners = self.triangles[*t as usize];
            if corners.contains(&into) {
                continue;
            }
            let moved = corners.map(|corner| if corner == node { into } else { corner });
            let area = |of: [u32; 3]| area_normal(of.map(|n| self.positions[n as usize]));
            let (before, after) = (area(corners), area(moved));
            let turn = before.normalize_or_zero().dot(after.normalize_or_zero());
            let [a, b, c] = moved.map(|n| self.positions[n as usize]);
            let sides = (a - b).length_squared() + (b - c).length_squared() + (c - a).length_squared();
            let shape = libm::sqrt(12.0) * after.length() / sides;
            if turn < MIN_TURN_COSINE || shape < MIN_SHAPE {
                return None;
            }
            least = least.min(libm::pow(turn, f64::from(TURN_EXPONENT)) * shape);
        }
        Some(least)
    }
}

#[cfg(test)]
mod tests {
    use super::super::poisson_disk_sample;
    use super::super::test_surfaces::{ball, cut_in_four, sheet};
    use super::*;
    use alloc::collections::BTreeMap;

    fn block() -> Surface {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        cut_in_four(&cut_in_four(
            &crate::recording::Recording::from_bytes(bytes).expect("a released recording").surface,
        ))
    }

    fn volume(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
        let six = |t: &[u32; 3]| {
            let [a, b, c] = t.map(|n| positions[n as usize]);
            a.dot(b.cross(c))
        };
        triangles.iter().map(six).sum::<f64>() / 6.0
    }

    #[test]
    fn a_closed_surface_stays_closed_and_keeps_its_sides() {
        let block = block();
        let whole = volume(&block.positions, &block.triangles);
        for (surface, spacings) in [(&block, [0.02, 0.035, 0.06, 0.09]), (&ball(4), [0.15, 0.25, 0.4, 0.6])] {
            for spacing in spacings {
                let nodes = poisson_disk_sample(surface, spacing);
                let triangles = decimate(surface, &nodes).expect("a surface");
                let mut sides = BTreeMap::new();
                for [a, b, c] in &triangles {
                    for side in [(a, b), (b, c), (c, a)] {
                        assert!(sides.insert(side, ()).is_none(), "side occurs twice: {spacing}");
                    }
                }
                assert!(sides.keys().all(|(a, b)| sides.contains_key(&(*b, *a))), "closed: {spacing}");
                let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), nodes.len(), "{spacing}");
                // Euler: one piece, without holes.
                assert_eq!(used.len() + triangles.len(), sides.len() / 2 + 2, "{spacing}");
                let left = volume(&surface.positions, &triangles);
                if surface.positions.len() == block.positions.len() {
                    assert!((left - whole).abs() < 1e-9 * whole, "flat sides, straight edges: {spacing}");
                } else {
                    // Chords: between samples at distance d the surface of a unit ball recedes by about d²/8.
                    let ball = 4.0 / 3.0 * core::f64::consts::PI;
                    let sunk = 1.0 - left / ball;
                    assert!(sunk > 0.0 && sunk < 3.0 * (1.6 * spacing).powi(2) / 6.0, "{spacing}: {sunk}");
                }
            }
        }
    }

    #[test]
    fn a_sheet_of_no_thickness_has_no_decimated_surface() {
        let sheet = sheet();
        assert!(decimate(&sheet, &poisson_disk_sample(&sheet, 2.0)).is_none());
    }
}
