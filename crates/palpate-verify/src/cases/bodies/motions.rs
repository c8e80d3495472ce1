//! Motions of the set: rest, slide, roll, land, punch, pinch and stack, each with the largest penetration of all surface nodes.

use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::{DQuat, DVec3};
use palpate::{
    Collider, DeviceParameters, Input, Model, ModelObject, ModelParameters, Obstacle, Output, Pose,
    Recording, Shape, State, Surface, Twist, step,
};
use palpate_testkit::{GRAVITY_M_S2, finger, floor, object_at, smoothstep};
use std::sync::Arc;

/// Step [s].
const STEP: f64 = 1e-3;

/// Half side [m] of the box that punches.
const PUNCH_HALF: f64 = 0.02;

/// Number of contact samples that stands for all nodes.
pub const ALL_NODES: usize = usize::MAX;

/// Results of a run.
pub struct Outcome {
    /// Largest penetration of any surface node [m]: over the run, and over its last part.
    pub penetration: f64,
    pub penetration_at_rest: f64,
    /// Mean force on the first object by all obstacles and devices over the last part [N].
    pub force: DVec3,
    /// Mean force of the obstacle that punches, and its largest deviation over the last part [N].
    pub punch: f64,
    pub flicker: f64,
    /// Energy that contacts and damping take over the last part [J].
    pub lost_at_rest: f64,
    /// Kinetic energy at the end [J].
    pub kinetic: f64,
    pub invariants: RunInvariants,
}

/// Turn about an axis by an angle in degrees.
fn turned(axis: DVec3, degrees: f64) -> DQuat {
    DQuat::from_axis_angle(axis.normalize(), degrees.to_radians())
}

/// Scene that runs and is observed.
struct Experiment {
    model: Model,
    seconds: f64,
    /// Share of the run that counts as its last part.
    last: f64,
    /// Poses of the obstacles and positions of the devices over time.
    obstacles: Box<dyn Fn(f64) -> Vec<Pose>>,
    devices: Box<dyn Fn(f64) -> Vec<DVec3>>,
}

/// Lowest position [m] of a surface turned by an orientation.
fn lowest(surface: &Surface, orientation: DQuat) -> f64 {
    surface.positions.iter().map(|p| (orientation * *p).y).fold(f64::INFINITY, f64::min)
}

fn highest(surface: &Surface, orientation: DQuat) -> f64 {
    -lowest(surface, DQuat::from_rotation_z(std::f64::consts::PI) * orientation)
}

/// Object that stands at a height above the floor, turned and moving.
fn placed(body: &Arc<Recording>, orientation: DQuat, height: f64, twist: Twist) -> ModelObject {
    let mut object = object_at(body, DVec3::Y * (height - lowest(&body.surface, orientation)), DVec3::ZERO);
    object.start.pose.orientation = orientation;
    object.start.twist = twist;
    object
}

fn model(
    samples: usize,
    obstacles: Vec<Obstacle>,
    devices: Vec<DeviceParameters>,
    objects: Vec<ModelObject>,
) -> Result<Model, VerifyError> {
    let parameters = ModelParameters {
        step_s: STEP,
        gravity: DVec3::Y * -GRAVITY_M_S2,
        obstacles,
        devices,
        max_contact_samples: samples,
        max_contact_points: 2048,
        ..ModelParameters::for_reference()
    };
    Ok(Model::new(parameters, objects)?)
}

fn still(count: usize) -> Box<dyn Fn(f64) -> Vec<Pose>> {
    Box::new(move |_| vec![Pose::IDENTITY; count])
}

/// Motion of the set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    Rest,
    Slide,
    Roll,
    Land,
    Punch,
    Pinch,
    Stack,
}

