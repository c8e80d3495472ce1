//! Which steps are written and drawn, and what is to be seen at one of them.

use crate::Failure;
use crate::scene_file::Scene;
use glam::DVec3;
use palpate::{DeviceMode, Input, Output, Pose};

/// A stretch of time, and frames in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Where it begins [s].
    pub from_s: f64,
    /// Where it ends [s]; may be infinite.
    pub to_s: f64,
    /// Frames per second of simulated time, above 0.
    pub fps: f64,
}

impl Default for Window {
    /// All of it, 50 times a second.
    fn default() -> Self {
        Self { from_s: 0.0, to_s: f64::INFINITY, fps: 50.0 }
    }
}

/// Times are sums of steps: they miss what they mean by some rounding [1/frame].
const ROUNDING: f64 = 1e-9;

impl Window {
    pub(super) fn check(&self) -> Result<(), Failure> {
        let Self { from_s, to_s, fps } = *self;
        if !(fps.is_finite() && fps > 0.0) {
            return Err(Failure(format!("--fps is {fps}, expected a positive number")));
        }
        if !(from_s.is_finite() && from_s >= 0.0) {
            return Err(Failure(format!("--from is {from_s} s, expected a time from 0 on")));
        }
        if to_s.is_nan() || to_s <= from_s {
            return Err(Failure(format!("--to is {to_s} s, expected a time after --from, {from_s} s")));
        }
        Ok(())
    }

    /// Whether a step that ends then is written.
    pub(super) fn holds(&self, time_s: f64, step_s: f64) -> bool {
        let slack = 0.001 * step_s;
        time_s >= self.from_s - slack && time_s <= self.to_s + slack
    }

    /// Whether a frame is due when so many have been taken.
    pub(super) fn due(&self, time_s: f64, taken: usize) -> bool {
        (time_s - self.from_s) * self.fps >= taken as f64 - ROUNDING
            && time_s <= self.to_s + ROUNDING / self.fps
    }

    /// The last of so many steps that it needs.
    pub fn last_step(&self, steps: u64, step_s: f64) -> u64 {
        // A float becomes the nearest whole number that there is.
        ((self.to_s / step_s + 0.001) as u64).min(steps)
    }

    /// How many frames so many steps give.
    pub fn frames(&self, steps: usize, step_s: f64) -> usize {
        let mut taken = 0;
        for number in 0..=self.last_step(steps as u64, step_s) {
            taken += usize::from(self.due(number as f64 * step_s, taken));
        }
        taken
    }
}

/// What is to be seen at one moment.
pub struct Frame<'a> {
    /// What there is.
    pub scene: &'a Scene,
    /// Where devices and obstacles are.
    pub input: &'a Input,
    /// What came of it.
    pub output: &'a Output,
    /// Elastic displacement [m, body] of every surface node, per object.
    pub displacements: &'a [Vec<DVec3>],
}

impl Frame<'_> {
    /// Where the tip of a device is [m, world]: its proxy, and before the first step the hand.
    pub fn tip(&self, device: usize) -> DVec3 {
        let started = self.output.time_s > 0.0;
        if started { self.output.devices[device].proxy } else { self.input.devices[device].position }
    }

    /// Whether a device is there: a pointer that nobody holds is nowhere, others wait where they are.
    pub fn shows(&self, device: usize) -> bool {
        let is_away = self.input.devices[device].mode == DeviceMode::Inactive;
        !(self.scene.devices[device].pointer && is_away)
    }

    /// Where an obstacle is.
    pub fn obstacle(&self, at: usize) -> Pose {
        obstacle_pose(self.scene, self.input, at)
    }
}

/// Where an obstacle is; one that the input does not tell of stays where it began.
pub fn obstacle_pose(scene: &Scene, input: &Input, at: usize) -> Pose {
    input.obstacles.get(at).copied().unwrap_or(scene.model.parameters().obstacles[at].pose)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_taken_at_even_times_from_the_window_s_start_to_its_end() {
        let window = Window { from_s: 0.1, to_s: 0.2, fps: 30.0 };
        let mut taken = Vec::new();
        for number in 0..=300 {
            let time = f64::from(number) * 0.001;
            if window.due(time, taken.len()) {
                taken.push(number);
            }
        }
        assert_eq!(taken, [100, 134, 167, 200]);
        assert_eq!(window.frames(300, 0.001), 4);
        assert_eq!(window.last_step(300, 0.001), 200);
        assert_eq!(Window::default().last_step(300, 0.001), 300);
        assert!(!window.holds(0.099, 0.001) && window.holds(0.1, 0.001) && window.holds(0.2000000001, 0.001));
    }

    #[test]
    fn no_more_frames_than_steps_are_taken() {
        let window = Window { from_s: 0.0, to_s: f64::INFINITY, fps: 1e6 };
        assert_eq!(window.frames(10, 0.001), 11);
    }
}
