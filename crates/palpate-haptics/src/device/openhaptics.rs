//! 3D Systems devices by OpenHaptics, the successor of the paper's GHOST, loaded at run time.
//!
//! Its frame is ours (x to the right, y up, z towards the user), in millimetres and newtons. Devices may be asked and pushed in
//! frames only, which its scheduler's thread makes, 1000 a second: a frame leaves what it read for the haptic update, and sends
//! the newest force that the haptic update wants ([`exchange`](super::exchange)). One scheduler serves all devices of a process;
//! it stands still for a moment when one is opened or left. Devices must have been calibrated with the vendor's tools.

use super::driver::Found;
use super::exchange::{DriverEnd, UpdateEnd, exchange};
use super::library::{Vendor, functions};
use super::{Device, Reading, Traits, handle_turned};
use crate::error::Error;
use glam::{DMat3, DVec3};
use std::ffi::{CStr, CString, c_char, c_double, c_int, c_uint, c_ulong, c_ushort, c_void};
use std::ptr::null;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub(super) static VENDOR: Vendor = Vendor {
    driver: "openhaptics",
    files: &["libHD.so", "libHD.so.3.4", "libHD.so.3.0"],
    software: "3D Systems' OpenHaptics and the driver of the device",
    variable: "PALPATE_LIBHD",
};

/// The constants of hdDefines.h that are used.
mod hd {
    use super::{c_uint, c_ushort};

    pub const SUCCESS: c_uint = 0;
    pub const INVALID_HANDLE: c_uint = 0xFFFF_FFFF;
    /// Errors from here to below [`FIRST_DEVICE_ERROR`] are of forces: too large, motors too warm. The position is good.
    pub const FIRST_FORCE_ERROR: c_uint = 0x0200;
    pub const FIRST_DEVICE_ERROR: c_uint = 0x0300;
    pub const CURRENT_BUTTONS: c_uint = 0x2000;
    pub const CURRENT_TRANSFORM: c_uint = 0x2052;
    pub const DEVICE_MODEL_TYPE: c_uint = 0x2501;
    pub const DEVICE_SERIAL_NUMBER: c_uint = 0x2504;
    pub const NOMINAL_MAX_CONTINUOUS_FORCE: c_uint = 0x2604;
    pub const CURRENT_FORCE: c_uint = 0x2700;
    pub const FORCE_OUTPUT: c_uint = 0x4000;
    pub const MAX_SCHEDULER_PRIORITY: c_ushort = c_ushort::MAX;
    pub const CALLBACK_DONE: c_uint = 0;
    pub const CALLBACK_CONTINUE: c_uint = 1;
}

/// Metres in a millimetre.
const METRE: f64 = 1e-3;

/// A last frame, without force, is waited for so long.
const LAST_FRAME: Duration = Duration::from_millis(100);

/// The library remembers no more errors than these at once.
const MOST_ERRORS: usize = 64;

/// An error of the library's stack.
#[repr(C)]
#[derive(Clone, Copy)]
struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    device: c_uint,
}

type Callback = unsafe extern "C" fn(*mut c_void) -> c_uint;

functions! {
    /// What is called of the library (hdDevice.h, hdScheduler.h).
    struct Functions {
        hdInitDevice: fn(*const c_char) -> c_uint,
        hdDisableDevice: fn(c_uint),
        hdMakeCurrentDevice: fn(c_uint),
        hdBeginFrame: fn(c_uint),
        hdEndFrame: fn(c_uint),
        hdEnable: fn(c_uint),
        hdDisable: fn(c_uint),
        hdGetIntegerv: fn(c_uint, *mut c_int),
        hdGetDoublev: fn(c_uint, *mut c_double),
        hdSetDoublev: fn(c_uint, *const c_double),
        hdGetString: fn(c_uint) -> *const c_char,
        hdGetError: fn() -> ErrorInfo,
        hdGetErrorString: fn(c_uint) -> *const c_char,
        hdScheduleAsynchronous: fn(Callback, *mut c_void, c_ushort) -> c_ulong,
        hdUnschedule: fn(c_ulong),
        hdStartScheduler: fn(),
        hdStopScheduler: fn(),
    }
}

/// Devices that the scheduler serves; held while one is opened or left.
static SERVED: Mutex<usize> = Mutex::new(0);

/// An open device.
pub(super) struct OpenHaptics {
    functions: Functions,
    end: UpdateEnd,
    flags: Arc<Flags>,
    served: Served,
    traits: Traits,
}

#[derive(Default)]
struct Flags {
    ending: AtomicBool,
    ended: AtomicBool,
}

/// What the scheduler holds of a device.
struct Served {
    device: c_uint,
    handle: c_ulong,
    servo: *mut Servo,
}

// SAFETY: the pointer is only used by the scheduler's thread, until that has ended with it.
unsafe impl Send for Served {}

/// What a frame works with, in the scheduler's thread.
struct Servo {
    functions: Functions,
    device: c_uint,
    end: DriverEnd,
    flags: Arc<Flags>,
}

