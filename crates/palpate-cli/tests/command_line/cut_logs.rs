//! Logs and other outputs of runs that were killed, or had no room on the disk or in memory.

use crate::viewer::Serving;
use crate::workplace::{CUBE, Workplace, with_memory, with_room};
use palpate_testkit::wait_until;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

/// Steps that a log has before its run is killed: some chunks.
const ENOUGH_STEPS: u64 = 1200;

/// Room for steps on a full disk [bytes]: some seconds of them.
const ROOM: u64 = 400_000;

/// Run in real time without an end.
fn endless_run(workplace: &Workplace) -> Child {
    Command::new(env!("CARGO_BIN_EXE_palpate"))
        .args(["run", "scene.toml", "--realtime", "--duration", "600", "--log", "run.mcap"])
        .current_dir(workplace.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts")
}

fn interrupt(child: &Child) {
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()));
}

/// Standard error of a command that succeeds.
fn said(workplace: &Workplace, arguments: &[&str]) -> String {
    let output = workplace.palpate(arguments);
    let text = String::from_utf8(output.stderr).expect("text");
    assert_eq!(output.status.code(), Some(0), "{arguments:?}: {text}");
    text
}

#[test]
fn a_killed_run_leaves_a_log_that_is_read_and_recovered() {
    let workplace = Workplace::with_scene();
    workplace.write("run.mcap", "an older log");
    let mut child = endless_run(&workplace);
    wait_until("some chunks", || workplace.logged_steps("run.mcap.part") > ENOUGH_STEPS);
    child.kill().expect("a child");
    child.wait().expect("a child");
    assert_eq!(workplace.text("run.mcap"), "an older log");
    std::fs::remove_file(workplace.path("run.mcap")).expect("removed");
    assert!(!workplace.files().iter().any(|name| name.starts_with('.')), "{:?}", workplace.files());

    let steps = workplace.logged_steps("run.mcap.part");
    let warning = format!(
        "warning: run.mcap.part: the log ends without its summary after {steps} steps ({:.3} s): was the run killed? `palpate recover \
         run.mcap.part -o WHOLE.mcap` makes a whole file\n",
        steps as f64 * 1e-3
    );
    assert_eq!(said(&workplace, &["replay", "run.mcap.part"]), warning);
    assert_eq!(said(&workplace, &["inspect", "run.mcap.part"]), warning);
    assert_eq!(said(&workplace, &["export", "run.mcap.part", "--csv", "steps.csv"]), warning);
    assert_eq!(workplace.text("steps.csv").lines().count() as u64, steps + 1);
    let replayed = &workplace.json(&["replay", "run.mcap.part", "--json"])["replayed"];
    assert_eq!(
        (&replayed["steps"], &replayed["identical"], &replayed["cut"]),
        (&steps.into(), &true.into(), &true.into())
    );
    let error = workplace.palpate(&["render", "run.mcap.part", "-o", "frames", "--browser", "true"]);
    assert!(String::from_utf8_lossy(&error.stderr).starts_with(&warning), "{error:?}");
    let serving = Serving::new(&workplace, &["run.mcap.part"]);
    wait_until("a frame", || serving.get("/log/0/frames?from=20&count=1").1.len() > 8);
    assert_eq!(serving.interrupt(), Some(0));

    // Who looks for the log is told; a new run destroys nothing.
    let error = workplace.fail(&["replay", "run.mcap"]);
    let expected = "cannot read the log run.mcap: there is only run.mcap.part, of a run that is going on, was killed or had no room; what is \
                    in it can be read by that name";
    assert_eq!(error, expected);
    let error =
        workplace.fail(&["run", "scene.toml", "--realtime", "--duration", "0.1", "--log", "run.mcap"]);
    let expected = "cannot write run.mcap: run.mcap.part is there, left by a run that was killed or had no room; keep what is in it \
                    (`palpate recover` makes a whole log), or remove it";
    assert_eq!(error, expected);
    assert_eq!(workplace.logged_steps("run.mcap.part"), steps);

    // One that is killed at once leaves nothing that is worth refusing for.
    let bytes = workplace.read("run.mcap.part");
    workplace.write("other.mcap.part", &bytes[..2000]);
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "other.mcap"]);
    assert_eq!(
        (workplace.logged_steps("other.mcap"), workplace.path("other.mcap.part").exists()),
        (50, false)
    );
    workplace.write("notes.part", "no log");
    let error = workplace.fail(&["run", "scene.toml", "--realtime", "--duration", "0.1", "--log", "notes"]);
    assert!(error.starts_with("cannot write notes: notes.part is there"), "{error}");

    let error = workplace.fail(&["recover", "run.mcap.part", "-o", "run.mcap.part"]);
    assert_eq!(error, "cannot write run.mcap.part: it is one of the inputs");
    let recovered = workplace.json(&["recover", "run.mcap.part", "-o", "run.mcap", "--json"]);
    assert_eq!((&recovered["steps"], &recovered["log"]), (&steps.into(), &"run.mcap".into()));
    assert_eq!(said(&workplace, &["replay", "run.mcap"]), "");
    assert_eq!(workplace.json(&["inspect", "run.mcap", "--json"])["whole"], true);
    let error = workplace.fail(&["recover", "run.mcap", "-o", "twice.mcap"]);
    assert_eq!(error, "run.mcap: the log is whole: there is nothing to recover");
    assert!(!workplace.path("twice.mcap").exists());
}

