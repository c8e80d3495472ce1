//! Plain values of the interface, and their conversion from the runtime's.

use crate::error::Failure;
use glam::{DQuat, DVec3};
use palpate_scene::RunMode;

/// Vector: x, y, z.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vector {
    /// x
    pub x: f64,
    /// y
    pub y: f64,
    /// z
    pub z: f64,
}

/// Unit quaternion.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quaternion {
    /// x
    pub x: f64,
    /// y
    pub y: f64,
    /// z
    pub z: f64,
    /// Real part.
    pub w: f64,
}

/// Placement: p_world = position + orientation·p_body.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Position of the origin of the body frame, an object's centre of mass [m].
    pub position: Vector,
    /// Orientation.
    pub orientation: Quaternion,
}

/// Purpose of a scene, which decides defaults (docs/scene.md).
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// Steps with a deadline: a budget of the solver, and fewer contact samples.
    RealTime = 0,
    /// Steps without a deadline.
    Offline = 1,
    /// To compare with: every surface node is a contact, and no object sleeps.
    Reference = 2,
}

/// Kind of a scene's parts.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Elastic objects.
    Object = 0,
    /// Devices: tips, hands that hold a point, prescribed forces.
    Device = 1,
    /// Planes and rigid obstacles.
    Obstacle = 2,
    /// Clamps.
    Clamp = 3,
}

/// Mode of a device.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DeviceMode {
    /// No part in the step.
    Inactive = 0,
    /// Hold of a point in all directions.
    Held = 1,
    /// Tip that touches surfaces.
    Touch = 2,
    /// Prescribed force on a point.
    Force = 3,
    /// Silence for now: a tip that comes back inside the object which it touched begins on the surface where it was.
    Suspended = 4,
}

/// Material point on the surface of an object.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Number of the object.
    pub object: usize,
    /// Number of the triangle.
    pub triangle: u32,
    /// Barycentric weights of its corners; they sum to 1.
    pub weights: [f64; 3],
}

/// Input of a device in a step.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceInput {
    /// Mode: a `PalpateDeviceMode`.
    pub mode: u32,
    /// Position at the end of the step [m]; without meaning where a force is prescribed.
    pub position: Vector,
    /// Point that is held, or that a prescribed force acts on.
    pub point: SurfacePoint,
    /// Prescribed force on the object [N].
    pub force: Vector,
}

/// Device after a step.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceOutput {
    /// Force on the hand, held over the step [N].
    pub force_on_hand: Vector,
    /// Proxy: the held point, or the centre of the tip that stays outside the objects [m].
    pub proxy: Vector,
}

/// Clamp after a step.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClampOutput {
    /// Force on the clamp, held over the step [N].
    pub force: Vector,
    /// Torque on the clamp about the origin of its frame [N·m].
    pub torque: Vector,
}

/// Plane or obstacle after a step.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObstacleOutput {
    /// Net force of the objects on it, held over the step [N].
    pub force: Vector,
    /// Torque of the objects on it about the position of its pose [N·m].
    pub torque: Vector,
}

/// Energies of an object, or of a scene [J]: kinetic + elastic + residual + potential + coupling = at the start + input − dissipated −
/// friction − impact + defect.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Energy {
    /// Kinetic energy of rigid motion and modes.
    pub kinetic: f64,
    /// Elastic energy of the modes.
    pub elastic: f64,
    /// Elastic energy of the residual compliance.
    pub residual: f64,
    /// Potential energy in the gravity field.
    pub potential: f64,
    /// Elastic energy of virtual couplings.
    pub coupling: f64,
    /// Work on the object at its contacts since the start.
    pub input: f64,
    /// Energy dissipated by damping since the start.
    pub dissipated: f64,
    /// Energy dissipated by friction since the start.
    pub friction: f64,
    /// Energy dissipated by impact since the start.
    pub impact: f64,
    /// Imbalance of the terms above since the start.
    pub defect: f64,
}

