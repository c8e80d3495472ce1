//! Chores of the project: `cargo xtask` lists them, `cargo xtask CHORE --help` tells what one does.
//!
//! Each does everything that a fresh machine with Rust needs, and says what is missing where it can't install it.

mod bare;
mod book;
mod c_library;
mod dependencies;
mod files;
mod fuzz;
mod machine;
mod process;
mod release;
mod sanitizers;
mod standard_library;
mod systems;
mod tests;
mod viewer;
mod web;
mod wheel;

use process::{palpate, root, run};
use std::process::{Command, ExitCode};
use xtask::{layers, words};

/// A chore of the command line.
struct Chore {
    name: &'static str,
    /// One line of the list.
    summary: &'static str,
    /// Flags that it takes, each with its values, if any, and its meaning.
    flags: &'static [(&'static str, &'static [&'static str], &'static str)],
    run: fn(&Flags) -> Result<(), String>,
}

const CHORES: &[Chore] = &[
    Chore {
        name: "demo",
        summary: "build palpate with its viewer and run its demo: elastic objects to touch in the browser",
        flags: &[(REST, &[], "arguments of `palpate demo`")],
        run: |flags| demo(&flags.rest()),
    },
    Chore {
        name: "test",
        summary: "install what the tests need, and run all of them",
        flags: &[("--only", tests::PARTS, "one part of the tests")],
        run: |flags| tests::run_parts(flags.value("--only")),
    },
    Chore {
        name: "tools",
        summary: "install what the tests need: tools of the C library's, Python packages, Chromium, npm packages",
        flags: &[],
        run: |_| tests::install_tools(),
    },
    Chore {
        name: "verify",
        summary: "the slow proofs: computed numbers against analytic ones",
        flags: &[(REST, &[], "arguments of `palpate verify`, as the names of cases")],
        run: |flags| verify(&flags.rest()),
    },
    Chore {
        name: "viewer",
        summary: "build the page that palpate serves (viewer/, with Node.js), which builds of palpate embed",
        flags: &[],
        run: |_| viewer::build(),
    },
    Chore {
        name: "wheel",
        summary: "build the Python package's wheel into target/wheels (bindings/python, docs/python.md)",
        flags: &[],
        run: |_| wheel::build().map(|_| ()),
    },
    Chore {
        name: "web",
        summary: "build WebAssembly, the npm package (bindings/web), and the page without a server into target/web/page",
        flags: &[],
        run: |_| web::build().map(|_| ()),
    },
    Chore {
        name: "dependencies",
        summary: "check licences, duplicates and, where cargo-deny and its database are there, advisories (deny.toml)",
        flags: &[],
        run: |_| dependencies::check(),
    },
    Chore {
        name: "attack",
        summary: "attack a running palpate on loopback: server, links, files, ends, numbers (SECURITY.md)",
        flags: &[(REST, &[], "arguments of `palpate-attack`, as --only")],
        run: |flags| attack(&flags.rest()),
    },
    Chore {
        name: "soak",
        summary: "30 minutes of fingers, a log, pages and a link, with one core hogged for a third of the time",
        flags: &[(REST, &[], "arguments of `palpate-attack`")],
        run: |flags| attack(&[&["--soak", SOAK_MINUTES], &*flags.rest()].concat()),
    },
    Chore {
        name: "layers",
        summary: "find import circles between modules, and imports against the floors of the runtime",
        flags: &[("--deep", &[], "also the modules of every folder")],
        run: |flags| check_layers(flags.has("--deep")),
    },
    Chore {
        name: "words",
        summary: "find retired words, doc comments that name nothing, and citations of equations that do not exist",
        flags: &[("--list", &[], "list them as warnings, and succeed")],
        run: |flags| check_words(flags.has("--list")),
    },
    Chore {
        name: "bare",
        summary: "build the runtime for a target without an operating system (no_std)",
        flags: &[],
        run: |_| bare::build(),
    },
    Chore {
        name: "c",
        summary: "build the C library with its header, pkg-config file and CMake package under target/palpate-c",
        flags: &[],
        run: |_| c_library::build(),
    },
    Chore {
        name: "site",
        summary: "build the documentation as a site into target/site (docs/SUMMARY.md), and check its links",
        flags: &[("--links", &[], "check the links of all pages, and build nothing")],
        run: |flags| if flags.has("--links") { book::check_links() } else { book::build() },
    },
    Chore {
        name: "release",
        summary: "build what one publishes into target/dist, with checksums and a bill of materials (docs/release.md)",
        flags: &[],
        run: |_| release::build(),
    },
    Chore {
        name: "systems",
        summary: "check palpate for Windows and macOS",
        flags: &[("--only", systems::NAMES, "one of them")],
        run: |flags| systems::check_all(flags.value("--only")),
    },
    Chore {
        name: "sanitizers",
        summary: "run the tests of the force process, devices and links under the thread and the address sanitizer",
        flags: &[("--only", sanitizers::SANITIZERS, "one of them")],
        run: |flags| sanitizers::run_tests(flags.value("--only")),
    },
    Chore {
        name: "fuzz",
        summary: "run the readers of files on random and damaged input by libFuzzer",
        flags: &[
            ("--target", fuzz::TARGETS, "one reader; all without"),
            ("--seconds", fuzz::SECONDS, "time for each; 60 without"),
            (REST, &[], "arguments of libFuzzer, as -- -runs=1000"),
        ],
        run: |flags| fuzz::run_targets(flags.value("--target"), flags.value("--seconds"), &flags.rest()),
    },
];

