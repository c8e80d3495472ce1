//! From a mesh to a recording: identities, closed forms and second routes for what `record` gives.

use faer::{Mat, Side};
use glam::DVec3;
use palpate::{Damping, HeldOscillator, Material, NearField, ResidualCompliance};
use palpate_fem::element::Order;
use palpate_fem::mesh::{Mesh, Region, box_mesh};
use palpate_fem::modes::{Modes, all_modes, orthonormality_error};
use palpate_fem::progress::{Progress, Silent};
use palpate_fem::record::{RecordParameters, Recorded, record};
use palpate_fem::reference::Reference;
use palpate_fem::residual::ResidualChoice;
use palpate_fem::system::System;

/// Solves with a factor of condition up to 1e6 keep ten of sixteen digits.
const SOLVED: f64 = 1e-10;

/// Sums and products of a few hundred terms keep all but three digits.
const SUMMED: f64 = 1e-12;

/// The most that rounding to f32 moves a number, as a share of it: half a unit in the 24th binary digit.
const F32_ROUNDING: f64 = 1.0 / 16_777_216.0;

fn material(young_pa: f64, poisson: f64, density_kg_m3: f64) -> Material {
    Material { region: String::new(), young_pa, poisson, density_kg_m3 }
}

fn parameters(order: Order, modes: usize) -> RecordParameters {
    RecordParameters {
        materials: vec![material(2e4, 0.3, 1000.0)],
        order,
        modes,
        damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        residual: ResidualChoice::Automatic,
        fixed_nodes: Vec::new(),
        source: "test".into(),
    }
}

fn block(size: [f64; 3], cells: [u32; 3]) -> Mesh {
    box_mesh(size, cells).expect("a good box")
}

/// Nodes of a mesh where a condition holds.
fn nodes_where(mesh: &Mesh, holds: impl Fn(DVec3) -> bool) -> Vec<u32> {
    (0..mesh.nodes.len() as u32).filter(|&node| holds(mesh.nodes[node as usize])).collect()
}

fn recorded(mesh: Mesh, parameters: &RecordParameters) -> Recorded {
    record(mesh, parameters, &mut Silent).expect("a good recording")
}

fn refusal(mesh: Mesh, parameters: &RecordParameters) -> String {
    record(mesh, parameters, &mut Silent).err().expect("an error").to_string()
}

/// Keeps the remarks.
#[derive(Default)]
struct Listener(Vec<String>);

impl Progress for Listener {
    fn begin(&mut self, _stage: &str, _total: u64) {}
    fn advance(&mut self, _units: u64) {}
    fn remark(&mut self, text: &str) {
        self.0.push(text.into());
    }
}

/// A bar with a soft and a stiff half of other density, and what it is recorded with: 1149 degrees of freedom, so that
/// the modes come by block Krylov.
fn two_material_bar(modes: usize) -> (Mesh, RecordParameters) {
    let mut mesh = block([0.2, 0.05, 0.05], [8, 2, 2]);
    mesh.regions.push(Region { tag: 1, name: None });
    for (tet, region) in mesh.tets.iter().zip(&mut mesh.tet_regions) {
        *region = u32::from(tet.iter().map(|&n| mesh.nodes[n as usize].x).sum::<f64>() > 0.0);
    }
    let materials = vec![material(2e4, 0.45, 1000.0), material(3e5, 0.2, 2500.0)];
    (mesh, RecordParameters { materials, ..parameters(Order::Quadratic, modes) })
}

/// A bar that is held at its left end.
fn fixed_bar(order: Order, modes: usize) -> (Mesh, RecordParameters) {
    let mesh = block([0.2, 0.05, 0.05], [8, 2, 2]);
    let fixed_nodes = nodes_where(&mesh, |p| p.x < -0.0999);
    (mesh, RecordParameters { fixed_nodes, ..parameters(order, modes) })
}

/// A cube of 81 degrees of freedom.
fn small_cube() -> Mesh {
    block([0.1; 3], [2; 3])
}

