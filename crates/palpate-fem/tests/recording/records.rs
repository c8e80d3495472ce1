//! Content of recordings, closed forms, and refused input.

use glam::DVec3;
use palpate::{Damping, MIN_CONTACT_SAMPLES};
use palpate_fem::{
    ElementOrder, Precision, Progress, RecordError, RecordParameters, RecordedBody, ResidualChoice, record,
};
use palpate_mesh::ball_mesh;
use std::cell::Cell;

use crate::bodies::*;

#[test]
fn the_same_input_gives_the_same_bytes() {
    let bytes = |body: &RecordedBody| body.recording.to_bytes().expect("a good recording");
    let bar = two_material_bar(40);
    let fixed = fixed_bar(ElementOrder::Quadratic, 40);
    for (first, (mesh, parameters)) in [(shared_bar(), bar), (shared_fixed_bar(), fixed)] {
        assert!(bytes(first) == bytes(&recorded(mesh, &parameters)));
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let cube = block([0.1; 3], [6, 6, 6]);
    let ball = ball_mesh(0.05, 4).expect("a good ball");
    // Degenerate modes by symmetry: up to three of the cube, seven of the ball; and the dense route.
    let bodies = [
        ("cube", &cube, parameters(ElementOrder::Linear, 60)),
        ("cube of order 2", &cube, parameters(ElementOrder::Quadratic, 40)),
        ("ball of order 2", &ball, parameters(ElementOrder::Quadratic, 40)),
        ("coarse ball", &ball_mesh(0.05, 2).expect("a good ball"), parameters(ElementOrder::Linear, 60)),
    ];
    for (name, mesh, parameters) in &bodies {
        let bytes = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
            let body = pool.install(|| recorded((*mesh).clone(), parameters));
            body.recording.to_bytes().expect("a good recording")
        };
        let one = bytes(1);
        for threads in [2, 4] {
            assert!(one == bytes(threads), "{name} on {threads} threads");
        }
    }
}

#[test]
fn mass_centre_and_inertia_of_a_box_are_the_closed_forms() {
    const SCALE: f64 = 0.5;
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        let mut mesh = block([0.2, 0.4, 0.6], [2, 3, 2]);
        let offset = DVec3::new(10.0, -20.0, 3.0);
        mesh.nodes.iter_mut().for_each(|node| *node += offset);
        mesh.scale(SCALE).expect("a positive number");
        let recording = recorded(mesh, &parameters(order, 6)).recording;
        let mass = 1000.0 * 0.1 * 0.2 * 0.3;
        assert!((recording.mass() / mass - 1.0).abs() < SUMMED);
        let centre = DVec3::from_array(recording.metadata.mass.center_of_mass_m);
        assert!((centre - offset * SCALE).length() < SUMMED * offset.length(), "{centre}");
        let moment = |a: f64, b: f64| mass / 12.0 * (a * a + b * b);
        let exact = [moment(0.2, 0.3), moment(0.1, 0.3), moment(0.1, 0.2)];
        for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
            let expected = if i == j { exact[i] } else { 0.0 };
            let got = recording.metadata.mass.inertia_kg_m2[i][j];
            // Coordinates of 10 m have lost two digits beside edges of 0.1 m.
            assert!((got - expected).abs() < 100.0 * SUMMED * exact[0], "{i}, {j}: {got} {expected}");
        }
        // The body frame has its origin at the centre of mass.
        let low = recording.surface.positions.iter().copied().reduce(DVec3::min).expect("nodes");
        assert!((low + DVec3::new(0.05, 0.1, 0.15)).length() < SUMMED * offset.length(), "{low}");
    }
}

