//! Displacement of one surface point, from the state alone: for probes, which change nothing.
//!
//! ```text
//! u = J·(Φ·q + S·g)  + sag        with a table        u = Σ_s J·R[s]·f[t−s]  + sag
//! ```
//!
//! Equations: docs/theory.md (C3), (C8).

use super::convolution::FirState;
use super::fir::Fir;
use super::modal::ModalState;
use super::{Body, ContactLocation, Footprint, Response, ResponseState};
use crate::dot_products::dot3;
use crate::recording::has_weight;
use crate::surface::SurfacePoint;
use glam::DVec3;

impl ResponseState {
    /// Elastic displacement of a surface point at the end of the last step [m, body], under a gravity [m/s², body].
    ///
    /// # Real time
    /// Costs modes and spring forces; with a table the forces of the last T steps.
    pub(crate) fn displacement_at(
        &self,
        (response, body): (&Response, &Body),
        point: &SurfacePoint,
        gravity: DVec3,
    ) -> DVec3 {
        match (response, self) {
            (Response::Modal(_), Self::Modal(state)) => modal_displacement(body, state, point, gravity),
            (Response::Fir(fir), Self::Fir(state)) => {
                convolved_displacement((fir, body), state, point, gravity)
            }
            _ => DVec3::ZERO,
        }
    }
}

fn modal_displacement(body: &Body, state: &ModalState, point: &SurfacePoint, gravity: DVec3) -> DVec3 {
    let recording = &*body.recording;
    let location = ContactLocation { point: *point, footprint: Footprint::Point };
    let mut displacement = body.sag(&location, gravity);
    for (node, weight) in recording.surface.corners(point).into_iter().filter(|(_, weight)| *weight != 0.0) {
        let m = recording.modes.len();
        let mut own = dot3(&recording.modes.mode_shapes[3 * m * node..3 * m * (node + 1)], &state.q);
        for &(other, force) in state.nodal.loaded() {
            own += recording.residual_by_model_node(node, other as usize) * force;
        }
        let patches =
            state.spring_forces.iter().filter(|spring| spring.location.footprint != Footprint::Point);
        for spring in patches {
            own += body.residual_of_node(node, &spring.location) * spring.force;
        }
        displacement += own * weight;
    }
    displacement
}

fn convolved_displacement(
    (fir, body): (&Fir, &Body),
    state: &FirState,
    point: &SurfacePoint,
    gravity: DVec3,
) -> DVec3 {
    let corners = body.recording.surface.corners(point).into_iter().filter(has_weight);
    corners.map(|(node, weight)| state.history.displacement(fir, (node, 0), gravity) * weight).sum()
}
