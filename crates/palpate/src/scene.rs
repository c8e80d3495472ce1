//! The model: what does not change while a scene runs.

use crate::contact::{Grasp, MOST_FACES};
use crate::error::Error;
use crate::motion::{Inertia, RigidIntegrator, RigidState, RigidStep};
use crate::obstacle::Obstacle;
use crate::recording::{Recording, Support};
use crate::response::{Body, Response, ResponseForm};
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

/// A spring and damper between a device and its proxy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// k [N/m], positive.
    pub stiffness: f64,
    /// d [N·s/m], not negative.
    pub damping: f64,
}

/// What a device is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceParameters {
    /// Radius of the tip that touches [m]; 0 for a point.
    pub tip_radius: f64,
    /// Radius of the patch that a touch is spread over [m]; 0 for a point. From about four edges of the mesh on
    /// the feel does not show the mesh.
    pub patch_radius: f64,
    /// Coulomb's coefficient of a touch [1]; 0 for a wet finger on ice.
    pub friction: f64,
    /// Between the device and its proxy; none holds the proxy to the device.
    pub coupling: Option<Coupling>,
}

impl Default for DeviceParameters {
    /// A point without friction, held to its device: nothing that was not asked for.
    fn default() -> Self {
        Self { tip_radius: 0.0, patch_radius: 0.0, friction: 0.0, coupling: None }
    }
}

/// What holds for a whole scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelParameters {
    /// Step h [s], above 0 and at most 1.
    pub step_s: f64,
    /// Gravity [m/s², world].
    pub gravity: DVec3,
    /// How rigid motion is advanced.
    pub motion: RigidIntegrator,
    /// Whether rigid motion counts within the step.
    pub rigid_compliance: RigidCompliance,
    /// The devices.
    pub devices: Vec<DeviceParameters>,
    /// Planes and rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Most contact points of one object, 9·n² numbers of memory. Beyond it contacts are left out, and the status says so.
    pub max_contact_points: usize,
    /// Most places at which an object meets an obstacle or another object. Where more of its surface nodes come near, fewer stand for all, each
    /// for the patch around it.
    pub max_contact_samples: usize,
}

impl Default for ModelParameters {
    /// 1 kHz, the rate of common haptic devices; no gravity; no device; room for the face of a cube of 20³ cells.
    fn default() -> Self {
        Self {
            step_s: 1e-3,
            gravity: DVec3::ZERO,
            motion: RigidIntegrator::default(),
            rigid_compliance: RigidCompliance::default(),
            devices: Vec::new(),
            obstacles: Vec::new(),
            max_contact_points: 512,
            max_contact_samples: usize::MAX,
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
    /// Coulomb's coefficient against other objects [1]; between two, the geometric mean of theirs.
    pub friction: f64,
}

/// A face stands on so many places at least.
const LEAST_PLACES: usize = 8;

/// Friction between objects when nothing is said: rubber on wood.
const FRICTION: f64 = 0.5;

impl ModelObject {
    /// An object with the modal form of its response.
    pub fn new(recording: Arc<Recording>, start: ObjectStart) -> Self {
        Self { recording, response: ResponseForm::Modal, start, friction: FRICTION }
    }
}

/// One object of a scene.
#[derive(Debug, Clone)]
pub(crate) struct SceneObject {
    pub(crate) body: Body,
    pub(crate) response: Response,
    pub(crate) friction: f64,
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
        if parameters.max_contact_samples < LEAST_PLACES {
            let given = parameters.max_contact_samples;
            return Err(Error::Model(format!(
                "max_contact_samples is {given}, expected {LEAST_PLACES} or more"
            )));
        }
        for (at, device) in parameters.devices.iter().enumerate() {
            device.check(at)?;
        }
        for (at, obstacle) in parameters.obstacles.iter().enumerate() {
            obstacle.check(at)?;
        }
        let count = objects.len();
        let objects = objects.into_iter().enumerate();
        let objects: Result<Vec<SceneObject>, _> =
            objects.map(|(at, object)| SceneObject::new(at, object, &parameters, count)).collect();
        let mut objects = objects?;
        if parameters.touches_surfaces(objects.len()) {
            for at in 0..objects.len() {
                let (before, own) = objects.split_at_mut(at);
                let known = before.iter().map(|object| (&object.body, &object.response));
                own[0].response.know_nodes(&own[0].body, known);
            }
        }
        Ok(Self { parameters, objects })
    }

    /// What holds for the whole scene.
    pub fn parameters(&self) -> &ModelParameters {
        &self.parameters
    }

    /// The recordings, in the order of the objects.
    pub fn recordings(&self) -> impl Iterator<Item = &Recording> {
        self.objects.iter().map(|object| &*object.body.recording)
    }

    /// How many things an object can lie on: obstacles, and objects.
    pub(crate) fn others(&self) -> usize {
        self.parameters.obstacles.len() + self.objects.len()
    }

    /// Whether a grasp names an object, a triangle and weights that exist.
    pub(crate) fn accepts(&self, grasp: &Grasp) -> bool {
        self.objects.get(grasp.object).is_some_and(|object| {
            object.body.recording.surface.holds(&grasp.point) && object.response.accepts(&grasp.point)
        })
    }
}

impl ModelParameters {
    /// Whether few places may stand for many nodes, of so many objects.
    pub(crate) fn thins_faces(&self, objects: usize) -> bool {
        self.max_contact_samples < usize::MAX && self.touches_surfaces(objects)
    }

