//! Axes: the range that they span, the position of a value, and round tick values.
//!
//! With t(v) = v on a linear and log₁₀ v on a logarithmic axis, the position of a value is (t(v) − low)/(high − low), from 0 to 1.

/// Largest magnitude that has a position; differences and ratios of larger ones could overflow.
const LARGEST: f64 = 1e140;

/// Relative difference below which two values are one.
const SAME: f64 = 1e-9;

/// Decades up to which 2 and 5 are labelled as well.
const DETAILED_DECADES: f64 = 1.8;

/// Decades up to which the values between are minor ticks.
const MINOR_DECADES: i32 = 7;

/// Spacing of values on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences have equal lengths.
    Linear,
    /// Equal ratios have equal lengths; only positive values have a position.
    Log,
}

/// Range of an axis.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    scale: Scale,
    /// t at the low end.
    low: f64,
    /// t at the high end.
    high: f64,
}

/// A tick of an axis.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Position from 0 to 1.
    pub position: f64,
    /// Number beside it; `None` for a minor tick.
    pub label: Option<String>,
}

impl Scale {
    /// t(v), where the value has a position.
    pub fn transform(self, value: f64) -> Option<f64> {
        match self {
            Self::Linear => (value.abs() < LARGEST).then_some(value),
            Self::Log => (value > LARGEST.recip() && value < LARGEST).then(|| value.log10()),
        }
    }
}

impl Range {
    /// Range of the values that have a position; equal values are in its middle, no values give one of length 1.
    pub fn of(values: impl Iterator<Item = f64>, scale: Scale) -> Self {
        let placed = values.filter_map(|value| scale.transform(value));
        let (low, high) =
            placed.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), t| (low.min(t), high.max(t)));
        let size = low.abs().max(high.abs());
        let (low, high) = match scale {
            _ if low > high => (0.0, 1.0),
            _ if high - low > SAME * size => (low, high),
            Scale::Log => (low - 0.3, high + 0.3),
            Scale::Linear if size == 0.0 => (-1.0, 1.0),
            Scale::Linear => (low - 0.5 * size, high + 0.5 * size),
        };
        Self { scale, low, high }
    }

    /// The range with a share of its length added at both ends.
    pub fn padded(self, share: f64) -> Self {
        let pad = share * (self.high - self.low);
        Self { low: self.low - pad, high: self.high + pad, ..self }
    }

    /// A linear range extended to the next round values; a logarithmic one as it is.
    pub fn rounded(self, intervals: usize) -> Self {
        if self.scale == Scale::Log {
            return self;
        }
        let step = round_step((self.high - self.low) / intervals as f64);
        let low = (self.low / step + SAME).floor() * step;
        Self { low, high: (self.high / step - SAME).ceil() * step, ..self }
    }

    /// Position of a value, clamped to [0, 1], if it has one.
    pub fn position(&self, value: f64) -> Option<f64> {
        let t = self.scale.transform(value)?;
        Some(((t - self.low) / (self.high - self.low)).clamp(0.0, 1.0))
    }

    /// Ticks at round values, in about so many intervals, and minor ones between decades.
    pub fn ticks(&self, intervals: usize) -> Vec<Tick> {
        let values = match self.scale {
            Scale::Linear => even_ticks(self.low, self.high, intervals),
            Scale::Log => self.decade_ticks(intervals),
        };
        let slack = SAME * self.low.abs().max(self.high.abs());
        let inside = values.into_iter().filter(|(value, _)| {
            let t = self.scale.transform(*value);
            t.is_some_and(|t| (self.low - slack..=self.high + slack).contains(&t))
        });
        inside.filter_map(|(value, label)| Some(Tick { position: self.position(value)?, label })).collect()
    }

    /// Powers of ten, labelled as far as there is room; over few decades also their 2 and 5.
    fn decade_ticks(&self, intervals: usize) -> Vec<(f64, Option<String>)> {
        let (first, last) = (self.low.floor() as i32, self.high.ceil() as i32);
        let every = ((last - first) as usize).div_ceil(intervals.max(1)).max(1) as i32;
        let plain = self.low.ceil() >= -3.0 && self.high.floor() <= 4.0;
        let detailed = self.high - self.low < DETAILED_DECADES;
        let digits = if last - first <= MINOR_DECADES { 9 } else { 1 };
        let mut ticks = Vec::new();
        for exponent in first..=last {
            for digit in 1..=digits {
                let value = f64::from(digit) * 10_f64.powi(exponent);
                let labelled = match digit {
                    1 => exponent.rem_euclid(every) == 0,
                    2 | 5 => detailed,
                    _ => false,
                };
                let label = match digit {
                    _ if plain => format!("{value:.0$}", (-exponent).max(0) as usize),
                    1 => format!("10{}", superscript(exponent)),
                    _ => format!("{digit}×10{}", superscript(exponent)),
                };
                ticks.push((value, labelled.then_some(label)));
            }
        }
        ticks
    }
}

