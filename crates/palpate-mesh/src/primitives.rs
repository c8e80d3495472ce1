//! Generated meshes: boxes and balls.

use super::error::MeshError;
use super::faces::EDGES;
use super::volume_mesh::{Mesh, MidEdgeNode, Region};
use glam::DVec3;
use std::collections::HashMap;

/// Largest number of tetrahedra: beyond it the factor does not fit into the memory of a common machine.
const MAX_TETRAHEDRA: u64 = 20_000_000;

/// Mesh of one region.
fn one_region(nodes: Vec<DVec3>, tets: Vec<[u32; 4]>) -> Mesh {
    let tet_regions = vec![0; tets.len()];
    Mesh { nodes, tets, tet_regions, regions: vec![Region::default()], ..Mesh::default() }
}

/// Division of the cells of a box into tetrahedra.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum CellSplit {
    /// Five, mirrored from cell to cell, as on the paper's cube: diagonals join the lattice points with an odd sum of indices. A corner of
    /// the box with an even sum belongs to one tetrahedron only; with even cell counts that is every corner.
    #[default]
    Five,
    /// Six around the diagonal from the low to the high corner, equal in all cells (Kuhn).
    Six,
}

impl CellSplit {
    /// Number of tetrahedra of a cell.
    fn tetrahedra(self) -> u64 {
        match self {
            Self::Five => 5,
            Self::Six => 6,
        }
    }

    /// Tetrahedra of a cell by its corners (0 or 1 along each axis); `odd` is the parity of the sum of its indices.
    pub(crate) fn of_cell(self, odd: u32) -> Vec<[[u32; 3]; 4]> {
        match self {
            Self::Five => {
                let mut split = [
                    [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]],
                    [[1, 1, 0], [0, 1, 0], [1, 0, 0], [1, 1, 1]],
                    [[1, 0, 1], [1, 0, 0], [0, 0, 1], [1, 1, 1]],
                    [[0, 1, 1], [0, 1, 0], [1, 1, 1], [0, 0, 1]],
                    [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]],
                ];
                if odd == 1 {
                    // Mirrored in x.
                    split.iter_mut().flatten().for_each(|corner| corner[0] ^= 1);
                    split.iter_mut().for_each(|tet| tet.swap(2, 3));
                }
                split.to_vec()
            }
            Self::Six => KUHN
                .iter()
                .map(|path| {
                    let mut corner = [0; 3];
                    let mut tet = [corner; 4];
                    for (slot, &axis) in tet[1..].iter_mut().zip(path) {
                        corner[axis] = 1;
                        *slot = corner;
                    }
                    // Odd permutations of the axes are the mirror images.
                    let [x, y, z] = *path;
                    if (x > y) ^ (y > z) ^ (x > z) {
                        tet.swap(2, 3);
                    }
                    tet
                })
                .collect(),
        }
    }
}

/// Mesh of a box of the given sides [m] about the origin, with [five tetrahedra per cell](CellSplit::Five).
///
/// # Errors
/// As [`split_box_mesh`].
pub fn box_mesh(size: [f64; 3], cells: [u32; 3]) -> Result<Mesh, MeshError> {
    split_box_mesh(size, cells, CellSplit::Five)
}

/// Mesh of a box of the given sides [m] about the origin.
///
/// # Errors
/// [`MeshError::BoxSize`] or [`MeshError::BoxCells`] for a side that is not positive, no cell, or too many cells.
pub fn split_box_mesh(size: [f64; 3], cells: [u32; 3], split: CellSplit) -> Result<Mesh, MeshError> {
    let each = split.tetrahedra();
    let tetrahedra = cells.iter().try_fold(each, |n, &c| n.checked_mul(u64::from(c))).unwrap_or(u64::MAX);
    if size.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
        return Err(MeshError::BoxSize { size });
    }
    if tetrahedra == 0 || tetrahedra > MAX_TETRAHEDRA {
        return Err(MeshError::BoxCells { cells, tetrahedra, limit: MAX_TETRAHEDRA });
    }
    let [nx, ny, nz] = cells;
    let number = |i: u32, j: u32, k: u32| (i * (ny + 1) + j) * (nz + 1) + k;
    let mut nodes = Vec::new();
    for i in 0..=nx {
        for j in 0..=ny {
            for k in 0..=nz {
                let share = [
                    f64::from(i) / f64::from(nx),
                    f64::from(j) / f64::from(ny),
                    f64::from(k) / f64::from(nz),
                ];
                nodes.push((DVec3::from_array(share) - DVec3::splat(0.5)) * DVec3::from_array(size));
            }
        }
    }
    let mut tets = Vec::new();
    for i in 0..nx {
        for j in 0..ny {
            for k in 0..nz {
                let at = |[a, b, c]: [u32; 3]| number(i + a, j + b, k + c);
                tets.extend(split.of_cell((i + j + k) % 2).into_iter().map(|tet| tet.map(at)));
            }
        }
    }
    Ok(one_region(nodes, tets))
}

