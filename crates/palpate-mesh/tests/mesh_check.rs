//! `Mesh::checked`: what passes, is oriented, gives a warning, and is refused. `Mesh::merge_coincident_nodes`.

use glam::DVec3;
use palpate_mesh::{Mesh, MeshError, NodeGroup, ball_mesh, box_mesh};
use proptest::prelude::*;

/// A sum of a few hundred volumes keeps all but the last three digits of f64.
const SUMMED: f64 = 1e-13;

/// A cube of 0.1 m with 40 tetrahedra and 27 nodes.
fn cube() -> Mesh {
    box_mesh([0.1; 3], [2; 3]).expect("a good box")
}

/// A cube of 0.1 m in five tetrahedra: 0 owns node 0 alone and joins tetrahedron 4, the middle one, by nodes 1, 2, 4.
fn cell() -> Mesh {
    box_mesh([0.1; 3], [1; 3]).expect("a good box")
}

fn sound(mesh: Mesh) -> Mesh {
    mesh.checked().expect("a sound mesh")
}

fn refusal(mesh: Mesh) -> String {
    mesh.checked().expect_err("an unusable mesh").to_string()
}

fn volumes(mesh: &Mesh) -> impl Iterator<Item = f64> {
    mesh.tets.iter().map(|tet| {
        let [a, b, c, d] = tet.map(|node| mesh.nodes[node as usize]);
        (b - a).cross(c - a).dot(d - a) / 6.0
    })
}

/// Two meshes in one, the second moved by `shift`; nothing is joined.
fn beside(mut mesh: Mesh, other: &Mesh, shift: DVec3) -> Mesh {
    let first = mesh.nodes.len() as u32;
    mesh.nodes.extend(other.nodes.iter().map(|&node| node + shift));
    mesh.tets.extend(other.tets.iter().map(|tet| tet.map(|node| node + first)));
    mesh.tet_regions.extend(&other.tet_regions);
    mesh
}

/// The tetrahedra of a mesh, each with four nodes of its own.
fn torn(mesh: &Mesh) -> Mesh {
    let nodes = mesh.tets.iter().flatten().map(|&node| mesh.nodes[node as usize]).collect();
    let tets = (0..mesh.tets.len() as u32).map(|at| [0, 1, 2, 3].map(|corner| 4 * at + corner)).collect();
    Mesh { nodes, tets, ..mesh.clone() }
}

#[test]
fn a_sound_mesh_passes_unchanged_and_without_warnings() {
    for mesh in [cube(), ball_mesh(0.05, 3).expect("a good ball")] {
        assert_eq!(sound(mesh.clone()), mesh);
    }
}

#[test]
fn inverted_tetrahedra_are_turned_and_counted() {
    let mut inverted = cube();
    inverted.tets.iter_mut().for_each(|tet| tet.swap(2, 3));
    let turned = sound(inverted);
    assert_eq!(turned.tets, cube().tets);
    let warning = "40 of 40 tetrahedra were inverted (corners in the other order) and were turned";
    assert_eq!(turned.warnings, [warning]);

    let mut inverted = cube();
    inverted.tets[17].swap(0, 1);
    let turned = sound(inverted);
    assert!(volumes(&turned).all(|volume| volume > 0.0));
    let warning = "1 of 40 tetrahedra were inverted (corners in the other order) and were turned";
    assert_eq!(turned.warnings, [warning]);
}

#[test]
fn a_vertex_pushed_through_the_opposite_face_is_a_fold() {
    let mut mesh = cell();
    mesh.nodes[0] = DVec3::ZERO;
    assert_eq!(
        refusal(mesh),
        "1 faces have both their tetrahedra on the same side: the mesh is inverted or folded there, first tetrahedra 0 \
         and 4 (counted from 0) near (-1.2500e-2, -1.2500e-2, -1.2500e-2) m"
    );
}

