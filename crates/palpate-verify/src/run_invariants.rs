//! Invariants of every run with contacts: no energy from nowhere, no contact left unsolved.

use crate::check::Check;
use palpate::Output;

/// Sums over some thousand steps and some hundred contacts, whose terms cancel to a hundredth of themselves: 1e5 ulps.
pub const ROUND_OFF: f64 = 1e-11;

/// The largest violations seen in a run.
///
/// ```text
/// gain   stored − stored at the start − input        defect   energy that no term of the ledger explains
/// ```
///
/// Both are shares of the largest energy that was in the scene.
#[derive(Default)]
pub struct RunInvariants {
    stored_at_start: Option<f64>,
    largest_energy: f64,
    largest_gain: f64,
    largest_defect: f64,
    unsolved: u32,
}

impl RunInvariants {
    /// Observes the output of a step; the first one is that of the start.
    pub fn observe(&mut self, output: &Output) {
        let energy = &output.energy;
        let start = *self.stored_at_start.get_or_insert(energy.stored());
        let energy_now = energy.kinetic + energy.elastic + energy.input.abs();
        self.largest_energy = self.largest_energy.max(start.abs()).max(energy_now);
        self.largest_gain = self.largest_gain.max(energy.stored() - start - energy.input);
        self.largest_defect = self.largest_defect.max(energy.defect.abs());
        self.unsolved += output.status.unsolved_islands + output.status.dropped_contacts;
    }

    /// Checks of a run of that name.
    pub fn checks(&self, run: &str) -> [Check; 3] {
        self.checks_with(run, 0)
    }

    /// Checks of a run of that name that may leave so many islands unsolved.
    pub fn checks_with(&self, run: &str, unsolved: u32) -> [Check; 3] {
        let share = |joules: f64| joules.max(0.0) / self.largest_energy;
        let (gain, defect) = (share(self.largest_gain), share(self.largest_defect));
        [
            Check::new(format!("{run}: energy beyond what was put in, share"), gain, 0.0, ROUND_OFF),
            Check::new(format!("{run}: energy that no term explains, share"), defect, 0.0, ROUND_OFF),
            Check::new(
                format!("{run}: contacts unsolved or left out"),
                f64::from(self.unsolved),
                0.0,
                unsolved.into(),
            ),
        ]
    }
}
