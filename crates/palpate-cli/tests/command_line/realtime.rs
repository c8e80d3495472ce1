//! Runs in real time, their logs, and replays. No test here looks at how fast anything was.

use crate::workplace::{Table, Workplace};
use palpate_testkit::wait_until;
use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Stdio};

/// Two fingers on the cube of `Workplace::with_scene`, which lies on a floor; the right one in a simulated hand.
pub fn workplace() -> Workplace {
    let workplace = Workplace::with_scene();
    let finger = |name: &str, more: &str| {
        format!(
            "[[device]]\nname = \"{name}\"\nmode = \"touch\"\ntip_radius = 0.005\nfriction = 0.6\n\
             coupling = {{ stiffness = 200.0, damping = 0.5 }}\npath = {{ file = \"{name}_finger.csv\" }}\n{more}"
        )
    };
    let scene = [
        "step = 0.002\ngravity = { file = \"gravity.csv\" }\nmost_places = 8\n".to_string(),
        "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nposition = [0.0, 0.0, 0.0501]\n".to_string(),
        "[[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 0.0, 1.0]\n".to_string(),
        finger("left", ""),
        finger("right", "simulated = { device = \"touch\", grip = \"light\" }\n"),
    ];
    workplace.write("gravity.csv", "0,0,0,-9.81\n0.5,2,0,-9\n");
    workplace.write("fingers.toml", scene.concat());
    for (name, side) in [("left", -1.0), ("right", 1.0)] {
        let path = format!("0,{},0,0.05\n0.2,{},0,0.05\n", side * 0.058, side * 0.053);
        workplace.write(&format!("{name}_finger.csv"), path);
    }
    workplace
}

#[test]
fn a_log_of_a_run_in_real_time_repeats_bit_for_bit_anywhere() {
    let workplace = workplace();
    let run = ["run", "fingers.toml", "--realtime", "--duration", "0.6", "--log", "run.mcap", "--json"];
    let report = workplace.json(&run);
    assert_eq!(report["steps"], 300);
    assert_eq!(report["max_contact_samples"], 8);
    assert_eq!(report["log"]["steps"], 300);
    assert_eq!(report["force_process"]["cycles"], 300);
    assert!(report["deformation_process"]["cycles"].as_u64() > Some(3), "{report:#}");
    assert_eq!(
        (&report["devices"][0]["kind"], &report["devices"][1]["kind"]),
        (&"path".into(), &"touch".into())
    );
    assert!(report["devices"][1]["updates"].as_u64() > Some(100), "{report:#}");
    assert!(report["granted"].as_str().is_some_and(|text| text.contains("memory")), "{report:#}");

    // The log needs nothing else.
    let elsewhere = Workplace::new();
    elsewhere.write("run.mcap", workplace.read("run.mcap"));
    let replay = ["replay", "run.mcap", "--csv", "steps.csv", "--contacts", "contacts.csv", "--json"];
    let summary = elsewhere.json(&replay);
    assert_eq!(
        (&summary["replayed"]["steps"], &summary["replayed"]["identical"]),
        (&300.into(), &true.into())
    );
    let steps = Table::parse(&elsewhere.text("steps.csv"));
    assert_eq!(steps.len(), 300);
    assert!(steps.column("left.fx").iter().any(|force| *force < -1e-3), "the left finger feels the cube");
    assert!(elsewhere.text("contacts.csv").contains("cube,floor,"));
    assert_eq!(elsewhere.files(), ["contacts.csv", "run.mcap", "steps.csv"], "and leaves nothing behind");
    assert_eq!(elsewhere.fail(&["replay", "run.mcap", "--runs", "0"]), "--runs is 0, expected 1 or more");
    let text = elsewhere.succeed(&["replay", "run.mcap", "--runs", "3"]);
    assert!(text.starts_with("300 steps replayed: every number came out again, bit for bit\n"), "{text}");

    // Whatever byte of it is wrong, it says so or comes out the same, and never breaks.
    let bytes = workplace.read("run.mcap");
    for at in [40, bytes.len() / 3, bytes.len() / 2, bytes.len() - 30] {
        let mut wrong = bytes.clone();
        wrong[at] ^= 0x55;
        elsewhere.write("wrong.mcap", wrong);
        let code = elsewhere.palpate(&["replay", "wrong.mcap"]).status.code();
        assert!(matches!(code, Some(0 | 1)), "byte {at}: {code:?}");
    }
    elsewhere.write("half.mcap", &bytes[..bytes.len() / 2]);
    assert!(elsewhere.fail(&["replay", "half.mcap"]).starts_with("half.mcap: the log"));
}