fn row(surface_nodes: &[u32], touchable: usize) -> usize {
    3 * surface_nodes[touchable / 3] as usize + touchable % 3
}

/// Unit loads on surface degrees of freedom, one per column.
fn unit_loads(system: &System, surface_nodes: &[u32]) -> Mat<f64> {
    let mut loads = Mat::zeros(system.discretisation.dofs(), 3 * surface_nodes.len());
    (0..loads.ncols()).for_each(|column| loads[(row(surface_nodes, column), column)] = 1.0);
    loads
}

/// Entry of the stored residual compliance [m/N].
fn stored(residual: &ResidualCompliance, i: usize, j: usize) -> f64 {
    residual.block(i / 3, j / 3).col(j % 3)[i % 3]
}

fn dense(residual: &ResidualCompliance, size: usize) -> Mat<f64> {
    Mat::from_fn(size, size, |i, j| stored(residual, i, j))
}

fn least_eigenvalue(matrix: &Mat<f64>) -> f64 {
    let scale = matrix.norm_max();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / scale);
    scaled.self_adjoint_eigen(Side::Lower).expect("a symmetric matrix").S()[0] * scale
}

#[test]
fn krylov_and_dense_modes_are_the_same_and_orthonormal() {
    /// Krylov stops at a residual of 1e-9 in ω², whose error is the square of that; the dense route loses condition.
    const SQUARES: f64 = 1e-9;
    /// A shape is off by the residual over the gap to the next group, 1e-9/1e-5; what it lacks in its group is the square.
    const SHAPES: f64 = 1e-7;
    const GROUP: f64 = 1e-5;
    for (mesh, parameters) in [two_material_bar(40), fixed_bar(Order::Quadratic, 40)] {
        let Recorded { system, modes, .. } = recorded(mesh, &parameters);
        assert!(system.discretisation.dofs() > 900, "small enough for the dense route");
        assert!(orthonormality_error(&system, modes.shapes.as_ref()) < SUMMED);
        let all = all_modes(&system, 60, &mut Silent).expect("all modes");
        assert!(orthonormality_error(&system, all.shapes.as_ref()) < SUMMED);
        let overlap = all.shapes.transpose() * system.mass_times(modes.shapes.as_ref());
        for (i, &square) in modes.squares.iter().enumerate() {
            assert!((square / all.squares[i] - 1.0).abs() < SQUARES, "mode {i}: {square} {}", all.squares[i]);
            let group = (0..60).filter(|&j| (all.squares[j] / square - 1.0).abs() < GROUP);
            let within: f64 = group.map(|j| overlap[(j, i)].powi(2)).sum();
            assert!((within - 1.0).abs() < SHAPES, "mode {i} lies in its group by {within}");
        }
    }
}

#[test]
fn symmetry_gives_the_cubes_modes_in_twos_and_threes() {
    /// Frequencies of one group agree to the eigensolver's digits: its residual is 1e-9.
    const WITHIN: f64 = 1e-9;
    /// Ω = ωL/c_s of the continuum (see `palpate verify continuum`); four quadratic cells a side are within a per cent.
    /// The three Lamé modes are of one frequency by their own law, not by symmetry: there the mesh parts two from one.
    const GROUPS: [(usize, f64); 6] =
        [(2, 2.85605), (3, 3.84598), (3, 3.91125), (2, 4.44288), (1, 4.44288), (3, 4.57279)];
    const DISCRETISED: f64 = 0.01;
    let parameters = RecordParameters { residual: ResidualChoice::None, ..parameters(Order::Quadratic, 14) };
    let recording = recorded(block([0.1; 3], [4; 3]), &parameters).recording;
    let shear_speed = (2e4_f64 / 2.6 / 1000.0).sqrt();
    let omegas: Vec<f64> =
        recording.modes.angular_frequencies.iter().map(|w| w * 0.1 / shear_speed).collect();
    let mut at = 0;
    for (size, omega) in GROUPS {
        let group = &omegas[at..at + size];
        at += size;
        let spread = group[size - 1] / group[0] - 1.0;
        assert!(spread < WITHIN, "{group:?} are {spread} apart");
        assert!((group[0] / omega - 1.0).abs() < DISCRETISED, "{group:?} and {omega}");
        assert!(omegas.get(at).is_none_or(|next| next / group[0] > 1.0 + 1e3 * WITHIN), "{group:?} goes on");
    }
}

