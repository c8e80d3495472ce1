//! Parameters of the contact solver: every tuned number in one place, each dimensionless by a named scale.
//!
//! Residuals are lengths, as shares of the *size* of the smallest object of the island. docs/ablation.md has what each is
//! worth.

/// Parameters of the contact solver.
pub(crate) struct SolverParameters {
    /// Residual of a contact's law at which an island is solved; and that for islands of few contacts, whose friction sticks
    /// without creep.
    pub(super) tolerance: f64,
    pub(super) exact_tolerance: f64,
    pub(super) few_contacts: usize,
    /// Residual that is enough after a number of contact visits: `visits`, or `visits_with_samples` where contact samples stand
    /// for nodes, since they are no more exact.
    pub(crate) loose_tolerance: f64,
    pub(super) visits: u32,
    pub(super) visits_with_samples: u32,
    /// Penetration that contacts themselves push out where contact samples stand for nodes: what the search for deep nodes leaves.
    pub(crate) sample_slop: f64,
    /// Residual that is used, and reported as unsolved, at the limit of sweeps.
    pub(super) rough_tolerance: f64,
    /// Upper limit of sweeps over all evaluations.
    pub(super) max_sweeps: u32,
    /// Change of a contact that a sweep skips, as a share of the accuracy that the sweeps aim at.
    pub(super) skip: f64,
    /// Goal of the sweeps between two evaluations, as a share of the residual before them.
    pub(super) sweep_goal: f64,
    /// Rotation within an evaluation [rad] from which contacts are linearised again.
    pub(super) relinearise: f64,
    /// Rotation [rad] up to which a linearisation is trusted: of a Newton step for the direction of slip, beyond which a
    /// fixed-point step is taken, and of an object in the scaled fallback (or its deformation, as a share of its radius).
    pub(super) max_turn: f64,
    /// Upper limit of scales that the fallback tries.
    pub(super) fallback_scales: u32,
    /// Denominator of a slipping contact's normal force, as a share of its normal compliance, below which it jams; the
    /// remainder shows as residual.
    pub(super) jam: f64,
    /// Share of a tip's penetration that is pushed out per step, as far as earlier losses pay for the work.
    pub(crate) recovery: f64,
}

/// The parameters.
pub(crate) const SOLVER: SolverParameters = SolverParameters {
    tolerance: 1e-8,
    exact_tolerance: 1e-12,
    few_contacts: 24,
    loose_tolerance: 1e-5,
    visits: 600,
    visits_with_samples: 60,
    sample_slop: 2e-3,
    rough_tolerance: 1e-4,
    max_sweeps: 400,
    skip: 0.1,
    sweep_goal: 0.02,
    relinearise: 0.01,
    max_turn: 0.3,
    fallback_scales: 4,
    jam: 0.05,
    recovery: 0.1,
};

/// Upper limit of exact evaluations, each of which reduces the residual of the rotation by a factor of about h·|ω| + strain. Reached only
/// where they diverge.
pub(super) const MAX_EVALUATIONS: u32 = 40;

/// Round-off of a length, as a share of (distance from the origin + size): a few roundings of x + R·(r + u).
pub(super) const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Compliance of a contact in a direction, as a share of that in all, below which it is the round-off of rotated zeros: fixed nodes.
pub(super) const RIGID: f64 = 1e-12;

/// Residual that counts as unsolved, as a share of the reach: more than round-off.
pub(crate) const UNSOLVED: f64 = 1e-9;
