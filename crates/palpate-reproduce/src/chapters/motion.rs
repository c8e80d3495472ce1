//! Motion: the share of a force that equation (2) drops from equation (3), equations (11) to (14), and slow rotation.

use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::page::{Section, code, figure, paragraph, table};
use crate::powers::power_of_ten;
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::verdict::quantity;
use glam::{DQuat, DVec3};
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle,
    Pose, Recording, RigidCompliance, RigidIntegrator, Sampling, Shape, State, Twist, step,
};
use palpate_fem::RecordedBody;
use palpate_fem::paper_cube::{DENSITY_KG_M3, SIDE_M, YOUNG_PA};
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use std::sync::Arc;

/// The paper's step and half of it [s].
const STEPS_S: [f64; 2] = [2e-3, 1e-3];

/// Two hands shake the cube, as in the paper's figure 5(b): frequency [Hz], to each side [m], time [s].
const SHAKES_HZ: f64 = 2.0;
const SWAY_M: f64 = 0.02;
const SECONDS: f64 = 5.0;

/// Fall of the rebounds [m], and the steps [s] of both integrators.
const DROP_M: f64 = 0.05;
const FALL_STEPS_S: [f64; 3] = [2e-3, 1e-3, 5e-4];
const G: f64 = 9.81;

/// Turns about two axes [°], and an angular rate [1/s] for the centrifugal strain: a turn a second.
const TURNS_DEG: [f64; 3] = [1.0, 10.0, 30.0];
const RATE: f64 = std::f64::consts::TAU;

/// Limit of what may be called negligible [%], and of what Euler's method of first order may change a rebound by at the paper's step [%].
const NEGLIGIBLE_PERCENT: f64 = 1.0;
const EULER_PERCENT: f64 = 10.0;

/// Force on the left hand along the shaking [N] in each step.
fn shaken(
    recording: &Arc<Recording>,
    step_s: f64,
    rigid_compliance: RigidCompliance,
) -> Result<Vec<f64>, ReproduceError> {
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let parameters = ModelParameters {
        step_s,
        rigid_compliance,
        devices: vec![DeviceParameters::default(); 2],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), start)])?;
    let mut state = State::new(&model);
    let sides = [-0.5 * SIDE_M, 0.5 * SIDE_M].map(|x| DVec3::X * x);
    let grasps =
        sides.map(|side| recording.surface.nearest(side).map(|(point, _)| Grasp { object: 0, point }));
    let forces = (1..=(SECONDS / step_s).round() as u64).map(|number| {
        let t = number as f64 * step_s;
        // It begins without a jump of the speed.
        let sway = DVec3::X * (SWAY_M * (4.0 * t).min(1.0) * (std::f64::consts::TAU * SHAKES_HZ * t).sin());
        let hands = sides.into_iter().zip(grasps);
        let devices =
            hands.map(|(side, grasp)| DeviceInput { position: side + sway, mode: grasp.into() }).collect();
        step(&model, &mut state, &Input { devices, ..Input::default() }).devices[0].force_on_hand.x
    });
    Ok(forces.collect())
}

/// Root of the mean square.
fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_u32), |(sum, count), v| (sum + v * v, count + 1));
    (sum / f64::from(count.max(1))).sqrt()
}

/// Effect of the dropped terms at one step.
struct Dropped {
    step_s: f64,
    /// ½h²/m over R[0] of the held point along the shaking [1].
    of_compliance: f64,
    /// Root mean square of the difference over that of the force, over the whole time [1].
    of_force: f64,
    /// Share of the force, second by second [1].
    by_second: Vec<f64>,
}

/// Effect of the dropped terms at a step [s].
fn dropped(recording: &Arc<Recording>, body: &RecordedBody, step_s: f64) -> Result<Dropped, ReproduceError> {
    let with = shaken(recording, step_s, RigidCompliance::Included)?;
    let without = shaken(recording, step_s, RigidCompliance::Dropped)?;
    let share = |range: std::ops::Range<usize>| {
        let difference = root_mean_square(range.clone().map(|at| with[at] - without[at]));
        difference / root_mean_square(with[range].iter().copied())
    };
    let per_second = (1.0 / step_s).round() as usize;
    let node = body.nearest_node(DVec3::X * (-0.5 * SIDE_M));
    let parameters = TableParameters {
        step_s,
        samples: 1,
        sampling: Sampling::End,
        method: TableMethod::ClosedForm,
        touchable_nodes: vec![node as u32],
        observed_nodes: vec![node as u32],
    };
    // R[0] along x.
    let own = TableRecorder::new(body, &parameters)?.columns(0..1, 1, &|_| {})[0][0];
    Ok(Dropped {
        step_s,
        of_compliance: 0.5 * step_s * step_s / recording.mass() / own,
        of_force: share(0..with.len()),
        by_second: (0..with.len() / per_second)
            .map(|s| share(s * per_second..(s + 1) * per_second))
            .collect(),
    })
}

