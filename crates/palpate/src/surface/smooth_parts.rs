//! Smooth parts of a surface: its triangles between creases.

use super::patch_weights::area_vector;
use super::{EDGE_COSINE, Surface};
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Number of the smooth part of every triangle: neighbours belong together unless a crease lies between them.
pub(super) fn smooth_parts(surface: &Surface) -> Vec<u32> {
    const NONE: u32 = u32::MAX;
    let normals: Vec<DVec3> =
        (0..surface.triangles.len()).map(|t| area_vector(surface, t).normalize_or_zero()).collect();
    let mut sides: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    let ends = |[a, b, c]: [u32; 3]| [[a.min(b), a.max(b)], [b.min(c), b.max(c)], [c.min(a), c.max(a)]];
    for (t, corners) in surface.triangles.iter().enumerate() {
        ends(*corners).into_iter().for_each(|side| sides.entry(side).or_default().push(t as u32));
    }
    let mut parts = vec![NONE; normals.len()];
    let (mut count, mut queue) = (0, Vec::new());
    for first in 0..normals.len() {
        if parts[first] != NONE {
            continue;
        }
        parts[first] = count;
        queue.push(first);
        while let Some(t) = queue.pop() {
            for side in ends(surface.triangles[t]) {
                for &next in &sides[&side] {
                    let next = next as usize;
                    if parts[next] == NONE && normals[t].dot(normals[next]) > EDGE_COSINE {
                        parts[next] = count;
                        queue.push(next);
                    }
                }
            }
        }
        count += 1;
    }
    parts
}

impl Surface {
    /// Number of smooth sides of all nodes: one of a node within a face, two on an edge, three at the corner of a box. As many planes
    /// can meet it at a time.
    pub(crate) fn node_sides(&self) -> usize {
        let mut sides = vec![Vec::new(); self.positions.len()];
        for (corners, part) in self.triangles.iter().zip(smooth_parts(self)) {
            for node in corners {
                let of_node: &mut Vec<u32> = &mut sides[*node as usize];
                if !of_node.contains(&part) {
                    of_node.push(part);
                }
            }
        }
        sides.iter().map(Vec::len).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::super::test_surfaces::ball;
    use super::*;

    #[test]
    fn a_cube_has_six_smooth_parts_and_a_ball_one() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let cube = crate::recording::Recording::from_bytes(bytes).expect("a released recording").surface;
        let parts = smooth_parts(&cube);
        for (t, part) in parts.iter().enumerate() {
            for (other, its) in parts.iter().enumerate() {
                let angle = area_vector(&cube, t).angle_between(area_vector(&cube, other));
                assert_eq!(part == its, angle < 0.1, "{t} {other}");
            }
        }
        assert_eq!(parts.iter().max(), Some(&5));
        let (low, high) = cube.extent();
        let faces = |p: &DVec3| (0..3).filter(|&k| (p[k] - low[k]).min(high[k] - p[k]) < 1e-9).count();
        assert_eq!(cube.node_sides(), cube.positions.iter().map(faces).sum::<usize>());
        assert!(smooth_parts(&ball(3)).iter().all(|part| *part == 0));
    }
}
