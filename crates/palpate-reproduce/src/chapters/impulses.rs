//! Figures 2 and 3: an impulse by a point and by a plane on the top face, and how the wave arrives.

use crate::chapter::{Chapter, DataFile, csv};
use crate::chart::{Axis, AxisName, Chart, ReferenceLine, Scale, Series, Style};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::page::{Section, figure, gallery, paragraph};
use crate::progress::StageProgress;
use crate::surface_picture::{Frame, Picture, View, colour_bar};
use glam::{DMat3, DVec3};
use palpate::Sampling;
use palpate_fem::RecordedBody;
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};

/// Step of the integration [s]; the force is held for `HELD` of them, the paper's step of 2 ms.
const STEP_S: f64 = 0.5e-3;
const HELD: usize = 4;
const SAMPLES: usize = 160;

/// Moments that are shown [ms].
const SHOWN_MS: [f64; 8] = [2.0, 4.0, 8.0, 12.0, 16.0, 24.0, 40.0, 72.0];

/// Displacement in the pictures, as a share of the cube's side: that of the travelling wave, from this moment [ms] on, and
/// the largest of all. They are exaggerated to the lesser of the two.
const TRAVELLING_MS: f64 = 8.0;
const SHOWN_SHARE: f64 = 0.12;
const LARGEST_SHARE: f64 = 0.35;

/// Shares of the peak at which a node counts as reached by the wave.
const THRESHOLDS: [f64; 9] = [1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3, 1e-2, 2e-2, 5e-2];

/// Displacements of the surface [m] after one kind of impulse: sample by sample, node by node.
struct Wave {
    frames: Vec<Vec<DVec3>>,
}

impl Wave {
    /// Response to a force held for `HELD` steps, from the response to one that is held for one.
    fn new(column: &[f64], nodes: usize) -> Self {
        let single: Vec<Vec<DVec3>> = column
            .chunks_exact(3 * nodes)
            .map(|sample| sample.chunks_exact(3).map(DVec3::from_slice).collect())
            .collect();
        let at = |s: usize, node: usize| (0..HELD.min(s + 1)).map(|k| single[s - k][node]).sum();
        Self { frames: (0..single.len()).map(|s| (0..nodes).map(|node| at(s, node)).collect()).collect() }
    }

    /// With the rigid motion of a body of some mass [kg] and inertia added, after a force that acts on points: what one
    /// who stands beside it sees.
    fn with_motion(&self, rest: &[DVec3], mass: f64, inertia: DMat3, forces: &[(DVec3, DVec3)]) -> Self {
        let force: DVec3 = forces.iter().map(|(_, force)| *force).sum();
        let torque: DVec3 = forces.iter().map(|(point, force)| point.cross(*force)).sum();
        let (acceleration, turning) = (force / mass, inertia.inverse() * torque);
        let held = HELD as f64 * STEP_S;
        let frames = self.frames.iter().enumerate().map(|(s, frame)| {
            let t = (s + 1) as f64 * STEP_S;
            // Twice integrated: ½t² while the force is held, then on at constant speed.
            let way = if t <= held { 0.5 * t * t } else { held * t - 0.5 * held * held };
            let moved = |(p, u): (&DVec3, &DVec3)| *u + (acceleration + turning.cross(*p)) * way;
            rest.iter().zip(frame).map(moved).collect()
        });
        Self { frames: frames.collect() }
    }

    fn peak(&self) -> f64 {
        self.frames.iter().flatten().fold(0.0, |peak, u| u.length().max(peak))
    }

    /// When every node has moved by more than a share of the peak [s]; linear between samples.
    fn arrival(&self, share: f64) -> Option<f64> {
        let bound = share * self.peak();
        let of_node = |node: usize| {
            let s = self.frames.iter().position(|frame| frame[node].length() > bound)?;
            let (before, after) =
                (if s == 0 { 0.0 } else { self.frames[s - 1][node].length() }, self.frames[s][node].length());
            Some(STEP_S * (s as f64 + (bound - before) / (after - before)))
        };
        (0..self.frames[0].len()).map(of_node).try_fold(0.0, |latest: f64, t| Some(latest.max(t?)))
    }
}

