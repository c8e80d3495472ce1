//! Decimation: a surface between some of a surface's nodes (Schroeder, Zarge & Lorensen 1992, "Decimation of triangle meshes").
//!
//! The other nodes are removed, and the hole that each leaves is filled with the triangles that best keep the directions of those
//! removed and have the best shapes; the node whose hole is filled best goes first. A closed surface stays closed, and sharp edges
//! with samples are preserved. Then edges are flipped where that brings their middles nearer to the surface.
//!
//! Equations: docs/theory.md (C30).

use super::{SphereTree, Surface, area_normal, triangles_around};
use alloc::collections::BinaryHeap;
use alloc::vec;
use alloc::vec::Vec;
use core::cmp::Reverse;
use glam::DVec3;

/// Lower limit of the cosine between a triangle that fills a hole and the nearest of those removed [1]. A triangle that cuts off a cube's
/// corner evenly has 0.58.
const MIN_TURN_COSINE: f64 = 0.6;

/// Lower limit of the shape quality of a triangle that fills a hole [1]; 1 for an equilateral one.
const MIN_SHAPE: f64 = 0.02;

/// Lower limit of the distance by which a flip brings the middle of an edge nearer to the surface, as a share of the edge's length.
const MIN_GAIN: f64 = 1e-3;

/// Exponent of the turn's cosine in the quality of a triangle, relative to the shape.
const TURN_EXPONENT: i32 = 8;

/// Triangles between the nodes that stay; none where not all others can be removed.
pub(crate) fn decimate(surface: &Surface, nodes: &[u32]) -> Option<Vec<[u32; 3]>> {
    let around = triangles_around(surface);
    let mut is_left: Vec<bool> = around.iter().map(|triangles| !triangles.is_empty()).collect();
    nodes.iter().for_each(|&node| is_left[node as usize] = false);
    let mut mesh =
        DecimatedMesh { positions: &surface.positions, triangles: surface.triangles.clone(), around };
    loop {
        let left: Vec<u32> = (0..is_left.len() as u32).filter(|&node| is_left[node as usize]).collect();
        if left.is_empty() {
            break;
        }
        // A hole elsewhere may have opened the way for the nodes that are left.
        if !mesh.remove_best_first(&left, &mut is_left) {
            return None;
        }
    }
    let tree = SphereTree::new(&surface.positions, &surface.triangles);
    mesh.flip_edges(|point| tree.distance((&surface.positions, &surface.triangles), point, 0.0));
    mesh.triangles.retain(|corners| *corners != REMOVED);
    Some(mesh.triangles)
}

/// Corners of a removed triangle.
const REMOVED: [u32; 3] = [u32::MAX; 3];

/// Surface during decimation.
struct DecimatedMesh<'a> {
    positions: &'a [DVec3],
    triangles: Vec<[u32; 3]>,
    around: Vec<Vec<u32>>,
}

/// Triangles that fill a hole, with the lowest of their qualities [1].
struct Filling {
    quality: f64,
    triangles: Vec<[u32; 3]>,
}

