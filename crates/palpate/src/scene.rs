//! The model: what does not change while a scene runs.

use crate::contact::Grasp;
use crate::error::Error;
use crate::motion::{Inertia, MotionRule};
use crate::recording::{Recording, Support};
use crate::response::{Response, ResponseForm};
use crate::spatial::{Pose, Twist};
use alloc::format;
use alloc::sync::Arc;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Whether the object's rigid motion within the step counts in the compliance that a hand feels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RigidCompliance {
    /// Equation (3) of the paper: held points are met exactly.
    #[default]
    Included,
    /// Equation (2) of the paper: dropped as small. Held points are missed by about h²·f/m.
    Dropped,
}

/// What holds for a whole scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelParameters {
    /// Step h [s], above 0 and at most 1.
    pub step_s: f64,
    /// Gravity [m/s², world].
    pub gravity: DVec3,
    /// How rigid motion is advanced.
    pub motion: MotionRule,
    /// Whether rigid motion counts within the step.
    pub rigid_compliance: RigidCompliance,
    /// Number of devices.
    pub devices: usize,
}

impl Default for ModelParameters {
    /// 1 kHz, the rate of common haptic devices; no gravity; no device.
    fn default() -> Self {
        Self {
            step_s: 1e-3,
            gravity: DVec3::ZERO,
            motion: MotionRule::default(),
            rigid_compliance: RigidCompliance::default(),
            devices: 0,
        }
    }
}

/// Where an object is at the start and how it moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectStart {
    /// Placement of the centre of mass.
    pub pose: Pose,
    /// Velocity; zero for an object with fixed nodes.
    pub twist: Twist,
}

/// An object to be put into a scene.
#[derive(Debug, Clone)]
pub struct ModelObject {
    /// The body.
    pub recording: Arc<Recording>,
    /// Which form of its response is used.
    pub response: ResponseForm,
    /// Where it is at the start.
    pub start: ObjectStart,
}

impl ModelObject {
    /// An object with the modal form of its response.
    pub fn new(recording: Arc<Recording>, start: ObjectStart) -> Self {
        Self { recording, response: ResponseForm::Modal, start }
    }
}

/// One object of a scene.
#[derive(Debug, Clone)]
pub(crate) struct SceneObject {
    pub(crate) recording: Arc<Recording>,
    pub(crate) response: Response,
    /// None for a body with fixed nodes.
    pub(crate) inertia: Option<Inertia>,
    pub(crate) start: ObjectStart,
    /// Size of the body [m], the scale of the solver's tolerance.
    pub(crate) radius: f64,
}

/// Objects and rules of a scene; immutable.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) parameters: ModelParameters,
    pub(crate) objects: Vec<SceneObject>,
}

impl Model {
    /// Put recordings into a scene.
    ///
    /// # Errors
    /// When a number is out of its range; the text names it.
    pub fn new(parameters: ModelParameters, objects: Vec<ModelObject>) -> Result<Self, Error> {
        let h = parameters.step_s;
        if !(h > 0.0 && h <= 1.0) {
            return Err(Error::Model(format!("step is {h} s, expected above 0 and at most 1")));
        }
        if !parameters.gravity.is_finite() {
            return Err(Error::Model(format!("gravity is {}, expected finite numbers", parameters.gravity)));
        }
        let objects = objects.into_iter().enumerate();
        let objects: Result<_, _> =
            objects.map(|(at, object)| SceneObject::new(at, object, &parameters)).collect();
        Ok(Self { parameters, objects: objects? })
    }

    /// What holds for the whole scene.
    pub fn parameters(&self) -> &ModelParameters {
        &self.parameters
    }

    /// The recordings, in the order of the objects.
    pub fn recordings(&self) -> impl Iterator<Item = &Recording> {
        self.objects.iter().map(|object| &*object.recording)
    }

    /// Whether a grasp names an object, a triangle and weights that exist.
    pub(crate) fn accepts(&self, grasp: &Grasp) -> bool {
        self.objects.get(grasp.object).is_some_and(|object| {
            let [a, b, c] = grasp.point.weights;
            (grasp.point.triangle as usize) < object.recording.surface.triangles.len()
                && libm::fabs(a + b + c - 1.0) < 1e-9
                && [a, b, c].iter().all(|w| (-1e-9..=1.0 + 1e-9).contains(w))
                && object.response.accepts(&grasp.point)
        })
    }
}

impl SceneObject {
    fn new(at: usize, object: ModelObject, parameters: &ModelParameters) -> Result<Self, Error> {
        let ModelObject { recording, response, start } = object;
        let ObjectStart { mut pose, twist } = start;
        let refusal = |what| Error::Model(format!("object {at}: {what}"));
        let fail = |what| Err(refusal(what));
        let norm = pose.orientation.length();
        if !(0.99..=1.01).contains(&norm) {
            return fail(format!("orientation has length {norm}, expected a unit quaternion w, x, y, z"));
        }
        if !(pose.position.is_finite() && twist.linear.is_finite() && twist.angular.is_finite()) {
            return fail("position and velocities must be finite".into());
        }
        pose.orientation = pose.orientation.normalize();
        let inertia = match recording.metadata.support {
            Support::Free => Some(Inertia::new(recording.mass(), recording.inertia())),
            Support::Fixed if twist != Twist::ZERO => {
                return fail("has fixed nodes, so its velocities must be zero".into());
            }
            Support::Fixed => None,
        };
        let response = Response::new(&recording, response, parameters.step_s)
            .map_err(|error| refusal(format!("{error}")))?;
        if inertia.is_none() && parameters.gravity != DVec3::ZERO && !response.knows_gravity() {
            return fail(
                "has fixed nodes, and its impulse response does not tell how it sags under gravity".into(),
            );
        }
        let radius = recording.surface.radius();
        Ok(Self { recording, response, inertia, start: ObjectStart { pose, twist }, radius })
    }

    /// Gravity [m/s²] in body axes.
    pub(crate) fn gravity_in_body(&self, gravity: DVec3, pose: &Pose) -> DVec3 {
        DMat3::from_quat(pose.orientation).transpose() * gravity
    }
}
