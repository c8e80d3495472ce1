//! Devices behind one small interface: a position in, a force out.
//!
//! Every driver speaks SI units in the device's frame as palpate takes it: x to the right of the user, y up, z towards the
//! user. A [`Mount`] says where that frame is in the world. A [`Driver`] speaks to a real device, through its maker's software.

mod dhd;
mod driver;
mod exchange;
mod haply;
mod library;
mod openhaptics;
mod scripted;
mod simulated;

pub use driver::{Driver, Found, discover};
pub use scripted::Scripted;
pub use simulated::{Hand, Simulated};

use crate::error::Error;
use glam::{DMat3, DQuat, DVec3};
use palpate::Pose;

/// What a device reads.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reading {
    /// Interface point [m, device frame].
    pub position: DVec3,
    /// How the handle is turned, for devices that tell.
    pub orientation: Option<DQuat>,
    /// Pressed buttons, one bit each.
    pub buttons: u32,
}

/// A device that pushes a hand. Calls come from one thread, `read` and `push` in turns.
pub trait Device: Send {
    /// What it is.
    fn traits(&self) -> Traits;

    /// Where the hand is now, at a time [s] since the start of all processes.
    ///
    /// # Errors
    /// When the device can't tell; it is asked again at the next update.
    fn read(&mut self, now_s: f64) -> Result<Reading, Error>;

    /// Push the hand with a force [N, device frame] until the next call.
    ///
    /// # Errors
    /// When the device can't be reached.
    fn push(&mut self, force: DVec3, now_s: f64) -> Result<(), Error>;
}

/// What a device is, as its maker tells.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traits {
    /// Its kind.
    pub kind: &'static str,
    /// Largest force [N] that it gives for long; infinite for one that pushes nobody.
    pub force_n: f64,
    /// Effective mass at the handle [kg].
    pub mass_kg: f64,
    /// Coulomb friction at the handle [N].
    pub friction_n: f64,
    /// Viscous damping at the handle [N·s/m].
    pub damping_n_s_m: f64,
    /// Smallest movement [m] that it tells.
    pub resolution_m: f64,
}

impl Traits {
    /// No device: nothing is pushed.
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

    /// The devices that are known by name.
    pub const KNOWN: [Self; 3] = [Self::TOUCH, Self::OMEGA_3, Self::INVERSE_3];

    /// One of [`Self::KNOWN`].
    pub fn named(kind: &str) -> Option<Self> {
        Self::KNOWN.into_iter().find(|traits| traits.kind == kind)
    }
}

/// Where a device's frame is in the world, and how much larger its movements are there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mount {
    /// World from device, lengths apart.
    pub pose: Pose,
    /// Lengths in the world per length of the device. Forces stay as they are.
    pub scale: f64,
}

impl Default for Mount {
    fn default() -> Self {
        Self { pose: Pose::IDENTITY, scale: 1.0 }
    }
}

impl Mount {
    /// A place [m, world] from one in the device's frame.
    pub fn world_from_device(&self, position: DVec3) -> DVec3 {
        self.pose.world_from_body(position * self.scale)
    }

    /// A force in the device's frame from one in the world [N].
    pub fn device_force(&self, force: DVec3) -> DVec3 {
        self.pose.orientation.inverse() * force
    }

    /// How a handle is turned in the world.
    pub fn world_orientation(&self, orientation: DQuat) -> DQuat {
        self.pose.orientation * orientation
    }
}

/// How a handle is turned, from its axes in a vendor's frame. The handle's own axes are renamed alike, so that one that is not
/// turned there is not turned here. None for what is no rotation.
fn handle_turned(axes: DMat3, ours_from_theirs: fn(DVec3) -> DVec3) -> Option<DQuat> {
    let square = axes * axes.transpose() - DMat3::IDENTITY;
    let rotation = square.to_cols_array().iter().all(|x| x.abs() < NO_ROTATION) && axes.determinant() > 0.0;
    if !rotation {
        return None;
    }
    let turned = DQuat::from_mat3(&axes);
    quaternion_turned(DVec3::new(turned.x, turned.y, turned.z), turned.w, ours_from_theirs)
}

/// The same from a quaternion's vector and scalar.
fn quaternion_turned(vector: DVec3, scalar: f64, ours_from_theirs: fn(DVec3) -> DVec3) -> Option<DQuat> {
    let turned = DQuat::from_vec4(ours_from_theirs(vector).extend(scalar));
    let length = turned.length();
    ((length - 1.0).abs() < NO_ROTATION).then(|| turned / length)
}

/// Farther from a rotation than this (numbers of single precision, and sensors, are off a little) is garbage.
const NO_ROTATION: f64 = 1e-2;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mount_turns_places_and_turns_forces_back() {
        let quarter = DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2);
        let mount = Mount { pose: Pose { position: DVec3::X, orientation: quarter }, scale: 2.0 };
        let place = mount.world_from_device(DVec3::new(0.1, 0.0, 0.0));
        assert!((place - DVec3::new(1.0, 0.2, 0.0)).length() < 1e-15, "{place}");
        let force = mount.device_force(DVec3::Y);
        assert!((force - DVec3::X).length() < 1e-15, "{force}");
    }

    #[test]
    fn axes_that_are_renamed_turn_handles_alike_and_garbage_does_not() {
        // A quarter turn about their x, which is our z.
        let turned = handle_turned(DMat3::from_rotation_x(1.0), |v| DVec3::new(v.y, v.z, v.x));
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
        assert!(garbage.into_iter().all(|axes| handle_turned(axes, |v| v).is_none()));
        assert_eq!(quaternion_turned(DVec3::NAN, 1.0, |v| v), None);
    }

    #[test]
    fn known_devices_are_found_by_name() {
        assert_eq!(Traits::named("omega.3").map(|traits| traits.force_n), Some(12.0));
        assert_eq!(Traits::named("nobody"), None);
    }
}