/// Flag of chores that pass arguments on: all from the first that is none of their flags, or from `--`.
const REST: &str = "--";

/// Flags of a call.
struct Flags(Vec<(String, Option<String>)>);

impl Flags {
    fn has(&self, name: &str) -> bool {
        self.0.iter().any(|(own, _)| own == name)
    }

    /// Arguments that are passed on.
    fn rest(&self) -> Vec<&str> {
        self.0.iter().filter(|(own, _)| own == REST).filter_map(|(_, value)| value.as_deref()).collect()
    }

    fn value(&self, name: &str) -> Option<&str> {
        self.0.iter().find(|(own, _)| own == name).and_then(|(_, value)| value.as_deref())
    }
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_help = |argument: &String| ["--help", "-h", "help"].contains(&argument.as_str());
    let Some(first) = arguments.first().filter(|first| !is_help(first)) else {
        print!("{}", list());
        return ExitCode::SUCCESS;
    };
    let Some(chore) = CHORES.iter().find(|chore| chore.name == first) else {
        eprintln!("xtask: there is no chore {first:?}\n\n{}", list());
        return ExitCode::from(2);
    };
    if arguments.iter().take_while(|argument| *argument != REST).any(is_help) {
        print!("{}", help(chore));
        return ExitCode::SUCCESS;
    }
    let flags = match flags(chore, &arguments[1..]) {
        Ok(flags) => flags,
        Err(what) => {
            eprintln!("xtask {}: {what}\n\n{}\n{}", chore.name, help(chore), list());
            return ExitCode::from(2);
        }
    };
    match (chore.run)(&flags) {
        Ok(()) => ExitCode::SUCCESS,
        Err(what) => {
            eprintln!("xtask {}: {what}", chore.name);
            ExitCode::FAILURE
        }
    }
}

/// All chores with one line each.
fn list() -> String {
    let mut text = String::from("cargo xtask CHORE [--help]\n\n");
    for chore in CHORES {
        text += &format!("  {:<14}{}\n", chore.name, chore.summary);
    }
    text
}

/// One chore with its flags.
fn help(chore: &Chore) -> String {
    let usage = |(flag, values, _): &(&str, &[&str], &str)| {
        if *flag == REST {
            " [[--] ARGUMENT …]".to_string()
        } else if values.is_empty() {
            format!(" [{flag}]")
        } else {
            format!(" [{flag} {}]", values.join("|"))
        }
    };
    let usage: String = chore.flags.iter().map(usage).collect();
    let mut text = format!("cargo xtask {}{usage}\n\n  {}\n", chore.name, chore.summary);
    for (flag, _, meaning) in chore.flags {
        text += &format!("\n  {flag:<10}{meaning}\n");
    }
    text
}

/// Flags of a call of a chore.
fn flags(chore: &Chore, arguments: &[String]) -> Result<Flags, String> {
    let mut found = Vec::new();
    let mut arguments = arguments.iter();
    while let Some(argument) = arguments.next() {
        let known = chore.flags.iter().find(|(flag, ..)| flag == argument && *flag != REST);
        let Some((flag, values, _)) = known else {
            if !chore.flags.iter().any(|(flag, ..)| *flag == REST) {
                return Err(format!("unknown argument {argument:?}"));
            }
            let first = Some(argument).filter(|argument| *argument != REST);
            let rest = first.into_iter().chain(arguments);
            found.extend(rest.map(|argument| (REST.to_string(), Some(argument.clone()))));
            break;
        };
        let mut value = None;
        if !values.is_empty() {
            let given = arguments.next().map(String::as_str).unwrap_or_default();
            if !values.contains(&given) {
                return Err(format!("{flag} {given:?}: expected one of {}", values.join(", ")));
            }
            value = Some(given.to_string());
        }
        found.push(((*flag).to_string(), value));
    }
    Ok(Flags(found))
}