#[test]
fn a_tetrahedron_that_stands_twice_is_refused() {
    let mut mesh = cell();
    // In another order of its corners, too.
    let [a, b, c, d] = mesh.tets[0];
    mesh.tets.push([c, a, b, d]);
    mesh.tet_regions.push(0);
    assert_eq!(
        refusal(mesh),
        "1 tetrahedra are duplicated (the same four nodes), first tetrahedra 0 and 5 (counted from 0) near \
         (-2.5000e-2, -2.5000e-2, -2.5000e-2) m"
    );
}

#[test]
fn three_tetrahedra_on_one_face_overlap() {
    let mut mesh = cell();
    mesh.nodes.push(DVec3::splat(-0.03));
    mesh.tets.push([8, 4, 2, 1]);
    mesh.tet_regions.push(0);
    assert_eq!(
        refusal(mesh),
        "1 faces belong to more than two tetrahedra: parts of the mesh overlap, first tetrahedra 0 and 5 (counted from \
         0) near (-2.5000e-2, -2.5000e-2, -2.5000e-2) m"
    );
}

#[test]
fn flat_tetrahedra_and_repeated_nodes_are_refused() {
    let mut mesh = cell();
    mesh.tets[0][1] = 0;
    assert_eq!(
        refusal(mesh),
        "1 tetrahedra are flat or repeat a node, first tetrahedron 0 (nodes [0, 0, 2, 1], all counted from 0) near \
         (-5.0000e-2, -2.5000e-2, -2.5000e-2) m"
    );
    let mut mesh = cell();
    mesh.nodes[0] = (mesh.nodes[1] + mesh.nodes[2] + mesh.nodes[4]) / 3.0;
    assert_eq!(
        refusal(mesh),
        "1 tetrahedra are flat or repeat a node, first tetrahedron 0 (nodes [0, 4, 2, 1], all counted from 0) near \
         (-1.6667e-2, -1.6667e-2, -1.6667e-2) m"
    );
}

#[test]
fn nodes_that_are_not_finite_or_do_not_exist_are_named() {
    let mut mesh = cell();
    mesh.nodes[7].y = f64::NAN;
    assert_eq!(
        refusal(mesh),
        "node 7 is at [0.05, NaN, 0.05], which is not finite (in tetrahedron 1; both counted from 0)"
    );
    let mut mesh = cell();
    mesh.nodes[3].z = f64::NEG_INFINITY;
    assert_eq!(
        refusal(mesh),
        "node 3 is at [-0.05, 0.05, -inf], which is not finite (in tetrahedron 3; both counted from 0)"
    );
    let mut mesh = cell();
    mesh.tets[2][3] = 8;
    assert_eq!(refusal(mesh), "tetrahedron 2 names node 8 of 8");
}

#[test]
fn errors_are_kinds_with_numbers() {
    let mut mesh = cell();
    mesh.tets[2][3] = 8;
    let error = mesh.checked().expect_err("an unusable mesh");
    assert!(matches!(error, MeshError::NodeNumber { tetrahedron: 2, node: 8, nodes: 8 }), "{error:?}");
    let error = beside(cell(), &cube(), DVec3::X).checked().expect_err("an unusable mesh");
    assert!(matches!(error, MeshError::Disconnected { pieces: 2, coincident: None, .. }), "{error:?}");
}

#[test]
fn a_mesh_without_tetrahedra_is_refused() {
    let text = "the mesh has no tetrahedra; palpate needs a volume mesh, not a surface";
    assert_eq!(refusal(Mesh::default()), text);
    assert_eq!(refusal(Mesh { tets: Vec::new(), tet_regions: Vec::new(), ..cube() }), text);
}

#[test]
fn separate_bodies_are_refused_with_the_place_of_each() {
    let mesh = beside(cell(), &cube(), DVec3::X);
    assert_eq!(
        refusal(mesh),
        "the mesh is disconnected: 2 pieces that share no face (5 tetrahedra near (-2.5000e-2, -2.5000e-2, -2.5000e-2) \
         m, 40 tetrahedra near (9.6250e-1, -3.7500e-2, -3.7500e-2) m); --piece largest keeps the largest, --piece N another (palpate mesh lists them)"
    );
}

