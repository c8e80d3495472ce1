//! Logs: what was written comes back to the bit, and repeats.

use super::scenes::{STEP_S, half_width, model, process_from};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Input, Model, State, step};
use palpate_haptics::SceneNames;
use palpate_haptics::log::{LogReader, LogWriter, WrittenLog};
use palpate_haptics::{Error, Motion};
use serde_json::Value;
use std::collections::BTreeMap;
use std::io::{Cursor, Seek, Write};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

pub fn names() -> SceneNames {
    SceneNames {
        objects: vec!["body".into()],
        devices: vec!["finger".into()],
        obstacles: vec!["floor".into()],
        ..SceneNames::default()
    }
}

/// Steps of the logs that are replayed.
const STEPS: u64 = 400;

/// Log of a finger that presses and falls silent in between.
fn log(steps: u64) -> Vec<u8> {
    let model = model(1, 300.0);
    log_from(State::new(&model), &model, steps)
}

/// Log that begins at a state of the model.
fn log_from(state: State, model: &Arc<Model>, steps: u64) -> Vec<u8> {
    let written = write_log(Cursor::new(Vec::new()), state, model, steps).expect("a log in memory");
    assert_eq!((written.steps, written.failure), (steps, None));
    written.sink.into_inner()
}

/// Writes a log of a finger that presses and falls silent in between.
pub fn write_log<W: Write + Seek>(
    sink: W,
    state: State,
    model: &Arc<Model>,
    steps: u64,
) -> Result<WrittenLog<W>, Error> {
    let edge = half_width(model) + 0.004;
    let (mut force, mut ports) = process_from(state, model);
    let facts = BTreeMap::from([("scene".to_string(), "a.toml".to_string())]);
    let files = [("a.toml".to_string(), b"step = 1".to_vec())];
    let start = (&**model, force.state(), force.input());
    let (mut sender, writer) = LogWriter::new(sink, names(), facts, &files, start)?;
    for tick in 1..=steps {
        let now_s = tick as f64 * STEP_S;
        if !(200..300).contains(&tick) {
            let position = DVec3::new(edge - 0.003, 0.0005 * (now_s * 31.0).sin(), 1e-4);
            ports[0].send(Motion { sequence: tick, time_s: now_s, position, ..Motion::default() });
        }
        force.cycle(now_s);
        sender.record_step(|record| {
            record.step = tick;
            record.capture(force.input(), force.state());
        });
        if tick % 10 == 0 {
            sender.record_frame(|frame| frame.capture(force.input(), force.state()));
        }
    }
    assert_eq!(sender.missed(), 0);
    Ok(writer.run(&AtomicBool::new(true)))
}

#[test]
fn a_log_replays_bit_for_bit_and_reports_the_first_difference() {
    let bytes = log(STEPS);
    let reader = LogReader::new(&bytes).expect("a log");
    assert_eq!(reader.metadata().expect("facts")["scene"], "a.toml");
    assert_eq!(reader.files().expect("files"), [("a.toml".to_string(), b"step = 1".to_vec())]);
    assert_eq!(reader.step_count(), 400);
    let model = model(1, 300.0);
    for other in [None, Some(250)] {
        let mut state = State::new(&model);
        let mut differs = None;
        let mut away = 0;
        for (at, logged) in reader.logged_steps().enumerate() {
            let logged = logged.expect("a step");
            assert_eq!(logged.step, at as u64 + 1);
            let mut input = logged.input(&names(), &[DeviceMode::Touch]).expect("an input");
            away += u32::from(input.devices[0].mode == DeviceMode::Suspended);
            if other == Some(logged.step) {
                input.devices[0] = DeviceInput::touching(DVec3::X * 0.02);
            }
            step(&model, &mut state, &input);
            differs = differs.or_else(|| {
                logged.first_difference(&names(), state.output()).map(|(what, ..)| (logged.step, what))
            });
        }
        match other {
            None => assert_eq!(differs, None),
            Some(step) => assert!(differs.as_ref().is_some_and(|(at, _)| *at == step), "{differs:?}"),
        }
        assert!(away > 40, "{away}");
    }
}

#[test]
fn a_log_of_a_resumed_scene_begins_at_its_initial_state() {
    let model = model(1, 300.0);
    let press = |number: u32| {
        let place = DVec3::new(half_width(&model) + 0.004 - 2e-5 * f64::from(number), 1e-3, 0.0);
        Input { devices: vec![DeviceInput::touching(place)], ..Input::default() }
    };
    let mut before = State::new(&model);
    for number in 0..150 {
        step(&model, &mut before, &press(number));
    }
    let motions = before.snapshots();
    let begins = State::resume(&model, &motions);
    assert!(begins.output().energy.elastic > 1e-9, "{:?}", begins.output().energy);
    assert!(motions[0].angular_momentum != DVec3::ZERO && motions[0].twist.linear.x < 0.0, "{motions:?}");

    let bytes = log_from(begins, &model, STEPS);
    let reader = LogReader::new(&bytes).expect("a log");
    let read = reader.start(&names()).expect("readable").expect("it tells how the body begins");
    assert_eq!(read, motions, "to the last bit");
    let mut state = State::resume(&model, &read);
    let mut at_rest = State::new(&model);
    let mut differs = 0;
    for logged in reader.logged_steps() {
        let logged = logged.expect("a step");
        let input = logged.input(&names(), &[DeviceMode::Touch]).expect("an input");
        step(&model, &mut state, &input);
        assert_eq!(logged.first_difference(&names(), state.output()), None, "step {}", logged.step);
        step(&model, &mut at_rest, &input);
        differs += u32::from(logged.first_difference(&names(), at_rest.output()).is_some());
    }
    assert_eq!(differs, 400, "from rest it would be another motion");
    let unknown = SceneNames { objects: vec!["other".into()], ..SceneNames::default() };
    let error = reader.start(&unknown).expect_err("there is none of that name").to_string();
    assert_eq!(error, "the log has no initial state of \"other\"");
}

