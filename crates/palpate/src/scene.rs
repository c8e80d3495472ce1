//! The model: parameters, objects, devices and obstacles of a scene; immutable while it runs.

use crate::clamp::{Clamp, ClampState, PlacedClamp};
use crate::collision::{Grasp, MAX_TIP_CONTACTS};
use crate::device::DeviceParameters;
use crate::error::{Error, ModelError};
use crate::io::DeviceMode;
use crate::motion::RigidIntegrator;
use crate::object::{InitialDeformation, Object, ObjectRules, ObjectStart};
use crate::obstacle::Obstacle;
use crate::recording::{ImpulseResponse, Recording};
use crate::response::{ContactLimits, ResponseForm};
use crate::surface::{Cell, MIN_CONTACT_SAMPLES};
use alloc::boxed::Box;
use alloc::format;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Rigid motion within the step as part of the contact compliance.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum RigidCompliance {
    /// Equation (3) of the paper: held points follow exactly.
    #[default]
    Included,
    /// Equation (2) of the paper: neglected. Held points are off by about h²·f/m.
    Dropped,
}

/// Parameters of a scene.
#[derive(Debug, Clone, PartialEq)]
pub struct ModelParameters {
    /// Step h [s], above 0 and at most 1.
    pub step_s: f64,
    /// Gravity [m/s², world], until an input changes it.
    pub gravity: DVec3,
    /// Time integrator of the rigid motion.
    pub motion: RigidIntegrator,
    /// Rigid motion within the step.
    pub rigid_compliance: RigidCompliance,
    /// Devices.
    pub devices: Vec<DeviceParameters>,
    /// Planes and rigid obstacles.
    pub obstacles: Vec<Obstacle>,
    /// Clamps: parts of surfaces that are held and moved by rigid frames.
    pub clamps: Vec<Clamp>,
    /// Upper limit of contact points of one object against planes, obstacles and other objects; memory of 9·n² numbers. Where nodes or samples
    /// are more, coarser samples replace them; contacts that find no room all the same are dropped, and counted in the status.
    pub max_contact_points: usize,
    /// Upper limit of contact samples of an object against one obstacle or object. Where more surface nodes come near,
    /// Poisson-disk samples replace them, each with the patch around it.
    pub max_contact_samples: usize,
    /// Budget of the contact solver in a step, in products of a 3×3 block and a force, each some nanoseconds: it leaves an island early when
    /// its share is used up (see [`StepStatus::islands_out_of_budget`](crate::StepStatus::islands_out_of_budget)).
    pub solver_budget: u64,
    /// Time for which objects have to be still before they fall asleep [s]; infinite for never. A sleeping object costs no more than its
    /// memory, until a device, a moving obstacle or another object comes near (see [`ObjectOutput::is_asleep`](crate::ObjectOutput::is_asleep)).
    pub sleep_after_s: f64,
}

impl Default for ModelParameters {
    /// 1 kHz, the rate of common haptic devices; no gravity; no device; room for one face of a cube of 20³ cells; up to 128 contact
    /// samples, which are all nodes of most contacts; sleep after half a second.
    fn default() -> Self {
        Self {
            step_s: 1e-3,
            gravity: DVec3::ZERO,
            motion: RigidIntegrator::default(),
            rigid_compliance: RigidCompliance::default(),
            devices: Vec::new(),
            obstacles: Vec::new(),
            clamps: Vec::new(),
            max_contact_points: 512,
            max_contact_samples: CONTACT_SAMPLES,
            solver_budget: u64::MAX,
            sleep_after_s: SLEEP_AFTER_S,
        }
    }
}

impl ModelParameters {
    /// Parameters for steps in real time: as by default, but 48 contact samples, and a budget of the solver.
    pub fn for_real_time() -> Self {
        Self {
            max_contact_samples: REALTIME_CONTACT_SAMPLES,
            solver_budget: REALTIME_SOLVER_BUDGET,
            ..Self::default()
        }
    }

