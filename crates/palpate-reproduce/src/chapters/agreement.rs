//! The two forms of the response against each other, the two ways of recording, and contact between nodes.

use crate::bodies::{cube, table_in_memory};
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::page::{Section, code, figure, paragraph, table};
use crate::powers::power_of_ten;
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::verdict::quantity;
use glam::DVec3;
use palpate::{
    Collider, DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart,
    Obstacle, Pose, ResponseForm, Sampling, Shape, State, Twist, step,
};
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use palpate_fem::{RecordedBody, SilentProgress};
use std::sync::Arc;

/// Small enough for all its modes.
const CELLS: u32 = 4;
const SAMPLES: usize = 500;
const STEP_S: f64 = 1e-3;
const HEADING: &str = "Two forms, two recordings, contact (the paper's equations (4)–(10))";

/// Way of the hands [m].
const SWAY_M: f64 = 4e-3;

/// Depth that a tip presses in [m], and the time that it takes [s].
const PRESS_M: f64 = 0.01;
const PRESS_S: f64 = 0.25;

/// fir against modal, and time integration against the closed form of all modes.
pub fn chapter(progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    progress.begin("agreement", 1);
    let body = cube(CELLS, usize::MAX, &mut SilentProgress)?;
    let mut rows = Vec::new();
    let mut differences = Vec::new();
    for (number, narrow) in [("double precision", false), ("single precision", true)] {
        let found = forms_apart(&body, narrow)?;
        rows.push(vec![format!("R[s] in {number} against modes"), power_of_ten(found.force, 1)]);
        differences.push(found);
    }
    let mut html = table(
        "Largest difference of two hands' forces, as a share of the largest force",
        &["forms", "difference"],
        &rows,
    );
    html += &paragraph(
        "A free cube of 4³ cells with all its modes, shaken by two hands that change the points they hold every 60 steps, most of them between nodes, \
         for as long as the table's window of 500 steps: the table holds the modal form's own numbers, so what is left is \
         round-off.",
    );
    let pressed = press(&body)?;
    html += &paragraph(&format!(
        "Given displacements are met: the held points are where the hands are to {} of the motion, on R[s] and in modal form. Between nodes a force is \
         distributed to the corners of its triangle with the weights that also give the displacement, exactly and not by repeated formulas of one and two nodes. A tip \
         without a coupling that presses {:.0} mm into the cube on a floor takes the surface with it: at the end of every step tip and deformed surface are \
         {} mm apart at most, the force is {:.2} N.",
        power_of_ten(differences[0].distance, 0),
        1e3 * PRESS_M,
        power_of_ten(1e3 * pressed.gap_m, 1),
        pressed.force_n,
    ));

    let surface = body.surface_nodes();
    let of = |method| TableParameters {
        step_s: 2e-3,
        samples: 100,
        sampling: Sampling::End,
        method,
        touchable_nodes: vec![surface[0]],
        observed_nodes: surface.clone(),
    };
    let columns = |method| -> Result<Vec<f64>, ReproduceError> {
        let parameters = of(method);
        let recorder = TableRecorder::new(&body, &parameters)?;
        Ok(recorder.columns(0..3, 3, &|_| {}).concat())
    };
    let exact = columns(TableMethod::ClosedForm)?;
    let scale = exact.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    let mut points = Vec::new();
    for substeps in [1, 2, 4, 8, 16] {
        let computed = columns(TableMethod::Transient { substeps })?;
        let error = exact.iter().zip(&computed).fold(0.0_f64, |worst, (a, b)| worst.max((a - b).abs()));
        points.push((2.0 / f64::from(substeps), error / scale));
    }
    progress.finish();
    let (coarse, fine) = (points[2], points[4]);
    let order = (coarse.1 / fine.1).ln() / (coarse.0 / fine.0).ln();
    let guide = points.iter().map(|&(h, _)| (h, fine.1 * (h / fine.0).powi(5))).collect();
    let chart = Chart {
        title: "Time integration against the closed form".into(),
        x: Axis { label: "integration step [ms]".into(), scale: Scale::Log },
        y: Axis { label: "largest error, share of the largest response".into(), scale: Scale::Log },
        series: vec![
            Series { label: "measured".into(), points: points.clone(), style: Style::LineAndMarkers },
            Series { label: "order 5".into(), points: guide, style: Style::Dashed },
        ],
        reference_lines: Vec::new(),
    };
    html += &figure(
        &chart.svg(),
        &format!(
            "The two ways of recording come together with the integrator's order: {order:.2} observed over the last two halvings."
        ),
    );
    let data = csv("convergence.csv", "step_ms,error", points.into_iter().map(|(h, e)| vec![h, e]));
    let findings = vec![
        Finding::measured(
            Statement::GivenDisplacement,
            quantity("difference of the forces", differences[0].force, "").at_most(ROUND_OFF),
            format!("held points are where the hands are to {} of their motion; forces on R[s] and by modes agree to {}", power_of_ten(differences[0].distance, 0), power_of_ten(differences[0].force, 1)),
        ),
        Finding::measured(
            Statement::PointInTriangle,
            quantity("distance from the hand", differences[0].distance, "of its way").at_most(ROUND_OFF),
            "weights of the triangle for force and displacement alike: points between nodes are held as exactly as nodes (row above)".into(),
        ),
        Finding::measured(
            Statement::GodObject,
            quantity("gap", 1e3 * pressed.gap_m, "mm").at_most(FELT_MM),
            format!("a tip pressed {:.0} mm deep: proxy and deformed surface at most {} mm apart, force {:.2} N", 1e3 * PRESS_M, power_of_ten(1e3 * pressed.gap_m, 1), pressed.force_n),
        ),
    ];
    html += &code("palpate reproduce --only agreement");
    let section = Section { id: "agreement".into(), heading: HEADING.into(), body: html };
    Ok(Chapter { section, data: vec![data], findings })
}

