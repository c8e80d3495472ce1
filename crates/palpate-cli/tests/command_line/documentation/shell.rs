//! Command lines of the pages: all are parsed, and run where that is quick.

use super::{Block, blocks, root};
use crate::workplace::Workplace;
use std::ffi::OsString;
use std::fs;

/// Commands of palpate that are parsed only: parts of their lines, and why.
const PARSED_ONLY: &[(&str, &str)] = &[
    ("palpate serve", "serves until it is ended"),
    ("palpate device", "waits for a scene"),
    ("palpate demo", "records for a minute, then serves"),
    ("palpate render", "needs a browser"),
    ("palpate reproduce", "takes minutes"),
    ("palpate verify", "takes minutes"),
    ("palpate bench", "takes minutes"),
    ("--listen", "needs a linked device"),
    ("--dense", "writes gigabytes"),
    ("report/", "needs the report of `palpate reproduce`"),
    ("12x12x12", "takes seconds, and is measured by hand"),
    ("--force-error", "takes minutes"),
    ("--realtime", "the page's scene has a real device"),
];

/// Options that make a recording quick, and that no page that is run here has.
const SMALL: [&str; 4] = ["--order", "1", "--modes", "6"];

/// Cells of a surface that is filled, where the page leaves them out.
const COARSE: [&str; 2] = ["--cell-size", "0.012"];

/// Log that was cut; while it is there, no run writes the log of that name.
const CUT_LOG: &str = "run.mcap.part";

/// Page on which a run in real time is of a real device.
const REAL_DEVICES: &str = "docs/my-device.md";

/// Program and arguments of each command of a block.
fn commands(block: &Block) -> Vec<Vec<String>> {
    let joined = block.text.replace("\\\n", " ");
    joined.lines().map(words).filter(|words| !words.is_empty()).collect()
}

/// Words of a line: quotes are taken off, a comment ends it.
fn words(line: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let (mut quote, mut is_new) = (None, true);
    for c in line.chars() {
        match quote {
            Some(mark) if c == mark => quote = None,
            None if c == '\'' || c == '"' => {
                quote = Some(c);
                if is_new {
                    words.push(String::new());
                }
                is_new = false;
            }
            None if c == '#' && is_new => break,
            None if c.is_whitespace() => is_new = true,
            _ => {
                if is_new {
                    words.push(String::new());
                }
                is_new = false;
                words.last_mut().expect("a word").push(c);
            }
        }
    }
    words
}

/// Folder with the files that the pages speak of.
fn reader() -> Workplace {
    let workplace = Workplace::with_scene();
    // A block of 60 × 40 × 30 mm.
    let corners = [0, 1, 2, 3, 4, 5, 6, 7].map(|k| {
        let side = |bit: u32, length: u32| if k >> bit & 1 == 1 { length } else { 0 };
        format!("v {} {} {}\n", side(0, 60), side(1, 40), side(2, 30))
    });
    let faces =
        ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"].map(|face| format!("f {face}\n"));
    // The content decides the format.
    workplace.write("liver.stl", corners.concat() + &faces.concat());
    for name in ["liver.vtk", "liver.msh"] {
        workplace.succeed(&["mesh", "liver.stl", "--cell-size", "12", "--output", name]);
    }
    fs::copy(workplace.path("liver.vtk"), workplace.path("liver.vtu")).expect("a writable folder");
    fs::copy(workplace.path("cube.palp"), workplace.path("liver.palp")).expect("a writable folder");
    let press = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n[[device]]\nname = \"hand\"\nmode = \"held\"\n\
                 attach = { object = \"cube\", point = [0.05, 0, 0] }\npath = { file = \"right.csv\" }\n";
    workplace.write("press.toml", press);
    workplace
}

fn cut_log() -> Vec<u8> {
    let log = root().join("data/logs/v3_extrapolated/finger_on_floor.mcap");
    let mut log = fs::read(log).expect("a sample log");
    log.truncate(log.len() - 1000);
    log
}

