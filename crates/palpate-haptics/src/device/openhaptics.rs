//! 3D Systems devices, through OpenHaptics (the successor of the paper's GHOST), loaded at run time.
//!
//! The vendor's frame is the device frame (x to the right, y up, z towards the user), in millimetres and newtons. Devices may be read
//! and commanded within frames only, which the library's scheduler thread makes at 1 kHz. A frame passes its reading to the haptic
//! update and takes the newest force from it (see [`exchange`](super::exchange)). One scheduler serves all devices of a process; it
//! is stopped while a device is opened or closed. Devices must have been calibrated with the vendor's tools.

use super::driver::DiscoveredDevice;
use super::exchange::{DriverSide, UpdateSide, exchange};
use super::library::{LibraryFiles, Vendor, functions};
use super::{Device, DeviceSpec, Reading, handle_orientation};
use crate::error::{DeviceError, Error};
use glam::{DMat3, DVec3};
use std::ffi::{CStr, CString, c_char, c_double, c_int, c_uint, c_ulong, c_ushort, c_void};
use std::ptr::null;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub(super) static VENDOR: Vendor = Vendor {
    driver: "openhaptics",
    files: LibraryFiles {
        linux: &["libHD.so", "libHD.so.3.4", "libHD.so.3.0"],
        // The vendor has a framework for old versions only.
        macos: &["/Library/Frameworks/HD.framework/HD", "libHD.dylib"],
        windows: &["hd.dll"],
    },
    software: "3D Systems' OpenHaptics and the driver of the device",
    variable: "PALPATE_LIBHD",
};

/// Constants of hdDefines.h.
mod hd {
    use super::{c_uint, c_ushort};

    pub const SUCCESS: c_uint = 0;
    pub const INVALID_HANDLE: c_uint = 0xFFFF_FFFF;
    /// Errors from here to below [`FIRST_DEVICE_ERROR`] concern forces: too large, motors too warm. The position is valid.
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

/// Millimetre [m].
const MILLIMETRE: f64 = 1e-3;

/// Timeout for the last frame, which commands zero force.
const LAST_FRAME_TIMEOUT: Duration = Duration::from_millis(100);

/// Size of the library's error stack.
const MAX_ERRORS: usize = 64;

/// Error of the library's stack.
#[repr(C)]
#[derive(Clone, Copy)]
struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    device: c_uint,
}

type Callback = unsafe extern "C" fn(*mut c_void) -> c_uint;