/// Rebound [m] of the cube that falls flat on a floor without friction.
fn rebound(recording: &Arc<Recording>, step_s: f64, motion: RigidIntegrator) -> Result<f64, ReproduceError> {
    let floor = Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.0 };
    let pose = Pose { position: DVec3::Y * (0.5 * SIDE_M + DROP_M), ..Pose::IDENTITY };
    let parameters = ModelParameters {
        step_s,
        motion,
        gravity: DVec3::Y * -G,
        obstacles: vec![floor],
        ..ModelParameters::for_real_time()
    };
    let start = ObjectStart { pose, twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(recording.clone(), start)])?;
    let mut state = State::new(&model);
    let heights: Vec<f64> = (0..(0.3 / step_s).round() as usize)
        .map(|_| step(&model, &mut state, &Input::default()).objects[0].pose.position.y - 0.5 * SIDE_M)
        .collect();
    let lowest =
        (0..heights.len() / 2).min_by(|&a, &b| heights[a].total_cmp(&heights[b])).unwrap_or_default();
    Ok(heights[lowest..].iter().copied().fold(f64::MIN, f64::max))
}

/// Angle [°] between two turns one after the other, about x and y by the same angle, and the turn by the sum of their vectors.
fn turn_error_deg(turn_deg: f64) -> f64 {
    let angle = turn_deg.to_radians();
    let both = DQuat::from_rotation_y(angle) * DQuat::from_rotation_x(angle);
    both.angle_between(DQuat::from_scaled_axis(DVec3::new(angle, angle, 0.0))).to_degrees()
}