impl DecimatedMesh<'_> {
    /// Remove nodes, in each step the one whose hole is filled best. Gives whether one could be removed.
    fn remove_best_first(&mut self, nodes: &[u32], is_left: &mut [bool]) -> bool {
        // Positive numbers have the order of their bits.
        let entry = |mesh: &Self, node: u32| {
            mesh.filling(node, &mesh.ring(node)).map(|filling| (filling.quality.to_bits(), Reverse(node)))
        };
        let mut queue: BinaryHeap<_> = nodes.iter().filter_map(|&node| entry(self, node)).collect();
        let mut has_removed = false;
        while let Some((expected, Reverse(node))) = queue.pop() {
            if !is_left[node as usize] {
                continue;
            }
            let ring = self.ring(node);
            let Some(filling) = self.filling(node, &ring) else { continue };
            // The triangles around it have changed since: with each change of its ring it was entered again.
            if filling.quality.to_bits() != expected {
                continue;
            }
            self.fill(node, &filling.triangles);
            (is_left[node as usize], has_removed) = (false, true);
            let changed = ring.iter().filter(|other| is_left[**other as usize]);
            queue.extend(changed.filter_map(|&other| entry(self, other)));
        }
        has_removed
    }

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

    /// Best filling of the hole that a node within a ring leaves, by dynamic programming over the ring (Klincsek 1980); none where there
    /// is none without folds.
    fn filling(&self, node: u32, ring: &[u32]) -> Option<Filling> {
        let count = ring.len();
        let is_tetrahedron =
            || self.has_triangle(ring[0], |corners| ring[1..].iter().all(|other| corners.contains(other)));
        if count < 3 || count == 3 && is_tetrahedron() {
            return None;
        }
        let normal = |t: &u32| self.area_normal(self.triangles[*t as usize]).normalize_or_zero();
        let removed: Vec<DVec3> = self.around[node as usize].iter().map(normal).collect();
        // Lowest quality in the part of the hole between two nodes of the ring, and the third corner of the triangle at their side.
        let mut parts = vec![(0.0_f64, 0); count * count];
        (1..count).for_each(|j| parts[(j - 1) * count + j].0 = f64::INFINITY);
        for span in 2..count {
            for i in 0..count - span {
                let j = i + span;
                if span + 1 < count && self.is_edge(ring[i], ring[j]) {
                    continue;
                }
                let mut best = (0.0_f64, 0);
                for k in (i + 1..j).rev() {
                    let beside = parts[i * count + k].0.min(parts[k * count + j].0);
                    if beside > best.0 {
                        let quality = self.quality([ring[i], ring[k], ring[j]], &removed).min(beside);
                        if quality > best.0 {
                            best = (quality, k);
                        }
                    }
                }
                parts[i * count + j] = best;
            }
        }
        let quality = parts[count - 1].0;
        if quality == 0.0 {
            return None;
        }
        let (mut triangles, mut open) = (Vec::with_capacity(count - 2), vec![(0, count - 1)]);
        while let Some((i, j)) = open.pop() {
            if j - i > 1 {
                let k = parts[i * count + j].1;
                triangles.push([ring[i], ring[k], ring[j]]);
                open.extend([(i, k), (k, j)]);
            }
        }
        Some(Filling { quality, triangles })
    }

    /// Quality of a triangle that replaces others with these unit normals [1]; 0 where it is folded or too narrow.
    fn quality(&self, corners: [u32; 3], removed: &[DVec3]) -> f64 {
        let area = self.area_normal(corners);
        let [a, b, c] = corners.map(|node| self.positions[node as usize]);
        let sides = (a - b).length_squared() + (b - c).length_squared() + (c - a).length_squared();
        let shape = libm::sqrt(12.0) * area.length() / sides;
        let normal = area.normalize_or_zero();
        let turn = removed.iter().map(|other| normal.dot(*other)).fold(-1.0, f64::max);
        if turn < MIN_TURN_COSINE || shape < MIN_SHAPE {
            return 0.0;
        }
        libm::pow(turn, f64::from(TURN_EXPONENT)) * shape
    }

    /// Fill the hole that a node leaves.
    fn fill(&mut self, node: u32, filling: &[[u32; 3]]) {
        let free = core::mem::take(&mut self.around[node as usize]);
        for &t in &free {
            for corner in core::mem::replace(&mut self.triangles[t as usize], REMOVED) {
                self.around[corner as usize].retain(|other| *other != t);
            }
        }
        for (t, corners) in free.into_iter().zip(filling) {
            self.triangles[t as usize] = *corners;
            corners.iter().for_each(|corner| self.around[*corner as usize].push(t));
        }
    }

    /// Flip edges whose middle is farther from the surface, by a distance [m], than the middle of the edge across them would be.
    fn flip_edges(&mut self, distance: impl Fn(DVec3) -> f64) {
        let mut has_flipped = true;
        // Each flip lowers the sum of the distances.
        while core::mem::take(&mut has_flipped) {
            for t in 0..self.triangles.len() {
                for side in 0..3 {
                    has_flipped |= self.flip_edge(t, side, &distance);
                }
            }
        }
    }

    /// Flip one side of a triangle if that brings its middle nearer to the surface. Gives whether it has.
    fn flip_edge(&mut self, t: usize, side: usize, distance: &impl Fn(DVec3) -> f64) -> bool {
        let corners = self.triangles[t];
        let [a, b, c] = [0, 1, 2].map(|k| corners[(side + k) % 3]);
        // Each edge once: from the lower of its nodes. Removed triangles have one node only.
        if a >= b {
            return false;
        }
        let has_side = |&&other: &&u32| {
            let corners = self.triangles[other as usize];
            (0..3).any(|k| (corners[k], corners[(k + 1) % 3]) == (b, a))
        };
        let Some(&other) = self.around[a as usize].iter().find(has_side) else { return false };
        let beyond = self.triangles[other as usize];
        let Some(d) = beyond.into_iter().find(|node| ![a, b].contains(node)) else { return false };
        let [from, to] = [a, b].map(|node| self.positions[node as usize]);
        let middle = |a: u32, b: u32| 0.5 * (self.positions[a as usize] + self.positions[b as usize]);
        let (now, gain) = (distance(middle(a, b)), MIN_GAIN * (to - from).length());
        if now <= gain || self.is_edge(c, d) {
            return false;
        }
        let removed = [corners, beyond].map(|of| self.area_normal(of).normalize_or_zero());
        let flipped = [[a, d, c], [d, b, c]];
        let is_sound = flipped.iter().all(|of| self.quality(*of, &removed) > 0.0);
        if !is_sound || distance(middle(c, d)) > now - gain {
            return false;
        }
        [self.triangles[t], self.triangles[other as usize]] = flipped;
        self.around[a as usize].retain(|of| *of != other);
        self.around[b as usize].retain(|of| *of as usize != t);
        self.around[c as usize].push(other);
        self.around[d as usize].push(t as u32);
        true
    }

    fn is_edge(&self, a: u32, b: u32) -> bool {
        self.has_triangle(a, |corners| corners.contains(&b))
    }

    fn has_triangle(&self, node: u32, is_it: impl Fn(&[u32; 3]) -> bool) -> bool {
        self.around[node as usize].iter().any(|t| is_it(&self.triangles[*t as usize]))
    }

    fn area_normal(&self, corners: [u32; 3]) -> DVec3 {
        area_normal(corners.map(|node| self.positions[node as usize]))
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
        let widths = [1.0, 1.2, 1.45, 1.75, 2.1, 2.5, 3.0, 3.6, 4.5];
        for (surface, finest) in [(&block, 0.02), (&ball(4), 0.15)] {
            for spacing in widths.map(|width| width * finest) {
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
