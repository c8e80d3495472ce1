//! Ways out of a process that drives a real device: each leaves the device without force. The devices are stand-ins whose amplifier
//! holds its force when the process is gone: a file. Each test prints how long the force stayed on.

#[path = "../../../palpate-haptics/tests/standins/inverse_service.rs"]
#[allow(dead_code)]
mod inverse_service;

use crate::devices::compile::compile;
use crate::workplace::Workplace;
use inverse_service::Service;
use palpate_testkit::wait_until;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

/// Force from which on a device pushes [N]: half of its limit.
const PUSHES_N: f64 = 0.2;

/// State of a stand-in's amplifier.
#[derive(Debug, PartialEq)]
struct Amplifier {
    open: bool,
    forces_on: bool,
    force: [f64; 3],
}

impl Amplifier {
    /// A device that nobody has, without force.
    fn is_left(&self) -> bool {
        !self.open && !self.forces_on && self.force == [0.0; 3]
    }
}

/// A run with a real device, which pulls its hand to a point that it does not reach.
struct Run {
    workplace: Workplace,
    process: Child,
    /// Process of the guardian.
    guardian: u32,
}

impl Run {
    /// Starts a run by a program with arguments before those of palpate, and waits for its force. The driver's stand-in is in `library`.
    fn start(driver: &str, library: &str, before: &[&str]) -> Self {
        let workplace = Workplace::with_scene();
        let file = compile(library, &workplace.path(""));
        let hand = format!(
            "driver = {{ kind = \"{driver}\", armed = true, max_force = 0.4 }}\n\
             mount = {{ position = [-0.055, 0.0, 0.0] }}\ncoupling = {{ stiffness = 200.0, damping = 0.5 }}"
        );
        let scene = workplace.text("scene.toml").replace("path = { file = \"left.csv\" }", &hand);
        workplace.write("real.toml", scene);
        let palpate = [env!("CARGO_BIN_EXE_palpate"), "run", "real.toml", "--realtime", "--duration", "600"];
        let words = [before, &palpate, &["--pictures", "0", "--json"]].concat();
        let process = Command::new(words[0])
            .args(&words[1..])
            .current_dir(workplace.path(""))
            .env(if driver == "dhd" { "PALPATE_LIBDHD" } else { "PALPATE_LIBHD" }, &file)
            .env("PALPATE_STANDIN", workplace.path("amplifier"))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts");
        let mut run = Self { workplace, process, guardian: 0 };
        wait_until("a force", || {
            run.amplifier().is_some_and(|one| one.force[0].abs().max(one.force[1].abs()) > PUSHES_N)
        });
        run.guardian = run.guardian_of(run.palpate());
        run
    }

    /// Process of palpate: the one that has a guardian.
    fn palpate(&self) -> u32 {
        let own = self.process.id();
        let children = children(own);
        children.into_iter().find(|child| command_of(*child).contains("real.toml")).unwrap_or(own)
    }

    fn guardian_of(&self, palpate: u32) -> u32 {
        let guards = |child: &u32| command_of(*child).contains("guard");
        children(palpate).into_iter().find(guards).expect("a guardian")
    }

    fn amplifier(&self) -> Option<Amplifier> {
        let text = std::fs::read_to_string(self.workplace.path("amplifier")).ok()?;
        let numbers: Vec<f64> = text.split_whitespace().filter_map(|word| word.parse().ok()).collect();
        let [open, on, x, y, z] = numbers[..] else { return None };
        Some(Amplifier { open: open == 1.0, forces_on: on == 1.0, force: [x, y, z] })
    }

    /// Waits until the device is left and the guardian has ended, prints how long the force stayed on, and gives what palpate printed.
    fn end_by(mut self, way: &str, act: impl FnOnce(&mut Self)) -> Output {
        let begun = Instant::now();
        act(&mut self);
        wait_until("no force", || self.amplifier().is_some_and(|one| one.force == [0.0; 3]));
        let took = begun.elapsed();
        wait_until("the device is closed", || self.amplifier().is_some_and(|one| one.is_left()));
        println!("{way}: without force after {:.1} ms", took.as_secs_f64() * 1e3);
        let guardian = self.guardian;
        wait_until("the guardian has ended", || !runs(guardian));
        self.process.wait_with_output().expect("a child")
    }
}

/// Children of a process.
fn children(process: u32) -> Vec<u32> {
    let threads = std::fs::read_dir(format!("/proc/{process}/task")).into_iter().flatten().flatten();
    let lists = threads.filter_map(|thread| std::fs::read_to_string(thread.path().join("children")).ok());
    lists
        .flat_map(|list| list.split_whitespace().filter_map(|id| id.parse().ok()).collect::<Vec<_>>())
        .collect()
}

/// Command line of a process.
fn command_of(process: u32) -> String {
    std::fs::read_to_string(format!("/proc/{process}/cmdline")).unwrap_or_default()
}

/// Whether a process runs: one that nobody waits for has ended, too.
fn runs(process: u32) -> bool {
    let stat = std::fs::read_to_string(format!("/proc/{process}/stat")).unwrap_or_default();
    stat.rsplit_once(") ").is_some_and(|(_, state)| !state.starts_with('Z'))
}