#[test]
fn files_that_are_no_log_or_half_of_one_are_refused() {
    // Few steps: the file is short, and every 11th byte of it is tried.
    let bytes = log(20);
    let error = |bytes: &[u8]| match LogReader::new(bytes) {
        Err(error) => error.to_string(),
        Ok(reader) => {
            let wrong = reader.logged_steps().find_map(Result::err).or(reader.files().err());
            wrong.map_or(String::new(), |error| error.to_string())
        }
    };
    assert_eq!(error(&bytes), "");
    // One chunk, and longer than the schemas in the summary.
    let long = log(STEPS);
    for (what, bytes) in
        [("empty", &[][..]), ("text", b"t,x,y,z\n0,0,0,0\n"), ("half", &long[..long.len() / 2])]
    {
        assert!(error(bytes).starts_with("the log"), "{what}: {:?}", error(bytes));
    }
    // Whatever bytes are wrong, nothing panics.
    for at in (0..bytes.len()).step_by(11) {
        let mut wrong = bytes.clone();
        wrong[at] ^= 0x55;
        error(&wrong);
    }
}

#[test]
fn logs_of_every_form_open_with_their_start_and_inputs() {
    let names = SceneNames {
        objects: vec!["block".into()],
        devices: vec!["left".into(), "right".into()],
        obstacles: vec!["box".into(), "rail".into()],
        ..SceneNames::default()
    };
    let forms = [
        // Form, bytes, whether it has initial states, whether it has held points.
        ("v1", &include_bytes!("../../../../data/logs/v1/held_and_simulated.mcap")[..], false, false),
        ("v2", &include_bytes!("../../../../data/logs/v2/held_and_simulated.mcap")[..], false, true),
        ("v3", &include_bytes!("../../../../data/logs/v3/held_and_simulated.mcap")[..], true, true),
    ];
    for (form, bytes, has_start, has_held_points) in forms {
        let reader = LogReader::new(bytes).expect("a log");
        assert_eq!(reader.metadata().expect("metadata")["scene"], "held_and_simulated.toml", "{form}");
        assert_eq!(reader.files().expect("files").len(), 5, "{form}");
        assert_eq!(reader.start(&names).expect("readable").is_some(), has_start, "{form}");
        assert_eq!(reader.step_count(), 250, "{form}");
        let inputs = reader.logged_steps().map(|logged| {
            logged.and_then(|logged| logged.input(&names, &[DeviceMode::Touch; 2])).expect("an input")
        });
        let held = |input: &Input| matches!(input.devices[0].mode, DeviceMode::Held(_));
        assert_eq!(inputs.filter(held).count(), if has_held_points { 250 } else { 0 }, "{form}");
    }
}

/// Check that a value has the fields and types of its schema, each with a description; gives the number of fields.
fn check_against_schema(value: &Value, schema: &Value, path: &str) -> usize {
    let description = schema["description"].as_str().unwrap_or_default();
    assert!(!description.is_empty(), "{path} has no description: {schema}");
    let is_of = |kind: bool| assert!(kind, "{path} is {value}, its schema {schema}");
    match schema["type"].as_str().expect("a type") {
        "object" => {
            let fields = value.as_object().expect("an object");
            let check = |(name, field): (&String, &Value)| {
                let known = &schema["properties"][name];
                assert!(known.is_object(), "{path}/{name} is not in the schema");
                check_against_schema(field, known, &format!("{path}/{name}"))
            };
            1 + fields.iter().map(check).sum::<usize>()
        }
        "array" => {
            let items = value.as_array().expect("an array");
            1 + items.iter().map(|item| check_against_schema(item, &schema["items"], path)).sum::<usize>()
        }
        kind => {
            match kind {
                "number" => {
                    is_of(value.is_number());
                    assert!(description.contains('['), "{path} has no unit: {description}");
                }
                "integer" => is_of(value.is_u64()),
                "boolean" => is_of(value.is_boolean()),
                _ => is_of(kind == "string" && value.is_string()),
            }
            1
        }
    }
}

#[test]
fn every_field_of_a_message_is_in_its_schema_with_its_unit() {
    let bytes = log(STEPS);
    let mut fields = BTreeMap::new();
    for message in mcap::MessageStream::new(&bytes).expect("a log") {
        let message = message.expect("a message");
        let schema = message.channel.schema.as_ref().expect("a schema");
        if message.channel.topic == "/tf" {
            assert_eq!(schema.name, "foxglove.FrameTransforms");
            continue;
        }
        let value: Value = serde_json::from_slice(&message.data).expect("JSON");
        let schema: Value = serde_json::from_slice(&schema.data).expect("a JSON schema");
        let count = check_against_schema(&value, &schema, &message.channel.topic);
        let most = fields.entry(message.channel.topic.clone()).or_insert(0);
        *most = count.max(*most);
    }
    let topics: Vec<&str> = fields.keys().map(String::as_str).collect();
    assert_eq!(topics, ["/contacts", "/modes", "/step"]);
    assert!(fields.values().all(|count| *count > 12), "{fields:?}");
}