#[test]
fn modes_and_residual_together_are_the_static_compliance() {
    let free = (small_cube(), parameters(Order::Quadratic, 12));
    let mut fixed = (small_cube(), parameters(Order::Quadratic, 12));
    fixed.1.fixed_nodes = nodes_where(&fixed.0, |p| p.z < -0.0499);
    for (mesh, parameters) in [free, fixed] {
        let Recorded { recording, system, modes } = recorded(mesh, &parameters);
        let surface_nodes = system.discretisation.surface_nodes();
        let n = 3 * surface_nodes.len();
        let exact = system.elastic_compliance(unit_loads(&system, &surface_nodes));
        let phi = Mat::from_fn(n, 12, |i, k| modes.shapes[(row(&surface_nodes, i), k)]);
        let weighted = Mat::from_fn(n, 12, |i, k| phi[(i, k)] / modes.squares[k]);
        let kept = &weighted * phi.transpose();
        let residual = dense(&recording.residual, n);
        let largest = exact.norm_max();
        for j in 0..n {
            // Rounded to f32; the diagonal is raised by the same share of its row, to stay positive.
            let raised: f64 = (0..n).map(|i| residual[(i, j)].abs()).sum();
            for i in 0..n {
                let error = (kept[(i, j)] + residual[(i, j)] - exact[(row(&surface_nodes, i), j)]).abs();
                let share = residual[(i, j)].abs() + if i == j { raised } else { 0.0 };
                let allowed = 1.001 * F32_ROUNDING * share + SOLVED * largest;
                assert!(error < allowed, "entry {i}, {j}: {error} above {allowed}");
            }
        }
        let least = least_eigenvalue(&residual);
        assert!(least > -SUMMED * residual.norm_max(), "an eigenvalue of S is {least}");
    }
}

#[test]
fn nothing_is_left_when_all_modes_are_kept() {
    let mut listener = Listener::default();
    let mut parameters = parameters(Order::Linear, 1000);
    parameters.damping = Damping::Ratio(0.05);
    let all = record(small_cube(), &parameters, &mut listener).expect("a good recording");
    // 27 nodes, less six rigid motions.
    assert_eq!(listener.0, ["1000 modes are wanted, the model has 75 elastic modes: all of them are kept"]);
    assert_eq!(all.recording.modes.len(), 75);
    let surface_nodes = all.system.discretisation.surface_nodes();
    let largest = all.system.elastic_compliance(unit_loads(&all.system, &surface_nodes)).norm_max();
    let left = dense(&all.recording.residual, 3 * surface_nodes.len()).norm_max();
    assert!(left < SOLVED * largest, "{left} of {largest}");
    let certificate = all.recording.metadata.certificate.expect("a certificate");
    assert_eq!(certificate.modes_of, [75, 75]);
    assert!(certificate.force_error_max < SOLVED && certificate.static_compliance_error_max < SOLVED);
}

