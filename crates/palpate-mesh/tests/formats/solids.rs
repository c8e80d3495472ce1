//! Hexahedra, wedges and pyramids, split into conforming tetrahedra.

use crate::body::{total_volume, volume};
use palpate_mesh::Mesh;

/// Cells along each side of a block.
const CELLS: usize = 3;

/// Rounding of a sum of a few hundred volumes.
const SUMMED: f64 = 1e-12;

/// A permutation of the numbers below `count`, another for each seed.
fn shuffled(count: usize, mut seed: u64) -> Vec<usize> {
    let mut all: Vec<usize> = (0..count).collect();
    for at in (1..count).rev() {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        all.swap(at, (seed >> 33) as usize % (at + 1));
    }
    all
}

/// Split of the cells of a block; every cell has its own.
#[derive(Clone, Copy, Debug)]
enum Split {
    Hexahedra,
    Wedges,
    Pyramids,
    Mixed,
}

/// A block of 0.1 m as a VTK file, its nodes in a random order; torn, each cell has nodes of its own.
fn block(split: Split, seed: u64, is_torn: bool) -> Vec<u8> {
    let side = CELLS + 1;
    let lattice = |i: usize, j: usize, k: usize| (i * side + j) * side + k;
    let mut points: Vec<[f64; 3]> = Vec::new();
    for i in 0..side {
        for j in 0..side {
            for k in 0..side {
                points.push([i, j, k].map(|at| 0.1 * at as f64 / CELLS as f64));
            }
        }
    }
    let mut cells: Vec<(u32, Vec<usize>)> = Vec::new();
    for cell in 0..CELLS.pow(3) {
        let (i, j, k) = (cell / CELLS / CELLS, cell / CELLS % CELLS, cell % CELLS);
        let at = |x: usize, y: usize, z: usize| lattice(i + x, j + y, k + z);
        let hex = [
            at(0, 0, 0),
            at(1, 0, 0),
            at(1, 1, 0),
            at(0, 1, 0),
            at(0, 0, 1),
            at(1, 0, 1),
            at(1, 1, 1),
            at(0, 1, 1),
        ];
        let chosen = match (split, cell % 3) {
            // Wedges have triangles at both ends, so mixed cells meet at quadrilaterals alone: hexahedra and pyramids.
            (Split::Mixed, 0) => Split::Hexahedra,
            (Split::Mixed, _) => Split::Pyramids,
            (other, _) => other,
        };
        match chosen {
            Split::Wedges => {
                for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
                    let wedge = [a, b, c, a + 4, b + 4, c + 4].map(|corner| hex[corner]);
                    cells.push((13, wedge.to_vec()));
                }
            }
            Split::Pyramids => {
                let middle = points.len();
                let mean = |axis: usize| hex.iter().map(|&node| points[node][axis]).sum::<f64>() / 8.0;
                points.push([mean(0), mean(1), mean(2)]);
                let faces =
                    [[0, 3, 2, 1], [0, 1, 5, 4], [0, 4, 7, 3], [1, 2, 6, 5], [2, 3, 7, 6], [4, 5, 6, 7]];
                for face in faces {
                    let base = face.map(|corner| hex[corner]);
                    cells.push((14, [&base[..], &[middle]].concat()));
                }
            }
            _ => cells.push((12, hex.to_vec())),
        }
    }
    if is_torn {
        let torn = |cell: &mut (u32, Vec<usize>), own: &mut Vec<[f64; 3]>| {
            for node in &mut cell.1 {
                own.push(points[*node]);
                *node = own.len() - 1;
            }
        };
        let mut own = Vec::new();
        cells.iter_mut().for_each(|cell| torn(cell, &mut own));
        points = own;
    }
    let number = shuffled(points.len(), seed);
    let mut placed = vec![[0.0; 3]; points.len()];
    points.iter().zip(&number).for_each(|(point, &at)| placed[at] = *point);
    let mut text = format!(
        "#vtk DataFile Version 2.0\nblock\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n",
        placed.len()
    );
    placed.iter().for_each(|[x, y, z]| text += &format!("{x} {y} {z}\n"));
    let size: usize = cells.iter().map(|(_, nodes)| 1 + nodes.len()).sum();
    text += &format!("CELLS {} {size}\n", cells.len());
    for (_, nodes) in &cells {
        let row: Vec<_> = nodes.iter().map(|&node| number[node].to_string()).collect();
        text += &format!("{} {}\n", nodes.len(), row.join(" "));
    }
    text += &format!("CELL_TYPES {}\n", cells.len());
    cells.iter().for_each(|(kind, _)| text += &format!("{kind}\n"));
    text.into_bytes()
}

