//! Haply devices, through the WebSocket of Haply's Inverse Service.
//!
//! The vendor's frame has x to the right, y forward and z up, in metres and newtons: device frame = (x, z, −y). The service sends an
//! inventory on connection, and then one state per message. A thread exchanges messages with it, at most one per [`PERIOD`]: it sends
//! the newest force and keeps the state that comes back. The haptic update never waits for the socket (see
//! [`exchange`](super::exchange)). When the service disappears, the thread reconnects as soon as it is back.

use super::driver::{DiscoveredDevice, select};
use super::exchange::{DriverSide, STALE_AFTER, UpdateSide, exchange};
use super::{Device, DeviceSpec, Reading, orientation_from_quaternion};
use crate::error::{DeviceError, Error};
use crate::safety_limits::SafetyLimits;
use glam::DVec3;
use serde::Deserialize;
use std::net::{TcpStream, ToSocketAddrs};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tungstenite::protocol::WebSocketConfig;
use tungstenite::{Message, WebSocket, client::client_with_config};

/// Environment variable with the service's address.
pub(super) const VARIABLE: &str = "PALPATE_HAPLY";

/// Default address of the service.
const DEFAULT_ADDRESS: &str = "localhost:10001";

/// Name of this program in the vendor's tools.
const PROFILE: &str = "palpate:device";

/// Shortest interval between two messages.
const PERIOD: Duration = Duration::from_micros(500);

/// Timeout of a connection.
const CONNECT_TIMEOUT: Duration = Duration::from_millis(500);

/// Timeout of a reply.
const REPLY_TIMEOUT: Duration = Duration::from_millis(100);

/// Pause between two attempts to reconnect.
const RETRY_INTERVAL: Duration = Duration::from_millis(200);

/// Largest message of the service [bytes].
const MAX_MESSAGE: usize = 1 << 20;

type Socket = WebSocket<TcpStream>;

/// Inventory or state that the service sends, as far as it is used.
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

/// Open device.
pub(super) struct Haply {
    exchange: UpdateSide,
    shared: Arc<Shared>,
    thread: Option<JoinHandle<()>>,
    spec: DeviceSpec,
}

/// State that the haptic update and the thread share.
struct Shared {
    ending: AtomicBool,
    /// Last failure of the connection.
    last_failure: Mutex<String>,
}

/// Thread that exchanges messages with the service.
struct Connection {
    address: String,
    device: String,
    exchange: DriverSide,
    shared: Arc<Shared>,
}

/// Connected devices.
pub(super) fn find(location: Option<&str>) -> Result<Vec<DiscoveredDevice>, Error> {
    let (_, state) = connect(&address(location))?;
    devices(&state)
}

/// Opens a device by its identifier or index.
pub(super) fn open(which: &str, location: Option<&str>) -> Result<(DiscoveredDevice, Haply), Error> {
    let address = address(location);
    let (socket, state) = connect(&address)?;
    let found = select("haply", &devices(&state)?, which)?.clone();
    if let Some(reason) = found.unavailable.clone() {
        return Err(DeviceError::Unavailable { driver: "haply", device: found.to_string(), reason }.into());
    }
    let known = found.name.starts_with("inverse3");
    let force_n = if known { DeviceSpec::INVERSE_3.force_n } else { SafetyLimits::default().force_n };
    let (exchange, driver) = exchange();
    let last_failure = Mutex::new("no state was received yet".to_string());
    let shared = Arc::new(Shared { ending: AtomicBool::new(false), last_failure });
    let device = found.serial.clone().unwrap_or_default();
    let connection = Connection { address, device, exchange: driver, shared: shared.clone() };
    let thread = std::thread::Builder::new().name("palpate haply".into());
    let thread = thread
        .spawn(move || connection.run(socket))
        .map_err(|e| Error::ThreadSpawn { purpose: "Inverse Service".into(), reason: e.to_string() })?;
    let spec = DeviceSpec { kind: "haply", force_n, ..DeviceSpec::INVERSE_3 };
    Ok((found, Haply { exchange, shared, thread: Some(thread), spec }))
}

