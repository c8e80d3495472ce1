//! OpenHaptics: units, frames of the scheduler, errors, and several devices on one scheduler.

use super::standin::{Hand, Standin};
use glam::{DQuat, DVec3};
use palpate_haptics::device::Driver;
use palpate_testkit::wait_until;
use std::sync::{Mutex, MutexGuard, PoisonError};

type Transform = extern "C" fn(usize, &[f64; 16]);
type Press = extern "C" fn(usize, i32);
type Code = extern "C" fn(u32);
type Switch = extern "C" fn(bool);
type InUse = extern "C" fn() -> bool;
type Pushed = extern "C" fn(usize) -> bool;

/// Round-off of a place that was converted from millimetres [m].
const PLACE_M: f64 = 1e-15;

/// Round-off of an angle between rotations [rad]: the root of that of their product.
const TURN_RAD: f64 = 1e-9;

/// The handle at a place [mm], turned by a quarter about the axis towards the user: its x points up.
fn at(x: f64, y: f64, z: f64) -> [f64; 16] {
    [0., 1., 0., 0., -1., 0., 0., 0., 0., 0., 1., 0., x, y, z, 1.]
}

/// Lock for tests that share a process: the library has one scheduler.
static ALONE: Mutex<()> = Mutex::new(());

fn standin() -> (MutexGuard<'static, ()>, Standin) {
    (ALONE.lock().unwrap_or_else(PoisonError::into_inner), Standin::new("libhd"))
}

fn open(standin: &Standin, which: &str) -> Hand {
    Hand::open(Driver::OpenHaptics, which, standin.place())
}

#[test]
fn connected_devices_are_listed_with_serial_number_and_continuous_force() {
    let (_alone, standin) = standin();
    let found = Driver::OpenHaptics.find(Some(standin.place())).expect("a device");
    assert_eq!(format!("{}, {:?} N", found[0], found[0].force_n), "0: Touch (2016-015-00123), Some(0.88) N");
    assert!(!standin.function::<InUse>("standin_in_use")(), "it is left again");
    let hand = open(&standin, "0");
    assert_eq!(hand.device.spec().force_n, 0.88);
    drop(hand);
    standin.function::<Switch>("standin_plug")(false);
    let error = Driver::OpenHaptics.find(Some(standin.place())).expect_err("none").to_string();
    assert_eq!(error, "openhaptics: the default device can't be had: Communication error (error 0x0302)");
}

#[test]
fn positions_forces_orientations_and_buttons_are_in_the_device_frame() {
    let (_alone, standin) = standin();
    standin.function::<Transform>("standin_transform")(0, &at(10.0, 20.0, -30.0));
    standin.function::<Press>("standin_press")(0, 0b10);
    let mut hand = open(&standin, "0");
    let reading = hand.next();
    assert!((reading.position - DVec3::new(0.01, 0.02, -0.03)).length() < PLACE_M, "{}", reading.position);
    let turned = reading.orientation.expect("it tells");
    assert!(turned.angle_between(DQuat::from_rotation_z(std::f64::consts::FRAC_PI_2)) < TURN_RAD, "{turned}");
    assert_eq!(reading.buttons, 0b10);
    wait_until("the force arrives", || {
        hand.set_force(DVec3::new(0.1, 0.2, 0.3)).expect("it pushes");
        standin.force(0) == [0.1, 0.2, 0.3]
    });
    // Nobody pushes any more: whoever did may have died.
    wait_until("the force goes", || standin.force(0) == [0.0; 3]);
}

#[test]
fn a_device_is_opened_once_and_left_without_force() {
    let (_alone, standin) = standin();
    let mut hand = open(&standin, "0");
    let twice = Driver::OpenHaptics.open("0", Some(standin.place())).err().expect("it is taken").to_string();
    assert_eq!(
        twice,
        "openhaptics: the default device can't be had: Device already initiated (error 0x0301)"
    );
    let stranger = Driver::OpenHaptics.open("Right", Some(standin.place())).err().expect("no such device");
    assert_eq!(
        stranger.to_string(),
        "openhaptics: the device \"Right\" can't be had: Communication error (error 0x0302)"
    );
    wait_until("frames go on after both", || hand.read().is_ok());
    wait_until("the force arrives", || {
        hand.set_force(DVec3::X).expect("it pushes");
        standin.force(0) == [1.0, 0.0, 0.0]
    });
    drop(hand);
    assert_eq!(standin.force(0), [0.0; 3]);
    assert!(!standin.function::<InUse>("standin_in_use")(), "nothing is open, on, scheduled or running");
}

#[test]
fn two_devices_share_the_scheduler_and_one_goes_on_when_the_other_is_left() {
    let (_alone, standin) = standin();
    standin.function::<Transform>("standin_transform")(1, &at(1000.0, 0.0, 0.0));
    let (mut first, mut second) = (open(&standin, "0"), open(&standin, "Left"));
    wait_until("frames of both", || first.read().is_ok() && second.read().is_ok());
    assert_eq!(second.next().position, DVec3::X);
    wait_until("both push", || {
        first.set_force(DVec3::X).and(second.set_force(DVec3::Y)).expect("they push");
        standin.force(0) == [1.0, 0.0, 0.0] && standin.force(1) == [0.0, 1.0, 0.0]
    });
    drop(first);
    assert_eq!(standin.force(0), [0.0; 3]);
    wait_until("the second goes on", || {
        second.set_force(DVec3::Z).expect("it pushes");
        second.read().is_ok() && standin.force(1) == [0.0, 0.0, 1.0]
    });
}

#[test]
fn errors_of_forces_are_not_errors_of_places_and_both_pass_with_their_cause() {
    let (_alone, standin) = standin();
    let fault = standin.function::<Code>("standin_fault");
    let mut hand = open(&standin, "0");
    hand.next();
    fault(0x0200);
    let warm = Err("openhaptics: the force was not given: Warm motors (error 0x0200)".to_string());
    wait_until("motors are warm", || hand.set_force(DVec3::X) == warm);
    hand.next();
    fault(0x0302);
    let gone = "openhaptics: the device reports no position: Communication error (error 0x0302)";
    wait_until("it is pulled out", || hand.read() == Err(gone.to_string()));
    assert_eq!(hand.set_force(DVec3::X), Ok(()));
    assert_eq!(standin.force(0), [0.0; 3]);
    fault(0);
    wait_until("it is back", || hand.read().is_ok());
    standin.function::<Switch>("standin_hang")(true);
    wait_until("no frames", || hand.read() == Err("openhaptics: the scheduler makes no frames".to_string()));
    drop(hand);
    assert!(!standin.function::<InUse>("standin_in_use")(), "also left while it hangs");
}

#[test]
fn numbers_that_are_not_finite_are_read_and_never_commanded() {
    let (_alone, standin) = standin();
    let mut hand = open(&standin, "0");
    standin.function::<Transform>("standin_transform")(0, &[f64::NAN; 16]);
    wait_until("garbage", || hand.next().position.is_nan());
    assert_eq!(hand.next().orientation, None);
    for metre in 0..20 {
        hand.set_force(DVec3::new(f64::NAN, 1.0, 1.0)).expect("it pushes");
        // A place that was given after the force is read: a frame has passed.
        let x = f64::from(metre);
        standin.function::<Transform>("standin_transform")(0, &at(1000.0 * x, 0.0, 0.0));
        wait_until("a frame", || (hand.next().position.x - x).abs() < PLACE_M);
    }
    assert!(!standin.function::<Pushed>("standin_pushed")(0));
}