#[test]
fn devices_in_other_processes_come_over_a_link() {
    let workplace = workplace();
    let text =
        workplace.text("fingers.toml").replace("path = { file = \"left_finger.csv\" }", "linked = true");
    workplace.write("linked.toml", &text);
    workplace.write("secret.txt", "a secret of this test\n");
    workplace.write("wrong.txt", "a secret of another test\n");
    let address = free_address();
    let run = [
        "run",
        "linked.toml",
        "--realtime",
        "--duration",
        "4",
        "--json",
        "--secret",
        "secret.txt",
        "--listen",
        &address,
    ];
    let device =
        ["device", "left", "--path", "left_finger.csv", "--connect", &address, "--duration", "1", "--json"];
    let (scene, finger) = std::thread::scope(|scope| {
        let scene = scope.spawn(|| workplace.json(&run));
        let finger = workplace.json(&[&device[..], &["--secret", "secret.txt"]].concat());
        let stranger = workplace.fail(&[&device[..], &["--secret", "wrong.txt"]].concat());
        assert_eq!(stranger, format!("{address} has another secret"));
        (scene.join().expect("no panic"), finger)
    });
    assert!(finger["force_max_n"].as_f64() > Some(1e-3), "it feels the cube: {finger:#}");
    assert!(finger["linked_s"].as_f64() > Some(0.3), "{finger:#}");
    assert_eq!(scene["devices"][0]["kind"], "link");
    assert!(scene["links"]["motions"].as_u64() > Some(100), "{scene:#}");
    assert!(scene["links"]["refused"].as_u64() > Some(0), "{scene:#}");
}

/// An address that is free now, and most likely a moment later.
fn free_address() -> String {
    let address = std::net::UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    address.expect("a free port").to_string()
}

/// The workplace with a scene `linked.toml`, whose left finger comes over a link.
fn linked_workplace(limits: &str) -> Workplace {
    let workplace = workplace();
    let linked = format!("linked = true\n{limits}");
    let text = workplace.text("fingers.toml").replace("path = { file = \"left_finger.csv\" }", &linked);
    workplace.write("linked.toml", text);
    workplace
}

#[test]
fn a_device_waits_for_a_name_that_is_taken_and_says_so() {
    let (workplace, address) = (linked_workplace(""), free_address());
    let run =
        ["run", "linked.toml", "--realtime", "--duration", "600", "--pictures", "0", "--listen", &address];
    let mut scene =
        workplace.command(&run).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("a scene");
    let device = ["device", "left", "--path", "left_finger.csv", "--connect", &address];
    let with = |more: &[&str]| {
        let mut command = workplace.command(&[&device[..], more].concat());
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("a device")
    };
    let line = |child: &mut Child| {
        let mut line = String::new();
        let stderr = child.stderr.as_mut().expect("standard error");
        BufReader::with_capacity(1, stderr).read_line(&mut line).expect("text");
        line
    };
    let linked = format!("linked to {address} as left\n");
    let mut first = with(&["--duration", "600"]);
    assert_eq!(line(&mut first), linked);
    let taken = "the device \"left\" is taken";
    assert_eq!(
        workplace.fail(&[&device[..], &["--wait", "0.5"]].concat()),
        format!("{taken}, also after 0.5 s (--wait)")
    );
    let mut second = with(&["--duration", "0.2", "--wait", "600"]);
    assert_eq!(line(&mut second), format!("{taken}: waiting for it\n"));
    first.kill().and_then(|()| first.wait()).expect("it runs");
    assert_eq!(line(&mut second), linked);
    assert_eq!(second.wait().expect("a child").code(), Some(0));
    scene.kill().and_then(|()| scene.wait()).expect("it runs");
}

