//! Scenes and logs in the browser, and pictures that a browser draws.

use crate::realtime;
use crate::workplace::{Table, Workplace, with_room};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::Duration;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// `palpate serve` in a workplace, until it is interrupted.
pub struct Serving {
    pub child: Child,
    /// `127.0.0.1:PORT`.
    address: String,
    /// Lines printed after that.
    said: JoinHandle<Vec<String>>,
}

impl Serving {
    pub fn new(workplace: &Workplace, arguments: &[&str]) -> Self {
        Self::start(Command::new(env!("CARGO_BIN_EXE_palpate")), workplace, arguments)
    }

    /// With room for so many blocks of 512 bytes in every file.
    pub fn with_room(blocks: u64, workplace: &Workplace, arguments: &[&str]) -> Self {
        Self::start(with_room(blocks), workplace, arguments)
    }

    fn start(mut command: Command, workplace: &Workplace, arguments: &[&str]) -> Self {
        let mut child = command
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
        let said = std::thread::spawn(move || lines.map_while(Result::ok).collect());
        Self { child, address, said }
    }

    pub fn get(&self, path: &str) -> (String, Vec<u8>) {
        let mut stream = TcpStream::connect(&self.address).expect("it listens");
        write!(stream, "GET {path} HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", self.address)
            .expect("it reads");
        let mut answer = Vec::new();
        stream.read_to_end(&mut answer).expect("an answer");
        let end = answer.windows(4).position(|four| four == b"\r\n\r\n").expect("a head") + 4;
        let head = String::from_utf8_lossy(&answer[..end]).into_owned();
        (head.split(' ').nth(1).unwrap_or_default().to_string(), answer[end..].to_vec())
    }

    /// A frame of the second of two logs, when it is made.
    fn frame_of_the_second_log(&self, number: u32) -> Vec<u8> {
        let path = format!("/log/1/frames?from={number}&count=1");
        std::iter::repeat_with(|| self.get(&path).1).find(|frame| !frame.is_empty()).expect("it repeats")
    }

    /// Its status after Ctrl-C.
    pub fn interrupt(self) -> Option<i32> {
        self.interrupted().0
    }

    /// Exit code after an interrupt, with the lines printed since it listens.
    pub fn interrupted(mut self) -> (Option<i32>, Vec<String>) {
        let sent = Command::new("kill").args(["-INT", &self.child.id().to_string()]).status();
        assert!(sent.is_ok_and(|status| status.success()));
        let code = self.child.wait().expect("a child").code();
        (code, self.said.join().expect("no panic"))
    }

    fn page(&self) -> Page {
        let (socket, _) = tungstenite::connect(format!("ws://{}/session", self.address)).expect("a session");
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(Duration::from_secs(20))).expect("a timeout");
        }
        Page(socket)
    }
}

/// A page without a browser.
struct Page(WebSocket<MaybeTlsStream<TcpStream>>);

/// Contents of a frame of a scene with one object and one obstacle.
struct Picture {
    generation: u32,
    step: u32,
    /// Force on the first device [N].
    force: f32,
}

impl Page {
    fn send(&mut self, text: &str) {
        self.0.send(Message::text(text)).expect("it hears");
    }

    /// Description of the scene.
    fn scene(&mut self) -> serde_json::Value {
        loop {
            let Message::Text(text) = self.0.read().expect("messages come") else { continue };
            let message: serde_json::Value = serde_json::from_str(&text).expect("JSON");
            if message["type"] == "scene" {
                return message;
            }
        }
    }

