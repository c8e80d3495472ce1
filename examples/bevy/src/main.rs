//! palpate in Bevy: a plugin that steps a model beside the frames and moves entities with its objects.
//!
//! `cargo run --release` in this folder, without a window: a block falls, and the transform of its entity is printed. The tests do not build it
//! (1.5 minutes of a core); it was compiled and run with Bevy 0.20.1.

use bevy_app::{App, Plugin, Update};
use bevy_ecs::prelude::{Component, IntoScheduleConfigs, Query, Res, ResMut, Resource};
use bevy_math::{Quat, Vec3};
use bevy_transform::components::Transform;
use palpate::glam::DVec3;
use palpate::{
    Input, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Pose, Recording, Shape, State, Twist,
    step,
};
use std::sync::Arc;

/// Model with its state, and the input of the next steps.
#[derive(Resource)]
struct Simulation {
    model: Arc<Model>,
    state: State,
    input: Input,
    /// Time that has passed and is not simulated yet [s].
    due_s: f64,
}

/// Entity that is drawn where an object of the model is.
#[derive(Component)]
struct Body(usize);

/// Duration of a frame [s]; with Bevy's clock that of `Time<Virtual>`.
#[derive(Resource)]
struct FrameTime(f64);

/// Longest time that a frame makes up for [s]: after a stall the simulation is late, and does not stall the next frame.
const MOST_DUE_S: f64 = 0.1;

/// Steps of the model in every frame, then the transforms of its bodies.
struct PalpatePlugin(Arc<Model>);

impl Plugin for PalpatePlugin {
    fn build(&self, app: &mut App) {
        let model = self.0.clone();
        let state = State::new(&model);
        app.insert_resource(Simulation { model, state, input: Input::default(), due_s: 0.0 })
            .add_systems(Update, (advance, place).chain());
    }
}

/// Takes the steps that are due. Other systems set `input` before: devices, obstacles, gravity.
fn advance(mut simulation: ResMut<Simulation>, frame: Res<FrameTime>) {
    let Simulation { model, state, input, due_s } = &mut *simulation;
    *due_s = (*due_s + frame.0).min(MOST_DUE_S);
    let step_s = model.parameters().step_s;
    while *due_s >= step_s {
        step(model, state, input);
        *due_s -= step_s;
    }
}

/// Moves the entities. Bevy has single precision, y up and metres, as here.
fn place(simulation: Res<Simulation>, mut bodies: Query<(&Body, &mut Transform)>) {
    for (Body(number), mut transform) in &mut bodies {
        let Pose { position: p, orientation: q } = simulation.state.output().objects[*number].pose;
        transform.translation = Vec3::new(p.x as f32, p.y as f32, p.z as f32);
        transform.rotation = Quat::from_xyzw(q.x as f32, q.y as f32, q.z as f32, q.w as f32);
    }
}

/// A block above a floor.
fn falling_block() -> Result<Model, Box<dyn std::error::Error>> {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../../data/recordings/v1/free.palp");
    let block = Arc::new(Recording::from_bytes(&std::fs::read(file)?)?);
    let floor = Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.5 };
    let parameters =
        ModelParameters { gravity: DVec3::Y * -9.81, obstacles: vec![floor], ..ModelParameters::default() };
    let pose = Pose { position: DVec3::Y * 0.2, ..Pose::IDENTITY };
    Ok(Model::new(parameters, vec![ModelObject::new(block, ObjectStart { pose, twist: Twist::ZERO })])?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut app = App::new();
    app.insert_resource(FrameTime(1.0 / 60.0)).add_plugins(PalpatePlugin(Arc::new(falling_block()?)));
    let entity = app.world_mut().spawn((Body(0), Transform::default())).id();
    for frame in 1..=30 {
        app.update();
        if frame % 5 == 0 {
            let transform = app.world().get::<Transform>(entity).ok_or("the entity is there")?;
            println!("frame {frame:2}: height {:.3} m", transform.translation.y);
        }
    }
    Ok(())
}
