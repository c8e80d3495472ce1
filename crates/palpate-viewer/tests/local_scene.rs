//! A live scene without threads: the protocol of the server, in simulated time.

use glam::{DQuat, DVec3};
use palpate_haptics::device::Reading;
use palpate_scene::{PartsInMemory, read_touchable_scene};
use palpate_testkit::FREE_BLOCK_FILE;
use palpate_viewer::{
    DevicePlace, LocalRequest, LocalScene, PageMessage, ViewerDevice, ViewerScene, describe_scene,
};
use serde_json::{Value, json};
use std::cell::Cell;
use std::path::Path;
use std::sync::Arc;

const SCENE: &str = "gravity = [0.0, -9.81, 0.0]\n[[object]]\nname = \"block\"\nrecording = \"block.palp\"\nposition = [0.0, 0.2, 0.0]\n\
                     [[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n";

/// Scene with a clock of its own, and what it has sent.
struct Page {
    scene: LocalScene,
    now_s: Cell<f64>,
    texts: Vec<Value>,
    frames: Vec<Vec<u8>>,
    sounds: Vec<Vec<u8>>,
}

fn viewer_scene(text: &str) -> ViewerScene {
    let recording = palpate::Recording::from_bytes(FREE_BLOCK_FILE).expect("a recording");
    let mut parts = PartsInMemory::default();
    parts.recordings.insert("block.palp".into(), Arc::new(recording));
    let read = read_touchable_scene(Path::new("scene"), text.into(), &parts).expect("a scene");
    let titles = (Some("block".to_string()), "A block".to_string(), String::new());
    let description = describe_scene(&read.scene, titles, &[true]);
    ViewerScene::new(&read.scene, description, |_| ViewerDevice::Pointer)
}

impl Page {
    fn new(text: &str) -> Self {
        let scene = LocalScene::new(viewer_scene(text)).expect("pointers only");
        let mut page =
            Self { scene, now_s: Cell::new(0.0), texts: Vec::new(), frames: Vec::new(), sounds: Vec::new() };
        page.call(|scene, _, send| scene.greet(Vec::new(), send));
        page
    }

    fn call<T>(
        &mut self,
        run: impl FnOnce(&mut LocalScene, &Cell<f64>, &mut dyn FnMut(PageMessage)) -> T,
    ) -> T {
        let (texts, frames, sounds) = (&mut self.texts, &mut self.frames, &mut self.sounds);
        run(&mut self.scene, &self.now_s, &mut |message| match message {
            PageMessage::Text(text) => texts.push(serde_json::from_str(&text).expect("JSON")),
            PageMessage::Frame(frame) => frames.push(frame),
            PageMessage::Sound(block) => sounds.push(block),
        })
    }

    fn receive(&mut self, message: &str) -> Option<LocalRequest> {
        self.call(|scene, _, send| scene.receive(message, send))
    }

    /// Wakes the scene every 4 ms of its clock, in which a step takes no time.
    fn run(&mut self, duration_s: f64) {
        let end = self.now_s.get() + duration_s;
        while self.now_s.get() < end {
            self.now_s.set(self.now_s.get() + 0.004);
            self.call(|scene, now, send| scene.advance(&|| now.get(), send));
        }
    }

    fn newest(&self, kind: &str) -> &Value {
        self.texts.iter().rev().find(|text| text["type"] == kind).expect("a message of this kind")
    }