/// The two figures and the arrival curve.
pub fn chapter(body: &RecordedBody, progress: &mut dyn StageProgress) -> Result<Chapter, ReproduceError> {
    let surface = body.surface_nodes();
    let top = |p: &DVec3| p.y > 0.05 - 1e-9;
    let centre = body.nearest_node(DVec3::new(0.0, 0.05, 0.0));
    let on_top: Vec<usize> = (0..body.nodes().len()).filter(|&node| top(&body.nodes()[node])).collect();
    // Downward: 1 N on the middle node; 1 N over the whole face, the same on each of its nodes.
    let mut loads = vec![vec![0.0; body.dofs()]; 2];
    loads[0][3 * centre + 1] = -1.0;
    for &node in &on_top {
        loads[1][3 * node + 1] = -1.0 / on_top.len() as f64;
    }
    let parameters = TableParameters {
        step_s: STEP_S,
        samples: SAMPLES,
        sampling: Sampling::End,
        method: TableMethod::Transient { substeps: 1 },
        touchable_nodes: surface.clone(),
        observed_nodes: surface.clone(),
    };
    progress.begin("impulses (figures 2 and 3)", 1);
    let recorder = TableRecorder::new(body, &parameters)?;
    let responses = recorder.responses(&loads);
    progress.finish();
    let waves: Vec<Wave> = responses.iter().map(|column| Wave::new(column, surface.len())).collect();

    let mut html = String::new();
    let mut data = Vec::new();
    let names = [
        (
            "Figure 2",
            "a point",
            "figure2",
            "an impulse of 1 N held for 2 ms on the middle node of the top face",
        ),
        ("Figure 3", "a plane", "figure3", "the same impulse spread evenly over the nodes of the top face"),
    ];
    for (wave, (label, by, file, what)) in waves.iter().zip(names) {
        html += &pictures(body, &surface, wave, &format!("{label}: {what} (by {by})."));
        data.push(frames_csv(&format!("{file}.csv"), body, &surface, wave));
    }
    // What moves as a whole counts, too: seen from the body's own frame, far nodes move at once, backwards.
    let rest: Vec<DVec3> = surface.iter().map(|&node| body.nodes()[node as usize]).collect();
    let share = DVec3::NEG_Y / on_top.len() as f64;
    let forces = [
        vec![(body.nodes()[centre], DVec3::NEG_Y)],
        on_top.iter().map(|&node| (body.nodes()[node], share)).collect(),
    ];
    let (mass, inertia) = (body.recording.mass(), body.recording.inertia());
    let waves: Vec<Wave> = waves
        .iter()
        .zip(&forces)
        .map(|(wave, forces)| wave.with_motion(&rest, mass, inertia, forces))
        .collect();
    let curve = |wave: &Wave| -> Vec<(f64, f64)> {
        let reached =
            THRESHOLDS.iter().filter_map(|&share| Some((100.0 * share, 1e3 * wave.arrival(share)?)));
        reached.collect()
    };
    let (point, plane) = (curve(&waves[0]), curve(&waves[1]));
    // From the middle of the top to a corner of the bottom, with the speed of the pressure wave.
    let pressure_ms = 1e3 * DVec3::new(0.05, 0.1, 0.05).length() / 17.64;
    let chart = Chart {
        title: "Time until every surface node has moved".into(),
        x: Axis { label: "threshold [% of the peak displacement]".into(), scale: Scale::Log },
        y: Axis { label: "arrival [ms]".into(), scale: Scale::Linear },
        series: vec![
            Series {
                label: "impulse by a point".into(),
                points: point.clone(),
                style: Style::LineAndMarkers,
            },
            Series {
                label: "impulse by a plane".into(),
                points: plane.clone(),
                style: Style::LineAndMarkers,
            },
        ],
        reference_lines: vec![
            ReferenceLine { axis: AxisName::Y, value: 16.0, label: "paper: 16 ms".into() },
            ReferenceLine {
                axis: AxisName::Y,
                value: pressure_ms,
                label: format!("pressure wave: {pressure_ms:.1} ms"),
            },
            ReferenceLine { axis: AxisName::X, value: 1.0, label: "1 %".into() },
        ],
    };
    let at = |points: &[(f64, f64)], percent: f64| {
        points.iter().find(|(x, _)| (x / percent - 1.0).abs() < 1e-9).map_or(f64::NAN, |(_, y)| *y)
    };
    html += &figure(&chart.svg(), "When the wave has reached all nodes depends on what counts as reached.");
    html += &paragraph(&format!(
        "The paper sees its wave reach all nodes after approximately 16 ms. The pressure wave needs {pressure_ms:.1} ms from the \
         middle of the top to the far corners; with a threshold of 1 % of the peak every node of the cube here has moved \
         after {:.1} ms, with 0.1 % after {:.1} ms, with 0.01 % after {:.1} ms. Displacement is that seen from outside, deformation and rigid \
         motion together, of the impulse that is held for 2 ms. An arrival time without its threshold says little.",
        at(&point, 1.0),
        at(&point, 0.1),
        at(&point, 0.01)
    ));
    let rows = THRESHOLDS.iter().map(|share| {
        let of = |wave: &Wave| wave.arrival(*share).map_or(f64::NAN, |t| 1e3 * t);
        vec![100.0 * share, of(&waves[0]), of(&waves[1])]
    });
    data.push(csv("arrival.csv", "threshold_percent_of_peak,point_ms,plane_ms", rows));
    let section =
        Section { id: "impulses".into(), heading: "Impulse responses (Figures 2 and 3)".into(), body: html };
    let findings = vec![Finding {
        what: "a wave from the middle of the top has moved every node".into(),
        place: "section 3.1, figures 2 and 3",
        paper: "after approximately 16 ms".into(),
        ours: format!(
            "after {:.1} ms by 1 % of the peak, {:.1} ms by 0.1 %, {:.1} ms by 0.01 %",
            at(&point, 1.0),
            at(&point, 0.1),
            at(&point, 0.01)
        ),
        section: "impulses",
    }];
    Ok(Chapter { section, data, findings })
}

