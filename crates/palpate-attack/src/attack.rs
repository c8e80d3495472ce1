//! An attack, and the table of verdicts.

use crate::workplace::Workplace;
use std::path::Path;
use std::time::Instant;

/// Result of an attack that was withstood, or the weakness that it found.
pub type Verdict = Result<String, String>;

/// One attack on a fresh workplace.
pub struct Attack {
    /// Surface that it is on.
    pub group: &'static str,
    /// Name: the deed of the attacker.
    pub name: &'static str,
    pub run: fn(&Workplace) -> Verdict,
}

/// Runs attacks one after the other and prints a line for each.
pub fn run_all(palpate: &Path, attacks: &[&Attack]) -> Result<(), String> {
    let mut broken = 0;
    for Attack { group, name, run } in attacks.iter().copied() {
        let start = Instant::now();
        let verdict = Workplace::new(palpate).and_then(|workplace| run(&workplace));
        let (word, what) = match &verdict {
            Ok(what) => ("withstood", what),
            Err(what) => ("BROKEN", what),
        };
        broken += usize::from(verdict.is_err());
        println!("{word:<9} {group:<8} {name} ({:.1} s)\n          {what}", start.elapsed().as_secs_f64());
    }
    println!("{} attacks, {broken} not withstood", attacks.len());
    match (attacks.len(), broken) {
        (0, _) => Err("there is no such attack: --list shows them".into()),
        (_, 0) => Ok(()),
        _ => Err(format!("{broken} attacks were not withstood")),
    }
}

/// Fails an attack unless a condition holds.
pub fn require(holds: bool, what: impl FnOnce() -> String) -> Result<(), String> {
    if holds { Ok(()) } else { Err(what()) }
}