/// Host and port from an address with or without `ws://` and port.
fn address(location: Option<&str>) -> String {
    let location = location.unwrap_or(DEFAULT_ADDRESS).trim_start_matches("ws://").trim_end_matches('/');
    if location.contains(':') { location.to_string() } else { format!("{location}:10001") }
}

/// Connects to the service and receives its inventory.
fn connect(address: &str) -> Result<(Socket, State), DeviceError> {
    let failed = |reason: String| DeviceError::ServiceUnreachable {
        address: address.to_string(),
        reason,
        variable: VARIABLE,
    };
    let mut reason = "no such host".to_string();
    for resolved in address.to_socket_addrs().map_err(|e| failed(e.to_string()))? {
        match TcpStream::connect_timeout(&resolved, CONNECT_TIMEOUT) {
            Ok(stream) => return greet(stream, address).map_err(failed),
            Err(error) => reason = error.to_string(),
        }
    }
    Err(failed(reason))
}

/// Opens the WebSocket and receives the inventory. Returns the reason of a failure.
fn greet(stream: TcpStream, address: &str) -> Result<(Socket, State), String> {
    let text = |e: std::io::Error| e.to_string();
    stream.set_nodelay(true).map_err(text)?;
    stream.set_read_timeout(Some(CONNECT_TIMEOUT)).map_err(text)?;
    stream.set_write_timeout(Some(REPLY_TIMEOUT)).map_err(text)?;
    let config =
        WebSocketConfig::default().max_message_size(Some(MAX_MESSAGE)).max_frame_size(Some(MAX_MESSAGE));
    let (mut socket, _) = client_with_config(format!("ws://{address}/"), stream, Some(config))
        .map_err(|e| format!("it does not speak WebSocket: {e}"))?;
    let state = receive(&mut socket)?;
    let state = serde_json::from_str(&state).map_err(|e| format!("it sends no inventory: {e}"))?;
    socket.get_ref().set_read_timeout(Some(REPLY_TIMEOUT)).map_err(text)?;
    Ok((socket, state))
}

/// Next text message. Returns the reason of a failure.
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

/// Devices of an inventory.
fn devices(state: &State) -> Result<Vec<DiscoveredDevice>, Error> {
    if state.inverse3.is_empty() {
        let message = "the Inverse Service has no Inverse3: connect one, and look at Haply Hub".to_string();
        return Err(DeviceError::NoDevice { driver: "haply", message }.into());
    }
    let one = |(index, device): (usize, &Inverse3)| {
        let config = device.config.as_ref();
        let kind = config.and_then(|config| config.kind.clone());
        let basis = config.and_then(|config| config.basis.as_ref()).map(|basis| basis.permutation.as_str());
        let unavailable = basis.filter(|basis| *basis != "XYZ").map(|basis| {
            format!("the service turns its axes to {basis}: set its basis to XYZ in Haply Hub, and turn the mount here")
        });
        let name = kind.unwrap_or_else(|| "inverse3".into());
        DiscoveredDevice { name, index, serial: Some(device.device_id.clone()), force_n: None, unavailable }
    };
    Ok(state.inverse3.iter().enumerate().map(one).collect())
}

/// Position or axis in the device frame from the vendor's frame.
fn ours_from_haply(v: DVec3) -> DVec3 {
    DVec3::new(v.x, v.z, -v.y)
}

/// Force in the vendor's frame from the device frame.
fn haply_from_ours(v: DVec3) -> DVec3 {
    DVec3::new(v.x, -v.z, v.y)
}

