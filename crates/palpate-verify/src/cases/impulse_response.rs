//! The impulse response of the middle of the paper's top face, by time integration, against all 6585 modes.

use crate::check::Check;
use crate::error::{VerifyError, numerics};
use crate::reference::{IMPULSE_RESPONSE_1_MS, column};
use glam::DVec3;
use palpate::Sampling;
use palpate_fem::paper_cube::{self, CELLS};
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use palpate_fem::{RecordExtent, RecordParameters};
use palpate_testkit::recorded;

/// Nodes of the reference's columns: middle of the top and of the bottom, a top corner, the middle of a side.
const PLACES: [DVec3; 4] = [
    DVec3::new(0.0, 0.05, 0.0),
    DVec3::new(0.0, -0.05, 0.0),
    DVec3::new(0.05, 0.05, 0.05),
    DVec3::new(0.05, 0.0, 0.0),
];

/// Errors that were measured, with half a digit of room; the reference is the second route.
const MEASURED: [f64; 3] = [0.02, 5e-4, 5e-5];

/// Samples that are compared: after 40 ms the waves have crossed the cube several times.
const SAMPLES: usize = 40;

/// Errors with one, two and four integration steps per sample.
pub fn impulse_response() -> Result<Vec<Check>, VerifyError> {
    // Three columns a place, after the number of the sample.
    let reference: Vec<Vec<f64>> = (1..=12).map(|number| column(IMPULSE_RESPONSE_1_MS, number)).collect();
    let parameters = RecordParameters { extent: RecordExtent::NoModes, ..paper_cube::parameters(CELLS, 1) };
    let body = recorded(paper_cube::mesh(CELLS)?, &parameters)?;
    let observed = PLACES.map(|p| body.nearest_node(p) as u32);
    let mut order: Vec<usize> = (0..4).collect();
    order.sort_by_key(|&at| observed[at]);
    let mut load = vec![0.0; body.dofs()];
    load[3 * observed[0] as usize + 1] = 1.0;
    let peak =
        reference.iter().flat_map(|column| &column[..SAMPLES]).fold(0.0_f64, |peak, u| peak.max(u.abs()));
    let mut errors = Vec::new();
    for substeps in [1, 2, 4] {
        let parameters = TableParameters {
            step_s: 1e-3,
            samples: SAMPLES,
            sampling: Sampling::End,
            method: TableMethod::Transient { substeps },
            touchable_nodes: vec![observed[0]],
            observed_nodes: order.iter().map(|&at| observed[at]).collect(),
        };
        let recorder = TableRecorder::new(&body, &parameters).map_err(numerics)?;
        let response = recorder.responses(std::slice::from_ref(&load)).concat();
        let mut error = 0.0_f64;
        for (number, sample) in response.chunks_exact(12).enumerate() {
            for (at, &node) in order.iter().enumerate() {
                for axis in 0..3 {
                    error = error.max((sample[3 * at + axis] - reference[3 * node + axis][number]).abs());
                }
            }
        }
        errors.push(error / peak);
    }
    let check = |quantity, error, allowed| Check::new(quantity, error, 0.0, allowed);
    Ok(vec![
        check("largest error over 40 ms, one step per sample", errors[0], MEASURED[0]),
        check("the same, two steps per sample", errors[1], MEASURED[1]),
        check("the same, four steps per sample", errors[2], MEASURED[2])
            .with_order(errors[0], errors[1], 2.0, 5.0),
    ])
}