#[test]
fn bodies_that_share_only_an_edge_or_a_node_are_refused() {
    for (shift, shared) in [(DVec3::new(0.1, 0.1, 0.0), 2), (DVec3::splat(0.1), 1)] {
        let mut mesh = beside(cell(), &cell(), shift);
        let apart = refusal(mesh.clone());
        assert!(
            apart.starts_with("the mesh is disconnected: 2 pieces that share no face (5 tetrahedra near ")
                && apart.contains("lie on the same point, --merge-nodes joins such nodes"),
            "{apart}"
        );
        assert_eq!(mesh.merge_coincident_nodes(), shared);
        let joined = refusal(mesh);
        assert!(
            joined.starts_with("the mesh is disconnected: 2 pieces that share no face (5 tetrahedra near ")
                && joined.ends_with(
                    "); --piece largest keeps the largest, --piece N another (palpate mesh lists them)"
                ),
            "{joined}"
        );
    }
}

#[test]
fn tetrahedra_with_own_nodes_are_refused_and_sound_once_merged() {
    let mut mesh = torn(&cell());
    assert_eq!(
        refusal(mesh.clone()),
        "the mesh is disconnected: 5 pieces that share no face (1 tetrahedra near (-2.5000e-2, -2.5000e-2, -2.5000e-2) \
         m, 1 tetrahedra near (2.5000e-2, 2.5000e-2, -2.5000e-2) m, 1 tetrahedra near (2.5000e-2, -2.5000e-2, 2.5000e-2) \
         m, 1 tetrahedra near (-2.5000e-2, 2.5000e-2, 2.5000e-2) m, …); nodes 2 and 5 lie on the same point, \
         --merge-nodes joins such nodes"
    );
    // 20 corners on 8 points.
    assert_eq!(mesh.merge_coincident_nodes(), 12);
    let merged = sound(mesh);
    assert_eq!(merged.warnings, ["12 nodes belong to no tetrahedron and are left out"]);
    assert_eq!(merged.boundary().len(), 12);
    let volume: f64 = volumes(&merged).sum();
    assert!((volume / 1e-3 - 1.0).abs() < SUMMED, "{volume}");
}

#[test]
fn merging_bridges_the_rounding_of_a_file_and_nothing_wider() {
    // Shifts of 2e-7 and 2e-5 of the diagonal, to both sides of a tolerance of 1e-6.
    for (shift, joins) in [(2e-7 * 0.1 * 3_f64.sqrt(), true), (2e-5 * 0.1 * 3_f64.sqrt(), false)] {
        let mut mesh = torn(&cube());
        mesh.nodes.iter_mut().skip(1).step_by(3).for_each(|node| node.x += shift);
        mesh.nodes.iter_mut().skip(2).step_by(3).for_each(|node| node.z -= shift);
        mesh.merge_coincident_nodes();
        let merged = mesh.checked();
        assert_eq!(merged.is_ok(), joins, "shift {shift}: {merged:?}");
        if let Ok(mesh) = merged {
            let surface = mesh.boundary();
            assert_eq!(surface.len(), 6 * 4 * 2, "the surface of a whole cube");
        }
    }
}

#[test]
fn merging_a_sound_mesh_changes_nothing() {
    let mut mesh = cube();
    mesh.groups.push(NodeGroup { name: "foot".into(), nodes: vec![0, 1, 2] });
    let before = mesh.clone();
    assert_eq!(mesh.merge_coincident_nodes(), 0);
    assert_eq!(mesh, before);
}

