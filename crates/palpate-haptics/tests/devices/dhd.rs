//! Force Dimension: axes, units, wrists, and devices that come and go. In simulated time.

use super::standin::Standin;
use glam::{DQuat, DVec3};
use palpate_haptics::device::{Device, Driver, Mount};
use palpate_haptics::{Effort, HapticUpdate, Safety, SafetyLimits, port};

type Place = extern "C" fn(usize, f64, f64, f64);
type Number = extern "C" fn(usize);
type Press = extern "C" fn(usize, u32);
type Turn = extern "C" fn(usize, &[[f64; 3]; 3]);
type Switch = extern "C" fn(bool);
type StiffnessLimit = extern "C" fn(f64);
type IsOpen = extern "C" fn(usize) -> bool;

fn open(standin: &Standin, which: &str) -> Box<dyn Device> {
    Driver::Dhd.open(which, Some(standin.place())).expect("a device").1
}

#[test]
fn connected_devices_are_listed_with_serial_number_and_force() {
    let standin = Standin::new("libdhd");
    standin.function::<Number>("standin_plug")(2);
    standin.function::<StiffnessLimit>("standin_limit")(7.5);
    let found = Driver::Dhd.find(Some(standin.place())).expect("two devices");
    let told: Vec<String> = found.iter().map(|one| format!("{one}, {:?} N", one.force_n)).collect();
    assert_eq!(told, ["0: omega.3 (301), Some(7.5) N", "1: omega.7 (702), Some(7.5) N"]);
    assert_eq!(open(&standin, "702").spec().force_n, 7.5, "its maker's limit");
    standin.function::<StiffnessLimit>("standin_limit")(-1.0);
    assert_eq!(open(&standin, "0").spec().force_n, 12.0, "no limit: the data sheet's");
    let error = Driver::Dhd.open("999", Some(standin.place())).err().expect("no such device");
    assert_eq!(error.to_string(), "dhd: there is no device \"999\", only 0: omega.3 (301), 1: omega.7 (702)");
    standin.function::<Number>("standin_plug")(0);
    let error = Driver::Dhd.find(Some(standin.place())).expect_err("none").to_string();
    assert!(error.starts_with("dhd: there is no device: connect one and switch it on"), "{error}");
}

#[test]
fn positions_forces_orientations_and_buttons_are_in_the_device_frame() {
    let standin = Standin::new("libdhd");
    standin.function::<Number>("standin_plug")(2);
    let mut device = open(&standin, "1");
    // Theirs: 10 mm towards the operator, 20 mm to the right, 30 mm up.
    standin.function::<Place>("standin_place")(1, 0.01, 0.02, 0.03);
    standin.function::<Press>("standin_press")(1, 0b101);
    // A quarter turn about the axis that points up, from "towards the operator" to "right".
    standin.function::<Turn>("standin_turn")(1, &[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]);
    let reading = device.read(0.0).expect("it reads");
    assert_eq!((reading.position, reading.buttons), (DVec3::new(0.02, 0.03, 0.01), 0b101));
    let turned = reading.orientation.expect("it has a wrist");
    assert!(turned.angle_between(DQuat::from_rotation_y(std::f64::consts::FRAC_PI_2)) < 1e-9, "{turned}");
    device.set_force(DVec3::new(1.0, 2.0, 3.0), 0.0).expect("it pushes");
    assert_eq!(standin.force(1), [3.0, 1.0, 2.0], "towards the operator, right, up");
    // What is no number goes nowhere, and what is no rotation is not told.
    device.set_force(DVec3::new(1.0, f64::NAN, 0.0), 0.0).expect("it pushes");
    assert_eq!(standin.force(1), [0.0; 3]);
    standin.function::<Turn>("standin_turn")(1, &[[f64::NAN; 3]; 3]);
    assert_eq!(device.read(0.0).expect("it reads").orientation, None);
    assert_eq!(open(&standin, "0").read(0.0).expect("it reads").orientation, None, "an omega.3 has no wrist");
}

#[test]
fn a_device_is_opened_once_and_left_without_force() {
    let standin = Standin::new("libdhd");
    let mut device = open(&standin, "0");
    assert_eq!(standin.force(0), [0.0; 3], "forces are on, and none is given");
    let twice = Driver::Dhd.open("0", Some(standin.place())).err().expect("it is taken");
    assert_eq!(twice.to_string(), "dhd: 0: a device can't be had: device is already in use");
    device.set_force(DVec3::Y, 0.0).expect("it pushes");
    assert_eq!(standin.force(0), [0.0, 0.0, 1.0]);
    drop(device);
    assert_eq!(standin.force(0), [0.0; 3]);
    assert!(!standin.function::<IsOpen>("standin_is_open")(0));
}

/// A haptic update with a stand-in, which waits for a button, and an effort that goes on.
struct Loop {
    standin: Standin,
    update: HapticUpdate,
    port: palpate_haptics::ForcePort,
    tick: u64,
}