/// Object after a step.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectOutput {
    /// Placement.
    pub pose: Pose,
    /// Velocity of the centre of mass [m/s].
    pub velocity: Vector,
    /// Angular velocity [rad/s].
    pub angular_velocity: Vector,
    /// Net force of contacts, hands, clamps and prescribed forces on it, held over the step [N]; without its weight.
    pub force: Vector,
    /// Torque of these forces about the position of its pose [N·m].
    pub torque: Vector,
    /// Energy ledger.
    pub energy: Energy,
    /// Largest penetration of its contacts [m], not negative.
    pub penetration_m: f64,
    /// Whether it is asleep.
    pub is_asleep: bool,
}

/// Other side of a contact.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Collider {
    /// The tip of a device.
    Device = 0,
    /// A plane or a rigid obstacle.
    Obstacle = 1,
    /// Another object.
    Object = 2,
}

/// Contact that carries force.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactOutput {
    /// Number of the object.
    pub object: usize,
    /// Kind of the other side.
    pub against: Collider,
    /// Number of the other side among its kind.
    pub against_number: usize,
    /// Point on the object's surface [m].
    pub point: Vector,
    /// Unit normal, out of the object.
    pub normal: Vector,
    /// Force on the object, held over the step [N].
    pub force: Vector,
    /// Gap [m], negative when penetrating.
    pub gap: f64,
    /// Mean slip speed over the step [m/s].
    pub slip_speed: f64,
}

/// Status of a step: what it could not do.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StepStatus {
    /// Largest residual of a contact's law [m].
    pub solver_residual_m: f64,
    /// Largest number of solver iterations of an island.
    pub iterations: u32,
    /// Inputs that are not finite, orientations that are no unit quaternions, points that do not exist: such a device is inactive, such an
    /// obstacle stays.
    pub rejected_inputs: u32,
    /// Held directions that depend linearly on others and got no force.
    pub dependent_rows: u32,
    /// Islands whose contacts were not solved to the tolerance.
    pub unsolved_islands: u32,
    /// Islands that the budget of work was too small for.
    pub islands_out_of_budget: u32,
    /// Contacts beyond an object's limit.
    pub dropped_contacts: u32,
}

impl From<DVec3> for Vector {
    fn from(vector: DVec3) -> Self {
        // No negative zeros, as in forces of nothing.
        let DVec3 { x, y, z } = vector + DVec3::ZERO;
        Self { x, y, z }
    }
}

impl From<Vector> for DVec3 {
    fn from(Vector { x, y, z }: Vector) -> Self {
        Self { x, y, z }
    }
}

impl From<palpate::Pose> for Pose {
    fn from(pose: palpate::Pose) -> Self {
        let DQuat { x, y, z, w } = pose.orientation;
        Self { position: pose.position.into(), orientation: Quaternion { x, y, z, w } }
    }
}

impl From<Pose> for palpate::Pose {
    fn from(Pose { position, orientation: Quaternion { x, y, z, w } }: Pose) -> Self {
        Self { position: position.into(), orientation: DQuat::from_xyzw(x, y, z, w) }
    }
}

/// Value of an enumeration that a program has given as a number.
pub(crate) fn chosen<T: Copy>(values: &[T], number: u32, what: &str) -> Result<T, Failure> {
    let value = usize::try_from(number).ok().and_then(|number| values.get(number)).copied();
    value.ok_or_else(|| Failure::argument(format!("there is no {what} of number {number}")))
}

impl Purpose {
    /// Purpose of a number.
    pub(crate) fn of(number: u32) -> Result<RunMode, Failure> {
        chosen(&[RunMode::RealTime, RunMode::Offline, RunMode::Reference], number, "purpose")
    }
}

impl Part {
    /// Part of a number.
    pub(crate) fn of(number: u32) -> Result<Self, Failure> {
        chosen(&[Self::Object, Self::Device, Self::Obstacle, Self::Clamp], number, "kind of parts")
    }
}

impl From<palpate::Grasp> for SurfacePoint {
    fn from(palpate::Grasp { object, point }: palpate::Grasp) -> Self {
        Self { object, triangle: point.triangle, weights: point.weights }
    }
}

impl From<SurfacePoint> for palpate::Grasp {
    fn from(SurfacePoint { object, triangle, weights }: SurfacePoint) -> Self {
        Self { object, point: palpate::SurfacePoint { triangle, weights } }
    }
}

