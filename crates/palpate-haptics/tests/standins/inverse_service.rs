//! A stand-in for Haply's Inverse Service: on connection an inventory, then one state for each message (version 3.5; X to the right, Y
//! forward, Z up; m, N). Tests of the command line use it too.

use serde_json::{Value, json};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;
use tungstenite::{Error, Message, WebSocket};

/// Replies of the service.
#[derive(Clone, Copy, PartialEq)]
pub enum Mood {
    States,
    Garbage,
    Nothing,
    NoDevice,
}

/// State of the service, and the messages that it received.
pub struct World {
    pub mood: Mood,
    pub basis: &'static str,
    pub cursor: [f64; 3],
    /// w, x, y, z.
    pub grip: [f64; 4],
    pub pressed: bool,
    pub force: [f64; 3],
    pub sessions: Vec<Value>,
    pub messages: u64,
}

/// The service, in a thread.
pub struct Service {
    pub address: SocketAddr,
    pub world: Arc<Mutex<World>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Service {
    pub fn new() -> Self {
        let world = World {
            mood: Mood::States,
            basis: "XYZ",
            cursor: [0.01, -0.12, 0.15],
            grip: [1.0, 0.0, 0.0, 0.0],
            pressed: false,
            force: [f64::NAN; 3],
            sessions: Vec::new(),
            messages: 0,
        };
        Self::at("127.0.0.1:0", Arc::new(Mutex::new(world)))
    }

    pub fn at(address: &str, world: Arc<Mutex<World>>) -> Self {
        let listener = TcpListener::bind(address).expect("a port");
        let address = listener.local_addr().expect("an address");
        listener.set_nonblocking(true).expect("a listener");
        let stop = Arc::new(AtomicBool::new(false));
        let thread = std::thread::spawn({
            let (world, stop) = (world.clone(), stop.clone());
            move || {
                std::thread::scope(|scope| {
                    while !stop.load(Ordering::SeqCst) {
                        if let Ok((stream, _)) = listener.accept() {
                            let (world, stop) = (&*world, &*stop);
                            scope.spawn(move || serve(stream, world, stop));
                        }
                        std::thread::sleep(Duration::from_millis(1));
                    }
                });
            }
        });
        Self { address, world, stop, thread: Some(thread) }
    }

    pub fn place(&self) -> String {
        format!("ws://{}", self.address)
    }

    pub fn set(&self, change: impl FnOnce(&mut World)) {
        change(&mut self.world.lock().expect("no panic"));
    }

    pub fn force(&self) -> [f64; 3] {
        self.world.lock().expect("no panic").force
    }

    /// Stop, with all connections.
    pub fn stop(&mut self) {
        self.stop.store(true, Ordering::SeqCst);
        self.thread.take().map(JoinHandle::join);
    }
}

impl Drop for Service {
    fn drop(&mut self) {
        self.stop();
    }
}

fn state(world: &World, whole: bool) -> Value {
    let [x, y, z] = world.cursor;
    let [w, i, j, k] = world.grip;
    let mut inverse3 = json!({
        "device_id": "049D",
        "state": { "cursor_position": { "x": x, "y": y, "z": z }, "control_mode": "idle" },
        "status": { "ready": true },
    });
    if whole {
        inverse3["config"] = json!({ "type": "inverse3", "basis": { "permutation": world.basis } });
    }
    let devices = if world.mood == Mood::NoDevice { json!([]) } else { json!([inverse3]) };
    json!({
        "session_id": 7,
        "inverse3": devices,
        "wireless_verse_grip": [{
            "device_id": "61548",
            "state": {
                "orientation": { "w": w, "x": i, "y": j, "z": k },
                "buttons": { "a": false, "b": world.pressed, "c": false },
            },
        }],
    })
}

fn serve(stream: TcpStream, world: &Mutex<World>, stop: &AtomicBool) {
    stream.set_nonblocking(false).expect("a socket");
    stream.set_read_timeout(Some(Duration::from_millis(500))).expect("a socket");
    let Ok(mut socket) = tungstenite::accept(stream) else { return };
    socket.get_ref().set_read_timeout(Some(Duration::from_millis(5))).expect("a socket");
    let inventory = state(&world.lock().expect("no panic"), true);
    let _ = socket.send(Message::text(inventory.to_string()));
    while !stop.load(Ordering::SeqCst) {
        match socket.read() {
            Ok(Message::Text(text)) => answer(&mut socket, text.as_str(), world),
            Ok(_) => {}
            Err(Error::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => {}
            Err(_) => return,
        }
    }
}

fn answer(socket: &mut WebSocket<TcpStream>, text: &str, world: &Mutex<World>) {
    let mut world = world.lock().expect("no panic");
    let message: Value = serde_json::from_str(text).expect("JSON");
    let device = &message["inverse3"][0];
    assert_eq!(device["device_id"], "049D");
    let force = &device["commands"]["set_cursor_force"]["vector"];
    world.force = ["x", "y", "z"].map(|axis| force[axis].as_f64().expect("a number"));
    world.messages += 1;
    if let Some(session) = message.get("session") {
        let first = (world.messages, session.clone());
        world.sessions.push(json!(first));
    }
    let answer = match world.mood {
        Mood::Nothing => return,
        Mood::Garbage => "{\"inverse3\": [{\"device_id\": 5".to_string(),
        Mood::States | Mood::NoDevice => state(&world, false).to_string(),
    };
    let _ = socket.send(Message::text(answer));
}