impl Loop {
    fn new() -> Self {
        let standin = Standin::new("libdhd");
        let (device_port, port) = port();
        let limits = SafetyLimits { ramp_up_s: 0.1, ..SafetyLimits::default() };
        let device = open(&standin, "0");
        let update =
            HapticUpdate::new(device, device_port, Mount::default(), Safety::new(limits), None, true);
        Self { standin, update, port, tick: 0 }
    }

    /// Go on for some milliseconds; gives the force then, upwards.
    fn run(&mut self, ticks: u64) -> f64 {
        for _ in 0..ticks {
            self.tick += 1;
            let now_s = self.tick as f64 * 1e-3;
            let in_reply_to = self.port.newest().sequence;
            let (force, absorbed_j) = (DVec3::Y, 0.0);
            let effort = Effort { sequence: self.tick, in_reply_to, time_s: now_s, force, absorbed_j };
            self.port.send(effort);
            self.update.cycle(now_s);
        }
        self.standin.force(0)[2]
    }

    fn press(&mut self) {
        self.standin.function::<Press>("standin_press")(0, 1);
        self.run(2);
        self.standin.function::<Press>("standin_press")(0, 0);
    }
}

#[test]
fn a_button_that_is_pressed_lets_force_through_and_one_that_was_held_does_not() {
    let mut it = Loop::new();
    it.standin.function::<Press>("standin_press")(0, 1);
    assert_eq!(it.run(300), 0.0, "it was held all along");
    it.standin.function::<Press>("standin_press")(0, 0);
    assert_eq!(it.run(300), 0.0);
    it.press();
    assert!((it.run(200) - 1.0).abs() < 1e-9);
}

#[test]
fn a_fault_takes_the_force_away_by_its_ramp_and_gives_it_back_by_itself() {
    let mut it = Loop::new();
    it.run(1);
    it.press();
    it.run(300);
    let failing = it.standin.function::<Switch>("standin_fail");
    failing(true);
    it.run(10);
    failing(false);
    // What the device has missed meanwhile went down by the ramp: half of 20 ms.
    let half = it.run(1);
    assert!(half > 0.3 && half < 0.6, "{half}");
    assert_eq!(it.run(20), 0.0);
    assert_eq!(it.update.counts().safety.trips, 1);
    assert!(it.update.counts().failed >= 10, "{:?}", it.update.counts());
    let why = it.update.failure().expect("why").to_string();
    assert_eq!(why, "dhd: can't read the position: communication error");
    assert!((it.run(400) - 1.0).abs() < 1e-9, "it comes back");
}

#[test]
fn a_device_that_is_pulled_out_is_found_again_and_gives_force_after_a_press_only() {
    let mut it = Loop::new();
    it.run(1);
    it.press();
    it.run(300);
    let plug = it.standin.function::<Number>("standin_plug");
    plug(0);
    it.run(2000);
    assert!(!it.standin.function::<IsOpen>("standin_is_open")(0), "it was given up");
    plug(1);
    it.run(1500);
    assert!(it.standin.function::<IsOpen>("standin_is_open")(0), "and found again");
    assert_eq!(it.run(500), 0.0, "who knows who holds it now");
    it.press();
    assert!((it.run(300) - 1.0).abs() < 1e-9);
}

#[test]
fn numbers_that_are_not_finite_never_reach_the_hand() {
    let mut it = Loop::new();
    it.run(1);
    it.press();
    it.run(300);
    let place = it.standin.function::<Place>("standin_place");
    for garbage in [f64::NAN, f64::INFINITY, 1e300, 5.0] {
        place(0, 0.0, garbage, 0.0);
        let before = it.run(1);
        let after = it.run(40);
        assert!(before.is_finite() && after.is_finite() && it.port.newest().position.is_finite());
        place(0, 0.0, 0.0, 0.0);
        let trips = it.update.counts().safety.trips;
        assert!(trips > 0, "{garbage}");
        assert!((it.run(500) - 1.0).abs() < 1e-9);
    }
    let safety = it.update.counts().safety;
    assert!(safety.not_finite > 2 && safety.overspeed > 0, "{safety:?}");
}

#[test]
fn the_device_s_own_watchdog_is_set_and_forces_come_back_from_zero_after_it() {
    let standin = Standin::new("libdhd");
    let mut device = open(&standin, "0");
    assert_eq!(standin.function::<extern "C" fn(usize) -> u32>("standin_watchdog")(0), 30_000, "30 ms");
    let is_on = standin.function::<IsOpen>("standin_is_on");
    let mut push = || device.set_force(DVec3::Y, 0.0).expect("it pushes");
    push();
    // However busy the machine is: within the watchdog's time at some time.
    palpate_testkit::wait_until("a force", || {
        push();
        standin.force(0) == [0.0, 0.0, 1.0]
    });
    std::thread::sleep(std::time::Duration::from_millis(40));
    push();
    assert!(is_on(0) && standin.force(0) == [0.0; 3], "zero first: {:?}", standin.force(0));
    palpate_testkit::wait_until("the force again", || {
        push();
        standin.force(0) == [0.0, 0.0, 1.0]
    });
}
