//! Check of a step: whether a run can go on.

use crate::scene::{Scene, SceneDevice};
use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, Grasp, Input, State};

/// Distance of a hand from the point that it holds, as a share of the object's radius, beyond which a step has let go of it.
const LOST_HOLD: f64 = 0.01;

impl Scene {
    /// Check the last step: finite numbers, accepted inputs, and held points that were met, since the object would be released. Contacts
    /// that are not solved may be in the next step, where objects can touch.
    ///
    /// # Errors
    /// Text for the author of the scene.
    pub fn check_step(&self, input: &Input, state: &State) -> Result<(), String> {
        check_step(self, input, state)
    }
}

fn check_step(scene: &Scene, input: &Input, state: &State) -> Result<(), String> {
    let output = state.output();
    let moves = output.objects.iter().all(|o| o.energy.stored().is_finite() && o.pose.position.is_finite());
    let finite = moves && output.devices.iter().all(|d| d.force_on_hand.is_finite() && d.proxy.is_finite());
    let is_sound = finite && output.status.rejected_inputs == 0;
    let unsolved = output.status.unsolved_islands > 0;
    if is_sound && !unsolved {
        return Ok(());
    }
    // A program may have let go of a point that the scene holds.
    let touches = |device: &DeviceInput| device.mode == DeviceMode::Touch;
    let can_touch = scene.can_touch() || input.devices.iter().any(touches);
    let lost = farthest_hand(scene, input, state);
    let has_let_go = unsolved && lost.as_ref().is_some_and(|hand| hand.share > LOST_HOLD);
    let step_s = scene.model.parameters().step_s;
    if can_touch && !has_let_go {
        return if is_sound {
            Ok(())
        } else {
            Err(format!(
                "at {:.6} s the numbers are not finite any more, or a device or an obstacle is where it can't be. Use a \
                 shorter step than {step_s} s, and check that paths are in metres",
                output.time_s
            ))
        };
    }
    let hint = lost.map_or(String::new(), |Hand { name, distance, .. }| {
        format!("; the hand of {name:?} is {distance:.3e} m from the point that it holds")
    });
    Err(format!(
        "at {:.6} s the held points can't be met: a hand moves, or a body turns, too far in one step of {step_s} s{hint}. Use a \
         shorter step, and check that paths are in metres",
        output.time_s
    ))
}

/// Hand that holds a point rigidly.
struct Hand<'s> {
    name: &'s str,
    /// Distance from the point [m], and as a share of the object's radius.
    distance: f64,
    share: f64,
}

/// Hand without a coupling that is farthest from its held point.
fn farthest_hand<'s>(scene: &'s Scene, input: &Input, state: &State) -> Option<Hand<'s>> {
    let apart = |(device, hand): (&'s SceneDevice, &DeviceInput)| {
        let DeviceMode::Held(Grasp { object, point }) = hand.mode else { return None };
        let surface = &scene.model.recordings().nth(object)?.surface;
        let mut displacement = vec![DVec3::ZERO; surface.positions.len()];
        state.surface_displacement(&scene.model, object, &mut displacement);
        let moved: DVec3 =
            surface.corners(&point).iter().map(|&(node, weight)| displacement[node] * weight).sum();
        let pose = state.output().objects[object].pose;
        let held = pose.world_from_body(surface.rest_position(&point) + moved);
        let distance = (hand.position - held).length();
        let share = distance / surface.radius();
        device.parameters.coupling.is_none().then_some(Hand { name: &device.name, distance, share })
    };
    let hands = scene.devices.iter().zip(&input.devices).filter_map(apart);
    hands.filter(|hand| hand.distance > 0.0).max_by(|a, b| a.distance.total_cmp(&b.distance))
}
