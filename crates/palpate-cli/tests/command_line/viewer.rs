//! Scenes and logs in the browser, and pictures that a browser draws.

use crate::realtime;
use crate::workplace::Workplace;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};

/// `palpate serve` in a workplace, until it is interrupted.
struct Serving {
    child: Child,
    /// `127.0.0.1:PORT`.
    address: String,
}

impl Serving {
    fn new(workplace: &Workplace, arguments: &[&str]) -> Self {
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(["serve", "--no-browser", "--listen", "127.0.0.1:0"])
            .args(arguments)
            .current_dir(workplace.path("."))
            .env("XDG_CACHE_HOME", workplace.path("cache"))
            .stderr(Stdio::piped())
            .spawn()
            .expect("the command starts");
        let mut lines = BufReader::new(child.stderr.take().expect("standard error")).lines();
        let line = lines.find_map(|line| line.ok().filter(|line| line.starts_with("open http://")));
        let line = line.expect("it says where");
        let address = line.trim_start_matches("open http://").split('/').next().expect("an address");
        let address = address.to_string();
        // Whatever else it says must not fill the pipe.
        std::thread::spawn(move || lines.for_each(drop));
        Self { child, address }
    }

    fn get(&self, path: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address)
            .expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        (head.split(' ').nth(1).unwrap_or_default().to_string(), answer[end..].to_vec())
    }

    /// Its status after Ctrl-C.
    fn interrupt(mut self) -> Option<i32> {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        self.child.wait().expect("a child").code()
    }
}

#[test]
fn a_scene_is_served_with_pointers_of_its_own_until_it_is_interrupted() {
    let workplace = realtime::workplace();
    let serving = Serving::new(&workplace, &["fingers.toml"]);
    assert_eq!(serving.get("/").0, "200");
    let (status, surface) = serving.get("/scene/1/object/0/surface");
    let nodes = u32::from_le_bytes(surface[..4].try_into().expect("four bytes"));
    assert_eq!((status.as_str(), nodes > 50), ("200", true), "{nodes} nodes");
    assert_eq!(serving.get("/scene/1/object/1/surface").0, "404");
    // A second one finds the port taken.
    let address = serving.address.clone();
    let error = workplace.fail(&["serve", "fingers.toml", "--no-browser", "--listen", &address]);
    assert!(error.contains("something listens at"), "{error}");
    assert_eq!(serving.interrupt(), Some(0));
}

#[test]
fn pointers_are_of_pages_and_nobody_else() {
    let workplace = realtime::workplace();
    let text = workplace.text("fingers.toml");
    let path = "path = { file = \"left_finger.csv\" }\n";
    workplace.write("pointer.toml", text.replace(path, "pointer = true\n"));
    let pointer = "the device \"left\" is a pointer of the viewer: open the scene with palpate serve";
    assert_eq!(workplace.fail(&["run", "pointer.toml"]), pointer);
    assert_eq!(workplace.fail(&["run", "pointer.toml", "--realtime", "--duration", "0.1"]), pointer);
    assert_eq!(Serving::new(&workplace, &["pointer.toml"]).interrupt(), Some(0));
    for (more, expected) in [
        (
            "pointer = true\npath = { file = \"left_finger.csv\" }\n",
            "line 18: a pointer is where the viewer's page says",
        ),
        ("pointer = true\nlinked = true\n", "line 18: a pointer is where the viewer's page says"),
        (
            "pointer = true\nattach = { object = \"cube\", point = [0, 0, 0] }\n",
            "with mode = \"touch\" leave it out",
        ),
    ] {
        workplace.write("pointer.toml", text.replace(path, more));
        let error = workplace.fail(&["serve", "pointer.toml", "--no-browser"]);
        assert!(error.contains(expected), "{error}");
    }
    for (arguments, expected) in [
        (
            &["serve", "--scene", "nothing", "--no-browser"][..],
            "there is no scene \"nothing\"; there are bounce, shake",
        ),
        (&["serve", "fingers.toml", "fingers.toml"], "one scene is served at a time"),
        (&["serve", "nowhere.toml", "--no-browser"], "cannot read the scene nowhere.toml"),
        (&["serve", "nowhere.mcap", "--no-browser"], "cannot read the log nowhere.mcap"),
        (&["serve", "fingers.toml", "--listen", "0.0.0.0:0"], "give a token of 8 characters or more"),
    ] {
        let error = workplace.fail(arguments);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_log_is_shown_and_drawn_the_same_every_time() {
    let workplace = realtime::workplace();
    workplace.succeed(&["run", "fingers.toml", "--realtime", "--duration", "0.4", "--log", "run.mcap"]);
    let serving = Serving::new(&workplace, &["run.mcap", "run.mcap"]);
    let mut frames = Vec::new();
    while frames.is_empty() {
        frames = serving.get("/log/1/frames?from=20&count=1").1;
    }
    assert_eq!(&frames[4..8], b"PLPF");
    assert_eq!(serving.interrupt(), Some(0));

    for (arguments, expected) in [
        (&["--browser", "no-such-browser"][..], "the browser no-such-browser can't be started"),
        (&["--fps", "0", "--browser", "true"], "--fps is 0, expected above 0"),
        (&["--camera", "1,2,3", "--browser", "true"], "expected six numbers"),
        (&["--from", "3", "--browser", "true"], "the log goes from 0 to 0.374 s"),
        (&["--browser", "true"], "the browser has ended"),
    ] {
        let error = workplace.fail(&[&["render", "run.mcap", "-o", "wrong"], arguments].concat());
        assert!(error.contains(expected), "{arguments:?}: {error}");
    }
    // Without a browser, or built without the page, there is nothing that could draw: `cargo xtask test` has both.
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../../viewer/dist/index.html");
    let browser = Command::new("chromium").arg("--version").output().is_ok();
    if !(browser && std::path::Path::new(page).exists()) {
        eprintln!("no browser, or no page: nothing is drawn");
        return;
    }
    let drawn: Vec<Vec<Vec<u8>>> = ["first", "second"]
        .into_iter()
        .map(|folder| {
            let size = ["--width", "320", "--height", "200", "--fps", "10"];
            let render = ["render", "run.mcap", "-o", folder, "--gif", "run.gif", "--json"];
            let report = workplace.json(&[&render[..], &size[..]].concat());
            assert_eq!((&report["pictures"], &report["apart_s"]), (&5.into(), &0.1.into()));
            (0..5).map(|number| workplace.read(&format!("{folder}/frame_{number:05}.png"))).collect()
        })
        .collect();
    assert!(drawn[0] == drawn[1], "the same bytes");
    assert!(drawn[0][0] != drawn[0][4], "something moves");
    assert!(
        drawn[0].iter().all(|png| png.starts_with(b"\x89PNG") && png[16..24] == [0, 0, 1, 64, 0, 0, 0, 200])
    );
    assert!(workplace.read("run.gif").starts_with(b"GIF89a"));
}
