//! Standard input and output in place of files, completions, and the manual.

use super::workplace::{CUBE, Table, Workplace};
use std::io::Write;
use std::process::{Command, Output, Stdio};

/// Runs a command with bytes on its standard input.
fn piped(command: &mut Command, input: &[u8]) -> Output {
    command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().expect("the command starts");
    // One that refuses its arguments reads nothing.
    let _ = child.stdin.take().expect("a pipe").write_all(input);
    child.wait_with_output().expect("the command ends")
}

/// Standard output and standard error of `palpate` with bytes on its standard input.
fn streams(workplace: &Workplace, arguments: &[&str], input: &[u8]) -> (Vec<u8>, String) {
    let output = piped(&mut workplace.command(arguments), input);
    let stderr = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    (output.stdout, stderr)
}

#[test]
fn a_scene_comes_from_standard_input_and_its_rows_go_to_standard_output() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--csv", "out.csv", "--contacts", "contacts.csv"]);
    let scene = workplace.read("scene.toml");
    let (rows, told) = streams(&workplace, &["run", "-", "--csv", "-"], &scene);
    assert_eq!(String::from_utf8(rows).expect("text"), workplace.text("out.csv"));
    assert!(told.contains("50 steps of 1 ms"), "{told}");
    let (contacts, _) = streams(&workplace, &["run", "-", "--contacts", "-"], &scene);
    assert_eq!(contacts, workplace.read("contacts.csv"));
    let (summary, _) = streams(&workplace, &["run", "-", "--json"], &scene);
    let summary: serde_json::Value = serde_json::from_slice(&summary).expect("JSON alone");
    assert_eq!(summary["steps"], 50);
    // Errors name the stream and the line.
    let output = piped(&mut workplace.command(&["run", "-"]), b"step = 0.001\ngravity = 3\n");
    let told = String::from_utf8(output.stderr).expect("text");
    assert!(!output.status.success() && told.starts_with("error: standard input: "), "{told}");
    // Nothing is left in a file of that name.
    assert!(!workplace.files().contains(&"-".to_string()));
}

#[test]
fn a_reader_that_goes_away_is_no_failure() {
    let workplace = Workplace::with_scene();
    let mut command = workplace.command(&["run", "scene.toml", "--duration", "20", "--csv", "-"]);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("it ends");
    let told = String::from_utf8(output.stderr).expect("text");
    assert!(output.status.success() && told.contains("20000 steps"), "{told}");
}

#[test]
fn meshes_and_recordings_go_through_pipes() {
    let workplace = Workplace::new();
    let (mesh, report) =
        streams(&workplace, &["mesh", "-", "-o", "-"], super::workplace::gmsh_bar().as_bytes());
    assert!(mesh.starts_with(b"# vtk DataFile"), "{}", String::from_utf8_lossy(&mesh));
    assert!(report.starts_with("standard input: Gmsh 2.2"), "{report}");
    let body = ["--young", "2000", "--poisson", "0.3", "--density", "110", "--modes", "6", "--order", "1"];
    let (recording, told) = streams(&workplace, &[&["record", "-", "-o", "-"], &body[..]].concat(), &mesh);
    assert!(told.contains("from standard input"), "{told}");
    let (text, _) = streams(&workplace, &["inspect", "-"], &recording);
    let text = String::from_utf8(text).expect("text");
    assert!(text.starts_with("standard input (") && text.contains("6 elastic"), "{text}");
    // A table beside it is told of elsewhere.
    let dense = ["--dense", "table.zarr", "--step", "0.001", "--duration", "0.005", "--precision", "compact"];
    let with_table = [&["record", "-", "-o", "-"], &body[..], &dense].concat();
    let (beside_table, told) = streams(&workplace, &with_table, &mesh);
    assert_eq!(beside_table, recording);
    assert!(told.contains("touchable"), "{told}");
    // The same bytes as those of files.
    workplace.write("standard input", &mesh);
    workplace.succeed(&[&["record", "standard input", "-o", "bar.palp"], &body[..]].concat());
    assert_eq!(workplace.read("bar.palp"), recording);
}

#[test]
fn paths_that_cannot_be_streams_say_why() {
    let workplace = Workplace::with_scene();
    for (arguments, expected) in [
        (&["run", "scene.toml", "--vtu", "-"][..], "--vtu can't be -: it is a folder of files; "),
        (
            &["run", "scene.toml", "--realtime", "--log", "-"],
            "--log can't be -: a log grows under a name of its own until it is whole; ",
        ),
        (&["replay", "-"], "the log can't be -: a log is read at several places; "),
        (&["serve", "-"], "what is served can't be -: what is served is read again when it restarts; "),
        (&["export", "cube.palp", "--gltf", "-"], "--gltf can't be -: its beginning is written last; "),
        (&["render", "run.mcap", "-o", "-"], "-o can't be -: it is a folder of files; "),
    ] {
        let error = workplace.fail(arguments);
        assert_eq!(error, format!("{expected}give a path (a file named - is ./-)"), "{arguments:?}");
    }
    assert_eq!(
        workplace.fail(&["run", "scene.toml", "--csv", "-", "--json"]),
        "--csv - and --json both write to standard output: give one a path"
    );
    assert_eq!(
        workplace.fail(&["run", "scene.toml", "--csv", "-", "--contacts", "-"]),
        "cannot write -: --csv and --contacts name the same file"
    );
    let error = workplace.fail(&[&CUBE[..], &["-", "--dense", "-"]].concat());
    assert_eq!(error, "--dense can't be -: it is a folder of files; give a path (a file named - is ./-)");
    // A file of that name has a path.
    workplace.succeed(&["run", "scene.toml", "--csv", "./-"]);
    assert_eq!(Table::parse(&workplace.text("-")).len(), 50);
}

#[test]
fn completions_know_every_command_and_the_manual_has_a_page_for_each() {
    let workplace = Workplace::new();
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let script = workplace.succeed(&["completions", shell]);
        for word in ["record", "completions", "damping-ratio"] {
            assert!(script.contains(word), "{shell}: {word}");
        }
    }
    let told = workplace.succeed(&["man", "-o", "man/man1"]);
    assert!(told.contains("palpate-record"), "{told}");
    let page = workplace.text("man/man1/palpate-record.1");
    for word in [".TH", "palpate\\-record", "Young", "\\-\\-damping\\-ratio"] {
        assert!(page.contains(word), "{word}: {page}");
    }
    // A hidden command has none.
    assert!(!workplace.path("man/man1/palpate-guard.1").exists());
    assert!(workplace.path("man/man1/palpate.1").exists());
}

#[test]
fn the_help_of_verify_lists_every_case() {
    let help = Workplace::new().succeed(&["verify", "--help"]);
    for case in palpate_verify::CASES {
        assert!(help.contains(&format!("\n  {} ", case.name)), "{}: {help}", case.name);
    }
}
