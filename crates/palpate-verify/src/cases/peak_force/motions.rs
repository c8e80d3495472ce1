//! Motions of hands that hold points of a body, and of fingers that touch it, with the forces on them.

use crate::error::VerifyError;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceParameters, Grasp, Input, Model, ModelParameters, Recording, State, Surface,
    SurfacePoint, step,
};
use palpate_testkit::{Random, object_at, smoothstep};
use std::fmt;
use std::sync::Arc;

/// Step of the recordings [s].
const STEP_S: f64 = 1e-3;

/// Steps of the ramp, and of a motion.
pub(super) const RISE: usize = 50;
const STEPS: usize = 250;

/// Motions of each number of hands; their directions are random.
const MOTIONS: usize = 4;

/// Least distance of two hands and size of their displacement, as shares of the body's diagonal.
const APART: f64 = 0.2;
const MOVED: f64 = 0.02;

/// Radius of a finger's patch as a share of the body's diagonal, and in mean edges at least: that of the certificate.
const PATCH_DIAGONAL: f64 = 0.03;
const PATCH_EDGES: f64 = 2.0;

/// Cosine of the largest angle between the normal of a second finger and the direction of the first.
const OPPOSED: f64 = 0.9;

/// Friction with which fingers stick.
const STICKS: f64 = 10.0;

/// Gap [m] of a finger at the start, and steps until it moves: a device begins where it is at the end of its first step.
const GAP: f64 = 1e-9;
pub(super) const WAIT: usize = 1;

/// Way in which hands meet the body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Hands {
    /// Points that are held in all directions.
    Held,
    /// Patches that are touched from the start on, and pressed in.
    Touched,
}

impl fmt::Display for Hands {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if *self == Self::Held { "held" } else { "touched" })
    }
}

/// Place of a hand.
pub(super) struct HandMotion {
    point: SurfacePoint,
    /// Outward normal.
    normal: DVec3,
    /// Displacement [m].
    by: DVec3,
}

/// Hands that move together.
pub(super) type Motion = Vec<HandMotion>;

/// Motions of one to three hands. Every second one of held points presses all in. Fingers press along their normals, and two of them against each other,
/// so that all keep in touch.
pub(super) fn motions(body: &Recording, hands: Hands) -> Vec<Motion> {
    let mut random = Random::new(7);
    let mut all = Vec::new();
    for count in 1..=3 {
        for number in 0..MOTIONS {
            let mut motion = Motion::new();
            while motion.len() < count {
                match hands {
                    Hands::Held => add_held(body, &mut motion, &mut random, number % 2 == 0),
                    Hands::Touched => add_touched(body, &mut motion, &mut random),
                }
            }
            all.push(motion);
        }
    }
    all
}

/// A random surface node away from those of a motion; none where it is fixed or near.
fn place(body: &Recording, motion: &Motion, random: &mut Random) -> Option<(SurfacePoint, DVec3)> {
    let surface = &body.surface;
    let triangle = (random.unit() * surface.triangles.len() as f64) as u32;
    let point = SurfacePoint { triangle, weights: [1.0, 0.0, 0.0] };
    let at = surface.rest_position(&point);
    let is_near =
        |other: &HandMotion| (surface.rest_position(&other.point) - at).length() < APART * surface.diagonal();
    (body.is_movable(&point) && !motion.iter().any(is_near)).then_some((point, at))
}

fn add_held(body: &Recording, motion: &mut Motion, random: &mut Random, presses: bool) {
    let Some((point, at)) = place(body, motion, random) else { return };
    let any = random.vector();
    let towards = if presses { -at } else { any };
    let by = towards.normalize() * MOVED * body.surface.diagonal();
    motion.push(HandMotion { point, normal: DVec3::ZERO, by });
}

fn add_touched(body: &Recording, motion: &mut Motion, random: &mut Random) {
    let surface = &body.surface;
    let Some((point, _)) = place(body, motion, random) else { return };
    // A finger at an edge has a contact on each face.
    let Some(normal) = smooth_normal(surface, surface.triangles[point.triangle as usize][0]) else { return };
    let opposes = |other: &HandMotion| normal.dot(other.normal) < -OPPOSED;
    if motion.len() == 1 && !opposes(&motion[0]) {
        return;
    }
    motion.push(HandMotion { point, normal, by: -normal * MOVED * surface.diagonal() });
}

/// Unit normal of a node whose triangles are within 37° of it, the crease of docs/theory.md (C22): the mean of theirs, as tips have it.
fn smooth_normal(surface: &Surface, node: u32) -> Option<DVec3> {
    const CREASE: f64 = 0.8;
    let around = surface.triangles.iter().filter(|corners| corners.contains(&node));
    let normals: Vec<DVec3> = around
        .map(|corners| {
            let [a, b, c] = corners.map(|node| surface.positions[node as usize]);
            (b - a).cross(c - a).normalize_or_zero()
        })
        .collect();
    let normal = normals.iter().sum::<DVec3>().normalize_or_zero();
    normals.iter().all(|of| of.dot(normal) > CREASE).then_some(normal)
}

/// Forces [N] of every motion, hand after hand in every step, as means over the step.
pub(super) fn forces_of(
    body: &Arc<Recording>,
    motions: &[Motion],
    hands: Hands,
    fraction: usize,
) -> Result<Vec<Vec<DVec3>>, VerifyError> {
    motions.iter().map(|motion| forces(body, motion, hands, fraction)).collect()
}

fn forces(
    body: &Arc<Recording>,
    motion: &Motion,
    hands: Hands,
    fraction: usize,
) -> Result<Vec<DVec3>, VerifyError> {
    let surface = &body.surface;
    let patch_radius = (PATCH_DIAGONAL * surface.diagonal()).max(PATCH_EDGES * surface.mean_edge());
    let finger = DeviceParameters {
        tip_radius: 0.5 * patch_radius,
        patch_radius,
        friction: STICKS,
        ..DeviceParameters::default()
    };
    let device = if hands == Hands::Held { DeviceParameters::default() } else { finger };
    let parameters = ModelParameters {
        step_s: STEP_S / fraction as f64,
        devices: vec![device; motion.len()],
        ..ModelParameters::for_reference()
    };
    let model = Model::new(parameters, vec![object_at(body, DVec3::ZERO, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    let mut means = vec![DVec3::ZERO; STEPS * motion.len()];
    for number in 0..STEPS * fraction {
        let moving = (number + 1).saturating_sub(WAIT * fraction);
        let share = smoothstep(moving as f64 / (RISE * fraction) as f64);
        let hand = |hand: &HandMotion| {
            let at = surface.rest_position(&hand.point) + hand.by * share;
            match hands {
                Hands::Held => DeviceInput::held(at, Grasp { object: 0, point: hand.point }),
                Hands::Touched => DeviceInput::touching(at + hand.normal * (device.tip_radius + GAP)),
            }
        };
        let input = Input { devices: motion.iter().map(hand).collect(), ..Input::default() };
        let devices = &step(&model, &mut state, &input).devices;
        let first = number / fraction * motion.len();
        for (mean, device) in means[first..].iter_mut().zip(devices) {
            *mean += device.force_on_hand / fraction as f64;
        }
    }
    Ok(means)
}
