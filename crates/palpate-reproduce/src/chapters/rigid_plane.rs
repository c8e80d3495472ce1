//! Impulse by a rigid plane: equation (9) of the paper on all nodes of a face.
//!
//! ```text
//! R_cc[0]·f = d·1,    Σ f = F
//! ```
//!
//! with f [N] the node forces along the plane's normal, held for one step of the paper, d [m] the displacement at its end that all nodes
//! share with the plane, and R_cc[0] [m/N] the response of the free body: its elastic part by time integration, and the motion
//! ½h²·(1/m + nᵀ·(I⁻¹·(x_j × n)) × x_i), the term of equation (3) at the node itself.

use crate::cholesky::solved;
use crate::error::ReproduceError;
use glam::DVec3;
use palpate::Sampling;
use palpate_fem::RecordedBody;
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};

/// Forces of a plane on the nodes of a face.
#[derive(Debug, Clone)]
pub struct PlaneForces {
    /// Force along the direction of the push on each node [N].
    pub forces_n: Vec<f64>,
    /// Common displacement of the nodes along it at the end of the step, motion of the whole body included [m].
    pub displacement_m: f64,
}

/// Forces of a plane that pushes some nodes of a free body, ascending, along a direction with `total_n` in all, held for one step of
/// `step_s` [s].
///
/// # Errors
/// A table that can't be computed, or a compliance that is not positive definite.
pub fn plane_forces(
    body: &RecordedBody,
    nodes: &[u32],
    direction: DVec3,
    total_n: f64,
    step_s: f64,
    method: TableMethod,
) -> Result<PlaneForces, ReproduceError> {
    let compliance = compliance(body, nodes, direction, step_s, method)?;
    // With d = 1 m; then scaled to the force in all.
    let unit = solved(&compliance, &vec![1.0; nodes.len()]).ok_or_else(|| {
        let what = "the compliance of the nodes under a plane is not positive definite";
        ReproduceError::Measurement(what.into())
    })?;
    let displacement_m = total_n / unit.iter().sum::<f64>();
    Ok(PlaneForces { forces_n: unit.into_iter().map(|f| f * displacement_m).collect(), displacement_m })
}

/// R_cc[0] along a direction [m/N], row by row.
fn compliance(
    body: &RecordedBody,
    nodes: &[u32],
    direction: DVec3,
    step_s: f64,
    method: TableMethod,
) -> Result<Vec<f64>, ReproduceError> {
    let parameters = TableParameters {
        step_s,
        samples: 1,
        sampling: Sampling::End,
        method,
        touchable_nodes: nodes.to_vec(),
        observed_nodes: nodes.to_vec(),
    };
    let load = |node: &u32| {
        let mut load = vec![0.0; body.dofs()];
        load[3 * *node as usize..][..3].copy_from_slice(&direction.to_array());
        load
    };
    let loads: Vec<Vec<f64>> = nodes.iter().map(load).collect();
    let columns = TableRecorder::new(body, &parameters)?.responses(&loads);
    let (mass, turning) = (body.recording.mass(), body.recording.inertia().inverse());
    let places: Vec<DVec3> = nodes.iter().map(|&node| body.nodes()[node as usize]).collect();
    let n = nodes.len();
    Ok((0..n * n)
        .map(|at| {
            let (i, j) = (at / n, at % n);
            let elastic = DVec3::from_slice(&columns[j][3 * i..]).dot(direction);
            let turned = (turning * places[j].cross(direction)).cross(places[i]).dot(direction);
            elastic + 0.5 * step_s * step_s * (1.0 / mass + turned)
        })
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::cube;
    use palpate::{
        Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose, Shape, State, Twist, step,
    };
    use palpate_fem::SilentProgress;
    use std::sync::Arc;

    const STEP_S: f64 = 2e-3;

    /// Difference of the runtime's forces, whose contact solver stops at a tolerance, as a share of the largest.
    const SAME: f64 = 1e-6;

    #[test]
    fn forces_of_a_plane_are_those_of_the_runtimes_plane_and_push_each_node() {
        let body = cube(4, usize::MAX, &mut SilentProgress).expect("a cube");
        let is_top = |node: &u32| body.nodes()[*node as usize].y > 0.05 - 1e-9;
        let nodes: Vec<u32> = body.surface_nodes().into_iter().filter(is_top).collect();
        let plane =
            plane_forces(&body, &nodes, DVec3::NEG_Y, 1.0, STEP_S, TableMethod::ClosedForm).expect("forces");
        let forces = &plane.forces_n;
        assert!((forces.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        assert!(forces.iter().all(|force| *force > 0.0), "{forces:?}");

        // The same plane in the runtime: it lies on the face, and is lower by d a step later.
        let recording = Arc::new(body.recording.clone());
        let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
        let at = |y: f64| Pose { position: DVec3::Y * y, ..Pose::IDENTITY };
        let obstacle =
            Obstacle { shape: Shape::Plane { normal: DVec3::NEG_Y }, pose: at(0.05), friction: 0.0 };
        let parameters =
            ModelParameters { step_s: STEP_S, obstacles: vec![obstacle], ..ModelParameters::for_reference() };
        let model = Model::new(parameters, vec![ModelObject::new(recording, start)]).expect("a model");
        let mut state = State::new(&model);
        let input = Input { obstacles: vec![at(0.05 - plane.displacement_m)], ..Input::default() };
        let output = step(&model, &mut state, &input);
        let largest = forces.iter().copied().fold(0.0, f64::max);
        assert_eq!(output.contacts.len(), nodes.len());
        for contact in &output.contacts {
            let near = |node: &&u32| {
                let apart = body.nodes()[**node as usize] - contact.point;
                DVec3::new(apart.x, 0.0, apart.z).length() < 1e-3
            };
            let at = nodes.iter().position(|node| near(&node)).expect("a node of the face");
            let error = (contact.force.y + forces[at]).abs() / largest;
            assert!(error < SAME, "node {}: {} and {}", nodes[at], -contact.force.y, forces[at]);
        }
    }
}
