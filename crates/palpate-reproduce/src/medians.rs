//! Medians of times with their range over a run.

use std::fmt;

/// Equal parts of a run whose medians are compared.
const PARTS: usize = 5;

/// Median of durations, and the range of the medians of five equal parts of the run [µs].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Median {
    pub us: f64,
    pub low_us: f64,
    pub high_us: f64,
}

impl Median {
    /// Of durations [ns] in the order in which they were measured; 0 of none.
    pub fn of(durations_ns: &[u32]) -> Self {
        let median = |part: &[u32]| {
            let mut sorted = part.to_vec();
            sorted.sort_unstable();
            sorted.get(sorted.len() / 2).map_or(0.0, |ns| f64::from(*ns) * 1e-3)
        };
        let parts = durations_ns.chunks_exact((durations_ns.len() / PARTS).max(1)).map(median);
        let (low_us, high_us) =
            parts.fold((f64::INFINITY, 0.0), |(l, h): (f64, f64), m| (l.min(m), h.max(m)));
        let us = median(durations_ns);
        Self { us, low_us: low_us.min(us), high_us: high_us.max(us) }
    }
}

impl fmt::Display for Median {
    /// In µs, or in ms from 1 ms on, with the range in brackets: "17.5 (17.2–18.0) µs".
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (scale, unit) = if self.us < 1e3 { (1.0, "µs") } else { (1e-3, "ms") };
        let [us, low, high] = [self.us, self.low_us, self.high_us].map(|us| us * scale);
        write!(f, "{us:.1} ({low:.1}–{high:.1}) {unit}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_range_is_that_of_the_parts_and_one_stall_does_not_widen_it() {
        let mut durations: Vec<u32> = (0..100).map(|at| 10_000 + 500 * (at / 20)).collect();
        durations[3] = 90_000_000;
        let median = Median::of(&durations);
        assert_eq!(median, Median { us: 11.0, low_us: 10.0, high_us: 12.0 });
        assert_eq!(median.to_string(), "11.0 (10.0–12.0) µs");
        assert_eq!(Median::of(&[2_000_000]).to_string(), "2.0 (2.0–2.0) ms");
        assert_eq!(Median::of(&[]).us, 0.0);
    }
}
