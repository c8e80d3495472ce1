//! Figures 2 and 3: an impulse by a point and by a rigid plane on the top face.

use super::arrival::arrival;
use super::rigid_plane::{PlaneForces, plane_forces};
use super::wave::{HELD, STEP_S, Wave};
use crate::bodies::surface_mesh;
use crate::chapter::{Chapter, DataFile, csv};
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::page::{Section, code, gallery, paragraph};
use crate::powers::power_of_ten;
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::surface_picture::{Frame, Picture, View, colour_bar};
use crate::verdict::quantity;
use glam::DVec3;
use palpate::Sampling;
use palpate_fem::RecordedBody;
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};

const SAMPLES: usize = 160;

/// Moments that are shown [ms].
const SHOWN_MS: [f64; 8] = [2.0, 4.0, 8.0, 12.0, 16.0, 24.0, 40.0, 72.0];

/// Displacement in the pictures, as a share of the cube's side: that of the travelling wave, from this moment [ms] on, and
/// the largest of all. They are exaggerated to the lesser of the two.
const TRAVELLING_MS: f64 = 8.0;
const SHOWN_SHARE: f64 = 0.12;
const LARGEST_SHARE: f64 = 0.35;

/// The two figures, and the arrival of the wave.
pub fn chapter(
    cells: u32,
    body: &RecordedBody,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    let surface = body.surface_nodes();
    let is_top = |node: &u32| body.nodes()[*node as usize].y > 0.05 - 1e-9;
    let on_top: Vec<u32> = surface.iter().copied().filter(is_top).collect();
    let centre = body.nearest_node(DVec3::new(0.0, 0.05, 0.0));
    let method = TableMethod::Transient { substeps: HELD as u32 };
    progress.begin("impulses (figures 2 and 3)", 1);
    let held_s = HELD as f64 * STEP_S;
    let plane = plane_forces(body, &on_top, DVec3::NEG_Y, 1.0, held_s, method)?;
    // Downward, 1 N in all.
    let mut loads = vec![vec![0.0; body.dofs()]; 2];
    loads[0][3 * centre + 1] = -1.0;
    for (node, force) in on_top.iter().zip(&plane.forces_n) {
        loads[1][3 * *node as usize + 1] = -force;
    }
    let parameters = TableParameters {
        step_s: STEP_S,
        samples: SAMPLES,
        sampling: Sampling::End,
        method: TableMethod::Transient { substeps: 1 },
        touchable_nodes: surface.clone(),
        observed_nodes: surface.clone(),
    };
    let recorder = TableRecorder::new(body, &parameters)?;
    let responses = recorder.responses(&loads);
    progress.finish();
    let waves: Vec<Wave> = responses.iter().map(|column| Wave::new(column, surface.len())).collect();

    let place = |node: u32| body.nodes()[node as usize];
    let rest: Vec<DVec3> = surface.iter().map(|&node| place(node)).collect();
    let on_plane: Vec<(DVec3, DVec3)> = on_top
        .iter()
        .zip(&plane.forces_n)
        .map(|(&node, force)| (place(node), DVec3::NEG_Y * *force))
        .collect();
    let (mass, inertia) = (body.recording.mass(), body.recording.inertia());
    // Rigid motion counts, too: seen from the body's own frame, far nodes move at once, backwards.
    let outside = [
        waves[0].with_motion(&rest, mass, inertia, &[(place(centre as u32), DVec3::NEG_Y)]),
        waves[1].with_motion(&rest, mass, inertia, &on_plane),
    ];
    let out_of_plane = flatness(&outside[1], &surface, &is_top, plane.displacement_m);
    let flat = power_of_ten(out_of_plane, 0);
    let least_n = plane.forces_n.iter().copied().fold(f64::MAX, f64::min);

    let mut html = paragraph(
        "A force of 1 N acts downward for one step of the paper, 2 ms, on the free cube at rest. The whole finite element model is integrated \
         with steps of 0.5 ms, so that nothing is left out but what the mesh can't show.",
    );
    let mut data = Vec::new();
    let names = [
        (
            "figure2",
            "The paper's figure 2: an impulse of 1 N for 2 ms on the middle node of the top face.".to_owned(),
        ),
        (
            "figure3",
            format!(
                "The paper's figure 3: the same impulse by a rigid plane on all {} nodes of the top face.",
                on_top.len()
            ),
        ),
    ];
    for (wave, (file, what)) in waves.iter().zip(names) {
        html += &pictures(body, wave, &what);
        data.push(frames_csv(&format!("{file}.csv"), body, &surface, wave));
    }
    let pushes = pushes(&plane, held_s);
    html += &paragraph(&format!(
        "The plane is one displacement that all its nodes share, without friction; the node forces are unknown and follow from equation (9) \
         on the {} vertical degrees of freedom of the face together. {pushes}. At the end of the step the nodes lie in the plane to {flat} of \
         its displacement, {:.2} mm. (Equal forces on all nodes, by contrast, pull edges and corners into spikes: fewer elements carry them.)",
        on_top.len(),
        1e3 * plane.displacement_m,
    ));
    let arrived = arrival(cells, body, &outside, progress)?;
    html += &arrived.html;
    html += &code("palpate reproduce --only impulses");
    data.push(csv(
        "plane.csv",
        "node,x_m,z_m,force_n",
        on_top
            .iter()
            .zip(&plane.forces_n)
            .map(|(&node, force)| vec![f64::from(node), place(node).x, place(node).z, *force]),
    ));
    data.push(arrived.data);
    let section = Section {
        id: "impulses".into(),
        heading: "Impulse responses (the paper's figures 2 and 3)".into(),
        body: html,
    };
    let findings = vec![
        Finding::measured(
            Statement::Figure2,
            quantity("arrival of 0.5 %", arrived.half_percent_ms, "ms").at_least(0.9 * PAPER_ARRIVAL_MS).and(
                quantity("arrival of 0.5 %", arrived.half_percent_ms, "ms").at_most(1.1 * PAPER_ARRIVAL_MS),
            ),
            arrived.found,
        ),
        Finding::measured(
            Statement::Figure3,
            quantity("out of the plane", out_of_plane, "of its displacement")
                .at_most(1e-9)
                .and(quantity("least force on a node", least_n, "N").at_least(0.0)),
            format!(
                "rigid plane, equation (9) on {} degrees of freedom. {pushes}; at its end they lie in one plane to {flat}",
                on_top.len()
            ),
        ),
    ];
    Ok(Chapter { section, data, findings })
}

