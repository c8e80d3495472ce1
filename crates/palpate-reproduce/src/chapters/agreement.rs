//! The two forms of the response against each other, and the two ways of recording.

use crate::bodies::{cube, table_in_memory};
use crate::chapter::{Chapter, csv};
use crate::chart::{Axis, Chart, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::page::{Section, figure, paragraph, table};
use crate::progress::StageProgress;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    ResponseForm, Sampling, State, Twist, step,
};
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use palpate_fem::{RecordedBody, SilentProgress};
use std::sync::Arc;

/// Small enough for all its modes.
const CELLS: u32 = 4;
const SAMPLES: usize = 500;
const STEP_S: f64 = 1e-3;

/// fir against modal, and time integration against the closed form of all modes.
pub fn chapter(progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    progress.begin("agreement", 1);
    let body = cube(CELLS, usize::MAX, &mut SilentProgress)?;
    let mut rows = Vec::new();
    for (number, narrow) in [("double precision", false), ("single precision", true)] {
        let error = largest_force_difference(&body, narrow)?;
        rows.push(vec![format!("fir against modal, {number}"), format!("{error:.1e}")]);
    }
    let mut html = table(
        "Largest difference of two hands' forces, as a share of the largest force",
        &["forms", "difference"],
        &rows,
    );
    html += &paragraph(
        "A free cube of 4³ cells with all its modes, shaken by two hands that change the nodes they hold every 60 steps, \
         for as long as the table's window of 500 steps: the table holds the modal form's own numbers, so what is left is \
         round-off.",
    );

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
    let section = Section { id: "agreement".into(), heading: "Two forms, two recordings".into(), body: html };
    let data = csv("convergence.csv", "step_ms,error", points.into_iter().map(|(h, e)| vec![h, e]));
    Ok(Chapter { section, data: vec![data], findings: Vec::new() })
}

/// Largest difference of forces between both forms, as a share of the largest force.
fn largest_force_difference(body: &RecordedBody, narrow: bool) -> Result<f64, ReproduceError> {
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
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for number in 0..SAMPLES {
        let t = number as f64 * STEP_S;
        let devices = [1.0, -1.0].map(|side| {
            let place = places[(number / 60) % 3] * DVec3::new(side, 1.0, side);
            let grasp = recording.surface.nearest(place).map(|(point, _)| Grasp { object: 0, point });
            let sway = DVec3::new(4e-3 * (20.0 * t).sin(), 1e-3 * (35.0 * t).sin(), 0.0);
            DeviceInput { position: place * 0.97 + sway, mode: grasp.into() }
        });
        let input = Input { devices: devices.to_vec(), ..Input::default() };
        let forces: Vec<Vec<DVec3>> = scenes
            .iter_mut()
            .map(|(model, state)| {
                step(model, state, &input).devices.iter().map(|d| d.force_on_hand).collect()
            })
            .collect();
        for (modal, fir) in forces[0].iter().zip(&forces[1]) {
            worst = worst.max((*modal - *fir).length());
            largest = largest.max(modal.length());
        }
    }
    Ok(worst / largest)
}
