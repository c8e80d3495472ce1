//! Tetrahedra made of surfaces: clean, sharp, thin, in pieces, broken.

mod refusals;
mod shapes;

use glam::DVec3;
use palpate_mesh::{
    Mesh, MeshingParameters, MeshingReport, PieceChoice, Repair, SurfaceMesh, tetrahedralise,
};
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

/// Bounds that every body meets [°]; the lattice alone guarantees 10.7° to 164.8° on smooth ones.
const ANGLES_DEG: [f64; 2] = [25.0, 155.0];

fn filled(surface: &SurfaceMesh, cell_size: Option<f64>) -> (Mesh, MeshingReport) {
    let watch = &mut |_| ControlFlow::Continue(());
    tetrahedralise(surface, &MeshingParameters { cell_size, nodes: None, curved: false }, watch)
        .expect("a surface with an inside")
}

/// Signed volume of all tetrahedra [m³].
fn volume(mesh: &Mesh) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|node| mesh.nodes[node as usize]);
        (b - a).cross(c - a).dot(d - a) / 6.0
    };
    mesh.tets.iter().map(of).sum()
}

/// The boundary is a closed manifold about tetrahedra that do not overlap, and the angles are good.
fn assert_sound(name: &str, mesh: &Mesh, report: &MeshingReport) {
    let boundary = SurfaceMesh { positions: mesh.nodes.clone(), triangles: mesh.boundary() };
    let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
    let mut links: HashMap<u32, Vec<[u32; 2]>> = HashMap::new();
    for &[a, b, c] in &boundary.triangles {
        for [from, to, other] in [[a, b, c], [b, c, a], [c, a, b]] {
            *edges.entry([from, to]).or_default() += 1;
            links.entry(other).or_default().push([from, to]);
        }
    }
    assert!(edges.iter().all(|(&[a, b], &count)| count == 1 && edges.contains_key(&[b, a])), "{name}: edges");
    // The triangles about a node are one ring.
    for ring in links.values() {
        let (mut at, mut length) = (ring[0][1], 1);
        while at != ring[0][0] {
            at = ring.iter().find(|[from, _]| *from == at).expect("a closed ring")[1];
            length += 1;
        }
        assert_eq!(length, ring.len(), "{name}: rings");
    }
    // By the divergence theorem: an inverted tetrahedron would count twice.
    assert!((volume(mesh) / boundary.volume() - 1.0).abs() < 1e-9, "{name}");
    let [least, most] = report.dihedral_range_deg;
    assert!(least > ANGLES_DEG[0] && most < ANGLES_DEG[1], "{name}: {least} to {most}");
    assert_eq!((mesh.nodes.len(), mesh.tets.len()), (report.nodes, report.tetrahedra));
}

#[test]
fn clean_bodies_are_filled_to_their_surface() {
    // Volume error, 95th percentile and maximum of the distance in cells: chords of a ball cut off a share of (cell/radius)², and the
    // lattice leaves some edges of some boxes chamfered.
    let bodies = [
        ("ball", shapes::ball(), 0.01, [0.05, 0.1]),
        ("torus", shapes::torus(), 0.02, [0.1, 0.3]),
        ("box", shapes::slab([0.1, 0.07, 0.05]), 5e-4, [0.01, 0.35]),
        ("cube", shapes::slab([0.1; 3]), 5e-4, [0.01, 0.35]),
        ("plate", shapes::slab([0.2, 0.2, 0.004]), 0.003, [0.01, 0.4]),
    ];
    for (name, surface, volume_error, [most, all]) in bodies {
        let (mesh, report) = filled(&surface, None);
        assert_sound(name, &mesh, &report);
        let error = report.volume_error.expect("no overlap");
        assert!(error.abs() < volume_error, "{name}: {error}");
        assert!((volume(&mesh) / surface.volume() - 1.0 - error).abs() < 1e-9, "{name}");
        let [p95, max] = report.distance_cells;
        assert!(p95 < most && max < all, "{name}: {p95} {max}");
        let nodes = if name == "plate" { 10_000..16_000 } else { 1_500..3_000 };
        assert!(nodes.contains(&report.nodes), "{name}: {} nodes", report.nodes);
        let told = mesh.warnings.len();
        let checked = mesh.checked().expect("a sound body");
        assert_eq!((told, checked.warnings.len()), (1, 1), "{name}: {:?}", checked.warnings);
    }
}

#[test]
fn a_body_has_about_as_many_nodes_as_are_asked_for() {
    for nodes in [150, 600, 5000] {
        for (name, surface) in [("ball", shapes::ball()), ("box", shapes::slab([0.1, 0.06, 0.04]))] {
            let watch = &mut |_| ControlFlow::Continue(());
            let parameters = MeshingParameters { cell_size: None, nodes: Some(nodes), curved: false };
            let (mesh, _) = tetrahedralise(&surface, &parameters, watch).expect("a surface with an inside");
            let share = mesh.nodes.len() as f64 / f64::from(nodes);
            assert!((0.7..1.4).contains(&share), "{name}: {} of {nodes}", mesh.nodes.len());
        }
    }
}

#[test]
fn the_volume_of_a_ball_converges_with_the_square_of_the_cell() {
    let surface = shapes::ball();
    let error = |cell: f64| filled(&surface, Some(cell)).1.volume_error.expect("no overlap");
    let (coarse, fine) = (error(0.02), error(0.01));
    let order = (coarse / fine).log2();
    assert!((1.7..2.6).contains(&order), "{coarse} {fine}: order {order}");
}

