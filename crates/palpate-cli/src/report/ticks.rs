//! Where an axis puts a value, and its round numbers.
//!
//! A place is a share from 0 (low end) to 1 (high end): (v − low)/(high − low), or the same of log₁₀ v.

use super::text::width;

/// How values are spread over an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences are equally long.
    Linear,
    /// Equal ratios are equally long; only positive values have a place.
    Log,
}

/// What an axis spans: `low < high`, both finite, both positive if logarithmic.
#[derive(Clone, Copy, Debug)]
pub struct Span {
    /// How values are spread.
    pub scale: Scale,
    /// Value at the low end.
    pub low: f64,
    /// Value at the high end.
    pub high: f64,
}

/// A tick of an axis.
#[derive(Clone, Debug)]
pub struct Tick {
    /// Place, 0 to 1.
    pub share: f64,
    /// What stands beside it; nothing beside a minor tick.
    pub label: Option<String>,
}

/// Beyond this magnitude a ratio or a difference could overflow; below its inverse, vanish.
const HUGE: f64 = 1e140;
/// Values that differ by less than this share are drawn as one.
const SAME: f64 = 1e-9;
/// Room between labels in a row.
const LABEL_ROOM: f64 = 10.0;
/// Up to this ratio a logarithmic axis has evenly spaced numbers,
const EVEN_RATIO: f64 = 5.0;
/// up to this one the numbers 1, 2, 5 of each decade, then decades.
const DECADES_RATIO: f64 = 60.0;

impl Scale {
    /// Whether a value has a place.
    pub fn places(self, value: f64) -> bool {
        value.abs() < HUGE && (self == Self::Linear || value > HUGE.recip())
    }
}