impl State {
    /// Reading of a device: its position, and the grip with the same index, a wireless one first.
    fn reading(&self, device: &str) -> Option<Reading> {
        let at = self.inverse3.iter().position(|one| one.device_id == device)?;
        let Vector { x, y, z } = self.inverse3[at].state.as_ref()?.cursor_position.as_ref()?;
        let grip = self.wireless_verse_grip.get(at).or_else(|| self.verse_grip.get(at));
        let grip = grip.and_then(|grip| grip.state.as_ref());
        let orientation =
            |q: &Quaternion| orientation_from_quaternion(DVec3::new(q.x, q.y, q.z), q.w, ours_from_haply);
        Some(Reading {
            position: ours_from_haply(DVec3::new(*x, *y, *z)),
            orientation: grip.and_then(|grip| grip.orientation.as_ref()).and_then(orientation),
            buttons: grip.map_or(0, |grip| {
                let Buttons { a, b, c } = grip.buttons;
                u32::from(a || grip.button) | u32::from(b) << 1 | u32::from(c) << 2
            }),
        })
    }
}

impl Connection {
    /// Exchanges messages with the service, and reconnects when it disappears, until the device is dropped. Also one that is dropped at
    /// once commands zero force.
    fn run(mut self, socket: Socket) {
        let mut socket = Some(socket);
        loop {
            let failure = match socket.take().map_or_else(|| self.reconnect(), Ok) {
                Ok(mut socket) => self.exchange_messages(&mut socket),
                Err(failure) => Some(failure),
            };
            let Some(failure) = failure else { return };
            *self.shared.last_failure.lock().unwrap_or_else(PoisonError::into_inner) = failure;
            if self.ending() {
                return;
            }
            std::thread::sleep(RETRY_INTERVAL);
        }
    }

    fn ending(&self) -> bool {
        self.shared.ending.load(Ordering::Acquire)
    }

    /// Connects again, if the service still has the device. Returns the reason of a failure.
    fn reconnect(&self) -> Result<Socket, String> {
        let (socket, state) = connect(&self.address).map_err(|error| error.to_string())?;
        let there = state.inverse3.iter().any(|one| one.device_id == self.device);
        if there {
            Ok(socket)
        } else {
            Err(format!("haply: the service has no device {} any more", self.device))
        }
    }

    /// Sends forces and receives states. Returns the failure, or `None` when the device is dropped, after a last zero force.
    fn exchange_messages(&mut self, socket: &mut Socket) -> Option<String> {
        // Only the first message configures the session.
        let mut session =
            format!("\"session\":{{\"configure\":{{\"profile\":{{\"name\":\"{PROFILE}\"}}}}}},");
        let device = serde_json::Value::from(self.device.as_str()).to_string();
        loop {
            let (begun, ending) = (Instant::now(), self.ending());
            let force =
                if ending { DVec3::ZERO } else { haply_from_ours(self.exchange.commanded_force(begun)) };
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
            // Replies without a reading are skipped; the reading then becomes stale.
            let reading =
                serde_json::from_str::<State>(&answer).ok().and_then(|state| state.reading(&self.device));
            if let Some(reading) = reading {
                self.exchange.send(reading, 0);
            }
            std::thread::sleep(PERIOD.saturating_sub(begun.elapsed()));
        }
    }
}

impl Device for Haply {
    fn spec(&self) -> DeviceSpec {
        self.spec
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, Error> {
        self.exchange.newest(now_s).map(|sample| sample.reading).ok_or_else(|| {
            let last = self.shared.last_failure.lock().unwrap_or_else(PoisonError::into_inner);
            let reason = format!("no reading for {} ms; last failure: {last}", STALE_AFTER.as_millis());
            DeviceError::Silent { driver: "haply", reason }.into()
        })
    }

    fn set_force(&mut self, force: DVec3, _: f64) -> Result<(), Error> {
        self.exchange.set_force(force);
        Ok(())
    }
}

impl Drop for Haply {
    fn drop(&mut self) {
        self.shared.ending.store(true, Ordering::Release);
        if let Some(thread) = self.thread.take() {
            // A panic of the thread has closed the connection, which ends the session and its force.
            let _ = thread.join();
        }
    }
}