#[test]
fn millimetres_over_a_link_are_refused_and_the_device_is_named() {
    for (limits, expected) in [
        ("", Some("within 2 m (limit range): is it in millimetres?")),
        ("limits = { range = 100.0, speed = 1000.0 }", None),
    ] {
        let (workplace, address) = (linked_workplace(limits), free_address());
        // On its way to the cube, of which it would be inside.
        workplace.write("mm.csv", "0,-58,0,50\n0.2,-53,0,50\n");
        let run = [
            "run",
            "linked.toml",
            "--realtime",
            "--duration",
            "3",
            "--json",
            "--pictures",
            "0",
            "--listen",
            &address,
        ];
        let device = ["device", "left", "--path", "mm.csv", "--connect", &address, "--duration", "1"];
        let report = std::thread::scope(|scope| {
            let scene = scope.spawn(|| workplace.json(&run));
            workplace.succeed(&device);
            scene.join().expect("no panic")
        });
        assert_eq!(report["unsolved_steps"], 0);
        let left = &report["devices"][0];
        assert_eq!(left["refused_motions"].as_u64() > Some(0), expected.is_some(), "{left:#}");
        let Some(expected) = expected else { continue };
        let warnings = report["warnings"].as_array().expect("warnings");
        let warning =
            warnings.iter().find(|warning| warning["kind"] == "refused_motions").expect("a warning");
        let message = warning["message"].as_str().expect("text");
        assert!(message.starts_with("the device \"left\": ") && message.ends_with(expected), "{message}");
        assert_eq!(warning["part"], "left");
    }
}

#[test]
fn the_paper_s_two_hands_run_in_real_time() {
    let workplace = Workplace::with_scene();
    let report = workplace.json(&[
        "run",
        "scene.toml",
        "--realtime",
        "--duration",
        "0.2",
        "--pictures",
        "0",
        "--json",
    ]);
    assert_eq!((&report["steps"], &report["max_contact_samples"]), (&200.into(), &48.into()));
    assert_eq!(report["deformation_process"]["cycles"], 0);
    assert!(report["devices"][0]["force_max_n"].as_f64() > Some(0.01), "{report:#}");
    let text = workplace.succeed(&["run", "scene.toml", "--realtime", "--duration", "0.05"]);
    for part in ["50 steps at 1000 Hz", "force: compute", "overruns", "left         path, "] {
        assert!(text.contains(part), "{part}: {text}");
    }
}

