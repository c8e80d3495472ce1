//! Haptic devices behind one interface: position in, force out.
//!
//! All quantities are in SI units and in the device frame: x to the right of the user, y up, z towards the user. A [`Mount`] places
//! that frame in the world. A [`Driver`] talks to a real device through the vendor's software.

#[cfg(feature = "real-time")]
mod dhd;
mod driver;
#[cfg(feature = "real-time")]
mod exchange;
#[cfg(feature = "real-time")]
mod haply;
#[cfg(feature = "real-time")]
mod library;
#[cfg(feature = "real-time")]
mod openhaptics;
mod path;
mod simulated;

#[cfg(feature = "real-time")]
pub use driver::discover;
pub use driver::{DiscoveredDevice, Driver};
pub use path::PathDevice;
pub use simulated::{Hand, SimulatedDevice};

use crate::error::Error;
use glam::{DMat3, DQuat, DVec3};
use palpate::Pose;

/// Reading of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Interface point [m, device frame].
    pub position: DVec3,
    /// Orientation of the handle, for devices that measure it: device frame from handle.
    pub orientation: Option<DQuat>,
    /// Pressed buttons, one bit each.
    pub buttons: u32,
}

/// Haptic device. All calls come from one thread, `read` and `set_force` alternately.
pub trait Device: Send {
    /// Specification.
    fn spec(&self) -> DeviceSpec;

    /// Reads the device at a time [s] since the start of all processes.
    ///
    /// # Errors
    /// If the device fails. It is read again at the next update.
    fn read(&mut self, now_s: f64) -> Result<Reading, Error>;

    /// Commands a force on the hand [N, device frame], held until the next call (zero-order hold).
    ///
    /// # Errors
    /// If the device can't be reached.
    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), Error>;
}

/// Specification of a device, from its data sheet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceSpec {
    /// Kind of device.
    pub kind: &'static str,
    /// Largest continuous force [N]; infinite for a device without force feedback.
    pub force_n: f64,
    /// Effective mass at the handle [kg].
    pub mass_kg: f64,
    /// Coulomb friction at the handle [N].
    pub friction_n: f64,
    /// Viscous damping at the handle [N·s/m].
    pub damping_n_s_m: f64,
    /// Resolution of the encoder at the handle [m].
    pub resolution_m: f64,
}

impl DeviceSpec {
    /// Specification of no device: without force feedback.
    pub const NONE: Self = Self {
        kind: "none",
        force_n: f64::INFINITY,
        mass_kg: 0.05,
        friction_n: 0.0,
        damping_n_s_m: 0.0,
        resolution_m: 0.0,
    };

    /// 3D Systems Touch, the successor of the paper's PHANToM (data sheet: 3.3 N, 45 g, 0.26 N, 450 dpi; damping estimated).
    pub const TOUCH: Self = Self {
        kind: "touch",
        force_n: 3.3,
        mass_kg: 0.045,
        friction_n: 0.26,
        damping_n_s_m: 0.005,
        resolution_m: 55e-6,
    };

    /// Force Dimension omega.3 (data sheet: 12 N, below 0.01 mm; mass, friction and damping estimated).
    pub const OMEGA_3: Self = Self {
        kind: "omega.3",
        force_n: 12.0,
        mass_kg: 0.2,
        friction_n: 0.1,
        damping_n_s_m: 0.1,
        resolution_m: 9e-6,
    };

    /// Haply Inverse3 (data sheet: 10 N at most, 0.01 mm; mass, friction and damping estimated).
    pub const INVERSE_3: Self = Self {
        kind: "inverse3",
        force_n: 10.0,
        mass_kg: 0.1,
        friction_n: 0.15,
        damping_n_s_m: 0.05,
        resolution_m: 10e-6,
    };

    /// Specifications that are known by name.
    pub const KNOWN: [Self; 3] = [Self::TOUCH, Self::OMEGA_3, Self::INVERSE_3];

    /// Specification of [`Self::KNOWN`] with a kind.
    pub fn named(kind: &str) -> Option<Self> {
        Self::KNOWN.into_iter().find(|spec| spec.kind == kind)
    }
}

