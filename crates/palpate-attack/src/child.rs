//! Child processes: started, signalled, watched, and never left behind.

use std::io::Read;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Time after which a wait has failed.
pub const PATIENCE: Duration = Duration::from_secs(30);

/// Waits for a condition; `false` after a time.
pub fn wait_until(patience: Duration, mut condition: impl FnMut() -> bool) -> bool {
    let start = Instant::now();
    while !condition() {
        if start.elapsed() > patience {
            return false;
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    true
}

/// A running child process with what it has printed so far; killed when dropped.
pub struct Running {
    child: Child,
    printed: Arc<Mutex<String>>,
    output: Arc<Mutex<String>>,
    readers: Vec<JoinHandle<()>>,
}

/// Exit status, by a signal or not, and everything printed.
pub struct Ended {
    /// Exit status; `None` after a signal.
    pub code: Option<i32>,
    /// Both outputs, as they came.
    pub printed: String,
    /// Standard output alone.
    pub output: String,
}

impl Running {
    /// Starts a command with both outputs captured.
    pub fn start(command: &mut Command) -> Result<Self, String> {
        let command = command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().map_err(|error| format!("{command:?}: {error}"))?;
        let (printed, output) = (Arc::<Mutex<String>>::default(), Arc::<Mutex<String>>::default());
        let readers = [
            child.stdout.take().map(|pipe| follow(pipe, vec![printed.clone(), output.clone()])),
            child.stderr.take().map(|pipe| follow(pipe, vec![printed.clone()])),
        ];
        Ok(Self { child, printed, output, readers: readers.into_iter().flatten().collect() })
    }

    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// Everything printed so far.
    pub fn printed(&self) -> String {
        self.printed.lock().map(|text| text.clone()).unwrap_or_default()
    }

    /// Waits until a text was printed.
    pub fn wait_for(&self, text: &str) -> Result<(), String> {
        match wait_until(PATIENCE, || self.printed().contains(text)) {
            true => Ok(()),
            false => Err(format!("{text:?} was not printed within {PATIENCE:?}, but {:?}", self.printed())),
        }
    }

    /// Sends a signal by its name.
    pub fn signal(&self, name: &str) {
        send_signal(self.id(), name);
    }

    pub fn is_alive(&mut self) -> bool {
        matches!(self.child.try_wait(), Ok(None))
    }

    /// Waits for the end, at most a time; a process that is still there then is killed and this is an error.
    pub fn end_within(mut self, patience: Duration) -> Result<Ended, String> {
        let ended = wait_until(patience, || !self.is_alive());
        if !ended {
            let _ = self.child.kill();
        }
        let status = self.child.wait().map_err(|error| error.to_string())?;
        for reader in self.readers.drain(..) {
            let _ = reader.join();
        }
        let printed = self.printed();
        let output = self.output.lock().map(|text| text.clone()).unwrap_or_default();
        match ended {
            true => Ok(Ended { code: status.code(), printed, output }),
            false => Err(format!("it did not end within {patience:?}; it printed {printed:?}")),
        }
    }

    pub fn end(self) -> Result<Ended, String> {
        self.end_within(PATIENCE)
    }

    /// Resident memory [MiB].
    pub fn memory_mib(&self) -> f64 {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.id())).unwrap_or_default();
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let kib = line.and_then(|line| line.trim().trim_end_matches(" kB").parse::<f64>().ok());
        kib.unwrap_or(0.0) / 1024.0
    }

    /// Number of open files.
    pub fn open_files(&self) -> usize {
        std::fs::read_dir(format!("/proc/{}/fd", self.id())).map_or(0, Iterator::count)
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// Sends a signal by its name to a process.
pub fn send_signal(id: u32, name: &str) {
    let _ = Command::new("kill").args([&format!("-{name}"), &id.to_string()]).stderr(Stdio::null()).status();
}

fn follow(mut pipe: impl Read + Send + 'static, texts: Vec<Arc<Mutex<String>>>) -> JoinHandle<()> {
    std::thread::spawn(move || {
        let mut buffer = [0; 4096];
        while let Ok(count @ 1..) = pipe.read(&mut buffer) {
            for mut text in texts.iter().filter_map(|text| text.lock().ok()) {
                text.push_str(&String::from_utf8_lossy(&buffer[..count]));
            }
        }
    })
}