#[test]
fn gravity_bends_a_fixed_bar_as_its_static_compliance_says() {
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        let (mesh, parameters) = fixed_bar(order, 15);
        let body = recorded(mesh, &parameters);
        let recording = &body.recording;
        let gravity = recording.gravity.as_ref().expect("a fixed body has a gravity response");
        let surface_nodes = body.surface_nodes();
        let uniform = |axis| (0..body.dofs()).map(|dof| f64::from(u8::from(dof % 3 == axis))).collect();
        let weight = body.unreduced().mass_times(&[0, 1, 2].map(uniform));
        let exact = body.unreduced().static_displacements(&weight);
        let m = recording.modes.len();
        for (axis, g) in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().enumerate() {
            for (node, &number) in surface_nodes.iter().enumerate() {
                let modal = |part: usize| -> f64 {
                    let phi = recording.modes.row(node, part);
                    let omegas = &recording.modes.angular_frequencies;
                    (0..m).map(|i| phi[i] * gravity.modal_forces[axis * m + i] / omegas[i].powi(2)).sum()
                };
                let sag = DVec3::new(modal(0), modal(1), modal(2)) + gravity.residual_displacement(node, g);
                let expected =
                    DVec3::from_array([0, 1, 2].map(|part| exact[axis][3 * number as usize + part]));
                assert!((sag - expected).length() < SOLVED * largest(&exact), "{node}: {sag} {expected}");
            }
        }
    }
}

#[test]
fn a_hanging_bar_without_poisson_effect_sags_by_its_weight_over_twice_its_stiffness() {
    // u = ρg/E·(L·s − s²/2) at s from the support: in the space of quadratic elements, so exact at every node.
    let (mesh, parameters) = fixed_bar(ElementOrder::Quadratic, 15);
    let parameters = RecordParameters { materials: vec![isotropic(2e4, 0.0, 1000.0)], ..parameters };
    let recording = recorded(mesh, &parameters).recording;
    let gravity = recording.gravity.expect("a fixed body has a gravity response");
    let (m, end) = (recording.modes.len(), 1000.0 / 2e4 * 0.2 * 0.2 / 2.0);
    for (node, position) in recording.surface.positions.iter().enumerate() {
        let s = position.x + 0.1;
        let exact = DVec3::X * (1000.0 / 2e4 * (0.2 * s - s * s / 2.0));
        let modal = |part: usize| -> f64 {
            let phi = recording.modes.row(node, part);
            let omegas = &recording.modes.angular_frequencies;
            (0..m).map(|i| phi[i] * gravity.modal_forces[i] / omegas[i].powi(2)).sum()
        };
        let sag = DVec3::new(modal(0), modal(1), modal(2)) + gravity.residual_displacement(node, DVec3::X);
        assert!((sag - exact).length() < SOLVED * end, "at {s} m: {sag}, expected {exact}");
    }
}

#[test]
fn quadratic_elements_have_four_triangles_a_face_and_a_closed_surface() {
    let mesh = block([0.1; 3], [2; 3]);
    let (corners, count) = (mesh.nodes.len() as u32, mesh.nodes.len());
    let surface = recorded(mesh, &parameters(ElementOrder::Quadratic, 6)).recording.surface;
    // 6 sides of 4 cells of 2 faces; V − E + F = 2 for a closed surface.
    assert_eq!(surface.triangles.len(), 4 * 6 * 4 * 2);
    let mut edges: Vec<[u32; 2]> =
        surface.triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
    edges.sort_unstable();
    assert!(edges.windows(2).all(|pair| pair[0] != pair[1]), "an edge is passed twice the same way");
    assert!(edges.iter().all(|&[a, b]| edges.binary_search(&[b, a]).is_ok()), "an edge has one triangle");
    assert_eq!(surface.positions.len() + surface.triangles.len(), edges.len() / 2 + 2);
    // All triangles look outward: those of a convex body away from its centre.
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| surface.positions[node as usize]);
        assert!((b - a).cross(c - a).dot(a) > 0.0);
    }
    let mut sources = surface.source_nodes.clone();
    sources.sort_unstable();
    sources.dedup();
    assert_eq!(sources.len(), surface.positions.len());
    // All corner nodes but the middle one are on the surface.
    assert_eq!(sources.iter().filter(|&&node| node < corners).count(), count - 1);
}