    /// Parameters for a reference to compare with: every surface node is a contact, and no object sleeps. A step costs up to a thousand times
    /// as much.
    pub fn for_reference() -> Self {
        Self { max_contact_samples: usize::MAX, sleep_after_s: f64::INFINITY, ..Self::default() }
    }
}

/// Contact samples by default, and in real time.
const CONTACT_SAMPLES: usize = 128;
const REALTIME_CONTACT_SAMPLES: usize = 48;

/// Budget of the solver in real time: about 0.3 ms on a core of 2024.
const REALTIME_SOLVER_BUDGET: u64 = 100_000;

/// Time for which objects are still before they fall asleep by default [s]: that of Box2D; some periods of a soft body.
const SLEEP_AFTER_S: f64 = 0.5;

/// Object to be put into a scene.
#[derive(Debug, Clone)]
pub struct ModelObject {
    /// Recording of the body.
    pub recording: Arc<Recording>,
    /// Form of its response.
    pub response: ResponseForm,
    /// Placement and velocity at the start.
    pub start: ObjectStart,
    /// Deformation at the start.
    pub deformation: InitialDeformation,
    /// Coulomb's coefficient of friction against other objects [1]; of a pair, the geometric mean.
    pub friction: f64,
}

/// Default coefficient of friction between objects [1]: rubber on wood.
const FRICTION: f64 = 0.5;

impl ModelObject {
    /// Undeformed object with the modal form of its response and the default friction.
    pub fn new(recording: Arc<Recording>, start: ObjectStart) -> Self {
        Self {
            recording,
            response: ResponseForm::Modal,
            start,
            deformation: InitialDeformation::default(),
            friction: FRICTION,
        }
    }
}

/// Objects and rules of a scene; immutable.
#[derive(Debug, Clone)]
pub struct Model {
    pub(crate) parameters: ModelParameters,
    pub(crate) objects: Vec<Object>,
    pub(crate) clamps: Vec<PlacedClamp>,
}

