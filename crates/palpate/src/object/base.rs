//! Base of a body with fixed nodes that moves without rotation.
//!
//! The base follows given positions y [m, world] as a quadratic B-spline: at the end of a step it is midway between the last two, and its
//! acceleration a is constant over the step,
//!
//! ```text
//! x⁺ = ½·(y + y⁺)        v⁺ = (y⁺ − y)/h        a = (v⁺ − v)/h        so        x⁺ = x + ½h·(v + v⁺)
//! ```
//!
//! In its frame the body feels gravity g − a. With mass m, participation L = Φᵀ·M·1 and momentum P = Lᵀ·q̇ of the modes, the energy of the
//! body and the work of the base over a step are
//!
//! ```text
//! T = ½·q̇ᵀ·q̇ + v·P + ½·m·v²        W = Δ(v·P + ½·m·v²) − a·L·Δq − (m·g + Σf)·Δx
//! ```
//!
//! Equations: docs/theory.md (C64), (C65).

use super::{Object, ObjectState};
use glam::DVec3;

/// Motion of a base; all zero for one that stays.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Base {
    /// Last given position y, less where the base started [m, world].
    given: DVec3,
    /// Velocity at the start and at the end of the step [m/s, world].
    pub(crate) velocity: DVec3,
    pub(crate) end_velocity: DVec3,
    /// Acceleration over the step [m/s², world].
    acceleration: DVec3,
    /// Displacement over the step [m, world].
    displacement: DVec3,
    /// L·q [kg·m] and P [kg·m/s] at the start of the step [world].
    start_moment: DVec3,
    start_momentum: DVec3,
}

impl Base {
    /// Whether it moves in the step.
    pub(crate) fn moves(&self) -> bool {
        self.velocity != DVec3::ZERO || self.end_velocity != DVec3::ZERO
    }
}

impl ObjectState {
    /// Gravity that the body feels in the frame of its base [m/s², world].
    pub(crate) fn felt_gravity(&self, gravity: DVec3) -> DVec3 {
        gravity - self.base.acceleration
    }

    /// Whether a base would have to move to a position [m, world].
    pub(crate) fn base_is_elsewhere(&self, object: &Object, position: DVec3) -> bool {
        position - object.start.pose.position != self.base.given
    }

    /// Begin a step of h [s] in which the base goes on to a given position [m, world]; it stays at rest or stops without one.
    pub(crate) fn begin_base_motion(&mut self, object: &Object, given: Option<DVec3>, h: f64) {
        let start = object.start.pose.position;
        let given = given.map_or(self.base.given, |given| given - start);
        let end_velocity = (given - self.base.given) / h;
        let base = Base {
            given,
            velocity: self.base.end_velocity,
            end_velocity,
            acceleration: (end_velocity - self.base.end_velocity) / h,
            displacement: (self.base.end_velocity + end_velocity) * (0.5 * h),
            ..self.base
        };
        self.base = base;
        if base.moves() {
            (self.base.start_moment, self.base.start_momentum) = self.modal_moments(object);
        }
    }

    /// L·q [kg·m] and P = L·q̇ [kg·m/s], world axes.
    fn modal_moments(&self, object: &Object) -> (DVec3, DVec3) {
        let Some(response) = &object.body.recording.gravity else { return (DVec3::ZERO, DVec3::ZERO) };
        let modes = self.response.modes();
        let axis = |axis: usize| {
            let loads = response.modal_forces[axis * modes.len()..].iter().zip(modes);
            loads.fold((0.0, 0.0), |(moment, momentum), (l, mode)| {
                (moment + l * mode.q, momentum + l * mode.v)
            })
        };
        let [x, y, z] = [axis(0), axis(1), axis(2)];
        let orientation = self.rigid.pose.orientation;
        (orientation * DVec3::new(x.0, y.0, z.0), orientation * DVec3::new(x.1, y.1, z.1))
    }

    /// Move the end of the step without contact force along with the base.
    pub(crate) fn carry_with_base(&mut self) {
        if self.base.moves() {
            self.free.end.pose.position = self.rigid.pose.position + self.base.displacement;
            self.free.end.velocity = self.base.end_velocity;
        }
    }

    /// Kinetic energy by the motion of the base at the end of the step [J], v·P + ½·m·v².
    pub(crate) fn base_energy(&self, object: &Object) -> f64 {
        let velocity = self.base.end_velocity;
        if velocity == DVec3::ZERO {
            return 0.0;
        }
        let (_, momentum) = self.modal_moments(object);
        velocity.dot(momentum) + 0.5 * object.body.recording.mass() * velocity.length_squared()
    }

    /// Work of the base over a step that is integrated [J], under a gravity [m/s², world].
    pub(crate) fn base_work(&self, object: &Object, gravity: DVec3) -> f64 {
        let base = &self.base;
        if !base.moves() {
            return 0.0;
        }
        let mass = object.body.recording.mass();
        let before = base.velocity.dot(base.start_momentum) + 0.5 * mass * base.velocity.length_squared();
        let (moment, _) = self.modal_moments(object);
        let force: DVec3 = self.points.points.iter().map(|point| point.force).sum();
        self.base_energy(object)
            - before
            - base.acceleration.dot(moment - base.start_moment)
            - (gravity * mass + force).dot(base.displacement)
    }
}
