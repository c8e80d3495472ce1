//! A stand-in for Force Dimension's libdhd.so: the calls that the driver makes, with the published units and axes (m, N; x
//! towards the operator, y to the right, z up) and results (0 or more for done, below 0 for an error that dhdErrorGetLastStr
//! tells of). Functions called standin_… are for tests.

#![allow(non_snake_case)]

mod amplifier;

use amplifier::Amplifier;
use std::ffi::{c_char, c_double, c_int, c_uchar, c_uint, c_ushort};
use std::fs::File;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

#[derive(Clone, Copy)]
struct One {
    open: bool,
    forces_on: bool,
    position: [f64; 3],
    frame: [[f64; 3]; 3],
    buttons: c_uint,
    force: [f64; 3],
    serial: c_ushort,
    /// Watchdog [125 µs]; 0 for none.
    watchdog: c_uchar,
    commanded: Option<Instant>,
    /// Whether the watchdog has disabled forces.
    expired: bool,
}

struct World {
    present: usize,
    failing: bool,
    max_force: f64,
    devices: [One; 2],
    /// The first device's file, while it is open.
    amplifier: Option<File>,
    error: &'static std::ffi::CStr,
}

const UNTURNED: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

const fn one(serial: c_ushort) -> One {
    let (position, force) = ([0.0; 3], [0.0; 3]);
    let (open, forces_on, expired) = (false, false, false);
    One { open, forces_on, position, frame: UNTURNED, buttons: 0, force, serial, watchdog: 0, commanded: None, expired }
}

static WORLD: Mutex<World> = Mutex::new(World {
    present: 1,
    failing: false,
    max_force: -1.0,
    devices: [one(301), one(702)],
    amplifier: None,
    error: c"no error",
});

fn world() -> MutexGuard<'static, World> {
    WORLD.lock().unwrap_or_else(PoisonError::into_inner)
}

impl World {
    fn fail(&mut self, error: &'static std::ffi::CStr) -> c_int {
        self.error = error;
        -1
    }

    /// Do something with an open device that is there.
    fn on(&mut self, id: c_char, act: impl FnOnce(&mut One)) -> c_int {
        let at = id as usize;
        if at >= self.present || self.failing {
            return self.fail(c"communication error");
        }
        if !self.devices[at].open {
            return self.fail(c"no device found");
        }
        act(&mut self.devices[at]);
        self.save();
        0
    }

    /// Writes the first device's state into its file.
    fn save(&mut self) {
        let One { open, forces_on, force, .. } = self.devices[0];
        self.amplifier.iter_mut().for_each(|file| Amplifier { open, forces_on, force }.save(file));
    }
}

impl One {
    /// Firmware: forces are off when no command came for too long.
    fn watch(&mut self) {
        let limit = Duration::from_micros(125) * u32::from(self.watchdog);
        let late = self.commanded.replace(Instant::now()).is_some_and(|time| time.elapsed() > limit);
        self.expired |= self.watchdog > 0 && late;
        self.forces_on &= !self.expired;
    }
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetDeviceCount() -> c_int {
    world().present as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdOpenID(index: c_char) -> c_int {
    let mut world = world();
    let at = index as usize;
    if at >= world.present {
        return world.fail(c"no device found");
    }
    if world.devices[at].open {
        return world.fail(c"device is already in use");
    }
    if at == 0 {
        let Ok((file, Amplifier { forces_on, force, .. })) = Amplifier::claim() else {
            return world.fail(c"device is already in use");
        };
        if file.is_some() {
            (world.devices[0].forces_on, world.devices[0].force) = (forces_on, force);
        }
        world.amplifier = file;
    }
    world.devices[at].open = true;
    world.save();
    index as c_int
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdClose(id: c_char) -> c_int {
    let mut world = world();
    let one = &mut world.devices[id as usize];
    one.open = false;
    one.forces_on = false;
    if id == 0 {
        world.save();
        world.amplifier = None;
    }
    0
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetSystemName(id: c_char) -> *const c_char {
    [c"omega.3", c"omega.7"][id as usize].as_ptr()
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetSerialNumber(serial: *mut c_ushort, id: c_char) -> c_int {
    // SAFETY: the caller's place.
    world().on(id, |one| unsafe { *serial = one.serial })
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdHasWrist(id: c_char) -> bool {
    id == 1
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetMaxForce(_: c_char) -> c_double {
    world().max_force
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdEnableForce(on: c_uchar, id: c_char) -> c_int {
    world().on(id, |one| (one.forces_on, one.expired) = (on != 0, false))
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetPosition(x: *mut c_double, y: *mut c_double, z: *mut c_double, id: c_char) -> c_int {
    // SAFETY: the caller's places.
    world().on(id, |one| unsafe { (*x, *y, *z) = one.position.into() })
}

#[unsafe(no_mangle)]
pub unsafe extern "C" fn dhdGetOrientationFrame(rows: *mut [[c_double; 3]; 3], id: c_char) -> c_int {
    // SAFETY: the caller's place.
    world().on(id, |one| unsafe { *rows = one.frame })
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdGetButtonMask(id: c_char) -> c_uint {
    world().devices[id as usize].buttons
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdSetForceAndTorqueAndGripperForce(
    x: c_double,
    y: c_double,
    z: c_double,
    tx: c_double,
    ty: c_double,
    tz: c_double,
    grip: c_double,
    id: c_char,
) -> c_int {
    assert_eq!((tx, ty, tz, grip), (0.0, 0.0, 0.0, 0.0));
    world().on(id, |one| {
        one.watch();
        let is_heard = one.forces_on || [x, y, z] == [0.0; 3];
        one.force = if is_heard { [x, y, z] } else { [if one.expired { 0.0 } else { f64::NAN }; 3] };
    })
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdSetWatchdog(duration: c_uchar, id: c_char) -> c_int {
    world().on(id, |one| one.watchdog = duration)
}

#[unsafe(no_mangle)]
pub extern "C" fn dhdErrorGetLastStr() -> *const c_char {
    world().error.as_ptr()
}

/// Where a hand holds a device.
#[unsafe(no_mangle)]
pub extern "C" fn standin_place(id: usize, x: f64, y: f64, z: f64) {
    world().devices[id].position = [x, y, z];
}

/// Rotation of the handle, row by row.
#[unsafe(no_mangle)]
pub extern "C" fn standin_turn(id: usize, rows: &[[f64; 3]; 3]) {
    world().devices[id].frame = *rows;
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_press(id: usize, buttons: c_uint) {
    world().devices[id].buttons = buttons;
}

/// Set the number of devices that are plugged in; unplugged ones stay open.
#[unsafe(no_mangle)]
pub extern "C" fn standin_plug(count: usize) {
    world().present = count;
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_limit(force: f64) {
    world().max_force = force;
}

/// Whether calls fail though the device is there.
#[unsafe(no_mangle)]
pub extern "C" fn standin_fail(failing: bool) {
    world().failing = failing;
}

/// The force that a device gives; not a number for one that was set before forces were on.
#[unsafe(no_mangle)]
pub extern "C" fn standin_force(id: usize, force: &mut [f64; 3]) {
    *force = world().devices[id].force;
}

/// The watchdog's time [µs].
#[unsafe(no_mangle)]
pub extern "C" fn standin_watchdog(id: usize) -> u32 {
    125 * u32::from(world().devices[id].watchdog)
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_is_on(id: usize) -> bool {
    world().devices[id].forces_on
}

#[unsafe(no_mangle)]
pub extern "C" fn standin_is_open(id: usize) -> bool {
    world().devices[id].open
}
