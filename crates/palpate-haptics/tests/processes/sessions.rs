//! The processes as threads.

use super::scenes::{half_width, model, path};
use palpate::{DeviceMode, Input, Pose};
use palpate_haptics::SceneNames;
use palpate_haptics::device::{DeviceSpec, Hand, Mount, PathDevice, SimulatedDevice};
use palpate_haptics::log::{LogReader, LogSender, LogSummary, LogWriter};
use palpate_haptics::{
    AttachedDevice, DeformationProcess, ForceProcess, SafetyLimits, SceneMotion, Scheduling, Session,
    SessionDevice,
};
use std::collections::BTreeMap;
use std::io::{Cursor, Error, Seek, SeekFrom, Write};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Instant;

fn session(steps: Option<u64>) -> Session {
    let model = model(2, 300.0);
    let edge = half_width(&model) + 0.004;
    let attached = |side: f64| {
        let wanted = path(&format!("0,{},0,0\n0.1,{},0,0\n", side * 1.1 * edge, side * 0.9 * edge));
        let device: Box<dyn palpate_haptics::device::Device> = if side > 0.0 {
            Box::new(PathDevice::new(wanted))
        } else {
            Box::new(SimulatedDevice::new(DeviceSpec::TOUCH, Hand::FIRM, wanted))
        };
        SessionDevice::Local(AttachedDevice {
            device,
            mode: DeviceMode::Touch,
            mount: Mount::default(),
            rate_hz: 1000.0,
            limits: SafetyLimits::default(),
            passive: true,
            arm_by_button: false,
        })
    };
    let floor = model.parameters().obstacles[0].pose;
    Session {
        start: Instant::now(),
        devices: vec![attached(1.0), attached(-1.0)],
        motion: SceneMotion {
            obstacles: vec![Box::new(move |_: f64| -> Pose { floor })],
            ..SceneMotion::default()
        },
        model,
        steps,
        frame_rate_hz: 60.0,
        scheduling: Scheduling { priority: None, core: None },
        device_timeout_s: 0.5,
        state: None,
        playback: Arc::default(),
        cycles: None,
        listener: None,
    }
}

/// A log of a session, whose begin fits.
fn log_to<W: Write + Seek>(out: W, session: &Session) -> (LogSender, LogWriter<W>) {
    let process = ForceProcess::new(session.model.clone(), Vec::new(), Vec::new(), 1.0);
    let names = SceneNames {
        objects: vec!["body".into()],
        devices: vec!["a".into(), "b".into()],
        obstacles: vec!["floor".into()],
        ..SceneNames::default()
    };
    let input = Input {
        devices: vec![palpate::DeviceInput::inactive(); 2],
        obstacles: vec![session.model.parameters().obstacles[0].pose],
        ..Input::default()
    };
    let start = (&*session.model, process.state(), &input);
    LogWriter::new(out, names, BTreeMap::new(), &[], start).expect("a log")
}

#[test]
fn a_session_keeps_count_makes_pictures_and_logs_every_step() {
    let session = session(Some(400));
    let log = log_to(Cursor::new(Vec::new()), &session);
    let (stop, steps) = (AtomicBool::new(false), AtomicU64::new(0));
    let mut frames = 0;
    let mut pictures = DeformationProcess::new(session.model.clone());
    let (report, out) = session
        .run(Some(log), &stop, &steps, |snapshot| {
            frames += 1;
            let frame = pictures.cycle(snapshot);
            let object = &frame.objects[0];
            let unit = |n: &[f32; 3]| (n.iter().map(|x| x * x).sum::<f32>() - 1.0).abs() < 1e-5;
            assert!(object.pose.is_some() && object.normals.iter().all(unit));
        })
        .expect("it runs");
    assert_eq!((report.steps, report.force.cycles(), steps.load(Ordering::Relaxed)), (400, 400, 400));
    assert!(frames > 3 && report.deformation.cycles() == frames, "{frames} pictures");
    assert!(report.wall_s > 0.35, "by the clock: {} s", report.wall_s);
    for device in report.devices.iter().flatten() {
        assert!(
            device.counts.updates > 50 && device.counts.failed == 0 && device.motion_to_force.count() > 50
        );
    }
    let logged = report.log.expect("a log");
    assert_eq!(logged.steps + logged.missed, 400);
    let written = out.expect("what it was written to");
    assert_eq!(written.failure, None);
    let bytes = written.sink.into_inner();
    assert_eq!(LogReader::new(&bytes).expect("a log").step_count(), logged.steps);
}

/// A disk with room for so many bytes.
struct Disk(Cursor<Vec<u8>>, usize);

impl Write for Disk {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let fits = self.0.get_ref().len() + bytes.len() <= self.1;
        if fits { self.0.write(bytes) } else { Err(Error::other("no room is left")) }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for Disk {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.0.seek(to)
    }
}

#[test]
fn a_disk_that_is_full_ends_the_log_and_nothing_else() {
    let session = session(Some(150));
    let disk = Disk(Cursor::new(Vec::new()), 10_000);
    let log = log_to(disk, &session);
    let (stop, steps) = (AtomicBool::new(false), AtomicU64::new(0));
    let (report, out) = session.run(Some(log), &stop, &steps, |_| ()).expect("it runs");
    let written = out.expect("there was a log");
    let error = written.failure.expect("it can't be written").to_string();
    assert_eq!(
        error,
        "cannot write the log: I/O error from writing, or reading a compression stream: no room is left"
    );
    // None of the steps fitted; the report counts them as missing.
    assert_eq!((report.steps, written.steps), (150, 0));
    assert_eq!(report.log, Some(LogSummary { steps: 0, missed: 150, is_cut: true }));
}

#[test]
fn a_session_without_an_end_stops_when_it_is_told() {
    let (stop, steps) = (AtomicBool::new(false), AtomicU64::new(0));
    let session = session(None);
    let report = std::thread::scope(|scope| {
        let running = scope.spawn(|| session.run::<Cursor<Vec<u8>>>(None, &stop, &steps, |_| ()));
        while steps.load(Ordering::Relaxed) < 50 {
            std::thread::yield_now();
        }
        stop.store(true, Ordering::Relaxed);
        running.join().expect("no panic").expect("it runs")
    });
    assert!(report.0.steps >= 50 && report.0.log.is_none());
}

#[test]
fn what_can_not_be_in_real_time_is_refused() {
    let mut wrong = session(Some(1));
    let SessionDevice::Local(first) = &mut wrong.devices[0] else { panic!("it is here") };
    first.rate_hz = 0.0;
    let refused = wrong.run::<Cursor<Vec<u8>>>(None, &AtomicBool::new(false), &AtomicU64::new(0), |_| ());
    let error = refused.expect_err("no rate").to_string();
    assert_eq!(error, "a device is to be updated at 0 Hz, expected 50 to 5000");
    let mut wrong = session(Some(1));
    wrong.devices.pop();
    let refused = wrong.run::<Cursor<Vec<u8>>>(None, &AtomicBool::new(false), &AtomicU64::new(0), |_| ());
    assert_eq!(refused.expect_err("one too few").to_string(), "1 devices for a scene of 2");
}
