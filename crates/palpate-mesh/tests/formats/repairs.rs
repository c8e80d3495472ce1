//! `Mesh::repair`: what is repaired, what is chosen, and what is told.

use crate::body::{body, total_volume};
use glam::DVec3;
use palpate_mesh::{MergeNodes, Mesh, PieceChoice, Repair};

/// Two boxes with nodes of their own, the second moved along x [m].
fn two(shift: f64) -> Mesh {
    let mut mesh = body();
    let other = body();
    let first = mesh.nodes.len() as u32;
    mesh.nodes.extend(other.nodes.iter().map(|&node| 0.5 * node + DVec3::X * shift));
    mesh.tets.extend(other.tets.iter().map(|tet| tet.map(|node| node + first)));
    mesh.tet_regions.extend(vec![1; other.tets.len()]);
    mesh
}

fn repaired(mut mesh: Mesh, choices: &Repair) -> Mesh {
    mesh.repair(choices).expect("a mesh that can be repaired");
    mesh
}

#[test]
fn tetrahedra_that_stand_twice_are_left_out() {
    let mut mesh = body();
    let [a, b, c, d] = mesh.tets[0];
    mesh.tets.push([c, a, b, d]);
    mesh.tet_regions.push(1);
    let mesh = repaired(mesh, &Repair::default());
    assert_eq!((&mesh.tets, &mesh.tet_regions), (&body().tets, &body().tet_regions));
    assert_eq!(
        mesh.warnings,
        [
            "1 tetrahedra stood in the mesh twice (the same four nodes) and were left out, each in the region that comes later"
        ]
    );
    mesh.checked().expect("a sound mesh");
}

#[test]
fn nodes_on_one_point_are_merged_where_that_joins_pieces() {
    let mut torn = body();
    torn.nodes = body().tets.iter().flatten().map(|&node| body().nodes[node as usize]).collect();
    torn.tets =
        (0..body().tets.len() as u32).map(|tet| [0, 1, 2, 3].map(|corner| 4 * tet + corner)).collect();
    torn.groups.clear();
    let joined = repaired(torn.clone(), &Repair::default());
    assert_eq!(
        joined.warnings,
        ["133 nodes lay on others and were merged, which joins 40 pieces into 1 (first nodes 1 and 4, counted from 0, at (-5.0000e-2, \
          0.0000e0, -1.5000e-1) m); --merge-nodes=never keeps them apart"
            .replace("1 and 4, counted from 0, at (-5.0000e-2, 0.0000e0, -1.5000e-1)", &first_pair(&joined.warnings[0]))]
    );
    joined.checked().expect("one sound body");
    let never = Repair { merge_nodes: MergeNodes::Never, ..Repair::default() };
    assert_eq!(repaired(torn.clone(), &never), torn);
}

/// Nodes and their place in a warning: their order is that of the search.
fn first_pair(warning: &str) -> String {
    let begin = warning.find("first nodes ").map_or(0, |at| at + "first nodes ".len());
    let end = warning.find(" m); --merge").unwrap_or(warning.len());
    warning[begin..end].to_owned()
}

#[test]
fn a_slit_through_one_piece_stays_open_unless_all_nodes_are_to_be_merged() {
    // One tetrahedron has a node of its own, and hangs on the face without it.
    let mut slit = body();
    let tet = 35;
    let node = slit.tets[tet][0];
    slit.nodes.push(slit.nodes[node as usize]);
    let shared = slit.tets.iter().filter(|other| other.contains(&node)).count();
    assert!(shared > 1);
    slit.tets[tet][0] = slit.nodes.len() as u32 - 1;
    let kept = repaired(slit.clone(), &Repair::default());
    assert_eq!(kept.tets, slit.tets);
    let always = Repair { merge_nodes: MergeNodes::Always, ..Repair::default() };
    let merged = repaired(slit, &always);
    assert_eq!(merged.tets, body().tets);
    assert!(
        merged.warnings[0].starts_with("1 nodes lay on others and were merged (first nodes "),
        "{:?}",
        merged.warnings
    );
}

#[test]
fn pieces_are_listed_by_volume_and_one_is_kept() {
    let mesh = two(1.0);
    let pieces = mesh.pieces();
    let volumes: Vec<_> = pieces.iter().map(|piece| (piece.volume * 1e6).round()).collect();
    assert_eq!(volumes, [6000.0, 750.0]);
    for (choice, volume, number) in [
        (PieceChoice::Largest, 6e-3, 1),
        (PieceChoice::Number(1), 6e-3, 1),
        (PieceChoice::Number(2), 7.5e-4, 2),
    ] {
        let kept = repaired(mesh.clone(), &Repair { piece: choice, ..Repair::default() });
        let warning = format!(
            "piece {number} of 2 is kept: 40 of 80 tetrahedra, {:.4e} m³, near ",
            pieces[number - 1].volume
        );
        assert!(kept.warnings[0].starts_with(&warning), "{:?}", kept.warnings);
        assert_eq!(kept.nodes.len(), mesh.nodes.len(), "nodes keep their numbers");
        let kept = kept.checked().expect("one sound body");
        assert!((total_volume(&kept) / volume - 1.0).abs() < 1e-12);
        // Regions and groups without anything of the piece have gone.
        assert_eq!(kept.regions.len(), if number == 1 { 2 } else { 1 });
        assert_eq!(kept.groups[0].nodes.is_empty(), number == 2);
    }
    let mut other = mesh.clone();
    assert_eq!(
        other
            .repair(&Repair { piece: PieceChoice::Number(3), ..Repair::default() })
            .expect_err("no such piece")
            .to_string(),
        "piece 3 is to be kept, and the body has 2, counted from 1"
    );
    let each: Vec<_> =
        pieces.iter().map(|piece| mesh.piece(piece).checked().expect("one sound body").tets.len()).collect();
    assert_eq!(each, [40, 40]);
    let error = mesh.checked().expect_err("two pieces").to_string();
    assert!(error.starts_with("the mesh is disconnected: 2 pieces that share no face"), "{error}");
    assert!(
        error.ends_with("; --piece largest keeps the largest, --piece N another (palpate mesh lists them)"),
        "{error}"
    );
}

#[test]
fn nodes_that_cannot_be_used_are_refused_before_anything_is_repaired() {
    let mut mesh = body();
    mesh.nodes[0].x = f64::NAN;
    let error = mesh.repair(&Repair::default()).expect_err("no place").to_string();
    assert!(error.starts_with("node 0 is at [NaN, -0.1, -0.15], which is not finite"), "{error}");
}