#[test]
fn supports_that_do_not_hold_the_body_are_refused() {
    let text =
        "the fixed nodes leave the body free to turn: fix at least three nodes that are not on one line";
    let at_edge = |p: DVec3| p.x < -0.0499 && p.y < -0.0499;
    let with = |order, holds: &dyn Fn(DVec3) -> bool| {
        let mesh = small_cube();
        let fixed_nodes = nodes_where(&mesh, holds);
        assert!(!fixed_nodes.is_empty());
        refusal(mesh, &RecordParameters { fixed_nodes, ..parameters(order, 6) })
    };
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        assert_eq!(with(order, &at_edge), text);
        assert_eq!(with(order, &|p| at_edge(p) && p.z < 0.01), text);
        assert_eq!(with(order, &|p| p == DVec3::ZERO), text);
        assert_eq!(with(order, &|_| true), "all nodes are fixed: nothing can move");
    }
    let mut mesh = small_cube();
    mesh.nodes.push(DVec3::ZERO);
    let parameters = RecordParameters { fixed_nodes: vec![27], ..parameters(ElementOrder::Linear, 6) };
    assert_eq!(refusal(mesh, &parameters), "the nodes to fix belong to no tetrahedron");
}

#[test]
fn a_cube_fixed_at_three_corners_can_be_recorded() {
    let mesh = small_cube();
    let fixed_nodes = nodes_where(&mesh, |p| {
        p.x + p.y + p.z > 0.0499 && p.abs().min_element() > 0.0499 && p != DVec3::splat(0.05)
    });
    assert_eq!(fixed_nodes.len(), 3);
    let parameters = RecordParameters { fixed_nodes, ..parameters(ElementOrder::Linear, 6) };
    let recorded = recorded(mesh, &parameters);
    assert_eq!(recorded.recording.metadata.mesh.fixed_nodes, 3);
    // 24 nodes are free.
    assert_eq!(recorded.unreduced().elastic_mode_count(), 72);
    assert!(recorded.recording.modes.angular_frequencies[0] > 1.0);
}

#[test]
fn materials_and_options_out_of_range_are_refused_with_value_and_range() {
    let with_material = |young, poisson, density| {
        let materials = vec![isotropic(young, poisson, density)];
        refusal(small_cube(), &RecordParameters { materials, ..parameters(ElementOrder::Linear, 6) })
    };
    assert_eq!(
        with_material(1e4, 0.5, 1000.0),
        "Poisson's ratio is 0.5, expected below 0.5: at 0.5 the material is incompressible and has no \
         displacement-only stiffness; use 0.49 for rubber or soft tissue"
    );
    assert_eq!(with_material(1e4, -1.0, 1000.0), "Poisson's ratio is -1, expected above -1 and below 0.5");
    assert_eq!(
        with_material(1e4, f64::NAN, 1000.0),
        "Poisson's ratio is NaN, expected above -1 and below 0.5"
    );
    assert_eq!(with_material(0.0, 0.3, 1000.0), "Young's modulus is 0e0 Pa, expected 1e-6 to 1e18 Pa");
    assert_eq!(with_material(1e4, 0.3, f64::INFINITY), "density is inf kg/m³, expected 1e-9 to 1e12 kg/m³");

    let with = |change: &dyn Fn(&mut RecordParameters)| {
        let mut parameters = parameters(ElementOrder::Linear, 6);
        change(&mut parameters);
        refusal(small_cube(), &parameters)
    };
    assert_eq!(with(&|p| p.modes = 0), "0 modes are requested, expected 1 or more");
    assert_eq!(with(&|p| p.materials.clear()), "0 materials for 1 regions");
    assert_eq!(
        with(&|p| p.residual = ResidualChoice::NearField(0.0)),
        "residual radius is 0 m, expected a positive number"
    );
    assert_eq!(
        with(&|p| p.damping = Damping::Ratio(-0.1)),
        "damping ratio is -0.1, expected a number that is not negative"
    );
    assert_eq!(
        with(&|p| p.damping = Damping::Rayleigh { alpha: 1.0, beta: f64::NAN }),
        "Rayleigh damping is 1 1/s, NaN s, expected two numbers that are not negative"
    );
    let mut mesh = small_cube();
    mesh.tets.pop();
    mesh.tets.push([0, 1, 2, 99]);
    assert_eq!(refusal(mesh, &parameters(ElementOrder::Linear, 6)), "tetrahedron 39 names node 99 of 27");
}

