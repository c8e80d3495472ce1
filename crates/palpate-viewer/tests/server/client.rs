//! Test client that acts as a page, and a test scene.

use glam::DVec3;
use palpate::{Coupling, DeviceParameters, Model, ModelObject, ModelParameters, Obstacle, Pose};
use palpate_haptics::{SceneMotion, Scheduling};
use palpate_testkit::{finger, floor, free_block, start_at};
use palpate_viewer::{
    JobControl, Limits, Live, MaterialDescription, ObjectDescription, OwnSettings, PhysicsSettings,
    SceneDescription, SceneError, SceneProvider, SceneSummary, ServedContent, Server, Settings, Upload,
    ViewerDevice, ViewerScene,
};
use serde_json::Value;
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// Scene: a body above a floor, with two pointers.
pub fn scene(gravity: DVec3, step_s: f64) -> ViewerScene {
    let recording = free_block();
    let radius = recording.surface.radius();
    let coupling = Some(Coupling { stiffness: 200.0, damping: 0.5 });
    let below = Pose { position: DVec3::Y * -5.0 * radius, ..Pose::IDENTITY };
    let parameters = ModelParameters {
        step_s,
        gravity,
        devices: vec![DeviceParameters { coupling, ..finger(0.1 * radius, 0.2 * radius, 0.5) }; 2],
        obstacles: vec![Obstacle { pose: below, ..floor(0.5) }],
        ..ModelParameters::for_reference()
    };
    let body = ModelObject::new(recording.clone(), start_at(DVec3::ZERO));
    let model = Model::new(parameters, vec![body]).expect("a model");
    let model = Arc::new(model);
    let object = ObjectDescription::new("body", &recording, vec!["a line".into()], true);
    let devices = [("left".to_string(), true), ("right".to_string(), true)];
    let titles = (Some("float".into()), "A body".into(), "It floats.".into());
    let mut description = SceneDescription::new(titles, &model, vec![object], &["floor".into()], &devices);
    description.own = Some(OwnSettings::of(&description));
    ViewerScene {
        description,
        model,
        devices: vec![ViewerDevice::Pointer; 2],
        motion: Arc::new(move || SceneMotion {
            obstacles: vec![Box::new(move |_| below)],
            ..SceneMotion::default()
        }),
        can_resume: true,
        log: None,
    }
}

/// Time after which a wait has failed: it bounds a failure, not a success.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Provider of one scene, and of recordings that fail; one of `slow.msh` does so only when its gate is opened, or it is cancelled.
struct OneScene {
    gate: Gate,
}

/// Interval at which a recording asks whether it is cancelled.
const CANCELLATION_POLL: Duration = Duration::from_millis(5);

/// Gate that a recording waits at until a test opens it, or is over.
type Gate = Arc<Mutex<Receiver<()>>>;

impl SceneProvider for OneScene {
    fn scenes(&self) -> Vec<SceneSummary> {
        vec![SceneSummary { id: "float".into(), title: "A body".into(), about: "It floats.".into() }]
    }

    fn open(&self, id: &str, job: JobControl) -> Result<ViewerScene, SceneError> {
        (job.report)("loading", Some(0.5));
        if id == "float" {
            Ok(scene(DVec3::ZERO, 1e-3))
        } else {
            Err(format!("there is no scene {id:?}").into())
        }
    }

    fn change_physics(&self, settings: &PhysicsSettings) -> Result<ViewerScene, SceneError> {
        let gravity = settings.gravity.map_or(DVec3::ZERO, DVec3::from_array);
        Ok(scene(gravity, settings.step.unwrap_or(1e-3)))
    }

    fn change_material(
        &self,
        _: usize,
        material: MaterialDescription,
        _: JobControl,
    ) -> Result<ViewerScene, SceneError> {
        Err(format!("E = {}", material.young).into())
    }

    fn record(&self, upload: Upload, job: JobControl) -> Result<ViewerScene, SceneError> {
        if upload.name == "slow.msh" {
            let gate = self.gate.lock().expect("no panic");
            // A test that has ended opens it as well.
            while gate.recv_timeout(CANCELLATION_POLL) == Err(RecvTimeoutError::Timeout) {
                if job.cancelled.load(Ordering::Acquire) {
                    return Err("interrupted".into());
                }
            }
        }
        Err(format!("{} bytes of {}", upload.bytes.len(), upload.name).into())
    }
}

