//! Haply devices by the Inverse Service, over its WebSocket.
//!
//! Its frame has x to the right, y forward and z up, in metres and newtons: ours from its is (x, z, −y). The service sends what
//! there is when one connects, and then one state for each message that it gets. A thread of its own talks to it, at most once in
//! [`PERIOD`]: it sends the newest force and keeps the state that comes back, and the haptic update meets it in an
//! [`exchange`](super::exchange), so that it never waits for a socket. When the service goes away the thread looks for it until
//! it is back.

use super::driver::{Found, pick};
use super::exchange::{DriverEnd, SILENCE, UpdateEnd, exchange};
use super::{Device, Reading, Traits, quaternion_turned};
use crate::error::Error;
use crate::safety::SafetyLimits;
use glam::DVec3;
use serde::Deserialize;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket, client::client_with_config};

/// The environment variable with the service's address.
pub(super) const VARIABLE: &str = "PALPATE_HAPLY";

/// Where the service is by itself.
const USUAL: &str = "localhost:10001";

/// What the service's own programs show of this one.
const PROFILE: &str = "palpate:device";

/// Between two messages, at least.
const PERIOD: Duration = Duration::from_micros(500);

/// A service that is there takes no longer to be connected to.
const PATIENCE: Duration = Duration::from_millis(500);

/// Nor to answer a message.
const ANSWER: Duration = Duration::from_millis(100);

/// Between two attempts to find it again.
const AGAIN: Duration = Duration::from_millis(200);

/// No state is longer [bytes].
const LONGEST: usize = 1 << 20;

type Socket = WebSocket<TcpStream>;

/// What the service sends, as far as it is used.
#[derive(Deserialize)]
struct State {
    #[serde(default)]
    inverse3: Vec<Inverse3>,
    #[serde(default)]
    verse_grip: Vec<Grip>,
    #[serde(default)]
    wireless_verse_grip: Vec<Grip>,
}

#[derive(Deserialize)]
struct Inverse3 {
    device_id: String,
    config: Option<Config>,
    state: Option<Cursor>,
}

#[derive(Deserialize)]
struct Config {
    #[serde(rename = "type")]
    kind: Option<String>,
    basis: Option<Basis>,
}

#[derive(Deserialize)]
struct Basis {
    permutation: String,
}

#[derive(Deserialize)]
struct Cursor {
    cursor_position: Option<Vector>,
}

#[derive(Deserialize)]
struct Vector {
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize)]
struct Grip {
    state: Option<GripState>,
}

#[derive(Deserialize)]
struct GripState {
    orientation: Option<Quaternion>,
    #[serde(default)]
    button: bool,
    #[serde(default)]
    buttons: Buttons,
}