/// Mesh of a ball of the given radius [m] about the origin, with 20·`layers`³ tetrahedra.
///
/// The 20 tetrahedra between an icosahedron and its centre are refined, and every shell is projected onto its sphere. Edges of the surface
/// have a mid-edge node on the sphere, for elements of order 2. Inner edges are straight: curved ones would converge with a lower order
/// about the centre, where their curvature is that of their length.
///
/// # Errors
/// [`MeshError::BallRadius`] or [`MeshError::BallLayers`] for a radius that is not positive, no layer, or too many layers.
pub fn ball_mesh(radius: f64, layers: u32) -> Result<Mesh, MeshError> {
    if !(radius.is_finite() && radius > 0.0) {
        return Err(MeshError::BallRadius { radius });
    }
    let tetrahedra = u64::from(layers).checked_pow(3).and_then(|n| n.checked_mul(20)).unwrap_or(u64::MAX);
    if layers == 0 || tetrahedra > MAX_TETRAHEDRA {
        return Err(MeshError::BallLayers { layers, tetrahedra, limit: MAX_TETRAHEDRA });
    }
    let (corners, faces) = icosahedron();
    let mut mesh = one_region(Vec::new(), Vec::new());
    // A lattice point is (shell a, and b, c within the shell's triangle) with a ≥ b ≥ c ≥ 0. Points on
    // shared edges and faces are found by their sums over the icosahedron's corners.
    let (mut numbers, mut node_shares) = (HashMap::new(), Vec::new());
    let place = |shares: [u32; 12], divisions: f64| {
        let sum: DVec3 = shares.iter().zip(corners).map(|(&s, corner)| corner * f64::from(s)).sum();
        let shell = radius * f64::from(shares.iter().sum::<u32>()) / divisions;
        sum.normalize_or_zero() * shell
    };
    for [p, q, r] in faces {
        let mut node = |[a, b, c]: [u32; 3]| -> u32 {
            let mut shares = [0_u32; 12];
            shares[p] += a - b;
            shares[q] += b - c;
            shares[r] += c;
            *numbers.entry(shares).or_insert_with(|| {
                mesh.nodes.push(place(shares, f64::from(layers)));
                node_shares.push(shares);
                mesh.nodes.len() as u32 - 1
            })
        };
        for base in lattice(layers) {
            for path in KUHN {
                let mut at = base;
                let mut tet = [at; 4];
                for (slot, axis) in tet[1..].iter_mut().zip(path) {
                    at[axis] += 1;
                    *slot = at;
                }
                if tet.iter().all(|[a, b, c]| a >= b && b >= c) {
                    mesh.tets.push(tet.map(&mut node));
                }
            }
        }
    }
    // The Kuhn simplices come in both orientations.
    for tet in &mut mesh.tets {
        let [a, b, c, d] = tet.map(|n| mesh.nodes[n as usize]);
        if (b - a).cross(c - a).dot(d - a) < 0.0 {
            tet.swap(2, 3);
        }
    }
    mesh.tet_regions = vec![0; mesh.tets.len()];
    let on_surface = |node: u32| node_shares[node as usize].iter().sum::<u32>() == layers;
    let mut middles = HashMap::new();
    for tet in &mesh.tets {
        for [a, b] in EDGES.map(|edge| edge.map(|corner| tet[corner])) {
            if on_surface(a) && on_surface(b) {
                middles.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let [of_a, of_b] = [a, b].map(|node| node_shares[node as usize]);
                    let sums = std::array::from_fn(|corner| of_a[corner] + of_b[corner]);
                    mesh.nodes.push(place(sums, 2.0 * f64::from(layers)));
                    mesh.nodes.len() as u32 - 1
                });
            }
        }
    }
    mesh.mid_edge_nodes = middles.into_iter().map(|(ends, node)| MidEdgeNode { ends, node }).collect();
    mesh.mid_edge_nodes.sort_unstable();
    Ok(mesh)
}

