//! A two-finger gripper closes on a soft cube until its force sensors read 4 N, and lifts it by friction.
//!
//! `cargo run --release -p palpate-scene --example gripper` records the cube first, within seconds.

use palpate::glam::DVec3;
use palpate::{
    Damping, Input, Material, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Output, Pose,
    Shape, State, Twist, step,
};
use palpate_scene::{BodySource, MaterialChoice, RecordOptions, SilentProgress};
use std::error::Error;
use std::sync::Arc;

/// Numbers of the parts in the model.
const FLOOR: usize = 0;
const FINGERS: [usize; 2] = [1, 2];

/// Half extents of a finger, and half the side of the cube [m].
const FINGER_M: DVec3 = DVec3::new(0.02, 0.02, 0.005);
const HALF_M: f64 = 0.03;

/// Grip force that is wanted [N], and how fast the fingers close per newton that is missing [m/(N·s)], at most [m/s].
const GRIP_N: f64 = 4.0;
const GAIN: f64 = 0.02;
const MAX_SPEED_M_S: f64 = 0.05;

/// Height of the lift [m], and when it begins and ends [s].
const LIFT_M: f64 = 0.1;
const LIFT_S: [f64; 2] = [0.5, 1.0];

/// Gripper: opening between cube and fingers [m], negative when they press.
struct Gripper {
    opening: f64,
}

impl Gripper {
    /// Pose of a finger at a height [m].
    fn finger(&self, side: f64, height: f64) -> Pose {
        let z = side * (HALF_M + FINGER_M.z + self.opening);
        Pose { position: DVec3::new(0.0, HALF_M + height, z), ..Pose::IDENTITY }
    }

    /// Poses of floor and fingers at a height [m].
    fn poses(&self, height: f64) -> Vec<Pose> {
        vec![Pose::IDENTITY, self.finger(-1.0, height), self.finger(1.0, height)]
    }

    /// Grip force [N]: the mean of what presses the fingers apart.
    fn force(output: &Output) -> f64 {
        let [left, right] = FINGERS.map(|finger| output.obstacles[finger].force.z);
        0.5 * (right - left)
    }

    /// Force control: closes while the force is too small, opens while it is too large.
    fn control(&mut self, output: &Output, step_s: f64) {
        let speed = (GAIN * (GRIP_N - Self::force(output))).clamp(-MAX_SPEED_M_S, MAX_SPEED_M_S);
        self.opening -= speed * step_s;
    }
}

/// Height of the fingers above their start at a time [m].
fn lift(time_s: f64) -> f64 {
    let s = ((time_s - LIFT_S[0]) / (LIFT_S[1] - LIFT_S[0])).clamp(0.0, 1.0);
    LIFT_M * s * s * (3.0 - 2.0 * s)
}

/// Runs the gripper; gives a line per 100 ms.
fn run() -> Result<Vec<String>, Box<dyn Error>> {
    let options = RecordOptions {
        materials: MaterialChoice::Uniform(Material::isotropic(3e4, 0.4, 1000.0)),
        damping: Some(Damping::Rayleigh { alpha: 0.0, beta: 2e-3 }),
        modes: 60,
        ..RecordOptions::default()
    };
    let cube = options.record(BodySource::Text("box:0.06x0.06x0.06/4x4x4"), &mut SilentProgress)?;
    println!("cube of {:.3} kg, {} modes", cube.mass(), cube.modes.len());
    let mut gripper = Gripper { opening: 0.002 };
    let shapes = [
        Shape::Plane { normal: DVec3::Y },
        Shape::Box { half_extents: FINGER_M },
        Shape::Box { half_extents: FINGER_M },
    ];
    let place = |(shape, pose)| Obstacle { shape, pose, friction: 0.8 };
    let parameters = ModelParameters {
        gravity: DVec3::Y * -9.81,
        obstacles: shapes.into_iter().zip(gripper.poses(0.0)).map(place).collect(),
        ..ModelParameters::default()
    };
    let start =
        ObjectStart { pose: Pose { position: DVec3::Y * HALF_M, ..Pose::IDENTITY }, twist: Twist::ZERO };
    let model = Model::new(parameters, vec![ModelObject::new(Arc::new(cube), start)])?;
    let step_s = model.parameters().step_s;
    let mut state = State::new(&model);
    let mut lines = vec!["time [s]   grip [N]   floor [N]   fingers [mm]   cube [mm]".to_string()];
    for number in 1..=1400_u32 {
        let height = lift(f64::from(number) * step_s);
        let output =
            step(&model, &mut state, &Input { obstacles: gripper.poses(height), ..Input::default() });
        gripper.control(output, step_s);
        if number % 100 == 0 {
            lines.push(format!(
                "{:8.1}   {:8.3}   {:9.3}   {:12.2}   {:10.2}",
                output.time_s,
                Gripper::force(output),
                -output.obstacles[FLOOR].force.y,
                1e3 * height,
                1e3 * (output.objects[0].pose.position.y - HALF_M)
            ));
        }
    }
    Ok(lines)
}

fn main() -> Result<(), Box<dyn Error>> {
    for line in run()? {
        println!("{line}");
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grip force against the wanted one [N], and height of the cube against that of the fingers [mm]: what control and friction leave.
    const CONTROLLED_N: f64 = 0.05;
    const CARRIED_MM: f64 = 1.0;

    #[test]
    fn the_cube_is_gripped_with_the_wanted_force_and_goes_up_with_the_fingers() {
        let lines = run().expect("a run");
        let numbers = |line: &String| line.split_whitespace().map(|n| n.parse().expect("a number")).collect();
        let rows: Vec<Vec<f64>> = lines[1..].iter().map(numbers).collect();
        let [before, last] = [&rows[4], &rows[13]];
        assert!(before[2] > 1.0 && before[4].abs() < CARRIED_MM, "it stands on the floor: {before:?}");
        assert!((last[1] - GRIP_N).abs() < CONTROLLED_N, "{last:?}");
        assert!(last[2] == 0.0 && last[3] == 100.0, "{last:?}");
        assert!((last[4] - last[3]).abs() < CARRIED_MM, "{last:?}");
    }
}
