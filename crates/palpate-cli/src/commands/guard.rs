//! `palpate guard`: the guardian of a real device, which palpate starts itself beside every process that drives one.

use crate::failure::Failure;
use crate::interrupt::{end_with_parent, ignore_signals};
use crate::terminal::notify;
use clap::Args;
use palpate::DeviceMode;
use palpate_haptics::AttachedDevice;
use palpate_haptics::guardian::{Guardian, GuardianWatch};
use palpate_scene::{RealDevice, attach_real, find_driver};
use std::process::Command;

/// Guardian of a real device: takes its force away if the process that drives it ends without closing it, or hangs
///
/// It is started by palpate itself; its messages come on standard input.
#[derive(Args, Debug, Clone)]
pub struct Arguments {
    /// Driver of the device
    #[arg(long, value_name = "DRIVER")]
    pub driver: String,
    /// Guarded process, the parent of this one
    #[arg(long, value_name = "PID")]
    pub process: u32,
    /// Longest pause between two beats [s]
    #[arg(long, value_name = "S")]
    pub hang: f64,
}

/// Runs the command.
pub fn guard(arguments: &Arguments) -> Result<(), Failure> {
    ignore_signals();
    let driver = find_driver(&arguments.driver).map_err(|what| Failure(format!("--{what}")))?;
    let watch = GuardianWatch { driver, process: arguments.process, hang_s: arguments.hang };
    let failed = |error| {
        Failure(format!("guardian: forces could not be switched off: {error}; switch the device off"))
    };
    let takeover = watch.run(std::io::stdin(), std::io::stdout()).map_err(failed)?;
    takeover.iter().for_each(|takeover| notify(&format!("guardian: {takeover}")));
    Ok(())
}

/// Opens a real device with a guardian, and ends with the process that has started this one. Returns it with a line that describes it.
pub fn attach_guarded(
    device: &RealDevice,
    mode: DeviceMode,
    rate_hz: f64,
    passivity: bool,
) -> Result<(AttachedDevice, String), Failure> {
    end_with_parent();
    let guardian = start_guardian(device)?;
    Ok(attach_real(device, mode, rate_hz, passivity, guardian)?)
}

fn start_guardian(device: &RealDevice) -> Result<Guardian, Failure> {
    let program = std::env::current_exe();
    let program =
        program.map_err(|error| Failure(format!("the guardian's program is not found: {error}")))?;
    let mut command = Command::new(program);
    command.args(["guard", "--driver", device.driver.name()]);
    command.args(["--process", &std::process::id().to_string(), "--hang", &device.limits.hang_s.to_string()]);
    Ok(Guardian::start(command)?)
}
