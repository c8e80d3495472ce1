#![allow(clippy::unwrap_used)]

use std::path::Path;

use glam::DVec3;

use super::parse;
use crate::scan::tests::XorShift;
use crate::{Mesh, MeshError, NodeGroup, Region};

const POSITIONS: [[f64; 3]; 5] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.25, -2.5e-3, 1.0], [1.0, 1.0, 1.5]];
/// Cell types and points.
const CELLS: [(i32, &[i32]); 3] = [(5, &[2, 0, 1]), (10, &[0, 1, 2, 3]), (10, &[1, 2, 3, 4])];

fn region(tag: i64) -> Region {
    Region { tag, ..Region::default() }
}

/// Content of all variants of the file.
fn expected() -> Mesh {
    Mesh {
        nodes: POSITIONS.map(DVec3::from).to_vec(),
        tets: vec![[0, 1, 2, 3], [1, 2, 3, 4]],
        tet_regions: vec![1, 0],
        regions: vec![region(-3), region(7)],
        groups: vec![
            NodeGroup { name: "left side".to_owned(), nodes: vec![0, 2] },
            NodeGroup { name: "top".to_owned(), nodes: vec![4] },
        ],
        warnings: vec!["cells of dimension 0 to 2 are ignored: 1".to_owned()],
        ..Mesh::default()
    }
}

/// Writes numbers as text or binary.
struct Writer {
    is_text: bool,
    bytes: Vec<u8>,
}

impl Writer {
    fn text(&mut self, text: &str) {
        self.bytes.extend(text.bytes());
    }

    fn put(&mut self, as_text: String, big_endian: &[u8]) {
        if self.is_text {
            self.text(&format!("{as_text} "));
        } else {
            self.bytes.extend(big_endian);
        }
    }

    fn bytes(&mut self, numbers: &[u8]) {
        for number in numbers {
            self.put(number.to_string(), &number.to_be_bytes());
        }
    }

    fn ints(&mut self, numbers: &[i32]) {
        for number in numbers {
            self.put(number.to_string(), &number.to_be_bytes());
        }
    }

    fn longs(&mut self, numbers: &[i64]) {
        for number in numbers {
            self.put(number.to_string(), &number.to_be_bytes());
        }
    }

    fn floats(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.put(number.to_string(), &number.to_be_bytes());
        }
    }

    fn doubles(&mut self, numbers: &[f64]) {
        for number in numbers {
            self.put(number.to_string(), &number.to_be_bytes());
        }
    }
}

const VARIANTS: [(bool, bool); 4] = [(false, true), (false, false), (true, true), (true, false)];

/// The file in one of its variants: with `OFFSETS` or sizes, text or binary.
fn file(has_offsets: bool, is_text: bool) -> Vec<u8> {
    let mut w = Writer { is_text, bytes: Vec::new() };
    let version = if has_offsets { "5.1" } else { "3.0" };
    let encoding = if is_text { "ASCII" } else { "BINARY" };
    w.text(&format!("# vtk DataFile Version {version}\nPOINTS 1\n{encoding}\n"));
    w.text("DATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n");
    w.doubles(&[0.5]);
    w.text("\nPOINTS 5 double\n");
    w.doubles(POSITIONS.as_flattened());
    w.text("\nMETADATA\nINFORMATION 1\nNAME L2 LOCATION x\nDATA 2 CELLS 7\n\n");
    if has_offsets {
        w.text("CELLS 4 11\nOFFSETS vtktypeint64\n");
        w.longs(&[0, 3, 7, 11]);
        w.text("\nCONNECTIVITY vtktypeint64\n");
        for point in CELLS.iter().flat_map(|(_, points)| *points) {
            w.longs(&[i64::from(*point)]);
        }
    } else {
        w.text("CELLS 3 14\n");
        for (_, points) in CELLS {
            w.ints(&[points.len() as i32]);
            w.ints(points);
        }
    }
    w.text("\nCELL_TYPES 3\n");
    w.ints(&CELLS.map(|(kind, _)| kind));
    w.text("\nCELL_DATA 3\nSCALARS quality float 1\nLOOKUP_TABLE default\n");
    w.floats(&[0.5, 0.25, f32::NAN]);
    w.text("\nLOOKUP_TABLE default 1\n");
    if is_text {
        w.floats(&[1.0; 4]);
    } else {
        w.bytes(&[255; 4]);
    }
    w.text("\nFIELD FieldData 3\nNULL_ARRAY\npart 2 3 int\n");
    w.ints(&[0; 6]);
    w.text("\nMETADATA\nCOMPONENT_NAMES\npart%20x\npart%20y\n\nMaterialIds 1 3 long\n");
    w.longs(&[1, 7, -3]);
    w.text("\nPOINT_DATA 5\nVECTORS shift float\n");
    w.floats(&[0.5; 15]);
    w.text("\nNORMALS n float\n");
    w.floats(&[0.5; 15]);
    w.text("\nTENSORS stress double\n");
    w.doubles(&[0.5; 45]);
    w.text("\nTEXTURE_COORDINATES t 2 float\n");
    w.floats(&[0.5; 10]);
    w.text("\nCOLOR_SCALARS colour 3\n");
    if is_text {
        w.floats(&[0.5; 15]);
    } else {
        w.bytes(&[128; 15]);
    }
    w.text("\nGLOBAL_IDS id vtkIdType\n");
    w.ints(&[1, 2, 3, 4, 5]);
    w.text("\nSCALARS left%20side unsigned_char\nLOOKUP_TABLE default\n");
    w.bytes(&[1, 0, 255, 0, 0]);
    w.text("\nFIELD FieldData 1\ntop 1 5 vtktypeint64\n");
    w.longs(&[0, 0, 0, 0, -9]);
    w.text("\n");
    w.bytes
}

