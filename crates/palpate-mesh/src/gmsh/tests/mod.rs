#![allow(clippy::unwrap_used)]

mod files;

use super::parse;
use crate::scan::tests::XorShift;
use crate::{Mesh, MeshError};
use files::Encoding::{Little, Text};
use files::{Msh, POSITIONS, VARIANTS, expected, file, group, region};
use glam::DVec3;
use std::path::Path;

fn read(bytes: impl AsRef<[u8]>) -> Result<Mesh, MeshError> {
    parse(bytes.as_ref(), Path::new("m.msh")).map(|file| file.mesh)
}

fn message(bytes: impl AsRef<[u8]>) -> String {
    read(bytes).expect_err("the file is wrong").to_string()
}

/// A 2.2 text file with four nodes and these elements, the first on line 12.
fn v2_with(elements: &[&str]) -> String {
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n\
         $EndNodes\n$Elements {}\n{}\n$EndElements\n",
        format_args!("\n{}", elements.len()),
        elements.join("\n")
    )
}

/// A 4.1 text file with two volumes, which have these physical tags, and a tetrahedron in each.
fn v4_with(tags: [&str; 2]) -> String {
    let counts = tags.map(|tags| tags.split_whitespace().count());
    format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n0 0 0 2\n\
         1 0 0 0 1 1 1 {} {} 0\n2 0 0 0 1 1 1 {} {} 0\n$EndEntities\n\
         $Nodes\n1 5 1 5\n3 1 0 5\n1\n2\n3\n4\n5\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n$EndNodes\n\
         $Elements\n2 2 1 2\n3 1 4 1\n1 1 2 3 4\n3 2 4 1\n2 2 3 4 5\n$EndElements\n",
        counts[0], tags[0], counts[1], tags[1]
    )
}

#[test]
fn every_variant_gives_the_same_mesh() {
    for (version, encoding) in VARIANTS {
        assert_eq!(read(file(version, encoding)).unwrap(), expected());
    }
}

#[test]
fn line_ends_blank_lines_spaces_and_a_byte_order_mark_change_nothing() {
    for version in [Msh::V2, Msh::V40, Msh::V41] {
        let text = String::from_utf8(file(version, Text)).unwrap();
        let spaced = text.replace('\n', " \t\r\n\r\n").replace("1 2", "1 \t2");
        assert_eq!(read(format!("\u{feff}{spaced}")).unwrap(), expected());
        assert_eq!(read(text.trim_end()).unwrap(), expected());
    }
}

#[test]
fn quadratic_tetrahedra_keep_the_nodes_of_their_edges() {
    // Nodes 5 to 10 in Gmsh's order: 01, 12, 02, 03, 23, 13.
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n10\n1 0 0 0\n2 2 0 0\n3 0 2 0\n4 0 0 2\n5 1 0 0.1\n6 1 1 0\n7 0 1 0\n\
                8 0 0 1\n9 0 1 1\n10 1 0 1\n$EndNodes\n$Elements\n1\n1 11 1 6 1 2 3 4 5 6 7 8 9 10\n$EndElements\n";
    let mesh = read(text).unwrap();
    assert_eq!((mesh.tets.as_slice(), mesh.mid_side_nodes.len()), (&[[0, 1, 2, 3]][..], 0));
    let edges: Vec<_> = mesh.mid_edge_nodes.iter().map(|found| (found.ends, found.node)).collect();
    assert_eq!(edges, [([0, 1], 4), ([0, 2], 6), ([0, 3], 7), ([1, 2], 5), ([1, 3], 9), ([2, 3], 8)]);
    assert!(mesh.warnings.is_empty() && mesh.is_curved());
    assert_eq!(mesh.groups, [group("6", &[0, 1, 2, 3, 4, 5, 6, 7, 8, 9])]);
}

#[test]
fn a_node_of_two_edges_is_that_of_the_first_and_told_of() {
    let elements = v2_with(&["1 11 1 6 4 3 2 1 5 5 5 5 5 5", "2 9 1 2 1 2 3 1 2 3"])
        .replace("\n4\n1 0", "\n5\n5 0.5 0.5 0.5\n1 0");
    let mesh = read(elements).unwrap();
    assert_eq!((mesh.tets, mesh.mid_edge_nodes.len()), (vec![[4, 3, 2, 1]], 1));
    assert_eq!(mesh.groups, [group("2", &[1, 2, 3]), group("6", &[0, 1, 2, 3, 4])]);
    let warning = "5 nodes on edges are a corner, the node of another edge or the second one of theirs: these edges are taken straight";
    assert_eq!(mesh.warnings, [warning]);
}