impl Span {
    /// The span of those values that have a place, widened if they are all the same; none if there are none.
    pub fn around(values: impl Iterator<Item = f64>, scale: Scale) -> Option<Self> {
        let (low, high) = values
            .filter(|&value| scale.places(value))
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return None;
        }
        let largest = low.abs().max(high.abs());
        let constant = high - low <= SAME * largest || high - low < HUGE.recip();
        let (low, high) = match scale {
            _ if !constant => (low, high),
            Scale::Log => (low / 2.0, high * 2.0),
            Scale::Linear if largest < HUGE.recip() => (-1.0, 1.0),
            Scale::Linear => (low - largest / 2.0, high + largest / 2.0),
        };
        Some(Self { scale, low, high })
    }

    /// The span with a share of its length added at both ends.
    pub fn padded(self, share: f64) -> Self {
        let Self { scale, low, high } = self;
        match scale {
            Scale::Linear => {
                Self { scale, low: low - share * (high - low), high: high + share * (high - low) }
            }
            Scale::Log => {
                let factor = (high / low).powf(share);
                Self { scale, low: low / factor, high: high * factor }
            }
        }
    }

    /// A linear span grown to the next of about so many round numbers.
    pub fn rounded(self, about: usize) -> Self {
        if self.scale == Scale::Log {
            return self;
        }
        let step = round_step((self.high - self.low) / about as f64);
        let low = (self.low / step + SAME).floor() * step;
        Self { low, high: (self.high / step - SAME).ceil() * step, ..self }
    }

    /// Place of a value, if it has one; what lies outside is moved to the nearer end.
    pub fn share(&self, value: f64) -> Option<f64> {
        let Self { scale, low, high } = *self;
        scale.places(value).then(|| match scale {
            Scale::Linear => ((value - low) / (high - low)).clamp(0.0, 1.0),
            Scale::Log => ((value / low).log10() / (high / low).log10()).clamp(0.0, 1.0),
        })
    }

    /// At most about so many labelled ticks, and minor ones between them if logarithmic.
    pub fn ticks(&self, about: usize) -> Vec<Tick> {
        let about = about.max(1);
        let values = match self.scale {
            Scale::Log if self.high / self.low > EVEN_RATIO => self.log_ticks(about),
            _ => self.even_ticks(about),
        };
        let placed = values.into_iter().filter(|&(value, _)| {
            value >= self.low * (1.0 - SAME.copysign(self.low))
                && value <= self.high * (1.0 + SAME.copysign(self.high))
        });
        placed.filter_map(|(value, label)| self.share(value).map(|share| Tick { share, label })).collect()
    }

    /// As many ticks as leave labels apart in a row of some length.
    pub fn ticks_that_fit(&self, most: usize, length: f64) -> Vec<Tick> {
        let fits = |ticks: &Vec<Tick>| {
            let labelled = ticks.iter().filter_map(|tick| Some((tick.share * length, tick.label.as_ref()?)));
            let ends = labelled.map(|(at, label)| (at - width(label) / 2.0, at + width(label) / 2.0));
            let ends: Vec<(f64, f64)> = ends.collect();
            ends.windows(2).all(|pair| pair[0].1 + LABEL_ROOM <= pair[1].0)
        };
        let choices = (2..=most).rev().map(|about| self.ticks(about));
        choices.into_iter().find(fits).unwrap_or_else(|| self.ticks(1))
    }

    /// Multiples of a round step.
    fn even_ticks(&self, about: usize) -> Vec<(f64, Option<String>)> {
        let step = round_step((self.high - self.low) / about as f64);
        let largest = self.low.abs().max(self.high.abs());
        let (first, last) = ((self.low / step - SAME).ceil(), (self.high / step + SAME).floor());
        let multiples = (0..=(last - first).max(0.0) as usize).map(|i| (first + i as f64) * step);
        multiples.map(|value| (value, Some(number(value, step, largest)))).collect()
    }

    /// Decades, labelled as far as there is room; over few decades also their 2 and 5.
    fn log_ticks(&self, about: usize) -> Vec<(f64, Option<String>)> {
        let (first, last) = (self.low.log10().floor() as i32, self.high.log10().ceil() as i32);
        let decades = (last - first) as usize;
        let every = decades.div_ceil(about).max(1) as i32;
        let plain = self.low.log10().ceil() >= -3.0 && self.high.log10().floor() <= 4.0;
        let detailed = self.high / self.low < DECADES_RATIO && about > 3;
        let minor = decades <= 7;
        let mut ticks = Vec::new();
        for exponent in first..=last {
            for digit in 1..=if minor { 9 } else { 1 } {
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

/// The smallest of 1, 2, 5, 10, … that is not below a positive value.
fn round_step(value: f64) -> f64 {
    let power = 10_f64.powi(value.log10().floor() as i32);
    let digit = [1.0, 2.0, 5.0].into_iter().find(|digit| digit * power >= value * (1.0 - SAME));
    digit.unwrap_or(10.0) * power
}

/// A multiple of a step with the digits that tell it from its neighbours; in powers of ten where the largest
/// number of the axis has many zeros.
fn number(value: f64, step: f64, largest: f64) -> String {
    let order = |v: f64| (v.log10() + SAME).floor() as i32;
    if value.abs() < step / 2.0 {
        return "0".to_owned();
    }
    let exponent = if (1e-3..1e5).contains(&largest) { 0 } else { order(largest) };
    let decimals = (exponent - order(step)).max(0) as usize;
    let digits = format!("{:.decimals$}", value / 10_f64.powi(exponent)).replace('-', "−");
    if exponent == 0 { digits } else { format!("{digits}×10{}", superscript(exponent)) }
}

/// A whole number in raised digits.
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

    fn labels(low: f64, high: f64, scale: Scale, about: usize) -> Vec<String> {
        Span { scale, low, high }.ticks(about).into_iter().filter_map(|tick| tick.label).collect()
    }

    #[test]
    fn linear_ticks_are_ones_twos_and_fives() {
        assert_eq!(labels(0.0, 1.0, Scale::Linear, 6), ["0", "0.2", "0.4", "0.6", "0.8", "1.0"]);
        assert_eq!(labels(-7.0, 12.0, Scale::Linear, 5), ["−5", "0", "5", "10"]);
        assert_eq!(labels(0.0, 400.0, Scale::Linear, 4), ["0", "100", "200", "300", "400"]);
    }

    #[test]
    fn many_zeros_become_a_power_of_ten() {
        assert_eq!(
            labels(0.0, 2e-6, Scale::Linear, 4),
            ["0", "0.5×10⁻⁶", "1.0×10⁻⁶", "1.5×10⁻⁶", "2.0×10⁻⁶"]
        );
        assert_eq!(labels(0.0, 3e7, Scale::Linear, 3), ["0", "1×10⁷", "2×10⁷", "3×10⁷"]);
    }

    #[test]
    fn log_ticks_are_decades_and_few_when_there_are_many() {
        assert_eq!(labels(1e-3, 1.0, Scale::Log, 6), ["0.001", "0.01", "0.1", "1"]);
        assert_eq!(labels(1e-6, 1e-4, Scale::Log, 6), ["10⁻⁶", "10⁻⁵", "10⁻⁴"]);
        assert_eq!(labels(1e-15, 1.0, Scale::Log, 6), ["10⁻¹⁵", "10⁻¹²", "10⁻⁹", "10⁻⁶", "10⁻³", "10⁰"]);
        assert_eq!(labels(2.0, 30.0, Scale::Log, 6), ["2", "5", "10", "20"]);
        assert_eq!(labels(20.0, 60.0, Scale::Log, 5), ["20", "30", "40", "50", "60"]);
        let minor = Span { scale: Scale::Log, low: 1.0, high: 100.0 }.ticks(6);
        assert_eq!(minor.iter().filter(|tick| tick.label.is_none()).count(), 16);
    }

    #[test]
    fn every_tick_lies_on_the_axis_in_order() {
        for (low, high) in [(1e-130, 1e130), (0.3, 0.9), (5.0, 5.001), (3.0, 4000.0)] {
            for scale in [Scale::Linear, Scale::Log] {
                for about in 1..9 {
                    let ticks = Span { scale, low, high }.ticks(about);
                    assert!(ticks.iter().all(|tick| (0.0..=1.0).contains(&tick.share)));
                    assert!(ticks.windows(2).all(|pair| pair[0].share < pair[1].share));
                    assert!(ticks.iter().filter(|tick| tick.label.is_some()).count() <= 2 * about + 2);
                }
            }
        }
    }

    #[test]
    fn labels_in_a_row_stay_apart() {
        for (scale, low, high) in
            [(Scale::Linear, 0.0, 2e-5), (Scale::Log, 1e-90, 1.0), (Scale::Log, 2.0, 9.0)]
        {
            let ticks = Span { scale, low, high }.ticks_that_fit(9, 300.0);
            let labelled: Vec<&Tick> = ticks.iter().filter(|tick| tick.label.is_some()).collect();
            assert!(labelled.len() >= 2);
            for pair in labelled.windows(2) {
                let widths = pair.iter().map(|tick| width(tick.label.as_ref().expect("as it was drawn")));
                assert!((pair[1].share - pair[0].share) * 300.0 > widths.sum::<f64>() / 2.0);
            }
        }
    }

    #[test]
    fn equal_values_get_room_and_no_values_get_no_span() {
        assert!(Span::around([f64::NAN, f64::INFINITY].into_iter(), Scale::Linear).is_none());
        assert!(Span::around([0.0, -1.0].into_iter(), Scale::Log).is_none());
        for (value, scale) in [(0.0, Scale::Linear), (-3.0, Scale::Linear), (4e-7, Scale::Log)] {
            let span = Span::around([value, value].into_iter(), scale).expect("as it was drawn");
            assert!((span.share(value).expect("as it was drawn") - 0.5).abs() < 1e-9);
        }
    }
}
