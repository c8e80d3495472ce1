//! Watch: the guardian's side.

use super::system;
use super::{BEAT, GOOD_BYE, PAUSE, READY};
use crate::device::{Device, Driver};
use crate::error::Error;
use crate::scheduling::Scheduling;
use glam::DVec3;
use std::fmt;
use std::io::{BufRead, BufReader, Read, Write};
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};

/// Real-time priority: above all threads of the guarded process, which may hang in a loop.
const PRIORITY: u8 = 90;

/// Timeout of the end of a killed process: its memory is freed by then, also if there is much.
const END_TIMEOUT: Duration = Duration::from_secs(5);

/// Interval between attempts to open the device: the system may close the device of a process that has ended later than its pipe.
const RETRY_INTERVAL: Duration = Duration::from_millis(2);

/// Timeout of the device, after which the guardian gives up.
const OPEN_TIMEOUT: Duration = Duration::from_secs(10);

/// Timeout of a reading of the opened device: it may not be initialised.
const READING_TIMEOUT: Duration = Duration::from_secs(1);

/// Watch over a process that drives a device.
#[derive(Debug, Clone, Copy)]
pub struct GuardianWatch {
    /// Driver of the device.
    pub driver: Driver,
    /// Guarded process, the parent of this one.
    pub process: u32,
    /// Longest pause between two beats [s].
    pub hang_s: f64,
}

/// Cause of a takeover.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Cause {
    /// The process ended without a good-bye.
    Ended,
    /// The process did not beat for so long [s], and was killed.
    Hung(f64),
}

/// Device that a guardian has left without force.
#[derive(Debug, Clone, PartialEq)]
pub struct Takeover {
    /// Cause.
    pub cause: Cause,
    /// Driver and name of the device.
    pub device: String,
    /// Time from the cause to the closed device [s].
    pub took_s: f64,
}

/// Message of the guarded process.
enum Message {
    Name(String),
    Byte(u8),
}

impl GuardianWatch {
    /// Watches over the process by messages of `input` until it says good-bye, or takes its device over. Says on `output` that it is
    /// ready. Returns the takeover, if there was one.
    ///
    /// # Errors
    /// If the device can't be opened to take its force away.
    pub fn run(
        &self,
        input: impl Read + Send + 'static,
        mut output: impl Write,
    ) -> Result<Option<Takeover>, Error> {
        system::detach();
        // Without a real-time priority it goes on.
        let _ = Scheduling { priority: Some(PRIORITY), core: None }.apply_priority();
        let messages = receive(input)?;
        // A parent that has gone is told by the end of its messages.
        let _ = writeln!(output, "{READY}").and_then(|()| output.flush());
        drop(output);
        let Ok(Message::Name(name)) = messages.recv() else { return Ok(None) };
        let Some((cause, since)) = self.wait(&messages) else { return Ok(None) };
        if matches!(cause, Cause::Hung(_)) {
            system::kill_parent(self.process);
            let deadline = Instant::now() + END_TIMEOUT;
            let left = || deadline.saturating_duration_since(Instant::now());
            while messages.recv_timeout(left()).is_ok() {}
        }
        self.take_force_away(&name)?;
        let device = format!("{} {name}", self.driver.name());
        Ok(Some(Takeover { cause, device, took_s: since.elapsed().as_secs_f64() }))
    }

    /// Waits for an end without a good-bye, or a pause that is too long; `None` after a good-bye. Returns the time when it was seen.
    fn wait(&self, messages: &Receiver<Message>) -> Option<(Cause, Instant)> {
        let limit = Duration::try_from_secs_f64(self.hang_s).unwrap_or(Duration::MAX);
        let mut beats = false;
        loop {
            let next = if beats { messages.recv_timeout(limit) } else { messages.recv().map_err(Into::into) };
            match next {
                Ok(Message::Byte(GOOD_BYE)) => return None,
                Ok(Message::Byte(BEAT)) => beats = true,
                Ok(Message::Byte(PAUSE)) => beats = false,
                Ok(_) => {}
                Err(RecvTimeoutError::Disconnected) => return Some((Cause::Ended, Instant::now())),
                Err(RecvTimeoutError::Timeout) => return Some((Cause::Hung(self.hang_s), Instant::now())),
            }
        }
    }

