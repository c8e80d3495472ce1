//! Check of a run: what it has seen that its author hardly means.

use crate::initial_checks::begins_inside;
use crate::scene::Scene;
use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate::{Collider, DeviceMode, Input, Recording, ResidualFieldCache, State};

/// Displacement, as a share of the object's diagonal, above which linear elasticity is inaccurate.
const LARGE_DEFORMATION: f64 = 0.1;

/// Penetration that gets a warning: this share of the object's diagonal, or this length [m] if it is larger.
const PENETRATION: f64 = 0.01;
const PENETRATION_M: f64 = 2e-4;

/// Number of samples below which the least distance of a tip is not known.
const MIN_SAMPLES: usize = 10;

/// Check of a run, step by step.
#[derive(Debug, Clone, Default)]
pub struct RunCheck {
    /// Largest sampled displacement of the surface, by object [m].
    pub deformation: Vec<f64>,
    /// Largest penetration by object [m]: of its contacts in every step, of all its nodes in obstacles in sampled steps.
    pub penetration: Vec<f64>,
    tips: Vec<Tip>,
    /// Number of samples of the surfaces.
    samples: usize,
    /// Number of steps with unsolved islands.
    pub unsolved_steps: usize,
    /// Number of steps with dropped contacts.
    dropping_steps: usize,
    /// Most dropped contacts in a step.
    pub dropped_contacts: u32,
    /// Most held directions that repeat others.
    pub dependent_rows: u32,
    /// Warnings about positions that a caller gave, one a part.
    far: Vec<Warning>,
}

/// Tip of a device.
#[derive(Debug, Clone, Copy)]
struct Tip {
    /// Position in the first step in which it could touch [m, world].
    first: Option<DVec3>,
    has_moved: bool,
    has_touched: bool,
    /// Least sampled distance from the surfaces until it touches [m].
    nearest: f64,
    /// Largest depth in an object that it was let out of [m].
    inside: f64,
}

impl RunCheck {
    /// Check before the first step.
    pub fn new(scene: &Scene) -> Self {
        let tip =
            Tip { first: None, has_moved: false, has_touched: false, nearest: f64::INFINITY, inside: 0.0 };
        let objects = scene.object_names.len();
        Self {
            deformation: vec![0.0; objects],
            penetration: vec![0.0; objects],
            tips: vec![tip; scene.devices.len()],
            ..Self::default()
        }
    }

    /// Check positions [m, world] that a caller gives to a part for its next steps, as those of a path are; the warning, where it is new.
    pub fn add_positions(
        &mut self,
        scene: &Scene,
        name: &str,
        positions: impl Iterator<Item = DVec3> + Clone,
        state: &State,
    ) -> Option<&Warning> {
        if self.far.iter().any(|told| told.part == name) {
            return None;
        }
        let poses = || state.output().objects.iter().map(|object| object.pose);
        self.far.push(scene.far_positions(name, positions, poses)?);
        self.far.last()
    }

    /// Check the positions of an input that a caller gives for the next step: those of hands, and of obstacles and clamps that move, without a
    /// path.
    ///
    /// # Real time
    /// No allocation but for a warning, one a part.
    pub fn add_input(&mut self, scene: &Scene, input: &Input, state: &State) {
        let has_position = |mode| matches!(mode, DeviceMode::Touch | DeviceMode::Held(_));
        let devices = scene.devices.iter().zip(&input.devices);
        let hands = devices.filter(|(own, given)| own.path.is_none() && has_position(given.mode));
        let hands = hands.map(|(own, given)| (&own.name, given.position));
        let obstacles = scene.obstacles.iter().zip(&input.obstacles);
        let obstacles = obstacles.filter(|(own, at)| own.path.is_none() && own.start.position != at.position);
        let obstacles = obstacles.map(|(own, at)| (&own.name, at.position));
        let clamps = scene.clamps.iter().zip(&input.clamps).filter(|(own, _)| own.path.is_none());
        let clamps = clamps.map(|(own, at)| (&own.name, at.position));
        for (name, position) in hands.chain(obstacles).chain(clamps) {
            self.add_positions(scene, name, std::iter::once(position), state);
        }
    }

    /// Add the last step of a state.
    ///
    /// # Real time
    /// No allocation.
    pub fn add(&mut self, input: &Input, state: &State) {
        let output = state.output();
        for (largest, object) in self.penetration.iter_mut().zip(&output.objects) {
            *largest = largest.max(object.penetration_m);
        }
        for (tip, (device, moved)) in self.tips.iter_mut().zip(input.devices.iter().zip(&output.devices)) {
            if device.mode == DeviceMode::Touch && device.position.is_finite() {
                tip.has_moved |= *tip.first.get_or_insert(device.position) != device.position;
            }
            tip.inside = tip.inside.max(moved.offset[0].length());
        }
        for contact in &output.contacts {
            if let Collider::Device(number) = contact.against {
                self.tips[number].has_touched = true;
            }
        }
        let status = &output.status;
        self.dependent_rows = self.dependent_rows.max(status.dependent_rows);
        self.dropped_contacts = self.dropped_contacts.max(status.dropped_contacts);
        self.unsolved_steps += usize::from(status.unsolved_islands > 0);
        self.dropping_steps += usize::from(status.dropped_contacts > 0);
    }