#[derive(Deserialize)]
struct Quaternion {
    w: f64,
    x: f64,
    y: f64,
    z: f64,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct Buttons {
    a: bool,
    b: bool,
    c: bool,
}

/// An open device.
pub(super) struct Haply {
    end: UpdateEnd,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    traits: Traits,
}

/// What the haptic update and the thread share.
struct Shared {
    ending: AtomicBool,
    /// Why there is no state.
    trouble: Mutex<String>,
}

/// The thread.
struct Talk {
    address: String,
    device: String,
    end: DriverEnd,
    shared: Arc<Shared>,
}

/// What is there.
pub(super) fn find(place: Option<&str>) -> Result<Vec<Found>, Error> {
    let (_, state) = connect(&address(place)).map_err(Error::Device)?;
    found(&state)
}

/// Open one.
pub(super) fn open(which: &str, place: Option<&str>) -> Result<(Found, Haply), Error> {
    let address = address(place);
    let (socket, state) = connect(&address).map_err(Error::Device)?;
    let found = pick("haply", &found(&state)?, which)?.clone();
    if let Some(why) = &found.why_not {
        return Err(Error::Device(format!("haply: {found} can't be had: {why}")));
    }
    let known = found.name.starts_with("inverse3");
    let force_n = if known { Traits::INVERSE_3.force_n } else { SafetyLimits::default().force_n };
    let (end, driver) = exchange();
    let trouble = Mutex::new("nothing has come yet".to_string());
    let shared = Arc::new(Shared { ending: AtomicBool::new(false), trouble });
    let device = found.serial.clone().unwrap_or_default();
    let talk = Talk { address, device, end: driver, shared: shared.clone() };
    let thread = std::thread::Builder::new().name("palpate haply".into());
    let thread = thread
        .spawn(move || talk.run(socket))
        .map_err(|e| Error::Thread(format!("cannot start a thread for the Inverse Service: {e}")))?;
    let traits = Traits { kind: "haply", force_n, ..Traits::INVERSE_3 };
    Ok((found, Haply { end, shared, thread: Some(thread), traits }))
}

/// Host and port, whichever way they are written.
fn address(place: Option<&str>) -> String {
    let place = place.unwrap_or(USUAL).trim_start_matches("ws://").trim_end_matches('/');
    if place.contains(':') { place.to_string() } else { format!("{place}:10001") }
}

/// Connect; gives what there is.
fn connect(address: &str) -> Result<(Socket, State), String> {
    let failed = |why: &dyn std::fmt::Display| {
        format!(
            "haply: no Inverse Service at {address} ({why}): install and start Haply's Inverse Service (3.5 or later), or give \
             its address in the environment variable {VARIABLE}"
        )
    };
    let mut why = "no such host".to_string();
    for resolved in address.to_socket_addrs().map_err(|e| failed(&e))? {
        match TcpStream::connect_timeout(&resolved, PATIENCE) {
            Ok(stream) => return greet(stream, address).map_err(|why| failed(&why)),
            Err(error) => why = error.to_string(),
        }
    }
    Err(failed(&why))
}

fn greet(stream: TcpStream, address: &str) -> Result<(Socket, State), String> {
    let text = |e: std::io::Error| e.to_string();
    stream.set_nodelay(true).map_err(text)?;
    stream.set_read_timeout(Some(PATIENCE)).map_err(text)?;
    stream.set_write_timeout(Some(ANSWER)).map_err(text)?;
    let config = WebSocketConfig::default().max_message_size(Some(LONGEST)).max_frame_size(Some(LONGEST));
    let (mut socket, _) = client_with_config(format!("ws://{address}/"), stream, Some(config))
        .map_err(|e| format!("it does not speak WebSocket: {e}"))?;
    let state = receive(&mut socket)?;
    let state = serde_json::from_str(&state).map_err(|e| format!("it sends no inventory: {e}"))?;
    socket.get_ref().set_read_timeout(Some(ANSWER)).map_err(text)?;
    Ok((socket, state))
}

/// The next text.
fn receive(socket: &mut Socket) -> Result<String, String> {
    loop {
        match socket.read() {
            Ok(Message::Text(text)) => return Ok(text.as_str().to_string()),
            Ok(Message::Close(_)) => return Err("it has closed the connection".into()),
            Ok(_) => {}
            Err(error) => return Err(error.to_string()),
        }
    }
}

/// The devices of an inventory.
fn found(state: &State) -> Result<Vec<Found>, Error> {
    if state.inverse3.is_empty() {
        return Err(Error::Device(
            "haply: the Inverse Service has no Inverse3: connect one, and look at Haply Hub".into(),
        ));
    }
    let one = |(index, device): (usize, &Inverse3)| {
        let config = device.config.as_ref();
        let kind = config.and_then(|config| config.kind.clone());
        let basis = config.and_then(|config| config.basis.as_ref()).map(|basis| basis.permutation.as_str());
        let why_not = basis.filter(|basis| *basis != "XYZ").map(|basis| {
            format!("the service turns its axes to {basis}: set its basis to XYZ in Haply Hub, and turn the mount here")
        });
        let name = kind.unwrap_or_else(|| "inverse3".into());
        Found { name, index, serial: Some(device.device_id.clone()), force_n: None, why_not }
    };
    Ok(state.inverse3.iter().enumerate().map(one).collect())
}

/// The same place, or axis, in our frame.
fn ours_from_haply(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y)
}

