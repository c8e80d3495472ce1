//! Attacks on a running palpate, and a soak: `cargo xtask attack`, `cargo xtask soak`.
//!
//! ```text
//! attack (hand, server, link, files, ends, numbers) → child processes of `palpate` on loopback → what came out → verdict
//! ```
//!
//! Nothing leaves the machine, every attack is bounded in time and size, and all files lie in one temporary folder. An attack that is
//! withstood says what came out; one that is not makes the program end with status 1.

mod attack;
mod child;
mod ends;
mod files;
mod hand;
mod http;
mod link;
mod numbers;
mod page;
mod random;
mod server;
mod soak;
mod workplace;

use attack::{Attack, run_all};
use std::path::PathBuf;
use std::process::ExitCode;

const HELP: &str = "\
palpate-attack [--palpate PROGRAM] [--only TEXT] [--list]
palpate-attack [--palpate PROGRAM] --soak MINUTES

  --palpate PROGRAM  the program under attack; by default the release build beside this one
  --only TEXT        attacks whose group or name has this text
  --list             list the attacks
  --soak MINUTES     two fingers, a log, two pages and a linked device on two cores, one of them hogged for a third of the time
";

/// Options of a call.
#[derive(Default)]
struct Options {
    palpate: Option<PathBuf>,
    only: String,
    list: bool,
    soak_minutes: Option<f64>,
}

fn main() -> ExitCode {
    let options = match options(std::env::args().skip(1)) {
        Ok(Some(options)) => options,
        Ok(None) => {
            print!("{HELP}");
            return ExitCode::SUCCESS;
        }
        Err(what) => {
            eprintln!("palpate-attack: {what}\n\n{HELP}");
            return ExitCode::from(2);
        }
    };
    let attacks: Vec<&Attack> =
        [hand::ATTACKS, server::ATTACKS, link::ATTACKS, files::ATTACKS, ends::ATTACKS, numbers::ATTACKS]
            .into_iter()
            .flatten()
            .filter(|attack| attack.group.contains(&options.only) || attack.name.contains(&options.only))
            .collect();
    if options.list {
        attacks.iter().for_each(|attack| println!("{:<8} {}", attack.group, attack.name));
        return ExitCode::SUCCESS;
    }
    let done = match (program(options.palpate), options.soak_minutes) {
        (Err(what), _) => Err(what),
        (Ok(palpate), Some(minutes)) => soak::run(&palpate, minutes),
        (Ok(palpate), None) => run_all(&palpate, &attacks),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("palpate-attack: {what}");
            ExitCode::FAILURE
        }
    }
}

/// Options of the arguments; `None` where help is asked for.
fn options(mut arguments: impl Iterator<Item = String>) -> Result<Option<Options>, String> {
    let mut options = Options::default();
    while let Some(argument) = arguments.next() {
        let mut value = || arguments.next().ok_or(format!("{argument} needs a value"));
        match argument.as_str() {
            "--help" | "-h" => return Ok(None),
            "--list" => options.list = true,
            "--palpate" => options.palpate = Some(value()?.into()),
            "--only" => options.only = value()?,
            "--soak" => {
                let minutes = value()?;
                let number = minutes.parse().ok().filter(|minutes| *minutes > 0.0 && *minutes <= 24.0 * 60.0);
                options.soak_minutes =
                    Some(number.ok_or(format!("--soak {minutes:?}: expected minutes, 1440 at most"))?);
            }
            _ => return Err(format!("unknown argument {argument:?}")),
        }
    }
    Ok(Some(options))
}

/// The program under attack.
fn program(given: Option<PathBuf>) -> Result<PathBuf, String> {
    let beside = || {
        let own = std::env::current_exe().map_err(|error| error.to_string())?;
        Ok::<_, String>(own.with_file_name("palpate").with_extension(std::env::consts::EXE_EXTENSION))
    };
    let path = given.map_or_else(beside, Ok)?;
    path.canonicalize().map_err(|error| format!("{}: {error}: build palpate first", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arguments_are_known_or_refused() {
        let given = |text: &str| options(text.split_whitespace().map(str::to_string));
        assert!(given("--help").is_ok_and(|options| options.is_none()));
        let soak = given("--soak 0.5 --only link").ok().flatten().expect("options");
        assert_eq!((soak.soak_minutes, soak.only.as_str()), (Some(0.5), "link"));
        let refused = |text: &str| given(text).err().expect("refused");
        assert_eq!(refused("--soak -1"), "--soak \"-1\": expected minutes, 1440 at most");
        assert_eq!(refused("--only"), "--only needs a value");
        assert_eq!(refused("--fast"), "unknown argument \"--fast\"");
    }

    #[test]
    fn every_attack_has_a_name_of_its_own() {
        let all =
            [hand::ATTACKS, server::ATTACKS, link::ATTACKS, files::ATTACKS, ends::ATTACKS, numbers::ATTACKS];
        let mut names: Vec<_> = all.into_iter().flatten().map(|attack| attack.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
