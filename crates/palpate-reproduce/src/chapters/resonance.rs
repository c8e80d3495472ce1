//! Resonance of the free cube on two points that are held still, from its static solution alone.
//!
//! The cube moves to and fro as a whole and gives way at the two points. With F the force of both points together along their line, in phase, and ε = −1/(mω²) the motion of
//! the mass under it, the points stay where they are if
//!
//! ```text
//! 1/(m·ω²) = C₀ + ω²·C₁,    C₀ = fᵀ·u,    C₁ = uᵀ·M·u,    u = G·f
//! ```
//!
//! with f a half on each point, G [m/N] the static compliance of the free body (inertia relief), and C₁ the first term of the series of the
//! dynamic compliance in ω². Damping C = αM + βK of the deformation gives the decay of the amplitude
//!
//! ```text
//! σ = ½·(α·C₁ + β·C₀) / (1/(m·ω⁴) + C₁)
//! ```

use glam::DVec3;
use palpate::Damping;
use palpate_fem::RecordedBody;
use std::f64::consts::TAU;

/// A decaying vibration.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resonance {
    /// Frequency [Hz].
    pub hz: f64,
    /// Decay of the amplitude [1/s].
    pub decay_per_s: f64,
}

impl Resonance {
    /// Of a free body on two nodes that are held along the x axis.
    pub fn computed(body: &RecordedBody, nodes: [usize; 2]) -> Self {
        let mut load = vec![0.0; body.dofs()];
        nodes.iter().for_each(|node| load[3 * node] += 0.5);
        let unreduced = body.unreduced();
        let static_field = unreduced.static_displacements(std::slice::from_ref(&load));
        let momentum = unreduced.mass_times(&static_field);
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (c0, c1) = (dot(&load, &static_field[0]), dot(&static_field[0], &momentum[0]));
        let mass = body.recording.mass();
        // C₁·x² + C₀·x − 1/m = 0 for x = ω², in the form that keeps its digits.
        let square = 2.0 / mass / (c0 + (c0 * c0 + 4.0 * c1 / mass).sqrt());
        let (alpha, beta) = match body.recording.metadata.damping {
            Damping::Rayleigh { alpha, beta } => (alpha, beta),
            // 2ζω of the vibration itself, as β alone.
            Damping::Ratio(zeta) => (0.0, 2.0 * zeta / square.sqrt()),
        };
        let decay_per_s = 0.5 * (alpha * c1 + beta * c0) / (1.0 / (mass * square * square) + c1);
        Self { hz: square.sqrt() / TAU, decay_per_s }
    }

    /// Of a series of samples every `step_s`, near a frequency [Hz]: the largest Fourier component under Hann's window within 30 %, and its
    /// decay from the first to the second half of the series.
    pub fn measured(samples: &[f64], step_s: f64, near_hz: f64) -> Self {
        let finest = (1..=1200).map(|k| near_hz * (0.7 + 0.6 * f64::from(k) / 1200.0));
        let hz =
            finest.max_by(|a, b| component(samples, step_s, *a).total_cmp(&component(samples, step_s, *b)));
        let hz = hz.unwrap_or(near_hz);
        let (first, second) = samples.split_at(samples.len() / 2);
        let apart_s = first.len() as f64 * step_s;
        Self {
            hz,
            decay_per_s: (component(first, step_s, hz) / component(second, step_s, hz)).ln() / apart_s,
        }
    }

    /// The decaying vibration of this frequency and decay that is nearest to a series of samples, sample by sample.
    pub fn fitted(&self, samples: &[f64], step_s: f64) -> Vec<f64> {
        let basis = |at: usize| {
            let t = at as f64 * step_s;
            let (sin, cos) = (TAU * self.hz * t).sin_cos();
            [cos, sin].map(|x| x * (-self.decay_per_s * t).exp())
        };
        // Normal equations of two unknowns.
        let [mut aa, mut ab, mut bb, mut ay, mut by] = [0.0; 5];
        for (at, y) in samples.iter().enumerate() {
            let [a, b] = basis(at);
            (aa, ab, bb, ay, by) = (aa + a * a, ab + a * b, bb + b * b, ay + a * y, by + b * y);
        }
        let determinant = aa * bb - ab * ab;
        let (p, q) = ((ay * bb - by * ab) / determinant, (by * aa - ay * ab) / determinant);
        (0..samples.len())
            .map(|at| {
                let [a, b] = basis(at);
                p * a + q * b
            })
            .collect()
    }
}

