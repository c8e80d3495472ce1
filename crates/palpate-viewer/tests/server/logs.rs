//! Log playback, and images rendered from a log.

use super::client::{TestServer, decode_frame, mode_shapes, scene};
use glam::DVec3;
use palpate::{DeviceInput, Input, State, step};
use palpate_haptics::Snapshot;
use palpate_testkit::GRAVITY_M_S2;
use palpate_viewer::{LogFrames, RenderJob, RenderRequest, ServedContent};
use std::sync::Arc;
use std::sync::mpsc::channel;

/// Error of a fall over 80 steps [m]: ½·g·t·h, first order in the step, is 0.4 mm.
const FALL_M: f64 = 1e-3;

/// Frames of a falling body, one every 20 steps.
fn log(number: usize, frames: u64) -> Arc<LogFrames> {
    let scene = scene(DVec3::Y * -GRAVITY_M_S2, 1e-3);
    let model = scene.model.clone();
    let (log, mut builder) =
        LogFrames::new(number, format!("{number}.mcap"), model.clone(), scene.description, frames, 0.02);
    let mut state = State::new(&model);
    let input = Input {
        devices: vec![DeviceInput::inactive(); 2],
        obstacles: vec![model.parameters().obstacles[0].pose],
        ..Input::default()
    };
    let mut snapshot = Snapshot::new(&model, &state, &input);
    for number in 1..=20 * frames {
        step(&model, &mut state, &input);
        if number % 20 == 0 {
            snapshot.capture(number, &input, &state);
            builder.push(&snapshot);
        }
    }
    builder.finish(None);
    log
}

/// Length-prefixed frames.
fn split_frames(mut bytes: &[u8]) -> Vec<&[u8]> {
    let mut all = Vec::new();
    while let Some((length, rest)) = bytes.split_first_chunk::<4>() {
        let (frame, rest) = rest.split_at(u32::from_le_bytes(*length) as usize);
        all.push(frame);
        bytes = rest;
    }
    all
}

#[test]
fn two_logs_are_announced_and_their_frames_and_series_are_fetched() {
    let served = TestServer::new(ServedContent::Logs(vec![log(0, 30), log(1, 12)]));
    let mut page = served.page();
    let hello = page.wait("hello");
    assert_eq!((&hello["kind"], &hello["logs"][1]["name"]), (&"logs".into(), &"1.mcap".into()));
    let (first, second) = (page.wait("scene"), page.wait("scene"));
    assert_eq!((&first["log"], &first["frames"], &second["frames"]), (&0.into(), &30.into(), &12.into()));
    assert_eq!(page.wait("progress")["done"], true);
    let shapes = mode_shapes(&served.get("/scene/1/object/0/mode_shapes").1);
    let (status, bytes) = served.get("/log/1/frames?from=3&count=5");
    let frames = split_frames(&bytes);
    assert_eq!((status, frames.len()), (200, 5));
    let frame = decode_frame(frames[0], &shapes);
    assert_eq!((frame.step, frame.generation), (80, 1));
    // ½·g·t².
    assert!((frame.position.y + 0.5 * GRAVITY_M_S2 * 0.08 * 0.08).abs() < FALL_M, "{}", frame.position);
    assert_eq!(split_frames(&served.get("/log/1/frames?from=10&count=1000").1).len(), 2);
    assert!(served.get("/log/1/frames?from=12&count=1").1.is_empty());
    assert_eq!(served.get("/log/1/frames?from=-1&count=1").0, 400);
    assert_eq!(served.get("/log/2/frames?from=0&count=1").0, 404);
    let series: serde_json::Value = serde_json::from_slice(&served.get("/log/0/series").1).expect("JSON");
    assert_eq!(
        (series["t"].as_array().map(Vec::len), &series["devices"][0]["name"]),
        (Some(30), &"left".into())
    );
    let potential = series["energy"]["potential"].as_array().expect("energies");
    assert!(potential[29].as_f64() < potential[0].as_f64());
}

#[test]
fn a_rendering_page_gets_the_request_and_its_images_arrive() {
    let (images, received) = channel();
    let request = RenderRequest {
        frames: vec![0, 7],
        width: 640,
        height: 480,
        camera: None,
        colour: "plain".into(),
        dark: true,
    };
    let served = TestServer::new(ServedContent::Render(log(0, 10), RenderJob { request, images }));
    let mut page = served.page();
    let hello = page.wait("hello");
    assert_eq!((&hello["kind"], &hello["render"]["frames"]), (&"render".into(), &serde_json::json!([0, 7])));
    for number in 0..2_u64 {
        let (status, _) = served.request(&format!("POST /image/{number}"), &[number as u8; 5]);
        assert_eq!(status, 204);
        assert_eq!(received.recv().expect("an image"), (number, vec![number as u8; 5]));
    }
}