#[test]
fn a_killed_server_leaves_a_log_that_is_read() {
    let workplace = Workplace::with_scene();
    let mut serving = Serving::new(&workplace, &["scene.toml", "--log", "run.mcap"]);
    wait_until("some chunks", || workplace.logged_steps("run.mcap.part") > ENOUGH_STEPS);
    serving.child.kill().expect("a child");
    serving.child.wait().expect("a child");
    let steps = workplace.logged_steps("run.mcap.part");
    assert_eq!(workplace.json(&["replay", "run.mcap.part", "--json"])["replayed"]["steps"], steps);
    let started = workplace.palpate(&["serve", "scene.toml", "--no-browser", "--log", "run.mcap"]);
    let error = String::from_utf8_lossy(&started.stderr).into_owned();
    let expected = "error: cannot write run.mcap: run.mcap.part is there, left by a run that was killed or had no room; keep what is in it \
                    (`palpate recover` makes a whole log), or remove it\n";
    assert_eq!((started.status.code(), error.as_str()), (Some(1), expected));
}

#[test]
fn a_full_disk_is_told_at_once_and_the_run_goes_on_with_its_report() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "short.mcap"]);
    let begin = std::fs::metadata(workplace.path("short.mcap")).expect("a log").len();
    let mut child = with_room((begin + ROOM) / 512)
        .args(["run", "scene.toml", "--realtime"])
        .args(["--duration", "600", "--json", "--log", "run.mcap"])
        .current_dir(workplace.path("."))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("a shell");
    let mut lines = BufReader::new(child.stderr.take().expect("standard error")).lines();
    let first = lines.next().expect("a line").expect("text");
    let expected =
        "warning: cannot write the log run.mcap: File too large (os error 27). The run goes on without it.";
    assert_eq!(first, expected);
    assert!(child.try_wait().expect("a child").is_none(), "it goes on");
    interrupt(&child);
    let mut report = String::new();
    child.stdout.take().expect("standard output").read_to_string(&mut report).expect("text");
    let rest: Vec<String> = lines.map_while(Result::ok).collect();
    assert_eq!(child.wait().expect("a child").code(), Some(1), "{rest:?}");
    let report: serde_json::Value = serde_json::from_str(&report).expect("a report");
    let (all, kept) =
        (report["steps"].as_u64().expect("steps"), report["log"]["steps"].as_u64().expect("steps"));
    assert!(kept > 50 && kept < all && report["force_process"]["cycles"].as_u64() >= Some(all), "{report:#}");
    assert_eq!((&report["log"]["whole"], &report["log"]["missed"]), (&false.into(), &(all - kept).into()));
    let expected = format!(
        "error: the log run.mcap is incomplete: at least the first {kept} of {all} steps are kept in run.mcap.part; `palpate recover run.mcap.part \
         -o WHOLE.mcap` makes a whole file of them"
    );
    assert_eq!(rest, [expected]);
    // A chunk may be whole whose index did not fit.
    let readable = workplace.logged_steps("run.mcap.part");
    assert!((kept..=all).contains(&readable), "{kept} to {readable} of {all}");
    workplace.succeed(&["recover", "run.mcap.part", "-o", "whole.mcap"]);
    assert_eq!(workplace.json(&["replay", "whole.mcap", "--json"])["replayed"]["steps"], readable);
}

