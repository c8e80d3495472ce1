//! Real devices, against a stand-in for Force Dimension's library: nothing else is there.

#[path = "../../../palpate-haptics/tests/standins/compile.rs"]
pub mod compile;

use crate::workplace::Workplace;

/// A folder whose programs find no vendor's software.
fn bare() -> Workplace {
    let mut workplace = Workplace::with_scene();
    workplace.set("PALPATE_LIBHD", "/nowhere/libHD.so");
    workplace.set("PALPATE_LIBDHD", "/nowhere/libdhd.so");
    workplace.set("PALPATE_HAPLY", "127.0.0.1:1");
    workplace
}

/// Workplace with a stand-in for one vendor's device.
fn with_device() -> Workplace {
    let mut workplace = bare();
    let library = compile::compile("libdhd", &workplace.path(""));
    workplace.set("PALPATE_LIBDHD", library.to_str().expect("a path in UTF-8"));
    workplace
}

/// The scene of `Workplace::with_scene` with another hand on the left, which may be pulled to where it wants to be.
fn scene(workplace: &Workplace, hand: &str) -> String {
    let coupling = "coupling = { stiffness = 200.0, damping = 0.5 }";
    workplace.text("scene.toml").replace("path = { file = \"left.csv\" }", &format!("{hand}\n{coupling}"))
}

#[test]
fn devices_are_listed_and_so_is_why_there_are_none() {
    let workplace = bare();
    let text = workplace.succeed(&["devices"]);
    for part in [
        "openhaptics  none: no library could be loaded as /nowhere/libHD.so (",
        "install 3D Systems' OpenHaptics and the driver of the device, or name the library's file in the environment variable \
         PALPATE_LIBHD\n",
        "dhd          none: no library could be loaded as /nowhere/libdhd.so (",
        "haply        none: no Inverse Service at 127.0.0.1:1 (",
        "simulated    touch, 3.3 N\n",
        "simulated    inverse3, 10 N\n",
    ] {
        assert!(text.contains(part), "{part}: {text}");
    }
    let workplace = with_device();
    assert!(workplace.succeed(&["devices"]).contains("\ndhd          0: omega.3 (301)\n"));
    let all = workplace.json(&["devices", "--json"]);
    let [openhaptics, dhd] = [0, 1].map(|at| &all["drivers"][at]);
    assert_eq!(
        (&openhaptics["driver"], &openhaptics["devices"]),
        (&"openhaptics".into(), &serde_json::json!([]))
    );
    assert!(openhaptics["why_not"].as_str().is_some_and(|why| why.starts_with("openhaptics: no library")));
    assert_eq!(dhd["devices"][0]["serial"], "301");
    assert_eq!((&dhd["why_not"], &dhd["variable"]), (&serde_json::Value::Null, &"PALPATE_LIBDHD".into()));
    assert_eq!(all["simulated"][1]["name"], "omega.3");
}

#[test]
fn a_scene_with_a_real_device_pulls_its_hand_and_repeats_without_it() {
    let workplace = with_device();
    // The device stays at its origin, which is 5 mm to the left of the point that it holds.
    let hand = "driver = { kind = \"dhd\", which = \"301\", armed = true, force = 0.4 }\n\
                mount = { position = [-0.055, 0.0, 0.0], orientation = [0.0, 0.0, 1.0, 0.0], scale = 2.0 }";
    workplace.write("real.toml", scene(&workplace, hand));
    let run = ["run", "real.toml", "--realtime", "--duration", "1", "--log", "run.mcap", "--json"];
    let report = workplace.json(&run);
    let device = &report["devices"][0];
    assert_eq!(
        (&device["kind"], &device["failed"], &device["failure"]),
        (&"dhd".into(), &0.into(), &serde_json::Value::Null)
    );
    let force = device["force_max_n"].as_f64().expect("a number");
    assert!((force - 0.4).abs() < 1e-6, "as much as it may: {force}");
    let unarmed = hand.replace("armed = true, ", "");
    workplace.write("unarmed.toml", scene(&workplace, &unarmed));
    let report = workplace.json(&["run", "unarmed.toml", "--realtime", "--duration", "0.3", "--json"]);
    assert_eq!(report["devices"][0]["force_max_n"], 0.0, "nobody has pressed a button");
    // A log needs no device.
    let elsewhere = bare();
    elsewhere.write("run.mcap", workplace.read("run.mcap"));
    assert!(elsewhere.succeed(&["replay", "run.mcap"]).contains("bit for bit"));
}