#[test]
fn locking_and_warnings_of_the_mesh_are_reported() {
    let mut listener = Listener::default();
    let mut mesh = small_cube();
    mesh.nodes.push(DVec3::ZERO);
    let parameters = RecordParameters {
        materials: vec![isotropic(2e4, 0.49995, 1000.0)],
        ..parameters(ElementOrder::Linear, 40)
    };
    record(mesh, &parameters, &mut listener).expect("a good recording");
    assert_eq!(
        listener.0[..3],
        [
            "1 nodes belong to no tetrahedron and are left out",
            "linear elements lock at Poisson's ratio 0.49995: frequencies come out some per cent too high; --order 2 \
             avoids it",
            "Poisson's ratio 0.49995 is so near to 0.5 that even quadratic elements lock; 0.49 is usual for rubber"
        ]
    );
}

#[test]
fn a_recording_reads_back_as_it_was_written() {
    for residual in [ResidualChoice::Automatic, ResidualChoice::NearField(0.05), ResidualChoice::None] {
        for precision in [Precision::Full, Precision::Compact] {
            let (mesh, parameters) = fixed_bar(ElementOrder::Linear, 8);
            let recording = recorded(mesh, &RecordParameters { residual, precision, ..parameters }).recording;
            let bytes = recording.to_bytes().expect("a good recording");
            assert!(palpate::Recording::from_bytes(&bytes).expect("a good recording") == recording);
        }
    }
}

#[test]
fn a_compact_recording_has_the_compliances_of_a_full_one() {
    // Half of 4 steps of 1/16384, and mode shapes, which near the fixed end are small beside their largest.
    const ROUNDED: f64 = 5e-4;
    let with = |precision| {
        let (mesh, parameters) = fixed_bar(ElementOrder::Linear, 8);
        recorded(mesh, &RecordParameters { precision, ..parameters }).recording
    };
    let (full, compact) = (with(Precision::Full), with(Precision::Compact));
    let (size, compact_size) =
        (full.to_bytes().expect("good").len(), compact.to_bytes().expect("good").len());
    assert!(compact_size * 2 < size, "{compact_size} of {size}");
    let squares = full.modes.angular_frequencies.iter().map(|omega| omega * omega).collect::<Vec<_>>();
    let compliance = |recording: &palpate::Recording, a: (usize, usize), b: (usize, usize)| {
        let (row, column) = (recording.modes.row(a.0, a.1), recording.modes.row(b.0, b.1));
        let modal: f64 = row.iter().zip(column).zip(&squares).map(|((x, y), square)| x * y / square).sum();
        modal + recording.residual.block(a.0, b.0).col(b.1)[a.1]
    };
    let nodes = full.surface.positions.len();
    let mut largest: f64 = 0.0;
    for (i, j) in (0..nodes).step_by(3).flat_map(|i| (0..nodes).step_by(5).map(move |j| (i, j))) {
        for (a, b) in (0..9).map(|at| ((i, at / 3), (j, at % 3))) {
            let root = (compliance(&full, a, a) * compliance(&full, b, b)).sqrt();
            if root > 0.0 {
                largest = largest.max((compliance(&compact, a, b) - compliance(&full, a, b)).abs() / root);
            }
        }
    }
    assert!((1e-6..ROUNDED).contains(&largest), "{largest}");
}

