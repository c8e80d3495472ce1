//! Check of a step: whether a run can go on.

use crate::scene::{Scene, SceneDevice};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Grasp, Input, State};

impl Scene {
    /// Check the last step: finite numbers and accepted inputs and, in a scene of held points only, that it is solved, since the object would
    /// be released. In scenes with contacts unsolved steps may be solved in the next.
    ///
    /// # Errors
    /// Text for the author of the scene.
    pub fn check_step(&self, input: &Input, state: &State) -> Result<(), String> {
        check_step(self, input, state)
    }
}

fn check_step(scene: &Scene, input: &Input, state: &State) -> Result<(), String> {
    // A program may have let go of a point that the scene holds.
    let touches = |device: &DeviceInput| device.mode == DeviceMode::Touch;
    let can_touch = scene.can_touch() || input.devices.iter().any(touches);
    let output = state.output();
    let moves = output.objects.iter().all(|o| o.energy.stored().is_finite() && o.pose.position.is_finite());
    let finite = moves && output.devices.iter().all(|d| d.force_on_hand.is_finite() && d.proxy.is_finite());
    let solved = output.status.unsolved_islands == 0 || can_touch;
    if solved && output.status.rejected_inputs == 0 && finite {
        return Ok(());
    }
    if can_touch {
        return Err(format!(
            "at {:.6} s the numbers are not finite any more, or a device or an obstacle is where it can't be. Use a \
             shorter step than {} s, and check that paths are in metres",
            output.time_s,
            scene.model.parameters().step_s
        ));
    }
    let hint = farthest_hand(scene, input, state).map_or(String::new(), |(distance, name)| {
        format!("; the hand of {name:?} is {distance:.3e} m from the point that it holds")
    });
    Err(format!(
        "at {:.6} s the held points can't be met: a hand moves, or a body turns, too far in one step of {} s{hint}. Use a \
         shorter step, and check that paths are in metres",
        output.time_s,
        scene.model.parameters().step_s
    ))
}

/// Device without a coupling that is farthest from its held point, with the distance [m].
fn farthest_hand<'s>(scene: &'s Scene, input: &Input, state: &State) -> Option<(f64, &'s str)> {
    let apart = |(device, hand): (&'s SceneDevice, &DeviceInput)| {
        let DeviceMode::Held(Grasp { object, point }) = device.mode else { return None };
        let surface = &scene.model.recordings().nth(object)?.surface;
        let mut displacement = vec![DVec3::ZERO; surface.positions.len()];
        state.surface_displacement(&scene.model, object, &mut displacement);
        let moved: DVec3 =
            surface.corners(&point).iter().map(|&(node, weight)| displacement[node] * weight).sum();
        let pose = state.output().objects[object].pose;
        let held = pose.world_from_body(surface.rest_position(&point) + moved);
        let stiff = device.parameters.coupling.is_none();
        stiff.then(|| ((hand.position - held).length(), device.name.as_str()))
    };
    let hands = scene.devices.iter().zip(&input.devices).filter_map(apart);
    hands.filter(|(distance, _)| *distance > 0.0).max_by(|a, b| a.0.total_cmp(&b.0))
}