/// Checks a command that is not palpate's by the files and chores that it names.
fn check_other(command: &[String], place: &str) {
    let read = |name: &str| fs::read_to_string(root().join(name)).expect("a file");
    let words: Vec<&str> = command.iter().map(String::as_str).collect();
    let exists = |path: &str| assert!(root().join(path).exists(), "{place}: there is no {path}");
    match words.as_slice() {
        ["cargo", "xtask", chore, flags @ ..] => {
            let chores = read("xtask/src/main.rs");
            assert!(chores.contains(&format!("name: \"{chore}\"")), "{place}: there is no chore {chore}");
            let known = |flag: &&str| !flag.starts_with("--") || chores.contains(&format!("\"{flag}\""));
            assert!(flags.iter().all(known), "{place}: {flags:?}");
        }
        ["cargo", "install", "--path", path] => exists(path),
        ["cargo", "add", "--path", path] => exists(path.trim_start_matches("../palpate/")),
        ["cargo", "add", "glam@0.33", ..] => {
            assert!(read("Cargo.toml").contains("glam = { version = \"0.33\""), "{place}: another version");
        }
        ["target/python-tests/bin/python", path] => exists(path),
        ["pip", "install", path] => assert!(path.starts_with("target/wheels/palpate-"), "{place}"),
        ["openssl", "rand" | "req", ..] => {}
        other => panic!("{place}: {other:?} is not checked"),
    }
}

#[test]
fn command_lines_of_the_pages_are_understood_and_the_quick_ones_run() {
    let mut workplaces: Vec<(String, Workplace)> = Vec::new();
    let (mut run, mut parsed, mut failures) = (0, 0, Vec::new());
    for block in blocks("sh") {
        for command in commands(&block) {
            let line = command.join(" ");
            let place = format!("{}: {line}", block.place());
            if command[0] != "palpate" {
                check_other(&command, &place);
                continue;
            }
            let arguments = command.iter().map(OsString::from);
            if let Err(error) = palpate_cli::check_command_line(arguments) {
                failures.push(format!("{place}: {error}"));
                continue;
            }
            let is_real = block.page == REAL_DEVICES;
            if PARSED_ONLY.iter().any(|(part, _)| line.contains(part) && (*part != "--realtime" || is_real)) {
                parsed += 1;
                continue;
            }
            if workplaces.last().is_none_or(|(page, _)| *page != block.page) {
                workplaces.push((block.page.clone(), reader()));
            }
            let (_, workplace) = workplaces.last().expect("a folder");
            let mut arguments: Vec<&str> = command[1..].iter().map(String::as_str).collect();
            if arguments[0] == "record" {
                arguments.extend(SMALL);
            }
            if arguments.contains(&"liver.stl") && !arguments.contains(&"--cell-size") {
                arguments.extend(COARSE);
            }
            if let Some(at) = arguments.iter().position(|argument| *argument == "--duration") {
                arguments[at + 1] = "0.1";
            }
            if line.contains(CUT_LOG) {
                workplace.write(CUT_LOG, cut_log());
            }
            let done = workplace.palpate(&arguments);
            if !done.status.success() {
                failures.push(format!("{place}: {}", String::from_utf8_lossy(&done.stderr)));
            }
            run += 1;
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    assert!(run >= 25 && parsed >= 20, "{run} were run, {parsed} parsed");
}

#[test]
fn command_lines_that_are_none_are_refused() {
    let refused =
        |line: &str| palpate_cli::check_command_line(words(line).into_iter().map(OsString::from)).is_err();
    assert!(refused("palpate mesh a.stl --scael 1"));
    assert!(refused("palpate squeeze"));
    assert!(!refused("palpate mesh 'a b.stl' --scale 0.001 # a comment"));
    assert_eq!(words("a 'b c' \"d\"e # f"), ["a", "b c", "de"]);
}