impl Model {
    /// Model of a scene with objects.
    ///
    /// # Errors
    /// [`ModelError`] for a number out of its range, or an impulse response that does not fit.
    pub fn new(parameters: ModelParameters, objects: Vec<ModelObject>) -> Result<Self, Error> {
        let fail = |name, what| Err(ModelError::Parameter { name, what }.into());
        let h = parameters.step_s;
        if !(h > 0.0 && h <= 1.0) {
            return fail("step_s", format!("step is {h} s, expected above 0 and at most 1"));
        }
        if !parameters.gravity.is_finite() {
            return fail("gravity", format!("gravity is {}, expected finite numbers", parameters.gravity));
        }
        if parameters.sleep_after_s.is_nan() || parameters.sleep_after_s <= 0.0 {
            let given = parameters.sleep_after_s;
            return fail(
                "sleep_after_s",
                format!("sleep_after_s is {given} s, expected a positive number, or infinity for never"),
            );
        }
        if parameters.max_contact_samples < MIN_CONTACT_SAMPLES {
            let given = parameters.max_contact_samples;
            return fail(
                "max_contact_samples",
                format!("max_contact_samples is {given}, expected {MIN_CONTACT_SAMPLES} or more"),
            );
        }
        for (at, device) in parameters.devices.iter().enumerate() {
            device.check(at)?;
        }
        for (at, obstacle) in parameters.obstacles.iter().enumerate() {
            obstacle.check(at)?;
        }
        let triangles: Vec<usize> =
            objects.iter().map(|object| object.recording.surface.triangles.len()).collect();
        for (at, clamp) in parameters.clamps.iter().enumerate() {
            clamp.check(at, &triangles)?;
        }
        // Cells of each object, clamp after clamp.
        let mut cells: Vec<Vec<Cell>> = vec![Vec::new(); objects.len()];
        let mut first_cells = Vec::with_capacity(parameters.clamps.len());
        for clamp in &parameters.clamps {
            let of_object = &mut cells[clamp.object];
            first_cells.push(of_object.len());
            of_object.extend(clamp.cells(&objects[clamp.object].recording));
        }
        let patch_radii: Vec<f64> = parameters.devices.iter().map(|device| device.patch_radius).collect();
        let contact_limits = parameters.touches_surfaces(objects.len()).then_some(ContactLimits {
            max_samples: parameters.max_contact_samples,
            max_points: parameters.max_contact_points,
        });
        let rules = ObjectRules {
            step_s: h,
            gravity: parameters.gravity,
            patch_radii: &patch_radii,
            cells: &[],
            contact_limits,
        };
        let given = objects;
        let mut objects: Vec<Object> = Vec::with_capacity(given.len());
        for (number, object) in given.into_iter().enumerate() {
            let ModelObject { recording, response, start, deformation, friction } = object;
            let rules = ObjectRules { cells: &cells[number], ..rules };
            let made = Object::new(recording, response, (start, deformation), friction, rules, &objects);
            let fail = |error| ModelError::Object { object: number, error: Box::new(error) };
            objects.push(made.map_err(fail)?);
        }
        if parameters.touches_surfaces(objects.len()) {
            for at in 0..objects.len() {
                let (before, own) = objects.split_at_mut(at);
                let known = before.iter().map(|object| (&*object.body, &object.response));
                own[0].response.precompute_nodal_compliance(&own[0].body, known);
            }
        }
        let place = |(clamp, &first_cell): (&Clamp, &usize)| {
            let object = &objects[clamp.object];
            let count = clamp.cells(&object.body.recording).len();
            let frame = ClampState::new(clamp.frame).start;
            let point = |cell: usize| {
                let location = object.body.cell_location(cell);
                frame.body_from_world(object.start.pose.world_from_body(object.body.rest_position(&location)))
            };
            let points = (first_cell..first_cell + count).map(point).collect();
            PlacedClamp { object: clamp.object, first_cell, points }
        };
        let clamps = parameters.clamps.iter().zip(&first_cells).map(place).collect();
        Ok(Self { parameters, objects, clamps })
    }

    /// Number of cells of a clamp: each is three held directions.
    ///
    /// # Panics
    /// If the model has no such clamp.
    pub fn clamp_cells(&self, clamp: usize) -> usize {
        self.clamps[clamp].points.len()
    }

    /// Number of cells of all clamps.
    pub(crate) fn all_clamp_cells(&self) -> usize {
        self.clamps.iter().map(|clamp| clamp.points.len()).sum()
    }

    /// Parameters of the scene.
    pub fn parameters(&self) -> &ModelParameters {
        &self.parameters
    }

    /// Recordings in the order of the objects.
    pub fn recordings(&self) -> impl Iterator<Item = &Recording> + Clone {
        self.objects.iter().map(|object| &*object.body.recording)
    }

    /// Whether object, triangle and weights of a grasp exist, and forces may enter there.
    pub(crate) fn accepts(&self, grasp: &Grasp) -> bool {
        self.objects.get(grasp.object).is_some_and(|object| {
            object.body.recording.surface.contains(&grasp.point) && object.response.accepts(&grasp.point)
        })
    }

    /// Check that a hand can hold a point: it exists, forces may enter there, and not all of its nodes are fixed. A step rejects other
    /// grasps. [`Self::prepare_device`] checks the same, and loads what the steps need.
    ///
    /// # Errors
    /// [`ModelError::Object`] of [`ModelError::FixedPoint`] or [`ModelError::NoSuchPoint`], with the number of the object.
    pub fn check_grasp(&self, grasp: &Grasp) -> Result<(), Error> {
        let fail = |error| {
            let error = Box::new(error);
            Err(ModelError::Object { object: grasp.object, error }.into())
        };
        if !self.accepts(grasp) {
            return fail(ModelError::NoSuchPoint { triangle: grasp.point.triangle });
        }
        if self.can_hold(grasp) { Ok(()) } else { fail(ModelError::FixedPoint) }
    }