#[test]
fn the_near_field_is_the_whole_residual_tapered() {
    // Many entries of this body's blocks are zero by symmetry: round-off that only a copy makes equal.
    let with = |residual| {
        let (mesh, parameters) = two_material_bar(12);
        let parameters = RecordParameters { residual, order: Order::Linear, ..parameters };
        recorded(mesh, &parameters).recording
    };
    let whole = with(ResidualChoice::Whole);
    let positions = &whole.surface.positions;
    let n = 3 * positions.len();
    let scale = dense(&whole.residual, n).norm_max();
    for radius in [0.03, 0.08] {
        let near = with(ResidualChoice::NearField(radius)).residual;
        let mut beyond = 0;
        for j in 0..n {
            let raised: f64 = (0..n).map(|i| stored(&whole.residual, i, j).abs()).sum();
            for i in 0..n {
                let distance = (positions[i / 3] - positions[j / 3]).length();
                let (value, mirror) = (stored(&near, i, j), stored(&near, j, i));
                assert_eq!(value, mirror, "entries {i}, {j}");
                if distance >= radius {
                    beyond += 1;
                    assert_eq!(value, 0.0, "entry {i}, {j} is beyond the radius");
                }
                let tapered = stored(&whole.residual, i, j) * NearField::taper(distance / radius);
                // Both are rounded once, and their diagonals raised by shares of their own rows.
                let share = 2.0 * tapered.abs() + if i == j { raised } else { 0.0 };
                let allowed = 1.001 * F32_ROUNDING * share + SUMMED * scale;
                assert!((value - tapered).abs() < allowed, "entry {i}, {j}: {value} is not {tapered}");
            }
        }
        assert!(beyond > 0 && beyond < n * n, "{beyond} entries beyond the radius of {n}²");
        let least = least_eigenvalue(&dense(&near, n));
        assert!(least > -SUMMED * scale, "radius {radius}: an eigenvalue of S is {least}");
    }
}

/// Static compliance and R[0] [m/N] of modes, as the diagonal of the three directions at a load.
fn compliances(modes: impl Iterator<Item = (f64, DVec3)>, damping: Damping, step_s: f64) -> [DVec3; 2] {
    modes.fold([DVec3::ZERO; 2], |[rest, first], (square, gain)| {
        let held = HeldOscillator::new(square.sqrt(), damping.ratio(square.sqrt()), step_s);
        [rest + gain * gain / square, first + gain * gain * held.instantaneous_compliance()]
    })
}

#[test]
fn the_reference_answers_as_the_sum_over_all_modes_does() {
    const STEP_S: f64 = 1e-3;
    const KEPT: usize = 20;
    /// The space starts with the static answer itself, so that only the sum over 166 modes rounds.
    const AT_REST: f64 = SUMMED;
    /// R[0] converges geometrically, by five digits in six blocks (measured) down to round-off.
    const IN_A_STEP: [(usize, f64); 3] = [(4, 1e-4), (10, 1e-8), (18, 1e-11)];
    let mesh = block([0.1; 3], [3; 3]);
    let fixed_nodes = nodes_where(&mesh, |p| p.z < -0.0499);
    for fixed_nodes in [Vec::new(), fixed_nodes] {
        let parameters = RecordParameters {
            materials: vec![material(2000.0, 0.49, 110.0)],
            fixed_nodes,
            ..parameters(Order::Linear, KEPT)
        };
        let Recorded { system, modes, .. } = recorded(mesh.clone(), &parameters);
        let all = all_modes(&system, system.elastic_modes(), &mut Silent).expect("all modes");
        // A corner, the middle of the top, and a node within the body.
        let places = [DVec3::splat(0.05), DVec3::new(0.017, 0.017, 0.05), DVec3::splat(0.017)].map(|near| {
            let distance = |node: &usize| (system.discretisation.nodes[*node] - near).length();
            (0..system.discretisation.nodes.len())
                .min_by(|a, b| distance(a).total_cmp(&distance(b)))
                .expect("a node")
        });
        let mut loads = Mat::zeros(system.discretisation.dofs(), 9);
        for (place, axis) in (0..3).flat_map(|place| (0..3).map(move |axis| (place, axis))) {
            loads[(3 * places[place] + axis, 3 * place + axis)] = 1.0;
        }
        let reference =
            Reference::new(&system, &modes, loads, STEP_S, 18, &mut Silent).expect("shifted factors");
        for (place, &node) in places.iter().enumerate() {
            let gain = |i: usize| {
                DVec3::new(
                    all.shapes[(3 * node, i)],
                    all.shapes[(3 * node + 1, i)],
                    all.shapes[(3 * node + 2, i)],
                )
            };
            let exact = (KEPT..all.squares.len()).map(|i| (all.squares[i], gain(i)));
            let [rest, first] = compliances(exact, parameters.damping, STEP_S);
            for (blocks, allowed) in IN_A_STEP {
                let left_out = reference.left_out(&system, place, blocks).expect("small eigenproblems");
                let modes = left_out.iter().map(|mode| (mode.square, mode.gain));
                let got = compliances(modes, parameters.damping, STEP_S);
                let error = |got: DVec3, exact: DVec3| (got - exact).length() / exact.length();
                assert!(error(got[0], rest) < AT_REST, "static, node {node}: {} {rest}", got[0]);
                let off = error(got[1], first);
                assert!(off < allowed, "R[0], node {node}, {blocks} blocks: {off}");
            }
        }
    }
}

