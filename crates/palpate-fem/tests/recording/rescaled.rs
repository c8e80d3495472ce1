//! Recordings rescaled to another material, against recordings of that material.

use palpate::{Damping, Material, Recording};
use palpate_fem::{ElementOrder, Precision, RecordParameters};

use crate::bodies::*;

/// Tolerance of numbers of two eigenvalue computations, relative.
const SOLVED: f64 = 1e-7;

/// Tolerance of residual compliances in single precision, relative to the largest.
const SINGLE: f64 = 3e-6;

const RAYLEIGH: Damping = Damping::Rayleigh { alpha: 3.0, beta: 2e-4 };

fn of(young: f64, density: f64, damping: Damping, precision: Precision) -> Recording {
    let material = Material::isotropic(young, 0.3, density);
    let parameters = RecordParameters {
        precision,
        ..RecordParameters::new(vec![material], ElementOrder::Quadratic, 24, damping)
    };
    // Three different sides: no mode is degenerate.
    recorded(block([0.1, 0.07, 0.05], [3, 2, 2]), &parameters).recording
}

#[test]
fn a_rescaled_recording_is_that_of_the_other_material() {
    for (damping, precision, residual) in [
        (RAYLEIGH, Precision::Full, SINGLE),
        (Damping::Ratio(0.02), Precision::Full, SINGLE),
        // 0.012 % of rounding of each of the two.
        (RAYLEIGH, Precision::Compact, 2.5e-4),
    ] {
        let rescaled = of(2e5, 900.0, damping, precision).rescaled(7e6, 2500.0).expect("a free body");
        let again = of(7e6, 2500.0, damping, precision);
        assert!((rescaled.mass() / again.mass() - 1.0).abs() < 1e-12);
        let pairs = |a: &[f64], b: &[f64]| a.iter().copied().zip(b.iter().copied()).collect::<Vec<_>>();
        let (own, other) = (&rescaled.modes, &again.modes);
        for (a, b) in pairs(&own.angular_frequencies, &other.angular_frequencies) {
            assert!((a / b - 1.0).abs() < SOLVED, "{damping:?}: {a} {b} rad/s");
        }
        for (a, b) in pairs(&own.damping_ratios, &other.damping_ratios) {
            assert!((a / b - 1.0).abs() < SOLVED, "{damping:?}: damping {a} {b}");
        }
        let nodes = own.mode_shapes.len() / 3 / own.len();
        // The sign of a mode is free; its square is not.
        let largest = other.mode_shapes.iter().map(|phi| phi * phi).fold(0.0, f64::max);
        let tolerance = if precision == Precision::Full { 1e-5 } else { 1e-3 };
        for (a, b) in pairs(&own.mode_shapes, &other.mode_shapes) {
            assert!((a * a - b * b).abs() < tolerance * largest, "{damping:?}: {a} {b}");
        }
        let block = |recording: &Recording, i, j| recording.residual.block(i, j);
        let size = block(&again, 0, 0).col(0)[0];
        for (i, j) in (0..nodes).flat_map(|i| [(i, i), (i, (i * 7 + 3) % nodes)]) {
            let difference = (block(&rescaled, i, j) - block(&again, i, j)).to_cols_array();
            let worst = difference.iter().fold(0.0_f64, |worst, entry| worst.max(entry.abs()));
            assert!(worst < residual * 4.0 * size, "{damping:?} {precision:?}: {worst:e} of {size:e}");
        }
    }
}

#[test]
fn a_certificate_is_kept_where_all_times_scale_alike() {
    let ratio = of(2e5, 900.0, Damping::Ratio(0.02), Precision::Full);
    let faster = ratio.rescaled(8e5, 900.0).expect("a free body");
    let (before, after) = (ratio.metadata.certificate, faster.metadata.certificate);
    let (before, after) = (before.expect("a certificate"), after.expect("a certificate"));
    assert_eq!(before.force_error_max, after.force_error_max);
    assert!((after.bandwidth_hz / before.bandwidth_hz - 2.0).abs() < 1e-12);
    assert!((after.event.rise_s / before.event.rise_s - 0.5).abs() < 1e-12);
    let rayleigh = of(2e5, 900.0, RAYLEIGH, Precision::Full).rescaled(8e5, 900.0).expect("a free body");
    assert_eq!(rayleigh.metadata.certificate, None, "its damping is another one");
}

#[test]
fn what_needs_elements_is_refused() {
    let refused = |recording: &Recording, young: f64, density: f64| {
        recording.rescaled(young, density).err().map(|error| error.to_string()).unwrap_or_default()
    };
    let (fixed, bar) = (&shared_fixed_bar().recording, &shared_bar().recording);
    assert!(refused(fixed, 1e5, 1000.0).contains("fixed nodes"), "{}", refused(fixed, 1e5, 1000.0));
    assert!(refused(bar, 1e5, 1000.0).contains("several materials"), "{}", refused(bar, 1e5, 1000.0));
    let free = of(2e5, 900.0, RAYLEIGH, Precision::Full);
    for (young, density) in [(0.0, 900.0), (-1.0, 900.0), (2e5, 0.0), (f64::NAN, 900.0), (2e5, f64::INFINITY)]
    {
        assert!(refused(&free, young, density).contains("expected a number"), "{young} {density}");
    }
    assert!(!refused(&free, 1e-300, 900.0).is_empty(), "frequencies out of range");
}