/// The three statements.
pub fn chapter(body: &RecordedBody, progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    let recording = Arc::new(body.recording.clone());
    progress.begin("motion", (STEPS_S.len() + FALL_STEPS_S.len()) as u64);
    let drops: Vec<Dropped> =
        STEPS_S.into_iter().map(|step_s| dropped(&recording, body, step_s)).collect::<Result<_, _>>()?;
    progress.advance(STEPS_S.len() as u64);
    let integrators = [RigidIntegrator::Paper, RigidIntegrator::ExactHold];
    let mut rebounds = Vec::new();
    for step_s in FALL_STEPS_S {
        let [paper, exact] = integrators.map(|motion| rebound(&recording, step_s, motion));
        rebounds.push((step_s, paper?, exact?));
    }
    progress.finish();

    let percent = |share: f64| format!("{:.2} %", 100.0 * share);
    let rows: Vec<Vec<String>> = drops
        .iter()
        .map(|d| {
            vec![
                format!("{:.0} ms", 1e3 * d.step_s),
                percent(d.of_compliance),
                percent(d.of_force),
                percent(*d.by_second.last().unwrap_or(&f64::NAN)),
            ]
        })
        .collect();
    let line = |d: &Dropped| Series {
        label: format!("step {:.0} ms", 1e3 * d.step_s),
        points: d.by_second.iter().enumerate().map(|(s, share)| (s as f64 + 1.0, 100.0 * share)).collect(),
        style: Style::LineAndMarkers,
    };
    let chart = Chart {
        title: "What equation (2) drops, second by second".into(),
        x: Axis { label: "second of the shaking".into(), scale: Scale::Linear },
        y: Axis {
            label: "difference of the force, share of the force, root mean squares [%]".into(),
            scale: Scale::Linear,
        },
        series: drops.iter().map(line).collect(),
        reference_lines: Vec::new(),
    };
    let mut html = paragraph(&format!(
        "Equation (3) adds the acceleration of the whole body within a step, ẍ·Δt² and l·θ̈·Δt², to the response; the paper drops both as negligible. palpate keeps \
         them, ½h² times the inverse mass and inertia at the point. Here two hands hold opposite sides of the cube and shake it at {SHAKES_HZ} Hz by ±{:.0} mm for \
         {SECONDS} s, with and without them (rigid_compliance = false in a scene), in simulated time.",
        1e3 * SWAY_M
    ));
    html += &table(
        "Share of what equation (2) drops from equation (3)",
        &["step", "of R[0] at the hand", "of the force, all 5 s", "of the force, last second"],
        &rows,
    );
    html += &figure(
        &chart.svg(),
        "Difference of the forces with and without the terms. Both runs follow the same hands; an error of R[0] shifts the frequency of the cube on its two points, so that the \
         difference grows with time while that vibration lasts.",
    );
    let rows: Vec<Vec<String>> = rebounds
        .iter()
        .map(|(step_s, paper, exact)| {
            vec![
                format!("{} ms", 1e3 * step_s),
                format!("{:.1} mm", 1e3 * paper),
                format!("{:.1} mm", 1e3 * exact),
            ]
        })
        .collect();
    html += &table(
        "Rebound of the cube from a fall of 50 mm on a floor without friction, by the integration of its motion",
        &["step", "equations (11)–(14)", "exact for a held force (palpate)"],
        &rows,
    );
    let turns = TURNS_DEG.map(|turn| format!("{:.3}° at {turn}°", turn_error_deg(turn)));
    let strain = DENSITY_KG_M3 * RATE * RATE * SIDE_M * SIDE_M / (8.0 * YOUNG_PA);
    let inertia = body.recording.inertia();
    let least = inertia.x_axis.x.min(inertia.y_axis.y).min(inertia.z_axis.z);
    let most = inertia.x_axis.x.max(inertia.y_axis.y).max(inertia.z_axis.z);
    html += &paragraph(&format!(
        "Slow rotation. A cube has the same inertia about all axes ({} apart), so that no gyroscopic torque arises. Angles as a vector, equation (14), do not add up when the axis \
         changes: turns about x and then y differ from the sum of their vectors by {}. The centrifugal strain, which neither the paper nor palpate has, is at most ρω²L²/(8E) = {} kg/m³ × \
         ({:.2} 1/s)² × ({SIDE_M} m)² / (8 × {YOUNG_PA} Pa) = {:.2} % at a turn per second.",
        power_of_ten((most - least) / most, 0),
        turns.join(", "),
        DENSITY_KG_M3,
        RATE,
        100.0 * strain
    ));
    html += &code("palpate reproduce --only motion");
    let papers = &drops[0];
    let (_, paper, exact) = rebounds[0];
    let findings = vec![
        Finding::derived(
            Statement::SlowRotation,
            quantity("error of a turn by 1°", 100.0 * turn_error_deg(1.0), "%")
                .at_most(NEGLIGIBLE_PERCENT)
                .and(quantity("centrifugal strain", 100.0 * strain, "%").at_most(NEGLIGIBLE_PERCENT)),
            format!(
                "turns about x, then y, against the sum of their vectors: {}; centrifugal strain at a turn per second ρω²L²/(8E) = {:.2} %",
                turns.join(", "),
                100.0 * strain
            ),
        ),
        Finding::measured(
            Statement::DroppedTerms,
            quantity("share of the force", 100.0 * papers.of_force, "%").at_most(NEGLIGIBLE_PERCENT),
            format!(
                "at 2 ms {} of R[0] at a held point, {} of the force over {SECONDS} s of shaking, {} in the last second",
                percent(papers.of_compliance),
                percent(papers.of_force),
                percent(*papers.by_second.last().unwrap_or(&f64::NAN))
            ),
        ),
        Finding::measured(
            Statement::EulerMotion,
            quantity("rebound against the exact one", 100.0 * (paper / exact - 1.0).abs(), "%")
                .at_most(EULER_PERCENT),
            format!(
                "rebound from 50 mm at 2 ms: {:.1} mm by equations (11)–(14), {:.1} mm by the exact update for a held force",
                1e3 * paper,
                1e3 * exact
            ),
        ),
    ];
    let data = csv(
        "motion.csv",
        "step_s,rebound_paper_m,rebound_exact_m",
        rebounds.into_iter().map(|(step_s, paper, exact)| vec![step_s, paper, exact]),
    );
    let dropped = csv(
        "dropped_terms.csv",
        "step_s,second,share_of_force",
        drops.iter().flat_map(|d| {
            d.by_second.iter().enumerate().map(|(s, share)| vec![d.step_s, s as f64 + 1.0, *share])
        }),
    );
    let section = Section {
        id: "motion".into(),
        heading: "Motion (the paper's equations (3), (11)–(14))".into(),
        body: html,
    };
    Ok(Chapter { section, data: vec![data, dropped], findings })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::cube;
    use palpate_fem::SilentProgress;

    #[test]
    fn dropped_terms_are_the_smaller_the_shorter_the_step_is() {
        let body = cube(4, 60, &mut SilentProgress).expect("a cube");
        let recording = Arc::new(body.recording.clone());
        let [long, short] = STEPS_S.map(|step_s| dropped(&recording, &body, step_s).expect("forces"));
        // ½h²/m with a mass of 0.11 kg over the elastic R[0], which falls less than with h².
        let per_newton = 0.5 * STEPS_S[0] * STEPS_S[0] / 0.11;
        assert!(long.of_compliance * 1e-3 < per_newton && long.of_compliance > 2.0 * short.of_compliance);
        assert!(long.of_force > 2.0 * short.of_force, "{} and {}", long.of_force, short.of_force);
        assert_eq!(long.by_second.len(), 5);
    }

    #[test]
    fn vectors_of_turns_differ_by_half_the_product_of_the_turns() {
        // The commutator's half, θ²/2, for small angles.
        let expected = 0.5 * 1.0_f64.to_radians().powi(2);
        assert!((turn_error_deg(1.0).to_radians() / expected - 1.0).abs() < 1e-3, "{}", turn_error_deg(1.0));
    }
}