/// Server on a free port that stops when dropped.
pub struct TestServer {
    pub address: SocketAddr,
    /// Lines for the terminal.
    pub notices: Arc<Mutex<Vec<String>>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl TestServer {
    pub fn live() -> Self {
        Self::live_with_gate().0
    }

    /// Server of the test scene with limits.
    pub fn limited(limits: Limits) -> Self {
        Self::bind(&Settings { limits, ..local() }, live_content().0)
    }

    /// Server, and what opens the gate of recordings of `slow.msh`.
    pub fn live_with_gate() -> (Self, Sender<()>) {
        let (content, open) = live_content();
        (Self::new(content), open)
    }

    pub fn new(content: ServedContent) -> Self {
        Self::bind(&local(), content)
    }

    pub fn bind(settings: &Settings, content: ServedContent) -> Self {
        let server = Server::bind(settings).expect("a free port");
        let address = server.address().expect("an address");
        let stop = Arc::new(AtomicBool::new(false));
        let stopped = stop.clone();
        let notices: Arc<Mutex<Vec<String>>> = Arc::default();
        let heard = notices.clone();
        let notify = move |line: &str| heard.lock().expect("no panic").push(line.into());
        let run = move || server.run(content, &stopped, &notify).expect("it runs");
        Self { address, notices, stop, thread: Some(std::thread::spawn(run)) }
    }

    /// Connection on which nothing was sent yet.
    pub fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(self.address).expect("it listens");
        stream.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
        stream
    }

    pub fn page(&self) -> Page {
        let address = format!("ws://{}/session", self.address);
        let (socket, _) = tungstenite::connect(address).expect("a session");
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(TIMEOUT)).expect("a timeout");
        }
        Page { socket }
    }

    /// HTTP status and body.
    pub fn request(&self, head: &str, body: &[u8]) -> (u16, Vec<u8>) {
        let (status, _, body) = self.answer(head, body);
        (status, body)
    }

    /// HTTP status, head and body.
    pub fn answer(&self, head: &str, body: &[u8]) -> (u16, String, Vec<u8>) {
        let mut stream = self.connect();
        let host = if head.contains("Host:") { String::new() } else { format!("Host: {}\r\n", self.address) };
        let length = body.len();
        write!(stream, "{head} HTTP/1.1\r\n{host}Content-Length: {length}\r\nConnection: close\r\n\r\n")
            .or_else(|_| Ok::<(), std::io::Error>(()))
            .expect("written or refused");
        let _ = stream.write_all(body);
        read_answer(&mut stream)
    }

    pub fn get(&self, path: &str) -> (u16, Vec<u8>) {
        self.request(&format!("GET {path}"), b"")
    }
}

impl Drop for TestServer {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Settings of a free port on loopback.
pub fn local() -> Settings {
    Settings::new((Ipv4Addr::LOCALHOST, 0).into())
}

/// Test scene, and what opens the gate of recordings of `slow.msh`.
pub fn live_content() -> (ServedContent, Sender<()>) {
    let (open, gate) = channel();
    let provider = Arc::new(OneScene { gate: Arc::new(Mutex::new(gate)) });
    let scheduling = Scheduling { priority: None, core: None };
    let first = scene(DVec3::ZERO, 1e-3);
    (ServedContent::Live(Box::new(Live { provider, first, scheduling })), open)
}

/// HTTP status, head and body; zeros if the connection is closed without an answer.
pub fn read_answer(stream: &mut TcpStream) -> (u16, String, Vec<u8>) {
    let mut answer = Vec::new();
    let _ = stream.read_to_end(&mut answer);
    let end = answer.windows(4).position(|four| four == b"\r\n\r\n").map_or(answer.len(), |at| at + 4);
    let head = String::from_utf8_lossy(&answer[..end]).into_owned();
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok());
    (status.unwrap_or(0), head, answer[end..].to_vec())
}

/// Decoded frame of the test scene.
#[derive(Debug, Clone)]
pub struct Frame {
    pub format: u32,
    pub generation: u32,
    pub step: u32,
    pub time_s: f64,
    pub position: DVec3,
    /// Positions of the surface nodes [m, body].
    pub positions: Vec<DVec3>,
    /// Mode, position [m] and force on the hand [N] of each device.
    pub devices: Vec<(u32, DVec3, DVec3)>,
    pub bytes: usize,
}

/// Little-endian reader.
struct Cursor<'a>(&'a [u8]);

impl Cursor<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (now, later) = self.0.split_at(N);
        self.0 = later;
        now.try_into().expect("enough bytes")
    }

    fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    /// Skips `count` numbers of four bytes.
    fn skip(&mut self, count: usize) {
        self.0 = &self.0[4 * count..];
    }

    fn f32(&mut self) -> f64 {
        f64::from(f32::from_le_bytes(self.take()))
    }

    fn vector(&mut self) -> DVec3 {
        DVec3::new(self.f32(), self.f32(), self.f32())
    }
}