/// Time in which the paper's wave has reached all nodes, "approximately" [ms].
const PAPER_ARRIVAL_MS: f64 = 16.0;

/// Range of the plane's forces, as a sentence.
fn pushes(plane: &PlaneForces, held_s: f64) -> String {
    let (least, most) = plane.forces_n.iter().fold((f64::MAX, f64::MIN), |(l, m), f| (l.min(*f), m.max(*f)));
    let all = if least >= 0.0 { "It pushes every node" } else { "It would pull some nodes" };
    format!("{all}, by {:.1} to {:.1} mN for {:.0} ms", 1e3 * least, 1e3 * most, 1e3 * held_s)
}

/// Largest distance of the plane's nodes from it at the end of the step, as a share of its displacement.
fn flatness(wave: &Wave, surface: &[u32], is_top: &dyn Fn(&u32) -> bool, displacement_m: f64) -> f64 {
    let frame = surface.iter().zip(&wave.frames[HELD - 1]);
    let apart = frame.filter(|(node, _)| is_top(node)).map(|(_, u)| (u.y + displacement_m).abs());
    apart.fold(0.0, f64::max) / displacement_m
}

/// The deformed surface at some moments, exaggerated, coloured by displacement.
fn pictures(body: &RecordedBody, wave: &Wave, caption: &str) -> String {
    let (rest, triangles) = surface_mesh(body);
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
    gallery(
        &drawn,
        &key,
        &format!("{caption} Displacements are drawn {scale:.1} times as large; rigid motion is left out."),
    )
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