/// SIGTERM and SIGHUP end a run as Ctrl-C does, with its report and a whole log; a device would be left without force.
#[test]
fn signals_end_a_run_in_good_order() {
    let workplace = Workplace::with_scene();
    for signal in ["-INT", "-TERM", "-HUP"] {
        let log = format!("log{signal}.mcap");
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["run", "scene.toml", "--realtime", "--duration", "600", "--json", "--log", &log])
            .current_dir(workplace.path("."))
            .stdout(Stdio::piped())
            .spawn()
            .expect("the command starts");
        let part = format!("{log}.part");
        wait_until("the log has begun", || workplace.logged_steps(&part) > 50);
        let sent = Command::new("kill").args([signal, &child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        let mut report = String::new();
        child.stdout.take().expect("standard output").read_to_string(&mut report).expect("text");
        assert_eq!(child.wait().expect("a child").code(), Some(0), "{signal}");
        let report: serde_json::Value = serde_json::from_str(&report).expect("a report");
        assert!(report["steps"].as_u64() > Some(50), "{signal}: {report:#}");
        workplace.succeed(&["replay", &log]);
        assert!(!workplace.path(&part).exists(), "{:?}", workplace.files());
    }
}

#[test]
fn what_can_not_be_in_real_time_is_refused_in_words() {
    let workplace = workplace();
    let cases = [
        (&["run", "scene.toml", "--log", "a.mcap"][..], "--log is of a run in real time: add --realtime"),
        (
            &["run", "scene.toml", "--realtime", "--csv", "a.csv"],
            "--csv, --contacts, --vtu and --sound take time",
        ),
        (
            &["run", "scene.toml", "--realtime", "--device-rate", "0", "--log", "a.mcap"],
            "a device is to be updated at 0 Hz, expected 50 to 5000",
        ),
        (&["run", "scene.toml", "--realtime", "--pictures", "-1"], "--pictures is -1, expected 0 to 1000"),
        (&["run", "scene.toml", "--secret", "a.txt"], "--secret is of a run in real time: add --realtime"),
        (
            &["device", "left", "--path", "left.csv", "--connect", "127.0.0.1:1", "--wait", "0.2"],
            "no scene was found at 127.0.0.1:1 (",
        ),
        (&["device", "left", "--path", "none.csv"], "cannot read the path none.csv"),
        (&["device", "left", "--path", "left.csv", "--rate", "1"], "--rate is 1 Hz, expected 50 to 5000"),
        (
            &["device", "left", "--path", "left.csv", "--limit", "speed"],
            "--limit is \"speed\", expected NAME=VALUE, as speed=3",
        ),
        (
            &["device", "left", "--path", "left.csv", "--limit", "speed=-1"],
            "--limit: speed is -1 m/s, expected above 0 and at most 100",
        ),
        (
            &["device", "left", "--path", "left.csv", "--simulated", "phantom"],
            "device is \"phantom\", expected one of",
        ),
        (
            &["device", "left", "--path", "left.csv", "--connect", "192.0.2.1:7402"],
            "192.0.2.1 is reached from other machines: a link there needs a secret",
        ),
        (&["run", "fingers.toml"], "the device \"right\" is held by a simulated hand"),
        (
            &["run", "scene.toml", "--realtime", "--log", "cube.palp"],
            "cannot write cube.palp: it is one of the inputs",
        ),
        (&["replay", "none.mcap"], "cannot read the log none.mcap"),
        (&["replay", "cube.palp"], "cube.palp: the log can't be read"),
        (&["replay", "empty.mcap"], "empty.mcap: the log"),
    ];
    workplace.write("empty.mcap", "");
    for (arguments, expected) in cases {
        let error = workplace.fail(arguments);
        assert!(error.starts_with(expected), "{arguments:?}: {error}");
    }
    let text = workplace.text("fingers.toml");
    for (from, to, expected) in [
        (
            "\"touch\", grip",
            "\"phantom\", grip",
            "line 26: device is \"phantom\", expected one of \"touch\", \"omega.3\", \"inverse3\"",
        ),
        ("\"light\"", "\"iron\"", "line 26: grip is \"iron\", expected \"firm\", \"light\" or \"fingertip\""),
        (
            "path = { file = \"left_finger.csv\" }\n",
            "",
            "line 13: the device needs path = { file = \"…\" }, driver = { kind = \"…\" } if it is a real one, linked = true",
        ),
        (
            "simulated = {",
            "linked = true\nsimulated = {",
            "line 26: a linked device has its path, or its hand, in the process",
        ),
        (
            "path = { file = \"left_finger.csv\" }",
            "linked = true\nlimits = { slew = 1.0 }",
            "line 19: there is no limit \"slew\", only range, speed",
        ),
        (
            "path = { file = \"left_finger.csv\" }",
            "driver = { kind = \"dhd\" }\nlimits = { watchdog = 2.0 }",
            "line 19: watchdog is 2 s, expected above 0 and at most 1",
        ),
        (
            "path = { file = \"left_finger.csv\" }",
            "path = { file = \"left_finger.csv\" }\nlimits = { speed = 2.0 }",
            "line 19: limits are of a real device or a linked one: leave them out",
        ),
        ("step = 0.002", "step = 0.02", "the step is 0.02 s: in real time it is 0.0002 s to 0.01 s"),
    ] {
        workplace.write("wrong.toml", text.replace(from, to));
        let error = workplace.fail(&["run", "wrong.toml", "--realtime", "--duration", "0.1"]);
        assert!(error.contains(expected), "{error}");
    }
    let logs = ["a.mcap", "a.mcap.part"];
    assert!(!logs.iter().any(|log| workplace.path(log).exists()), "{:?}", workplace.files());
}
