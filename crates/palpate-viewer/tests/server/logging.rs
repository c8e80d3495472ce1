//! Logs of a live scene: one per start of the scene.

use super::client::{TestServer, mode_shapes, scene};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Input, State, step};
use palpate_haptics::SceneNames;
use palpate_haptics::Scheduling;
use palpate_haptics::log::{LogReader, LogSummary, LogWriter};
use palpate_testkit::{GRAVITY_M_S2, free_block, half_extent};
use palpate_viewer::{
    JobControl, Live, LogFile, LogOpener, MaterialDescription, PageNotifier, PhysicsSettings, SceneError,
    SceneProvider, SceneSummary, ServedContent, Upload, ViewerScene,
};
use std::collections::BTreeMap;
use std::io::{Cursor, Error, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex};

/// Force of a pointer that presses the body [N], and how far it pushes and gravity moves it [m], at least.
const FELT_N: f64 = 0.02;
const PUSHED_M: f64 = 1e-4;
const FALLEN_M: f64 = 1e-3;

type FinishedLogs = Arc<Mutex<Vec<Vec<u8>>>>;

/// Log file in memory of limited size.
struct InMemory {
    bytes: Cursor<Vec<u8>>,
    capacity: usize,
    logs: FinishedLogs,
    pages: PageNotifier,
}

impl Write for InMemory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.bytes.get_ref().len() + bytes.len() > self.capacity {
            (self.pages)("no room is left");
            return Err(Error::other("no room is left"));
        }
        self.bytes.write(bytes)
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Seek for InMemory {
    fn seek(&mut self, to: SeekFrom) -> std::io::Result<u64> {
        self.bytes.seek(to)
    }
}

impl LogFile for InMemory {
    fn finish(self: Box<Self>, summary: LogSummary) {
        assert!(summary.is_cut || summary.missed == 0, "{summary:?}");
        self.logs.lock().expect("no panic").push(self.bytes.into_inner());
    }
}

fn names() -> SceneNames {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_string()).collect();
    SceneNames {
        objects: own(&["body"]),
        devices: own(&["left", "right"]),
        obstacles: own(&["floor"]),
        ..SceneNames::default()
    }
}

/// Provider of a logged scene: finished logs, capacity of a log [bytes].
struct LoggedProvider(FinishedLogs, usize);

impl LoggedProvider {
    fn scene(&self, gravity: DVec3) -> ViewerScene {
        let scene = scene(gravity, 1e-3);
        let (logs, capacity, model) = (self.0.clone(), self.1, scene.model.clone());
        let input = Input {
            devices: vec![DeviceInput::inactive(); 2],
            obstacles: (scene.motion)().obstacles.iter_mut().map(|pose| pose(0.0)).collect(),
            ..Input::default()
        };
        let open: LogOpener = Arc::new(move |state, pages| {
            let file = InMemory { bytes: Cursor::default(), capacity, logs: logs.clone(), pages };
            let start = (&*model, state, &input);
            LogWriter::new(Box::new(file) as Box<dyn LogFile>, names(), BTreeMap::new(), &[], start)
                .map_err(SceneError::other)
        });
        ViewerScene { log: Some(open), ..scene }
    }
}

impl SceneProvider for LoggedProvider {
    fn scenes(&self) -> Vec<SceneSummary> {
        Vec::new()
    }

    fn open(&self, _: &str, _: JobControl) -> Result<ViewerScene, SceneError> {
        Err("there is no other scene".into())
    }

    fn change_physics(&self, settings: &PhysicsSettings) -> Result<ViewerScene, SceneError> {
        Ok(self.scene(settings.gravity.map_or(DVec3::ZERO, DVec3::from_array)))
    }

    fn change_material(
        &self,
        _: usize,
        _: MaterialDescription,
        _: JobControl,
    ) -> Result<ViewerScene, SceneError> {
        Err("there is no other material".into())
    }

    fn record(&self, _: Upload, _: JobControl) -> Result<ViewerScene, SceneError> {
        Err("there is no other mesh".into())
    }
}

fn served(capacity: usize) -> (TestServer, FinishedLogs) {
    let logs = FinishedLogs::default();
    let provider = LoggedProvider(logs.clone(), capacity);
    let first = provider.scene(DVec3::ZERO);
    let scheduling = Scheduling { priority: None, core: None };
    let live = Live { provider: Arc::new(provider), first, scheduling };
    (TestServer::new(ServedContent::Live(Box::new(live))), logs)
}

