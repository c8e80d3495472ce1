//! Log of a live scene that was recorded by its inputs: it replays bit for bit, and ends with its limits or the next start.

use glam::DVec3;
use palpate::{DeviceInput, Input, State};
use palpate_haptics::InputRecord;
use palpate_scene::{
    LogMaker, LogReplay, PartsInMemory, ReplayError, RunMode, TouchableScene, read_scene_text,
    read_touchable_scene,
};
use palpate_testkit::FREE_BLOCK_FILE;
use palpate_viewer::{LONGEST_RECORD_S, LocalScene, PageMessage, ViewerDevice, ViewerScene, describe_scene};
use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

const SCENE: &str = "gravity = [0.0, -9.81, 0.0]\n[[object]]\nname = \"block\"\nrecording = \"block.palp\"\nposition = [0.0, 0.2, 0.0]\n\
                     [[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n";

/// Live scene, its text with pointers, and its clock.
struct Page {
    scene: LocalScene,
    text: String,
    parts: PartsInMemory,
    now_s: Cell<f64>,
}

fn ignore(_: PageMessage) {}

/// The scene's recording.
fn block() -> PartsInMemory {
    let mut parts = PartsInMemory::default();
    let recording = palpate::Recording::from_bytes(FREE_BLOCK_FILE).expect("a recording");
    parts.recordings.insert("block.palp".into(), Arc::new(recording));
    parts
}

impl Page {
    fn new() -> Self {
        let parts = block();
        let read = read_touchable_scene(Path::new("scene"), SCENE.into(), &parts).expect("a scene");
        let TouchableScene { scene, text, .. } = read;
        let description = describe_scene(&scene, (None, "A block".to_string(), String::new()), &[true]);
        let scene = ViewerScene::new(&scene, description, |_| ViewerDevice::Pointer);
        let scene = LocalScene::new(scene).expect("pointers only");
        Self { scene, text, parts, now_s: Cell::new(0.0) }
    }

    fn run(&mut self, duration_s: f64) {
        let end = self.now_s.get() + duration_s;
        while self.now_s.get() < end {
            self.now_s.set(self.now_s.get() + 0.004);
            self.scene.advance(&|| self.now_s.get(), &mut ignore);
        }
    }

    fn receive(&mut self, message: &str) {
        self.scene.receive(message, &mut ignore);
    }

    /// Log of the record.
    fn log(&mut self) -> Option<Vec<u8>> {
        let inputs = self.scene.end_record()?;
        let numbers = inputs.numbers().to_vec();
        let mut maker = LogMaker::new(self.text.clone(), &self.parts, numbers, 1).expect("a record");
        while maker.advance().expect("a step") {}
        assert_eq!(maker.steps(), inputs.steps());
        maker.finish().ok()
    }
}

/// Number of steps of a log that repeats bit for bit, and the largest force on a hand [N].
fn replayed(log: Vec<u8>) -> (u64, f64) {
    let log = LogReplay::from_bytes(Path::new("own.mcap"), log).expect("a log");
    let mut state: State = log.initial_state().expect("a state");
    let mut largest = 0.0_f64;
    let replayed = log.replay(&mut state, u64::MAX, |_, state, _| -> Result<(), ReplayError> {
        let forces = state.output().devices.iter().map(|device| device.force_on_hand.length());
        largest = forces.fold(largest, f64::max);
        Ok(())
    });
    let replayed = replayed.expect("the bits of the live scene");
    assert_eq!(replayed.first_difference, None);
    (replayed.steps, largest)
}

#[test]
fn a_recorded_run_is_a_log_that_repeats_bit_for_bit() {
    let mut page = Page::new();
    // The block has fallen when the record begins, which starts from its state.
    page.run(1.0);
    page.scene.begin_record(&mut ignore).expect("a scene");
    page.run(0.1);
    page.receive(r#"{"type":"press","pointer":1,"mode":"touch","position":[0,0.2,0]}"#);
    page.run(0.1);
    for height in 0..60 {
        let y = 0.2 - 0.003 * f64::from(height);
        page.receive(&format!(r#"{{"type":"move","pointers":[{{"pointer":1,"position":[0,{y},0]}}]}}"#));
        page.run(0.016);
    }
    page.receive(r#"{"type":"release","pointer":1}"#);
    page.receive(r#"{"type":"press","pointer":2,"mode":"hold","position":[0,0.05,0],"object":0,"triangle":3,"weights":[0.2,0.3,0.5]}"#);
    page.run(0.2);
    let log = page.log().expect("a log");
    let (steps, largest) = replayed(log);
    assert!((1300..=1500).contains(&steps), "{steps} steps");
    assert!(largest > 0.05, "the largest force is {largest} N");
    assert!(page.log().is_none(), "a record gives one log");
}

#[test]
fn a_start_of_the_scene_ends_the_record() {
    let mut page = Page::new();
    page.scene.begin_record(&mut ignore).expect("a scene");
    page.run(0.2);
    page.receive(r#"{"type":"reset"}"#);
    page.run(0.5);
    let (steps, _) = replayed(page.log().expect("a log"));
    assert!((190..=210).contains(&steps), "{steps} steps");
}

#[test]
fn a_record_has_a_largest_length() {
    let mut page = Page::new();
    page.scene.begin_record(&mut ignore).expect("a scene");
    page.run(LONGEST_RECORD_S + 1.0);
    let inputs = page.scene.end_record().expect("a record");
    assert_eq!(inputs.steps() as f64 * 0.001, LONGEST_RECORD_S);
}

#[test]
fn a_record_without_steps_gives_no_log() {
    let mut page = Page::new();
    page.scene.begin_record(&mut ignore).expect("a scene");
    assert!(page.log().is_none());
}

#[test]
fn a_log_says_where_devices_are_that_nobody_moves() {
    let parts = block();
    // As a program of its own moves it: without a path, and no pointer of the page.
    let text = format!("{SCENE}[[device]]\nname = \"finger\"\nmode = \"touch\"\ntip_radius = 0.01\n");
    let scene = read_scene_text(Path::new("scene"), &text, &parts, RunMode::RealTime).expect("a scene");
    let mut inputs = InputRecord::new(&State::new(&scene.model).snapshots());
    for step in 0..300 {
        let position = DVec3::Y * (0.35 - 0.001 * f64::from(step));
        inputs.push(&Input { devices: vec![DeviceInput::touching(position)], ..scene.input_at(0.0) });
    }
    let mut maker = LogMaker::new(text, &parts, inputs.numbers().to_vec(), 1).expect("a scene of a log");
    while maker.advance().expect("a step") {}
    let (steps, largest) = replayed(maker.finish().expect("a log"));
    assert_eq!(steps, 300);
    assert!(largest > 0.01, "the largest force is {largest} N");
}