#[test]
fn a_real_device_comes_over_a_link() {
    let workplace = with_device();
    workplace.write("linked.toml", scene(&workplace, "linked = true"));
    let address = std::net::UdpSocket::bind("127.0.0.1:0").and_then(|socket| socket.local_addr());
    let address = address.expect("a free port").to_string();
    let run = ["run", "linked.toml", "--realtime", "--duration", "4", "--json", "--listen", &address];
    let device = [
        "device",
        "left",
        "--driver",
        "dhd",
        "--mount-position",
        "-0.055,0,0",
        "--armed",
        "--connect",
        &address,
    ];
    let more = ["--duration", "1.5", "--json"];
    let (scene, hand) = std::thread::scope(|scope| {
        let scene = scope.spawn(|| workplace.json(&run));
        let hand = workplace.json(&[&device[..], &more].concat());
        (scene.join().expect("no panic"), hand)
    });
    assert_eq!((&hand["kind"], &hand["failed"]), (&"dhd".into(), &0.into()), "{hand:#}");
    assert!(hand["force_max_n"].as_f64() > Some(0.1), "{hand:#}");
    assert!(scene["links"]["motions"].as_u64() > Some(100), "{scene:#}");
}

#[test]
fn what_a_real_device_can_not_be_is_refused_in_words() {
    let workplace = bare();
    let cases = [
        (
            &["device", "left", "--driver", "phantom"][..],
            "--driver is \"phantom\", expected one of \"openhaptics\", \"dhd\", \"haply\"",
        ),
        (&["device", "left", "--driver", "dhd"], "dhd: no library could be loaded as /nowhere/libdhd.so ("),
        (&["device", "left", "--driver", "haply"], "haply: no Inverse Service at 127.0.0.1:1 ("),
        (
            &["device", "left", "--driver", "dhd", "--mount-position", "-1,2"],
            "--mount-position is [-1.0, 2.0], expected x,y,z in metres",
        ),
        (
            &["device", "left", "--driver", "dhd", "--mount-orientation", "1,1,0,0"],
            "--mount-orientation: orientation has length 1.414",
        ),
        (
            &["device", "left", "--driver", "dhd", "--mount-scale", "0"],
            "--mount-scale is 0, expected above 0",
        ),
        (
            &["device", "left", "--driver", "dhd", "--force", "-1"],
            "--force is -1 N, expected above 0 and below 100",
        ),
    ];
    let options =
        [&["--armed"][..], &["--which", "0"], &["--mount-position", "0,0,0"], &["--mount-scale", "1"]];
    for option in options {
        let error = workplace.fail(&[&["device", "left", "--path", "left.csv"], option].concat());
        assert_eq!(error, format!("{} is of a real device: name its --driver", option[0]));
    }
    for (arguments, expected) in cases {
        let error = workplace.fail(arguments);
        assert!(error.starts_with(expected), "{arguments:?}: {error}");
    }
    for arguments in [&["device", "left"][..], &["device", "left", "--path", "left.csv", "--driver", "dhd"]] {
        assert_eq!(workplace.palpate(arguments).status.code(), Some(2), "{arguments:?}");
    }
    let path = "path = { file = \"left.csv\" }";
    let driver = "driver = { kind = \"dhd\" }";
    for (hand, expected) in [
        (
            "driver = { kind = \"phantom\" }",
            "line 12: driver is \"phantom\", expected one of \"openhaptics\", \"dhd\", \"haply\"",
        ),
        (
            "driver = { kind = \"dhd\", id = -1 }",
            "line 12: id is neither a number from 0 nor a name in quotes",
        ),
        (
            "driver = { kind = \"dhd\", max_force = 0.0 }",
            "line 12: max_force is 0 N, expected above 0 and below 1e2",
        ),
        ("driver = { kind = \"dhd\" }\nmount = { scale = 0.0 }", "line 13: scale is 0, expected above 0"),
        (
            "driver = { kind = \"dhd\" }\nmount = { orientation = [2.0, 0.0, 0.0, 0.0] }",
            "line 13: orientation has length 2",
        ),
        (
            &format!("{path}\n{driver}"),
            "line 13: a real device is where its hand is: leave path, simulated and linked out",
        ),
        (&format!("linked = true\n{driver}"), "line 13: a real device is where its hand is"),
        (&format!("{path}\nmount = {{ scale = 2.0 }}"), "line 13: mount is of a real device"),
        (driver, "dhd: no library could be loaded as /nowhere/libdhd.so ("),
    ] {
        workplace.write("wrong.toml", scene(&workplace, hand));
        let error = workplace.fail(&["run", "wrong.toml", "--realtime", "--duration", "0.1"]);
        assert!(error.contains(expected), "{expected}: {error}");
    }
    let error = workplace.fail(&["run", "wrong.toml"]);
    assert_eq!(error, "the device \"left\" is held by a real hand, which lives in real time: add --realtime");
}