/// A short text file with a tetrahedron, whose `CELLS` are on line 9.
const SHORT: &str = "# vtk DataFile Version 2.0\n\nASCII\nDATASET UNSTRUCTURED_GRID\n\
                     POINTS 4 float\n0 0 0 1 0 0\n0 1 0\n0 0 1\n\
                     CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
/// The file in layout 5.1.
const SHORT_OFFSETS: &str = "# vtk DataFile Version 5.1\n\nASCII\nDATASET UNSTRUCTURED_GRID\n\
                             POINTS 4 float\n0 0 0 1 0 0\n0 1 0\n0 0 1\n\
                             CELLS 2 4\nOFFSETS vtktypeint64\n0 4\n\
                             CONNECTIVITY vtktypeint64\n0 1 2 3\nCELL_TYPES 1\n10\n";

fn read(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshError> {
    parse(bytes.as_ref(), Path::new("m.vtk")).map(|file| file.mesh)
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    read(bytes).expect_err("the file is wrong").to_string()
}

/// Asserts the message for a file in which some text is replaced.
#[track_caller]
fn assert_message(file: &str, from: &str, to: &str, expected: &str) {
    let changed = file.replace(from, to);
    assert_ne!(changed, file);
    assert_eq!(message(changed), format!("m.vtk: {expected}"));
}

#[test]
fn every_variant_gives_the_same_mesh() {
    for (has_offsets, is_text) in VARIANTS {
        assert_eq!(read(file(has_offsets, is_text)).unwrap(), expected());
    }
}

#[test]
fn line_ends_blank_lines_case_and_a_byte_order_mark_change_nothing() {
    let text = String::from_utf8(file(true, true)).unwrap();
    let (first, rest) = text.split_once("ASCII\n").unwrap();
    let (first, rest) = (first.replace('\n', "\r\n"), rest.replace('\n', " \r\n"));
    let rest = rest.replace("POINTS", "points").replace("DATASET", "\r\n\r\n Dataset");
    assert_eq!(read(format!("\u{feff}{first}ascii\r\n{rest}")).unwrap(), expected());
    assert_eq!(read(text.trim_end()).unwrap(), expected());
}

#[test]
fn without_a_region_array_there_is_one_region() {
    for file in [SHORT, SHORT_OFFSETS] {
        let mesh = read(file).unwrap();
        assert_eq!(mesh.tets, [[0, 1, 2, 3]]);
        assert_eq!((mesh.regions, mesh.tet_regions), (vec![region(0)], vec![0]));
        assert_eq!(mesh.warnings, Vec::<String>::new());
    }
}

#[test]
fn region_arrays_with_fractions_are_reported_and_the_first_other_is_taken() {
    let arrays = "CELL_DATA 1\nFIELD f 3\nRegion 1 1 float\n2\npart 1 1 short\n5\nregion 1 1 int\n6\n";
    let mesh = read(format!("{SHORT}{arrays}")).unwrap();
    assert_eq!(mesh.regions, [region(5)]);
    let warning = "cell array 'Region' is ignored: its type is no integer";
    assert_eq!(mesh.warnings, [warning]);
}

#[test]
fn strings_in_text_are_skipped_and_in_binary_refused() {
    let field = "FIELD f 2\nnote 1 3 string\na b\n\nPOINTS 3\nx 1 1 int\n1\nPOINTS";
    assert!(read(SHORT.replace("POINTS", field)).is_ok());
    let binary = SHORT.replace("ASCII", "BINARY").replace("POINTS", field);
    assert_eq!(message(binary), "m.vtk: byte 80: arrays of type 'string' cannot be read: save as ASCII");
}

#[test]
fn quadratic_tetrahedra_keep_the_nodes_of_their_edges() {
    // Points 4 to 9 in VTK's order: 01, 12, 02, 03, 13, 23.
    let text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 10 float\n0 0 0 2 0 0 0 2 0 0 0 2\n\
                1 0 0.25 1 1 0 0 1 0 0 0 1 1 0 1 0 1 1\nCELLS 1 11\n10 0 1 2 3 4 5 6 7 8 9\nCELL_TYPES 1\n24\n";
    let mesh = read(text).unwrap();
    assert_eq!((mesh.tets.as_slice(), mesh.mid_side_nodes.len()), (&[[0, 1, 2, 3]][..], 0));
    let edges: Vec<_> = mesh.mid_edge_nodes.iter().map(|found| (found.ends, found.node)).collect();
    assert_eq!(edges, [([0, 1], 4), ([0, 2], 6), ([0, 3], 7), ([1, 2], 5), ([1, 3], 8), ([2, 3], 9)]);
    assert!(mesh.warnings.is_empty() && mesh.is_curved());
}

#[test]
fn cells_that_are_not_split_are_refused() {
    let file = SHORT.replace("TYPES 1\n10\n", "TYPES 1\n42\n");
    assert_eq!(
        message(file),
        "m.vtk: line 12: cell 0 is a polyhedron (type 42): expected tetrahedra, hexahedra, wedges or pyramids; ParaView's filter \
         Tetrahedralize makes them"
    );
}

#[test]
fn what_is_no_unstructured_grid_in_a_legacy_file_is_refused() {
    let begin = "expected '# vtk DataFile Version', which a VTK mesh begins with, found";
    for (file, expected) in [
        ("", format!("line 1: {begin} the end of the file")),
        ("\n\nx", format!("line 1: {begin} the end of the line")),
        ("solid x\n", format!("line 1: {begin} 'solid x'")),
    ] {
        assert_eq!(message(file), format!("m.vtk: {expected}"));
    }
    for (from, to, expected) in [
        ("ASCII", "TEXT", "line 3: expected ASCII or BINARY, found 'TEXT'"),
        ("DATASET", "DATA", "line 4: expected DATASET, found 'DATA'"),
        (
            "UNSTRUCTURED_GRID",
            "POLYDATA",
            "line 4: this is a VTK surface (POLYDATA), expected UNSTRUCTURED_GRID: a body needs tetrahedra, which gmsh, TetGen or \
             fTetWild make of a surface; ParaView saves it as .stl or .ply for an obstacle",
        ),
        (
            "UNSTRUCTURED_GRID",
            "STRUCTURED_POINTS",
            "line 4: expected UNSTRUCTURED_GRID, found 'STRUCTURED_POINTS': ParaView's filter Tetrahedralize makes an unstructured \
             grid of it",
        ),
        ("float", "half", "line 5: expected a number type such as double, found 'half'"),
        ("CELLS 1", "VERTS 1", "line 9: expected a keyword such as POINT_DATA, found 'VERTS'"),
    ] {
        assert_message(SHORT, from, to, expected);
    }
}

#[test]
fn counts_that_lie_are_found() {
    for (from, to, expected) in [
        ("POINTS 4", "POINTS 5", "line 9: expected a coordinate, found 'CELLS'"),
        ("POINTS 4", "POINTS -4", "line 5: expected the number of points, found '-4'"),
        ("POINTS 4", "POINTS 3", "line 8: expected a keyword such as POINT_DATA, found '0'"),
        (
            "POINTS 4",
            "POINTS 400",
            "line 5: the file states 400 points, more than its remaining 61 bytes can hold",
        ),
        ("CELLS 1 5", "CELLS 1 4", "line 10: a cell has 4 points, and CELLS leaves it 3 of 4 numbers"),
        ("CELLS 1 5", "CELLS 1 6", "line 10: the cells take 5 numbers, and CELLS states 6"),
        ("CELLS 1 5", "CELLS 2 6", "line 11: expected the number of points of a cell, found 'CELL_TYPES'"),
        ("4 0 1 2 3", "-1 0 1 2 3", "line 10: a cell has -1 points, and CELLS leaves it 4 of 5 numbers"),
        ("TYPES 1", "TYPES 2", "line 11: 2 cell types are stated for 1 cells"),
        ("\n10\n", "\n10\nCELL_DATA 2\n", "line 13: data of 2 cells is stated, and there are 1"),
        (
            "\n10\n",
            "\n10\nPOINT_DATA 4\nFIELD f 1\na 1 3 int\n1 1 1\n",
            "line 15: array 'a' has 3 tuples, expected 4",
        ),
        (
            "\n10\n",
            "\n10\nPOINT_DATA 4\nSCALARS a int\nLOOKUP_TABLE default\n1 1 1\nSCALARS b int\n",
            "line 17: expected a whole number, found 'SCALARS'",
        ),
        (
            "\n10\n",
            "\n10\nPOINT_DATA 4\nSCALARS a int 99999999999999999\nLOOKUP_TABLE default\n1\n",
            "line 15: the file states 399999999999999996 numbers, more than its remaining 2 bytes \
             can hold",
        ),
    ] {
        assert_message(SHORT, from, to, expected);
    }
}

#[test]
fn offsets_that_lie_are_found() {
    for (from, to, expected) in [
        ("\n0 4\n", "\n1 4\n", "line 11: offset 1 after 0: expected to rise from 0"),
        ("\n0 4\n", "\n0 -4\n", "line 11: offset -4 after 0: expected to rise from 0"),
        ("\n0 4\n", "\n0 3\n", "line 11: the last offset is 3, and CELLS states 4 points"),
        ("CONNECTIVITY", "X", "line 12: expected CONNECTIVITY, found 'X'"),
        ("vtktypeint64", "double", "line 10: expected an offset, found a type with fractions"),
        ("0 1 2 3\n", "0 1 2 4\n", "line 13: a cell has point 4, and the file has 4 points"),
        ("CELLS 2", "CELLS 1", "line 11: the last offset is 0, and CELLS states 4 points"),
    ] {
        assert_message(SHORT_OFFSETS, from, to, expected);
    }
}

#[test]
fn wrong_cells_and_orders_are_found() {
    for (from, to, expected) in [
        (
            "1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
            "1 4\n3 0 1 2\nCELL_TYPES 1\n71\n",
            "line 12: cell 0 has type 71 and 3 points",
        ),
        ("4 0 1 2 3", "4 0 1 2 -3", "line 10: a cell has point -3, and the file has 4 points"),
        ("\n10\n", "\n5\n", "line 12: cell 0 has type 5 and 4 points"),
        ("\n10\n", "\n99\n", "line 12: unknown cell type 99"),
        ("\n10\n", "\n", "line 11: expected a cell type, found the end of the file"),
        ("CELL_TYPES 1\n10\n", "", "line 10: the file has no CELL_TYPES"),
        ("CELLS 1 5\n4 0 1 2 3\n", "", "line 9: CELL_TYPES comes before CELLS"),
        ("POINTS", "CELLS 1 5\nPOINTS", "line 5: CELLS comes before POINTS"),
        ("CELLS 1", "POINTS 1", "line 9: POINTS is in the file twice"),
        ("POINTS", "POINT_DATA 4\nPOINTS", "line 5: data comes before the points or cells it is of"),
        ("\n10\n", "\n10\nSCALARS a int\n", "line 13: an array comes before POINT_DATA and CELL_DATA"),
    ] {
        assert_message(SHORT, from, to, expected);
    }
}

#[test]
fn errors_in_a_binary_file_say_the_byte() {
    let bytes = file(false, false);
    let cells = bytes.windows(10).position(|w| w == b"CELLS 3 14").unwrap() + 11;
    let mut damaged = bytes.clone();
    damaged[cells + 7] = 9;
    assert_eq!(
        message(damaged),
        format!("m.vtk: byte {}: a cell has point 9, and the file has 5 points", cells + 4)
    );
}

#[test]
fn a_file_cut_anywhere_before_the_end_of_its_cells_is_an_error() {
    for (has_offsets, is_text) in VARIANTS {
        let bytes = file(has_offsets, is_text);
        let end = bytes.windows(9).position(|w| w == b"CELL_DATA").unwrap() - 2;
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err() || length >= end, "{length}");
        }
    }
}

#[test]
fn damaged_files_do_not_panic() {
    let mut random = XorShift(0x9e37_79b9_7f4a_7c15);
    for (has_offsets, is_text) in VARIANTS {
        let bytes = file(has_offsets, is_text);
        for _ in 0..3000 {
            let _ = read(random.damage(&bytes));
        }
    }
}
