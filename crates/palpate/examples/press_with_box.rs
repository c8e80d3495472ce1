//! Press a block on a floor with a moving rigid box, and read the contact forces.

use glam::{DQuat, DVec3};
use palpate::{
    Collider, Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose, Recording, Shape,
    State, Twist, step,
};
use std::sync::Arc;

const FLOOR: usize = 0;
const BOX: usize = 1;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let block = Arc::new(Recording::from_bytes(&std::fs::read("data/recordings/v1/free.palp")?)?);
    let (top, bottom) = block
        .surface
        .positions
        .iter()
        .fold((0.0_f64, 0.0_f64), |(top, bottom), p| (top.max(p.y), bottom.min(p.y)));
    let half = 0.02;
    let lifted = |y: f64| Pose { position: DVec3::Y * y, orientation: DQuat::IDENTITY };
    let parameters = ModelParameters {
        gravity: DVec3::Y * -9.81,
        obstacles: vec![
            Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.5 },
            Obstacle {
                shape: Shape::Box { half_extents: DVec3::splat(half) },
                pose: lifted(top - bottom + half + 0.002),
                friction: 0.5,
            },
        ],
        ..ModelParameters::default()
    };
    let start = ObjectStart { pose: lifted(-bottom), twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(block, start)])?;
    let mut state = State::new(&model);

    println!("time [s]   box [mm]   force of the box [N]   force of the floor [N]");
    for number in 0..=400 {
        // Down by 6 mm in 0.2 s, then still.
        let depth = 0.006 * (f64::from(number) * 1e-3 / 0.2).min(1.0);
        let input = Input {
            obstacles: vec![Pose::IDENTITY, lifted(top - bottom + half + 0.002 - depth)],
            ..Input::default()
        };
        let output = step(&model, &mut state, &input);
        let force = |obstacle| -> DVec3 {
            let of = output.contacts.iter().filter(|c| c.against == Collider::Obstacle(obstacle));
            of.map(|contact| contact.force).sum()
        };
        if number % 50 == 0 {
            let (pressed, carried) = (force(BOX).y.abs(), force(FLOOR).y);
            println!("{:8.3}   {:8.2}   {pressed:20.4}   {carried:22.4}", output.time_s, -1e3 * depth);
        }
    }
    Ok(())
}
