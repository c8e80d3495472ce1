//! The modal form of a body's response: u = Φ·q + S·f.
//!
//! Each modal coordinate q [m·√kg] is an oscillator under a held force (see `oscillator`); the residual compliance S
//! stands for everything that the kept modes miss, as a massless spring within the step.

use super::oscillator::{HeldOscillator, Oscillation};
use crate::recording::{ModalBasis, Recording};
use crate::surface::SurfacePoint;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// States below this size [√J] are set to zero: denormal numbers cost 40 times as much.
const FLUSH_BELOW: f64 = 1e-150;

/// All modes of one object at one step size.
#[derive(Debug, Clone)]
pub(crate) struct SampledModes {
    oscillators: Vec<HeldOscillator>,
}

/// State of one object in modal form.
#[derive(Debug, Clone)]
pub(crate) struct ModalState {
    pub(crate) modes: Vec<Oscillation>,
    /// Points that forces [N, body] acted on in the last step, for the residual compliance.
    acting: Vec<(SurfacePoint, DVec3)>,
    /// Energy [J] of the residual compliance, ½·fᵀ·S·f.
    residual_energy: f64,
}

/// What the devices' points see of the modes of the objects that they hold; buffers of the whole scene.
#[derive(Debug, Clone)]
pub(crate) struct ModalPoints {
    /// Three rows J·Φ per device, `stride` numbers apart.
    rows: Vec<f64>,
    stride: usize,
    /// J·S·Jᵀ between devices that hold the same object, devices × devices [m/N].
    residual: Vec<DMat3>,
    /// The residual compliance's part of each point's displacement [m, body].
    displacement: Vec<DVec3>,
    /// The part of it that the body's weight causes; it lasts as long as the grasp, since only bodies that stay
    /// where they are have one.
    sag: Vec<DVec3>,
    free_modes: Vec<f64>,
    forces: Vec<f64>,
}

/// A force [N, body] on a device's point, and how far the point went over the step [m, body].
#[derive(Debug, Clone, Copy)]
pub(crate) struct Acting<'a> {
    pub(crate) device: usize,
    pub(crate) point: &'a SurfacePoint,
    pub(crate) force: DVec3,
    pub(crate) travel: DVec3,
}

impl ModalState {
    pub(crate) fn new(modes: usize, devices: usize) -> Self {
        Self {
            modes: vec![Oscillation::default(); modes],
            acting: Vec::with_capacity(devices),
            residual_energy: 0.0,
        }
    }

    /// Displacement of a surface point by the residual compliance under the forces of the last step [m, body].
    fn residual_displacement(&self, recording: &Recording, corners: [(usize, f64); 3]) -> DVec3 {
        let blocks = |(point, force): &(SurfacePoint, DVec3)| {
            residual_between(recording, corners, recording.surface.corners(point)) * *force
        };
        self.acting.iter().map(blocks).sum()
    }
}

impl ModalPoints {
    pub(crate) fn new(devices: usize, most_modes: usize) -> Self {
        Self {
            rows: vec![0.0; devices * 3 * most_modes],
            stride: 3 * most_modes,
            residual: vec![DMat3::ZERO; devices * devices],
            displacement: vec![DVec3::ZERO; devices],
            sag: vec![DVec3::ZERO; devices],
            free_modes: vec![0.0; most_modes],
            forces: vec![0.0; most_modes],
        }
    }

    /// J·Φ of a device's point: three rows of m numbers.
    fn rows(&self, device: usize, modes: usize) -> &[f64] {
        &self.rows[device * self.stride..][..3 * modes]
    }
}

impl SampledModes {
    pub(crate) fn new(modes: &ModalBasis, step_s: f64) -> Self {
        let pairs = modes.angular_frequencies.iter().zip(&modes.damping_ratios);
        Self { oscillators: pairs.map(|(&omega, &zeta)| HeldOscillator::new(omega, zeta, step_s)).collect() }
    }

