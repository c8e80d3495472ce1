//! Checks of numbers that look as if given in another unit: lengths in millimetres, a step in milliseconds, friction in per cent.

use crate::scene::Scene;
use crate::warning::{Warning, WarningKind};
use glam::{DQuat, DVec3};
use palpate::{ModelObject, Pose, Shape, Support};

/// Diagonal of an object [m] above which it looks as if given in millimetres.
const LARGE_OBJECT_M: f64 = 20.0;

/// Distance of an object from everything else, in its diagonals, above which one of them looks as if placed in millimetres: beyond the height of a
/// fall, and below the 300 or more by which a body on a floor misses it then.
const APART: f64 = 100.0;

/// Radius of a tip or a patch, in diagonals of all objects, above which it looks as if given in millimetres.
const LARGE_TIP: f64 = 10.0;

/// Step [s] above which it looks as if given in milliseconds: nothing of a size that a hand touches vibrates so slowly.
const LONG_STEP_S: f64 = 0.1;

/// Gravity [m/s²] above which it looks as if given in cm/s²: ten times that of the Earth.
const LARGE_GRAVITY_M_S2: f64 = 100.0;

/// Time of rest before sleep [s] above which it looks as if given in milliseconds.
const LONG_REST_S: f64 = 50.0;

/// Coefficients of friction [1] that look like per cent: rubber has at most 4, and larger ones than 100 mean that nothing slips.
const FRICTION_PERCENT: std::ops::RangeInclusive<f64> = 5.0..=100.0;

impl Scene {
    /// Warning about positions [m, world] that a caller gives to a part, if some are far from the objects at the start and from where these
    /// are now. Their poses are asked for only then.
    pub fn far_positions<P: Iterator<Item = Pose> + Clone>(
        &self,
        name: &str,
        mut positions: impl Iterator<Item = DVec3> + Clone,
        poses: impl FnOnce() -> P,
    ) -> Option<Warning> {
        let bounds = &self.object_bounds;
        let farthest = bounds.farthest(positions.clone())?;
        let now = poses();
        let is_far = |x: DVec3| now.clone().all(|pose| (x - pose.position).length() > bounds.far());
        positions.any(is_far).then(|| bounds.warning("the motion", name, farthest))
    }
}

/// Warnings about the numbers of a scene and its objects.
pub(crate) fn check_units(scene: &Scene, objects: &[ModelObject]) -> Vec<Warning> {
    let mut warnings = Vec::new();
    let parameters = scene.model.parameters();
    let mut warn = |part: &str, message: String| {
        warnings.push(Warning::new(WarningKind::Units, part, message));
    };
    if parameters.step_s > LONG_STEP_S {
        let message = format!("the step is {} s long: it is in seconds, 0.001 for 1 ms", parameters.step_s);
        warn("", message);
    }
    if parameters.sleep_after_s > LONG_REST_S && parameters.sleep_after_s.is_finite() {
        let message = format!(
            "sleep_after is {} s: it is in seconds, 0.5 for 500 ms; inf for objects that never sleep",
            parameters.sleep_after_s
        );
        warn("", message);
    }
    let gravity = parameters.gravity.length();
    if gravity > LARGE_GRAVITY_M_S2 {
        warn("", format!("gravity is {gravity} m/s²: it is in m/s², 9.81 on the Earth"));
    }
    for (object, name) in objects.iter().zip(&scene.object_names) {
        let diagonal = object.recording.surface.diagonal();
        if diagonal > LARGE_OBJECT_M {
            let message = format!(
                "the object {name:?} is {diagonal:.1} m across: if its mesh is in millimetres, record it with --scale 0.001"
            );
            warn(name, message);
        }
        let distance = distance_from_others(scene, objects, object);
        if distance.is_finite() && distance > APART * diagonal {
            let message = format!(
                "the object {name:?} begins {distance:.1} m away from everything else, and is {diagonal:.3} m across: positions are in \
                 metres; if these are in millimetres, divide them by 1000"
            );
            warn(name, message);
        }
    }
    let span = scene.object_bounds.diagonal();
    for (device, own) in scene.devices.iter().zip(&parameters.devices) {
        let radii = [("tip", own.tip_radius), ("patch", own.patch_radius)];
        if let Some((what, radius)) = radii.into_iter().find(|(_, radius)| *radius > LARGE_TIP * span) {
            let message = format!(
                "the {what} of {:?} has a radius of {radius} m, and the objects span {span:.3} m: lengths are in metres; if this is in \
                 millimetres, divide it by 1000",
                device.name
            );
            warn(&device.name, message);
        }
    }
    let of_objects = scene.object_names.iter().zip(objects.iter().map(|object| object.friction));
    let of_devices = scene.devices.iter().zip(&parameters.devices).map(|(own, of)| (&own.name, of.friction));
    let of_obstacles =
        scene.obstacles.iter().zip(&parameters.obstacles).map(|(own, of)| (&own.name, of.friction));
    for (name, friction) in of_objects.chain(of_devices).chain(of_obstacles) {
        if friction > *FRICTION_PERCENT.start() && FRICTION_PERCENT.contains(&friction) {
            let message = format!(
                "the friction of {name:?} is {friction}: it is a coefficient, {} for {friction} %",
                friction / 100.0
            );
            warn(name, message);
        }
    }
    warnings.extend(weak_couplings(scene, objects));
    warnings.extend(half_turns(scene, objects));
    warnings.extend(lifting_gravity(scene, objects));
    warnings
}

