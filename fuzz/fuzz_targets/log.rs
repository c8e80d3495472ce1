//! Logs: header, attachments, and every step.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_haptics::log::LogReader;

fuzz_target!(|bytes: &[u8]| {
    let Ok(reader) = LogReader::new(bytes) else { return };
    let _ = (reader.metadata(), reader.files(), reader.step_count());
    for step in reader.logged_steps().take(1000) {
        if step.is_err() {
            break;
        }
    }
});