#[test]
fn version_1_has_its_own_sections_and_rows() {
    let text = "$NOD\n5\n10 0 0 0\n3 1 0 0\n70000 0 1 0\n4 0.25 -2.5e-3 1\n11 1 1 1.5\n$ENDNOD\n$ELM\n3\n\
                1 2 1 9 3 70000 10 3\n2 4 7 1 4 10 3 70000 4\n3 4 3 1 4 3 70000 4 11\n$ENDELM\n";
    let file = parse(text.as_bytes(), Path::new("m.msh")).unwrap();
    assert_eq!(file.format, "Gmsh 1, text");
    assert_eq!(file.elements.into_iter().collect::<Vec<_>>(), [("tetrahedra", 2), ("triangles", 1)]);
    assert_eq!(file.mesh.nodes, POSITIONS.map(DVec3::from));
    assert_eq!(file.mesh.tets, [[0, 1, 2, 3], [1, 2, 3, 4]]);
    assert_eq!(
        (file.mesh.regions, file.mesh.tet_regions),
        (vec![region(3, None), region(7, None)], vec![1, 0])
    );
    assert_eq!(
        file.mesh.groups,
        [group("1", &[0, 1, 2]), group("3", &[1, 2, 3, 4]), group("7", &[0, 1, 2, 3])]
    );
    assert_eq!(
        message(text.replace("7 1 4 10", "7 1 5 10")),
        "m.msh: line 12: tetrahedra of this type have 4 nodes, found 5"
    );
    assert_eq!(
        message(text.replace("$ENDELM", "")),
        "m.msh: line 13: expected $ENDELM after 3 elements, found the end of the file"
    );
}

#[test]
fn tetrahedra_of_no_physical_volume_are_in_region_0() {
    let mesh = read(v2_with(&["1 4 0 1 2 3 4", "2 4 2 0 1 1 2 3 4"])).unwrap();
    assert_eq!(mesh.regions, [region(0, None)]);
    assert_eq!(mesh.tet_regions, [0, 0]);
    assert_eq!(mesh.groups, []);
    let mesh = read(v4_with(["", "0"])).unwrap();
    assert_eq!(mesh.regions, [region(0, None)]);
    assert_eq!(mesh.groups, []);
}

#[test]
fn an_entity_is_in_the_groups_of_all_its_tags_and_in_the_region_of_the_first() {
    let mesh = read(v4_with(["9 4", "-4 9"])).unwrap();
    assert_eq!(mesh.regions, [region(4, None), region(9, None)]);
    assert_eq!(mesh.tet_regions, [1, 0]);
    let all = [0, 1, 2, 3, 4];
    assert_eq!(mesh.groups, [group("4", &all), group("9", &all)]);
}

#[test]
fn a_tetrahedron_that_2_2_lists_for_each_of_its_volumes_is_kept_once() {
    let rows = ["1 4 1 7 1 2 3 4", "2 4 1 9 1 2 3 4", "3 4 1 9 2 1 4 3"];
    let mesh = read(v2_with(&rows)).unwrap();
    assert_eq!(mesh.tets, [[0, 1, 2, 3], [1, 0, 3, 2]]);
    assert_eq!(mesh.regions, [region(7, None), region(9, None)]);
    assert_eq!(mesh.tet_regions, [0, 1]);
    let all = [0, 1, 2, 3];
    assert_eq!(mesh.groups, [group("7", &all), group("9", &all)]);
    let warning = "elements listed again under another physical volume: 1; each is kept once, in \
                  the volume listed first";
    assert_eq!(mesh.warnings, [warning]);
}

#[test]
fn groups_of_one_name_are_joined_with_a_warning() {
    let mesh = read(v2_with(&["1 15 1 2 4", "2 1 1 2 1 2", "3 15 1 1 3"])).unwrap();
    assert_eq!(mesh.groups, [group("1", &[2]), group("2", &[0, 1, 3])]);
    let warning = "physical group 2 of dimension 1 and another are both called '2': their nodes \
                  are joined";
    assert_eq!(mesh.warnings, [warning]);
}

#[test]
fn blocks_of_unlisted_entities_are_reported() {
    let text = v4_with(["5", "6"]).replace("3 2 4 1\n", "3 20 4 1\n");
    let mesh = read(text).unwrap();
    assert_eq!(mesh.tet_regions, [1, 0]);
    assert_eq!(mesh.regions, [region(0, None), region(5, None)]);
    let warning = "element blocks of entities that $Entities does not list, as in a partitioned \
                  mesh: 1; they are in no region and no group";
    assert_eq!(mesh.warnings, [warning]);
}

#[test]
fn coordinates_need_not_be_finite() {
    let text = v2_with(&[]).replace("2 1 0 0", "2 nan -inf -nan");
    let mesh = read(text).unwrap();
    let [x, y, z] = mesh.nodes[1].to_array();
    assert!(x.is_nan() && y == f64::NEG_INFINITY && z.is_nan());
}