    /// Wait for a picture that is so.
    fn see(&mut self, is: impl Fn(&Picture) -> bool) {
        loop {
            match self.0.read().expect("pictures come") {
                Message::Binary(bytes) if is(&Picture::read(&bytes)) => return,
                Message::Text(text) => assert!(!text.contains(r#""type":"error""#), "{text}"),
                _ => {}
            }
        }
    }
}

impl Picture {
    /// As docs/viewer-protocol.md has it.
    fn read(bytes: &[u8]) -> Self {
        let u32_at = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
        let f32_at = |at: usize| f32::from_bits(u32_at(at));
        assert_eq!((u32_at(64), u32_at(68)), (1, 1), "objects and obstacles");
        let modes = 88 + 28;
        let residuals = modes + 4 + 4 * u32_at(modes) as usize;
        let k = u32_at(residuals) as usize;
        let obstacle = residuals + 8 + (2 * k).next_multiple_of(4) + (3 * k).next_multiple_of(4);
        let force = obstacle + 28 + 4 + 24;
        let force = [0, 4, 8].map(|part| f32_at(force + part));
        Self {
            generation: u32_at(8),
            step: u32_at(12),
            force: force.iter().map(|part| part * part).sum::<f32>().sqrt(),
        }
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
        (
            &["serve", "nowhere.mcap", "--log", "a.mcap"],
            "--log is of a scene that runs, and nowhere.mcap is a log already: leave it out",
        ),
        (&["serve", "fingers.toml", "--log", "no/a.mcap"], "cannot write no/a.mcap: there is no folder no"),
        (
            &["serve", "fingers.toml", "--no-browser", "--listen", "127.0.0.1:0", "--log", "cube.palp"],
            "cannot write cube.palp: it is one of the inputs",
        ),
        (&["demo", "--no-serve", "--log", "a.mcap"], "--log is of the viewer, which is not opened here"),
    ] {
        let error = workplace.fail(arguments);
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn a_page_gets_the_warnings_of_its_scene() {
    let workplace = realtime::workplace();
    let text = workplace.text("fingers.toml");
    workplace.write("good.toml", &text);
    workplace
        .write("sunk.toml", text.replace("position = [0.0, 0.0, 0.0501]", "position = [0.0, 0.0, 0.048]"));
    for (scene, expected) in [("good.toml", 0), ("sunk.toml", 1)] {
        let serving = Serving::new(&workplace, &[scene]);
        let warnings = serving.page().scene()["warnings"].clone();
        let about_floor = |line: &&serde_json::Value| {
            line.as_str().is_some_and(|line| line.contains("begins 2.00 mm inside \"floor\""))
        };
        let found = warnings.as_array().expect("a list").iter().filter(about_floor).count();
        assert_eq!(found, expected, "{scene}: {warnings}");
        assert_eq!(serving.interrupt(), Some(0));
    }
}

#[test]
fn what_is_done_with_a_pointer_is_logged_and_every_scene_is_a_log_of_its_own() {
    let workplace = realtime::workplace();
    let text = workplace.text("fingers.toml");
    let (text, _) = text.split_once("[[device]]").expect("devices");
    // Constant gravity: a scene whose gravity changes in time begins anew with other settings.
    workplace.write("cube.toml", text.replace("{ file = \"gravity.csv\" }", "[0.0, 0.0, -9.81]"));
    workplace.write("run-2.mcap", "of somebody else");
    let serving = Serving::new(&workplace, &["cube.toml", "--log", "run.mcap"]);
    let mut page = serving.page();
    page.see(|picture| picture.step > 20);
    page.send(r#"{"type":"press","pointer":1,"mode":"touch","position":[-0.09,0.001,0.05]}"#);
    page.send(r#"{"type":"move","pointers":[{"pointer":1,"position":[-0.045,0.001,0.05]}]}"#);
    page.see(|picture| picture.force > 0.02);
    assert!(!workplace.path("run.mcap").exists(), "it is hidden until it is whole");
    page.send(r#"{"type":"set_physics","friction":0.1}"#);
    page.see(|picture| picture.generation == 2 && picture.step > 20);
    page.send(r#"{"type":"reset"}"#);
    page.see(|picture| picture.generation == 3 && picture.step > 20);
    let (code, said) = serving.interrupted();
    assert_eq!(code, Some(0), "{said:?}");
    let logs = ["run.mcap", "run-3.mcap", "run-4.mcap"];
    assert!(said.iter().zip(logs).all(|(line, log)| line.starts_with(&format!("log {log}: "))), "{said:?}");
    assert_eq!((said.len(), workplace.text("run-2.mcap").as_str()), (3, "of somebody else"));
    assert!(!workplace.files().iter().any(|name| name.ends_with(".tmp")), "{:?}", workplace.files());

    // They need nothing else.
    let elsewhere = Workplace::new();
    let mut ends = Vec::new();
    for log in logs {
        elsewhere.write(log, workplace.read(log));
        let summary = elsewhere.json(&["replay", log, "--csv", "steps.csv", "--json"]);
        assert_eq!(summary["replayed"]["identical"], true, "{summary:#}");
        let steps = Table::parse(&elsewhere.text("steps.csv"));
        assert!(steps.len() > 20 && summary["replayed"]["steps"] == steps.len(), "{summary:#}");
        let least = |column: &str| steps.column(column).into_iter().fold(f64::INFINITY, f64::min);
        let forces = steps.column("finger1.fx");
        if log == "run.mcap" {
            assert!(forces.iter().any(|force| *force < -0.02), "the finger feels the cube");
            assert!(least("finger1.x") < -0.08, "and comes from the left");
        } else {
            assert!(forces.iter().all(|force| *force == 0.0), "it is away in {log}");
        }
        let places = steps.column("cube.px");
        ends.push((places[0], places[places.len() - 1]));
    }
    // The second goes on where the first has ended, and the third begins anew.
    assert!((ends[1].0 - ends[0].1).abs() < 1e-3 && ends[0].1 > 1e-4, "{ends:?}");
    assert!(ends[2].0.abs() < 1e-6, "{ends:?}");
    elsewhere.succeed(&["export", "run-3.mcap", "--gltf", "run.glb", "--vtu", "frames"]);
    let glb = elsewhere.read("run.glb");
    assert!(String::from_utf8_lossy(&glb).contains("\"scale\":[0.0,0.0,0.0]"), "fingers that are away");
    let serving = Serving::new(&elsewhere, &["run.mcap", "run-3.mcap"]);
    assert_eq!(&serving.frame_of_the_second_log(1)[4..8], b"PLPF");
    assert_eq!(serving.interrupt(), Some(0));
}

#[test]
fn a_log_is_shown_and_drawn_the_same_every_time() {
    let workplace = realtime::workplace();
    workplace.succeed(&["run", "fingers.toml", "--realtime", "--duration", "0.4", "--log", "run.mcap"]);
    let serving = Serving::new(&workplace, &["run.mcap", "run.mcap"]);
    assert_eq!(&serving.frame_of_the_second_log(20)[4..8], b"PLPF");
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