#[test]
fn groups_follow_their_nodes_when_these_are_merged() {
    let mut mesh = torn(&cell());
    let foot = |mesh: &Mesh| {
        (0..mesh.nodes.len() as u32).filter(|&n| mesh.nodes[n as usize].x < 0.0).collect::<Vec<_>>()
    };
    mesh.groups.push(NodeGroup { name: "foot".into(), nodes: foot(&mesh) });
    assert_eq!(mesh.groups[0].nodes.len(), 10);
    mesh.merge_coincident_nodes();
    let nodes = &mesh.groups[0].nodes;
    assert!(nodes.len() == 4 && nodes.is_sorted_by(|a, b| a < b), "{nodes:?}");
    assert!(nodes.iter().all(|node| mesh.tets.iter().flatten().any(|used| used == node)));
}

#[test]
fn a_slit_gets_a_warning_and_stays_open_until_merged() {
    // The right half uses its own copy of the node in the middle of an edge of the cube: faces there come apart, the
    // halves still join through the others.
    let mut mesh = cube();
    let middle = DVec3::new(0.0, 0.05, 0.05);
    let node = mesh.nodes.iter().position(|p| *p == middle).expect("a node at the middle") as u32;
    let copy = mesh.nodes.len() as u32;
    mesh.nodes.push(middle);
    let right = |mesh: &Mesh, tet: &[u32; 4]| tet.iter().any(|&n| mesh.nodes[n as usize].x > 0.0);
    let nodes = mesh.clone();
    for tet in mesh.tets.iter_mut().filter(|tet| right(&nodes, tet)) {
        tet.iter_mut().filter(|n| **n == node).for_each(|n| *n = copy);
    }
    let open = sound(mesh.clone());
    assert_eq!(
        open.warnings,
        [format!(
            "1 pairs of nodes lie on the same point (nodes {node} and {copy}, counted from 0, at (0.0000e0, 5.0000e-2, \
             5.0000e-2) m): the body is slit open there. If it should not be, use --merge-nodes"
        )]
    );
    assert!(open.boundary().len() > 48, "the slit has faces of its own");
    assert_eq!(mesh.merge_coincident_nodes(), 1);
    assert_eq!(sound(mesh).boundary().len(), 48);
}

#[test]
fn unused_nodes_get_a_warning_wherever_they_are() {
    let mut mesh = cube();
    mesh.nodes.extend([DVec3::splat(1e4), DVec3::ZERO, DVec3::splat(f64::NAN)]);
    assert_eq!(sound(mesh).warnings, ["3 nodes belong to no tetrahedron and are left out"]);
}

#[test]
fn sizes_that_look_like_another_unit_get_a_warning() {
    let warnings =
        |size| sound(box_mesh([size, 0.5 * size, 0.5 * size], [2; 3]).expect("a good box")).warnings;
    assert_eq!(warnings(10.0), ["the body is 10 m large; if the file is in millimetres, use --scale 0.001"]);
    assert_eq!(warnings(1e-5), ["the body is only 0.00001 m large; is the scale right? (--scale)"]);
    let odd = ["the body is 180.2 m large; if the file is in millimetres, use --scale 0.001"];
    assert_eq!(warnings(180.239997863), odd);
    let question = |size, scale| box_mesh([size; 3], [2; 3]).expect("a good box").unit_question(scale);
    let text = |size, scale| question(size, scale).unwrap_or_default();
    assert_eq!(
        text(0.08, 1e3),
        "the body is 80 m large with --scale 1000; if the file is in metres, use --scale 1"
    );
    assert_eq!(
        text(80.0, 1e3),
        "the body is 80000 m large with --scale 1000; if the file is in millimetres, use --scale 0.001"
    );
    assert_eq!(
        text(0.08, 1e-3),
        "the body is only 0.00008 m large with --scale 0.001; if the file is in metres, use --scale 1"
    );
    assert_eq!(
        text(80.0, 1e-6),
        "the body is only 0.00008 m large with --scale 1e-6; if the file is in millimetres, use --scale 0.001"
    );
    assert_eq!(text(8e4, 1.0), "the body is 80000 m large; if the file is in micrometres, use --scale 1e-6");
    assert_eq!([question(0.08, -1.0), question(0.08, 0.0)], [None, None], "the scale itself is refused");
    // Whoever has been asked is not asked again.
    let mut asked = box_mesh([180.0; 3], [2; 3]).expect("a good box");
    assert!(asked.unit_question(1.0).is_some() && asked.unit_question(1e-3).is_none());
    asked.is_unit_asked = true;
    assert!(sound(asked).warnings.is_empty());
    assert!(warnings(3.0).is_empty() && warnings(1e-3).is_empty());
}