/// And back.
fn haply_from_ours(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

impl State {
    /// What is told of a device: its position, and the grip of the same place in the list, a wireless one first.
    fn reading(&self, device: &str) -> Option<Reading> {
        let at = self.inverse3.iter().position(|one| one.device_id == device)?;
        let Vector { x, y, z } = self.inverse3[at].state.as_ref()?.cursor_position.as_ref()?;
        let grip = self.wireless_verse_grip.get(at).or_else(|| self.verse_grip.get(at));
        let grip = grip.and_then(|grip| grip.state.as_ref());
        let turned = |q: &Quaternion| quaternion_turned(DVec3::new(q.x, q.y, q.z), q.w, ours_from_haply);
        Some(Reading {
            position: ours_from_haply(DVec3::new(*x, *y, *z)),
            orientation: grip.and_then(|grip| grip.orientation.as_ref()).and_then(turned),
            buttons: grip.map_or(0, |grip| {
                let Buttons { a, b, c } = grip.buttons;
                u32::from(a || grip.button) | u32::from(b) << 1 | u32::from(c) << 2
            }),
        })
    }
}

impl Talk {
    /// Talk to the service, and look for it when it goes away, until the device is left.
    fn run(mut self, socket: Socket) {
        let mut socket = Some(socket);
        while !self.ending() {
            let why = match socket.take().map_or_else(|| self.come_back(), Ok) {
                Ok(mut socket) => self.talk(&mut socket),
                Err(why) => Some(why),
            };
            let Some(why) = why else { return };
            *self.shared.trouble.lock().unwrap_or_else(PoisonError::into_inner) = why;
            std::thread::sleep(AGAIN);
        }
    }

    fn ending(&self) -> bool {
        self.shared.ending.load(Ordering::Acquire)
    }

    fn come_back(&self) -> Result<Socket, String> {
        let (socket, state) = connect(&self.address)?;
        let there = state.inverse3.iter().any(|one| one.device_id == self.device);
        if there {
            Ok(socket)
        } else {
            Err(format!("haply: the service has no device {} any more", self.device))
        }
    }

    /// Messages and their answers; ends without force and without a reason when the device is left.
    fn talk(&mut self, socket: &mut Socket) -> Option<String> {
        // Only the first message may tell of the session.
        let mut session =
            format!("\"session\":{{\"configure\":{{\"profile\":{{\"name\":\"{PROFILE}\"}}}}}},");
        let device = serde_json::Value::from(self.device.as_str()).to_string();
        loop {
            let (begun, ending) = (Instant::now(), self.ending());
            let force = if ending { DVec3::ZERO } else { haply_from_ours(self.end.wanted()) };
            let [x, y, z] = force.to_array();
            let message = format!(
                "{{{session}\"inverse3\":[{{\"device_id\":{device},\"commands\":{{\"set_cursor_force\":{{\"vector\":\
                 {{\"x\":{x},\"y\":{y},\"z\":{z}}}}}}}}}]}}"
            );
            session.clear();
            let answer = socket.send(Message::text(message)).map_err(|e| e.to_string());
            let answer = match answer.and_then(|()| receive(socket)) {
                Ok(answer) => answer,
                Err(why) => return Some(format!("haply: the Inverse Service is gone: {why}")),
            };
            if ending {
                let _ = socket.close(None);
                let _ = socket.flush();
                return None;
            }
            // An answer that tells nothing is passed over: if none comes for long, the device falls silent.
            let reading =
                serde_json::from_str::<State>(&answer).ok().and_then(|state| state.reading(&self.device));
            if let Some(reading) = reading {
                self.end.tell(reading, 0);
            }
            std::thread::sleep(PERIOD.saturating_sub(begun.elapsed()));
        }
    }
}

impl Device for Haply {
    fn traits(&self) -> Traits {
        self.traits
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        self.end.newest(now_s).map(|told| told.reading).ok_or_else(|| {
            let trouble = self.shared.trouble.lock().unwrap_or_else(PoisonError::into_inner);
            Error::Device(format!("haply: nothing was told for {} ms; last: {trouble}", SILENCE.as_millis()))
        })
    }

    fn push(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        self.end.push(force);
        Ok(())
    }
}

impl Drop for Haply {
    fn drop(&mut self) {
        self.shared.ending.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A thread that has ended by a bug has closed the connection, which ends the session and its force.
            let _ = thread.join();
        }
    }
}
