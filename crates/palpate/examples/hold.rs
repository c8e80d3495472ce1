//! Hold a corner of a recorded block and move it by a millimetre: the force on the hand.

use palpate::glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
    Recording, State, Twist, step,
};
use std::sync::Arc;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let block = Recording::from_bytes(&std::fs::read("data/recordings/v1/free.palp")?)?;
    let (point, _) = block.surface.nearest(DVec3::new(0.1, 0.05, 0.05)).ok_or("no surface")?;
    let hand = block.surface.rest_position(&point) + DVec3::X * 0.001;
    let input =
        Input { devices: vec![DeviceInput::held(hand, Grasp { object: 0, point })], ..Input::default() };

    let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
    let parameters =
        ModelParameters { devices: vec![DeviceParameters::default()], ..ModelParameters::default() };
    let model = Model::new(parameters, vec![ModelObject::new(Arc::new(block), start)])?;
    let mut state = State::new(&model);
    let output = step(&model, &mut state, &input);
    println!("{:.5} N", output.devices[0].force_on_hand.x);
    Ok(())
}
