//! Verdicts: whether a statement of the paper holds here, by a number of the run and a limit.

use std::fmt;

/// Outcome of a statement, best first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Outcome {
    /// The number is within its limit.
    Holds,
    /// The number is beyond its limit.
    FallsShort,
    /// There is no number.
    NotReproduced,
}

/// Outcome with the comparisons that it follows from.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    pub outcome: Outcome,
    comparisons: Vec<String>,
}

/// Number of the run with its name and unit.
#[derive(Debug, Clone, Copy)]
pub struct Quantity<'a> {
    pub name: &'a str,
    pub value: f64,
    pub unit: &'a str,
}

/// Number of the run.
pub fn quantity<'a>(name: &'a str, value: f64, unit: &'a str) -> Quantity<'a> {
    Quantity { name, value, unit }
}

impl Quantity<'_> {
    /// Holds up to a limit.
    pub fn at_most(self, limit: f64) -> Verdict {
        self.compared(self.value <= limit, '≤', limit)
    }

    /// Holds from a limit on.
    pub fn at_least(self, limit: f64) -> Verdict {
        self.compared(self.value >= limit, '≥', limit)
    }

    /// Holds for one value.
    pub fn equals(self, expected: f64) -> Verdict {
        self.compared(self.value == expected, '=', expected)
    }

    fn compared(self, is_within: bool, relation: char, limit: f64) -> Verdict {
        let Self { name, value, unit } = self;
        if value.is_nan() {
            return Verdict {
                outcome: Outcome::NotReproduced,
                comparisons: vec![format!("{name}: no number")],
            };
        }
        let outcome = if is_within { Outcome::Holds } else { Outcome::FallsShort };
        let relation = match (is_within, relation) {
            (true, relation) => relation,
            (false, '≤') => '>',
            (false, '≥') => '<',
            (false, _) => '≠',
        };
        let (value, limit) = (short(value), short(limit));
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        Verdict { outcome, comparisons: vec![format!("{name} {value} {relation} {limit}{unit}")] }
    }
}

impl Verdict {
    /// Both: the worse outcome.
    pub fn and(mut self, other: Self) -> Self {
        self.outcome = self.outcome.max(other.outcome);
        self.comparisons.extend(other.comparisons);
        self
    }
}

impl fmt::Display for Verdict {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let outcome = match self.outcome {
            Outcome::Holds => "holds",
            Outcome::FallsShort => "falls short",
            Outcome::NotReproduced => "not reproduced",
        };
        write!(f, "{outcome}: {}", self.comparisons.join("; "))
    }
}

/// Three digits, or a power of ten.
fn short(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || (1e-3..1e5).contains(&size) {
        let digits = if size == 0.0 { 0 } else { (2 - size.log10().floor() as i32).clamp(0, 5) };
        let text = format!("{value:.*}", digits as usize);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').into() } else { text }
    } else {
        crate::powers::power_of_ten(value, 0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_number_decides_and_stands_beside_its_limit() {
        let time = |ms| quantity("force", ms, "ms").at_most(0.5);
        assert_eq!(time(0.021).to_string(), "holds: force 0.021 ≤ 0.5 ms");
        assert_eq!(time(24.3).to_string(), "falls short: force 24.3 > 0.5 ms");
        assert_eq!(time(f64::NAN).to_string(), "not reproduced: force: no number");
        let nodes = |count| quantity("nodes", count, "").at_least(866.0);
        assert_eq!(nodes(866.0).to_string(), "holds: nodes 866 ≥ 866");
        assert_eq!(nodes(98.0).to_string(), "falls short: nodes 98 < 866");
    }

    #[test]
    fn of_several_comparisons_the_worst_counts() {
        let both = |ms| quantity("a", 1.0, "").at_most(2.0).and(quantity("b", ms, "ms").at_most(2.0));
        assert_eq!(both(1.0).outcome, Outcome::Holds);
        assert_eq!(both(3.0).to_string(), "falls short: a 1 ≤ 2; b 3 > 2 ms");
        assert_eq!(both(f64::NAN).outcome, Outcome::NotReproduced);
    }
}
