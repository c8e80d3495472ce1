//! A coarser surface between some of a surface's nodes.
//!
//! The other nodes are merged, one after the other, into a neighbour: the one for which the triangles around keep their
//! directions and get good shapes. So a closed surface stays closed, and edges stay where nodes stand on them.

use super::{Surface, area_normal, triangles_around};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// A triangle may not turn by more than this cosine when one of its nodes is merged into another, nor get a worse shape,
/// where an equilateral one has 1.
const TURNS: f64 = 0.3;
const SLENDER: f64 = 0.02;

/// How much more a triangle's direction counts than its shape.
const STRAIGHT: i32 = 8;

/// Triangles between the nodes that stay; none where the surface does not let all others go.
pub(crate) fn decimate(surface: &Surface, nodes: &[u32]) -> Option<Vec<[u32; 3]>> {
    let mut stays = vec![false; surface.positions.len()];
    nodes.iter().for_each(|&node| stays[node as usize] = true);
    let mut coarse = Coarse {
        positions: &surface.positions,
        triangles: surface.triangles.clone(),
        around: triangles_around(surface),
    };
    let is_used = |node: &u32| !coarse.around[*node as usize].is_empty();
    let mut left: Vec<u32> =
        (0..stays.len() as u32).filter(|n| !stays[*n as usize]).filter(is_used).collect();
    // Evenly: of neighbours only one a pass.
    let mut waits = vec![0; stays.len()];
    let mut pass = 0;
    while !left.is_empty() {
        pass += 1;
        let before = left.len();
        left.retain(|&node| {
            if waits[node as usize] == pass {
                return true;
            }
            let ring = coarse.ring(node);
            let merged = coarse.merge(node, &ring);
            if merged {
                ring.iter().for_each(|&other| waits[other as usize] = pass);
            }
            !merged
        });
        if left.len() == before {
            return None;
        }
    }
    let whole = (0..coarse.triangles.len()).filter(|&t| coarse.triangles[t] != GONE);
    Some(whole.map(|t| coarse.triangles[t]).collect())
}

/// A triangle that is no more.
const GONE: [u32; 3] = [u32::MAX; 3];

/// A surface that gets coarser.
struct Coarse<'a> {
    positions: &'a [DVec3],
    triangles: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
}

impl Coarse<'_> {
    /// The nodes around a node, one after the other; none where the triangles around it are no fan.
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

    /// Merge a node into the best one of its ring; says whether there is one.
    fn merge(&mut self, node: u32, ring: &[u32]) -> bool {
        let worth = |&into: &u32| self.worth(node, into, ring);
        let best = ring.iter().filter_map(|into| worth(into).map(|worth| (worth, *into)));
        let Some((_, into)) = best.max_by(|a, b| a.0.total_cmp(&b.0)) else { return false };
        for t in core::mem::take(&mut self.around[node as usize]) {
            let corners = &mut self.triangles[t as usize];
            if corners.contains(&into) {
                for corner in core::mem::replace(corners, GONE) {
                    self.around[corner as usize].retain(|other| *other != t);
                }
            } else {
                corners.iter_mut().filter(|corner| **corner == node).for_each(|corner| *corner = into);
                self.around[into as usize].push(t);
            }
        }
        true
    }

    /// What it is worth to merge a node into one of its ring; none where that is not possible.
    fn worth(&self, node: u32, into: u32, ring: &[u32]) -> Option<f64> {
        // Both have two neighbours in common, else the surface would fold together.
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
            if turn < TURNS || shape < SLENDER {
                return None;
            }
            least = least.min(libm::pow(turn, f64::from(STRAIGHT)) * shape);
        }
        Some(least)
    }
}

#[cfg(test)]
mod tests {
    use super::super::poisson_disk_sample;
    use super::*;
    use alloc::collections::BTreeMap;

    fn block() -> Surface {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        cut_in_four(&cut_in_four(
            &crate::recording::Recording::from_bytes(bytes).expect("a released recording").surface,
        ))
    }

    /// Every triangle cut in four.
    fn cut_in_four(surface: &Surface) -> Surface {
        let mut positions = surface.positions.clone();
        let mut middles = BTreeMap::new();
        let mut triangles = Vec::new();
        for &[a, b, c] in &surface.triangles {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]) * 0.5);
                    positions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        Surface { source_nodes: (0..positions.len() as u32).collect(), positions, triangles }
    }

    fn ball() -> Surface {
        let (a, b) = (DVec3::X, DVec3::Y);
        let positions = vec![a, b, -a, -b, DVec3::Z, -DVec3::Z];
        let upper = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
        let lower = upper.map(|[i, j, _]: [u32; 3]| [j, i, 5]);
        let mut ball =
            Surface { source_nodes: (0..6).collect(), positions, triangles: [upper, lower].concat() };
        for _ in 0..4 {
            ball = cut_in_four(&ball);
            ball.positions.iter_mut().for_each(|p| *p = p.normalize());
        }
        ball
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
        for (surface, aparts) in [(&block, [0.02, 0.035, 0.06, 0.09]), (&ball(), [0.15, 0.25, 0.4, 0.6])] {
            for apart in aparts {
                let nodes = poisson_disk_sample(surface, apart);
                let triangles = decimate(surface, &nodes).expect("a surface");
                let mut sides = BTreeMap::new();
                for [a, b, c] in &triangles {
                    for side in [(a, b), (b, c), (c, a)] {
                        assert!(sides.insert(side, ()).is_none(), "twice the same side: {apart}");
                    }
                }
                assert!(sides.keys().all(|(a, b)| sides.contains_key(&(*b, *a))), "closed: {apart}");
                let mut used: Vec<u32> = triangles.iter().flatten().copied().collect();
                used.sort_unstable();
                used.dedup();
                assert_eq!(used.len(), nodes.len(), "{apart}");
                // Euler: one piece, without holes.
                assert_eq!(used.len() + triangles.len(), sides.len() / 2 + 2, "{apart}");
                let left = volume(&surface.positions, &triangles);
                if surface.positions.len() == block.positions.len() {
                    assert!((left - whole).abs() < 1e-9 * whole, "flat sides, straight edges: {apart}");
                } else {
                    // Chords: between places d apart a ball of radius 1 sinks by some d²/8 on each of its sides.
                    let ball = 4.0 / 3.0 * core::f64::consts::PI;
                    let sunk = 1.0 - left / ball;
                    assert!(sunk > 0.0 && sunk < 3.0 * (1.6 * apart).powi(2) / 6.0, "{apart}: {sunk}");
                }
            }
        }
    }

    #[test]
    fn a_sheet_of_no_thickness_has_no_coarser_surface() {
        let positions: Vec<DVec3> =
            (0..25).map(|k| DVec3::new(f64::from(k % 5), f64::from(k / 5), 0.0)).collect();
        let cells = (0..16_u32).map(|k| k % 4 + k / 4 * 5);
        let front = cells.flat_map(|i| [[i, i + 1, i + 6], [i, i + 6, i + 5]]);
        let triangles: Vec<[u32; 3]> = front.flat_map(|[a, b, c]| [[a, b, c], [a, c, b]]).collect();
        let sheet = Surface { source_nodes: (0..25).collect(), positions, triangles };
        assert!(decimate(&sheet, &poisson_disk_sample(&sheet, 2.0)).is_none());
    }
}
