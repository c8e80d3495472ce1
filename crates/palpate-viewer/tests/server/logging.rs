//! What happens in a scene is logged: one log each time that it begins anew.

use super::client::{Served, recording, shapes, stage};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Input, State, step};
use palpate_haptics::Scheduling;
use palpate_haptics::log::{LogSummary, LogWriter, Names, Reader};
use palpate_viewer::{
    Live, LogFile, LogOpener, MaterialDescription, PageNotifier, PhysicsSettings, ProgressCallback,
    SceneProvider, SceneSummary, ServedContent, Upload, ViewerScene,
};
use std::collections::BTreeMap;
use std::io::{Cursor, Error, Seek, SeekFrom, Write};
use std::sync::{Arc, Mutex};

type Kept = Arc<Mutex<Vec<Vec<u8>>>>;

/// A log in memory with room for so many bytes.
struct InMemory {
    bytes: Cursor<Vec<u8>>,
    room: usize,
    kept: Kept,
    pages: PageNotifier,
}

impl Write for InMemory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        if self.bytes.get_ref().len() + bytes.len() > self.room {
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
        assert_eq!(summary.missed, 0);
        self.kept.lock().expect("no panic").push(self.bytes.into_inner());
    }
}

fn names() -> Names {
    let own = |names: &[&str]| names.iter().map(|name| (*name).to_string()).collect();
    Names { objects: own(&["body"]), devices: own(&["left", "right"]), obstacles: own(&["floor"]) }
}

/// A body in weightlessness that is logged.
struct Logged(Kept, usize);

impl Logged {
    fn stage(&self, gravity: DVec3) -> ViewerScene {
        let stage = stage(gravity, 1e-3);
        let (kept, room, model) = (self.0.clone(), self.1, stage.model.clone());
        let input = Input {
            devices: vec![DeviceInput::inactive(); 2],
            obstacles: stage.movers.iter().map(|mover| mover(0.0)).collect(),
        };
        let open: LogOpener = Arc::new(move |state, pages| {
            let file = InMemory { bytes: Cursor::default(), room, kept: kept.clone(), pages };
            let start = (&*model, state, &input);
            LogWriter::new(Box::new(file) as Box<dyn LogFile>, names(), BTreeMap::new(), &[], start)
                .map_err(|error| error.to_string())
        });
        ViewerScene { log: Some(open), ..stage }
    }
}

impl SceneProvider for Logged {
    fn titles(&self) -> Vec<SceneSummary> {
        Vec::new()
    }

    fn open(&self, _: &str, _: ProgressCallback) -> Result<ViewerScene, String> {
        Err("there is no other scene".into())
    }

    fn change(&self, rules: &PhysicsSettings) -> Result<ViewerScene, String> {
        Ok(self.stage(rules.gravity.map_or(DVec3::ZERO, DVec3::from_array)))
    }

    fn change_material(
        &self,
        _: usize,
        _: MaterialDescription,
        _: ProgressCallback,
    ) -> Result<ViewerScene, String> {
        Err("there is no other material".into())
    }

    fn record(&self, _: Upload, _: ProgressCallback) -> Result<ViewerScene, String> {
        Err("there is no other mesh".into())
    }
}

fn served(room: usize) -> (Served, Kept) {
    let kept = Kept::default();
    let workshop = Logged(kept.clone(), room);
    let first = workshop.stage(DVec3::ZERO);
    let scheduling = Scheduling { priority: None, core: None };
    let live = Live { workshop: Arc::new(workshop), first, scheduling };
    (Served::new(ServedContent::Live(Box::new(live))), kept)
}

#[test]
fn every_scene_is_a_log_that_repeats_and_one_that_goes_on_begins_where_the_last_was() {
    let (served, kept) = served(usize::MAX);
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = shapes(&served.get(&format!("/scene/{generation}/object/0/shapes")).1);
    let radius = recording().surface.radius();
    let low = recording().surface.positions.iter().map(|place| place.x).fold(0.0, f64::min);
    let at = |x: f64| format!("[{x:?},0.001,-0.001]");
    page.send(&format!(
        r#"{{"type":"press","pointer":3,"mode":"touch","position":{}}}"#,
        at(low - 0.15 * radius)
    ));
    let deep = at(low + 0.05 * radius);
    page.send(&format!(r#"{{"type":"move","pointers":[{{"pointer":3,"position":{deep}}}]}}"#));
    page.picture(&shapes, |picture| picture.devices[0].2.length() > 0.02 && picture.position.x > 1e-4);
    // Paused and by single steps: simulated time is what counts.
    page.send(r#"{"type":"pause","paused":true}"#);
    while page.wait("status")["paused"] != true {}
    page.send(r#"{"type":"step"}"#);
    page.send(r#"{"type":"set","gravity":[0,-9.81,0]}"#);
    page.wait("scene");
    page.send(r#"{"type":"pause","paused":false}"#);
    page.picture(&shapes, |picture| {
        picture.generation as u64 == generation + 1 && picture.position.y < -1e-3
    });
    page.send(r#"{"type":"reset"}"#);
    page.wait("scene");
    page.picture(&shapes, |picture| picture.generation as u64 == generation + 2 && picture.step > 20);
    drop(served);

    let kept = kept.lock().expect("no panic");
    assert_eq!(kept.len(), 3);
    let mut before = None;
    for (bytes, gravity) in kept.iter().zip([DVec3::ZERO, DVec3::Y * -9.81, DVec3::Y * -9.81]) {
        let reader = Reader::new(bytes).expect("a whole log");
        let model = stage(gravity, 1e-3).model;
        let motions = reader.start(&names()).expect("readable").expect("how the body begins");
        let mut state = State::resume(&model, &motions);
        let (mut felt, mut steps) = (0.0_f64, 0);
        for logged in reader.each_step() {
            let logged = logged.expect("a step");
            let input = logged.input(&names(), &[DeviceMode::Touch; 2]).expect("an input");
            felt = felt.max(step(&model, &mut state, &input).devices[0].force_on_hand.length());
            assert_eq!(logged.difference(&names(), state.output()), None, "step {}", logged.step);
            steps += 1;
        }
        assert!(steps > 0, "an empty log is kept");
        match before {
            None => assert!(felt > 0.02, "{felt} N"),
            Some(before) if std::ptr::eq(bytes, &kept[1]) => assert_eq!(motions, before),
            Some(_) => assert_eq!(motions, State::new(&model).snapshots()),
        }
        before = Some(state.snapshots());
    }
}

#[test]
fn a_full_disk_ends_the_log_and_the_scene_goes_on() {
    let (served, kept) = served(30_000);
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = shapes(&served.get(&format!("/scene/{generation}/object/0/shapes")).1);
    page.send(r#"{"type":"set","gravity":[0,-9.81,0]}"#);
    page.wait("scene");
    assert_eq!(page.wait("error")["text"], "no room is left");
    page.picture(&shapes, |picture| picture.position.y < -0.1);
    // Without its log the scene still goes on from where it is.
    page.send(r#"{"type":"set","gravity":[0,0,0]}"#);
    page.wait("scene");
    let on = page.picture(&shapes, |picture| picture.generation as u64 == generation + 2);
    assert!(on.position.y < -0.01, "it falls, or bounces off the floor: {}", on.position);
    drop(served);
    // What was begun last had room enough, or not: nothing that is kept is half a log.
    for bytes in kept.lock().expect("no panic").iter() {
        assert!(Reader::new(bytes).expect("a whole log").each_step().all(|logged| logged.is_ok()));
    }
}
