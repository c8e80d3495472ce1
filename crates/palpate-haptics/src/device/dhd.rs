//! Force Dimension devices by the DHD library of their SDK, loaded at run time.
//!
//! Its frame has x towards the operator, y to the right and z up, in metres and newtons: ours from its is (y, z, x). Calls go
//! to the device and wait for its answer; they are made by the haptic update itself, as the SDK means them to be. A device that
//! fails for [`LOST_S`] is closed and opened again as soon as it is back, which takes as long as the SDK takes. Devices must have
//! been initialised with the vendor's tools: before that they don't know where they are.

use super::driver::{Found, pick};
use super::library::{Vendor, functions};
use super::{Device, Reading, Traits, handle_turned};
use crate::error::Error;
use crate::safety::SafetyLimits;
use glam::{DMat3, DVec3};
use std::ffi::{CStr, c_char, c_double, c_int, c_uchar, c_uint, c_ushort};

pub(super) static VENDOR: Vendor = Vendor {
    driver: "dhd",
    files: &["libdhd.so", "libdhd.so.3"],
    software: "Force Dimension's SDK (3.3 or later)",
    variable: "PALPATE_LIBDHD",
};

/// A device that fails for so long [s] is lost.
const LOST_S: f64 = 0.1;

/// Between two attempts [s] to get it back.
const AGAIN_S: f64 = 1.0;

const OFF: c_uchar = 0;
const ON: c_uchar = 1;