/// Decoded mode shapes.
pub fn mode_shapes(bytes: &[u8]) -> Vec<Vec<DVec3>> {
    let mut cursor = Cursor(bytes);
    let (n, m) = (cursor.u32() as usize, cursor.u32() as usize);
    cursor.0 = &cursor.0[4 * m..];
    let half = |cursor: &mut Cursor| {
        let bits = u32::from(u16::from_le_bytes(cursor.take()));
        let (sign, exponent, fraction) = (bits >> 15, bits >> 10 & 31, bits & 1023);
        let value = match exponent {
            0 => f64::from(fraction) * 2.0_f64.powi(-24),
            _ => (1.0 + f64::from(fraction) / 1024.0) * 2.0_f64.powi(exponent as i32 - 15),
        };
        if sign == 1 { -value } else { value }
    };
    let node = |cursor: &mut Cursor| DVec3::new(half(cursor), half(cursor), half(cursor));
    (0..m).map(|_| (0..n).map(|_| node(&mut cursor)).collect()).collect()
}

pub fn decode_frame(bytes: &[u8], shapes: &[Vec<DVec3>]) -> Frame {
    let mut cursor = Cursor(bytes);
    assert_eq!(&cursor.take(), b"PLPF");
    let (format, generation, step) = (cursor.u32(), cursor.u32(), cursor.u32());
    let time_s = f64::from_le_bytes(cursor.take());
    cursor.skip(10);
    let counts: [u32; 4] = std::array::from_fn(|_| cursor.u32());
    assert_eq!(&counts[..3], [1, 1, 2]);
    cursor.skip(2);
    let position = cursor.vector();
    cursor.skip(4);
    let mut positions = free_block().surface.positions.clone();
    let count = cursor.u32() as usize;
    if format == 1 {
        for shape in &shapes[..count] {
            let q = cursor.f32();
            positions.iter_mut().zip(shape).for_each(|(node, shape)| *node += *shape * q);
        }
        let (k, unit) = (cursor.u32() as usize, cursor.f32());
        let (differences, rest) = cursor.0.split_at((2 * k).next_multiple_of(4));
        let (values, rest) = rest.split_at((3 * k).next_multiple_of(4));
        let mut node = 0;
        for at in 0..k {
            node += usize::from(u16::from_le_bytes([differences[2 * at], differences[2 * at + 1]]));
            let axis = |axis: usize| f64::from(values[3 * at + axis] as i8) * unit;
            positions[node] += DVec3::new(axis(0), axis(1), axis(2));
        }
        cursor.0 = rest;
    } else {
        positions.iter_mut().take(count).for_each(|node| *node = cursor.vector());
    }
    cursor.skip(7);
    let device = |cursor: &mut Cursor| {
        let (mode, position) = (cursor.u32(), cursor.vector());
        cursor.vector();
        (mode, position, cursor.vector())
    };
    let devices = (0..2).map(|_| device(&mut cursor)).collect();
    assert_eq!(cursor.0.len(), counts[3] as usize * 32, "contacts");
    Frame { format, generation, step, time_s, position, positions, devices, bytes: bytes.len() }
}

/// WebSocket session.
pub struct Page {
    pub socket: WebSocket<MaybeTlsStream<TcpStream>>,
}

impl Page {
    pub fn send(&mut self, text: &str) {
        let _ = self.socket.send(Message::text(text.to_string()));
    }

    /// Next message of a type.
    pub fn wait(&mut self, kind: &str) -> Value {
        let until = Instant::now() + TIMEOUT;
        while Instant::now() < until {
            if let Message::Text(text) = self.socket.read().expect("a message") {
                let value: Value = serde_json::from_str(&text).expect("JSON");
                if value["type"] == kind {
                    return value;
                }
            }
        }
        panic!("no {kind} within {TIMEOUT:?}");
    }

    /// Next block of sound, within a number of messages: generation, sample rate and samples.
    pub fn sound(&mut self, messages: usize) -> Option<(u32, u32, Vec<f32>)> {
        for _ in 0..messages {
            let Message::Binary(bytes) = self.socket.read().expect("a message") else { continue };
            let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes"));
            if number(0) != 0x5350_4c50 {
                continue;
            }
            let samples = bytes[16..].chunks_exact(4);
            let samples: Vec<f32> =
                samples.map(|four| f32::from_le_bytes(four.try_into().expect("four bytes"))).collect();
            assert_eq!(samples.len(), number(12) as usize);
            return Some((number(4), number(8), samples));
        }
        None
    }

    /// Next frame that satisfies a condition.
    pub fn frame(&mut self, shapes: &[Vec<DVec3>], mut condition: impl FnMut(&Frame) -> bool) -> Frame {
        let until = Instant::now() + TIMEOUT;
        while Instant::now() < until {
            if let Message::Binary(bytes) = self.socket.read().expect("a message") {
                let frame = decode_frame(&bytes, shapes);
                if condition(&frame) {
                    return frame;
                }
            }
        }
        panic!("no such frame within {TIMEOUT:?}");
    }
}
