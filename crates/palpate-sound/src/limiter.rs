//! Soft limiter: linear up to a knee, then saturating below a ceiling.
//!
//! ```text
//! y = x                                       |x| ≤ knee
//! y = ±(knee + (c − knee)·tanh((|x| − knee)/(c − knee)))    beyond, c: ceiling
//! ```
//!
//! Value and slope are continuous, and |y| ≤ c < 1 for every x. Without memory: it delays nothing, and distorts what is too loud.
//!
//! Equations: docs/theory.md (C88).

/// Size [1, of full scale] up to which samples pass as they are.
pub const KNEE: f64 = 0.5;

/// Upper limit of the size of samples [1, of full scale]: 1 dB below full scale.
pub const CEILING: f64 = 0.89;

/// Limited sample; silence for one that is no number.
pub fn limit(sample: f64) -> f64 {
    let size = sample.abs();
    if size <= KNEE {
        return sample;
    }
    if size.is_nan() {
        return 0.0;
    }
    let room = CEILING - KNEE;
    let limited = KNEE + room * libm::tanh((size - KNEE) / room);
    libm::copysign(limited.min(CEILING), sample)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_samples_pass_and_no_sample_is_above_the_ceiling() {
        assert_eq!([limit(0.3), limit(-0.5), limit(f64::NAN)], [0.3, -0.5, 0.0]);
        for size in [0.51, 1.0, 3.0, 1e3, f64::MAX, f64::INFINITY] {
            assert!(limit(size) <= CEILING && limit(size) > KNEE, "{size}");
            assert_eq!(limit(-size), -limit(size));
        }
    }

    #[test]
    fn the_curve_rises_with_a_slope_of_at_most_one_that_is_continuous_at_the_knee() {
        let step = 1e-4;
        let slopes =
            (0..20_000).map(|at| (limit(f64::from(at + 1) * step) - limit(f64::from(at) * step)) / step);
        let mut last = 1.0;
        for slope in slopes {
            // The slope is 1 − tanh², whose steepest descent is 0.77 per room of 0.39.
            assert!(
                slope > 0.0 && slope <= 1.0 + 1e-9 && (slope - last).abs() < 2.0 * step / (CEILING - KNEE)
            );
            last = slope;
        }
    }
}