#[test]
fn a_server_on_a_full_disk_keeps_the_steps_so_far_and_goes_on() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "short.mcap"]);
    let begin = std::fs::metadata(workplace.path("short.mcap")).expect("a log").len();
    let serving = Serving::with_room((begin + ROOM) / 512, &workplace, &["scene.toml", "--log", "run.mcap"]);
    let mut kept = 0;
    wait_until("the disk is full", || {
        let before = std::mem::replace(
            &mut kept,
            std::fs::metadata(workplace.path("run.mcap.part")).map_or(0, |m| m.len()),
        );
        kept == before && kept > begin + ROOM - 512
    });
    assert!(!serving.get("/").0.is_empty(), "it goes on");
    let (code, said) = serving.interrupted();
    assert_eq!(said[0], "warning: cannot write the log run.mcap: File too large (os error 27)");
    assert!(said[1].starts_with("warning: the log run.mcap is incomplete: at least the first "), "{said:?}");
    assert_eq!(said[2..], ["error: cannot write the log run.mcap: File too large (os error 27)"]);
    assert_eq!(code, Some(1));
    assert!(workplace.logged_steps("run.mcap.part") > 50);
    workplace.succeed(&["recover", "run.mcap.part", "-o", "run.mcap"]);
}

#[test]
fn an_interrupted_rendering_leaves_neither_its_folders_nor_its_browser() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "run.mcap"]);
    std::fs::create_dir(workplace.path("tmp")).expect("a folder");
    // A browser that draws nothing; it leaves its number.
    workplace
        .write("browser", "#!/bin/sh\n[ \"$1\" = --version ] && exit 0\necho $$ > number\nexec sleep 1000\n");
    let made = Command::new("chmod").arg("+x").arg(workplace.path("browser")).status();
    assert!(made.is_ok_and(|status| status.success()));
    for signal in ["-TERM", "-HUP", "-INT"] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["render", "run.mcap", "-o", "frames", "--browser", "./browser"])
            .env("TMPDIR", workplace.path("tmp"))
            .current_dir(workplace.path("."))
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let mut number = String::new();
        wait_until("the browser runs", || {
            number = std::fs::read_to_string(workplace.path("number")).unwrap_or_default();
            number.ends_with('\n')
        });
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        assert_eq!(child.wait().expect("a child").code(), Some(1), "{signal}");
        assert_eq!(std::fs::read_dir(workplace.path("tmp")).expect("a folder").count(), 0, "{signal}");
        assert!(!workplace.path("frames").exists(), "{signal}");
        let lives = Command::new("kill").args(["-0", number.trim()]).stderr(Stdio::null()).status();
        assert!(!lives.is_ok_and(|status| status.success()), "{signal}");
        std::fs::remove_file(workplace.path("number")).expect("removed");
    }
}

