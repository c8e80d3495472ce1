//! Guardian: a small process beside one that drives a real device, which takes the device's force away if that process ends or hangs.
//!
//! ```text
//! guarded process ── name of the device, beats, good-bye ──▶ guardian        (a pipe; its end means that the process has ended)
//! ```
//!
//! The haptic update beats, in every reading: the thread that commands the device answers for it. While the guarded process is well,
//! the guardian never touches the device. It has a session of its own, so that the terminal's signals miss it. After a pipe that ends
//! without a good-bye, or too long a pause between beats, it ends the guarded process for good, so that the vendor's software lets
//! the device go, opens the device with the same driver, commands zero force, disables forces and closes it.

mod system;
mod watch;

pub use watch::{Cause, GuardianWatch, Takeover};

use crate::device::{Device, DeviceSpec, DiscoveredDevice, Driver, Reading};
use crate::error::{DeviceError, Error};
use glam::DVec3;
use std::io::{BufRead, BufReader, Write};
use std::process::{Child, ChildStdin, Command, Stdio};
use std::time::{Duration, Instant};

/// Shortest interval between two beats: a pipe write every 20th update at 1 kHz costs nothing, and a limit of 0.1 s is five beats.
const BEAT_INTERVAL: Duration = Duration::from_millis(20);

/// Timeout of the guardian's end after a good-bye, after which it is killed.
const GOOD_BYE_TIMEOUT: Duration = Duration::from_secs(1);

/// Interval of checks for the guardian's end.
const GOOD_BYE_POLL: Duration = Duration::from_millis(1);

/// Line by which a guardian says that it is there.
const READY: &str = "ready";

/// Messages after the name of the device, one byte each.
const BEAT: u8 = b'.';
/// The next beat may take long: the device is closed, and about to be opened again.
const PAUSE: u8 = b'p';
const GOOD_BYE: u8 = b'q';

/// Guardian process, as the guarded process has it.
pub struct Guardian {
    process: Child,
    messages: ChildStdin,
    last_beat: Option<Instant>,
}

impl Guardian {
    /// Starts a guardian: a command whose process calls [`GuardianWatch::run`] on its standard input and output.
    ///
    /// # Errors
    /// If the process does not start, or does not say that it is ready.
    pub fn start(mut command: Command) -> Result<Self, Error> {
        let failed = |reason: String| Error::from(DeviceError::NoGuardian { reason });
        system::set_apart(&mut command);
        command.stdin(Stdio::piped()).stdout(Stdio::piped());
        let mut process = command.spawn().map_err(|error| failed(error.to_string()))?;
        let (Some(messages), Some(replies)) = (process.stdin.take(), process.stdout.take()) else {
            return Err(failed("it has no pipes".into()));
        };
        let mut line = String::new();
        let read = BufReader::new(replies).read_line(&mut line);
        let mut guardian = Self { process, messages, last_beat: None };
        if line.trim_end() != READY {
            guardian.end();
            let reason = read.map_or_else(|error| error.to_string(), |_| format!("it says {line:?}"));
            return Err(failed(reason));
        }
        system::set_nonblocking(&guardian.messages).map_err(|error| failed(error.to_string()))?;
        Ok(guardian)
    }

    /// Opens a device as [`Driver::open`], for this guardian to take over if the process ends or hangs.
    ///
    /// # Errors
    /// If it is missing, or in use, or the guardian has ended.
    pub fn open(mut self, driver: Driver, which: &str) -> Result<(DiscoveredDevice, Box<dyn Device>), Error> {
        let (found, device) = driver.open(which, None)?;
        // Indices may change; OpenHaptics opens by the names of configurations only.
        let name = match driver {
            Driver::OpenHaptics => which,
            Driver::Dhd | Driver::Haply => found.serial.as_deref().unwrap_or(which),
        };
        let line = format!("{}\n", name.replace('\n', " "));
        if let Err(error) = self.messages.write_all(line.as_bytes()) {
            return Err(DeviceError::NoGuardian { reason: error.to_string() }.into());
        }
        Ok((found, Box::new(GuardedDevice { device: Some(device), guardian: self })))
    }

    /// Sends a beat, or another message, if one is due.
    fn send(&mut self, message: u8) -> Result<(), std::io::Error> {
        let due = self.last_beat.is_none_or(|time| time.elapsed() >= BEAT_INTERVAL);
        if due || message != BEAT {
            self.last_beat = Some(Instant::now());
            self.messages.write_all(&[message])?;
        }
        Ok(())
    }

    /// Says good-bye, and waits for the end of the process.
    fn end(&mut self) {
        // A guardian that has ended already hears nothing.
        let _ = self.messages.write_all(&[GOOD_BYE]);
        let deadline = Instant::now() + GOOD_BYE_TIMEOUT;
        while matches!(self.process.try_wait(), Ok(None)) {
            if Instant::now() > deadline {
                let _ = self.process.kill();
                let _ = self.process.wait();
                return;
            }
            std::thread::sleep(GOOD_BYE_POLL);
        }
    }
}

impl Drop for Guardian {
    fn drop(&mut self) {
        self.end();
    }
}

/// Real device with its guardian. Without the guardian it gives no readings, so that no force passes.
struct GuardedDevice {
    /// Device; `None` once it is closed.
    device: Option<Box<dyn Device>>,
    guardian: Guardian,
}

impl GuardedDevice {
    fn closed() -> Error {
        DeviceError::NoGuardian { reason: "the device is closed".into() }.into()
    }
}

impl Device for GuardedDevice {
    fn spec(&self) -> DeviceSpec {
        self.device.as_ref().map_or(DeviceSpec::NONE, |device| device.spec())
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        let reading = self.device.as_mut().ok_or_else(Self::closed)?.read(now_s);
        let is_closed = matches!(reading, Err(Error::Device(DeviceError::Disconnected { .. })));
        let beat = self.guardian.send(if is_closed { PAUSE } else { BEAT });
        beat.map_err(|error| DeviceError::GuardianGone { reason: error.to_string() })?;
        reading
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), Error> {
        self.device.as_mut().ok_or_else(Self::closed)?.set_force(force, now_s)
    }
}

impl Drop for GuardedDevice {
    fn drop(&mut self) {
        // The good-bye comes after the device is closed.
        drop(self.device.take());
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn without_a_guardian_there_is_no_device() {
        let error = |program: &str| Guardian::start(Command::new(program)).err().expect("none").to_string();
        let because = |reason: &str| {
            format!(
                "no guardian could be started ({reason}): a real device is not opened without one, since nothing would take its \
                 force away after a crash"
            )
        };
        assert_eq!(error("/nowhere/palpate"), because("No such file or directory (os error 2)"));
        assert_eq!(error("true"), because("it says \"\""));
    }
}
