//! State of a scene: what changes from step to step, and the buffers of a step.

use crate::bounded_vec::BoundedVec;
use crate::clamp::ClampState;
use crate::collision::{CollisionCaches, CollisionScene, CollisionWorkspace, Contact, Levels};
use crate::contact::{Constraint, RecoveryBudget, Solver};
use crate::device::DeviceState;
use crate::energy::EnergyLedger;
use crate::io::{ClampOutput, DeviceOutput, ObjectOutput, ObstacleOutput, Output, StepStatus};
use crate::motion::{RigidState, RigidStep};
use crate::object::ObjectState;
use crate::response::OscillatorState;
use crate::scene::Model;
use crate::sleep::Sleepers;
use crate::spatial::{Pose, Twist};
use alloc::boxed::Box;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Placement, motion and deformation of an object, to resume a scene from.
#[derive(Debug, Clone, PartialEq)]
pub struct ObjectSnapshot {
    /// Placement.
    pub pose: Pose,
    /// Velocity.
    pub twist: Twist,
    /// Angular momentum about the centre of mass [kg·m²/s, world]; the angular velocity follows from it up to round-off.
    pub angular_momentum: DVec3,
    /// States of the modes; none where a table is used.
    pub modes: Vec<OscillatorState>,
}

/// State of a scene. A clone goes on as its original does; its output and some buffers grow in its first steps, and as objects wake for
/// the first time.
#[derive(Debug, Clone)]
pub struct State {
    /// Steps since the start.
    pub(crate) steps: u64,
    pub(crate) objects: Vec<ObjectState>,
    pub(crate) devices: Vec<DeviceState>,
    /// Obstacle poses.
    pub(crate) obstacles: Vec<Pose>,
    /// Frames of the clamps.
    pub(crate) clamps: Vec<ClampState>,
    /// Gravity in the last step [m/s², world].
    pub(crate) gravity: DVec3,
    /// Contact cache, in the order of the ids.
    pub(crate) contacts: BoundedVec<Contact>,
    pub(crate) levels: Levels,
    pub(crate) sleepers: Sleepers,
    pub(crate) resting: Resting,
    /// Energy of the virtual couplings.
    pub(crate) couplings: EnergyLedger,
    pub(crate) recovery: RecoveryBudget,
    pub(crate) caches: CollisionCaches,
    /// Buffers of its steps; none where those of others are used.
    pub(crate) workspace: Option<Box<Workspace>>,
    pub(crate) output: Output,
}

/// Contacts and energy of sleeping objects; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct Resting {
    /// Contacts of each sleeping object.
    pub(crate) contacts: Vec<BoundedVec<Contact>>,
    /// Number of their contacts in the output, which are its first.
    pub(crate) outputs: usize,
    /// Net forces of these contacts on the obstacles.
    pub(crate) obstacles: Vec<ObstacleOutput>,
    /// Sum of their energy ledgers.
    energy: EnergyLedger,
}

impl Resting {
    /// Sum up the ledgers of the sleeping objects.
    pub(crate) fn update_energy(&mut self, objects: &[ObjectState], sleepers: &Sleepers) {
        let asleep = objects.iter().enumerate().filter(|(at, _)| !sleepers.is_awake(*at));
        self.energy = asleep.fold(EnergyLedger::default(), |sum, (_, own)| sum.plus(&own.ledger));
    }

    /// Energy that they have lost since the start [J].
    pub(crate) fn lost(&self) -> f64 {
        self.energy.lost()
    }

    /// Ledger of the scene, with that of the virtual couplings.
    pub(crate) fn scene_energy(
        &self,
        couplings: &EnergyLedger,
        objects: &[ObjectState],
        sleepers: &Sleepers,
    ) -> EnergyLedger {
        let awake = sleepers.awake_indices().map(|at| &objects[at].ledger);
        awake.fold(couplings.plus(&self.energy), |sum, own| sum.plus(own))
    }
}

/// Buffers of a step, made once. Nothing in them lasts longer: states of one model can share them, as rows of a batch share those of a thread
/// ([`step_in`](crate::step_in)).
#[derive(Debug, Clone)]
pub struct Workspace {
    pub(crate) collision: CollisionWorkspace,
    pub(crate) solver: Solver,
    /// Contacts of the next step, while they are matched.
    pub(crate) spare: BoundedVec<Contact>,
    /// Constraints of the contacts.
    pub(crate) constraints: BoundedVec<Constraint>,
    pub(crate) next_obstacles: Vec<Pose>,
}

impl Workspace {
    /// Buffers for the states of a model.
    pub fn new(model: &Model) -> Self {
        let parameters = &model.parameters;
        let count = model.objects.len();
        let contacts = (0..count).map(|at| parameters.point_capacity(&model.objects[at])).sum();
        Self {
            collision: CollisionWorkspace::new(model.collision_scene(), contacts),
            solver: Solver::new(
                count,
                parameters.devices.len() + model.all_clamp_cells(),
                contacts,
                parameters.uses_samples(count),
            ),
            spare: BoundedVec::new(contacts),
            constraints: BoundedVec::new(contacts),
            next_obstacles: parameters.obstacles.iter().map(|obstacle| obstacle.pose).collect(),
        }
    }
}