/// The deformed surface at some moments, exaggerated, coloured by displacement.
fn pictures(body: &RecordedBody, surface: &[u32], wave: &Wave, caption: &str) -> String {
    let mut number = vec![0_u32; body.nodes().len()];
    surface.iter().enumerate().for_each(|(at, &node)| number[node as usize] = at as u32);
    let triangles: Vec<[u32; 3]> =
        body.surface_triangles().iter().map(|t| t.map(|node| number[node as usize])).collect();
    let rest: Vec<DVec3> = surface.iter().map(|&node| body.nodes()[node as usize]).collect();
    let frames: Vec<(f64, &Vec<DVec3>)> = SHOWN_MS
        .iter()
        .filter_map(|&ms| Some((ms, wave.frames.get((ms * 1e-3 / STEP_S).round() as usize - 1)?)))
        .collect();
    let peak_from = |from_ms: f64| {
        let late = frames.iter().filter(|(ms, _)| *ms >= from_ms).flat_map(|(_, frame)| frame.iter());
        late.fold(0.0_f64, |peak, u| peak.max(u.length()))
    };
    // The wave is to be seen, the first indentation to stay one.
    let (travelling, first) = (peak_from(TRAVELLING_MS), peak_from(0.0));
    let scale = (SHOWN_SHARE * 0.1 / travelling).min(LARGEST_SHARE * 0.1 / first);
    let deformed: Vec<Vec<DVec3>> = frames
        .iter()
        .map(|(_, frame)| rest.iter().zip(*frame).map(|(p, u)| *p + *u * scale).collect())
        .collect();
    let view = View { azimuth_deg: 30.0, elevation_deg: 25.0 };
    let frame = Frame::around(deformed.iter().flatten(), view);
    let range = (0.0, 1e3 * travelling);
    let drawn: Vec<String> = frames
        .iter()
        .zip(&deformed)
        .map(|((ms, u), positions)| {
            let values: Vec<f64> = u.iter().map(|u| 1e3 * u.length()).collect();
            let caption = format!("{ms} ms");
            Picture { positions, triangles: &triangles, values: &values, range, view, frame, caption }.svg()
        })
        .collect();
    let key = colour_bar(range, "displacement [mm]; yellow: this and more");
    gallery(&drawn, &key, &format!("{caption} Displacements are drawn {scale:.1} times as large."))
}

/// Every shown moment and node: where it is at rest and how far it has moved.
fn frames_csv(name: &str, body: &RecordedBody, surface: &[u32], wave: &Wave) -> DataFile {
    let rows = SHOWN_MS.iter().flat_map(|&ms| {
        let frame = &wave.frames[(ms * 1e-3 / STEP_S).round() as usize - 1];
        surface.iter().zip(frame).map(move |(&node, u)| {
            let p = body.nodes()[node as usize];
            vec![ms, f64::from(node), p.x, p.y, p.z, u.x, u.y, u.z]
        })
    });
    csv(name, "t_ms,node,x_m,y_m,z_m,ux_m,uy_m,uz_m", rows)
}