#[test]
fn certified_errors_fall_with_modes_and_show_what_a_missing_residual_costs() {
    /// S is rounded to f32 and its diagonal raised by 2⁻²⁴ of a row of a few hundred entries.
    const AT_REST: f64 = 1e-5;
    let certificate = |modes, residual| {
        let parameters = RecordParameters {
            materials: vec![material(2000.0, 0.49, 110.0)],
            residual,
            ..parameters(Order::Linear, modes)
        };
        let recording = recorded(block([0.1; 3], [4; 3]), &parameters).recording;
        recording.metadata.certificate.expect("a certificate")
    };
    let mut before = f64::INFINITY;
    for modes in [5, 20, 60] {
        let certificate = certificate(modes, ResidualChoice::Automatic);
        let error = certificate.force_error_max;
        assert!(error > 0.0 && error < before, "{modes} modes: {error} after {before}");
        assert!(certificate.force_error_median <= error);
        assert!(certificate.static_compliance_error_max < AT_REST, "{certificate:?}");
        // 125 nodes, less six rigid motions; 8 points and 4 patches.
        assert_eq!((certificate.modes_of, certificate.samples), ([modes as u64, 369], 12));
        before = error;
    }
    let without = certificate(60, ResidualChoice::None);
    assert!(without.force_error_max > 0.5 && without.static_compliance_error_max > 0.1, "{without:?}");
}

#[test]
fn the_same_input_gives_the_same_bytes() {
    for (mesh, parameters) in [two_material_bar(30), fixed_bar(Order::Quadratic, 30)] {
        let bytes = || recorded(mesh.clone(), &parameters).recording.to_bytes().expect("a good recording");
        assert!(bytes() == bytes());
    }
}

#[test]
fn mass_centre_and_inertia_of_a_box_are_the_closed_forms() {
    const SCALE: f64 = 0.5;
    for order in [Order::Linear, Order::Quadratic] {
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
    for order in [Order::Linear, Order::Quadratic] {
        let (mesh, parameters) = fixed_bar(order, 15);
        let Recorded { recording, system, .. } = recorded(mesh, &parameters);
        let gravity = recording.gravity.expect("a fixed body has a gravity response");
        let surface_nodes = system.discretisation.surface_nodes();
        let uniform =
            Mat::from_fn(system.discretisation.dofs(), 3, |dof, axis| f64::from(u8::from(dof % 3 == axis)));
        let exact = system.elastic_compliance(system.mass_times(uniform.as_ref()));
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
                    DVec3::from_array([0, 1, 2].map(|part| exact[(3 * number as usize + part, axis)]));
                assert!((sag - expected).length() < SOLVED * exact.norm_max(), "{node}: {sag} {expected}");
            }
        }
    }
}