/// Size of the Fourier component of samples at a frequency [Hz], under Hann's window.
fn component(samples: &[f64], step_s: f64, hz: f64) -> f64 {
    let count = samples.len() as f64;
    let (mut re, mut im) = (0.0, 0.0);
    for (at, y) in samples.iter().enumerate() {
        let window = 0.5 - 0.5 * (TAU * (at as f64 + 0.5) / count).cos();
        let (sin, cos) = (TAU * hz * at as f64 * step_s).sin_cos();
        (re, im) = (re + window * y * cos, im + window * y * sin);
    }
    re.hypot(im)
}

/// Nodes in the middle of the left and the right side of the cube.
pub fn side_nodes(body: &RecordedBody) -> [usize; 2] {
    [-0.05, 0.05].map(|x| body.nearest_node(DVec3::X * x))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bodies::cube;
    use palpate::{
        DeviceInput, DeviceParameters, Grasp, Input, Model, ModelObject, ModelParameters, ObjectStart, Pose,
        State, Twist, step,
    };
    use palpate_fem::SilentProgress;
    use std::sync::Arc;

    const STEP_S: f64 = 1e-3;

    /// Error of the series, cut after ω²: (ω/ω₁)⁴ of the modes' part of the compliance, and of the window of ten periods.
    const FREQUENCY: f64 = 0.005;
    const DECAY: f64 = 0.1;

    #[test]
    fn a_cube_on_two_held_points_rings_at_the_computed_frequency() {
        let body = cube(4, 60, &mut SilentProgress).expect("a cube");
        let nodes = side_nodes(&body);
        let expected = Resonance::computed(&body, nodes);
        let recording = Arc::new(body.recording.clone());
        let twist = Twist { linear: DVec3::X * 0.1, angular: DVec3::ZERO };
        let start = ObjectStart { pose: Pose::IDENTITY, twist };
        let parameters = ModelParameters {
            step_s: STEP_S,
            devices: vec![DeviceParameters::default(); 2],
            ..ModelParameters::for_reference()
        };
        let model =
            Model::new(parameters, vec![ModelObject::new(recording.clone(), start)]).expect("a model");
        let mut state = State::new(&model);
        let places = nodes.map(|node| body.nodes()[node]);
        let grasps =
            places.map(|place| recording.surface.nearest(place).map(|(point, _)| Grasp { object: 0, point }));
        let devices: Vec<DeviceInput> = places
            .into_iter()
            .zip(grasps)
            .map(|(position, grasp)| DeviceInput { position, mode: grasp.into() })
            .collect();
        let input = Input { devices, ..Input::default() };
        // What rings faster has decayed after 2 s.
        let forces: Vec<f64> = (0..5000)
            .map(|_| {
                step(&model, &mut state, &input).devices.iter().map(|device| device.force_on_hand.x).sum()
            })
            .collect();
        let found = Resonance::measured(&forces[2000..], STEP_S, expected.hz);
        assert!((found.hz / expected.hz - 1.0).abs() < FREQUENCY, "{found:?}, expected {expected:?}");
        assert!(
            (found.decay_per_s / expected.decay_per_s - 1.0).abs() < DECAY,
            "{found:?}, expected {expected:?}"
        );
        let fitted = found.fitted(&forces[2000..], STEP_S);
        let apart = forces[2000..].iter().zip(&fitted).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let largest = fitted.iter().copied().fold(0.0, f64::max);
        assert!(apart < 0.1 * largest, "{apart} of {largest}");
    }
}