    /// Opens the device, commands zero force and closes it.
    fn take_force_away(&self, name: &str) -> Result<(), Error> {
        let deadline = Instant::now() + OPEN_TIMEOUT;
        loop {
            match self.driver.open(name, None) {
                Ok((_, mut device)) => {
                    command_zero(&mut *device);
                    // The driver commands zero force again, and disables forces.
                    drop(device);
                    return Ok(());
                }
                Err(error) if Instant::now() > deadline => return Err(error),
                Err(_) => std::thread::sleep(RETRY_INTERVAL),
            }
        }
    }
}

/// Commands zero force until the device gives a reading, which shows that it has heard of it, or has none to give.
fn command_zero(device: &mut dyn Device) {
    let begun = Instant::now();
    while begun.elapsed() < READING_TIMEOUT {
        let now_s = begun.elapsed().as_secs_f64();
        if device.set_force(DVec3::ZERO, now_s).and_then(|()| device.read(now_s)).is_ok() {
            return;
        }
        std::thread::sleep(RETRY_INTERVAL);
    }
}

/// Messages of a pipe, until its end.
fn receive(input: impl Read + Send + 'static) -> Result<Receiver<Message>, Error> {
    let (sender, receiver) = channel();
    let read = move || {
        let mut input = BufReader::new(input);
        let mut name = String::new();
        // A name without its end is none: the device was not opened yet.
        if input.read_line(&mut name).is_err() || !name.ends_with('\n') {
            return;
        }
        if sender.send(Message::Name(name.trim_end_matches('\n').to_string())).is_err() {
            return;
        }
        let bytes = input.bytes().map_while(Result::ok);
        let _ = bytes.map(Message::Byte).all(|message| sender.send(message).is_ok());
    };
    let thread = std::thread::Builder::new().name("palpate messages".into()).spawn(read);
    let failed = |error: std::io::Error| Error::ThreadSpawn {
        purpose: "guardian's messages".into(),
        reason: error.to_string(),
    };
    thread.map(|_| receiver).map_err(failed)
}

impl fmt::Display for Takeover {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cause, device, took_s } = self;
        match cause {
            Cause::Ended => write!(f, "palpate ended and left {device} with its force")?,
            Cause::Hung(limit_s) => write!(f, "palpate hung for {limit_s} s with {device}, and was killed")?,
        }
        write!(f, ": forces are off, after {:.0} ms", 1e3 * took_s)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Cursor;

    fn watch() -> GuardianWatch {
        GuardianWatch { driver: Driver::Dhd, process: 0, hang_s: 1e6 }
    }

    #[test]
    fn a_good_bye_and_a_process_that_had_no_device_yet_leave_the_device_alone() {
        for messages in ["", "0", "0\n..q", "0\nq", "0\n.p.q"] {
            let mut said = Vec::new();
            let done = watch().run(Cursor::new(messages), &mut said);
            assert_eq!((done, said), (Ok(None), b"ready\n".to_vec()), "{messages:?}");
        }
    }

    #[test]
    fn ends_and_pauses_are_told_apart() {
        let (sender, messages) = channel();
        let send = |bytes: &str| bytes.bytes().for_each(|byte| drop(sender.send(Message::Byte(byte))));
        let cause = |hang_s: f64| GuardianWatch { hang_s, ..watch() }.wait(&messages).map(|(cause, _)| cause);
        send("...");
        assert_eq!(cause(0.01), Some(Cause::Hung(0.01)));
        send(".q");
        assert_eq!(cause(0.01), None);
        send("..p");
        drop(sender);
        assert_eq!(cause(0.01), Some(Cause::Ended), "a pause may take long");
    }

    #[test]
    fn a_takeover_says_what_happened() {
        let ended = Takeover { cause: Cause::Ended, device: "dhd 301".into(), took_s: 0.0123 };
        assert_eq!(
            ended.to_string(),
            "palpate ended and left dhd 301 with its force: forces are off, after 12 ms"
        );
        let hung = Takeover { cause: Cause::Hung(0.5), ..ended };
        assert_eq!(
            hung.to_string(),
            "palpate hung for 0.5 s with dhd 301, and was killed: forces are off, after 12 ms"
        );
    }
}
