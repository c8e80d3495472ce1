//! Force Dimension devices, through the DHD library of their SDK, loaded at run time.
//!
//! The vendor's frame has x towards the operator, y to the right and z up, in metres and newtons: device frame = (y, z, x). Calls
//! block until the device answers; the haptic update makes them itself, as the SDK intends. A device that fails for [`LOST_S`] is
//! closed, and opened again as soon as it is back, which blocks as long as the SDK takes. Devices must have been initialised with
//! the vendor's tools, or they report no position.

use super::driver::{DiscoveredDevice, select};
use super::library::{LibraryFiles, Vendor, functions};
use super::{Device, DeviceSpec, Reading, handle_orientation};
use crate::error::{DeviceError, Error};
use crate::safety_limits::SafetyLimits;
use glam::{DMat3, DVec3};
use std::ffi::{CStr, c_char, c_double, c_int, c_uchar, c_uint, c_ushort};
use std::time::{Duration, Instant};

pub(super) static VENDOR: Vendor = Vendor {
    driver: "dhd",
    files: LibraryFiles {
        linux: &["libdhd.so", "libdhd.so.3"],
        macos: &["libdhd.dylib", "libdhd.3.dylib"],
        windows: &["dhd64.dll", "dhd.dll"],
    },
    software: "Force Dimension's SDK (3.3 or later)",
    variable: "PALPATE_LIBDHD",
};

/// Time of failures after which a device counts as lost [s].
const LOST_S: f64 = 0.1;

/// Interval between attempts to reopen a lost device [s].
const RETRY_INTERVAL_S: f64 = 1.0;

/// Watchdog of the device: time without a command after which its firmware disables forces. It is above the 20 ms from one update to
/// the next at the lowest rate (50 Hz), and at most 255 units.
const WATCHDOG: Duration = Duration::from_millis(30);

/// Unit of the watchdog [µs].
const WATCHDOG_UNIT_MICROS: u128 = 125;

const OFF: c_uchar = 0;
const ON: c_uchar = 1;

functions! {
    /// Functions of the library (dhdc.h). The device's id comes last.
    struct Functions {
        dhdGetDeviceCount: fn() -> c_int,
        dhdOpenID: fn(c_char) -> c_int,
        dhdClose: fn(c_char) -> c_int,
        dhdGetSystemName: fn(c_char) -> *const c_char,
        dhdGetSerialNumber: fn(*mut c_ushort, c_char) -> c_int,
        dhdHasWrist: fn(c_char) -> bool,
        dhdEnableForce: fn(c_uchar, c_char) -> c_int,
        dhdGetPosition: fn(*mut c_double, *mut c_double, *mut c_double, c_char) -> c_int,
        dhdGetOrientationFrame: fn(*mut [[c_double; 3]; 3], c_char) -> c_int,
        dhdGetButtonMask: fn(c_char) -> c_uint,
        dhdSetForceAndTorqueAndGripperForce:
            fn(c_double, c_double, c_double, c_double, c_double, c_double, c_double, c_char) -> c_int,
        dhdErrorGetLastStr: fn() -> *const c_char,
    }
}

/// Loaded library.
#[derive(Clone, Copy)]
struct Dhd {
    functions: Functions,
    /// `dhdGetMaxForce`, missing in old versions.
    max_force: Option<unsafe extern "C" fn(c_char) -> c_double>,
    /// `dhdSetWatchdog`, missing before version 3.3.2.
    set_watchdog: Option<unsafe extern "C" fn(c_uchar, c_char) -> c_int>,
}

/// Open device.
pub(super) struct ForceDimension {
    dhd: Dhd,
    found: DiscoveredDevice,
    /// Id of the open device; `None` while it is lost.
    id: Option<c_char>,
    wrist: bool,
    spec: DeviceSpec,
    failing_since: Option<f64>,
    next_try_s: f64,
    /// Time before the last command; `None` before the first.
    commanded: Option<Instant>,
    /// Whether the watchdog may have disabled forces.
    may_be_off: bool,
}

/// Connected devices.
pub(super) fn find(location: Option<&str>) -> Result<Vec<DiscoveredDevice>, Error> {
    Dhd::load(location)?.find()
}

/// Opens a device by its serial number or index.
pub(super) fn open(which: &str, location: Option<&str>) -> Result<(DiscoveredDevice, ForceDimension), Error> {
    let dhd = Dhd::load(location)?;
    let found = select("dhd", &dhd.find()?, which)?.clone();
    if let Some(reason) = found.unavailable.clone() {
        return Err(DeviceError::Unavailable { driver: "dhd", device: found.to_string(), reason }.into());
    }
    let (id, wrist) = dhd.open(found.index)?;
    let device = ForceDimension {
        dhd,
        spec: spec(&found),
        found: found.clone(),
        id: Some(id),
        wrist,
        failing_since: None,
        next_try_s: f64::NEG_INFINITY,
        commanded: None,
        may_be_off: false,
    };
    Ok((found, device))
}