fn demo(arguments: &[&str]) -> Result<(), String> {
    machine::need_c_compiler()?;
    if let Err(what) = viewer::build() {
        eprintln!("xtask: {what}: palpate is built without its viewer");
    }
    let folder: &[&str] = if arguments.contains(&"--output") { &[] } else { &["--output", "target/demo"] };
    run(Command::new(palpate()?).arg("demo").args(folder).args(arguments))
}

fn verify(arguments: &[&str]) -> Result<(), String> {
    machine::need_c_compiler()?;
    run(Command::new(palpate()?).arg("verify").args(arguments))
}

/// Duration of a soak [min].
const SOAK_MINUTES: &str = "30";

fn attack(arguments: &[&str]) -> Result<(), String> {
    machine::need_c_compiler()?;
    let palpate = palpate()?;
    process::cargo(&["build", "--release", "--locked", "--package", "palpate-attack"])?;
    run(Command::new(palpate.with_file_name("palpate-attack")).arg("--palpate").arg(&palpate).args(arguments))
}

fn check_layers(deep: bool) -> Result<(), String> {
    let report = layers::check(root(), deep)?;
    for text in report.circles.iter().chain(&report.against_floors) {
        println!("{text}");
    }
    if !report.against_floors.is_empty() {
        println!("against the floors: {}", report.against_floors.len());
    }
    println!("circles: {}", report.circles.len());
    if report.is_clean() {
        Ok(())
    } else {
        Err("modules must not import each other (ARCHITECTURE.md)".into())
    }
}

fn check_words(list: bool) -> Result<(), String> {
    let report = words::check(root())?;
    for text in report.retired.iter().chain(&report.doc_comments).chain(&report.citations) {
        println!("{text}");
    }
    let words::Report { retired, doc_comments, citations } = &report;
    println!(
        "retired words: {}, doc comments that name nothing: {}, citations: {}",
        retired.len(),
        doc_comments.len(),
        citations.len()
    );
    if report.is_clean() || list {
        return Ok(());
    }
    Err(format!("the terms are in docs/glossary.md, the retired ones in {}", words::RETIRED_WORDS))
}

#[cfg(test)]
mod command_line_tests {
    use super::*;

    fn chore(name: &str) -> &'static Chore {
        CHORES.iter().find(|chore| chore.name == name).expect("a chore")
    }

    #[test]
    fn the_list_has_a_line_for_every_chore() {
        assert!(
            CHORES.iter().all(|chore| list().contains(&format!("\n  {:<14}{}\n", chore.name, chore.summary)))
        );
    }

    #[test]
    fn flags_are_known_with_their_values_or_refused() {
        let given = |text: &str| text.split(' ').map(str::to_string).collect::<Vec<_>>();
        assert_eq!(
            flags(chore("test"), &given("--only rust")).map(|f| f.value("--only") == Some("rust")),
            Ok(true)
        );
        assert!(flags(chore("words"), &given("--list")).is_ok_and(|flags| flags.has("--list")));
        let refused = |name: &str, text: &str| flags(chore(name), &given(text)).err();
        assert_eq!(refused("bare", "--fast").as_deref(), Some("unknown argument \"--fast\""));
        let expected = "--only \"all\": expected one of build, python, viewer, web, c, doc, rust";
        assert_eq!(refused("test", "--only all").as_deref(), Some(expected));
    }

    #[test]
    fn arguments_are_passed_on_from_the_first_that_is_no_flag() {
        let rest = |name: &str, text: &str| {
            let given: Vec<String> = text.split(' ').map(str::to_string).collect();
            flags(chore(name), &given).map(|flags| flags.rest().join(" "))
        };
        assert_eq!(rest("verify", "hertz pinch"), Ok("hertz pinch".into()));
        assert_eq!(rest("demo", "-- --help"), Ok("--help".into()));
        assert_eq!(rest("attack", "--only files -- --seed"), Ok("--only files -- --seed".into()));
        assert_eq!(rest("fuzz", "--seconds 10 -- -runs=5"), Ok("-runs=5".into()));
        assert_eq!(rest("soak", "--help"), Ok("--help".into()));
        assert!(help(chore("verify")).starts_with("cargo xtask verify [[--] ARGUMENT …]\n"));
    }
}
