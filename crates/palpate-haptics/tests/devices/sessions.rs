//! Sessions in which a device (a stand-in) presses a body.

#[path = "../processes/scenes.rs"]
#[allow(dead_code)]
mod scenes;

use super::standin::Standin;
use glam::DVec3;
use palpate::{DeviceMode, Model, Pose};
use palpate_haptics::device::{Device, DeviceSpec, Driver, Mount, Reading};
use palpate_haptics::{
    AttachedDevice, Error, PoseTrajectory, SafetyLimits, SceneMotion, Scheduling, Session, SessionDevice,
};
use palpate_testkit::wait_until;
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

/// Limits that a busy machine does not trip: a free body that is let go flies away.
const PATIENT: SafetyLimits = SafetyLimits { force_n: 3.0, ramp_down_s: 0.02, ..SafetyLimits::NONE };

/// Session with one armed device and a floor.
fn session(model: Arc<Model>, device: Box<dyn Device>, floor: PoseTrajectory) -> Session {
    let attached = AttachedDevice {
        device,
        mode: DeviceMode::Touch,
        mount: Mount::default(),
        rate_hz: 1000.0,
        limits: PATIENT,
        passive: true,
        arm_by_button: false,
    };
    Session {
        model,
        start: Instant::now(),
        devices: vec![SessionDevice::Local(attached)],
        motion: SceneMotion { obstacles: vec![floor], ..SceneMotion::default() },
        steps: None,
        frame_rate_hz: 0.0,
        scheduling: Scheduling { priority: None, core: None },
        device_timeout_s: 0.5,
        state: None,
        playback: Arc::default(),
        cycles: None,
        listener: None,
    }
}

/// Device that notes when its hand is pushed; its next reading panics if it is to.
struct NotesPushes {
    device: Box<dyn Device>,
    pushed: Arc<AtomicBool>,
    panics: bool,
}

impl Device for NotesPushes {
    fn spec(&self) -> DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        assert!(!self.panics || !self.pushed.load(Ordering::Relaxed), "a bug in the haptic update");
        self.device.read(now_s)
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), Error> {
        self.pushed.fetch_or(force.length() > 0.01, Ordering::Relaxed);
        self.device.set_force(force, now_s)
    }
}

/// Thread that panics.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Panics {
    ForceProcess,
    HapticUpdate,
}

/// Steps after which a session without a panic has failed.
const STEPS: u64 = 20_000;

#[test]
fn a_panic_of_a_thread_leaves_the_device_without_force() {
    for (panics, expected) in [
        (Panics::ForceProcess, "the thread of the force process panicked: a bug"),
        (Panics::HapticUpdate, "the thread of the haptic update panicked: a bug"),
    ] {
        let standin = Standin::new("libdhd");
        let place = standin.function::<extern "C" fn(usize, f64, f64, f64)>("standin_place");
        let pushed = Arc::new(AtomicBool::new(false));
        let model = scenes::model(1, 300.0);
        let edge = scenes::half_width(&model) + 0.004;
        place(0, 0.0, 1.05 * edge, 0.0);
        let device = Driver::Dhd.open("0", Some(standin.place())).expect("a device").1;
        let in_update = panics == Panics::HapticUpdate;
        let device = Box::new(NotesPushes { device, pushed: pushed.clone(), panics: in_update });
        let floor = model.parameters().obstacles[0].pose;
        let trajectory: PoseTrajectory = Box::new(move |_| {
            assert!(in_update || !pushed.load(Ordering::Relaxed), "a bug in the force process");
            floor
        });
        let session = Session { steps: Some(STEPS), ..session(model, device, trajectory) };
        let (stop, steps) = (AtomicBool::new(false), AtomicU64::new(0));
        let done = std::thread::scope(|scope| {
            let running = scope.spawn(|| session.run::<Cursor<Vec<u8>>>(None, &stop, &steps, |_| ()));
            let mut deep = 0.0;
            let is_open = standin.function::<extern "C" fn(usize) -> bool>("standin_is_open");
            wait_until("the device is closed", || {
                deep = f64::min(deep + 2e-5, 0.3 * edge);
                place(0, 0.0, 1.05 * edge - deep, 0.0);
                !is_open(0)
            });
            stop.store(true, Ordering::Relaxed);
            running.join().expect("no panic")
        });
        assert_eq!(done.expect_err("a bug").to_string(), expected);
        assert_eq!(standin.force(0), [0.0; 3]);
        assert!(!standin.function::<extern "C" fn(usize) -> bool>("standin_is_on")(0));
    }
}

#[test]
fn a_hand_with_a_device_presses_a_body_and_feels_it() {
    let standin = Standin::new("libdhd");
    let place = standin.function::<extern "C" fn(usize, f64, f64, f64)>("standin_place");
    let model = scenes::model(1, 300.0);
    let edge = scenes::half_width(&model) + 0.004;
    // From the right: theirs is y.
    place(0, 0.0, 1.05 * edge, 0.0);
    let device = Driver::Dhd.open("0", Some(standin.place())).expect("a device").1;
    let floor = model.parameters().obstacles[0].pose;
    let session = session(model, device, Box::new(move |_: f64| -> Pose { floor }));
    let (stop, steps) = (AtomicBool::new(false), AtomicU64::new(0));
    let (report, felt) = std::thread::scope(|scope| {
        let running = scope.spawn(|| session.run::<Cursor<Vec<u8>>>(None, &stop, &steps, |_| ()));
        let mut felt = [0.0; 3];
        // A millimetre in 20 steps, until it is felt or the body has been passed.
        while steps.load(Ordering::Relaxed) < 4000 && felt[1] < 0.01 {
            let deep = (steps.load(Ordering::Relaxed) as f64 * 5e-5).min(0.3 * edge);
            place(0, 0.0, 1.05 * edge - deep, 0.0);
            felt = standin.force(0);
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        stop.store(true, Ordering::Relaxed);
        (running.join().expect("no panic").expect("it runs").0, felt)
    });
    let device = report.devices[0].as_ref().expect("it was here");
    assert_eq!(device.spec.kind, "dhd");
    assert!(felt[1] > 0.01 && felt[1] > 10.0 * felt[0].hypot(felt[2]), "out of the body: {felt:?}");
    assert!(device.counts.force_max_n >= felt[1] && device.counts.failed == 0, "{:?}", device.counts);
    assert!(report.state.output().objects[0].twist.linear.x < 0.0, "and the body goes");
    assert_eq!(standin.force(0), [0.0; 3], "and is left without force");
    assert!(!standin.function::<extern "C" fn(usize) -> bool>("standin_is_open")(0));
}
