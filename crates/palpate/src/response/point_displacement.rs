//! Displacement of one surface point, from the state alone: for probes, which change nothing.
//!
//! ```text
//! u = J·(Φ·q + S·g)  + sag        with a table        u = Σ_s J·R[s]·f[t−s]  + sag
//! ```
//!
//! Equations: docs/theory.md (C3), (C8).

use super::dot_products::dot3;
use super::fir::{Fir, FirState};
use super::modal::ModalState;
use super::{Body, ContactLocation, Footprint, Response, ResponseState};
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
            (Response::Fir(fir), Self::Fir(state)) => convolved_displacement(fir, state, point, gravity),
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
            own += recording.residual.block(node, other as usize) * force;
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

fn convolved_displacement(fir: &Fir, state: &FirState, point: &SurfacePoint, gravity: DVec3) -> DVec3 {
    let history = &state.history;
    let mut displacement = fir.sag_of_point(point, gravity, history.steps());
    let mut add = |age: usize, source: &SurfacePoint, force: DVec3| {
        let [a, b, c, d, e, f, g, h, i] = fir.block(age, point, source);
        displacement +=
            DVec3::new(a, d, g) * force.x + DVec3::new(b, e, h) * force.y + DVec3::new(c, f, i) * force.z;
    };
    for source in 0..history.sources() {
        let Some((forces, ages)) = history.window(source) else { continue };
        ages.for_each(|age| add(age, &history.point(source), forces[age]));
    }
    history.strays().for_each(|(age, stray)| add(age, &stray.point, stray.force));
    displacement
}
