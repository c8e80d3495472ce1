//! Recording files: content behind a right hash, then a model of it and three steps.
#![no_main]

use glam::DVec3;
use libfuzzer_sys::fuzz_target;
use palpate::{DeviceInput, Model, ModelParameters, Recording, State, step};
use palpate_testkit::{EditableRecording, finger, floor, grasp, object_at, touching};
use std::sync::Arc;

fuzz_target!(|bytes: &[u8]| {
    let _ = Recording::from_bytes(bytes);
    let Some(file) = EditableRecording::new(bytes).and_then(|content| content.to_bytes()) else { return };
    let Ok(recording) = Recording::from_bytes(&file).map(Arc::new) else { return };
    let radius = recording.surface.radius();
    let tip = (0.1 * radius).min(1.0);
    let parameters = ModelParameters {
        gravity: DVec3::Y * -9.81,
        obstacles: vec![floor(0.5)],
        devices: vec![finger(tip, tip, 0.5), finger(tip, 0.0, 0.5)],
        max_contact_samples: 12,
        ..ModelParameters::default()
    };
    let objects = [0.9, 2.5].map(|height| object_at(&recording, DVec3::Y * (height * radius), DVec3::ZERO));
    let Ok(model) = Model::new(parameters, objects.into()) else { return };
    let mut state = State::new(&model);
    let mut input = touching(&[DVec3::Y * (2.0 * radius), DVec3::ZERO]);
    input.devices[1] = DeviceInput::held(DVec3::ZERO, grasp(0, 0, [0.2, 0.3, 0.5]));
    for _ in 0..3 {
        let output = step(&model, &mut state, &input);
        assert!(output.devices.iter().all(|device| device.force_on_hand.is_finite()));
        input.devices[0].position.y -= 0.05 * radius;
    }
});