functions! {
    /// Functions of the library (hdDevice.h, hdScheduler.h).
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

/// Number of devices on the scheduler; locked while one is opened or closed.
static SCHEDULED: Mutex<usize> = Mutex::new(0);

/// Open device.
pub(super) struct OpenHaptics {
    functions: Functions,
    exchange: UpdateSide,
    flags: Arc<Flags>,
    scheduled: Scheduled,
    spec: DeviceSpec,
}

/// Shutdown handshake between the device and its servo.
#[derive(Default)]
struct Flags {
    /// Set by the device: the next frame is the last.
    ending: AtomicBool,
    /// Set by the servo in its last frame.
    ended: AtomicBool,
}

/// Device on the scheduler.
struct Scheduled {
    device: c_uint,
    handle: c_ulong,
    servo: *mut Servo,
}

// SAFETY: only the scheduler's thread uses the pointer, until it has ended with it.
unsafe impl Send for Scheduled {}

/// Servo of a device: the state of its frames, in the scheduler's thread.
struct Servo {
    functions: Functions,
    device: c_uint,
    exchange: DriverSide,
    flags: Arc<Flags>,
}

/// Connected devices: the default one. The library opens devices by the names of their configurations, and lists none.
pub(super) fn find(location: Option<&str>) -> Result<Vec<DiscoveredDevice>, Error> {
    let functions = Functions::of(&VENDOR.load(location)?)?;
    let scheduled = lock_scheduled();
    functions.pause(*scheduled);
    let found = functions.init("0").map(|(found, device)| {
        // SAFETY: the device was opened above, and is not used after.
        unsafe { (functions.hdDisableDevice)(device) };
        found
    });
    functions.resume(*scheduled)?;
    Ok(vec![found?])
}

/// Opens a device by the name of its configuration; "0" is the default one.
pub(super) fn open(which: &str, location: Option<&str>) -> Result<(DiscoveredDevice, OpenHaptics), Error> {
    let functions = Functions::of(&VENDOR.load(location)?)?;
    let mut scheduled = lock_scheduled();
    functions.pause(*scheduled);
    let opened = functions.schedule(which);
    *scheduled += usize::from(opened.is_ok());
    let resumed = functions.resume(*scheduled);
    // If the scheduler does not run, the device is dropped below, which takes the lock.
    drop(scheduled);
    let opened = opened?;
    resumed.map(|()| opened)
}

fn lock_scheduled() -> MutexGuard<'static, usize> {
    SCHEDULED.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Functions {
    /// Stops the scheduler, if it has devices.
    fn pause(&self, scheduled: usize) {
        if scheduled > 0 {
            // SAFETY: a plain call.
            unsafe { (self.hdStopScheduler)() };
        }
    }

    /// Starts the scheduler, if it has devices.
    fn resume(&self, scheduled: usize) -> Result<(), Error> {
        if scheduled == 0 {
            return Ok(());
        }
        self.pop_errors();
        // SAFETY: a plain call.
        unsafe { (self.hdStartScheduler)() };
        self.check("the scheduler does not start")
    }

    /// Opens a device. Returns its description and handle.
    fn init(&self, which: &str) -> Result<(DiscoveredDevice, c_uint), Error> {
        let name = CString::new(which).map_err(|_| DeviceError::NoDevice {
            driver: "openhaptics",
            message: format!("{which:?} is no name of a configuration"),
        })?;
        self.pop_errors();
        let default = which == "0";
        // SAFETY: the name ends with 0 and outlives the call; a null pointer means the default device.
        let device = unsafe { (self.hdInitDevice)(if default { null() } else { name.as_ptr() }) };
        let what = if default { "the default device".to_string() } else { format!("the device {which:?}") };
        self.check(&format!("{what} can't be had"))?;
        if device == hd::INVALID_HANDLE {
            let what = what.trim_start_matches("the ");
            let message =
                format!("there is no {what}: connect it, and name it with the vendor's setup program");
            return Err(DeviceError::NoDevice { driver: "openhaptics", message }.into());
        }
        let mut force = f64::NAN;
        // SAFETY: the device is open and current; a force is one number, whose memory outlives the call.
        let (name, serial) = unsafe {
            (self.hdGetDoublev)(hd::NOMINAL_MAX_CONTINUOUS_FORCE, &raw mut force);
            (
                text((self.hdGetString)(hd::DEVICE_MODEL_TYPE)),
                text((self.hdGetString)(hd::DEVICE_SERIAL_NUMBER)),
            )
        };
        self.pop_errors();
        let force_n = (force.is_finite() && force > 0.0).then_some(force);
        let name = name.unwrap_or_else(|| "a device".into());
        Ok((DiscoveredDevice { name, index: 0, serial, force_n, unavailable: None }, device))
    }

    /// Opens a device and schedules its servo.
    fn schedule(&self, which: &str) -> Result<(DiscoveredDevice, OpenHaptics), Error> {
        let (found, device) = self.init(which)?;
        // SAFETY: the device is open and current.
        unsafe { (self.hdEnable)(hd::FORCE_OUTPUT) };
        let (exchange, driver) = exchange();
        let flags = Arc::new(Flags::default());
        let servo = Servo { functions: *self, device, exchange: driver, flags: flags.clone() };
        let servo = Box::into_raw(Box::new(servo));
        // SAFETY: the callback gets its servo, which stays until the scheduler has ended with it.
        let handle =
            unsafe { (self.hdScheduleAsynchronous)(frame, servo.cast(), hd::MAX_SCHEDULER_PRIORITY) };
        if let Err(error) = self.check("the scheduler does not take the device") {
            // SAFETY: the scheduler is stopped and has not taken the servo; the device is not used after.
            unsafe {
                drop(Box::from_raw(servo));
                (self.hdDisableDevice)(device);
            }
            return Err(error);
        }
        let force_n = found.force_n.unwrap_or(DeviceSpec::TOUCH.force_n);
        let spec = DeviceSpec { kind: "openhaptics", force_n, ..DeviceSpec::TOUCH };
        let scheduled = Scheduled { device, handle, servo };
        Ok((found, OpenHaptics { functions: *self, exchange, flags, scheduled, spec }))
    }

    /// Empties the error stack. Returns the oldest error, which caused the others, or success.
    fn pop_errors(&self) -> c_uint {
        let mut first = hd::SUCCESS;
        for _ in 0..MAX_ERRORS {
            // SAFETY: a plain call; the newest error comes first.
            match unsafe { (self.hdGetError)() }.code {
                hd::SUCCESS => break,
                code => first = code,
            }
        }
        first
    }

    /// Error of the calls since the last check, if there was one.
    fn check(&self, call: &str) -> Result<(), Error> {
        match self.pop_errors() {
            hd::SUCCESS => Ok(()),
            code => Err(self.call_error(call, code)),
        }
    }

    fn call_error(&self, call: &str, code: c_uint) -> Error {
        // SAFETY: a plain call; it gives a text of the library's.
        let message = text(unsafe { (self.hdGetErrorString)(code) }).unwrap_or_default();
        let reason = format!("{message} (error {code:#06x})");
        DeviceError::Call { driver: "openhaptics", call: call.to_string(), reason }.into()
    }
}

/// Text from the library; `None` if it is null or empty.
fn text(text: *const c_char) -> Option<String> {
    // SAFETY: the library gives texts that end with 0 and stay, or nothing.
    let text = (!text.is_null()).then(|| unsafe { CStr::from_ptr(text) }.to_string_lossy().into_owned());
    text.filter(|text| !text.is_empty())
}

/// Callback of the scheduler: one frame of a servo.
unsafe extern "C" fn frame(servo: *mut c_void) -> c_uint {
    // SAFETY: it was scheduled with a servo, which stays until `ended` is set, and which nobody else uses.
    unsafe { &mut *servo.cast::<Servo>() }.frame()
}

impl Servo {
    /// Frame: reads the device, commands the newest force, sends the reading.
    ///
    /// # Real time
    /// No allocation or lock except the library's.
    fn frame(&mut self) -> c_uint {
        let ending = self.flags.ending.load(Ordering::Acquire);
        let force = if ending { DVec3::ZERO } else { self.exchange.commanded_force(Instant::now()) };
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
        let axes = DMat3::from_cols(column(0), column(4), column(8));
        let reading = Reading {
            position: column(12) * MILLIMETRE,
            orientation: handle_orientation(axes, |v| v),
            buttons: buttons as u32,
        };
        self.exchange.send(reading, self.functions.pop_errors());
        if ending {
            self.flags.ended.store(true, Ordering::Release);
            return hd::CALLBACK_DONE;
        }
        hd::CALLBACK_CONTINUE
    }
}

impl OpenHaptics {
    /// Whether a fault concerns the force. Such a fault leaves the reading valid, any other one the force.
    fn is_force_fault(code: c_uint) -> bool {
        (hd::FIRST_FORCE_ERROR..hd::FIRST_DEVICE_ERROR).contains(&code)
    }
}

impl Device for OpenHaptics {
    fn spec(&self) -> DeviceSpec {
        self.spec
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        match self.exchange.newest(now_s) {
            None => {
                let reason = "the scheduler makes no frames".to_string();
                Err(DeviceError::Silent { driver: "openhaptics", reason }.into())
            }
            Some(sample) if sample.fault != hd::SUCCESS && !Self::is_force_fault(sample.fault) => {
                Err(self.functions.call_error("the device reports no position", sample.fault))
            }
            Some(sample) => Ok(sample.reading),
        }
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), Error> {
        self.exchange.set_force(force);
        match self.exchange.newest(now_s) {
            Some(sample) if Self::is_force_fault(sample.fault) => {
                Err(self.functions.call_error("the force was not given", sample.fault))
            }
            _ => Ok(()),
        }
    }
}

impl Drop for OpenHaptics {
    fn drop(&mut self) {
        let Self { functions, flags, scheduled: Scheduled { device, handle, servo }, .. } = self;
        // The last frame commands zero force.
        flags.ending.store(true, Ordering::Release);
        let deadline = Instant::now() + LAST_FRAME_TIMEOUT;
        while !flags.ended.load(Ordering::Acquire) && Instant::now() < deadline {
            std::thread::sleep(Duration::from_millis(1));
        }
        let ended = flags.ended.load(Ordering::Acquire);
        let mut scheduled = lock_scheduled();
        // SAFETY: the device is open and not used after; the scheduler is stopped while it is closed.
        unsafe {
            (functions.hdStopScheduler)();
            if !ended {
                (functions.hdUnschedule)(*handle);
            }
            (functions.hdMakeCurrentDevice)(*device);
            (functions.hdDisable)(hd::FORCE_OUTPUT);
            (functions.hdDisableDevice)(*device);
        }
        *scheduled -= 1;
        // If the scheduler does not start again, the other devices report that they are silent.
        let _ = functions.resume(*scheduled);
        if ended {
            // SAFETY: the servo has ended, and nobody else has it. A scheduler that hangs may still call it: then it is leaked.
            drop(unsafe { Box::from_raw(*servo) });
        }
    }
}
