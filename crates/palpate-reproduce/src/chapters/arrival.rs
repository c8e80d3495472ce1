//! Arrival of the wave of figure 2, over the threshold that counts as arrived, and the reason why it comes before the pressure wave.

use super::explicit_cube::{ExplicitCube, MassMatrix};
use super::wave::{HELD, STEP_S, Wave};
use crate::chapter::{DataFile, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::page::{figure, paragraph};
use crate::progress::StageProgress;
use glam::DVec3;
use palpate_fem::RecordedBody;
use palpate_fem::paper_cube::{self, DENSITY_KG_M3, POISSON, YOUNG_PA};

/// Shares of the peak at which a node counts as reached by the wave.
const THRESHOLDS: [f64; 9] = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2];

/// Step of the explicit integration [s] times the cells of a side: below the stability limit of the consistent mass with the paper's
/// material, 2.4·10⁻⁴ s.
const EXPLICIT_STEP_S: f64 = 2.4e-4;
/// Time that the explicit integration covers [s]: past the arrival at 1 % of the peak.
const EXPLICIT_S: f64 = 0.03;

/// The explicit solutions: mass matrix, damping β [s], label.
const EXPLICIT: [(MassMatrix, f64, &str); 3] = [
    (MassMatrix::Consistent, 2e-4, "independent code, consistent mass"),
    (MassMatrix::Lumped, 2e-4, "independent code, lumped mass"),
    (MassMatrix::Lumped, 0.0, "independent code, lumped mass, undamped"),
];

/// Arrival as the chapter uses it.
pub struct Arrival {
    /// Chart and explanation.
    pub html: String,
    /// Answer to the paper's 16 ms.
    pub found: String,
    /// Time after which every node has moved by 0.5 % of the peak [ms].
    pub half_percent_ms: f64,
    /// The numbers.
    pub data: DataFile,
}

/// Speed of pressure waves, √((λ + 2μ)/ρ) [m/s].
fn pressure_speed() -> f64 {
    (YOUNG_PA * (1.0 - POISSON) / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)) / DENSITY_KG_M3).sqrt()
}

/// Arrival [ms] over the thresholds [% of the peak]; no point where the wave has not arrived.
fn curve(wave: &Wave, step_s: f64) -> Vec<(f64, f64)> {
    THRESHOLDS.iter().filter_map(|&share| Some((100.0 * share, 1e3 * wave.arrival(share, step_s)?))).collect()
}

/// Arrival [ms] at a threshold; not a number if there was none.
fn at(points: &[(f64, f64)], percent: f64) -> f64 {
    points.iter().find(|(x, _)| (x / percent - 1.0).abs() < 1e-9).map_or(f64::NAN, |(_, ms)| *ms)
}