#[test]
fn each_start_of_a_scene_is_a_log_that_replays_and_a_resumed_scene_starts_from_the_last_state() {
    let (served, logs) = served(usize::MAX);
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    let radius = free_block().surface.radius();
    let low = -half_extent(&free_block(), 0);
    let at = |x: f64| format!("[{x:?},0.001,-0.001]");
    page.send(&format!(
        r#"{{"type":"press","pointer":3,"mode":"touch","position":{}}}"#,
        at(low - 0.15 * radius)
    ));
    let deep = at(low + 0.05 * radius);
    page.send(&format!(r#"{{"type":"move","pointers":[{{"pointer":3,"position":{deep}}}]}}"#));
    page.frame(&shapes, |frame| frame.devices[0].2.length() > FELT_N && frame.position.x > PUSHED_M);
    // Pauses and single steps leave no trace in the log.
    page.send(r#"{"type":"pause","paused":true}"#);
    while page.wait("status")["paused"] != true {}
    page.send(r#"{"type":"single_step"}"#);
    page.send(r#"{"type":"set_physics","gravity":[0,-9.81,0]}"#);
    page.wait("scene");
    page.send(r#"{"type":"pause","paused":false}"#);
    page.frame(&shapes, |frame| frame.generation as u64 == generation + 1 && frame.position.y < -FALLEN_M);
    page.send(r#"{"type":"reset"}"#);
    page.wait("scene");
    page.frame(&shapes, |frame| frame.generation as u64 == generation + 2 && frame.step > 20);
    drop(served);

    let logs = logs.lock().expect("no panic");
    assert_eq!(logs.len(), 3);
    let mut before = None;
    for (bytes, gravity) in logs.iter().zip([DVec3::ZERO, DVec3::Y * -GRAVITY_M_S2, DVec3::Y * -GRAVITY_M_S2])
    {
        let reader = LogReader::new(bytes).expect("a whole log");
        let model = scene(gravity, 1e-3).model;
        let motions = reader.start(&names()).expect("readable").expect("how the body begins");
        let mut state = State::resume(&model, &motions);
        let (mut max_force, mut steps) = (0.0_f64, 0);
        for logged in reader.logged_steps() {
            let logged = logged.expect("a step");
            let input = logged.input(&names(), &[DeviceMode::Touch; 2]).expect("an input");
            max_force = max_force.max(step(&model, &mut state, &input).devices[0].force_on_hand.length());
            assert_eq!(logged.first_difference(&names(), state.output()), None, "step {}", logged.step);
            steps += 1;
        }
        assert!(steps > 0, "an empty log");
        match before {
            None => assert!(max_force > FELT_N, "{max_force} N"),
            Some(before) if std::ptr::eq(bytes, &logs[1]) => assert_eq!(motions, before),
            Some(_) => assert_eq!(motions, State::new(&model).snapshots()),
        }
        before = Some(state.snapshots());
    }
}

#[test]
fn a_full_disk_ends_the_log_and_the_scene_keeps_running() {
    let (served, logs) = served(30_000);
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    page.send(r#"{"type":"set_physics","gravity":[0,-9.81,0]}"#);
    page.wait("scene");
    assert_eq!(page.wait("error")["text"], "no room is left");
    page.frame(&shapes, |frame| frame.position.y < -0.1);
    // The scene still resumes from its state.
    page.send(r#"{"type":"set_physics","gravity":[0,0,0]}"#);
    page.wait("scene");
    let on = page.frame(&shapes, |frame| frame.generation as u64 == generation + 2);
    assert!(on.position.y < -0.01, "it falls, or bounces off the floor: {}", on.position);
    drop(served);
    // Every log can be read as far as it was written; the disk took no whole chunk of some.
    for bytes in logs.lock().expect("no panic").iter() {
        match LogReader::new(bytes) {
            Ok(reader) => assert!(reader.logged_steps().all(|logged| logged.is_ok())),
            Err(error) => assert_eq!(
                error.to_string(),
                "the log ends before its first whole step: nothing of it can be read"
            ),
        }
    }
}
