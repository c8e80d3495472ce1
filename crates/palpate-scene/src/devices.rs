//! Devices by name: drivers of real devices, traits of simulated ones, grips of a hand.

use palpate_haptics::SafetyLimits;
use palpate_haptics::device::{DeviceSpec, Driver, Hand, Mount};

/// Real device with its limits.
#[derive(Debug, Clone)]
pub struct RealDevice {
    /// Driver.
    pub driver: Driver,
    /// Device of the driver: a number from 0, or a name.
    pub id: String,
    /// Pose and scale of its frame in the world.
    pub mount: Mount,
    /// Force limit [N]; none for the default of [`SafetyLimits`](palpate_haptics::SafetyLimits).
    pub max_force_n: Option<f64>,
    /// Safety limits; `max_force_n` replaces that of the force.
    pub limits: SafetyLimits,
    /// Whether forces are on from the start; otherwise from the press of a button.
    pub armed: bool,
}

/// Upper bound of force limits [N].
pub const MAX_FORCE_N: f64 = 100.0;

/// Grips of a hand on a device, and none, by name.
pub const ANY_HAND: [(&str, Option<Hand>); 4] = [
    ("let go", None),
    ("fingertip", Some(Hand::FINGERTIP)),
    ("light", Some(Hand::LIGHT)),
    ("firm", Some(Hand::FIRM)),
];

/// Driver by name.
///
/// # Errors
/// A message with the known names.
pub fn find_driver(name: &str) -> Result<Driver, String> {
    let known = || Driver::ALL.map(|driver| format!("{:?}", driver.name())).join(", ");
    Driver::named(name).ok_or_else(|| format!("driver is {name:?}, expected one of {}", known()))
}

/// Device traits by name.
///
/// # Errors
/// A message with the known names.
pub fn find_device_traits(name: &str) -> Result<DeviceSpec, String> {
    let known = || DeviceSpec::KNOWN.map(|traits| format!("{:?}", traits.kind)).join(", ");
    DeviceSpec::named(name).ok_or_else(|| format!("device is {name:?}, expected one of {}", known()))
}

/// Hand by the name of its grip.
///
/// # Errors
/// A message with the known names.
pub fn find_grip(name: &str) -> Result<Hand, String> {
    match name {
        "firm" => Ok(Hand::FIRM),
        "light" => Ok(Hand::LIGHT),
        "fingertip" => Ok(Hand::FINGERTIP),
        other => Err(format!("grip is {other:?}, expected \"firm\", \"light\" or \"fingertip\"")),
    }
}
