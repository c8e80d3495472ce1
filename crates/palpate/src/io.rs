//! Input and output of a step.

use crate::collision::{Collider, Grasp};
use crate::energy::EnergyLedger;
use crate::spatial::{Pose, Twist};
use alloc::vec::Vec;
use glam::DVec3;

/// Mode of a device in a step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub enum DeviceMode {
    /// Takes no part in the scene.
    #[default]
    Inactive,
    /// Holds a point in all directions (bilateral constraint).
    Held(Grasp),
    /// Exerts a prescribed force on a point, or on the patch about it, wherever the point goes.
    Force(AppliedForce),
    /// Its tip touches surfaces (unilateral contact).
    Touch,
    /// It is silent for now: no force, as [`Self::Inactive`]. A tip that comes back inside the object which it touched begins on the
    /// surface where it was.
    Suspended,
}

impl DeviceMode {
    /// Whether the device holds, touches or exerts a prescribed force.
    pub fn is_active(&self) -> bool {
        matches!(self, Self::Held(_) | Self::Touch | Self::Force(_))
    }
}

/// Prescribed force on a material point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AppliedForce {
    /// Point that it acts on.
    pub grasp: Grasp,
    /// Force on the object, held over the step [N, world].
    pub force: DVec3,
}

/// One device's part of a step's input.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceInput {
    /// Interface point at the end of the step [m, world]; without meaning where a force is prescribed.
    pub position: DVec3,
    /// Mode in the step.
    pub mode: DeviceMode,
}

impl From<Option<Grasp>> for DeviceMode {
    fn from(grasp: Option<Grasp>) -> Self {
        grasp.map_or(Self::Inactive, Self::Held)
    }
}

impl DeviceInput {
    /// Inactive device.
    pub fn inactive() -> Self {
        Self { position: DVec3::ZERO, mode: DeviceMode::Inactive }
    }

    /// Device that holds a point, at a position [m, world].
    pub fn held(position: DVec3, grasp: Grasp) -> Self {
        Self { position, mode: DeviceMode::Held(grasp) }
    }

    /// Device that touches, at a position [m, world].
    pub fn touching(position: DVec3) -> Self {
        Self { position, mode: DeviceMode::Touch }
    }

    /// Device that exerts a prescribed force.
    pub fn exerting(applied: AppliedForce) -> Self {
        Self { position: DVec3::ZERO, mode: DeviceMode::Force(applied) }
    }

    /// Position of the hand at the end of the step [m, world]: the interface point, or the point that a prescribed force acts on.
    pub fn hand(&self, output: &DeviceOutput) -> DVec3 {
        match self.mode {
            DeviceMode::Force(_) => output.proxy,
            DeviceMode::Inactive | DeviceMode::Held(_) | DeviceMode::Touch | DeviceMode::Suspended => {
                self.position
            }
        }
    }
}

/// Input of a step.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Input {
    /// Devices in the model's order. Missing entries are inactive.
    pub devices: Vec<DeviceInput>,
    /// Obstacle poses at the end of the step, in the model's order. Missing entries stay.
    pub obstacles: Vec<Pose>,
    /// Frames of the clamps at the end of the step [m, world], in the model's order. Missing entries stay.
    pub clamps: Vec<Pose>,
    /// Positions that the bases of bodies with fixed nodes go to [m, world], in the order of the objects: of the centre of mass at rest. At
    /// the end of the step a base is midway between the last position and this one, half a step behind, and moves with their difference
    /// over the step. None, or a missing entry, is the last position.
    pub bases: Vec<Option<DVec3>>,
    /// Gravity, held over the step [m/s², world]. None stays as it was, at the start the model's.
    pub gravity: Option<DVec3>,
}

impl Input {
    /// Copy another input of the same scene.
    ///
    /// # Real time
    /// No allocation, if there is room for its clamps and bases.
    pub fn copy_from(&mut self, other: &Self) {
        self.devices.copy_from_slice(&other.devices);
        self.obstacles.copy_from_slice(&other.obstacles);
        self.clamps.clone_from(&other.clamps);
        self.bases.clone_from(&other.bases);
        self.gravity = other.gravity;
    }
}

/// One device's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct DeviceOutput {
    /// Reaction force on the hand, held over the step [N, world].
    pub force_on_hand: DVec3,
    /// Proxy at the end of the step [m, world]: the held point, the point that a prescribed force acts on, or the
    /// centre of the tip that stays outside the objects; without contact the device's position, but for the lag of a coupling's damper.
    pub proxy: DVec3,
    /// Offset of the interface point from the device's position at the start and at the end of the step [m, world], while a tip that
    /// was inside an object is let out; it decays within some tenths of a second.
    pub offset: [DVec3; 2],
}

