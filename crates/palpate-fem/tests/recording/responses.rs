//! Modes, residual compliance, truncated response and certificate against second routes.

use faer::Mat;
use glam::DVec3;
use palpate::{Damping, NearField, SampledOscillator};
use palpate_fem::{ElementOrder, RecordParameters, RecordedBody, ResidualChoice, SilentProgress, paper_cube};

use crate::bodies::*;

#[test]
fn krylov_and_dense_modes_are_the_same_and_orthonormal() {
    /// Krylov stops at a residual of 1e-9 in ω², whose error is the square of that; the dense route loses condition.
    const SQUARES: f64 = 1e-9;
    /// The error of a shape is the residual over the gap to the next group, 1e-9/1e-5; its defect in the group is the square.
    const SHAPES: f64 = 1e-7;
    const GROUP: f64 = 1e-5;
    for body in [shared_bar(), shared_fixed_bar()] {
        let unreduced = body.unreduced();
        let modes = unreduced.kept_modes();
        assert!(body.dofs() > 900, "small enough for the dense route");
        assert!(unreduced.orthonormality_error(modes) < SUMMED);
        let all = unreduced.dense_modes(60, &mut SilentProgress).expect("all modes");
        assert!(unreduced.orthonormality_error(&all) < SUMMED);
        let shapes: Vec<Vec<f64>> = (0..modes.count()).map(|i| modes.shape(i).to_vec()).collect();
        let weighted = unreduced.mass_times(&shapes);
        let overlap = |j: usize, i: usize| -> f64 {
            all.shape(j).iter().zip(&weighted[i]).map(|(shape, weighted)| shape * weighted).sum()
        };
        let squares = all.squared_frequencies();
        for (i, &square) in modes.squared_frequencies().iter().enumerate() {
            assert!((square / squares[i] - 1.0).abs() < SQUARES, "mode {i}: {square} {}", squares[i]);
            let group = (0..60).filter(|&j| (squares[j] / square - 1.0).abs() < GROUP);
            let within: f64 = group.map(|j| overlap(j, i).powi(2)).sum();
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
    let parameters =
        RecordParameters { residual: ResidualChoice::None, ..parameters(ElementOrder::Quadratic, 14) };
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
    let free = (small_cube(), parameters(ElementOrder::Quadratic, 12));
    let mut fixed = (small_cube(), parameters(ElementOrder::Quadratic, 12));
    fixed.1.fixed_nodes = nodes_where(&fixed.0, |p| p.z < -0.0499);
    for (mesh, parameters) in [free, fixed] {
        let body = recorded(mesh, &parameters);
        let modes = body.unreduced().kept_modes();
        let surface_nodes = body.surface_nodes();
        let n = 3 * surface_nodes.len();
        let exact = body.unreduced().static_displacements(&unit_loads(&body, &surface_nodes));
        let phi = Mat::from_fn(n, 12, |i, k| modes.shape(k)[row(&surface_nodes, i)]);
        let weighted = Mat::from_fn(n, 12, |i, k| phi[(i, k)] / modes.squared_frequencies()[k]);
        let kept = &weighted * phi.transpose();
        let residual = dense(&body.recording.residual, n);
        let largest = largest(&exact);
        for j in 0..n {
            // Rounded to f32; the diagonal is raised by the same share of its row, to stay positive.
            let raised: f64 = (0..n).map(|i| residual[(i, j)].abs()).sum();
            for i in 0..n {
                let error = (kept[(i, j)] + residual[(i, j)] - exact[j][row(&surface_nodes, i)]).abs();
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
    let mut parameters = parameters(ElementOrder::Linear, 1000);
    parameters.damping = Damping::Ratio(0.05);
    let all = RecordedBody::new(small_cube(), &parameters, &mut listener).expect("a good recording");
    // 27 nodes, less six rigid motions.
    assert_eq!(
        listener.0,
        ["1000 modes are requested, the model has 75 elastic modes: all of them are kept"]
    );
    assert_eq!(all.recording.modes.len(), 75);
    let surface_nodes = all.surface_nodes();
    let largest = largest(&all.unreduced().static_displacements(&unit_loads(&all, &surface_nodes)));
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
        let parameters = RecordParameters { residual, order: ElementOrder::Linear, ..parameters };
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
        let held = SampledOscillator::new(square.sqrt(), damping.ratio(square.sqrt()), step_s);
        [rest + gain * gain / square, first + gain * gain * held.instantaneous_compliance()]
    })
}

#[test]
fn truncated_response_is_the_sum_over_all_modes() {
    const STEP_S: f64 = 1e-3;
    const KEPT: usize = 20;
    /// The space starts with the static response itself, so that only the sum over 166 modes rounds.
    const AT_REST: f64 = SUMMED;
    /// R[0] converges geometrically, by five digits in six blocks (measured) down to round-off.
    const IN_A_STEP: [(usize, f64); 3] = [(4, 1e-4), (10, 1e-8), (18, 1e-11)];
    let mesh = block([0.1; 3], [3; 3]);
    let fixed_nodes = nodes_where(&mesh, |p| p.z < -0.0499);
    for fixed_nodes in [Vec::new(), fixed_nodes] {
        let parameters = RecordParameters {
            materials: vec![paper_cube::material()],
            fixed_nodes,
            ..parameters(ElementOrder::Linear, KEPT)
        };
        let body = recorded(mesh.clone(), &parameters);
        let unreduced = body.unreduced();
        let all =
            unreduced.dense_modes(unreduced.elastic_mode_count(), &mut SilentProgress).expect("all modes");
        // A corner, the middle of the top, and a node within the body.
        let places = [DVec3::splat(0.05), DVec3::new(0.017, 0.017, 0.05), DVec3::splat(0.017)]
            .map(|near| body.nearest_node(near));
        let truncated =
            unreduced.truncated_response(&places, STEP_S, 18, &mut SilentProgress).expect("shifted factors");
        for (place, &node) in places.iter().enumerate() {
            let gain = |i: usize| DVec3::from_slice(&all.shape(i)[3 * node..]);
            let exact = (KEPT..all.count()).map(|i| (all.squared_frequencies()[i], gain(i)));
            let [rest, first] = compliances(exact, parameters.damping, STEP_S);
            for (blocks, allowed) in IN_A_STEP {
                let modes = truncated.modes(place, blocks).expect("small eigenproblems");
                let modes = modes.iter().map(|mode| (mode.square, mode.gain));
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
            materials: vec![paper_cube::material()],
            residual,
            ..parameters(ElementOrder::Linear, modes)
        };
        let recording = recorded(block([0.1; 3], [4; 3]), &parameters).recording;
        recording.metadata.certificate.expect("a certificate")
    };
    let mut before = f64::INFINITY;
    let mut peaks_before = [f64::INFINITY; 6];
    for modes in [5, 20, 60] {
        let certificate = certificate(modes, ResidualChoice::Automatic);
        let error = certificate.force_error_max;
        assert!(error > 0.0 && error < before, "{modes} modes: {error} after {before}");
        assert!(certificate.force_error_median <= error);
        let peak = certificate.peak_force_error_max.expect("a peak force error");
        let peaks = [peak.held, peak.touched].concat();
        let fall = peaks.iter().zip(peaks_before).all(|(peak, before)| *peak > error && *peak < before);
        assert!(
            fall,
            "{modes} modes: {peaks:?} after {peaks_before:?}, one place over the whole event {error}"
        );
        peaks_before.copy_from_slice(&peaks);
        assert!(certificate.static_compliance_error_max < AT_REST, "{certificate:?}");
        // 125 nodes, less six rigid motions; 12 points and 4 patches.
        assert_eq!((certificate.modes_of, certificate.samples), ([modes as u64, 369], 16));
        before = error;
    }
    let without = certificate(60, ResidualChoice::None);
    assert!(without.force_error_max > 0.5 && without.static_compliance_error_max > 0.1, "{without:?}");
}
