//! A stand-in for OpenHaptics' libHD.so: the calls that the driver makes, with the published constants, units and axes (mm, N; x
//! to the right, y up, z towards the user), a stack of errors, frames, and a scheduler of 1000 callbacks a second in a thread of
//! its own. Functions called standin_… are for tests.

#![allow(non_snake_case)]

mod amplifier;

use amplifier::Amplifier;
use std::ffi::{CStr, c_char, c_double, c_int, c_uint, c_ulong, c_ushort, c_void};
use std::fs::File;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;
use std::time::Duration;

#[repr(C)]
pub struct ErrorInfo {
    code: c_uint,
    internal: c_int,
    device: c_uint,
}

type Callback = unsafe extern "C" fn(*mut c_void) -> c_uint;

#[derive(Clone, Copy)]
struct One {
    open: bool,
    forces_on: bool,
    in_frame: bool,
    transform: [f64; 16],
    buttons: c_int,
    wanted: [f64; 3],
    force: [f64; 3],
    pushed: bool,
}

const UNTURNED: [f64; 16] = [1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1., 0., 0., 0., 0., 1.];

const ONE: One = One {
    open: false,
    forces_on: false,
    in_frame: false,
    transform: UNTURNED,
    buttons: 0,
    wanted: [0.0; 3],
    force: [0.0; 3],
    pushed: false,
};

struct World {
    devices: [One; 2],
    /// The first device's file, while it is open.
    amplifier: Option<File>,
    current: usize,
    errors: Vec<c_uint>,
    /// An error of every frame.
    fault: c_uint,
    present: bool,
    scheduled: Vec<(c_ulong, Callback, usize)>,
    scheduler: Option<JoinHandle<()>>,
    handles: c_ulong,
}

static WORLD: Mutex<World> = Mutex::new(World {
    devices: [ONE; 2],
    amplifier: None,
    current: 0,
    errors: Vec::new(),
    fault: 0,
    present: true,
    scheduled: Vec::new(),
    scheduler: None,
    handles: 0,
});

static RUNNING: AtomicBool = AtomicBool::new(false);
/// Running, and making no frames.
static HANGS: AtomicBool = AtomicBool::new(false);

fn world() -> MutexGuard<'static, World> {
    WORLD.lock().unwrap_or_else(PoisonError::into_inner)
}

impl World {
    /// Writes the first device's state into its file.
    fn save(&mut self) {
        let One { open, forces_on, force, .. } = self.devices[0];
        self.amplifier.iter_mut().for_each(|file| Amplifier { open, forces_on, force }.save(file));
    }