#[test]
fn what_is_no_mesh_of_these_versions_is_refused() {
    let begin = "expected $MeshFormat, which a gmsh mesh begins with, found";
    let convert = "cannot be read, only 1, 2.2, 4.0 and 4.1: convert it with gmsh OLD.msh -save -format \
                   msh41 -o NEW.msh";
    for (file, expected) in [
        ("", format!("line 1: {begin} the end of the file")),
        (" \r\n\n", format!("line 1: {begin} the end of the file")),
        ("\n$NOD\n", "line 2: expected the number of nodes, found the end of the file".to_owned()),
        ("solid x\n", format!("line 1: {begin} 'solid'")),
        ("\u{1}\u{2}'", format!("line 1: {begin} '\\u{{1}}\\u{{2}}\\''")),
        ("$MeshFormat\n3 0 8\n", format!("line 2: MSH version '3' {convert}")),
        ("$MeshFormat\n1.0 0 8\n", format!("line 2: MSH version '1.0' {convert}")),
        ("$MeshFormat\n2.2 2 8\n", "line 2: file type '2', expected 0 or 1".to_owned()),
        ("$MeshFormat\n2.2 0 4\n", "line 2: data size '4', expected 8".to_owned()),
        (
            "$MeshFormat\n2.2 1 8\n\u{2}\0\0\0\n",
            "byte 20: expected the integer 1 in binary, found bytes [2, 0, 0, 0]".to_owned(),
        ),
        ("$MeshFormat\n2.2 0 8 1\n", "line 2: expected the end of the line, found '1'".to_owned()),
    ] {
        assert_eq!(message(file), format!("m.msh: {expected}"));
    }
}

#[test]
fn counts_that_lie_are_found() {
    let file = v2_with(&["1 4 0 1 2 3 4"]);
    for (from, to, expected) in [
        ("\n4\n1 0", "\n5\n1 0", "line 10: expected a node number, found '$EndNodes'"),
        ("\n4\n1 0", "\n3\n1 0", "line 9: expected $EndNodes after 3 nodes, found '4'"),
        ("\n4\n1 0", "\n-4\n1 0", "line 5: expected the number of nodes, found '-4'"),
        ("\n4\n1 0", "\nx\n1 0", "line 5: expected the number of nodes, found 'x'"),
        (
            "\n4\n1 0",
            "\n99999999999999\n1 0",
            "line 5: the file states 99999999999999 nodes, more than its remaining 83 bytes can \
             hold",
        ),
        ("\n1\n1 4", "\n2\n1 4", "line 14: expected an element number, found '$EndElements'"),
        ("\n1\n1 4", "\n0\n1 4", "line 13: expected $EndElements after 0 elements, found '1'"),
        (
            "\n1\n1 4",
            "\n77\n1 4",
            "line 12: the file states 77 elements, more than its remaining 28 bytes can hold",
        ),
    ] {
        let file = file.replace(from, to);
        assert_eq!(message(file), format!("m.msh: {expected}"));
    }
}

#[test]
fn block_counts_of_4_1_must_agree() {
    let file = v4_with(["1", "2"]);
    for (from, to, expected) in [
        ("\n1 5 1 5\n", "\n1 6 1 5\n", "line 21: the node blocks hold 5 nodes, and 6 are stated"),
        ("\n1 5 1 5\n", "\n1 4 1 5\n", "line 11: the node blocks hold more than the 4 nodes stated"),
        ("\n2 2 1 2\n", "\n2 3 1 2\n", "line 28: the blocks hold 2 elements, and 3 are stated"),
        ("\n2 2 1 2\n", "\n2 1 1 2\n", "line 27: the blocks hold more than the 1 elements stated"),
        ("\n2 2 1 2\n", "\n1 1 1 2\n", "line 27: expected $EndElements after 1 elements, found '3'"),
        ("\n3 2 4 1\n", "\n2 2 4 1\n", "line 27: tetrahedra in a block of dimension 2"),
        ("\n3 1 0 5\n", "\n4 1 0 5\n", "line 11: a node block has dimension 4, expected 0 to 3"),
        ("\n3 1 0 5\n", "\n3 1 7 5\n", "line 11: the parametric flag is 7, expected 0 or 1"),
    ] {
        let changed = file.replace(from, to);
        assert_ne!(changed, file);
        assert_eq!(message(changed), format!("m.msh: {expected}"));
    }
}

