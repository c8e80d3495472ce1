//! What figures take from a log: it is computed again, step by step, to the bit.

use crate::Failure;
use glam::DVec3;
use palpate::{Collider, EnergyLedger, Input, Output, State};
use palpate_scene::LogReplay;
use std::path::Path;

/// The end of one step.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Steps since the start.
    pub step: u64,
    /// Simulated time [s].
    pub time_s: f64,
    /// Centre of mass of the first object [m, world].
    pub centre: DVec3,
    /// Where the devices are [m, world], and the forces on their hands [N].
    pub hands: Vec<(DVec3, DVec3)>,
    /// Force of all obstacles on the objects [N].
    pub support: DVec3,
    /// The ledger of the scene.
    pub energy: EnergyLedger,
}

impl Snapshot {
    /// What a step has left.
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
pub fn moments(log: &Path) -> Result<Vec<Snapshot>, Failure> {
    let run = LogReplay::read(log)?;
    let mut state = State::new(&run.scene.model);
    let mut moments = Vec::new();
    run.replay::<Failure>(&mut state, run.steps, |input, state, _| {
        moments.push(Snapshot::new(moments.len() as u64 + 1, input, state.output()));
        Ok(())
    })?;
    Ok(moments)
}

/// Largest energy [J] that the ledger has lost track of: stored + lost − input, against that at the start of the run.
pub fn missing(moments: &[Snapshot], at_start_j: f64) -> f64 {
    let sum = |energy: &EnergyLedger| energy.stored() + energy.lost() - energy.input;
    moments.iter().map(|moment| (sum(&moment.energy) - at_start_j).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn energy_that_goes_from_one_form_to_another_is_not_missing_and_energy_that_goes_nowhere_is() {
        let moment = |kinetic, dissipated, input| Snapshot {
            step: 1,
            time_s: 0.0,
            centre: DVec3::ZERO,
            hands: Vec::new(),
            support: DVec3::ZERO,
            energy: EnergyLedger { kinetic, dissipated, input, ..EnergyLedger::default() },
        };
        assert_eq!(missing(&[moment(1.0, 0.0, 0.0), moment(0.5, 0.75, 0.25)], 1.0), 0.0);
        assert_eq!(missing(&[moment(1.0, 0.0, 0.0), moment(0.5, 0.25, 0.0)], 1.0), 0.25);
    }
}
