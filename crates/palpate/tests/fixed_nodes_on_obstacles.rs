//! Contacts that cannot give way: fixed nodes on an obstacle carry no force, and leave the other contacts of their body as they are.

use glam::DVec3;
use palpate::{Collider, ModelObject, ModelParameters, Obstacle, Pose, Recording, Shape, SurfacePoint, step};
use palpate_testkit::{finger, fixed_block, half_extent, model_and_state, start_at, touching};

/// Relative difference of a force whose island has some contacts more, and therefore a looser tolerance [1].
const SAME: f64 = 1e-6;

/// Radius of the tip [m].
const TIP: f64 = 0.005;

/// Centre of the end [m] whose nodes are fixed, in the body frame.
fn fixed_end(body: &Recording) -> DVec3 {
    let is_fixed = |triangle: &usize| {
        let point = SurfacePoint { triangle: *triangle as u32, weights: [1.0 / 3.0; 3] };
        !body.is_movable(&point)
    };
    let triangle = (0..body.surface.triangles.len()).find(is_fixed).expect("a fixed end");
    let node = body.surface.triangles[triangle][0] as usize;
    DVec3::X * body.surface.positions[node].x
}

/// Forces [N] of a tip that presses the free end, for the fixed end so deep [m] in a wall, or without one; and the number of islands that
/// were not solved.
fn press(wall: Option<f64>, friction: f64) -> (Vec<DVec3>, u32) {
    let body = fixed_block();
    let end = fixed_end(&body);
    let outwards = end.normalize();
    let obstacle = |depth: f64| Obstacle {
        shape: Shape::Plane { normal: -outwards },
        pose: Pose { position: end - outwards * depth, ..Pose::IDENTITY },
        friction,
    };
    let top = half_extent(&body, 1);
    let parameters = ModelParameters {
        devices: vec![finger(TIP, 0.0, friction)],
        obstacles: wall.map(obstacle).into_iter().collect(),
        ..ModelParameters::for_reference()
    };
    let (model, mut state) = model_and_state(parameters, vec![ModelObject::new(body, start_at(DVec3::ZERO))]);
    let mut unsolved = 0;
    let forces = (0..200).map(|number| {
        // Down to 9 mm.
        let depth = 1e-4 * f64::from(number.min(100)) - 1e-3;
        let output = step(&model, &mut state, &touching(&[DVec3::Y * (top + TIP - depth) - 0.5 * end]));
        unsolved += output.status.unsolved_islands;
        let on_wall = output.contacts.iter().filter(|contact| contact.against == Collider::Obstacle(0));
        assert_eq!(on_wall.map(|contact| contact.force.length()).sum::<f64>(), 0.0, "force on the wall [N]");
        output.devices[0].force_on_hand
    });
    (forces.collect(), unsolved)
}

#[test]
fn finger_feels_a_body_the_same_whether_or_not_its_fixed_nodes_lie_on_an_obstacle() {
    for friction in [0.0, 0.5] {
        let (alone, _) = press(None, friction);
        let largest = alone.iter().map(|force| force.length()).fold(0.0, f64::max);
        assert!(largest > 0.3, "{largest} N");
        // Flush; inside by less and by more than what is told of when a scene is read.
        for depth in [0.0, 1e-6, 1.5e-5, 1e-3] {
            let (forces, unsolved) = press(Some(depth), friction);
            let difference = alone.iter().zip(&forces).map(|(a, b)| (*a - *b).length()).fold(0.0, f64::max);
            assert!(
                difference <= SAME * largest,
                "{depth} m, friction {friction}: {difference} N of {largest} N"
            );
            assert_eq!(unsolved, 0, "{depth} m, friction {friction}");
        }
    }
}
