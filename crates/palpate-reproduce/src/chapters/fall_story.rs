//! The instants of a fall that tell its story, found in the steps of a run.

use crate::log_steps::LoggedStep;

/// Step of the run [s].
pub const STEP_S: f64 = 2e-3;

/// Height of the cube's centre when it stands undeformed [m].
pub const HALF_M: f64 = 0.05;

/// Largest deviation of the floor's force from its mean, as a share of it, of a cube that lies still.
const STILL: f64 = 0.1;

/// Time for which the deviation is looked at [s].
const STILL_S: f64 = 0.2;
/// Height above the floor at which a jump begins [m].
const JUMP_M: f64 = 1e-3;

/// The instants that tell the story, as places in the steps of a run.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Story {
    /// The first force of the floor.
    pub touch: usize,
    /// The lowest of the first contact.
    pub deepest: usize,
    /// The last force of the floor before the top.
    pub leaves: usize,
    /// The highest between first and second contact.
    pub top: usize,
    /// The lowest of the second contact.
    pub second: usize,
}

/// Height of the centre above that of the cube standing undeformed [m].
pub fn height(logged: &LoggedStep) -> f64 {
    logged.centre.y - HALF_M
}

impl Story {
    /// The story of a run; none if it does not bounce.
    pub fn find(steps: &[LoggedStep]) -> Option<Self> {
        let after = |from: usize, is: &dyn Fn(&LoggedStep) -> bool| {
            steps[from..].iter().position(is).map(|found| from + found)
        };
        let lowest = |from: usize, to: usize| {
            (from..to).min_by(|&a, &b| height(&steps[a]).total_cmp(&height(&steps[b])))
        };
        let touch = after(0, &|logged| logged.support.y > 0.0)?;
        let up = after(touch + 1, &|logged| height(logged) > JUMP_M)?;
        let deepest = lowest(touch, up)?;
        let down = after(up, &|logged| height(logged) < 0.0)?;
        let top = (up..down).max_by(|&a, &b| height(&steps[a]).total_cmp(&height(&steps[b])))?;
        let leaves = (deepest..top).rev().find(|&at| steps[at].support.y > 0.0)?;
        let up_again = after(down, &|logged| height(logged) > JUMP_M).unwrap_or(steps.len());
        Some(Self { touch, deepest, leaves, top, second: lowest(down, up_again)? })
    }

    /// Steps since the start, with captions.
    pub fn instants(&self, steps: &[LoggedStep]) -> Vec<(u64, String)> {
        let bends = (self.touch..=self.deepest)
            .find(|&at| height(&steps[at]) < 0.5 * height(&steps[self.deepest]))
            .unwrap_or(self.deepest);
        let of = |at: usize, what: &str| {
            let logged = &steps[at];
            (logged.step, format!("{:.3} s: {what}", logged.time_s))
        };
        vec![
            (0, "0 s: let go, 5 cm above the floor".into()),
            of(self.touch.saturating_sub(1), "just before contact"),
            of(bends, "the lower face lies, the rest falls on"),
            of(self.deepest, "deepest"),
            of((self.leaves + 1).min(self.top), "leaves the floor"),
            of(self.top, &format!("top of the rebound, {:.1} mm", 1e3 * height(&steps[self.top]))),
            of(self.second, "deepest of the second contact"),
            of(
                steps.len() - 1,
                if lies_still(steps) {
                    "lies still, sagging under its weight"
                } else {
                    "on the floor, still trembling"
                },
            ),
        ]
    }
}

fn lies_still(steps: &[LoggedStep]) -> bool {
    let late = &steps[steps.len().saturating_sub((STILL_S / STEP_S) as usize)..];
    let mean = late.iter().map(|logged| logged.support.y).sum::<f64>() / late.len() as f64;
    late.iter().all(|logged| (logged.support.y - mean).abs() <= STILL * mean)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::log_steps::tests::at_rest;
    use glam::DVec3;

    /// A ball on a spring floor, in numbers.
    fn bounce() -> Vec<LoggedStep> {
        let heights = [50, 30, 0, -10, -5, 0, 10, 24, 12, 0, -6, -3, 4, 0];
        let logged = |(at, mm): (usize, i32)| LoggedStep {
            centre: DVec3::Y * (HALF_M + 1e-3 * f64::from(mm)),
            support: DVec3::Y * f64::from(u8::from(mm < 0)),
            ..at_rest(at as u64 + 1, 0.01 * (at + 1) as f64)
        };
        heights.into_iter().enumerate().map(logged).collect()
    }

    #[test]
    fn the_story_of_a_bounce_goes_from_touch_to_second_contact() {
        let found = Story::find(&bounce()).expect("it bounces");
        assert_eq!(found, Story { touch: 3, deepest: 3, leaves: 4, top: 7, second: 10 });
        let instants = found.instants(&bounce());
        assert!(instants.is_sorted_by_key(|(step, _)| *step), "{instants:?}");
        assert!(instants[5].1.contains("24.0 mm"), "{instants:?}");
    }

    #[test]
    fn what_never_touches_has_no_story() {
        assert_eq!(Story::find(&bounce()[..3]), None);
    }
}
