//! Budget of recovery: what losses pay for pushing objects out of obstacles and of each other by contact forces.
//!
//! ```text
//! b⁺ = e^(−h/T)·b + ½·losses − given back        a debt, b < 0, is not forgotten
//! ```
//!
//! In the long run contacts give back at most half of what friction, damping and blows take, and nothing where nothing is lost: a body that
//! rocks on nodes that come and go cannot draw on losses of long ago for ever.
//!
//! Equations: docs/theory.md (C38), (C81).

/// Time T in which losses are forgotten [s]: some time constants of the motion that pushes out, less than anybody waits for a body to rest.
const MEMORY_S: f64 = 0.2;

/// Budget of recovery of a scene.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct RecoveryBudget {
    /// Energy b [J]; negative where more was given back than the forces before the step foretold. Losses pay such a debt first.
    available: f64,
}

impl RecoveryBudget {
    /// Energy that is available in a step [J].
    pub(crate) fn available(&self) -> f64 {
        self.available
    }

    /// Close a step of h [s] with its losses, net of what contacts gave back [J].
    pub(crate) fn close(&mut self, step_s: f64, net_losses: f64, given_back: f64) {
        let kept = if self.available > 0.0 { libm::exp(-step_s / MEMORY_S) } else { 1.0 };
        self.available = kept * self.available + 0.5 * (net_losses + given_back) - given_back;
    }
}
