//! Reference series: solutions with all 6585 modes of the paper's cube (`reference/README.md`).

/// Pinch, step 1 ms: time [s], force on the left node [N].
pub const PINCH_1_MS: &str = include_str!("../reference/pinch_full_1ms.csv");

/// Impulse response of the middle of the top face, step 1 ms: number of the sample, then displacement [m] of four nodes.
pub const IMPULSE_RESPONSE_1_MS: &str = include_str!("../reference/impulse_response_top_centre_1ms.csv");

/// Fall from 5 cm, step 1 ms: time [s], height [m], force [N], energy [J].
pub const FALL_1_MS: &str = include_str!("../reference/bounce_full_1ms.csv");

/// Fall at the paper's step, 2 ms.
pub const FALL_2_MS: &str = include_str!("../reference/bounce_full_2ms.csv");

/// Rebound [m] of the fall from 5 cm with all modes.
pub const UNREDUCED_REBOUND_M: f64 = 0.0245;

/// One step of the fall with all modes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct UnreducedFallRow {
    /// Time [s].
    pub time_s: f64,
    /// Height [m] of the lower face of the undeformed frame above the floor.
    pub height_m: f64,
    /// Normal force of the floor [N].
    pub force_n: f64,
}

/// The fall from 5 cm with all modes, at the paper's step of 2 ms.
pub fn unreduced_fall() -> Vec<UnreducedFallRow> {
    let [time, height, force] = [0, 1, 2].map(|number| column(FALL_2_MS, number));
    let rows = time.into_iter().zip(height).zip(force);
    rows.map(|((time_s, height_m), force_n)| UnreducedFallRow { time_s, height_m, force_n }).collect()
}

/// A column of a series, counted from 0, without its header.
pub fn column(series: &str, number: usize) -> Vec<f64> {
    series.lines().skip(1).filter_map(|row| row.split(',').nth(number)?.parse().ok()).collect()
}
