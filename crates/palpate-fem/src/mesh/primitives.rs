//! Generated meshes: boxes and balls.

use super::error::MeshError;
use super::volume_mesh::{Mesh, Region};
use glam::DVec3;

/// Largest number of tetrahedra: beyond it the factor does not fit into the memory of a common machine.
const MAX_TETRAHEDRA: u64 = 20_000_000;

/// Mesh of one region.
fn one_region(nodes: Vec<DVec3>, tets: Vec<[u32; 4]>) -> Mesh {
    let tet_regions = vec![0; tets.len()];
    Mesh { nodes, tets, tet_regions, regions: vec![Region { tag: 0, name: None }], ..Mesh::default() }
}

/// Mesh of a box of the given sides [m] about the origin, with five tetrahedra per cell.
///
/// The two mirror-image splits alternate, so that faces match: diagonals join the lattice points
/// with an odd sum of indices. A corner of the box with an even sum belongs to one tetrahedron only;
/// with even cell counts that is every corner, which is the paper's cube.
///
/// # Errors
/// [`MeshError::BoxSize`] or [`MeshError::BoxCells`] for a side that is not positive, no cell, or too many cells.
pub fn box_mesh(size: [f64; 3], cells: [u32; 3]) -> Result<Mesh, MeshError> {
    let tetrahedra = cells.iter().try_fold(5_u64, |n, &c| n.checked_mul(u64::from(c))).unwrap_or(u64::MAX);
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
                let odd = (i + j + k) % 2;
                // Corner (a, b, c) of the cell, mirrored in x for odd cells.
                let at = |a: u32, b: u32, c: u32| number(i + (a ^ odd), j + b, k + c);
                let mut split = [
                    [at(0, 0, 0), at(1, 0, 0), at(0, 1, 0), at(0, 0, 1)],
                    [at(1, 1, 0), at(0, 1, 0), at(1, 0, 0), at(1, 1, 1)],
                    [at(1, 0, 1), at(1, 0, 0), at(0, 0, 1), at(1, 1, 1)],
                    [at(0, 1, 1), at(0, 1, 0), at(1, 1, 1), at(0, 0, 1)],
                    [at(1, 0, 0), at(0, 1, 0), at(0, 0, 1), at(1, 1, 1)],
                ];
                if odd == 1 {
                    split.iter_mut().for_each(|tet| tet.swap(2, 3));
                }
                tets.extend(split);
            }
        }
    }
    Ok(one_region(nodes, tets))
}

/// Mesh of a ball of the given radius [m] about the origin, with 20·`layers`³ tetrahedra.
///
/// The 20 tetrahedra between an icosahedron and its centre are refined, and every shell is projected onto its sphere.
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
    let mut numbers = std::collections::HashMap::new();
    for [p, q, r] in faces {
        let mut node = |[a, b, c]: [u32; 3]| -> u32 {
            let mut shares = [0_u32; 12];
            shares[p] += a - b;
            shares[q] += b - c;
            shares[r] += c;
            *numbers.entry(shares).or_insert_with(|| {
                let sum: DVec3 = shares.iter().zip(corners).map(|(&s, corner)| corner * f64::from(s)).sum();
                let shell = radius * f64::from(a) / f64::from(layers);
                mesh.nodes.push(sum.normalize_or_zero() * shell);
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
    use crate::mesh::faces::tet_volume;

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
        let mesh = box_mesh([1.0, 2.0, 3.0], [3, 1, 2]).expect("a good box").checked().expect("a sound mesh");
        let volume: f64 = mesh.tets.iter().map(|tet| tet_volume(&mesh.nodes, tet)).sum();
        assert!((volume - 6.0).abs() < 1e-14 && mesh.warnings.is_empty(), "{volume} {:?}", mesh.warnings);
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