fn send(signal: &str, process: u32) {
    let sent = Command::new("kill").args([signal, &process.to_string()]).status();
    assert!(sent.is_ok_and(|status| status.success()), "{signal}");
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn signals_leave_a_device_without_force_and_its_guardian_ends_with_the_run() {
    for signal in ["-INT", "-TERM", "-HUP"] {
        let run = Run::start("dhd", "libdhd", &[]);
        let output = run.end_by(signal, |run| send(signal, run.palpate()));
        assert_eq!(output.status.code(), Some(0), "{signal}: {}", text(&output.stderr));
        assert!(!text(&output.stderr).contains("guardian"), "{}", text(&output.stderr));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a report");
        assert_eq!(report["devices"][0]["failure"], serde_json::Value::Null, "{report:#}");
    }
}

#[test]
fn a_guardian_takes_the_force_away_when_the_process_is_killed_aborts_or_faults() {
    for (driver, library, signal, times) in [
        ("dhd", "libdhd", "-KILL", 1),
        ("dhd", "libdhd", "-ABRT", 1),
        // The handler of stack overflows takes the first for a fault of another kind.
        ("dhd", "libdhd", "-SEGV", 2),
        ("openhaptics", "libhd", "-KILL", 1),
    ] {
        let run = Run::start(driver, library, &[]);
        let palpate = run.palpate();
        let output = run.end_by(&format!("{driver}, {signal}"), |_| {
            (0..times).for_each(|_| {
                let _ = Command::new("kill").args([signal, &palpate.to_string()]).status();
            });
        });
        assert_eq!(output.status.code(), None, "by a signal");
        let device = if driver == "dhd" { "dhd 301" } else { "openhaptics 0" };
        let said = text(&output.stderr);
        let expected =
            format!("guardian: palpate ended and left {device} with its force: forces are off, after ");
        assert!(said.lines().any(|line| line.starts_with(&expected)), "{said}");
    }
}

#[test]
fn a_process_that_hangs_is_killed_and_its_device_left_without_force() {
    let run = Run::start("dhd", "libdhd", &[]);
    let output = run.end_by("-STOP", |run| send("-STOP", run.palpate()));
    assert_eq!(output.status.code(), None, "killed");
    let said = text(&output.stderr);
    let expected = "guardian: palpate hung for 0.5 s with dhd 301, and was killed: forces are off, after ";
    assert!(said.lines().any(|line| line.starts_with(expected)), "{said}");
}

#[test]
fn a_run_ends_in_good_order_with_the_process_that_started_it() {
    let run = Run::start("dhd", "libdhd", &["sh", "-c", "\"$@\"; true", "sh"]);
    let (shell, palpate) = (run.process.id(), run.palpate());
    assert_ne!(shell, palpate);
    let output = run.end_by("parent killed", |run| run.process.kill().expect("it runs"));
    wait_until("palpate has ended", || !runs(palpate));
    assert!(text(&output.stdout).contains("\"steps\""), "with its report: {}", text(&output.stderr));
    assert!(!text(&output.stderr).contains("guardian"), "{}", text(&output.stderr));
}

#[test]
fn without_its_guardian_a_device_gives_no_force() {
    let run = Run::start("dhd", "libdhd", &[]);
    let palpate = run.palpate();
    send("-KILL", run.guardian);
    let begun = Instant::now();
    wait_until("no force", || run.amplifier().is_some_and(|one| one.force == [0.0; 3]));
    println!("guardian killed: without force after {:.1} ms", begun.elapsed().as_secs_f64() * 1e3);
    std::thread::sleep(Duration::from_millis(50));
    assert_eq!(run.amplifier().map(|one| one.force), Some([0.0; 3]), "and it stays away");
    let output = run.end_by("-INT without a guardian", |_| send("-INT", palpate));
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).expect("a report");
    let failure = report["devices"][0]["failure"].as_str().expect("a failure");
    assert_eq!(
        failure,
        "the guardian of the device has ended (Broken pipe (os error 32)): without one it gives no force, start again"
    );
}

#[test]
fn a_guardian_takes_the_force_of_a_haply_device_away() {
    let service = Service::new();
    // The vendor's service holds the last force of a client that has gone.
    service.set(|world| world.cursor = [0.0; 3]);
    let mut workplace = Workplace::with_scene();
    workplace.set("PALPATE_HAPLY", &service.place());
    let hand = "driver = { kind = \"haply\", armed = true, max_force = 0.4 }\n\
                mount = { position = [-0.055, 0.0, 0.0] }\ncoupling = { stiffness = 200.0, damping = 0.5 }";
    let scene = workplace.text("scene.toml").replace("path = { file = \"left.csv\" }", hand);
    workplace.write("real.toml", scene);
    let mut process = workplace
        .command(&["run", "real.toml", "--realtime", "--duration", "600"])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the command starts");
    wait_until("a force", || service.force()[0].abs() > PUSHES_N);
    let begun = Instant::now();
    process.kill().expect("it runs");
    wait_until("no force", || service.force() == [0.0; 3]);
    println!("haply, -KILL: without force after {:.1} ms", begun.elapsed().as_secs_f64() * 1e3);
    let said = text(&process.wait_with_output().expect("a child").stderr);
    let expected = "guardian: palpate ended and left haply 049D with its force: forces are off, after ";
    assert!(said.lines().any(|line| line.starts_with(expected)), "{said}");
}
