//! What changes while a scene runs, what a step takes and what it gives.

use crate::contact::{
    Collider, Contact, ContactPoints, DeviceState, Grasp, Level, Lift, NodeCache, Search, Solver, Vicinity,
    WantedList,
};
use crate::deformation::DeformationSnapshot;
use crate::energy::EnergyLedger;
use crate::motion::{RigidState, RigidStep};
use crate::response::{OscillatorState, ResponseState};
use crate::scene::{Model, SceneObject};
use crate::spatial::{Pose, Twist};
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// What a device does in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum DeviceMode {
    /// Nothing: it is away.
    #[default]
    Inactive,
    /// It holds a point in all directions.
    Held(Grasp),
    /// Its tip touches whatever it meets.
    Touch,
}

/// One device's part of a step's input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceInput {
    /// Interface point at the end of the step [m, world].
    pub position: DVec3,
    /// What it does.
    pub mode: DeviceMode,
}

impl From<Option<Grasp>> for DeviceMode {
    fn from(grasp: Option<Grasp>) -> Self {
        grasp.map_or(Self::Inactive, Self::Held)
    }
}

impl DeviceInput {
    /// A device that is away.
    pub fn inactive() -> Self {
        Self { position: DVec3::ZERO, mode: DeviceMode::Inactive }
    }

    /// A device that holds a point.
    pub fn held(position: DVec3, grasp: Grasp) -> Self {
        Self { position, mode: DeviceMode::Held(grasp) }
    }

    /// A device that touches.
    pub fn touching(position: DVec3) -> Self {
        Self { position, mode: DeviceMode::Touch }
    }
}

/// Input of a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Input {
    /// In the order of the model's devices. Missing entries are away.
    pub devices: Vec<DeviceInput>,
    /// Where the obstacles are at the end of the step, in the order of the model's. Missing entries stay.
    pub obstacles: Vec<Pose>,
}

/// One device's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DeviceOutput {
    /// Force on the hand [N, world]: the reaction, held over the step.
    pub force_on_hand: DVec3,
    /// Proxy at the end of the step [m, world]: the held point, or the centre of the tip that stays outside the objects;
    /// the device's position if it meets nothing and no coupling's damper lets it come later.
    pub proxy: DVec3,
}

/// A contact that carries force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactOutput {
    /// Position of the object in the model.
    pub object: usize,
    /// What it is in contact with.
    pub against: Collider,
    /// Where on the object's surface, at the end of the step [m, world].
    pub point: DVec3,
    /// Out of the object [world].
    pub normal: DVec3,
    /// Force on the object [N, world], held over the step.
    pub force: DVec3,
    /// Gap at the end of the step [m], negative when penetrating.
    pub gap: f64,
    /// Speed of slip over the step [m/s].
    pub slip_speed: f64,
}

/// One object's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectOutput {
    /// Placement at the end of the step.
    pub pose: Pose,
    /// Velocity at the end of the step.
    pub twist: Twist,
    /// Its energies.
    pub energy: EnergyLedger,
}

/// How a step went. A step can't fail; this says what it met.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepStatus {
    /// Largest miss of a contact's law [m].
    pub solver_residual_m: f64,
    /// Most repetitions that an object needed.
    pub iterations: u32,
    /// Devices and obstacles whose position was not finite or whose grasp does not exist; the device is away, the
    /// obstacle stays.
    pub rejected_inputs: u32,
    /// Held directions that repeat others and got no force.
    pub dependent_rows: u32,
    /// Objects, or groups of them, whose contacts could not be solved, or whose turn could not be found, because a hand
    /// or a body moves too far in a step. Their contacts gave a part of the force in this step, or none; those of groups
    /// with nothing but held points gave none.
    pub unsolved_islands: u32,
    /// Contacts for which an object had no room.
    pub dropped_contacts: u32,
}

/// Output of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Time at the end of the step [s].
    pub time_s: f64,
    /// Per device.
    pub devices: Vec<DeviceOutput>,
    /// Per object.
    pub objects: Vec<ObjectOutput>,
    /// The contacts that carry force, held points apart.
    pub contacts: Vec<ContactOutput>,
    /// Sum over objects, with what devices and obstacles do.
    pub energy: EnergyLedger,
    /// How it went.
    pub status: StepStatus,
}

/// How an object is placed, moves and is deformed: what a scene can begin with.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectSnapshot {
    /// Placement.
    pub pose: Pose,
    /// Velocity.
    pub twist: Twist,
    /// Angular momentum about the centre of mass [kg·m²/s, world]: the velocity follows from it but for rounding.
    pub angular_momentum: DVec3,
    /// Its modes; none where a table is used.
    pub modes: Vec<OscillatorState>,
}

