//! Static stiffness felt by a finger of given radius on the upper face of a block that is fixed at its lower face.
//!
//! A finger with patch radius a is the load k(|x − c|/a) over the surface, k(s) = (1 − s²)², and it feels the
//! displacement averaged with the same weight. So force over displacement is 1/(nᵀ·wᵀ·G·w·n), with G the static
//! compliance, whatever the mesh. The expected value is solved for on a finer mesh, with its own quadrature.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{DeviceInput, DeviceParameters, Input, Recording, State, step};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, RecordedBody};
use palpate_mesh::box_mesh;
use palpate_testkit::{ElasticMaterial, PAPER_MATERIAL, object_at, recorded, scene, smoothstep};
use std::sync::Arc;

const SIZE: [f64; 3] = [0.1, 0.05, 0.1];
const TIP: f64 = 0.005;
const DEPTH: f64 = 1e-3;

/// Patch radius [m]: four edges of the coarsest surface. The error of the finite elements under the kernel falls with the mesh:
/// they are 1 % too stiff at four edges of the surface, 2 % at three, 4 % at two, 8 % at one and a half.
const PATCH: f64 = 0.03;

/// The paper's material, damped so much that a press settles within a second.
const CALM: ElasticMaterial = ElasticMaterial { stiffness_damping_s: 0.02, ..PAPER_MATERIAL };

/// Points on the upper face [m]: its middle, and others within one cell of the coarsest mesh.
const PLACES: [[f64; 2]; 5] =
    [[0.0, 0.0], [0.003, 0.001], [0.0062, 0.0062], [0.0097, 0.0041], [0.0125, 0.002]];

fn place([x, z]: [f64; 2]) -> DVec3 {
    DVec3::new(x, 0.5 * SIZE[1], z)
}

fn standing(cells: u32, order: ElementOrder) -> Result<Arc<Recording>, VerifyError> {
    let mesh = box_mesh(SIZE, [cells, cells / 2, cells])?;
    Ok(CALM.fixed_body(mesh, order, 60, |node| node.y < -0.499 * SIZE[1])?)
}

/// Weights of the kernel about a point of the upper face, at the nodes of quadratic elements: each face's integral by
/// the middles of 256 parts. Four triangles stand for a face, at its corners and in the middle.
fn kernel(body: &RecordedBody, centre: DVec3) -> Vec<(usize, f64)> {
    const PARTS: u32 = 16;
    let mut weights = Vec::new();
    for face in body.surface_triangles().chunks_exact(4) {
        let (corners, middles) = ([face[0][0], face[1][1], face[2][2]], [face[0][1], face[1][2], face[2][0]]);
        let places = corners.map(|node| body.nodes()[node as usize]);
        if places.iter().any(|p| p.y < 0.499 * SIZE[1]) {
            continue;
        }
        let area = (places[1] - places[0]).cross(places[2] - places[0]).length();
        for i in 0..PARTS {
            for j in 0..2 * (PARTS - i) - 1 {
                // Upright and inverted parts of strip i.
                let third = f64::from(1 + j % 2) / 3.0;
                let u = (f64::from(i) + third) / f64::from(PARTS);
                let v = (f64::from(j / 2) + third) / f64::from(PARTS);
                let l = [1.0 - u - v, u, v];
                let x = places[0] * l[0] + places[1] * l[1] + places[2] * l[2];
                let s = (x - centre).length() / PATCH;
                if s < 1.0 {
                    let share = area * (1.0 - s * s).powi(2);
                    for k in 0..3 {
                        weights.push((corners[k] as usize, l[k] * (2.0 * l[k] - 1.0) * share));
                        weights.push((middles[k] as usize, 4.0 * l[k] * l[(k + 1) % 3] * share));
                    }
                }
            }
        }
    }
    let total: f64 = weights.iter().map(|(_, w)| w).sum();
    weights.iter_mut().for_each(|(_, w)| *w /= total);
    weights
}