/// Warnings about couplings that stretch by more than the size of every free object under its weight: their stiffness looks as if given in
/// N/mm.
fn weak_couplings(scene: &Scene, objects: &[ModelObject]) -> Vec<Warning> {
    let gravity = scene.model.parameters().gravity.length();
    let free = objects.iter().filter(|object| object.recording.metadata.support == Support::Free);
    // Stiffness [N/m] that carries an object at a stretch of its diagonal.
    let carrying = free.map(|object| object.recording.mass() * gravity / object.recording.surface.diagonal());
    let least = carrying.fold(f64::INFINITY, f64::min);
    let devices = scene.devices.iter().zip(&scene.model.parameters().devices);
    let couplings = devices.filter_map(|(device, of)| Some((&device.name, of.coupling?.stiffness)));
    let weak = couplings.filter(|(_, stiffness)| least.is_finite() && *stiffness < least);
    weak.map(|(name, stiffness)| {
        let message = format!(
            "the coupling of {name:?} has a stiffness of {stiffness} N/m, and carries no object at less than a stretch of the object's size \
             ({least:.2} N/m): if it is in N/mm, multiply it by 1000, and the damping too"
        );
        Warning::new(WarningKind::Units, name, message)
    })
    .collect()
}

/// Warnings about orientations that turn by half a turn about z exactly: (0, 0, 0, 1) looks as if its scalar part stood last.
fn half_turns(scene: &Scene, objects: &[ModelObject]) -> Vec<Warning> {
    let of_objects = scene.object_names.iter().zip(objects.iter().map(|object| object.start.pose));
    let of_obstacles = scene.obstacles.iter().map(|obstacle| (&obstacle.name, obstacle.start));
    let turned = of_objects
        .chain(of_obstacles)
        .filter(|(_, pose)| pose.orientation == DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0));
    turned
        .map(|(name, _)| {
            let message = format!(
                "the orientation of {name:?} is [0, 0, 0, 1], half a turn about z: the scalar part w stands first, [1, 0, 0, 0] turns \
                 nothing; for half a turn write [0, 0, 0, -1]"
            );
            Warning::new(WarningKind::Units, name, message)
        })
        .collect()
}

/// Distance of an object from the nearest other object, plane or obstacle that rests [m], at least; infinite without any.
fn distance_from_others(scene: &Scene, objects: &[ModelObject], object: &ModelObject) -> f64 {
    let centre = object.start.pose.position;
    let others = objects.iter().filter(|other| !std::ptr::eq(*other, object));
    let from_objects =
        others.map(|other| (other.start.pose.position - centre).length() - other.recording.surface.radius());
    let placed = scene.obstacles.iter().zip(&scene.model.parameters().obstacles);
    let at_rest = placed.filter(|(own, _)| own.path.is_none());
    let from_obstacles = at_rest.filter_map(|(own, of)| {
        let found = of.shape.signed_distance(own.start.body_from_world(centre), f64::INFINITY);
        found.map(|(distance, _)| distance)
    });
    let nearest = from_objects.chain(from_obstacles).fold(f64::INFINITY, f64::min);
    nearest - object.recording.surface.radius()
}

/// Warning about gravity that lifts free objects off every plane.
fn lifting_gravity(scene: &Scene, objects: &[ModelObject]) -> Option<Warning> {
    let parameters = scene.model.parameters();
    let gravity = parameters.gravity;
    let normals = parameters.obstacles.iter().filter_map(|of| match of.shape {
        Shape::Plane { normal } => Some(of.pose.orientation * normal),
        _ => None,
    });
    let mut normals = normals.peekable();
    let is_free = objects.iter().any(|object| object.recording.metadata.support == Support::Free);
    normals.peek()?;
    // Within 60° of the normal: a wall is not meant to carry.
    let lifts = is_free && normals.all(|normal| normal.dot(gravity) > 0.5 * gravity.length());
    lifts.then(|| {
        let message = format!(
            "gravity {:?} has the direction of every plane's normal, out of the solid side, and lifts the objects off: turn one of \
             them round",
            gravity.to_array()
        );
        Warning::new(WarningKind::Gravity, "", message)
    })
}