fn read(split: Split, seed: u64, is_torn: bool) -> Mesh {
    volume([("block.vtk", block(split, seed, is_torn))]).mesh
}

#[test]
fn splits_are_conforming_for_any_numbers_of_the_nodes() {
    for split in [Split::Hexahedra, Split::Wedges, Split::Pyramids, Split::Mixed] {
        for seed in 0..20 {
            let mesh = read(split, seed, false).checked().expect("a sound mesh");
            // A face of neighbours that are cut differently would be on the boundary, and one piece would be several.
            assert_eq!(mesh.boundary().len(), 6 * 2 * CELLS.pow(2), "{split:?} {seed}");
            assert!((total_volume(&mesh) / 1e-3 - 1.0).abs() < SUMMED, "{split:?} {seed}");
        }
    }
}

#[test]
fn cells_that_share_no_nodes_are_cut_alike_so_that_they_can_be_joined() {
    for split in [Split::Hexahedra, Split::Wedges, Split::Pyramids] {
        let mut mesh = read(split, 7, true);
        assert!(mesh.pieces().len() >= CELLS.pow(3), "{split:?}");
        mesh.repair(&palpate_mesh::Repair::default()).expect("a mesh that can be joined");
        let mesh = mesh.checked().expect("a sound mesh");
        assert_eq!(mesh.boundary().len(), 6 * 2 * CELLS.pow(2), "{split:?}");
        assert!((total_volume(&mesh) / 1e-3 - 1.0).abs() < SUMMED, "{split:?}");
    }
}

#[test]
fn a_split_is_told_with_its_numbers() {
    let file = volume([("block.vtk", block(Split::Hexahedra, 3, false))]);
    assert_eq!(file.format, "VTK legacy 2.0, text");
    assert_eq!(file.mesh.tets.len(), 27 * 6);
    assert_eq!(file.mesh.warnings, ["hexahedra (27) were split into 162 tetrahedra"]);
    assert_eq!(file.elements.into_iter().collect::<Vec<_>>(), [("hexahedra", 27)]);
}

#[test]
fn quadratic_solids_give_their_corners() {
    // A hexahedron of 20 nodes, a wedge of 15 and a pyramid of 13; all others at the origin of a far corner.
    for (kind, corners, nodes, tets) in [(25, 8, 20, 6), (26, 6, 15, 3), (27, 5, 13, 2), (29, 8, 27, 6)] {
        let mut points = vec!["0 0 0", "1 0 0", "1 1 0", "0 1 0", "0 0 1", "1 0 1", "1 1 1", "0 1 1"];
        if corners == 6 {
            points = vec!["0 0 0", "1 0 0", "0 1 0", "0 0 1", "1 0 1", "0 1 1"];
        }
        points.truncate(corners);
        points.resize(nodes, "0.5 0.5 0.5");
        let row: Vec<_> = (0..nodes).map(|node| node.to_string()).collect();
        let text = format!(
            "# vtk DataFile Version 4.2\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {nodes} double\n{}\nCELLS 1 {}\n{nodes} {}\nCELL_TYPES 1\n{kind}\n",
            points.join("\n"),
            nodes + 1,
            row.join(" ")
        );
        let mesh = volume([("x.vtk", text.into_bytes())]).mesh;
        assert_eq!((mesh.tets.len(), mesh.mid_side_nodes.len()), (tets, nodes - corners), "{kind}");
        let mesh = mesh.checked().expect("a sound mesh");
        let expected = match corners {
            8 => 1.0,
            6 => 0.5,
            _ => 1.0 / 3.0,
        };
        assert!((total_volume(&mesh) - expected).abs() < SUMMED, "{kind}");
    }
}

#[test]
fn a_voxel_and_a_hexahedron_with_repeated_corners_are_read() {
    let head = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n\
                0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\n";
    for (cells, expected) in
        [("8 0 1 2 3 4 5 6 7\nCELL_TYPES 1\n11\n", 1.0), ("8 0 1 3 3 4 5 7 7\nCELL_TYPES 1\n12\n", 0.5)]
    {
        let mesh = volume([("x.vtk", format!("{head}CELLS 1 9\n{cells}").into_bytes())]).mesh;
        let mesh = mesh.checked().expect("a sound mesh");
        assert!((total_volume(&mesh) - expected).abs() < SUMMED);
    }
}