/// What is there: the library opens devices by the names of their configurations and lists none, so the default one is tried.
pub(super) fn find(place: Option<&str>) -> Result<Vec<Found>, Error> {
    let functions = Functions::of(&VENDOR.load(place)?)?;
    let served = serve();
    functions.pause(*served);
    let found = functions.init("0").map(|(found, device)| {
        // SAFETY: the device was opened above, and is not used after.
        unsafe { (functions.hdDisableDevice)(device) };
        found
    });
    functions.resume(*served)?;
    Ok(vec![found?])
}

/// Open one.
pub(super) fn open(which: &str, place: Option<&str>) -> Result<(Found, OpenHaptics), Error> {
    let functions = Functions::of(&VENDOR.load(place)?)?;
    let mut served = serve();
    functions.pause(*served);
    let opened = functions.schedule(which);
    *served += usize::from(opened.is_ok());
    let resumed = functions.resume(*served);
    // What was opened is left again if the scheduler does not run, which needs the lock.
    drop(served);
    let opened = opened?;
    resumed.map(|()| opened)
}

fn serve() -> MutexGuard<'static, usize> {
    SERVED.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Functions {
    /// Let the scheduler stand still, if it serves devices.
    fn pause(&self, served: usize) {
        if served > 0 {
            // SAFETY: a plain call.
            unsafe { (self.hdStopScheduler)() };
        }
    }

    /// Let it run again, if it serves devices.
    fn resume(&self, served: usize) -> Result<(), Error> {
        if served == 0 {
            return Ok(());
        }
        self.errors();
        // SAFETY: a plain call.
        unsafe { (self.hdStartScheduler)() };
        self.check("openhaptics: the scheduler does not start")
    }

    /// Open a device and ask it what it is. Gives its handle.
    fn init(&self, which: &str) -> Result<(Found, c_uint), Error> {
        let name = CString::new(which)
            .map_err(|_| Error::Device(format!("openhaptics: {which:?} is no name of a configuration")))?;
        self.errors();
        let default = which == "0";
        // SAFETY: the name ends with 0 and outlives the call; none means the default device.
        let device = unsafe { (self.hdInitDevice)(if default { null() } else { name.as_ptr() }) };
        let what = if default { "the default device".to_string() } else { format!("the device {which:?}") };
        self.check(&format!("openhaptics: {what} can't be had"))?;
        if device == hd::INVALID_HANDLE {
            return Err(Error::Device(format!(
                "openhaptics: there is no {}: connect it, and name it with the vendor's setup program",
                what.trim_start_matches("the ")
            )));
        }
        let mut force = f64::NAN;
        // SAFETY: the device is open and current; a force is one number, whose place outlives the call.
        let (name, serial) = unsafe {
            (self.hdGetDoublev)(hd::NOMINAL_MAX_CONTINUOUS_FORCE, &raw mut force);
            (
                text((self.hdGetString)(hd::DEVICE_MODEL_TYPE)),
                text((self.hdGetString)(hd::DEVICE_SERIAL_NUMBER)),
            )
        };
        self.errors();
        let force_n = (force.is_finite() && force > 0.0).then_some(force);
        let name = name.unwrap_or_else(|| "a device".into());
        Ok((Found { name, index: 0, serial, force_n, why_not: None }, device))
    }

    /// Open a device and put it on the scheduler.
    fn schedule(&self, which: &str) -> Result<(Found, OpenHaptics), Error> {
        let (found, device) = self.init(which)?;
        // SAFETY: the device is open and current.
        unsafe { (self.hdEnable)(hd::FORCE_OUTPUT) };
        let (end, driver) = exchange();
        let flags = Arc::new(Flags::default());
        let servo = Servo { functions: *self, device, end: driver, flags: flags.clone() };
        let servo = Box::into_raw(Box::new(servo));
        // SAFETY: the callback gets its servo, which stays until the scheduler has ended with it.
        let handle =
            unsafe { (self.hdScheduleAsynchronous)(frame, servo.cast(), hd::MAX_SCHEDULER_PRIORITY) };
        if let Err(error) = self.check("openhaptics: the scheduler does not take the device") {
            // SAFETY: the scheduler has not taken the servo, and stands still; the device is not used after.
            unsafe {
                drop(Box::from_raw(servo));
                (self.hdDisableDevice)(device);
            }
            return Err(error);
        }
        let force_n = found.force_n.unwrap_or(Traits::TOUCH.force_n);
        let traits = Traits { kind: "openhaptics", force_n, ..Traits::TOUCH };
        let served = Served { device, handle, servo };
        Ok((found, OpenHaptics { functions: *self, end, flags, served, traits }))
    }

    /// Empty the stack of errors; gives the first that came, which explains the others, or success.
    fn errors(&self) -> c_uint {
        let mut first = hd::SUCCESS;
        for _ in 0..MOST_ERRORS {
            // SAFETY: a plain call; the newest error comes first.
            match unsafe { (self.hdGetError)() }.code {
                hd::SUCCESS => break,
                code => first = code,
            }
        }
        first
    }

    fn check(&self, what: &str) -> Result<(), Error> {
        match self.errors() {
            hd::SUCCESS => Ok(()),
            code => Err(self.failed(what, code)),
        }
    }

    fn failed(&self, what: &str, code: c_uint) -> Error {
        // SAFETY: a plain call; it gives a text of the library's.
        let why = text(unsafe { (self.hdGetErrorString)(code) }).unwrap_or_default();
        Error::Device(format!("{what}: {why} (error {code:#06x})"))
    }
}

