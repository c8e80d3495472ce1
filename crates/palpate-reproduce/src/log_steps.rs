//! Steps of a log, replayed to the bit, as the figures need them.

use crate::error::ReproduceError;
use glam::DVec3;
use palpate::{Collider, EnergyLedger, Input, Output, State};
use palpate_scene::LogReplay;
use std::path::Path;

/// The end of one step.
#[derive(Debug, Clone)]
pub struct LoggedStep {
    /// Steps since the start.
    pub step: u64,
    /// Simulated time [s].
    pub time_s: f64,
    /// Centre of mass of the first object [m, world].
    pub centre: DVec3,
    /// Interface point [m, world] of each device, and the force on its hand [N].
    pub hands: Vec<(DVec3, DVec3)>,
    /// Force of all obstacles on the objects [N].
    pub support: DVec3,
    /// The ledger of the scene.
    pub energy: EnergyLedger,
}

impl LoggedStep {
    /// A step from its input and output.
    pub fn new(step: u64, input: &Input, output: &Output) -> Self {
        let hands = input.devices.iter().zip(&output.devices);
        let supports =
            output.contacts.iter().filter(|contact| matches!(contact.against, Collider::Obstacle(_)));
        Self {
            step,
            time_s: output.time_s,
            centre: output.objects[0].pose.position,
            hands: hands.map(|(device, out)| (device.position, out.force_on_hand)).collect(),
            support: supports.map(|contact| contact.force).sum(),
            energy: output.energy,
        }
    }
}

/// Every step of a log.
pub fn logged_steps(log: &Path) -> Result<Vec<LoggedStep>, ReproduceError> {
    let run = LogReplay::read(log)?;
    let mut state = State::new(&run.scene.model);
    let mut steps = Vec::new();
    run.replay::<ReproduceError>(&mut state, run.steps, |input, state, _| {
        steps.push(LoggedStep::new(steps.len() as u64 + 1, input, state.output()));
        Ok(())
    })?;
    Ok(steps)
}

/// Largest |stored + lost − input − energy at the start| [J]: energy that the ledger does not account for.
pub fn unaccounted_energy(steps: &[LoggedStep], at_start_j: f64) -> f64 {
    let sum = |energy: &EnergyLedger| energy.stored() + energy.lost() - energy.input;
    steps.iter().map(|logged| (sum(&logged.energy) - at_start_j).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_that_goes_from_one_form_to_another_is_not_missing_and_energy_that_goes_nowhere_is() {
        let logged = |kinetic, dissipated, input| LoggedStep {
            step: 1,
            time_s: 0.0,
            centre: DVec3::ZERO,
            hands: Vec::new(),
            support: DVec3::ZERO,
            energy: EnergyLedger { kinetic, dissipated, input, ..EnergyLedger::default() },
        };
        assert_eq!(unaccounted_energy(&[logged(1.0, 0.0, 0.0), logged(0.5, 0.75, 0.25)], 1.0), 0.0);
        assert_eq!(unaccounted_energy(&[logged(1.0, 0.0, 0.0), logged(0.5, 0.25, 0.0)], 1.0), 0.25);
    }
}