    /// Tables that a mode of a device needs as a whole, with the numbers of their objects: all of them for a tip, that of its object for a
    /// prescribed force on a patch.
    pub fn whole_tables(
        &self,
        device: usize,
        mode: &DeviceMode,
    ) -> impl Iterator<Item = (usize, &ImpulseResponse)> {
        let is_patch = self.parameters.devices.get(device).is_some_and(|own| own.patch_radius > 0.0);
        let (all, only) = match mode {
            DeviceMode::Touch => (true, None),
            DeviceMode::Force(applied) if is_patch => (false, Some(applied.grasp.object)),
            _ => (false, None),
        };
        let tables = self.objects.iter().map(|object| object.response.table()).enumerate();
        tables
            .filter(move |(object, _)| all || only == Some(*object))
            .filter_map(|(object, table)| Some((object, table?)))
    }

    /// Check a mode of a device, and load what its steps need of recorded tables into memory, before it is used in a step.
    ///
    /// # Errors
    /// [`ModelError::Object`] with the number of the object: as [`Self::check_grasp`], or [`ModelError::ImpulseResponse`] for a column that cannot be
    /// read.
    pub fn prepare_device(&self, device: usize, mode: &DeviceMode) -> Result<(), Error> {
        let of = |object: usize, error: Error| match error {
            Error::Model(error) => ModelError::Object { object, error: Box::new(error) }.into(),
            other => other,
        };
        for (object, table) in self.whole_tables(device, mode) {
            table.prepare_all().map_err(|error| of(object, error))?;
        }
        let grasp = match mode {
            DeviceMode::Held(grasp) => grasp,
            DeviceMode::Force(applied) => &applied.grasp,
            DeviceMode::Inactive | DeviceMode::Touch | DeviceMode::Suspended => return Ok(()),
        };
        // A column is loaded before it is asked whether its nodes can move.
        if self.accepts(grasp)
            && let Some(object) = self.objects.get(grasp.object)
            && let Some(table) = object.response.table()
        {
            let prepared = table.prepare(&object.body.recording.surface, &grasp.point);
            prepared.map_err(|error| of(grasp.object, error))?;
        }
        self.check_grasp(grasp)
    }

    /// Whether a hand can hold the point of a grasp: it exists, forces may enter there, and it can move.
    ///
    /// # Real time
    pub(crate) fn can_hold(&self, grasp: &Grasp) -> bool {
        let can_move = |object: &Object| object.response.is_movable(&object.body, &grasp.point);
        self.accepts(grasp) && self.objects.get(grasp.object).is_some_and(can_move)
    }
}

impl ModelParameters {
    /// Whether contact samples replace nodes, by the number of objects.
    pub(crate) fn uses_samples(&self, objects: usize) -> bool {
        self.max_contact_samples < usize::MAX && self.touches_surfaces(objects)
    }

    /// Steps for which objects are still before they fall asleep, two or more, so that none does in a step in which something disturbs it; none
    /// when they never do.
    pub(crate) fn steps_until_sleep(&self) -> Option<u32> {
        let steps = self.sleep_after_s / self.step_s;
        steps.is_finite().then_some((libm::ceil(steps) as u32).max(2))
    }

    /// Whether surfaces come into contact with obstacles or one another, by the number of objects.
    fn touches_surfaces(&self, objects: usize) -> bool {
        !self.obstacles.is_empty() || objects > 1
    }

    /// Capacity of contact points of an object: one held point and the tip contacts of every device, the cells of its clamps, and those of
    /// its surface.
    pub(crate) fn point_capacity(&self, object: &Object) -> usize {
        (1 + MAX_TIP_CONTACTS) * self.devices.len() + object.body.cells() + object.body.surface_points
    }
}