impl Motion {
    /// Run of a body with so many contact samples; in a stack a block carries it.
    pub fn run(
        self,
        body: &Arc<Recording>,
        block: &Arc<Recording>,
        samples: usize,
    ) -> Result<Outcome, VerifyError> {
        let flat = DQuat::IDENTITY;
        let none = || Box::new(|_| Vec::new()) as Box<dyn Fn(f64) -> Vec<DVec3>>;
        let experiment = match self {
            Self::Rest => Experiment {
                model: model(samples, vec![floor(0.5)], vec![], vec![placed(body, flat, 0.0, Twist::ZERO)])?,
                seconds: 2.5,
                last: 0.2,
                obstacles: still(1),
                devices: none(),
            },
            Self::Slide => {
                let twist = Twist { linear: DVec3::X * 0.6, angular: DVec3::ZERO };
                Experiment {
                    model: model(samples, vec![floor(0.3)], vec![], vec![placed(body, flat, 0.0, twist)])?,
                    seconds: 2.5,
                    last: 0.2,
                    obstacles: still(1),
                    devices: none(),
                }
            }
            Self::Roll => {
                let twist = Twist { linear: DVec3::Z * 0.5, angular: DVec3::X * 10.0 };
                Experiment {
                    model: model(samples, vec![floor(0.8)], vec![], vec![placed(body, flat, 0.0, twist)])?,
                    seconds: 1.5,
                    last: 0.2,
                    obstacles: still(1),
                    devices: none(),
                }
            }
            Self::Land => {
                let tilted = turned(DVec3::new(1.0, 0.3, 0.8), 25.0);
                Experiment {
                    model: model(
                        samples,
                        vec![floor(0.5)],
                        vec![],
                        vec![placed(body, tilted, 0.03, Twist::ZERO)],
                    )?,
                    seconds: 3.0,
                    last: 0.1,
                    obstacles: still(1),
                    devices: none(),
                }
            }
            Self::Punch => {
                let top = highest(&body.surface, flat) - lowest(&body.surface, flat);
                // Above a place where there is material: the highest node.
                let at = body.surface.positions.iter().copied().fold(DVec3::splat(-1.0), |best, p| {
                    let key = |p: DVec3| p.y - 0.05 * (p.x * p.x + p.z * p.z).sqrt();
                    if key(p) > key(best) { p } else { best }
                });
                let half_extents = DVec3::splat(PUNCH_HALF);
                let shape = Shape::Box { half_extents };
                let pose = move |t: f64| {
                    let depth = 0.15 * top * smoothstep((t - 0.5) / 0.4) - 1e-3;
                    let position = DVec3::new(at.x, top - depth + PUNCH_HALF, at.z);
                    Pose { position, ..Pose::IDENTITY }
                };
                let punch = Obstacle { shape, pose: pose(0.0), friction: 0.5 };
                Experiment {
                    model: model(
                        samples,
                        vec![floor(0.5), punch],
                        vec![],
                        vec![placed(body, flat, 0.0, Twist::ZERO)],
                    )?,
                    seconds: 2.0,
                    last: 0.25,
                    obstacles: Box::new(move |t| vec![Pose::IDENTITY, pose(t)]),
                    devices: none(),
                }
            }
            Self::Pinch => {
                let height = -lowest(&body.surface, flat);
                let side = |sign: f64| {
                    let key = |p: DVec3| sign * p.x - 0.2 * p.y.abs() - 0.2 * p.z.abs();
                    let best = body.surface.positions.iter().copied().fold(None, |best: Option<DVec3>, p| {
                        if best.is_none_or(|b| key(p) > key(b)) { Some(p) } else { best }
                    });
                    best.unwrap_or_default() + DVec3::Y * height
                };
                let tip = 0.008;
                let (left, right) = (side(-1.0), side(1.0));
                let width = (right - left).length();
                let devices = move |t: f64| {
                    let squeeze = 0.06 * width * smoothstep((t - 0.3) / 0.4) - 5e-4;
                    let up = DVec3::Y * 0.03 * smoothstep((t - 0.9) / 0.4);
                    vec![left + DVec3::X * (squeeze - tip) + up, right - DVec3::X * (squeeze - tip) + up]
                };
                Experiment {
                    model: model(
                        samples,
                        vec![floor(0.5)],
                        vec![finger(tip, tip, 1.0); 2],
                        vec![placed(body, flat, 0.0, Twist::ZERO)],
                    )?,
                    seconds: 2.5,
                    last: 0.2,
                    obstacles: still(1),
                    devices: Box::new(devices),
                }
            }
            Self::Stack => {
                let lower = placed(block, flat, 0.0, Twist::ZERO);
                let top = highest(&block.surface, flat) - lowest(&block.surface, flat);
                Experiment {
                    model: model(
                        samples,
                        vec![floor(0.5)],
                        vec![],
                        vec![placed(body, flat, top, Twist::ZERO), lower],
                    )?,
                    seconds: 2.5,
                    last: 0.2,
                    obstacles: still(1),
                    devices: none(),
                }
            }
        };
        Ok(experiment.run())
    }
}

