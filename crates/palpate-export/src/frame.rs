//! Time windows, and the state of a scene at a frame.

use crate::error::TimeWindowError;
use crate::labels::{SceneLabels, obstacle_pose};
use glam::DVec3;
use palpate::{Input, Model, Output, Pose};

/// Time interval, and the frame rate in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TimeWindow {
    /// Start [s].
    pub from_s: f64,
    /// End [s]; may be infinite.
    pub to_s: f64,
    /// Frames per second of simulated time, above 0.
    pub fps: f64,
}

impl Default for TimeWindow {
    /// The whole run at 50 frames per second.
    fn default() -> Self {
        Self { from_s: 0.0, to_s: f64::INFINITY, fps: 50.0 }
    }
}

/// Rounding of times, which are sums of steps [frames].
const ROUNDING: f64 = 1e-9;

impl TimeWindow {
    /// Checks the numbers.
    ///
    /// # Errors
    /// When the interval is empty, starts before 0, or the frame rate is not positive.
    pub fn check(&self) -> Result<(), TimeWindowError> {
        let Self { from_s, to_s, fps } = *self;
        if !(fps.is_finite() && fps > 0.0) {
            return Err(TimeWindowError::FrameRate(fps));
        }
        if !(from_s.is_finite() && from_s >= 0.0) {
            return Err(TimeWindowError::Start(from_s));
        }
        if to_s.is_nan() || to_s <= from_s {
            return Err(TimeWindowError::End { from_s, to_s });
        }
        Ok(())
    }

    /// Whether a step that ends at a time is written.
    pub(crate) fn contains(&self, time_s: f64, step_s: f64) -> bool {
        let slack = 0.001 * step_s;
        time_s >= self.from_s - slack && time_s <= self.to_s + slack
    }

    /// Whether the next frame is due, after `taken` ones.
    pub(crate) fn due(&self, time_s: f64, taken: usize) -> bool {
        (time_s - self.from_s) * self.fps >= taken as f64 - ROUNDING
            && time_s <= self.to_s + ROUNDING / self.fps
    }

    /// Last step in the window, of a run of `steps` steps.
    pub fn last_step(&self, steps: u64, step_s: f64) -> u64 {
        // The conversion saturates.
        ((self.to_s / step_s + 0.001) as u64).min(steps)
    }

    /// Number of frames of a run of `steps` steps.
    pub fn frames(&self, steps: usize, step_s: f64) -> usize {
        let mut taken = 0;
        for number in 0..=self.last_step(steps as u64, step_s) {
            taken += usize::from(self.due(number as f64 * step_s, taken));
        }
        taken
    }
}

/// State of a scene at the time of a frame.
pub struct Frame<'a> {
    /// Model.
    pub model: &'a Model,
    /// Names of its parts.
    pub labels: &'a SceneLabels,
    /// Positions of devices and poses of obstacles.
    pub input: &'a Input,
    /// Result of the step.
    pub output: &'a Output,
    /// Elastic displacements of the surface nodes, by object [m, body frame].
    pub displacements: &'a [Vec<DVec3>],
}

impl Frame<'_> {
    /// Position of a device's tip: its proxy; before the first step its interface point [m, world].
    pub fn tip(&self, device: usize) -> DVec3 {
        let started = self.output.time_s > 0.0;
        if started { self.output.devices[device].proxy } else { self.input.devices[device].position }
    }

    /// Whether a device is shown: a transient one only while it is active.
    pub fn shows(&self, device: usize) -> bool {
        let inactive = !self.input.devices[device].mode.is_active();
        !(self.labels.devices[device].transient && inactive)
    }

    /// Pose of an obstacle.
    pub fn obstacle(&self, at: usize) -> Pose {
        obstacle_pose(self.model, self.input, at)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_taken_at_even_times_from_the_window_s_start_to_its_end() {
        let window = TimeWindow { from_s: 0.1, to_s: 0.2, fps: 30.0 };
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
        assert_eq!(TimeWindow::default().last_step(300, 0.001), 300);
        assert!(
            !window.contains(0.099, 0.001)
                && window.contains(0.1, 0.001)
                && window.contains(0.2000000001, 0.001)
        );
    }

    #[test]
    fn no_more_frames_than_steps_are_taken() {
        let window = TimeWindow { from_s: 0.0, to_s: f64::INFINITY, fps: 1e6 };
        assert_eq!(window.frames(10, 0.001), 11);
    }
}
