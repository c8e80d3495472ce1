//! The machine and the time of a run, as far as the system tells.

use crate::page::table;
use std::time::{SystemTime, UNIX_EPOCH};

/// Facts about the machine, read at the start of a run.
#[derive(Debug, Clone)]
pub struct Machine {
    /// Processor.
    pub processor: String,
    /// Cores that this process may use.
    pub cores: usize,
    /// Memory, kernel, date, load before the run.
    facts: Vec<(&'static str, String)>,
}

impl Machine {
    /// Reads the facts; what the system does not tell is "not known".
    pub fn read() -> Self {
        let file = |path: &str| std::fs::read_to_string(path).unwrap_or_default();
        let cpu = file("/proc/cpuinfo");
        let processor = value(&cpu, "model name").unwrap_or("not known").to_owned();
        let memory = value(&file("/proc/meminfo"), "MemTotal").and_then(|text| {
            let kibibytes: f64 = text.split_whitespace().next()?.parse().ok()?;
            Some(format!("{:.0} GB", kibibytes * 1024.0 / 1e9))
        });
        let kernel = file("/proc/sys/kernel/osrelease");
        let load = file("/proc/loadavg");
        let load = load.split_whitespace().next().unwrap_or("not known").to_owned();
        let seconds = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let known =
            |text: &str| if text.trim().is_empty() { "not known".to_owned() } else { text.trim().to_owned() };
        Self {
            processor,
            cores: std::thread::available_parallelism().map_or(1, usize::from),
            facts: vec![
                ("memory", memory.unwrap_or_else(|| "not known".into())),
                (
                    "system",
                    format!("{} {}, kernel {}", std::env::consts::OS, std::env::consts::ARCH, known(&kernel)),
                ),
                ("load of the machine before the run", format!("{load} processes, mean of a minute")),
                ("date", date(seconds)),
            ],
        }
    }

    /// The facts with palpate's version and commit as a table.
    pub fn table(&self, commit: Option<&str>) -> String {
        let mut rows = vec![
            vec!["palpate".to_owned(), env!("CARGO_PKG_VERSION").to_owned()],
            vec!["commit before the build".to_owned(), commit.unwrap_or("not known").to_owned()],
            vec!["processor".to_owned(), self.processor.clone()],
            vec!["cores".to_owned(), self.cores.to_string()],
        ];
        rows.extend(self.facts.iter().map(|(name, text)| vec![(*name).to_owned(), text.clone()]));
        table("Version and machine of this run", &["", ""], &rows)
    }
}

/// Value of the first line of a name in a file of `name: value` lines.
fn value<'a>(text: &'a str, name: &str) -> Option<&'a str> {
    let line = text.lines().find(|line| line.starts_with(name))?;
    line.split_once(':').map(|(_, value)| value.trim())
}

/// Date and time [UTC] after some seconds since 1970.
fn date(seconds: u64) -> String {
    // Days since 1 March of year 0, in eras of 400 years (Hinnant, chrono-compatible low-level date algorithms, 2021).
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let day_of_year = day - (365 * year + year / 4 - year / 100);
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let (month, next) = if month < 10 { (month + 3, 0) } else { (month - 9, 1) };
    let clock = seconds % 86_400;
    format!(
        "{:04}-{month:02}-{day:02} {:02}:{:02} UTC",
        year + 400 * era + next,
        clock / 3600,
        clock / 60 % 60
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(date(0), "1970-01-01 00:00 UTC");
        assert_eq!(date(951_782_399), "2000-02-28 23:59 UTC");
        assert_eq!(date(951_782_400), "2000-02-29 00:00 UTC");
        assert_eq!(date(1_798_761_599), "2026-12-31 23:59 UTC");
    }

    #[test]
    fn values_are_found_by_their_names() {
        let text = "vendor_id\t: A\nmodel name\t: B C\nmodel name\t: D\n";
        assert_eq!(value(text, "model name"), Some("B C"));
        assert_eq!(value(text, "MemTotal"), None);
    }
}