#[test]
fn a_hanging_bar_without_poisson_effect_sags_by_its_weight_over_twice_its_stiffness() {
    // u = ρg/E·(L·s − s²/2) at s from the support: in the space of quadratic elements, so exact at every node.
    let (mesh, parameters) = fixed_bar(Order::Quadratic, 15);
    let parameters = RecordParameters { materials: vec![material(2e4, 0.0, 1000.0)], ..parameters };
    let Recorded { recording, .. } = recorded(mesh, &parameters);
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
    let surface = recorded(mesh, &parameters(Order::Quadratic, 6)).recording.surface;
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
    for order in [Order::Linear, Order::Quadratic] {
        assert_eq!(with(order, &at_edge), text);
        assert_eq!(with(order, &|p| at_edge(p) && p.z < 0.01), text);
        assert_eq!(with(order, &|p| p == DVec3::ZERO), text);
        assert_eq!(with(order, &|_| true), "all nodes are fixed: nothing can move");
    }
    let mut mesh = small_cube();
    mesh.nodes.push(DVec3::ZERO);
    let parameters = RecordParameters { fixed_nodes: vec![27], ..parameters(Order::Linear, 6) };
    assert_eq!(refusal(mesh, &parameters), "the nodes to fix belong to no tetrahedron");
}

#[test]
fn a_cube_held_at_three_corners_can_be_recorded() {
    let mesh = small_cube();
    let fixed_nodes = nodes_where(&mesh, |p| {
        p.x + p.y + p.z > 0.0499 && p.abs().min_element() > 0.0499 && p != DVec3::splat(0.05)
    });
    assert_eq!(fixed_nodes.len(), 3);
    let parameters = RecordParameters { fixed_nodes, ..parameters(Order::Linear, 6) };
    let recorded = recorded(mesh, &parameters);
    assert_eq!(recorded.recording.metadata.mesh.fixed_nodes, 3);
    // 24 nodes are free.
    assert_eq!(recorded.system.elastic_modes(), 72);
    assert!(recorded.recording.modes.angular_frequencies[0] > 1.0);
}

#[test]
fn materials_and_options_out_of_range_are_refused_with_value_and_range() {
    let with_material = |young, poisson, density| {
        let materials = vec![material(young, poisson, density)];
        refusal(small_cube(), &RecordParameters { materials, ..parameters(Order::Linear, 6) })
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
        let mut parameters = parameters(Order::Linear, 6);
        change(&mut parameters);
        refusal(small_cube(), &parameters)
    };
    assert_eq!(with(&|p| p.modes = 0), "0 modes are wanted, expected 1 or more");
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
    assert_eq!(refusal(mesh, &parameters(Order::Linear, 6)), "tetrahedron 39 names node 99 of 27");
}

#[test]
fn locking_and_the_meshs_own_remarks_are_told() {
    let mut listener = Listener::default();
    let mut mesh = small_cube();
    mesh.nodes.push(DVec3::ZERO);
    let parameters =
        RecordParameters { materials: vec![material(2e4, 0.49995, 1000.0)], ..parameters(Order::Linear, 40) };
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
        let (mesh, parameters) = fixed_bar(Order::Linear, 8);
        let recording = recorded(mesh, &RecordParameters { residual, ..parameters }).recording;
        let bytes = recording.to_bytes().expect("a good recording");
        assert!(palpate::Recording::from_bytes(&bytes).expect("a good recording") == recording);
    }
}

#[test]
fn kept_modes_of_a_recording_are_those_of_all_nodes_at_the_surface() {
    let (mesh, parameters) = two_material_bar(10);
    let Recorded { recording, system, modes } = recorded(mesh, &parameters);
    let Modes { squares, shapes } = modes;
    for (node, &number) in system.discretisation.surface_nodes().iter().enumerate() {
        let expected = DVec3::from_array(system.mass.center_of_mass_m) + recording.surface.positions[node];
        assert!((system.discretisation.nodes[number as usize] - expected).length() < SUMMED);
        for (axis, mode) in (0..3).flat_map(|axis| (0..10).map(move |mode| (axis, mode))) {
            assert_eq!(recording.modes.row(node, axis)[mode], shapes[(3 * number as usize + axis, mode)]);
        }
    }
    for (mode, square) in squares.into_iter().enumerate() {
        let omega = recording.modes.angular_frequencies[mode];
        assert_eq!(omega, square.sqrt());
        // ζ = α/(2ω) + βω/2.
        let zeta = 2.0 / (2.0 * omega) + 2e-4 * omega / 2.0;
        assert!((recording.modes.damping_ratios[mode] / zeta - 1.0).abs() < SUMMED);
    }
}