/// A text of the library's, if there is one.
fn text(text: *const c_char) -> Option<String> {
    // SAFETY: the library gives texts that end with 0 and stay, or nothing.
    let text = (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned());
    text.filter(|text| !text.is_empty())
}

/// A frame, by the scheduler.
unsafe extern "C" fn frame(servo: *mut c_void) -> c_uint {
    // SAFETY: it was scheduled with a servo, which stays until `ended` is set, and which nobody else uses.
    unsafe { &mut *servo.cast::<Servo>() }.frame()
}

impl Servo {
    /// Read, push, tell.
    ///
    /// # Real time
    /// No allocation or lock but the library's.
    fn frame(&mut self) -> c_uint {
        let ending = self.flags.ending.load(Ordering::Acquire);
        let force = if ending { DVec3::ZERO } else { self.end.wanted() };
        let (mut columns, mut buttons) = ([f64::NAN; 16], 0);
        // SAFETY: calls of a frame with an open device; a transform is 16 numbers, a force 3, and all outlive the calls.
        unsafe {
            (self.functions.hdBeginFrame)(self.device);
            (self.functions.hdGetDoublev)(hd::CURRENT_TRANSFORM, columns.as_mut_ptr());
            (self.functions.hdGetIntegerv)(hd::CURRENT_BUTTONS, &raw mut buttons);
            (self.functions.hdSetDoublev)(hd::CURRENT_FORCE, force.to_array().as_ptr());
            (self.functions.hdEndFrame)(self.device);
        }
        let column = |at: usize| DVec3::from_slice(&columns[at..at + 3]);
        let turned = DMat3::from_cols(column(0), column(4), column(8));
        let reading = Reading {
            position: column(12) * METRE,
            orientation: handle_turned(turned, |v| v),
            buttons: buttons as u32,
        };
        self.end.tell(reading, self.functions.errors());
        if ending {
            self.flags.ended.store(true, Ordering::Release);
            return hd::CALLBACK_DONE;
        }
        hd::CALLBACK_CONTINUE
    }
}

impl OpenHaptics {
    /// Errors of forces spoil no reading, and other ones no force.
    fn force_fault(code: c_uint) -> bool {
        (hd::FIRST_FORCE_ERROR..hd::FIRST_DEVICE_ERROR).contains(&code)
    }
}

impl Device for OpenHaptics {
    fn traits(&self) -> Traits {
        self.traits
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        match self.end.newest(now_s) {
            None => Err(Error::Device("openhaptics: the scheduler makes no frames".into())),
            Some(told) if told.fault != hd::SUCCESS && !Self::force_fault(told.fault) => {
                Err(self.functions.failed("openhaptics: the device does not tell where it is", told.fault))
            }
            Some(told) => Ok(told.reading),
        }
    }

    fn push(&mut self, force: DVec3, now_s: f64) -> Result<(), Error> {
        self.end.push(force);
        match self.end.newest(now_s) {
            Some(told) if Self::force_fault(told.fault) => {
                Err(self.functions.failed("openhaptics: the force was not given", told.fault))
            }
            _ => Ok(()),
        }
    }
}

impl Drop for OpenHaptics {
    fn drop(&mut self) {
        let Self { functions, flags, served: Served { device, handle, servo }, .. } = self;
        // The last frame carries no force.
        flags.ending.store(true, Ordering::Release);
        let patience = Instant::now() + LAST_FRAME;
        while !flags.ended.load(Ordering::Acquire) && Instant::now() < patience {
            std::thread::sleep(Duration::from_millis(1));
        }
        let ended = flags.ended.load(Ordering::Acquire);
        let mut served = serve();
        // SAFETY: the device is open and not used after; the scheduler stands still while it is left.
        unsafe {
            (functions.hdStopScheduler)();
            if !ended {
                (functions.hdUnschedule)(*handle);
            }
            (functions.hdMakeCurrentDevice)(*device);
            (functions.hdDisable)(hd::FORCE_OUTPUT);
            (functions.hdDisableDevice)(*device);
        }
        *served -= 1;
        // If it does not run again, the other devices fall silent and say so.
        let _ = functions.resume(*served);
        if ended {
            // SAFETY: the scheduler has said that it is done with the servo, and nobody else has it. A scheduler that hangs may
            // still come to it: then it is left where it is.
            drop(unsafe { Box::from_raw(*servo) });
        }
    }
}