    /// Sample the deformation, and with all nodes the penetration in obstacles and the distance of tips, by fields that the samples of a run
    /// share. Costs as much as drawing the surfaces.
    pub fn sample_surfaces(
        &mut self,
        scene: &Scene,
        input: &Input,
        state: &State,
        fields: &mut Vec<ResidualFieldCache>,
    ) {
        self.samples += 1;
        fields.resize_with(scene.object_names.len(), ResidualFieldCache::default);
        let obstacles = scene.model.parameters().obstacles.iter().zip(&input.obstacles);
        let output = state.output();
        for ((object, recording), field) in scene.model.recordings().enumerate().zip(fields) {
            let mut displacement = vec![DVec3::ZERO; recording.surface.positions.len()];
            let deformation = state.deformation(object);
            deformation.surface_displacement_cached(&scene.model, field, &mut displacement);
            let largest = &mut self.deformation[object];
            *largest = displacement.iter().map(|u| u.length()).fold(*largest, f64::max);
            let pose = output.objects[object].pose;
            let mut surface = recording.surface.clone();
            surface.positions.iter_mut().zip(&displacement).for_each(|(x, u)| *x += *u);
            let reach = surface.radius();
            for (obstacle, at) in obstacles.clone() {
                let distance = |x: DVec3, max_distance: f64| {
                    let x = at.body_from_world(pose.world_from_body(x));
                    let found = obstacle.shape.signed_distance(x, max_distance);
                    found.map_or(f64::INFINITY, |(distance, _)| distance)
                };
                if distance(DVec3::ZERO, reach) <= reach {
                    let depths = surface.positions.iter().map(|x| -distance(*x, 0.0));
                    self.penetration[object] = depths.fold(self.penetration[object], f64::max);
                }
            }
            let tips = self.tips.iter_mut().zip(&input.devices);
            for (tip, device) in tips.filter(|(tip, _)| !tip.has_touched) {
                let found = surface.nearest(pose.body_from_world(device.position));
                tip.nearest = found.map_or(tip.nearest, |(_, distance)| tip.nearest.min(distance));
            }
        }
    }

    /// Warnings of the steps so far.
    pub fn warnings(&self, scene: &Scene) -> Vec<Warning> {
        let mut all = self.far.clone();
        let objects = scene.model.recordings().zip(&scene.object_names);
        for ((recording, name), deformation) in objects.clone().zip(&self.deformation) {
            let share = deformation / recording.surface.diagonal();
            if share > LARGE_DEFORMATION {
                let message = format!(
                    "{name} deforms by {:.0} % of its size; linear elasticity is meant for small strain",
                    100.0 * share
                );
                all.push(Warning::new(WarningKind::LargeDeformation, name, message));
            }
        }
        let depths = objects.zip(&self.penetration);
        all.extend(depths.filter_map(|((recording, name), depth)| penetration(name, recording, *depth)));
        for (device, tip) in scene.devices.iter().zip(&self.tips) {
            // Of a path the check of the scene's start tells.
            if device.path.is_none() && tip.inside > PENETRATION_M {
                all.push(begins_inside(&device.name, tip.inside, "an object", "begin outside"));
            }
            let could_touch = tip.first.is_some() && (device.path.is_some() || tip.has_moved);
            if could_touch && !tip.has_touched {
                let nearest = if self.samples < MIN_SAMPLES { f64::INFINITY } else { tip.nearest };
                all.push(no_contact(&device.name, nearest));
            }
        }
        let of_scene = |kind: WarningKind, message: String| Warning::new(kind, "", message);
        if self.unsolved_steps > 0 {
            let message = format!(
                "in {} steps contacts could not be solved, and gave a part of their force or none: use a shorter step",
                self.unsolved_steps
            );
            all.push(of_scene(WarningKind::Unsolved, message));
        }
        if self.dropping_steps > 0 {
            let message = format!(
                "in {} steps contacts were left out, up to {} at once: raise max_contact_points above {}",
                self.dropping_steps,
                self.dropped_contacts,
                scene.model.parameters().max_contact_points
            );
            all.push(of_scene(WarningKind::DroppedContacts, message));
        }
        if self.dependent_rows > 0 {
            let message =
                format!("{} held directions repeat others and were given no force", self.dependent_rows);
            all.push(of_scene(WarningKind::DependentRows, message));
        }
        all
    }
}

/// Warning about an object that was pressed into something by a depth [m].
pub(crate) fn penetration(name: &str, recording: &Recording, depth: f64) -> Option<Warning> {
    let diagonal = recording.surface.diagonal();
    (depth > PENETRATION_M.max(PENETRATION * diagonal)).then(|| {
        let message = format!(
            "{name} was {:.2} mm inside something, {:.1} % of its size: use a shorter step, slower motion, or more contact \
             samples (max_contact_samples)",
            1000.0 * depth,
            100.0 * depth / diagonal
        );
        Warning::new(WarningKind::Penetration, name, message)
    })
}

/// Warning about a tip that touched nothing; its least distance from the objects is infinite where it is not known [m].
pub(crate) fn no_contact(name: &str, nearest: f64) -> Warning {
    let nearest = if nearest.is_finite() {
        format!("; its centre stayed about {nearest:.4} m or more from all objects")
    } else {
        String::new()
    };
    Warning::new(WarningKind::NoContact, name, format!("{name} touched nothing{nearest}"))
}