#[test]
fn other_outputs_that_do_not_fit_are_told_and_leave_nothing() {
    let workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "run.mcap"]);
    let begin = workplace.read("run.mcap");
    workplace.write("cut.mcap", &begin[..begin.len() - 20]);
    let before = workplace.files();
    let record = [&CUBE[..], &["new.palp"]].concat();
    for (arguments, what) in [
        (&["run", "scene.toml", "--csv", "steps.csv"][..], "steps.csv"),
        (&["run", "scene.toml", "--contacts", "c.csv", "--csv", "steps.csv"], "steps.csv"),
        (&["run", "scene.toml", "--vtu", "frames"], "frames/cube_00000.vtu"),
        (&["export", "cube.palp", "--gltf", "modes.glb"], "modes.glb"),
        (&record, "new.palp"),
    ] {
        for blocks in [0, 1, 8] {
            let output = workplace.palpate_with_room(blocks, arguments);
            let text = String::from_utf8(output.stderr).expect("text");
            assert_eq!(output.status.code(), Some(1), "{arguments:?}: {text}");
            let expected = format!("error: cannot write {what}: File too large (os error 27)\n");
            assert!(text.ends_with(&expected), "{arguments:?} with {blocks} blocks: {text}");
            assert_eq!(workplace.files(), before, "{arguments:?}");
        }
    }
    let output = workplace.palpate_with_room(8, &["recover", "cut.mcap", "-o", "whole.mcap"]);
    let text = String::from_utf8(output.stderr).expect("text");
    assert!(text.ends_with("File too large (os error 27)\n") && output.status.code() == Some(1), "{text}");
    assert_eq!(workplace.files(), before);
}

#[test]
fn outputs_are_whole_or_not_there_wherever_memory_runs_out() {
    let workplace = Workplace::with_scene();
    let record = [&CUBE[..], &["new.palp"]].concat();
    let run = ["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "run.mcap"];
    let csv = ["run", "scene.toml", "--csv", "steps.csv"];
    let gltf = ["export", "cube.palp", "--gltf", "modes.glb"];
    for (arguments, output) in
        [(&record[..], "new.palp"), (&run, "run.mcap"), (&csv, "steps.csv"), (&gltf, "modes.glb")]
    {
        // Less than the program itself needs at first, then an eighth more each time.
        let (mut failed, mut kilobytes) = (0, 8192);
        loop {
            let ended = with_memory(kilobytes)
                .args(arguments)
                .current_dir(workplace.path("."))
                // A panic for want of memory has none for its backtrace.
                .env("RUST_BACKTRACE", "1")
                .output()
                .expect("a shell");
            if ended.status.success() {
                break;
            }
            failed += 1;
            assert!(!workplace.path(output).exists(), "{arguments:?} with {kilobytes} kB");
            if workplace.path("run.mcap.part").exists() {
                workplace.logged_steps("run.mcap.part");
            }
            kilobytes += kilobytes / 8;
        }
        assert!(failed >= 5, "{arguments:?}: {failed} attempts failed before {kilobytes} kB were enough");
        let whole = workplace.read(output);
        // What failed attempts have left hinders nothing.
        std::fs::remove_file(workplace.path(output)).expect("an output");
        workplace.succeed(arguments);
        if output != "run.mcap" {
            assert!(workplace.read(output) == whole, "{output}");
        }
    }
}

#[test]
fn two_runs_at_once_never_share_a_log() {
    let workplace = Workplace::with_scene();
    let mut first = endless_run(&workplace);
    wait_until("a chunk", || workplace.logged_steps("run.mcap.part") > 0);
    let error =
        workplace.fail(&["run", "scene.toml", "--realtime", "--duration", "0.1", "--log", "run.mcap"]);
    assert_eq!(error, "cannot write run.mcap: another process is writing it");
    interrupt(&first);
    assert_eq!(first.wait().expect("a child").code(), Some(0));
    let replayed = &workplace.json(&["replay", "run.mcap", "--json"])["replayed"];
    assert_eq!((&replayed["identical"], &replayed["cut"]), (&true.into(), &false.into()));
}

#[test]
fn temporary_folders_go_with_a_signal_and_those_of_a_killed_process_with_the_next() {
    let mut workplace = Workplace::with_scene();
    workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05", "--log", "run.mcap"]);
    std::fs::create_dir(workplace.path("tmp")).expect("a folder");
    let temporary = workplace.path("tmp");
    workplace.set("TMPDIR", &temporary.display().to_string());
    let left = || std::fs::read_dir(&temporary).expect("a folder").count();
    for (signal, remaining) in [("-TERM", 0), ("-HUP", 0), ("-INT", 0), ("-KILL", 1)] {
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["replay", "run.mcap", "--runs", "100000000"])
            .env("TMPDIR", &temporary)
            .current_dir(workplace.path("."))
            .stderr(Stdio::null())
            .spawn()
            .expect("the command starts");
        let unpacked = || {
            let mut folders = std::fs::read_dir(&temporary).expect("a folder").flatten();
            folders.any(|folder| folder.path().join(".lock").exists())
        };
        wait_until("it has unpacked the log", unpacked);
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        child.wait().expect("a child");
        assert_eq!(left(), remaining, "{signal}");
    }
    workplace.succeed(&["inspect", "run.mcap"]);
    assert_eq!(left(), 0);
}

