//! Number of steps of a run.

use palpate_scene::Scene;

/// Largest number of steps of one `run`: a day at 1 kHz.
pub const MAX_STEPS: u32 = 100_000_000;

/// Number of steps by the motions, by the number of steps or the duration [s] that are given, or to the end of the scene's paths.
///
/// # Errors
/// Text for the caller.
pub fn count_steps(
    scene: &Scene,
    done: u64,
    motions: Option<usize>,
    (steps, duration): (Option<i64>, Option<f64>),
) -> Result<usize, String> {
    let step_s = scene.model.parameters().step_s;
    let count = match (motions, steps, duration) {
        (Some(given), None, None) => return Ok(given),
        (Some(_), ..) => return Err("the motions have a row per step: leave steps and duration out".into()),
        (None, Some(_), Some(_)) => return Err("give steps or duration, not both".into()),
        (None, Some(steps), None) => steps as f64,
        (None, None, Some(duration)) => (duration / step_s).round(),
        (None, None, None) if scene.end_s() > 0.0 => {
            ((scene.end_s() / step_s).round() - done as f64).max(0.0)
        }
        (None, None, None) => {
            return Err("the scene has no path that ends: give positions, steps or duration".into());
        }
    };
    if (0.0..=f64::from(MAX_STEPS)).contains(&count) {
        Ok(count as usize)
    } else {
        Err(format!("the run has {count} steps of {step_s} s, expected 0 to {MAX_STEPS}"))
    }
}