#[test]
fn kept_modes_of_a_recording_are_those_of_all_nodes_at_the_surface() {
    let body = shared_bar();
    let (recording, modes) = (&body.recording, body.unreduced().kept_modes());
    for (node, &number) in body.surface_nodes().iter().enumerate() {
        let centre = DVec3::from_array(recording.metadata.mass.center_of_mass_m);
        let expected = centre + recording.surface.positions[node];
        assert!((body.nodes()[number as usize] - expected).length() < SUMMED);
        for (axis, mode) in (0..3).flat_map(|axis| (0..40).map(move |mode| (axis, mode))) {
            assert_eq!(recording.modes.row(node, axis)[mode], modes.shape(mode)[3 * number as usize + axis]);
        }
    }
    for (mode, square) in modes.squared_frequencies().iter().enumerate() {
        let omega = recording.modes.angular_frequencies[mode];
        assert_eq!(omega, square.sqrt());
        // ζ = α/(2ω) + βω/2.
        let zeta = 2.0 / (2.0 * omega) + 2e-4 * omega / 2.0;
        assert!((recording.modes.damping_ratios[mode] / zeta - 1.0).abs() < SUMMED);
    }
}

/// Listener that interrupts after some units of work.
struct Interrupter {
    stage: &'static str,
    reached: Cell<bool>,
}

impl Progress for Interrupter {
    fn begin(&mut self, stage: &str, _total: u64) {
        self.reached.set(self.reached.get() || stage == self.stage);
    }
    fn advance(&mut self, _units: u64) {}
    fn warn(&mut self, _text: &str) {}
    fn is_interrupted(&self) -> bool {
        self.reached.get()
    }
}

#[test]
fn every_long_stage_can_be_interrupted() {
    for stage in ["modes", "residual compliance", "certificate"] {
        let (mesh, parameters) = two_material_bar(8);
        let mut listener = Interrupter { stage, reached: Cell::new(false) };
        let refused = record(mesh, &parameters, &mut listener);
        assert!(matches!(refused, Err(RecordError::Interrupted)), "{stage}");
        assert!(listener.reached.get(), "{stage} was not reached");
    }
}

#[test]
fn a_recorded_ball_holds_its_levels_and_the_certificate_their_chord_sag() {
    const RADIUS_M: f64 = 0.05;
    const ROUND_OFF_M: f64 = 1e-15;
    let mesh = ball_mesh(RADIUS_M, 6).expect("a good ball");
    let recording = recorded(mesh, &parameters(ElementOrder::Linear, 6)).recording;
    let levels = &recording.sample_levels;
    assert_eq!(*levels, recording.surface.sample_levels(MIN_CONTACT_SAMPLES));
    let stated = recording.metadata.certificate.expect("a certificate").sample_levels;
    assert_eq!(stated.len(), levels.len());
    let longest = |triangles: &[[u32; 3]]| {
        let corner = |node: u32| recording.surface.positions[node as usize];
        let sides = triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]);
        sides.map(|(a, b)| (corner(a) - corner(b)).length()).fold(0.0, f64::max)
    };
    // Depth of a triangle with corners on the sphere, by its longest side: at least that of the side's middle, at most that of an
    // equilateral triangle's, which one of them is, to round-off. The recorded surface has triangles itself.
    let depth = |half_squared: f64| RADIUS_M - (RADIUS_M * RADIUS_M - half_squared).max(0.0).sqrt();
    let own = depth(longest(&recording.surface.triangles).powi(2) / 3.0);
    for (level, stated) in levels.iter().zip(stated) {
        assert_eq!((stated.samples, stated.spacing_m), (level.nodes.len() as u64, level.spacing));
        let side = longest(&level.triangles);
        let distance = stated.hausdorff_distance_m.expect("a ball has a decimated surface");
        let (low, high) = (depth(side * side / 4.0) - own, depth(side * side / 3.0));
        assert!(
            (low..high + ROUND_OFF_M).contains(&distance),
            "{} samples: {distance}, {low} to {high}",
            level.nodes.len()
        );
    }
}
