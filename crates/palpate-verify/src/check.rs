//! One quantity against its known value.

/// By how much an observed order of convergence may fall short on meshes that are too coarse to be asymptotic.
const ORDER_SHORTFALL: f64 = 0.3;

/// A quantity that was computed, and the value that it must have.
///
/// ```text
/// error = |measured/expected − 1| ≤ tolerance        or |measured| where expected = 0
/// ```
#[derive(Debug, Clone)]
pub struct Check {
    /// Name of the quantity, with its unit in brackets.
    pub quantity: String,
    /// Computed value.
    pub measured: f64,
    /// Known value.
    pub expected: f64,
    /// Relative error, or the absolute one where `expected` is 0.
    pub error: f64,
    /// Largest error with which the check passes.
    pub tolerance: f64,
    /// Observed and expected order of convergence.
    pub order: Option<[f64; 2]>,
}

impl Check {
    /// A comparison without order of convergence.
    pub fn new(quantity: impl Into<String>, measured: f64, expected: f64, tolerance: f64) -> Self {
        let error = if expected == 0.0 { measured.abs() } else { (measured / expected - 1.0).abs() };
        Self { quantity: quantity.into(), measured, expected, error, tolerance, order: None }
    }

    /// Adds the order of convergence that two errors show at sizes that differ by `ratio`: ln(coarse/fine)/ln(ratio).
    pub fn with_order(self, coarse: f64, fine: f64, ratio: f64, expected: f64) -> Self {
        let observed = (coarse / fine).ln() / ratio.ln();
        Self { order: Some([observed, expected]), ..self }
    }

    /// Whether the error is within its tolerance and the order no less than expected, but for 0.3 on coarse meshes.
    pub fn passed(&self) -> bool {
        let order = self.order.is_none_or(|[observed, expected]| observed > expected - ORDER_SHORTFALL);
        self.error <= self.tolerance && order
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_relative_except_where_nothing_is_expected() {
        assert!((Check::new("force [N]", 1.02, 1.0, 0.03).error - 0.02).abs() < 1e-12);
        assert_eq!(Check::new("energy [J]", -2e-9, 0.0, 1e-9).error, 2e-9);
    }

    #[test]
    fn no_number_and_too_low_an_order_fail() {
        assert!(!Check::new("force [N]", f64::NAN, 1.0, 1.0).passed());
        let second_order = |fine| Check::new("force [N]", 1.0, 1.0, 0.1).with_order(1.0, fine, 2.0, 2.0);
        assert!(second_order(0.25).passed());
        assert!(!second_order(0.5).passed());
    }
}