    /// Whether objects, so many, have something to lie on: obstacles, or one another.
    fn touches_surfaces(&self, objects: usize) -> bool {
        !self.obstacles.is_empty() || objects > 1
    }
}

impl DeviceParameters {
    /// Refuse numbers out of range.
    fn check(&self, at: usize) -> Result<(), Error> {
        let fail = |what| Err(Error::Model(format!("device {at}: {what}")));
        for (name, value) in [("tip_radius", self.tip_radius), ("patch_radius", self.patch_radius)] {
            if !(0.0..1e6).contains(&value) {
                return fail(format!("{name} is {value} m, expected a number not below 0"));
            }
        }
        if !(0.0..1e6).contains(&self.friction) {
            return fail(format!("friction is {}, expected a number not below 0", self.friction));
        }
        match self.coupling {
            Some(Coupling { stiffness, .. }) if !(stiffness > 0.0 && stiffness < 1e18) => {
                fail(format!("coupling stiffness is {stiffness} N/m, expected a positive number"))
            }
            Some(Coupling { damping, .. }) if !(0.0..1e18).contains(&damping) => {
                fail(format!("coupling damping is {damping} N·s/m, expected a number not below 0"))
            }
            _ => Ok(()),
        }
    }
}

impl SceneObject {
    fn new(
        at: usize,
        object: ModelObject,
        parameters: &ModelParameters,
        objects: usize,
    ) -> Result<Self, Error> {
        let ModelObject { recording, response, start, friction } = object;
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
        if !(0.0..1e6).contains(&friction) {
            return fail(format!("friction is {friction}, expected a number not below 0"));
        }
        let radius = recording.surface.radius();
        let mut radii: Vec<f64> = parameters.devices.iter().map(|device| device.patch_radius).collect();
        radii.retain(|radius| *radius > 0.0);
        radii.sort_unstable_by(f64::total_cmp);
        radii.dedup();
        let thins = parameters.thins_faces(objects) && matches!(response, Response::Modal(_));
        let body =
            Body::new(recording, &radii, if thins { parameters.max_contact_samples } else { usize::MAX });
        Ok(Self { body, response, friction, inertia, start: ObjectStart { pose, twist }, radius })
    }

    /// Room for contact points: every device's faces and its held point, and where there is something to lie on as
    /// many as there are surface nodes, within the allowed.
    pub(crate) fn capacity(&self, parameters: &ModelParameters, objects: usize) -> usize {
        let devices = parameters.devices.len();
        if !self.is_searched() {
            return devices;
        }
        let surface = if parameters.touches_surfaces(objects) {
            self.body.recording.surface.positions.len().min(parameters.max_contact_points)
        } else {
            0
        };
        (1 + MOST_FACES) * devices + surface
    }

    /// Whether contacts can be looked for on it: a table tells only of points that are known beforehand.
    pub(crate) fn is_searched(&self) -> bool {
        matches!(self.response, Response::Modal(_))
    }

    /// Rigid motion over a step under contact force [N] and torque [N·m], with weight; a fixed body stays.
    ///
    /// # Real time
    pub(crate) fn advance_rigid(
        &self,
        parameters: &ModelParameters,
        start: &RigidState,
        (force, torque): (DVec3, DVec3),
        nearly: Option<&RigidStep>,
    ) -> RigidStep {
        match &self.inertia {
            Some(inertia) => {
                let force = force + parameters.gravity * inertia.mass;
                inertia.advance(parameters.motion, start, parameters.step_s, (force, torque), nearly)
            }
            None => RigidStep { end: *start, turn: DVec3::ZERO, miss: 0.0 },
        }
    }

    /// Gravity [m/s²] in body axes.
    pub(crate) fn gravity_in_body(&self, gravity: DVec3, pose: &Pose) -> DVec3 {
        DMat3::from_quat(pose.orientation).transpose() * gravity
    }
}