impl Experiment {
    fn run(&self) -> Outcome {
        let model = &self.model;
        let mut state = State::new(model);
        let mut outcome = Outcome {
            penetration: 0.0,
            penetration_at_rest: 0.0,
            force: DVec3::ZERO,
            punch: 0.0,
            flicker: 0.0,
            lost_at_rest: 0.0,
            kinetic: 0.0,
            invariants: RunInvariants::default(),
        };
        outcome.invariants.observe(state.output());
        let steps = (self.seconds / STEP).round() as usize;
        let late = (steps as f64 * (1.0 - self.last)) as usize;
        let (mut lost, mut punches) = (0.0, Vec::new());
        for number in 1..=steps {
            let t = number as f64 * STEP;
            let obstacles = (self.obstacles)(t);
            let devices = (self.devices)(t).into_iter().map(palpate::DeviceInput::touching).collect();
            let input = Input { obstacles: obstacles.clone(), devices, ..Input::default() };
            let output = step(model, &mut state, &input);
            outcome.invariants.observe(output);
            if number == late {
                lost = output.energy.lost();
            }
            if number > late {
                let share = 1.0 / (steps - late) as f64;
                outcome.force += force_on_first(output) * share;
                punches.push(
                    output
                        .contacts
                        .iter()
                        .filter(|c| c.against == Collider::Obstacle(1))
                        .map(|c| -c.force.y)
                        .sum::<f64>(),
                );
                outcome.lost_at_rest = output.energy.lost() - lost;
            }
            outcome.kinetic = output.energy.kinetic;
            if number % 10 == 0 {
                let depth = self.penetration(&state, &obstacles);
                outcome.penetration = outcome.penetration.max(depth);
                if number > late {
                    outcome.penetration_at_rest = outcome.penetration_at_rest.max(depth);
                }
            }
        }
        outcome.punch = punches.iter().sum::<f64>() / punches.len() as f64;
        outcome.flicker = punches.iter().map(|f| (f - outcome.punch).abs()).fold(0.0, f64::max);
        outcome
    }

    /// Largest penetration [m] of any surface node in an obstacle, or in the other object's surface.
    fn penetration(&self, state: &State, obstacles: &[Pose]) -> f64 {
        let model = &self.model;
        let world: Vec<Vec<DVec3>> = model
            .recordings()
            .enumerate()
            .map(|(object, recording)| {
                let mut out = vec![DVec3::ZERO; recording.surface.positions.len()];
                state.surface_displacement(model, object, &mut out);
                let pose = state.output().objects[object].pose;
                let rest = recording.surface.positions.iter();
                rest.zip(&out).map(|(rest, u)| pose.world_from_body(*rest + *u)).collect()
            })
            .collect();
        let mut deepest = 0.0_f64;
        for node in world.iter().flatten() {
            deepest = deepest.max(-node.y);
            if let Some(punch) = obstacles.get(1) {
                let depth = (DVec3::splat(PUNCH_HALF) - (*node - punch.position).abs()).min_element();
                deepest = deepest.max(depth);
            }
        }
        if let [upper, lower] = &*world {
            let recordings: Vec<_> = model.recordings().collect();
            deepest = deepest.max(depth_in(upper, lower, &recordings[1].surface));
            deepest = deepest.max(depth_in(lower, upper, &recordings[0].surface));
        }
        deepest
    }
}

/// Force [N] on the first object by everything but gravity.
fn force_on_first(output: &Output) -> DVec3 {
    let contacts = output.contacts.iter().map(|contact| match (contact.object, contact.against) {
        (0, _) => contact.force,
        (_, Collider::Object(0)) => -contact.force,
        _ => DVec3::ZERO,
    });
    contacts.sum()
}

/// Largest depth [m] of points inside a closed surface: by the sign of its solid angle, and the distance to its triangles.
fn depth_in(points: &[DVec3], nodes: &[DVec3], surface: &Surface) -> f64 {
    let low = nodes.iter().copied().fold(DVec3::INFINITY, DVec3::min);
    let high = nodes.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
    let mut deepest = 0.0_f64;
    for point in points.iter().filter(|p| p.cmpge(low).all() && p.cmple(high).all()) {
        let (mut angle, mut distance) = (0.0, f64::INFINITY);
        for corners in &surface.triangles {
            let [a, b, c] = corners.map(|n| nodes[n as usize] - *point);
            let (la, lb, lc) = (a.length(), b.length(), c.length());
            // van Oosterom & Strackee 1983.
            let product = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            angle += 2.0 * a.dot(b.cross(c)).atan2(product);
            distance = distance.min(distance_to(a, b, c));
        }
        if angle > std::f64::consts::TAU {
            deepest = deepest.max(distance);
        }
    }
    deepest
}

/// Distance [m] of the origin from a triangle.
fn distance_to(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let normal = (b - a).cross(c - a);
    let inside = |p: DVec3, q: DVec3| normal.cross(q - p).dot(-p) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        return (a.dot(normal) / normal.length()).abs();
    }
    let edge = |p: DVec3, q: DVec3| {
        let t = (-p.dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        (p + (q - p) * t).length()
    };
    edge(a, b).min(edge(b, c)).min(edge(c, a))
}
