//! Steps of a log, replayed to the bit, as the figures need them, with the stalls of the machine.
//!
//! A step of a log does the same work each time it is computed. One that took much longer in real time than when it is computed again was
//! interrupted: the operating system, or the host of a virtual machine, took the core away.

use crate::chart::{Series, Style};
use crate::error::ReproduceError;
use glam::DVec3;
use palpate::{Collider, EnergyLedger, Input, Output, State};
use palpate_haptics::log::LogReader;
use palpate_mesh::read_regular_file;
use palpate_scene::{LogReplay, ReplayError};
use std::path::Path;

/// The end of one step.
#[derive(Debug, Clone)]
pub struct LoggedStep {
    /// Steps since the start.
    pub step: u64,
    /// Simulated time [s].
    pub time_s: f64,
    /// Centre of mass of the first object [m, world], and its velocity [m/s].
    pub centre: DVec3,
    pub velocity: DVec3,
    /// Interface point [m, world] of each device, and the force on its hand [N].
    pub hands: Vec<(DVec3, DVec3)>,
    /// Force of all obstacles on the objects [N].
    pub support: DVec3,
    /// The ledger of the scene.
    pub energy: EnergyLedger,
    /// Times in the run [µs]: delay after the deadline, and computing; and computing again.
    pub lateness_us: f64,
    pub compute_us: f64,
    pub again_us: f64,
}

/// Time by which a step must be late, or longer than when it is computed again, to be a stall [µs]: a tenth of the paper's cycle, and several
/// times what a cache that was lost costs.
const STALL_US: f64 = 200.0;

/// Runs of a log that the times of computing again are the least of: enough that hardly a step is interrupted in each.
pub const REPLAYS: usize = 4;

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
            velocity: output.objects[0].twist.linear,
            hands: hands.map(|(device, out)| (device.position, out.force_on_hand)).collect(),
            support: supports.map(|contact| contact.force).sum(),
            energy: output.energy,
            lateness_us: 0.0,
            compute_us: 0.0,
            again_us: f64::INFINITY,
        }
    }

    /// Whether the machine interrupted or delayed the step.
    pub fn is_stall(&self) -> bool {
        self.lateness_us > STALL_US || self.compute_us > self.again_us + STALL_US
    }
}

/// Every step of a log.
pub fn logged_steps(log: &Path) -> Result<Vec<LoggedStep>, ReproduceError> {
    let run = LogReplay::read(log)?;
    let mut steps: Vec<LoggedStep> = Vec::new();
    for _ in 0..REPLAYS {
        let mut state = State::new(&run.scene.model);
        let mut at = 0;
        run.replay::<ReproduceError>(&mut state, run.steps, |input, state, took| {
            if at == steps.len() {
                steps.push(LoggedStep::new(at as u64 + 1, input, state.output()));
            }
            steps[at].again_us = steps[at].again_us.min(1e6 * took.as_secs_f64());
            at += 1;
            Ok(())
        })?;
    }
    for (step, logged) in steps.iter_mut().zip(times_us(log)?) {
        (step.lateness_us, step.compute_us) = logged;
    }
    Ok(steps)
}

/// Delay after the deadline and compute time of each cycle of a log [µs].
fn times_us(log: &Path) -> Result<Vec<(f64, f64)>, ReproduceError> {
    let failed = |error| ReplayError::Log { path: log.to_path_buf(), error };
    let bytes = read_regular_file(log).map_err(|source| ReplayError::Io {
        action: "read the log",
        path: log.to_path_buf(),
        source,
    })?;
    let reader = LogReader::new(bytes).map_err(failed)?;
    let times =
        reader.logged_steps().map(|logged| logged.map(|step| (step.lateness_us(), step.compute_us())));
    Ok(times.collect::<Result<_, _>>().map_err(failed)?)
}

/// Time from the deadline to the end of each cycle of a log [µs].
pub fn cycle_times_us(log: &Path) -> Result<Vec<f64>, ReproduceError> {
    Ok(times_us(log)?.into_iter().map(|(late, compute)| late + compute).collect())
}

/// Longest of some steps when they are computed again [µs].
pub fn longest_again_us(steps: &[LoggedStep]) -> f64 {
    steps.iter().map(|step| step.again_us).fold(0.0, f64::max)
}

/// Stalls among some steps as a series of markers on a curve.
pub fn stalls<'a>(
    steps: impl IntoIterator<Item = &'a LoggedStep>,
    of: impl Fn(&LoggedStep) -> f64,
) -> Series {
    let stalled = steps.into_iter().filter(|step| step.is_stall());
    let points: Vec<(f64, f64)> = stalled.map(|step| (step.time_s, of(step))).collect();
    Series { label: format!("stalls of the machine ({})", points.len()), points, style: Style::Markers }
}

/// Largest |stored + lost − input − energy at the start| [J]: energy that the ledger does not account for.
pub fn unaccounted_energy(steps: &[LoggedStep], at_start_j: f64) -> f64 {
    let sum = |energy: &EnergyLedger| energy.stored() + energy.lost() - energy.input;
    steps.iter().map(|logged| (sum(&logged.energy) - at_start_j).abs()).fold(0.0, f64::max)
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// A step at rest at some time.
    pub(crate) fn at_rest(step: u64, time_s: f64) -> LoggedStep {
        LoggedStep {
            step,
            time_s,
            centre: DVec3::ZERO,
            velocity: DVec3::ZERO,
            hands: Vec::new(),
            support: DVec3::ZERO,
            energy: EnergyLedger::default(),
            lateness_us: 0.0,
            compute_us: 20.0,
            again_us: 20.0,
        }
    }

    #[test]
    fn energy_that_goes_from_one_form_to_another_is_not_missing_and_energy_that_goes_nowhere_is() {
        let logged = |kinetic, dissipated, input| LoggedStep {
            energy: EnergyLedger { kinetic, dissipated, input, ..EnergyLedger::default() },
            ..at_rest(1, 0.0)
        };
        assert_eq!(unaccounted_energy(&[logged(1.0, 0.0, 0.0), logged(0.5, 0.75, 0.25)], 1.0), 0.0);
        assert_eq!(unaccounted_energy(&[logged(1.0, 0.0, 0.0), logged(0.5, 0.25, 0.0)], 1.0), 0.25);
    }

    #[test]
    fn a_step_is_a_stall_if_it_was_late_or_took_much_longer_than_when_it_is_computed_again() {
        let usual = at_rest(1, 0.0);
        let hard = LoggedStep { compute_us: 900.0, again_us: 850.0, ..at_rest(2, 0.1) };
        let interrupted = LoggedStep { compute_us: 900.0, ..at_rest(3, 0.2) };
        let late = LoggedStep { lateness_us: 300.0, ..at_rest(4, 0.3) };
        let found = stalls(&[usual, hard, interrupted, late], |step| step.step as f64);
        assert_eq!(found.points, [(0.2, 3.0), (0.3, 4.0)]);
        assert_eq!(found.label, "stalls of the machine (2)");
    }
}