/// Specification of a device: the vendor's force limit where known, a careful one for unknown models.
fn spec(found: &DiscoveredDevice) -> DeviceSpec {
    let known = if found.name.to_lowercase().starts_with("omega") {
        DeviceSpec::OMEGA_3.force_n
    } else {
        f64::INFINITY
    };
    let limit = found.force_n.unwrap_or(f64::INFINITY).min(known);
    let force_n = if limit.is_finite() { limit } else { SafetyLimits::default().force_n };
    DeviceSpec { kind: "dhd", force_n, ..DeviceSpec::OMEGA_3 }
}

/// Position or force in the device frame from the vendor's frame.
fn ours_from_dhd(v: DVec3) -> DVec3 {
    DVec3::new(v.y, v.z, v.x)
}

/// Position or force in the vendor's frame from the device frame.
fn dhd_from_ours(v: DVec3) -> DVec3 {
    DVec3::new(v.z, v.x, v.y)
}

impl Dhd {
    fn load(location: Option<&str>) -> Result<Self, Error> {
        let loaded = VENDOR.load(location)?;
        // SAFETY: the type is that of the vendor's published header.
        let max_force = unsafe { loaded.function("dhdGetMaxForce") }.ok();
        // SAFETY: as above.
        let set_watchdog = unsafe { loaded.function("dhdSetWatchdog") }.ok();
        Ok(Self { functions: Functions::of(&loaded)?, max_force, set_watchdog })
    }

    fn find(&self) -> Result<Vec<DiscoveredDevice>, Error> {
        // SAFETY: a plain call without arguments.
        let count = unsafe { (self.functions.dhdGetDeviceCount)() };
        if count < 1 {
            let message =
                "there is no device: connect one and switch it on (and see that USB devices may be opened)";
            return Err(DeviceError::NoDevice { driver: "dhd", message: message.to_string() }.into());
        }
        Ok((0..count as usize).map(|index| self.inspect(index)).collect())
    }

    /// Description of the device with an index.
    fn inspect(&self, index: usize) -> DiscoveredDevice {
        // SAFETY: a plain call; an invalid index is refused.
        let id = unsafe { (self.functions.dhdOpenID)(index as c_char) };
        if id < 0 {
            let unavailable = Some(self.last_error());
            return DiscoveredDevice {
                name: "a device".into(),
                index,
                serial: None,
                force_n: None,
                unavailable,
            };
        }
        let found = self.describe(index, id as c_char);
        // SAFETY: the device was opened above.
        unsafe { (self.functions.dhdClose)(id as c_char) };
        found
    }

    /// Description of an open device.
    fn describe(&self, index: usize, id: c_char) -> DiscoveredDevice {
        let mut serial: c_ushort = 0;
        // SAFETY: the device is open; the memory for the serial outlives the call.
        let (name, has_serial, force_n) = unsafe {
            let name = text((self.functions.dhdGetSystemName)(id));
            let has_serial = (self.functions.dhdGetSerialNumber)(&raw mut serial, id) >= 0;
            (name, has_serial, self.max_force.map(|max_force| max_force(id)))
        };
        DiscoveredDevice {
            name: name.unwrap_or_else(|| "a device".into()),
            index,
            serial: has_serial.then(|| serial.to_string()),
            // A negative value means no limit.
            force_n: force_n.filter(|force| force.is_finite() && *force > 0.0),
            unavailable: None,
        }
    }

    /// Opens a device, with forces enabled and zero, and its watchdog set. Returns its id and whether it has a wrist.
    fn open(&self, index: usize) -> Result<(c_char, bool), Error> {
        // SAFETY: a plain call; an invalid index is refused.
        let id = unsafe { (self.functions.dhdOpenID)(index as c_char) };
        if id < 0 {
            return Err(self.call_error("open the device"));
        }
        let id = id as c_char;
        // SAFETY: the device is open.
        let (wrist, on) =
            unsafe { ((self.functions.dhdHasWrist)(id), (self.functions.dhdEnableForce)(ON, id)) };
        let ready =
            if on < 0 { Err(self.call_error("switch forces on")) } else { self.command(id, DVec3::ZERO) };
        if let Err(error) = ready {
            // SAFETY: the device is open, and not used after.
            unsafe { (self.functions.dhdClose)(id) };
            return Err(error);
        }
        if let Some(set_watchdog) = self.set_watchdog {
            let units = (WATCHDOG.as_micros() / WATCHDOG_UNIT_MICROS) as c_uchar;
            // SAFETY: the device is open. Devices without a watchdog refuse, and go on.
            unsafe { set_watchdog(units, id) };
        }
        Ok((id, wrist))
    }

    /// Commands zero force, and enables forces again.
    fn enable_again(&self, id: c_char) -> Result<(), Error> {
        self.command(id, DVec3::ZERO)?;
        // SAFETY: a plain call with an open device.
        if unsafe { (self.functions.dhdEnableForce)(ON, id) } < 0 {
            return Err(self.call_error("switch forces on"));
        }
        Ok(())
    }