/// Force per displacement [N/m] at each place, solved for on a mesh.
fn stiffness(cells: u32) -> Result<Vec<f64>, VerifyError> {
    let mesh = box_mesh(SIZE, [cells, cells / 2, cells])?;
    let fixed = (0..mesh.nodes.len()).filter(|&node| mesh.nodes[node].y < -0.499 * SIZE[1]);
    let fixed_nodes = fixed.map(|node| node as u32).collect();
    let parameters = RecordParameters {
        fixed_nodes,
        extent: RecordExtent::NoModes,
        ..CALM.parameters(ElementOrder::Quadratic, 1)
    };
    let body = recorded(mesh, &parameters)?;
    let kernels = PLACES.map(|at| kernel(&body, place(at)));
    let mut loads = vec![vec![0.0; body.dofs()]; PLACES.len()];
    for (column, weights) in kernels.iter().enumerate() {
        weights.iter().for_each(|&(node, w)| loads[column][3 * node + 1] += w);
    }
    let moved = body.unreduced().static_displacements(&loads);
    let average = |(column, weights): (usize, &Vec<(usize, f64)>)| {
        1.0 / weights.iter().map(|&(node, w)| w * moved[column][3 * node + 1]).sum::<f64>()
    };
    Ok(kernels.iter().enumerate().map(average).collect())
}

/// Force per displacement [N/m] of a finger that is pressed in and at rest.
fn pressed(
    body: &Arc<Recording>,
    at_place: [f64; 2],
    invariants: &mut RunInvariants,
) -> Result<f64, VerifyError> {
    let finger = DeviceParameters { tip_radius: TIP, patch_radius: PATCH, ..DeviceParameters::default() };
    // The body frame's origin is the centre of mass, here the centre of the block.
    let objects = vec![object_at(body, DVec3::ZERO, DVec3::ZERO)];
    let model = scene(1e-3, DVec3::ZERO, Vec::new(), vec![finger], objects)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let mut force = 0.0;
    for number in 1..=1200 {
        // From a tenth of a millimetre above.
        let down = (DEPTH + 1e-4) * smoothstep(f64::from(number) / 200.0) - 1e-4;
        let hand = place(at_place) + DVec3::Y * (TIP - down);
        let input = Input { devices: vec![DeviceInput::touching(hand)], ..Input::default() };
        let output = step(&model, &mut state, &input);
        invariants.observe(output);
        force = output.devices[0].force_on_hand.y;
    }
    Ok(force / DEPTH)
}

/// Tolerance between the two finest meshes, of which the finest is the reference.
const REFERENCE: f64 = 2e-3;

/// Tolerance of the stiffness: the mesh error at four edges per patch radius, 1 %, with as much again for the steps.
const STIFFNESS: f64 = 0.02;

/// A twentieth is less than a hand can tell apart, 7 % of a force (Jones 1989, Perception 18, 681).
const UNFELT: f64 = 0.05;

/// Three meshes against a finer one, at five points within a cell.
pub fn press() -> Result<Vec<Check>, VerifyError> {
    let exact = stiffness(20)?;
    let coarser = stiffness(16)?;
    let mut checks =
        vec![Check::new("expected stiffness, 16 cells against 20 [N/m]", coarser[0], exact[0], REFERENCE)];
    for cells in [8, 10, 12] {
        let body = standing(cells, ElementOrder::Quadratic)?;
        let mut invariants = RunInvariants::default();
        let mut ratios = Vec::new();
        for (number, at_place) in PLACES.into_iter().enumerate() {
            let felt = pressed(&body, at_place, &mut invariants)?;
            ratios.push(felt / exact[number]);
            if number == 0 {
                let quantity = format!("force per displacement, {cells} cells [N/m]");
                checks.push(Check::new(quantity, felt, exact[0], STIFFNESS));
            }
        }
        let worst = ratios.iter().map(|ratio| (ratio - 1.0).abs()).fold(0.0, f64::max);
        let quantity =
            format!("the same at {} places within a cell, {cells} cells, worst error", PLACES.len());
        checks.push(Check::new(quantity, worst, 0.0, UNFELT));
        let texture =
            ratios.iter().fold(0.0, |a: f64, r| a.max(*r)) - ratios.iter().fold(9.0, |a: f64, r| a.min(*r));
        checks.push(Check::new(format!("texture: from place to place, {cells} cells"), texture, 0.0, UNFELT));
        checks.extend(invariants.checks(&format!("{cells} cells")));
    }
    Ok(checks)
}