#[test]
fn what_is_no_regular_file_is_refused_and_nothing_is_waited_for() {
    let workplace = Workplace::with_scene();
    for pipe in ["pipe", "pipe.mcap", "pipe.stl", "pipe.msh", "pipe.palp"] {
        let made = Command::new("mkfifo").arg(workplace.path(pipe)).status();
        assert!(made.is_ok_and(|status| status.success()));
    }
    let material = ["--young", "2000", "--poisson", "0.3", "--density", "110", "-o", "out.palp"];
    for (arguments, what) in [
        (vec!["run", "pipe"], "cannot read the scene pipe"),
        (vec!["run", "."], "cannot read the scene ."),
        (vec!["serve", "pipe", "--no-browser"], "cannot read the scene pipe"),
        (vec!["serve", "pipe.mcap", "--no-browser"], "cannot read the log pipe.mcap"),
        (vec!["replay", "pipe"], "cannot read the log pipe"),
        (vec!["recover", "pipe", "-o", "whole.mcap"], "cannot read the log pipe"),
        (vec!["export", "pipe.mcap", "--csv", "steps.csv"], "cannot read the log pipe.mcap"),
        (vec!["export", "pipe.palp", "--csv", "steps.csv"], "cannot read the recording pipe.palp"),
        (vec!["inspect", "pipe"], "cannot read the recording pipe"),
        (vec!["device", "left", "--path", "pipe"], "cannot read the path pipe"),
        ([&["record", "pipe.msh"][..], &material].concat(), "cannot read mesh pipe.msh"),
        (
            vec!["record", "box:0.1x0.1x0.1/2x2x2", "--materials", "pipe", "-o", "out.palp"],
            "cannot read the materials pipe",
        ),
    ] {
        let is = if arguments[1] == "." { "a folder" } else { "a pipe" };
        assert_eq!(workplace.fail(&arguments), format!("{what}: it is {is}, not a file"), "{arguments:?}");
    }
    for (from, to, what) in [("cube.palp", "pipe.palp", "recording"), ("left.csv", "pipe", "path")] {
        let scene = workplace.text("scene.toml").replace(from, to);
        workplace.write("wrong.toml", scene);
        let error = workplace.fail(&["run", "wrong.toml"]);
        assert!(
            error.ends_with(&format!(": cannot read the {what} {to}: it is a pipe, not a file")),
            "{error}"
        );
    }
    assert!(!["steps.csv", "whole.mcap", "out.palp"].iter().any(|name| workplace.path(name).exists()));
}
