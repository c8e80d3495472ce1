//! Options of a real device.

use crate::failure::Failure;
use clap::Args;
use glam::DVec3;
use palpate::Pose;
use palpate_haptics::device::Mount;
use palpate_haptics::{SafetyLimits, unit_quaternion};
use palpate_scene::{MAX_FORCE_N, RealDevice, find_driver};

/// Real device, instead of a path.
#[derive(Args, Debug, Clone)]
pub struct RealArguments {
    /// Driver of a real device: openhaptics, dhd or haply (`palpate devices` lists the devices)
    #[arg(long, value_name = "DRIVER", conflicts_with_all = ["path", "simulated"])]
    pub driver: Option<String>,
    /// Which one: its number from 0 (0 by default), its serial, or (openhaptics) the name of its configuration
    #[arg(long, value_name = "DEVICE")]
    pub which: Option<String>,
    /// Position of the device frame [m, world]
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    pub mount_position: Vec<f64>,
    /// Orientation of the device frame (x right, y up, z towards the user) in the world
    #[arg(long, value_name = "W,X,Y,Z", value_delimiter = ',', allow_hyphen_values = true)]
    pub mount_orientation: Vec<f64>,
    /// Scale from the device to the world; by default 1
    #[arg(long, value_name = "SCALE", allow_negative_numbers = true)]
    pub mount_scale: Option<f64>,
    /// Force limit [N], within that of the device; by default 3
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub force: Option<f64>,
    /// Enable forces from the start, without pressing a button
    #[arg(long)]
    pub armed: bool,
}

impl RealArguments {
    /// Real device with limits, if given.
    pub fn real(&self, limits: SafetyLimits) -> Result<Option<RealDevice>, Failure> {
        let Some(driver) = &self.driver else { return self.refuse().map(|()| None) };
        let driver = find_driver(driver).map_err(|what| Failure(format!("--{what}")))?;
        if let Some(force) = self.force.filter(|force| !(*force > 0.0 && *force < MAX_FORCE_N)) {
            return Err(Failure(format!("--force is {force} N, expected above 0 and below {MAX_FORCE_N}")));
        }
        let (id, mount) = (self.which.clone().unwrap_or("0".into()), self.mount()?);
        Ok(Some(RealDevice { driver, id, mount, max_force_n: self.force, limits, armed: self.armed }))
    }

    /// Refuses options that need a driver: clap would not, since the driver conflicts with the path.
    fn refuse(&self) -> Result<(), Failure> {
        let options = [
            (self.which.is_some(), "--which"),
            (!self.mount_position.is_empty(), "--mount-position"),
            (!self.mount_orientation.is_empty(), "--mount-orientation"),
            (self.mount_scale.is_some(), "--mount-scale"),
            (self.force.is_some(), "--force"),
            (self.armed, "--armed"),
        ];
        match options.iter().find(|(given, _)| *given) {
            Some((_, option)) => Err(Failure(format!("{option} is of a real device: name its --driver"))),
            None => Ok(()),
        }
    }

    fn mount(&self) -> Result<Mount, Failure> {
        let Self { mount_position, mount_orientation, mount_scale, .. } = self;
        let scale = mount_scale.unwrap_or(1.0);
        let mut pose = Pose::IDENTITY;
        match mount_position[..] {
            [] => {}
            [x, y, z] if DVec3::new(x, y, z).is_finite() => pose.position = DVec3::new(x, y, z),
            _ => {
                return Err(Failure(format!(
                    "--mount-position is {mount_position:?}, expected x,y,z in metres"
                )));
            }
        }
        match mount_orientation[..] {
            [] => {}
            [w, x, y, z] => {
                let turned = unit_quaternion(w, x, y, z);
                pose.orientation = turned.map_err(|what| Failure(format!("--mount-orientation: {what}")))?;
            }
            _ => {
                return Err(Failure(format!(
                    "--mount-orientation is {mount_orientation:?}, expected w,x,y,z"
                )));
            }
        }
        if !(scale > 0.0 && scale.is_finite()) {
            return Err(Failure(format!("--mount-scale is {scale}, expected above 0")));
        }
        Ok(Mount { pose, scale })
    }
}
