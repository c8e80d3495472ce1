//! The amplifier of a device, whose force goes on when the process that set it is gone: a file that the environment variable
//! PALPATE_STANDIN names. It is locked while a process has the device. Without the variable there is none.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};

/// Length of what is in the file [bytes]: written at once, so that a reader sees a whole state.
const LENGTH: usize = 120;

/// State of a device as text: `open 1 on 1 force 0.1 0 0`.
#[derive(Clone, Copy, Default)]
pub struct Amplifier {
    pub open: bool,
    pub forces_on: bool,
    pub force: [f64; 3],
}

impl Amplifier {
    /// The claimed file, with the state of the device; `Err` if another process has it, and no file without the variable.
    pub fn claim() -> Result<(Option<File>, Self), ()> {
        let Some(path) = std::env::var_os("PALPATE_STANDIN") else { return Ok((None, Self::default())) };
        let mut file = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(path).map_err(drop)?;
        file.try_lock().map_err(drop)?;
        let mut text = String::new();
        file.read_to_string(&mut text).map_err(drop)?;
        let number = |at: usize| text.split_whitespace().nth(at).and_then(|word| word.parse().ok()).unwrap_or(0.0);
        let force = [number(5), number(6), number(7)];
        Ok((Some(file), Self { open: true, forces_on: number(3) == 1.0, force }))
    }

    /// Writes the state into a claimed file.
    pub fn save(&self, file: &mut File) {
        let [x, y, z] = self.force;
        let (open, on) = (u8::from(self.open), u8::from(self.forces_on));
        let text = format!("{:<LENGTH$}", format!("open {open} on {on} force {x:.6e} {y:.6e} {z:.6e}"));
        let written = file.seek(SeekFrom::Start(0)).and_then(|_| file.write_all(text.as_bytes()));
        written.expect("a writable file");
    }
}
