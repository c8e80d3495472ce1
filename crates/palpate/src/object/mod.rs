//! One elastic body of a scene: its recording with all that contacts need of it, its inertia, and its state.

mod base;
mod state;

pub(crate) use state::ObjectState;

use crate::error::ModelError;
use crate::motion::{Inertia, RigidIntegrator, RigidState, RigidStep};
use crate::recording::{Recording, Support};
use crate::response::{Body, ContactLimits, Response, ResponseForm, ResponseState, ResponseView};
use crate::spatial::{Pose, Twist};
use crate::surface::Cell;
use alloc::format;
use alloc::sync::Arc;
use glam::{DMat3, DVec3};

/// Placement and velocity of an object at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectStart {
    /// Placement of the centre of mass.
    pub pose: Pose,
    /// Velocity; zero for an object with fixed nodes.
    pub twist: Twist,
}

/// Deformation of an object at the start.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum InitialDeformation {
    /// None.
    #[default]
    Undeformed,
    /// Static equilibrium with gravity; of a body with fixed nodes in modal form.
    Equilibrium,
}

/// Rules of a scene that an object is made for.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ObjectRules<'a> {
    /// Step h [s].
    pub(crate) step_s: f64,
    /// Gravity [m/s², world].
    pub(crate) gravity: DVec3,
    /// Contact patch radii of the devices [m].
    pub(crate) patch_radii: &'a [f64],
    /// Cells of the object's clamps.
    pub(crate) cells: &'a [Cell],
    /// Limits of the contacts of its surface; none where nothing meets it.
    pub(crate) contact_limits: Option<ContactLimits>,
}

/// One object of a scene; immutable.
#[derive(Debug, Clone)]
pub(crate) struct Object {
    /// Its body, which objects of one recording share.
    pub(crate) body: Arc<Body>,
    pub(crate) response: Response,
    /// Coulomb's coefficient against other objects [1].
    pub(crate) friction: f64,
    /// Mass and inertia; none for a body with fixed nodes.
    pub(crate) inertia: Option<Inertia>,
    pub(crate) start: ObjectStart,
    pub(crate) deformation: InitialDeformation,
    /// Radius of the sphere about the centre of mass that holds the body at rest [m]: the scale of the solver's tolerance.
    pub(crate) radius: f64,
}

impl Object {
    /// Object from its recording, with the patches and contact samples that the scene asks for; `others` are the earlier objects of the scene.
    pub(crate) fn new(
        recording: Arc<Recording>,
        form: ResponseForm,
        (start, deformation): (ObjectStart, InitialDeformation),
        friction: f64,
        rules: ObjectRules,
        others: &[Self],
    ) -> Result<Self, ModelError> {
        let fail = |name, what| Err(ModelError::Parameter { name, what });
        let ObjectStart { mut pose, twist } = start;
        let norm = pose.orientation.length();
        if !(0.99..=1.01).contains(&norm) {
            return fail(
                "pose",
                format!("orientation has length {norm}, expected a unit quaternion w, x, y, z"),
            );
        }
        if !(pose.position.is_finite() && twist.linear.is_finite() && twist.angular.is_finite()) {
            return fail("start", "position and velocities must be finite".into());
        }
        pose.orientation = pose.orientation.normalize();
        let inertia = match recording.metadata.support {
            Support::Free => Some(Inertia::new(recording.mass(), recording.inertia())),
            Support::Fixed if twist != Twist::ZERO => {
                return fail("twist", "has fixed nodes, so its velocities must be zero".into());
            }
            Support::Fixed => None,
        };
        let response = Response::new(&recording, form, rules.step_s)?;
        if inertia.is_none() && rules.gravity != DVec3::ZERO && !response.has_gravity_response() {
            let what = "has fixed nodes, and its impulse response does not tell how it sags under gravity";
            return Err(ModelError::ImpulseResponse { what: what.into() });
        }
        if deformation == InitialDeformation::Equilibrium {
            if inertia.is_some() {
                let what = "has no fixed nodes: without contact it has no static equilibrium to start from";
                return fail("deformation", what.into());
            }
            if matches!(response, Response::Fir(_)) {
                return fail(
                    "deformation",
                    "uses a table, which starts undeformed: use the modal form".into(),
                );
            }
        }
        if !(0.0..1e6).contains(&friction) {
            return fail("friction", format!("friction is {friction}, expected a number not below 0"));
        }
        let radius = recording.surface.radius();
        let mut radii = rules.patch_radii.to_vec();
        radii.retain(|radius| *radius > 0.0);
        radii.sort_unstable_by(f64::total_cmp);
        radii.dedup();
        let is_same = |other: &&Self| {
            let has_clamps = !rules.cells.is_empty() || other.body.cells() > 0;
            Arc::ptr_eq(&other.body.recording, &recording) && !has_clamps
        };
        let known = others.iter().find(is_same).map(|other| other.body.clone());
        let body = known
            .unwrap_or_else(|| Arc::new(Body::new(recording, &radii, rules.contact_limits, rules.cells)));
        Ok(Self {
            body,
            response,
            friction,
            inertia,
            start: ObjectStart { pose, twist },
            deformation,
            radius,
        })
    }

    /// Whether its response is in modal form.
    pub(crate) fn is_modal(&self) -> bool {
        matches!(self.response, Response::Modal(_))
    }

    /// Whether gravity may change: a table of a body with fixed nodes tells how it sags under a constant one.
    pub(crate) fn allows_gravity_change(&self) -> bool {
        self.inertia.is_some() || self.is_modal()
    }

    /// Whether its base may move: that of a body with fixed nodes, in modal form.
    pub(crate) fn has_movable_base(&self) -> bool {
        self.inertia.is_none() && self.is_modal()
    }

    /// Rigid motion over a step of h [s] under contact force [N], torque [N·m] and weight; a fixed body stays.
    /// `nearly` is a step under nearly the same forces, to start the iteration from.
    ///
    /// # Real time
    pub(crate) fn advance_rigid(
        &self,
        (integrator, step_s, gravity): (RigidIntegrator, f64, DVec3),
        start: &RigidState,
        (force, torque): (DVec3, DVec3),
        nearly: Option<&RigidStep>,
    ) -> RigidStep {
        match &self.inertia {
            Some(inertia) => {
                let force = force + gravity * inertia.mass;
                inertia.advance(integrator, start, step_s, (force, torque), nearly)
            }
            None => RigidStep { end: *start, turn: DVec3::ZERO, residual: 0.0 },
        }
    }

    /// Gravity in body axes [m/s²].
    pub(crate) fn gravity_in_body(&self, gravity: DVec3, pose: &Pose) -> DVec3 {
        DMat3::from_quat(pose.orientation).transpose() * gravity
    }

    /// Response with its state, under a gravity [m/s², world].
    pub(crate) fn view<'a>(
        &'a self,
        gravity: DVec3,
        rigid: &RigidState,
        state: &'a mut ResponseState,
    ) -> ResponseView<'a> {
        let gravity = self.gravity_in_body(gravity, &rigid.pose);
        ResponseView { response: &self.response, body: &self.body, state, gravity }
    }
}