impl From<palpate::DeviceInput> for DeviceInput {
    fn from(palpate::DeviceInput { position, mode }: palpate::DeviceInput) -> Self {
        let nothing = SurfacePoint { object: 0, triangle: 0, weights: [0.0; 3] };
        let (mode, point, force) = match mode {
            palpate::DeviceMode::Inactive => (DeviceMode::Inactive, nothing, DVec3::ZERO),
            palpate::DeviceMode::Touch => (DeviceMode::Touch, nothing, DVec3::ZERO),
            palpate::DeviceMode::Suspended => (DeviceMode::Suspended, nothing, DVec3::ZERO),
            palpate::DeviceMode::Held(grasp) => (DeviceMode::Held, grasp.into(), DVec3::ZERO),
            palpate::DeviceMode::Force(applied) => (DeviceMode::Force, applied.grasp.into(), applied.force),
        };
        Self { mode: mode as u32, position: position.into(), point, force: force.into() }
    }
}

impl DeviceInput {
    /// The runtime's input.
    pub(crate) fn checked(self) -> Result<palpate::DeviceInput, Failure> {
        let grasp = self.point.into();
        let modes = [
            palpate::DeviceMode::Inactive,
            palpate::DeviceMode::Held(grasp),
            palpate::DeviceMode::Touch,
            palpate::DeviceMode::Force(palpate::AppliedForce { grasp, force: self.force.into() }),
            palpate::DeviceMode::Suspended,
        ];
        let mode = chosen(&modes, self.mode, "mode of a device")?;
        Ok(palpate::DeviceInput { position: self.position.into(), mode })
    }
}

impl From<&palpate::DeviceOutput> for DeviceOutput {
    fn from(output: &palpate::DeviceOutput) -> Self {
        Self { force_on_hand: output.force_on_hand.into(), proxy: output.proxy.into() }
    }
}

impl From<&palpate::ClampOutput> for ClampOutput {
    fn from(output: &palpate::ClampOutput) -> Self {
        Self { force: output.force.into(), torque: output.torque.into() }
    }
}

impl From<&palpate::ObstacleOutput> for ObstacleOutput {
    fn from(output: &palpate::ObstacleOutput) -> Self {
        Self { force: output.force.into(), torque: output.torque.into() }
    }
}

impl From<&palpate::EnergyLedger> for Energy {
    fn from(ledger: &palpate::EnergyLedger) -> Self {
        let &palpate::EnergyLedger {
            kinetic,
            elastic,
            residual,
            potential,
            coupling,
            input,
            dissipated,
            friction,
            impact,
            defect,
        } = ledger;
        Self { kinetic, elastic, residual, potential, coupling, input, dissipated, friction, impact, defect }
    }
}

impl From<&palpate::ObjectOutput> for ObjectOutput {
    fn from(output: &palpate::ObjectOutput) -> Self {
        Self {
            pose: output.pose.into(),
            velocity: output.twist.linear.into(),
            angular_velocity: output.twist.angular.into(),
            force: output.force.into(),
            torque: output.torque.into(),
            energy: (&output.energy).into(),
            penetration_m: output.penetration_m,
            is_asleep: output.is_asleep,
        }
    }
}

impl From<&palpate::ContactOutput> for ContactOutput {
    fn from(output: &palpate::ContactOutput) -> Self {
        let (against, against_number) = match output.against {
            palpate::Collider::Device(number) => (Collider::Device, number),
            palpate::Collider::Obstacle(number) => (Collider::Obstacle, number),
            palpate::Collider::Object(number) => (Collider::Object, number),
        };
        Self {
            object: output.object,
            against,
            against_number,
            point: output.point.into(),
            normal: output.normal.into(),
            force: output.force.into(),
            gap: output.gap,
            slip_speed: output.slip_speed,
        }
    }
}

impl From<&palpate::StepStatus> for StepStatus {
    fn from(status: &palpate::StepStatus) -> Self {
        let &palpate::StepStatus {
            solver_residual_m,
            iterations,
            rejected_inputs,
            dependent_rows,
            unsolved_islands,
            islands_out_of_budget,
            dropped_contacts,
        } = status;
        Self {
            solver_residual_m,
            iterations,
            rejected_inputs,
            dependent_rows,
            unsolved_islands,
            islands_out_of_budget,
            dropped_contacts,
        }
    }
}