/// The arrival of the waves by a point and by a plane, and of the first one in an independent code.
///
/// # Errors
/// A mesh that can't be made.
pub fn arrival(
    cells: u32,
    body: &RecordedBody,
    waves: &[Wave; 2],
    progress: &mut dyn StageProgress,
) -> Result<Arrival, ReproduceError> {
    let mesh = paper_cube::mesh(cells)?;
    let surface = body.surface_nodes();
    let centre = body.nearest_node(DVec3::new(0.0, 0.05, 0.0));
    let step_s = EXPLICIT_STEP_S / f64::from(cells);
    progress.begin("an independent solution", EXPLICIT.len() as u64);
    let mut independent = Vec::new();
    for (number, (mass, beta_s, label)) in EXPLICIT.into_iter().enumerate() {
        let cube = ExplicitCube::new(&mesh, mass);
        let load = (centre, DVec3::NEG_Y, HELD as f64 * STEP_S);
        let frames = cube.response(load, beta_s, (step_s, (EXPLICIT_S / step_s).round() as usize), &surface);
        independent.push((label, curve(&Wave { frames }, step_s)));
        progress.advance(number as u64 + 1);
    }
    progress.finish();
    let [point, plane] = waves.each_ref().map(|wave| curve(wave, STEP_S));
    // From the middle of the top to a corner of the bottom.
    let pressure_ms = 1e3 * DVec3::new(0.05, 0.1, 0.05).length() / pressure_speed();
    let line = |label: &str, points: &[(f64, f64)], style| Series {
        label: label.into(),
        points: points.to_vec(),
        style,
    };
    let shown =
        |points: &[(f64, f64)]| points.iter().copied().filter(|(x, _)| *x <= 1.001).collect::<Vec<_>>();
    let mut series = vec![line("palpate, consistent mass", &shown(&point), Style::LineAndMarkers)];
    series
        .extend(independent.iter().map(|(label, points)| line(label, &shown(points), Style::LineAndMarkers)));
    let level = |value, label| ReferenceLine { axis: AxisName::Y, value, label };
    let chart = Chart {
        title: "Time until every surface node has moved, after an impulse by a point".into(),
        x: Axis { label: "threshold [% of the peak displacement]".into(), scale: Scale::Log },
        y: Axis { label: "arrival [ms]".into(), scale: Scale::Linear },
        series,
        reference_lines: vec![
            level(16.0, "paper: 16 ms".into()),
            level(pressure_ms, format!("pressure wave: {pressure_ms:.1} ms")),
        ],
    };
    let mut html = figure(
        &chart.svg(),
        "Arrival of the wave of the paper's figure 2 over what counts as arrived. Displacement is that seen from outside, deformation and \
         rigid motion together.",
    );
    let early = |points: &[(f64, f64)]| format!("{:.1} ms", at(points, 0.01));
    html += &paragraph(&format!(
        "The paper sees its wave reach all nodes after approximately 16 ms and tells no threshold. Here every node has moved by 1 % of the peak \
         after {:.1} ms, by 0.5 % after {:.1} ms and by 0.1 % after {:.1} ms. The pressure wave, √((λ+2μ)/ρ) = {:.2} m/s, needs {pressure_ms:.1} ms \
         for the {:.1} mm to the far corners.",
        at(&point, 1.0),
        at(&point, 0.5),
        at(&point, 0.1),
        pressure_speed(),
        1e3 * DVec3::new(0.05, 0.1, 0.05).length(),
    ));
    html += &paragraph(&format!(
        "At small thresholds nodes move before the pressure wave can be there: at 0.01 %, after {}. That is the consistent mass matrix. Its inverse \
         joins every node with every other, so that a force accelerates all nodes at once, ever less with the distance, and its short waves run \
         faster than the continuum's; the lumped mass has neither. A second finite element code, which shares nothing with palpate's but the \
         mesh (explicit central differences with steps of {:.0} µs), has {} with the consistent mass and {} with the lumped one. Without the damping βK, \
         which spreads like heat, it is {} with the lumped mass; what is left is the mesh of {:.1} mm.",
        early(&point),
        1e6 * step_s,
        early(&independent[0].1),
        early(&independent[1].1),
        early(&independent[2].1),
        100.0 / f64::from(cells),
    ));
    let rows = THRESHOLDS.iter().map(|share| {
        let percent = 100.0 * share;
        let others = independent.iter().map(|(_, points)| at(points, percent));
        [percent, at(&point, percent), at(&plane, percent)].into_iter().chain(others).collect()
    });
    let data = csv(
        "arrival.csv",
        "threshold_percent_of_peak,point_ms,plane_ms,independent_consistent_ms,independent_lumped_ms,independent_lumped_undamped_ms",
        rows,
    );
    let found = format!(
        "every node has moved by 0.5 % of the peak after {:.1} ms, by 1 % after {:.1} ms, by 0.1 % after {:.1} ms, by 0.01 % after {:.1} ms: before the pressure wave's {pressure_ms:.1} ms, by the \
         consistent mass matrix ({:.1} ms with a lumped one in an independent code)",
        at(&point, 0.5),
        at(&point, 1.0),
        at(&point, 0.1),
        at(&point, 0.01),
        at(&independent[1].1, 0.01),
    );
    Ok(Arrival { html, found, half_percent_ms: at(&point, 0.5), data })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::cube;
    use crate::chapters::impulses;
    use palpate_fem::SilentProgress;

    #[test]
    fn the_pressure_wave_needs_6_9_ms_to_the_far_corners() {
        assert!((1e3 * DVec3::new(0.05, 0.1, 0.05).length() / pressure_speed() - 6.94).abs() < 0.01);
    }

    #[test]
    fn what_is_early_is_early_by_the_consistent_mass() {
        let body = cube(6, 60, &mut SilentProgress).expect("a cube");
        let chapter = impulses::chapter(6, &body, &mut SilentProgress).expect("a chapter");
        let arrival = chapter.data.iter().find(|file| file.name == "arrival.csv").expect("its numbers");
        let row: Vec<f64> = arrival
            .text
            .lines()
            .nth(1)
            .expect("0.01 %")
            .split(',')
            .map(|n| n.parse().expect("a number"))
            .collect();
        let (palpate, consistent, lumped, undamped) = (row[1], row[3], row[4], row[5]);
        // SciPy's solution of the same equations, with a direct solver for the mass: 1.68, 4.48 and 5.16 ms.
        for (found, expected) in [(consistent, 1.68), (lumped, 4.48), (undamped, 5.16)] {
            assert!((found - expected).abs() < 0.05, "{found} ms, expected {expected}");
        }
        assert!(
            (palpate - consistent).abs() < 0.2 * (lumped - consistent),
            "palpate's mass is consistent: {palpate} ms"
        );
    }
}