/// Six paths along the axes from (0,0,0) to (1,1,1): Kuhn's triangulation of a cell.
const KUHN: [[usize; 3]; 6] = [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];

/// Cells of a refined tetrahedron.
fn lattice(n: u32) -> impl Iterator<Item = [u32; 3]> {
    (0..n).flat_map(move |a| (0..=a).flat_map(move |b| (0..=b).map(move |c| [a, b, c])))
}

/// Unit corners, and faces with ascending corner numbers.
fn icosahedron() -> ([DVec3; 12], Vec<[usize; 3]>) {
    let golden = (1.0 + 5.0_f64.sqrt()) / 2.0;
    let mut corners = Vec::new();
    for (s, t) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        corners.push(DVec3::new(0.0, s, t * golden));
        corners.push(DVec3::new(s, t * golden, 0.0));
        corners.push(DVec3::new(t * golden, 0.0, s));
    }
    let near = |a: usize, b: usize| (corners[a] - corners[b]).length() < 2.1;
    let mut faces = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(a, c) {
                    faces.push([a, b, c]);
                }
            }
        }
    }
    let mut unit = [DVec3::ZERO; 12];
    for (to, from) in unit.iter_mut().zip(&corners) {
        *to = from.normalize();
    }
    (unit, faces)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::faces::tet_volume;

    #[test]
    fn the_papers_cube_has_its_counts_and_lone_corners() {
        let mesh = box_mesh([0.1; 3], [12; 3]).expect("a good box").checked().expect("a sound mesh");
        assert_eq!((mesh.nodes.len(), mesh.tets.len()), (2197, 8640));
        let boundary = mesh.boundary();
        assert_eq!(boundary.len(), 1728);
        let corners = mesh.nodes.iter().enumerate().filter(|(_, p)| p.abs().min_element() > 0.0499);
        for (corner, _) in corners {
            let owners = mesh.tets.iter().filter(|tet| tet.contains(&(corner as u32))).count();
            assert_eq!(owners, 1, "corner {corner}");
        }
    }

    #[test]
    fn boxes_of_odd_cell_counts_fill_their_volume() {
        for (split, tetrahedra) in [(CellSplit::Five, 30), (CellSplit::Six, 36)] {
            let mesh = split_box_mesh([1.0, 2.0, 3.0], [3, 1, 2], split).expect("a good box");
            let mesh = mesh.checked().expect("a sound mesh");
            let volume: f64 = mesh.tets.iter().map(|tet| tet_volume(&mesh.nodes, tet)).sum();
            assert!((volume - 6.0).abs() < 1e-14 && mesh.warnings.is_empty(), "{volume} {:?}", mesh.warnings);
            assert_eq!(mesh.tets.len(), tetrahedra);
        }
    }

    #[test]
    fn balls_are_sound_and_their_volume_converges_with_second_order() {
        let missing = |layers: u32| {
            let mesh = ball_mesh(0.5, layers).expect("a good ball").checked().expect("a sound mesh");
            assert_eq!(mesh.tets.len() as u32, 20 * layers.pow(3));
            let volume: f64 = mesh.tets.iter().map(|tet| tet_volume(&mesh.nodes, tet)).sum();
            1.0 - volume / (std::f64::consts::PI / 6.0)
        };
        let order = (missing(4) / missing(8)).log2();
        assert!((order - 2.0).abs() < 0.1, "observed order {order}");
    }

    #[test]
    fn impossible_primitives_are_refused() {
        assert!(
            box_mesh([0.0, 1.0, 1.0], [1; 3]).is_err() && box_mesh([f64::NAN, 1.0, 1.0], [1; 3]).is_err()
        );
        assert!(box_mesh([1.0; 3], [0, 1, 1]).is_err() && box_mesh([1.0; 3], [u32::MAX; 3]).is_err());
        assert!(
            ball_mesh(-1.0, 3).is_err() && ball_mesh(1.0, 0).is_err() && ball_mesh(1.0, u32::MAX).is_err()
        );
    }
}