#[test]
fn slivers_get_a_warning_with_the_worst_and_its_quality() {
    // Node 0 at a height above the middle of the face of nodes 1, 2, 4, which has three sides of 0.1·√2 m.
    let (height, side_squared) = (1e-4, 0.02);
    let mut mesh = cell();
    let middle = (mesh.nodes[1] + mesh.nodes[2] + mesh.nodes[4]) / 3.0;
    mesh.nodes[0] = middle - DVec3::ONE.normalize() * height;
    let area = 3_f64.sqrt() / 4.0 * side_squared;
    let squares = 3.0 * side_squared + 3.0 * (side_squared / 3.0 + height * height);
    let quality = 12.0 * (area * height).powf(2.0 / 3.0) / squares;
    assert_eq!(
        sound(mesh).warnings,
        [format!(
            "1 tetrahedra are slivers, the worst is 0 near (-1.6681e-2, -1.6681e-2, -1.6681e-2) m with quality \
             {quality:.4} (1 is regular): responses are too stiff there"
        )]
    );
}

#[test]
fn the_boundary_is_closed_looks_outward_and_holds_the_volume() {
    for mesh in [cube(), cell(), ball_mesh(0.05, 2).expect("a good ball")] {
        let triangles = mesh.boundary();
        let mut edges: Vec<_> = triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        edges.sort_unstable();
        for [a, b] in &edges {
            assert_eq!(edges.iter().filter(|edge| **edge == [*a, *b]).count(), 1);
            assert!(edges.binary_search(&[*b, *a]).is_ok(), "edge {a} {b} has one triangle");
        }
        // V = ⅓·∮ x·n dA, by Gauss.
        let corners = |t: &[u32; 3]| t.map(|node| mesh.nodes[node as usize]);
        let enclosed: f64 = triangles
            .iter()
            .map(|t| {
                let [a, b, c] = corners(t);
                a.dot(b.cross(c)) / 6.0
            })
            .sum();
        let filled: f64 = volumes(&mesh).sum();
        assert!((enclosed / filled - 1.0).abs() < SUMMED, "{enclosed} {filled}");
    }
}

proptest! {
    #[test]
    fn the_order_of_corners_does_not_matter(swaps in prop::collection::vec((0..40_usize, 0..4_usize, 0..4_usize), 0..60)) {
        let mut mesh = cube();
        for (tet, a, b) in swaps {
            mesh.tets[tet].swap(a, b);
        }
        let mesh = sound(mesh);
        prop_assert!(volumes(&mesh).all(|volume| volume > 0.0));
        prop_assert_eq!(mesh.boundary().len(), 48);
    }

    #[test]
    fn damaged_meshes_are_refused_or_made_sound_and_never_panic(
        numbers in prop::collection::vec((0..40_usize, 0..4_usize, 0..29_u32), 0..4),
        places in prop::collection::vec(
            (0..27_usize, 0..3_usize, prop_oneof![-0.1..0.1, Just(f64::NAN), Just(1e90), Just(-1e-200)]), 0..3),
        merge in any::<bool>(),
    ) {
        let mut mesh = cube();
        for (tet, corner, node) in numbers {
            mesh.tets[tet][corner] = node;
        }
        for (node, axis, value) in places {
            mesh.nodes[node][axis] = value;
        }
        if merge {
            mesh.merge_coincident_nodes();
        }
        if let Ok(mesh) = mesh.checked() {
            prop_assert!(volumes(&mesh).all(|volume| volume > 0.0 && volume.is_finite()));
        }
    }
}
