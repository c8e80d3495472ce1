//! Pointers that touch as somebody at the page does, but faster and deeper: press on a surface that is seen, push in along the view, drag
//! aside, release.

use crate::random::Random;
use crate::scenes::smoothstep;
use glam::DVec3;
use palpate::{DeviceInput, Model, Output};

/// Angular frequency of the page's tracking filter [rad/s].
const TRACKING_FREQUENCY: f64 = 120.0;

/// Least cosine between the view and a surface that is pressed.
const FACING: f64 = 0.35;

/// Duration of a press [s], from a blow to slow.
const PRESS_S: [f64; 2] = [0.04, 0.4];

/// Depth of a press in object radii: the page's 0.09 to deeper than the surface is away from the centre.
const DEPTH: [f64; 2] = [0.09, 1.0];

/// Speed of a drag [m/s], at most.
const DRAG_M_S: f64 = 0.5;

/// Duration of a drag, and of a pause [s], at most.
const DRAG_S: f64 = 1.5;
const PAUSE_S: f64 = 2.0;

/// One touch.
struct Touch {
    /// Where the pointer begins, and where its press ends [m, world].
    from: DVec3,
    to: DVec3,
    press_s: f64,
    /// Velocity of the drag [m/s, world].
    drag: DVec3,
    end_s: f64,
    time_s: f64,
}

/// Pointer that touches at random.
pub struct RandomPointer {
    tip_radius: f64,
    pause_s: f64,
    touch: Option<Touch>,
    position: DVec3,
    velocity: DVec3,
}

impl RandomPointer {
    /// Pointer that has not touched yet.
    pub fn new(tip_radius: f64) -> Self {
        Self { tip_radius, pause_s: 1.0, touch: None, position: DVec3::ZERO, velocity: DVec3::ZERO }
    }

    /// Input of the next step of h [s].
    pub fn next(&mut self, random: &mut Random, model: &Model, output: &Output, h: f64) -> DeviceInput {
        let Some(touch) = &mut self.touch else {
            self.pause_s -= h;
            if self.pause_s > 0.0 {
                return DeviceInput::inactive();
            }
            let touch = begin(random, model, output, self.tip_radius);
            (self.position, self.velocity) = (touch.from, DVec3::ZERO);
            let position = touch.from;
            self.touch = Some(touch);
            return DeviceInput::touching(position);
        };
        touch.time_s += h;
        if touch.time_s > touch.end_s {
            self.touch = None;
            self.pause_s = random.within(0.05, PAUSE_S);
            return DeviceInput::inactive();
        }
        let dragged = touch.drag * (touch.time_s - touch.press_s).max(0.0);
        let target = touch.from.lerp(touch.to, smoothstep(touch.time_s / touch.press_s)) + dragged;
        // The page's tracking filter: critically damped, sampled exactly.
        let a = self.position - target;
        let b = self.velocity + a * TRACKING_FREQUENCY;
        let decay = (-TRACKING_FREQUENCY * h).exp();
        let offset = (a + b * h) * decay;
        (self.position, self.velocity) = (target + offset, b * decay - offset * TRACKING_FREQUENCY);
        DeviceInput::touching(self.position)
    }
}

/// A touch on a triangle that is seen from a random direction above.
fn begin(random: &mut Random, model: &Model, output: &Output, tip_radius: f64) -> Touch {
    let number = (random.unit() * output.objects.len() as f64) as usize;
    let recording = model.recordings().nth(number).expect("a recording of each object");
    let (surface, pose) = (&recording.surface, output.objects[number].pose);
    let view = -random.vector().with_y(random.within(0.2, 1.0)).normalize();
    let seen = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|node| pose.world_from_body(surface.positions[node as usize]));
        let normal = (b - a).cross(c - a).normalize();
        (normal.dot(view) < -FACING).then_some((a + b + c) / 3.0)
    };
    let start = (random.unit() * surface.triangles.len() as f64) as usize;
    let order = surface.triangles[start..].iter().chain(&surface.triangles[..start]);
    let point = order.filter_map(seen).next().unwrap_or(pose.position);
    let radius = surface.radius();
    let outside = (1.35 * tip_radius + 1e-4) / FACING;
    let press_s = random.within(PRESS_S[0], PRESS_S[1]);
    Touch {
        from: point - view * outside,
        to: point + view * (radius * random.within(DEPTH[0], DEPTH[1])),
        press_s,
        drag: random.vector() * random.within(0.0, DRAG_M_S),
        end_s: press_s + random.within(0.0, DRAG_S),
        time_s: 0.0,
    }
}