    /// Number of modes.
    pub(crate) fn len(&self) -> usize {
        self.oscillators.len()
    }

    /// Let a device hold a point; gives where the point is now [m, body].
    ///
    /// # Real time
    pub(crate) fn hold(
        &self,
        recording: &Recording,
        state: &ModalState,
        points: &mut ModalPoints,
        device: usize,
        point: &SurfacePoint,
        gravity: DVec3,
    ) -> DVec3 {
        let m = self.len();
        let corners = recording.surface.corners(point);
        // J·Φ: the weighted rows of the triangle's corners.
        let rows = &mut points.rows[device * points.stride..][..3 * m];
        rows.fill(0.0);
        for (node, weight) in corners {
            for axis in 0..3 {
                let shape = recording.modes.row(node, axis);
                for (row, phi) in rows[axis * m..(axis + 1) * m].iter_mut().zip(shape) {
                    *row += weight * phi;
                }
            }
        }
        let sag = recording.gravity.as_ref().map_or(DVec3::ZERO, |response| {
            corners.iter().map(|&(node, w)| response.residual_displacement(node, gravity) * w).sum()
        });
        points.sag[device] = sag;
        points.displacement[device] = sag + state.residual_displacement(recording, corners);
        project_rows(points.rows(device, m), state.modes.iter().map(|mode| mode.q))
            + points.displacement[device]
    }

    /// J_a·(Φ·B·Φᵀ + S)·J_bᵀ [m/N] between the points of two devices, and keep its second part.
    ///
    /// # Real time
    pub(crate) fn compliance(
        &self,
        recording: &Recording,
        points: &mut ModalPoints,
        a: (usize, &SurfacePoint),
        b: (usize, &SurfacePoint),
    ) -> DMat3 {
        let corners = |point| recording.surface.corners(point);
        let s = residual_between(recording, corners(a.1), corners(b.1));
        points.residual[a.0 * points.sag.len() + b.0] = s;
        let m = self.len();
        let (rows_a, rows_b) = (points.rows(a.0, m), points.rows(b.0, m));
        let mut sum = [[0.0; 3]; 3];
        for (i, oscillator) in self.oscillators.iter().enumerate() {
            for (column, b) in sum.iter_mut().enumerate() {
                let weighted = oscillator.b * rows_b[column * m + i];
                for (row, value) in b.iter_mut().enumerate() {
                    *value += rows_a[row * m + i] * weighted;
                }
            }
        }
        DMat3::from_cols_array_2d(&sum) + s
    }

    /// Modal coordinates at the end of the step if no device's force acts.
    ///
    /// # Real time
    pub(crate) fn predict(
        &self,
        recording: &Recording,
        state: &ModalState,
        points: &mut ModalPoints,
        gravity: DVec3,
        any_held: bool,
    ) {
        let m = self.len();
        let forces = &mut points.forces[..m];
        forces.fill(0.0);
        if let Some(response) = &recording.gravity {
            for (axis, a) in gravity.to_array().into_iter().enumerate() {
                for (force, load) in forces.iter_mut().zip(&response.modal_forces[axis * m..]) {
                    *force += a * load;
                }
            }
        }
        if any_held {
            let free = &mut points.free_modes[..m];
            for (((oscillator, &mode), &p), q) in
                self.oscillators.iter().zip(&state.modes).zip(&*forces).zip(free)
            {
                *q = oscillator.advance(mode, p).q;
            }
        }
    }

    /// Displacement of a device's point at the end of the step if no device's force acts [m, body].
    ///
    /// # Real time
    pub(crate) fn free(&self, points: &ModalPoints, device: usize) -> DVec3 {
        let m = self.len();
        project_rows(points.rows(device, m), points.free_modes[..m].iter().copied()) + points.sag[device]
    }

