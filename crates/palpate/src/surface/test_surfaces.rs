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

/// Cube with the corners 0 and 1 in every coordinate, whose faces are grids with diagonals that alternate.
pub(super) fn cube(cells: u32) -> Surface {
    let mut nodes = BTreeMap::new();
    let mut positions = Vec::new();
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for (side, i, j) in (0..2 * cells * cells).map(|k| (k % 2, k / 2 % cells, k / 2 / cells)) {
            let mut node = |(i, j): (u32, u32)| {
                let mut grid = [0; 3];
                (grid[axis], grid[(axis + 1) % 3], grid[(axis + 2) % 3]) = (side * cells, i, j);
                *nodes.entry(grid).or_insert_with(|| {
                    positions.push(DVec3::from_array(grid.map(|k| f64::from(k) / f64::from(cells))));
                    positions.len() as u32 - 1
                })
            };
            let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(&mut node);
            let first = ((i + j) % 2) as usize;
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| corners[(first + k) % 4]);
            let outward = |[a, b, c]: [u32; 3]| if side == 1 { [a, b, c] } else { [a, c, b] };
            triangles.extend([outward([a, b, c]), outward([a, c, d])]);
        }
    }
    Surface { source_nodes: (0..positions.len() as u32).collect(), positions, triangles }
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