#[test]
fn rows_that_are_wrong_are_found() {
    let tet = "1 4 0 1 2 3 4";
    for (rows, expected) in [
        ([tet, "1 4 0 1 2 3"], "line 14: expected a node number, found the end of the line"),
        ([tet, "1 4 0 1 2 3 4 4"], "line 14: expected the end of the line, found '4'"),
        ([tet, "1 4 0 1 2 3 5"], "line 14: an element has node 5, which is not in the file"),
        ([tet, "1 4 0 1 2 3 -1"], "line 14: expected a node number, found -1"),
        ([tet, "1 4 0 1 2 3 1.5"], "line 14: expected a node number, found '1.5'"),
        ([tet, "1 34 0 1 2 3 4"], "line 14: unknown element type 34"),
        ([tet, "1 4 -1 1 2 3 4"], "line 14: expected the number of tags, found -1"),
    ] {
        assert_eq!(message(v2_with(&rows)), format!("m.msh: {expected}"));
    }
    for (row, expected) in [
        ("2 1 0", "line 7: expected a coordinate, found the end of the line"),
        ("2 1 0 x", "line 7: expected a coordinate, found 'x'"),
        ("1 1 0 0", "line 7: node 1 is in the file twice"),
    ] {
        let file = v2_with(&[tet]).replace("2 1 0 0", row);
        assert_eq!(message(file), format!("m.msh: {expected}"));
    }
}

#[test]
fn sections_that_are_missing_unended_or_repeated_are_found() {
    let format = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let nodes = "$Nodes\n0\n$EndNodes\n";
    let elements = "$Elements\n0\n$EndElements\n";
    for (sections, expected) in [
        (String::new(), "line 3: the file has no $Nodes"),
        (nodes.to_owned(), "line 6: the file has no $Elements"),
        (elements.to_owned(), "line 4: $Elements comes before $Nodes"),
        (nodes.repeat(2), "line 7: $Nodes is in the file twice"),
        ("$X\n1\n$EndXY\n".to_owned(), "line 5: this section has no $EndX"),
        ("$EndX\n".to_owned(), "line 4: expected a section such as $Nodes, found '$EndX'"),
        ("Nodes\n".to_owned(), "line 4: expected a section such as $Nodes, found 'Nodes'"),
        ("$Nodes\n0\n".to_owned(), "line 5: expected $EndNodes after 0 nodes, found the end of the file"),
        (
            "$ParametricNodes\n".to_owned(),
            "line 4: $ParametricNodes cannot be read: save without parametric nodes",
        ),
        (
            "$PhysicalNames\n1\n2 1 grip\n$EndPhysicalNames\n".to_owned(),
            "line 6: expected a name in quotes, found 'grip'",
        ),
    ] {
        assert_eq!(message(format!("{format}{sections}")), format!("m.msh: {expected}"));
    }
}

#[test]
fn errors_in_a_binary_file_say_the_byte() {
    let mut bytes = file(Msh::V41, Little);
    let nodes = bytes.windows(7).position(|w| w == b"$Nodes\n").unwrap() + 7;
    bytes[nodes + 15] = 0x7f;
    assert_eq!(
        message(&bytes),
        format!(
            "m.msh: byte {}: the file states 9151314442816847877 nodes, more than its remaining \
             {} bytes can hold",
            nodes + 8,
            bytes.len() - nodes - 16
        )
    );
}

#[test]
fn many_tags_on_many_nodes_are_refused() {
    let tags: Vec<_> = (1..2000).map(|n: u32| n.to_string()).collect();
    let tags = tags.join(" ");
    let elements = v4_with([&tags, ""]);
    assert!(read(elements).is_ok());

    let count = 2000;
    let rows: String = (1..=count).map(|n| format!("{n}\n")).collect();
    let positions = "0 0 0\n".repeat(count);
    let points: String = (1..=count).map(|n| format!("{n} {n}\n")).collect();
    let file = format!(
        "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Entities\n1 0 0 0\n1 0 0 0 1999 {tags}\n\
         $EndEntities\n$Nodes\n1 {count} 1 {count}\n0 1 0 {count}\n{rows}{positions}$EndNodes\n\
         $Elements\n1 {count} 1 {count}\n0 1 15 {count}\n{points}$EndElements\n"
    );
    assert_eq!(message(file), "m.msh: line 6015: too many physical tags on the same entities");
}

#[test]
fn a_file_cut_anywhere_before_its_end_is_an_error() {
    for (version, encoding) in VARIANTS {
        let bytes = file(version, encoding);
        let end = b"$EndElements";
        let end = bytes.windows(end.len()).position(|w| w == end).unwrap() + end.len();
        for length in 0..bytes.len() {
            assert!(read(&bytes[..length]).is_err() || length >= end, "{length}");
        }
    }
}

#[test]
fn damaged_files_do_not_panic() {
    let mut random = XorShift(0x9e37_79b9_7f4a_7c15);
    for (version, encoding) in VARIANTS {
        let bytes = file(version, encoding);
        for _ in 0..3000 {
            let _ = read(random.damage(&bytes));
        }
    }
}
