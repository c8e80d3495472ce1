//! Surfaces for the unit tests of this module.

use super::Surface;
use alloc::collections::BTreeMap;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Surface with every triangle cut in four.
pub(super) fn cut_in_four(surface: &Surface) -> Surface {
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

/// Octahedron cut in four so many times, with its nodes on the unit sphere.
pub(super) fn ball(times: usize) -> Surface {
    let (a, b) = (DVec3::X, DVec3::Y);
    let positions = vec![a, b, -a, -b, DVec3::Z, -DVec3::Z];
    let upper = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]];
    let lower = upper.map(|[i, j, _]: [u32; 3]| [j, i, 5]);
    let mut ball = Surface { source_nodes: (0..6).collect(), positions, triangles: [upper, lower].concat() };
    for _ in 0..times {
        ball = cut_in_four(&ball);
        ball.positions.iter_mut().for_each(|p| *p = p.normalize());
    }
    ball
}

/// Sheet of no thickness: the same cells seen from both sides.
pub(super) fn sheet() -> Surface {
    let positions: Vec<DVec3> =
        (0..25).map(|k| DVec3::new(f64::from(k % 5), f64::from(k / 5), 0.0)).collect();
    let cells = (0..16_u32).map(|k| k % 4 + k / 4 * 5);
    let front = cells.flat_map(|i| [[i, i + 1, i + 6], [i, i + 6, i + 5]]);
    let triangles: Vec<[u32; 3]> = front.flat_map(|[a, b, c]| [[a, b, c], [a, c, b]]).collect();
    Surface { source_nodes: (0..25).collect(), positions, triangles }
}