/// One object in motion.
#[derive(Debug, Clone)]
pub(crate) struct ObjectState {
    pub(crate) rigid: RigidState,
    pub(crate) response: ResponseState,
    pub(crate) points: ContactPoints,
    /// The step without contact force, and as it is solved.
    pub(crate) free: RigidStep,
    pub(crate) end: RigidStep,
    pub(crate) lift: Lift,
    /// How far the deformation moves any surface node in the step without contact force, at most [m].
    pub(crate) surface_motion: f64,
    /// How far contact forces moved their points in the last step, at most [m].
    pub(crate) pushed: f64,
    pub(crate) ledger: EnergyLedger,
    pub(crate) stored_at_start: f64,
}

/// The state of a scene.
#[derive(Debug, Clone)]
pub struct State {
    pub(crate) steps: u64,
    pub(crate) objects: Vec<ObjectState>,
    pub(crate) devices: Vec<DeviceState>,
    /// Where the obstacles are.
    pub(crate) obstacles: Vec<Pose>,
    /// In the order of their keys.
    pub(crate) contacts: Vec<Contact>,
    /// Whether a device is inside an object, where it came to without crossing the surface: devices × objects.
    pub(crate) inside: Vec<bool>,
    /// How coarsely each object meets each obstacle, and each other object: objects × (obstacles + objects).
    pub(crate) levels: Vec<Level>,
    /// What virtual couplings did.
    pub(crate) couplings: EnergyLedger,
    pub(crate) workspace: Workspace,
    pub(crate) output: Output,
}

/// Buffers of a step, made once.
#[derive(Debug, Clone)]
pub(crate) struct Workspace {
    pub(crate) solver: Solver,
    pub(crate) search: Search,
    pub(crate) caches: Vec<NodeCache>,
    /// Devices × objects.
    pub(crate) vicinities: Vec<Vicinity>,
    pub(crate) near: Vec<u32>,
    pub(crate) wanted: WantedList,
    pub(crate) spare: Vec<Contact>,
    pub(crate) modes: Vec<f64>,
    pub(crate) next_obstacles: Vec<Pose>,
}

impl State {
    /// The scene at its start: undeformed, with all buffers that steps will need.
    pub fn new(model: &Model) -> Self {
        let parameters = &model.parameters;
        let devices = parameters.devices.len();
        let objects: Vec<_> = model.objects.iter().map(|o| ObjectState::new(o, model)).collect();
        let object_outputs = model.objects.iter().zip(&objects).map(|(object, state)| ObjectOutput {
            pose: state.rigid.pose,
            twist: object.start.twist,
            energy: state.ledger,
        });
        let contacts = objects.iter().map(|own| own.points.capacity()).sum();
        let output = Output {
            time_s: 0.0,
            devices: vec![DeviceOutput::default(); devices],
            objects: object_outputs.collect(),
            contacts: Vec::with_capacity(contacts),
            energy: objects.iter().fold(EnergyLedger::default(), |sum, o| sum.plus(&o.ledger)),
            status: StepStatus::default(),
        };
        let most_modes = model.objects.iter().map(|o| o.response.modes()).max().unwrap_or(0);
        let nodes = |o: &SceneObject| o.body.recording.surface.positions.len();
        let obstacles: Vec<Pose> = parameters.obstacles.iter().map(|obstacle| obstacle.pose).collect();
        Self {
            steps: 0,
            devices: vec![DeviceState::new(); devices],
            contacts: Vec::with_capacity(contacts),
            inside: vec![false; devices * model.objects.len()],
            levels: vec![Level::default(); model.objects.len() * model.others()],
            couplings: EnergyLedger::default(),
            workspace: Workspace {
                solver: Solver::new(
                    model.objects.len(),
                    devices,
                    contacts,
                    parameters.thins_faces(model.objects.len()),
                ),
                search: Search::new(),
                caches: model.objects.iter().map(|o| NodeCache::new(&o.body)).collect(),
                vicinities: (0..devices)
                    .flat_map(|_| model.objects.iter().map(|o| Vicinity::new(o.response.modes())))
                    .collect(),
                near: Vec::with_capacity(model.objects.iter().map(nodes).max().unwrap_or(0)),
                wanted: WantedList::new(contacts),
                spare: Vec::with_capacity(contacts),
                modes: vec![0.0; most_modes],
                next_obstacles: obstacles.clone(),
            },
            obstacles,
            objects,
            output,
        }
    }