    /// Commands a force [N, vendor's frame], with zero torque and gripper force.
    fn command(&self, id: c_char, force: DVec3) -> Result<(), Error> {
        let [x, y, z] = force.to_array();
        // SAFETY: a plain call with an open device.
        let done =
            unsafe { (self.functions.dhdSetForceAndTorqueAndGripperForce)(x, y, z, 0.0, 0.0, 0.0, 0.0, id) };
        // Positive results are warnings: a motor at its limit, or a repeated reading.
        if done < 0 { Err(self.call_error("set the force")) } else { Ok(()) }
    }

    /// Message of the library's last error.
    fn last_error(&self) -> String {
        // SAFETY: a plain call; it gives a text of the library's, or nothing.
        text(unsafe { (self.functions.dhdErrorGetLastStr)() }).unwrap_or_else(|| "it does not say why".into())
    }

    fn call_error(&self, what: &str) -> Error {
        let call = format!("can't {what}");
        DeviceError::Call { driver: "dhd", call, reason: self.last_error() }.into()
    }
}

/// Text from the library; `None` for a null pointer.
fn text(text: *const c_char) -> Option<String> {
    // SAFETY: the library gives texts that end with 0 and stay, or nothing.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned())
}

impl ForceDimension {
    /// Reads position, orientation and buttons of the open device.
    fn read_open(&self, id: c_char) -> Result<Reading, Error> {
        let Functions { dhdGetPosition, dhdGetButtonMask, dhdGetOrientationFrame, .. } = self.dhd.functions;
        let mut position = DVec3::NAN;
        // SAFETY: the device is open; the memory for the numbers outlives the call.
        let result =
            unsafe { dhdGetPosition(&raw mut position.x, &raw mut position.y, &raw mut position.z, id) };
        if result < 0 {
            return Err(self.dhd.call_error("read the position"));
        }
        let mut orientation = None;
        if self.wrist {
            let mut rows = [[f64::NAN; 3]; 3];
            // SAFETY: the device is open; the matrix outlives the call.
            if unsafe { dhdGetOrientationFrame(&raw mut rows, id) } < 0 {
                return Err(self.dhd.call_error("read the orientation"));
            }
            orientation = handle_orientation(DMat3::from_cols_array_2d(&rows).transpose(), ours_from_dhd);
        }
        // SAFETY: a plain call with an open device.
        let buttons = unsafe { dhdGetButtonMask(id) };
        Ok(Reading { position: ours_from_dhd(position), orientation, buttons })
    }

    /// Reopens a lost device, if it is back and has the same serial number.
    fn reopen(&mut self, now_s: f64) -> Result<c_char, Error> {
        if now_s < self.next_try_s {
            return Err(self.disconnected());
        }
        self.next_try_s = now_s + RETRY_INTERVAL_S;
        // SAFETY: a plain call without arguments.
        if unsafe { (self.dhd.functions.dhdGetDeviceCount)() } <= self.found.index as c_int {
            return Err(self.disconnected());
        }
        let (id, wrist) = self.dhd.open(self.found.index)?;
        if self.dhd.describe(self.found.index, id).serial != self.found.serial {
            // SAFETY: the device was opened above, and is not used after.
            unsafe { (self.dhd.functions.dhdClose)(id) };
            return Err(self.disconnected());
        }
        (self.id, self.wrist) = (Some(id), wrist);
        Ok(id)
    }

    fn disconnected(&self) -> Error {
        DeviceError::Disconnected { driver: "dhd", device: self.found.to_string() }.into()
    }

    /// Commands zero force, disables forces and closes the device.
    fn close(&mut self) {
        let Some(id) = self.id.take() else { return };
        // If this fails, disabling forces below still stops them.
        let _ = self.dhd.command(id, DVec3::ZERO);
        // SAFETY: the device is open, and not used after.
        unsafe {
            (self.dhd.functions.dhdEnableForce)(OFF, id);
            (self.dhd.functions.dhdClose)(id);
        }
    }
}

impl Device for ForceDimension {
    fn spec(&self) -> DeviceSpec {
        self.spec
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        let id = self.id.map_or_else(|| self.reopen(now_s), Ok)?;
        let read = self.read_open(id);
        match &read {
            Ok(_) => self.failing_since = None,
            Err(_) if now_s - *self.failing_since.get_or_insert(now_s) > LOST_S => {
                self.close();
                self.failing_since = None;
                // The next reading opens it again, which may take long.
                return Err(self.disconnected());
            }
            Err(_) => {}
        }
        read
    }

    fn set_force(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        let force = if force.is_finite() { force } else { DVec3::ZERO };
        let Some(id) = self.id else {
            // A lost device gives no force.
            return if force == DVec3::ZERO { Ok(()) } else { Err(self.disconnected()) };
        };
        let before = self.commanded.replace(Instant::now());
        let is_late = || before.is_some_and(|time| time.elapsed() > WATCHDOG);
        let done = if self.may_be_off || is_late() {
            // Forces come back from zero.
            self.may_be_off = false;
            self.dhd.enable_again(id)
        } else {
            self.dhd.command(id, dhd_from_ours(force))
        };
        // The command itself may have been late, and was not heard.
        self.may_be_off |= is_late();
        done
    }
}

impl Drop for ForceDimension {
    fn drop(&mut self) {
        self.close();
    }
}