    /// The device of a frame; what is called outside of one is an error.
    fn in_frame(&mut self) -> Option<&mut One> {
        if !self.devices[self.current].in_frame {
            self.errors.push(0x0402);
            return None;
        }
        Some(&mut self.devices[self.current])
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdInitDevice(name: *const c_char) -> c_uint {
    // SAFETY: the caller's text.
    let name = (!name.is_null()).then(|| unsafe { CStr::from_ptr(name) }.to_string_lossy().into_owned());
    let mut world = world();
    let at = match name.as_deref() {
        None | Some("Default Device") => 0,
        Some("Left") => 1,
        Some(_) => 2,
    };
    let mut error = match world.devices.get(at) {
        Some(one) if one.open => 0x0301,
        Some(_) if world.present => 0,
        _ => 0x0302,
    };
    if error == 0 && at == 0 {
        match Amplifier::claim() {
            Err(()) => error = 0x0301,
            Ok((None, _)) => {}
            Ok((file, Amplifier { forces_on, force, .. })) => {
                (world.devices[0].forces_on, world.devices[0].force) = (forces_on, force);
                world.amplifier = file;
            }
        }
    }
    if error != 0 {
        world.errors.push(error);
        return 0xFFFF_FFFF;
    }
    world.devices[at].open = true;
    world.current = at;
    world.save();
    at as c_uint
}

#[unsafe(no_mangle)]
pub extern "C" fn hdDisableDevice(device: c_uint) {
    let mut world = world();
    world.devices[device as usize].open = false;
    if device == 0 {
        world.save();
        world.amplifier = None;
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdMakeCurrentDevice(device: c_uint) {
    world().current = device as usize;
}

#[unsafe(no_mangle)]
pub extern "C" fn hdBeginFrame(device: c_uint) {
    let mut world = world();
    world.current = device as usize;
    let one = &mut world.devices[device as usize];
    one.in_frame = one.open;
}

#[unsafe(no_mangle)]
pub extern "C" fn hdEndFrame(device: c_uint) {
    let mut world = world();
    let fault = world.fault;
    if fault != 0 {
        world.errors.push(fault);
    }
    let one = &mut world.devices[device as usize];
    one.in_frame = false;
    one.force = if one.forces_on && fault == 0 { one.wanted } else { [0.0; 3] };
    one.pushed |= one.force != [0.0; 3];
    // What is not set in the next frame is none.
    one.wanted = [0.0; 3];
    world.save();
}

#[unsafe(no_mangle)]
pub extern "C" fn hdEnable(what: c_uint) {
    let mut world = world();
    let current = world.current;
    world.devices[current].forces_on |= what == 0x4000;
    world.save();
}

#[unsafe(no_mangle)]
pub extern "C" fn hdDisable(what: c_uint) {
    let mut world = world();
    let current = world.current;
    world.devices[current].forces_on &= what != 0x4000;
    world.save();
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetIntegerv(what: c_uint, numbers: *mut c_int) {
    let mut world = world();
    match what {
        0x2000 => {
            if let Some(one) = world.in_frame() {
                // SAFETY: the caller's place.
                unsafe { *numbers = one.buttons };
            }
        }
        _ => world.errors.push(0x0100),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdGetDoublev(what: c_uint, numbers: *mut c_double) {
    let mut world = world();
    match what {
        0x2052 => {
            if let Some(one) = world.in_frame() {
                // SAFETY: the caller's place for 16 numbers.
                unsafe { std::ptr::copy_nonoverlapping(one.transform.as_ptr(), numbers, 16) };
            }
        }
        // SAFETY: the caller's place. A Touch tells 0.88 N for long.
        0x2604 => unsafe { *numbers = 0.88 },
        _ => world.errors.push(0x0100),
    }
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn hdSetDoublev(what: c_uint, numbers: *const c_double) {
    let mut world = world();
    match what {
        0x2700 => {
            if let Some(one) = world.in_frame() {
                // SAFETY: the caller's three numbers.
                one.wanted = unsafe { *numbers.cast() };
            }
        }
        _ => world.errors.push(0x0100),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetString(what: c_uint) -> *const c_char {
    match what {
        0x2501 => c"Touch".as_ptr(),
        0x2504 => c"2016-015-00123".as_ptr(),
        _ => std::ptr::null(),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetError() -> ErrorInfo {
    let mut world = world();
    let device = world.current as c_uint;
    ErrorInfo { code: world.errors.pop().unwrap_or(0), internal: 0, device }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdGetErrorString(code: c_uint) -> *const c_char {
    match code {
        0x0200 => c"Warm motors".as_ptr(),
        0x0301 => c"Device already initiated".as_ptr(),
        0x0302 => c"Communication error".as_ptr(),
        _ => c"Other error".as_ptr(),
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn hdScheduleAsynchronous(callback: Callback, data: *mut c_void, _: c_ushort) -> c_ulong {
    let mut world = world();
    world.handles += 1;
    let handle = world.handles;
    world.scheduled.push((handle, callback, data as usize));
    handle
}

#[unsafe(no_mangle)]
pub extern "C" fn hdUnschedule(handle: c_ulong) {
    world().scheduled.retain(|(own, ..)| *own != handle);
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStartScheduler() {
    let mut world = world();
    if world.scheduler.is_some() {
        world.errors.push(0x0304);
        return;
    }
    RUNNING.store(true, Ordering::SeqCst);
    world.scheduler = Some(std::thread::spawn(|| {
        while RUNNING.load(Ordering::SeqCst) {
            std::thread::sleep(Duration::from_millis(1));
            if HANGS.load(Ordering::SeqCst) {
                continue;
            }
            let scheduled = self::world().scheduled.clone();
            for (handle, callback, data) in scheduled {
                // SAFETY: what was scheduled, with its data.
                if unsafe { callback(data as *mut c_void) } == 0 {
                    hdUnschedule(handle);
                }
            }
        }
    }));
}

#[unsafe(no_mangle)]
pub extern "C" fn hdStopScheduler() {
    RUNNING.store(false, Ordering::SeqCst);
    let scheduler = world().scheduler.take();
    scheduler.map(JoinHandle::join);
}

/// The handle's transform, column by column, in mm.
#[unsafe(no_mangle)]
pub extern "C" fn standin_transform(id: usize, transform: &[f64; 16]) {
    world().devices[id].transform = *transform;
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_press(id: usize, buttons: c_int) {
    world().devices[id].buttons = buttons;
}

/// An error of every frame from now on; 0 for none.
#[unsafe(no_mangle)]
pub extern "C" fn standin_fault(code: c_uint) {
    world().fault = code;
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_plug(present: bool) {
    world().present = present;
}

/// A scheduler that hangs makes no frames.
#[unsafe(no_mangle)]
pub extern "C" fn standin_hang(hangs: bool) {
    HANGS.store(hangs, Ordering::SeqCst);
}

/// The force of the last frame.
#[unsafe(no_mangle)]
pub extern "C" fn standin_force(id: usize, force: &mut [f64; 3]) {
    *force = world().devices[id].force;
}

/// Whether there was ever a force.
#[unsafe(no_mangle)]
pub extern "C" fn standin_pushed(id: usize) -> bool {
    world().devices[id].pushed
}

/// Whether a device is open, gives forces, or is scheduled.
#[unsafe(no_mangle)]
pub extern "C" fn standin_in_use() -> bool {
    let world = world();
    let used = |one: &One| one.open || one.forces_on;
    world.devices.iter().any(used) || !world.scheduled.is_empty() || world.scheduler.is_some()
}