    /// The scene where its objects are as they were in another state: placed, moving and deformed alike, with nothing in contact
    /// yet, at time 0 with a ledger of its own. So a scene goes on under other rules: another step, gravity, friction.
    /// Objects with other modes, or tables, begin where the model says.
    pub fn resume(model: &Model, from: &[ObjectSnapshot]) -> Self {
        let mut state = Self::new(model);
        let gravity = model.parameters.gravity;
        let pairs = state.objects.iter_mut().zip(&model.objects).zip(from);
        for (at, ((own, object), before)) in pairs.enumerate() {
            if !own.response.resume_from(&before.modes) {
                continue;
            }
            let ObjectSnapshot { pose, twist, angular_momentum, .. } = *before;
            own.rigid = RigidState { pose, velocity: twist.linear, angular_momentum };
            let still = RigidStep { end: own.rigid, turn: DVec3::ZERO, miss: 0.0 };
            (own.free, own.end) = (still, still);
            own.weigh(object, gravity);
            own.stored_at_start = own.ledger.stored();
            state.output.objects[at] = ObjectOutput { pose, twist, energy: own.ledger };
        }
        state.output.energy =
            state.objects.iter().fold(EnergyLedger::default(), |sum, own| sum.plus(&own.ledger));
        state
    }

    /// How its objects move at the end of the last step, in the model's order.
    pub fn motions(&self) -> Vec<ObjectSnapshot> {
        let motion = |(own, output): (&ObjectState, &ObjectOutput)| ObjectSnapshot {
            pose: own.rigid.pose,
            twist: Twist { linear: own.rigid.velocity, ..output.twist },
            angular_momentum: own.rigid.angular_momentum,
            modes: own.response.modes().to_vec(),
        };
        self.objects.iter().zip(&self.output.objects).map(motion).collect()
    }

    /// The output of the last step; before the first, the scene at its start.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Modal coordinates q [m·√kg] of an object and their rates; none for one that uses a table.
    pub fn modal_state(&self, object: usize) -> &[OscillatorState] {
        self.objects[object].response.modes()
    }

    /// Elastic displacement [m, body] of every surface node of an object at the end of the last step. Costs nodes ×
    /// modes, with a table nodes × forces of the last T steps: for pictures, beside the force.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement(&self, model: &Model, object: usize, out: &mut [DVec3]) {
        self.deformation(object).surface_displacement(model, out);
    }

    /// What deforms an object at the end of the last step: a copy that can go elsewhere.
    pub fn deformation(&self, object: usize) -> DeformationSnapshot {
        let own = &self.objects[object];
        DeformationSnapshot { object, pose: own.rigid.pose, deformed: own.response.deformed() }
    }
}

impl ObjectState {
    /// How far from the origin the object goes [m]: the scale of round-off of its places.
    pub(crate) fn reach(&self, object: &SceneObject) -> f64 {
        self.rigid.pose.position.length() + object.radius
    }

    fn new(object: &SceneObject, model: &Model) -> Self {
        let parameters = &model.parameters;
        let capacity = object.capacity(parameters, model.objects.len());
        let nodes = object.body.recording.surface.positions.len();
        let twist = object.start.twist;
        let pose = object.start.pose;
        let angular_momentum = object
            .inertia
            .map_or(DVec3::ZERO, |inertia| inertia.angular_momentum(pose.orientation, twist.angular));
        let rigid = RigidState { pose, velocity: twist.linear, angular_momentum };
        let still = RigidStep { end: rigid, turn: DVec3::ZERO, miss: 0.0 };
        let mut state = Self {
            rigid,
            response: object.response.at_rest(nodes, capacity),
            points: ContactPoints::new(capacity),
            free: still,
            end: still,
            lift: Lift::default(),
            surface_motion: 0.0,
            pushed: 0.0,
            ledger: EnergyLedger::default(),
            stored_at_start: 0.0,
        };
        state.weigh(object, parameters.gravity);
        state.stored_at_start = state.ledger.stored();
        state
    }

    /// Write kinetic, elastic and potential energy of the state into its ledger.
    ///
    /// # Real time
    pub(crate) fn weigh(&mut self, object: &SceneObject, gravity: DVec3) {
        let elastic = self.response.energy(&object.response);
        let rigid = object.inertia.map_or(0.0, |inertia| inertia.kinetic_energy(&self.rigid));
        let mut potential = -object.body.recording.mass() * gravity.dot(self.rigid.pose.position);
        if let Some(response) = &object.body.recording.gravity {
            let acceleration = object.gravity_in_body(gravity, &self.rigid.pose);
            let modes = self.response.modes();
            for (axis, a) in acceleration.to_array().into_iter().enumerate() {
                let loads = &response.modal_forces[axis * modes.len()..][..modes.len()];
                let work: f64 = loads.iter().zip(modes).map(|(p, mode)| p * mode.q).sum();
                potential -= a * work;
            }
        }
        self.ledger.kinetic = elastic.kinetic + rigid;
        self.ledger.elastic = elastic.elastic;
        self.ledger.residual = elastic.residual;
        self.ledger.potential = potential;
    }
}