#[test]
fn a_broken_surface_is_repaired_and_told() {
    let (clean, _) = filled(&shapes::torus(), None);
    let (mesh, report) = filled(&shapes::broken_torus(), None);
    assert_sound("broken torus", &mesh, &report);
    assert_eq!(
        mesh.warnings[..4],
        [
            "1 triangles had corners on one point and were left out",
            "1 triangles stood twice and were left out the second time",
            "40 triangles faced the other way than their neighbours and were turned",
            "the surface is open at 15 edges, by 0.10 % of its area: the holes were closed smoothly"
        ]
    );
    assert!(mesh.warnings[4].starts_with("the surface was filled with "), "{}", mesh.warnings[4]);
    assert_eq!(mesh.warnings.len(), 5);
    assert!((volume(&mesh) / volume(&clean) - 1.0).abs() < 0.005);
    assert_eq!(mesh.pieces().len(), 1);
}

#[test]
fn parts_that_intersect_are_united() {
    for (name, mut surface) in [("clean", shapes::torus()), ("broken", shapes::broken_torus())] {
        let (single, _) = filled(&surface, Some(0.015));
        shapes::add(&mut surface, &shapes::torus(), DVec3::new(0.03, 0.02, 0.015));
        let (mesh, report) = filled(&surface, Some(0.015));
        assert_sound(name, &mesh, &report);
        assert_eq!((mesh.pieces().len(), report.volume_error), (1, None), "{name}");
        let ratio = volume(&mesh) / volume(&single);
        assert!((1.2..1.8).contains(&ratio), "{name}: {ratio}");
    }
    // Two cubes that overlap by half a side: 1.5 volumes of one.
    let mut cubes = shapes::slab([0.1; 3]);
    shapes::add(&mut cubes, &shapes::slab([0.1; 3]), DVec3::new(0.05, 0.0, 0.0));
    let (mesh, report) = filled(&cubes, None);
    assert_sound("cubes", &mesh, &report);
    assert!((volume(&mesh) / 1.5e-3 - 1.0).abs() < 0.005, "{}", volume(&mesh));
}

#[test]
fn parts_that_face_inwards_are_turned_unless_they_are_cavities() {
    let mut surface = shapes::ball();
    let mut cavity = shapes::ball();
    cavity.positions.iter_mut().for_each(|position| *position *= 0.5);
    cavity.flip_orientation();
    shapes::add(&mut surface, &cavity, DVec3::ZERO);
    let (mesh, report) = filled(&surface, None);
    assert_sound("hollow ball", &mesh, &report);
    assert_eq!(mesh.warnings.len(), 1);
    let hollow = TAU * 2.0 / 3.0 * 0.05_f64.powi(3) * (1.0 - 0.125);
    assert!((volume(&mesh) / hollow - 1.0).abs() < 0.02);

    surface.flip_orientation();
    let (turned, _) = filled(&surface, None);
    assert_eq!(turned.warnings[0], "the surface faced inwards and was turned");
    assert!((volume(&turned) / hollow - 1.0).abs() < 0.02, "{}", volume(&turned) / hollow);
}

#[test]
fn a_part_that_faces_inwards_beside_others_is_turned() {
    let mut surface = shapes::ball();
    surface.flip_orientation();
    shapes::add(&mut surface, &shapes::slab([0.1; 3]), DVec3::X * 0.2);
    let (mesh, report) = filled(&surface, None);
    assert_sound("ball and box", &mesh, &report);
    assert_eq!(mesh.warnings[0], "1 parts of the surface faced inwards and were turned");
    assert_eq!(mesh.pieces().len(), 2);
}

#[test]
fn two_bodies_are_two_pieces_to_choose_from() {
    let mut surface = shapes::ball();
    shapes::add(&mut surface, &shapes::ball(), DVec3::X * 0.2);
    let (mut mesh, report) = filled(&surface, None);
    assert_sound("two balls", &mesh, &report);
    assert_eq!(mesh.pieces().len(), 2);
    mesh.repair(&Repair { piece: PieceChoice::Number(2), ..Repair::default() }).expect("two pieces");
    let ball = TAU * 2.0 / 3.0 * 0.05_f64.powi(3);
    assert!((volume(&mesh.checked().expect("one piece")) / ball - 1.0).abs() < 0.02);
}

#[test]
fn the_same_surface_gives_the_same_bits_on_any_number_of_threads() {
    let surface = shapes::broken_torus();
    let once = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| filled(&surface, None))
    };
    let one = once(1);
    for threads in [1, 2, 4] {
        assert!(one == once(threads), "{threads} threads");
    }
}

#[test]
fn corners_of_a_box_are_nodes() {
    let (mesh, _) = filled(&shapes::slab([0.1, 0.07, 0.05]), None);
    for corner in 0..8 {
        let sign = |bit: i32| if corner >> bit & 1 == 1 { 0.5 } else { -0.5 };
        let corner = DVec3::new(sign(0) * 0.1, sign(1) * 0.07, sign(2) * 0.05);
        assert!(mesh.nodes.iter().any(|node| (*node - corner).length() < 1e-12), "{corner}");
    }
}
