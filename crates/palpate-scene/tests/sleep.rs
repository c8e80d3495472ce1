//! Sleep of recorded bodies: the forces that stay are those of rest.

use glam::{DQuat, DVec3};
use palpate::{Damping, Input, Material, Model, ModelParameters, Obstacle, Pose, Shape, State, step};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, record};
use palpate_mesh::ball_mesh;
use palpate_scene::SilentProgress;
use palpate_testkit::{floor, object_at};
use std::sync::Arc;

const RADIUS: f64 = 0.04;

/// Half the thickness of the board that presses from above [m].
const HALF_BOARD: f64 = 0.02;

/// Net force that sleep leaves, as a share of the force of the floor: 1 % of that of floor and board.
const NET: f64 = 0.02;

/// Pose of the board when it has come down by a length [m] from where it touches the ball.
fn board_pose(down: f64) -> Pose {
    Pose { position: DVec3::Y * (2.0 * RADIUS + HALF_BOARD - down), orientation: DQuat::IDENTITY }
}

/// Weightless ball on a floor, under a board that comes down at a speed [m/s] to a depth [m] and stays. Forces of both [N], upwards, in the first
/// step in which the ball sleeps; none within 20 s.
fn forces_asleep(model: &Model, depth: f64, speed: f64) -> Option<[f64; 2]> {
    let mut state = State::new(model);
    (0..20_000).find_map(|number| {
        let down = (speed * f64::from(number) * model.parameters().step_s).min(depth);
        let input = Input { obstacles: vec![Pose::IDENTITY, board_pose(down)], ..Input::default() };
        let output = step(model, &mut state, &input);
        output.objects[0].is_asleep.then(|| [0, 1].map(|at| output.obstacles[at].force.y))
    })
}

#[test]
fn a_weightless_ball_between_floor_and_board_sleeps_where_their_forces_balance() {
    let foam = Material::isotropic(5500.0, 0.45, 1060.0);
    let parameters = RecordParameters {
        extent: RecordExtent::NoCertificate,
        ..RecordParameters::new(vec![foam], ElementOrder::Linear, 50, Damping::Ratio(0.02))
    };
    let mesh = ball_mesh(RADIUS, 4).expect("a ball");
    let ball = Arc::new(record(mesh, &parameters, &mut SilentProgress).expect("a recording"));
    let board = Obstacle {
        shape: Shape::Box { half_extents: DVec3::new(0.05, HALF_BOARD, 0.05) },
        pose: board_pose(0.0),
        friction: 0.5,
    };
    let parameters =
        ModelParameters { obstacles: vec![floor(0.5), board], ..ModelParameters::for_real_time() };
    let model =
        Model::new(parameters, vec![object_at(&ball, DVec3::Y * RADIUS, DVec3::ZERO)]).expect("a model");
    let mut slept = 0;
    for (depth, speed) in [(5e-4, 1e-3), (5e-4, 2e-3), (1e-3, 1e-3), (1e-3, 2e-3), (2e-3, 1e-3)] {
        let Some([floor, board]) = forces_asleep(&model, depth, speed) else { continue };
        println!("{depth} m at {speed} m/s: floor {floor} N, board {board} N");
        assert!((floor + board).abs() < NET * floor.abs(), "{depth} {speed}: {floor} {board}");
        slept += 1;
    }
    assert!(slept >= 3, "{slept}");
}