/// One clamp's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ClampOutput {
    /// Reaction force on the clamp, held over the step [N, world].
    pub force: DVec3,
    /// Reaction torque on the clamp about the origin of its frame, with arms at the end of the step [N·m, world].
    pub torque: DVec3,
}

/// Net force on a plane or obstacle in a step, the sum over its contacts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ObstacleOutput {
    /// Force of the objects on it, held over the step [N, world].
    pub force: DVec3,
    /// Torque of the objects on it about the origin of its frame, the position of its pose, with arms at the end of the step [N·m, world].
    pub torque: DVec3,
}

/// Contact that carries force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactOutput {
    /// Number of the object in the model.
    pub object: usize,
    /// The other side.
    pub against: Collider,
    /// Point on the object's surface at the end of the step [m, world].
    pub point: DVec3,
    /// Unit normal, out of the object [world].
    pub normal: DVec3,
    /// Force on the object, held over the step [N, world].
    pub force: DVec3,
    /// Gap at the end of the step [m], negative when penetrating.
    pub gap: f64,
    /// Mean slip speed over the step [m/s].
    pub slip_speed: f64,
}

/// One object's part of a step's output.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectOutput {
    /// Placement at the end of the step.
    pub pose: Pose,
    /// Velocity at the end of the step.
    pub twist: Twist,
    /// Net force of contacts, hands, clamps and prescribed forces on it, held over the step [N, world]; without its weight, and without what
    /// its support carries.
    pub force: DVec3,
    /// Torque of these forces about the origin of the body frame, the centre of mass at rest, with arms at the end of the step [N·m, world].
    pub torque: DVec3,
    /// Energy ledger.
    pub energy: EnergyLedger,
    /// Largest penetration of the object's contacts at the end of the step [m], not negative; 0 without contact. Between
    /// contact locations an object may be deeper.
    pub penetration_m: f64,
    /// Whether it is asleep: still, and left as it is with its contacts until something comes near.
    pub is_asleep: bool,
}

/// Status of a step. A step cannot fail; the status reports rejected inputs and unsolved contacts.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct StepStatus {
    /// Largest residual of a contact's law [m].
    pub solver_residual_m: f64,
    /// Largest number of solver iterations of an island.
    pub iterations: u32,
    /// Devices and obstacles with a position or force that is not finite, or a grasp that does not exist: the device is inactive, the
    /// obstacle, or a clamp, stays. Gravity that is not finite, or changes for a body with fixed nodes that uses a table, stays too.
    pub rejected_inputs: u32,
    /// Held directions that depend linearly on others and got no force.
    pub dependent_rows: u32,
    /// Islands (objects that contacts connect) whose contacts were not solved to the tolerance, and objects whose rotation was
    /// not, because a device or a body moves too far in a step. Such contacts give a scaled force in this step, or none;
    /// islands with held points only give none.
    pub unsolved_islands: u32,
    /// Islands whose contacts the solver left before they met their laws, since the budget of work was used up. Their forces give no energy,
    /// and the next step goes on from them.
    pub islands_out_of_budget: u32,
    /// Contacts dropped beyond an object's limit of contact points.
    pub dropped_contacts: u32,
}

/// Output of a step.
#[derive(Debug, Clone, PartialEq)]
pub struct Output {
    /// Time at the end of the step [s].
    pub time_s: f64,
    /// Devices, in the model's order.
    pub devices: Vec<DeviceOutput>,
    /// Objects, in the model's order.
    pub objects: Vec<ObjectOutput>,
    /// Planes and obstacles, in the model's order.
    pub obstacles: Vec<ObstacleOutput>,
    /// Clamps, in the model's order.
    pub clamps: Vec<ClampOutput>,
    /// Contacts that carry force, without held points; those of sleeping objects first, as they were.
    pub contacts: Vec<ContactOutput>,
    /// Energy ledger of the scene.
    pub energy: EnergyLedger,
    /// Status of the step.
    pub status: StepStatus,
}

impl Output {
    /// Copy another output of the same scene.
    ///
    /// # Real time
    /// No allocation, if there is room for its contacts.
    pub fn copy_from(&mut self, other: &Self) {
        (self.time_s, self.energy, self.status) = (other.time_s, other.energy, other.status);
        self.devices.copy_from_slice(&other.devices);
        self.objects.copy_from_slice(&other.objects);
        self.obstacles.copy_from_slice(&other.obstacles);
        self.clamps.copy_from_slice(&other.clamps);
        self.contacts.clone_from(&other.contacts);
    }
}