/// Mount: pose of the device frame in the world, and scale of its movements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// World from device frame, without the scale.
    pub pose: Pose,
    /// Metres in the world per metre of the device. Forces are not scaled.
    pub scale: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self { pose: Pose::IDENTITY, scale: 1.0 }
    }
}

impl Mount {
    /// Position [m, world] from one in the device frame [m].
    pub fn world_from_device(&self, position: DVec3) -> DVec3 {
        self.pose.world_from_body(position * self.scale)
    }

    /// Force in the device frame [N] from one in the world [N].
    pub fn device_force(&self, force: DVec3) -> DVec3 {
        self.pose.orientation.inverse() * force
    }

    /// Orientation in the world from one in the device frame.
    pub fn world_orientation(&self, orientation: DQuat) -> DQuat {
        self.pose.orientation * orientation
    }
}

/// Orientation of a handle from its axes in a vendor's frame. The handle's axes are permuted like the frame's, so that the identity
/// stays the identity. `None` if the axes are no rotation.
fn handle_orientation(axes: DMat3, ours_from_theirs: fn(DVec3) -> DVec3) -> Option<DQuat> {
    let square = axes * axes.transpose() - DMat3::IDENTITY;
    let rotation =
        square.to_cols_array().iter().all(|x| x.abs() < ROTATION_TOLERANCE) && axes.determinant() > 0.0;
    if !rotation {
        return None;
    }
    let q = DQuat::from_mat3(&axes);
    orientation_from_quaternion(DVec3::new(q.x, q.y, q.z), q.w, ours_from_theirs)
}

/// Orientation of a handle from the vector and scalar part of a quaternion in a vendor's frame; `None` if its length is not 1.
fn orientation_from_quaternion(
    vector: DVec3,
    scalar: f64,
    ours_from_theirs: fn(DVec3) -> DVec3,
) -> Option<DQuat> {
    let q = DQuat::from_vec4(ours_from_theirs(vector).extend(scalar));
    let length = q.length();
    ((length - 1.0).abs() < ROTATION_TOLERANCE).then(|| q / length)
}

/// Largest deviation from a rotation, in any entry of R·Rᵀ − 1 or in a quaternion's length: single precision and sensors are off a
/// little, anything else is garbage.
const ROTATION_TOLERANCE: f64 = 1e-2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_transforms_positions_forwards_and_forces_back() {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let mount = Mount { pose: Pose { position: DVec3::X, orientation: quarter }, scale: 2.0 };
        let position = mount.world_from_device(DVec3::new(0.1, 0.0, 0.0));
        assert!((position - DVec3::new(1.0, 0.2, 0.0)).length() < 1e-15, "{position}");
        let force = mount.device_force(DVec3::Y);
        assert!((force - DVec3::X).length() < 1e-15, "{force}");
    }

    #[test]
    fn permuted_axes_permute_rotations_and_garbage_is_refused() {
        // A quarter turn about their x, which is our z.
        let turned = handle_orientation(DMat3::from_rotation_x(1.0), |v| DVec3::new(v.y, v.z, v.x));
        assert!(
            turned.is_some_and(|turned| turned.angle_between(DQuat::from_rotation_z(1.0)) < 1e-12),
            "{turned:?}"
        );
        let garbage = [
            DMat3::ZERO,
            DMat3::NAN,
            DMat3::IDENTITY * 2.0,
            DMat3::from_diagonal(DVec3::new(1.0, 1.0, -1.0)),
        ];
        assert!(garbage.into_iter().all(|axes| handle_orientation(axes, |v| v).is_none()));
        assert_eq!(orientation_from_quaternion(DVec3::NAN, 1.0, |v| v), None);
    }

    #[test]
    fn known_devices_are_found_by_name() {
        assert_eq!(DeviceSpec::named("omega.3").map(|spec| spec.force_n), Some(12.0));
        assert_eq!(DeviceSpec::named("nobody"), None);
    }
}