/// Round-off of sums of some hundred terms in another order, and of the contact solver [1].
const ROUND_OFF: f64 = 1e-9;

/// Gap that no hand feels: a micrometre [mm].
const FELT_MM: f64 = 1e-3;

/// Differences of two forms of the response.
struct Difference {
    /// Largest difference of forces, as a share of the largest force.
    force: f64,
    /// Largest distance of a held point from its hand, as a share of the hands' way.
    distance: f64,
}

/// The two forms under the same two hands.
fn forms_apart(body: &RecordedBody, narrow: bool) -> Result<Difference, ReproduceError> {
    let rounded = |value: f64| if narrow { f64::from(value as f32) } else { value };
    let surface = body.surface_nodes();
    let table = table_in_memory(body, STEP_S, SAMPLES, surface, rounded)?;
    let recording = Arc::new(body.recording.clone());
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let forms = [ResponseForm::Modal, ResponseForm::Fir(Arc::new(table))];
    let parameters = ModelParameters {
        devices: vec![DeviceParameters::default(); 2],
        step_s: STEP_S,
        ..ModelParameters::for_reference()
    };
    let mut scenes = Vec::new();
    for response in forms {
        let object = ModelObject { response, ..ModelObject::new(recording.clone(), start) };
        let model = Model::new(parameters.clone(), vec![object])?;
        let state = State::new(&model);
        scenes.push((model, state));
    }
    let places = [DVec3::new(-0.05, 0.0, 0.0), DVec3::new(-0.05, 0.02, 0.01), DVec3::new(-0.04, 0.05, 0.0)];
    let (mut worst, mut largest, mut apart) = (0.0_f64, 0.0_f64, 0.0_f64);
    for number in 0..SAMPLES {
        let t = number as f64 * STEP_S;
        let devices = [1.0, -1.0].map(|side| {
            let place = places[(number / 60) % 3] * DVec3::new(side, 1.0, side);
            let grasp = recording.surface.nearest(place).map(|(point, _)| Grasp { object: 0, point });
            let sway = DVec3::new(SWAY_M * (20.0 * t).sin(), 1e-3 * (35.0 * t).sin(), 0.0);
            DeviceInput { position: place * 0.97 + sway, mode: grasp.into() }
        });
        let input = Input { devices: devices.to_vec(), ..Input::default() };
        let forces: Vec<Vec<DVec3>> = scenes
            .iter_mut()
            .map(|(model, state)| {
                let output = step(model, state, &input);
                for (hand, held) in input.devices.iter().zip(&output.devices) {
                    apart = apart.max((hand.position - held.proxy).length());
                }
                output.devices.iter().map(|d| d.force_on_hand).collect()
            })
            .collect();
        for (modal, fir) in forces[0].iter().zip(&forces[1]) {
            worst = worst.max((*modal - *fir).length());
            largest = largest.max(modal.length());
        }
    }
    Ok(Difference { force: worst / largest, distance: apart / SWAY_M })
}

/// A tip that presses.
struct Press {
    /// Largest distance of the tip from the deformed surface at the end of a step [m].
    gap_m: f64,
    /// Force at the full depth [N].
    force_n: f64,
}

/// A tip without a coupling presses the middle of the top of the cube, which stands on a floor.
fn press(body: &RecordedBody) -> Result<Press, ReproduceError> {
    let recording = Arc::new(body.recording.clone());
    let top = recording.surface.positions.iter().map(|p| p.y).fold(f64::MIN, f64::max);
    let floor = Obstacle {
        shape: Shape::Plane { normal: DVec3::Y },
        pose: Pose { position: DVec3::Y * -top, ..Pose::IDENTITY },
        friction: 0.5,
    };
    let parameters = ModelParameters {
        devices: vec![DeviceParameters { coupling: None, ..DeviceParameters::default() }],
        obstacles: vec![floor],
        step_s: STEP_S,
        ..ModelParameters::for_reference()
    };
    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(recording, start)])?;
    let mut state = State::new(&model);
    let mut pressed = Press { gap_m: 0.0, force_n: 0.0 };
    for number in 0..=(2.0 * PRESS_S / STEP_S) as u32 {
        let depth = PRESS_M * (f64::from(number) * STEP_S / PRESS_S).min(1.0);
        let tip = DeviceInput::touching(DVec3::Y * (top + 1e-6 - depth));
        let output = step(&model, &mut state, &Input { devices: vec![tip], ..Input::default() });
        let touches = output.contacts.iter().filter(|contact| matches!(contact.against, Collider::Device(_)));
        pressed.gap_m = touches.map(|contact| contact.gap.abs()).fold(pressed.gap_m, f64::max);
        pressed.force_n = output.devices[0].force_on_hand.y;
    }
    Ok(pressed)
}