impl State {
    /// State of a scene at its start: undeformed, with all buffers that steps need.
    pub fn new(model: &Model) -> Self {
        let parameters = &model.parameters;
        let devices = parameters.devices.len();
        let count = model.objects.len();
        let new_object =
            |object| ObjectState::new(object, parameters.gravity, parameters.point_capacity(object));
        let objects: Vec<_> = model.objects.iter().map(new_object).collect();
        let object_outputs = model.objects.iter().zip(&objects).map(|(object, state)| ObjectOutput {
            pose: state.rigid.pose,
            twist: object.start.twist,
            force: DVec3::ZERO,
            torque: DVec3::ZERO,
            energy: state.ledger,
            penetration_m: 0.0,
            is_asleep: false,
        });
        let contacts = objects.iter().map(|own| own.points.capacity()).sum();
        let output = Output {
            time_s: 0.0,
            devices: vec![DeviceOutput::default(); devices],
            objects: object_outputs.collect(),
            obstacles: vec![ObstacleOutput::default(); parameters.obstacles.len()],
            clamps: vec![ClampOutput::default(); parameters.clamps.len()],
            contacts: Vec::with_capacity(contacts),
            energy: objects.iter().fold(EnergyLedger::default(), |sum, o| sum.plus(&o.ledger)),
            status: StepStatus::default(),
        };
        let can_sleep = parameters.steps_until_sleep().is_some();
        let resting_contacts = |own: &ObjectState| if can_sleep { own.points.capacity() } else { 0 };
        let obstacles: Vec<Pose> = parameters.obstacles.iter().map(|obstacle| obstacle.pose).collect();
        Self {
            steps: 0,
            gravity: parameters.gravity,
            devices: vec![DeviceState::new(); devices],
            clamps: parameters.clamps.iter().map(|clamp| ClampState::new(clamp.frame)).collect(),
            contacts: BoundedVec::new(contacts),
            levels: Levels::new(
                model.objects.iter().map(|object| object.body.surface_points),
                obstacles.len(),
            ),
            sleepers: Sleepers::new(count),
            resting: Resting {
                contacts: objects.iter().map(|own| BoundedVec::new(resting_contacts(own))).collect(),
                outputs: 0,
                obstacles: vec![ObstacleOutput::default(); parameters.obstacles.len()],
                energy: EnergyLedger::default(),
            },
            couplings: EnergyLedger::default(),
            recovery: RecoveryBudget::default(),
            caches: CollisionCaches::new(model.collision_scene()),
            workspace: Some(Box::new(Workspace::new(model))),
            obstacles,
            objects,
            output,
        }
    }

    /// Free the buffers of its steps: for a state that is stepped with those of others ([`step_in`](crate::step_in)). Without them
    /// [`step`](crate::step()) makes new ones.
    pub fn release_workspace(&mut self) {
        self.workspace = None;
    }

    /// State that resumes from snapshots of another one: placed, moving and deformed alike, without contacts, at time 0 with a
    /// ledger of its own. The model may have another step, gravity or friction. Objects with another number of modes,
    /// or with tables, start where the model says.
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
            let still = RigidStep { end: own.rigid, turn: DVec3::ZERO, residual: 0.0 };
            (own.free, own.end) = (still, still);
            own.update_ledger(object, gravity);
            own.stored_at_start = own.ledger.stored();
            state.output.objects[at] =
                ObjectOutput { pose, twist, energy: own.ledger, ..state.output.objects[at] };
        }
        state.output.energy = state.resting.scene_energy(&state.couplings, &state.objects, &state.sleepers);
        state
    }

    /// Snapshots of all objects at the end of the last step, in the model's order.
    pub fn snapshots(&self) -> Vec<ObjectSnapshot> {
        let snapshot = |(own, output): (&ObjectState, &ObjectOutput)| ObjectSnapshot {
            pose: own.rigid.pose,
            twist: Twist { linear: own.rigid.velocity, ..output.twist },
            angular_momentum: own.rigid.angular_momentum,
            modes: own.response.modes().to_vec(),
        };
        self.objects.iter().zip(&self.output.objects).map(snapshot).collect()
    }

    /// Output of the last step; before the first, of the scene at its start.
    pub fn output(&self) -> &Output {
        &self.output
    }

    /// Number of steps since the start: the next one ends at (count + 1)·h.
    pub fn step_count(&self) -> u64 {
        self.steps
    }

    /// Modal coordinates q [m·√kg] of an object and their rates; none for one that uses a table.
    pub fn modal_state(&self, object: usize) -> &[OscillatorState] {
        self.objects[object].response.modes()
    }

    /// Modal forces p [N/√kg] that were held over the last step of an object, Φᵀ·f with gravity; none for one that uses a table. With the
    /// states at the start of the step they give its motion at any time within the step ([`SampledOscillator`](crate::SampledOscillator)). An
    /// object that sleeps keeps those of its last step.
    pub fn held_modal_forces(&self, object: usize) -> &[f64] {
        self.objects[object].response.held_modal_forces()
    }
}

impl Model {
    /// The scene as collision detection sees it.
    pub(crate) fn collision_scene(&self) -> CollisionScene<'_> {
        let parameters = &self.parameters;
        CollisionScene {
            objects: &self.objects,
            devices: &parameters.devices,
            obstacles: &parameters.obstacles,
            max_contact_samples: parameters.max_contact_samples,
        }
    }
}