    /// Hold forces over the step that was predicted; gives the energy [J] that is lost in it.
    ///
    /// # Real time
    pub(crate) fn advance<'a>(
        &self,
        state: &mut ModalState,
        points: &mut ModalPoints,
        acting: impl Iterator<Item = Acting<'a>> + Clone,
    ) -> f64 {
        let m = self.len();
        // p = Φᵀ·Jᵀ·g.
        for Acting { device, force, .. } in acting.clone() {
            let rows = &points.rows[device * points.stride..][..3 * m];
            for (axis, g) in force.to_array().into_iter().enumerate() {
                for (p, row) in points.forces[..m].iter_mut().zip(&rows[axis * m..(axis + 1) * m]) {
                    *p += g * row;
                }
            }
        }
        let mut dissipated = 0.0;
        for ((oscillator, mode), &p) in self.oscillators.iter().zip(&mut state.modes).zip(&points.forces) {
            dissipated += oscillator.dissipation(*mode, p);
            let next = oscillator.advance(*mode, p);
            let quiet = libm::fabs(next.q) + libm::fabs(next.v) < FLUSH_BELOW;
            *mode = if quiet { Oscillation::default() } else { next };
        }

        // The residual spring: work g·Δ(S·g), stored ½·gᵀ·S·g, the rest is lost.
        let (mut work, mut energy) = (0.0, 0.0);
        let devices = points.sag.len();
        state.acting.clear();
        for Acting { device, force, point, .. } in acting.clone() {
            let pushed: DVec3 = acting
                .clone()
                .map(|other| points.residual[device * devices + other.device] * other.force)
                .sum();
            let displacement = pushed + points.sag[device];
            work += force.dot(displacement - points.displacement[device]);
            energy += 0.5 * force.dot(pushed);
            points.displacement[device] = displacement;
            state.acting.push((*point, force));
        }
        dissipated += work - (energy - state.residual_energy);
        state.residual_energy = energy;
        dissipated
    }

    /// Kinetic, elastic and residual energy [J].
    ///
    /// # Real time
    pub(crate) fn energy(&self, state: &ModalState) -> [f64; 3] {
        let mut sum = [0.0, 0.0, state.residual_energy];
        for (oscillator, &mode) in self.oscillators.iter().zip(&state.modes) {
            let (kinetic, elastic) = oscillator.energy(mode);
            sum[0] += kinetic;
            sum[1] += elastic;
        }
        sum
    }

    /// Displacement of every surface node [m, body], u = Φ·q + S·f.
    pub(crate) fn surface_displacement(
        &self,
        recording: &Recording,
        state: &ModalState,
        gravity: DVec3,
        out: &mut [DVec3],
    ) {
        for (node, u) in out.iter_mut().enumerate() {
            let part = |axis: usize| -> f64 {
                recording.modes.row(node, axis).iter().zip(&state.modes).map(|(phi, mode)| phi * mode.q).sum()
            };
            *u = DVec3::new(part(0), part(1), part(2));
            if let Some(response) = &recording.gravity {
                *u += response.residual_displacement(node, gravity);
            }
            for (point, force) in &state.acting {
                for (corner, weight) in recording.surface.corners(point) {
                    *u += recording.residual.block(node, corner) * *force * weight;
                }
            }
        }
    }
}

/// Rows·q for three rows, one per axis.
///
/// # Real time
fn project_rows(rows: &[f64], q: impl Iterator<Item = f64> + Clone) -> DVec3 {
    let modes = rows.len() / 3;
    let axis =
        |a: usize| rows[a * modes..(a + 1) * modes].iter().zip(q.clone()).map(|(r, q)| r * q).sum::<f64>();
    DVec3::new(axis(0), axis(1), axis(2))
}

/// J_a·S·J_bᵀ [m/N].
fn residual_between(recording: &Recording, a: [(usize, f64); 3], b: [(usize, f64); 3]) -> DMat3 {
    let mut sum = DMat3::ZERO;
    for (i, wi) in a {
        for (j, wj) in b {
            if wi != 0.0 && wj != 0.0 {
                sum += recording.residual.block(i, j) * (wi * wj);
            }
        }
    }
    sum
}