/// Multiples of a round step between two values, with the digits that tell them apart.
fn even_ticks(low: f64, high: f64, intervals: usize) -> Vec<(f64, Option<String>)> {
    let step = round_step((high - low) / intervals.max(1) as f64);
    let decimals = (-(step.log10() + SAME).floor()).max(0.0) as usize;
    let (first, last) = ((low / step - SAME).ceil(), (high / step + SAME).floor());
    let number = |multiple: f64| match multiple {
        0.0 => "0".to_owned(),
        _ => format!("{:.decimals$}", multiple * step).replace('-', "−"),
    };
    let multiples = (0..=(last - first).max(0.0) as usize).map(|i| first + i as f64);
    multiples.map(|multiple| (multiple * step, Some(number(multiple)))).collect()
}

/// The smallest of 1, 2, 5, 10, … that is not below a positive value.
fn round_step(value: f64) -> f64 {
    let power = 10_f64.powi(value.log10().floor() as i32);
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= value * (1.0 - SAME));
    digit.unwrap_or(10.0) * power
}

/// A whole number in superscript digits.
fn superscript(value: i32) -> String {
    let raised = |c: char| match c {
        '-' => '⁻',
        _ => c.to_digit(10).and_then(|digit| "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(digit as usize)).unwrap_or(c),
    };
    value.to_string().chars().map(raised).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(low: f64, high: f64, scale: Scale, intervals: usize) -> Vec<String> {
        let range = Range::of([low, high].into_iter(), scale);
        range.ticks(intervals).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_ones_twos_and_fives() {
        assert_eq!(labels(0.0, 1.0, Scale::Linear, 6), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-7.0, 12.0, Scale::Linear, 5), ["−5", "0", "5", "10"]);
        assert_eq!(labels(0.0, 400.0, Scale::Linear, 4), ["0", "100", "200", "300", "400"]);
    }

    #[test]
    fn log_ticks_are_decades_and_few_when_there_are_many() {
        assert_eq!(labels(1e-3, 1.0, Scale::Log, 6), ["0.001", "0.01", "0.1", "1"]);
        assert_eq!(labels(1e-6, 1e-4, Scale::Log, 6), ["10⁻⁶", "10⁻⁵", "10⁻⁴"]);
        assert_eq!(labels(1e-15, 1.0, Scale::Log, 6), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        assert_eq!(labels(2.0, 30.0, Scale::Log, 6), ["2", "5", "10", "20"]);
        let minor = Range::of([1.0, 100.0].into_iter(), Scale::Log).ticks(6);
        assert_eq!(minor.iter().filter(|tick| tick.label.is_none()).count(), 16);
    }

    #[test]
    fn every_tick_lies_on_the_axis_in_order() {
        for (low, high) in [(1e-130, 1e130), (0.3, 0.9), (5.0, 5.001), (3.0, 4000.0)] {
            for scale in [Scale::Linear, Scale::Log] {
                for intervals in 1..9 {
                    let ticks = Range::of([low, high].into_iter(), scale).ticks(intervals);
                    assert!(ticks.iter().all(|tick| (0.0..=1.0).contains(&tick.position)));
                    assert!(ticks.windows(2).all(|pair| pair[0].position < pair[1].position));
                    assert!(ticks.iter().filter(|tick| tick.label.is_some()).count() <= 2 * intervals + 2);
                }
            }
        }
    }

    #[test]
    fn equal_values_are_in_the_middle_and_no_values_give_a_range() {
        for (value, scale) in [(0.0, Scale::Linear), (-3.0, Scale::Linear), (4e-7, Scale::Log)] {
            let range = Range::of([value, value].into_iter(), scale);
            assert!((range.position(value).expect("a position") - 0.5).abs() < 1e-9);
        }
        let range = Range::of([f64::NAN, 0.0, -1.0].into_iter(), Scale::Log);
        assert_eq!(range.position(-1.0), None);
        assert_eq!(range.ticks(5).first().map(|tick| tick.position), Some(0.0));
    }
}