    fn steps(&mut self) -> u64 {
        self.receive(r#"{"type":"slow_motion","slowdown":1}"#);
        self.newest("status")["steps"].as_u64().expect("a number")
    }
}

/// Position of the block in a frame [m, world].
fn height(frame: &[u8]) -> f64 {
    // Header of 24 bytes, energies, four counts, two words; then the pose of the first object.
    let energies = palpate::EnergyLedger::default().named().len();
    let at = 24 + 4 * energies + 4 * 4 + 8 + 4;
    f64::from(f32::from_le_bytes(frame[at..at + 4].try_into().expect("four bytes")))
}

#[test]
fn a_page_gets_what_a_server_sends_and_steps_follow_the_clock() {
    let mut page = Page::new(SCENE);
    let kinds: Vec<&str> = page.texts.iter().filter_map(|text| text["type"].as_str()).collect();
    assert_eq!(kinds, ["hello", "scene", "status"]);
    assert_eq!(page.texts[0]["records"], false);
    assert_eq!(page.frames.len(), 1, "the initial state");
    page.run(0.1);
    // The first steps are made when the clock wakes; from then on none is left out.
    let (before, at) = (page.steps(), page.now_s.get());
    page.run(1.0);
    assert_eq!(page.steps() - before, ((page.now_s.get() - at) * 1e3).round() as u64);
    assert!((58..=70).contains(&page.frames.len()), "{} frames in 1.1 s", page.frames.len());
    let (first, last) = (height(&page.frames[0]), height(page.frames.last().expect("frames")));
    assert!((first - 0.2).abs() < 1e-6 && last < first - 0.05, "it falls from {first} to {last}");
}

#[test]
fn time_in_which_the_page_slept_is_skipped() {
    let mut page = Page::new(SCENE);
    page.run(0.1);
    let before = page.steps();
    page.now_s.set(page.now_s.get() + 3600.0);
    page.run(0.004);
    let made = page.steps() - before;
    assert!(made <= 60, "{made} steps after an hour");
    assert!(page.newest("status")["force_process"]["overruns"].as_u64() > Some(0), "it says so");
    let (before, at) = (page.steps(), page.now_s.get());
    page.run(0.5);
    assert_eq!(page.steps() - before, ((page.now_s.get() - at) * 1e3).round() as u64);
}

#[test]
fn a_slow_machine_answers_between_bursts_of_steps() {
    let mut page = Page::new(SCENE);
    page.run(0.02);
    // Each reading of the clock is 2 ms later: a step of 1 ms is never in time.
    page.call(|scene, now, send| {
        let clock = || {
            now.set(now.get() + 0.002);
            now.get()
        };
        scene.advance(&clock, send);
    });
    let before = page.now_s.get();
    page.call(|scene, now, send| {
        let clock = || {
            now.set(now.get() + 0.002);
            now.get()
        };
        scene.advance(&clock, send);
    });
    assert!(page.now_s.get() - before < 0.03, "{} s without a look at messages", page.now_s.get() - before);
}

#[test]
fn pointers_press_pause_steps_and_reset_work_as_with_a_server() {
    let mut page = Page::new(SCENE);
    page.run(3.0);
    let top = 0.3;
    page.receive(&format!(r#"{{"type":"press","pointer":1,"mode":"touch","position":[0.0,{top},0.0]}}"#));
    assert_eq!(page.newest("assigned")["device"], 0);
    page.receive(r#"{"type":"move","pointers":[{"pointer":1,"position":[0.0,0.02,0.0]}]}"#);
    page.run(0.5);
    let pressed = page.frames.last().expect("frames").clone();
    page.receive(r#"{"type":"release","pointer":1}"#);
    page.receive(r#"{"type":"pause","paused":true}"#);
    page.run(0.1);
    let paused = page.steps();
    page.run(0.1);
    assert_eq!(page.steps(), paused);
    page.receive(r#"{"type":"single_step"}"#);
    page.run(0.02);
    assert_eq!(page.steps(), paused + 1);
    page.receive(r#"{"type":"pause","paused":false}"#);
    page.receive(r#"{"type":"reset"}"#);
    assert_eq!(page.newest("scene")["generation"], 2);
    assert!((height(page.frames.last().expect("frames")) - 0.2).abs() < 1e-6);
    assert!(height(&pressed) < 0.2);
    assert!(page.scene.static_data("scene/2/object/0/surface").is_some_and(|data| data.len() > 8));
    assert!(page.scene.static_data("scene/1/object/0/surface").is_none(), "of an older generation");
    assert_eq!(page.receive("nonsense"), None);
    assert!(page.newest("error")["text"].as_str().is_some_and(|text| text.contains("cannot read a message")));
}

#[test]
fn another_scene_goes_on_from_the_state_where_both_allow_it() {
    let mut page = Page::new(SCENE);
    page.run(0.15);
    let before = height(page.frames.last().expect("frames"));
    let request = page.receive(r#"{"type":"set_physics","gravity":[0.0,0.0,0.0]}"#);
    let Some(LocalRequest::ChangePhysics(settings)) = request else { panic!("{request:?}") };
    assert_eq!(settings.gravity, Some(DVec3::ZERO.to_array()));
    let floating = SCENE.replace("-9.81", "0.0");
    page.call(|scene, _, send| scene.start(viewer_scene(&floating).changed_from(scene.scene()), true, send))
        .expect("a scene");
    let shown = page.newest("scene");
    assert_eq!((&shown["gravity"][1], &shown["own"]["gravity"][1]), (&0.0.into(), &(-9.81).into()));
    let after = height(page.frames.last().expect("frames"));
    assert!((after - before).abs() < 0.03 && after < 0.2, "{before} {after}");
    let request = page.receive(r#"{"type":"open_scene","scene":"other"}"#);
    assert_eq!(request, Some(LocalRequest::Open("other".into())));
}

#[test]
fn sound_goes_with_the_steps_while_the_page_wants_it() {
    let mut page = Page::new(SCENE);
    page.run(0.1);
    assert!(page.sounds.is_empty());
    page.receive(r#"{"type":"sound","on":true}"#);
    page.run(0.5);
    let samples: usize = page.sounds.iter().map(|block| (block.len() - 16) / 4).sum();
    assert!((23_000..=24_300).contains(&samples), "{samples} samples in half a second of 48 kHz");
    page.receive(r#"{"type":"slow_motion","slowdown":2}"#);
    let heard = page.sounds.len();
    page.run(0.2);
    assert!(page.sounds.len() <= heard + 1, "silence in slow motion");
    page.receive(r#"{"type":"slow_motion","slowdown":1}"#);
    page.receive(r#"{"type":"reset"}"#);
    page.run(0.2);
    assert!(page.sounds.len() > heard + 10, "it goes on after a reset");
    page.receive(r#"{"type":"sound","on":false}"#);
    let heard = page.sounds.len();
    page.run(0.2);
    assert_eq!(page.sounds.len(), heard);
}

/// Device above the block that lies on the floor, its frame turned a quarter about the vertical.
const ABOVE: DevicePlace = DevicePlace {
    start: DVec3::new(0.0, 0.15, 0.0),
    orientation: DQuat::from_xyzw(0.0, std::f64::consts::FRAC_1_SQRT_2, 0.0, std::f64::consts::FRAC_1_SQRT_2),
    scale: 1.0,
};

impl Page {
    /// Update of the haptic device after a time [s]: the steps that are due, then the force [N] on the hand at a depth [m] below its start.
    fn exchange(&mut self, after_s: f64, depth: f64, buttons: u32) -> DVec3 {
        // The vendor's origin is somewhere.
        const FIRST: DVec3 = DVec3::new(0.3, -0.2, 0.1);
        self.now_s.set(self.now_s.get() + after_s);
        self.call(|scene, now, send| scene.advance(&|| now.get(), send));
        let reading = Reading { position: FIRST - depth * DVec3::Y, orientation: None, buttons };
        self.scene.exchange(Some(reading), self.now_s.get()).expect("an attached device")
    }
}

#[test]
fn a_haptic_device_feels_the_block_after_the_press_of_a_button_and_gives_its_place_back() {
    let mut page = Page::new(&SCENE.replace("[0.0, 0.2, 0.0]", "[0.0, 0.05, 0.0]"));
    page.run(1.0);
    let device = page.scene.attach_device(ABOVE).expect("a free slot");
    let scene = page.newest("scene");
    let slots = scene["devices"].as_array().expect("devices").len();
    assert_eq!(device, slots - 1, "the last one, so that pointers have the first");
    // The hand goes down at 5 cm/s and stays.
    let at = |page: &mut Page, depth: f64, buttons: u32| page.exchange(0.001, depth, buttons);
    let down = |step: u32| (5e-5 * f64::from(step)).min(0.06);
    let forces: Vec<DVec3> = (0..1500).map(|step| at(&mut page, down(step), 0)).collect();
    assert!(forces.iter().all(|force| *force == DVec3::ZERO), "no button was pressed");
    let status = |page: &mut Page| page.newest("status")["haptic_device"].clone();
    assert_eq!(status(&mut page), json!({ "force": "off", "max_force_n": 1.5 }));
    let forces: Vec<DVec3> =
        (0..1500).map(|step| at(&mut page, 0.06, u32::from((100..200).contains(&step)))).collect();
    assert!(forces[..100].iter().all(|force| *force == DVec3::ZERO));
    let last = forces[1499];
    // The largest force, to round-off.
    assert!(last.y > 0.1 && last.length() < 1.5 + 1e-12, "{last}");
    assert_eq!(status(&mut page)["force"], "on");
    // After a pause between updates the force is gone, and told; then it is back.
    let statuses: Vec<Value> = (0..1500)
        .map(|step| {
            let force = page.exchange(if step == 100 { 0.05 } else { 0.001 }, 0.06, 0);
            assert!(step != 100 || force == DVec3::ZERO, "{force}");
            status(&mut page)["force"].clone()
        })
        .collect();
    assert!(statuses.contains(&json!("late_updates")) && statuses[1499] == "on", "{statuses:?}");
    // Without readings the force goes.
    let mut force = last;
    for _ in 0..200 {
        page.now_s.set(page.now_s.get() + 0.001);
        page.call(|scene, now, send| scene.advance(&|| now.get(), send));
        force = page.scene.exchange(None, page.now_s.get()).expect("an attached device");
    }
    assert_eq!(force, DVec3::ZERO);
    page.run(0.5);
    assert_eq!(status(&mut page)["force"], "off");
    let press = |page: &mut Page, pointer: usize| {
        page.receive(&format!(
            r#"{{"type":"press","pointer":{pointer},"mode":"touch","position":[0,0.3,0]}}"#
        ));
        page.newest("assigned")["device"].as_u64()
    };
    let taken: Vec<_> = (0..slots).map(|pointer| press(&mut page, pointer)).collect();
    assert_eq!(taken.iter().flatten().count(), slots - 1, "{taken:?}");
    page.scene.detach_device();
    assert_eq!(press(&mut page, slots - 1), Some(device as u64));
    assert_eq!(page.scene.exchange(None, 0.0), None);
    assert_eq!(page.scene.attach_device(ABOVE), None, "every slot is taken");
}

#[test]
fn an_update_that_comes_late_takes_the_force_away_for_a_while_and_no_more() {
    /// Depth [m] at which the hand stays, well in the block.
    const DEPTH: f64 = 0.06;
    /// Depths of the tip's way in the block at which the late update comes [m].
    const LATE_AT: [f64; 3] = [0.048, 0.053, 0.058];
    // Force at the end, with one update that is late by so much, in a hand of so many metres per millisecond.
    let pressed = |late_s: f64, late_at: f64, speed: f64, is_armed_first: bool| {
        let mut page = Page::new(&SCENE.replace("[0.0, 0.2, 0.0]", "[0.0, 0.05, 0.0]"));
        page.run(1.0);
        page.scene.attach_device(ABOVE).expect("a free slot");
        let (mut depth, mut is_late) = (0.0, false);
        for step in 0..4000 {
            let buttons = u32::from((100..200).contains(&step) && is_armed_first || step >= 2000);
            let late_s = if !is_late && depth > late_at { late_s } else { 0.0 };
            is_late |= depth > late_at;
            let moved = if step < 200 { 0.0 } else { speed * (1.0 + 1e3 * late_s) };
            depth = (depth + moved).min(DEPTH);
            page.exchange(0.001 + late_s, depth, buttons);
        }
        page.exchange(0.001, depth, 1).y
    };
    for is_armed_first in [true, false] {
        for speed in [5e-5, 2e-4] {
            let expected = pressed(0.0, LATE_AT[0], speed, is_armed_first);
            assert!(expected > 1.4, "{expected}");
            for (late_s, late_at) in LATE_AT.map(|at| [(0.03, at), (0.06, at)]).concat() {
                let force = pressed(late_s, late_at, speed, is_armed_first);
                assert!(
                    (force / expected - 1.0).abs() < 0.01,
                    "{late_s} s at {late_at} m, {speed} m/ms, armed first: {is_armed_first}: {force} N of {expected}"
                );
            }
        }
    }
}
