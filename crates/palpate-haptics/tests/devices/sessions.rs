//! Session in which a device (a stand-in) presses a body.

#[path = "../processes/scenes.rs"]
#[allow(dead_code)]
mod scenes;

use super::standin::Standin;
use palpate::{DeviceMode, Pose};
use palpate_haptics::device::{Driver, Mount};
use palpate_haptics::{AttachedDevice, SafetyLimits, Scheduling, Session, SessionDevice};
use std::io::Cursor;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

#[test]
fn a_hand_with_a_device_presses_a_body_and_feels_it() {
    let standin = Standin::new("libdhd");
    let place = standin.function::<extern "C" fn(usize, f64, f64, f64)>("standin_place");
    let model = scenes::model(1, 300.0);
    let edge = scenes::half_width(&model) + 0.004;
    // From the right: theirs is y.
    place(0, 0.0, 1.05 * edge, 0.0);
    let device = Driver::Dhd.open("0", Some(standin.place())).expect("a device").1;
    let attached = AttachedDevice {
        device,
        mode: DeviceMode::Touch,
        mount: Mount::default(),
        rate_hz: 1000.0,
        limits: SafetyLimits { ramp_up_s: 0.01, ..SafetyLimits::default() },
        passive: true,
        arm_by_button: false,
    };
    let floor = model.parameters().obstacles[0].pose;
    let session = Session {
        model,
        start: Instant::now(),
        devices: vec![SessionDevice::Local(attached)],
        obstacle_trajectories: vec![Box::new(move |_: f64| -> Pose { floor })],
        clamp_paths: Vec::new(),
        base_paths: Vec::new(),
        gravity: None,
        steps: None,
        frame_rate_hz: 0.0,
        scheduling: Scheduling { priority: None, core: None },
        device_timeout_s: 0.5,
        state: None,
        playback: Arc::default(),
        cycles: None,
    };
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