functions! {
    /// What is called of the library (dhdc.h). A device's number comes last.
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

/// The library.
#[derive(Clone, Copy)]
struct Dhd {
    functions: Functions,
    /// Not in every version.
    max_force: Option<unsafe extern "C" fn(c_char) -> c_double>,
}

/// An open device.
pub(super) struct ForceDimension {
    dhd: Dhd,
    found: Found,
    /// The library's number for it, while it is open.
    id: Option<c_char>,
    wrist: bool,
    traits: Traits,
    failing_since: Option<f64>,
    next_try_s: f64,
}

/// What is there.
pub(super) fn find(place: Option<&str>) -> Result<Vec<Found>, Error> {
    Dhd::load(place)?.find()
}

/// Open one.
pub(super) fn open(which: &str, place: Option<&str>) -> Result<(Found, ForceDimension), Error> {
    let dhd = Dhd::load(place)?;
    let found = pick("dhd", &dhd.find()?, which)?.clone();
    if let Some(why) = &found.why_not {
        return Err(Error::Device(format!("dhd: {found} can't be had: {why}")));
    }
    let (id, wrist) = dhd.open(found.index)?;
    let device = ForceDimension {
        dhd,
        traits: traits(&found),
        found: found.clone(),
        id: Some(id),
        wrist,
        failing_since: None,
        next_try_s: f64::NEG_INFINITY,
    };
    Ok((found, device))
}

/// What a device is, with the vendor's force where that is told, and a careful one for a device that is not known here.
fn traits(found: &Found) -> Traits {
    let known =
        if found.name.to_lowercase().starts_with("omega") { Traits::OMEGA_3.force_n } else { f64::INFINITY };
    let told = found.force_n.unwrap_or(f64::INFINITY).min(known);
    let force_n = if told.is_finite() { told } else { SafetyLimits::default().force_n };
    Traits { kind: "dhd", force_n, ..Traits::OMEGA_3 }
}

/// The same place, or force, in our frame.
fn ours_from_dhd(v: DVec3) -> DVec3 {
    DVec3::new(v.y, v.z, v.x)
}

/// And back.
fn dhd_from_ours(v: DVec3) -> DVec3 {
    DVec3::new(v.z, v.x, v.y)
}

impl Dhd {
    fn load(place: Option<&str>) -> Result<Self, Error> {
        let loaded = VENDOR.load(place)?;
        // SAFETY: the type is that of the vendor's published header.
        let max_force = unsafe { loaded.function("dhdGetMaxForce") }.ok();
        Ok(Self { functions: Functions::of(&loaded)?, max_force })
    }

    fn find(&self) -> Result<Vec<Found>, Error> {
        // SAFETY: a plain call without arguments.
        let count = unsafe { (self.functions.dhdGetDeviceCount)() };
        if count < 1 {
            return Err(Error::Device(
                "dhd: there is no device: connect one and switch it on (and see that USB devices may be opened)".into(),
            ));
        }
        Ok((0..count as usize).map(|index| self.look(index)).collect())
    }

    /// What the device of an index is.
    fn look(&self, index: usize) -> Found {
        // SAFETY: a plain call; a number that is none is refused.
        let id = unsafe { (self.functions.dhdOpenID)(index as c_char) };
        if id < 0 {
            let why_not = Some(self.last_error());
            return Found { name: "a device".into(), index, serial: None, force_n: None, why_not };
        }
        let found = self.facts(index, id as c_char);
        // SAFETY: the device was opened above.
        unsafe { (self.functions.dhdClose)(id as c_char) };
        found
    }

    fn facts(&self, index: usize, id: c_char) -> Found {
        let mut serial: c_ushort = 0;
        // SAFETY: the device is open; the serial's place outlives the call.
        let (name, told, force_n) = unsafe {
            let name = text((self.functions.dhdGetSystemName)(id));
            let told = (self.functions.dhdGetSerialNumber)(&raw mut serial, id) >= 0;
            (name, told, self.max_force.map(|max_force| max_force(id)))
        };
        Found {
            name: name.unwrap_or_else(|| "a device".into()),
            index,
            serial: told.then(|| serial.to_string()),
            // Below 0 the library limits nothing.
            force_n: force_n.filter(|force| force.is_finite() && *force > 0.0),
            why_not: None,
        }
    }

    /// Open a device with forces on, and none given. Gives its number, and whether it has a wrist.
    fn open(&self, index: usize) -> Result<(c_char, bool), Error> {
        // SAFETY: a plain call; a number that is none is refused.
        let id = unsafe { (self.functions.dhdOpenID)(index as c_char) };
        if id < 0 {
            return Err(self.failed("open the device"));
        }
        let id = id as c_char;
        // SAFETY: the device is open.
        let (wrist, on) =
            unsafe { ((self.functions.dhdHasWrist)(id), (self.functions.dhdEnableForce)(ON, id)) };
        let ready = if on < 0 { Err(self.failed("switch forces on")) } else { self.push(id, DVec3::ZERO) };
        if let Err(error) = ready {
            // SAFETY: the device is open, and not used after.
            unsafe { (self.functions.dhdClose)(id) };
            return Err(error);
        }
        Ok((id, wrist))
    }

    /// A force [N] in the library's frame, with no torque and no force of the gripper.
    fn push(&self, id: c_char, force: DVec3) -> Result<(), Error> {
        let [x, y, z] = force.to_array();
        // SAFETY: a plain call with an open device.
        let done =
            unsafe { (self.functions.dhdSetForceAndTorqueAndGripperForce)(x, y, z, 0.0, 0.0, 0.0, 0.0, id) };
        // Above 0: given, with a motor at its limit, or from the last reading.
        if done < 0 { Err(self.failed("set the force")) } else { Ok(()) }
    }

    fn last_error(&self) -> String {
        // SAFETY: a plain call; it gives a text of the library's, or nothing.
        text(unsafe { (self.functions.dhdErrorGetLastStr)() }).unwrap_or_else(|| "it does not say why".into())
    }

    fn failed(&self, what: &str) -> Error {
        Error::Device(format!("dhd: can't {what}: {}", self.last_error()))
    }
}

/// A text of the library's.
fn text(text: *const c_char) -> Option<String> {
    // SAFETY: the library gives texts that end with 0 and stay, or nothing.
    (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned())
}

impl ForceDimension {
    fn ask(&self, id: c_char) -> Result<Reading, Error> {
        let Functions { dhdGetPosition, dhdGetButtonMask, dhdGetOrientationFrame, .. } = self.dhd.functions;
        let mut position = DVec3::NAN;
        // SAFETY: the device is open; the numbers' places outlive the call.
        let told =
            unsafe { dhdGetPosition(&raw mut position.x, &raw mut position.y, &raw mut position.z, id) };
        if told < 0 {
            return Err(self.dhd.failed("tell the position"));
        }
        let mut orientation = None;
        if self.wrist {
            let mut rows = [[f64::NAN; 3]; 3];
            // SAFETY: the device is open; the matrix outlives the call.
            if unsafe { dhdGetOrientationFrame(&raw mut rows, id) } < 0 {
                return Err(self.dhd.failed("tell the orientation"));
            }
            orientation = handle_turned(DMat3::from_cols_array_2d(&rows).transpose(), ours_from_dhd);
        }
        // SAFETY: a plain call with an open device.
        let buttons = unsafe { dhdGetButtonMask(id) };
        Ok(Reading { position: ours_from_dhd(position), orientation, buttons })
    }

    /// Get a lost device back, if it is the same.
    fn come_back(&mut self, now_s: f64) -> Result<c_char, Error> {
        let gone = || Error::Device(format!("dhd: {} is gone", self.found));
        if now_s < self.next_try_s {
            return Err(gone());
        }
        self.next_try_s = now_s + AGAIN_S;
        // SAFETY: a plain call without arguments.
        if unsafe { (self.dhd.functions.dhdGetDeviceCount)() } <= self.found.index as c_int {
            return Err(gone());
        }
        let (id, wrist) = self.dhd.open(self.found.index)?;
        if self.dhd.facts(self.found.index, id).serial != self.found.serial {
            // SAFETY: the device was opened above, and is not used after.
            unsafe { (self.dhd.functions.dhdClose)(id) };
            return Err(gone());
        }
        (self.id, self.wrist) = (Some(id), wrist);
        Ok(id)
    }

    fn close(&mut self) {
        let Some(id) = self.id.take() else { return };
        // Whatever fails here, nothing more can be done.
        let _ = self.dhd.push(id, DVec3::ZERO);
        // SAFETY: the device is open, and not used after.
        unsafe {
            (self.dhd.functions.dhdEnableForce)(OFF, id);
            (self.dhd.functions.dhdClose)(id);
        }
    }
}

impl Device for ForceDimension {
    fn traits(&self) -> Traits {
        self.traits
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        let id = self.id.map_or_else(|| self.come_back(now_s), Ok)?;
        let read = self.ask(id);
        match &read {
            Ok(_) => self.failing_since = None,
            Err(_) if now_s - *self.failing_since.get_or_insert(now_s) > LOST_S => {
                self.close();
                self.failing_since = None;
            }
            Err(_) => {}
        }
        read
    }

    fn push(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        let force = if force.is_finite() { force } else { DVec3::ZERO };
        match self.id {
            Some(id) => self.dhd.push(id, dhd_from_ours(force)),
            // A device that is gone pushes nobody.
            None if force == DVec3::ZERO => Ok(()),
            None => Err(Error::Device(format!("dhd: {} is gone", self.found))),
        }
    }
}

impl Drop for ForceDimension {
    fn drop(&mut self) {
        self.close();
    }
}
