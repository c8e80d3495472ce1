//! The force process's end of links.

use super::identity::Secret;
use super::lock;
use super::messages::{Hello, Welcome, effort_bytes, motion};
use super::transport::transport;
use crate::clock::Clock;
use crate::error::Error;
use crate::port::{DevicePort, Effort};
use crate::scheduling::Scheduling;
use quinn::crypto::rustls::QuicServerConfig;
use quinn::{Connection, Endpoint, Incoming, ServerConfig};
use std::collections::HashMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use triple_buffer::Output;

/// Efforts are looked for this share of a step after it is due: a step that takes longer is answered a step later.
const AFTER: f64 = 0.2;

/// Real-time priority of the answers: below the force process and the haptic updates.
const PRIORITY: u8 = 60;

/// A device must say which it is within this.
const PATIENCE: Duration = Duration::from_secs(2);

/// The longest greeting [bytes].
const LONGEST_HELLO: usize = 1024;

/// More devices than these at once are no scene's.
const MOST_CONNECTIONS: usize = 64;

/// What came over all links.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkCounts {
    /// Devices that came, again after a cut too.
    pub connected: u64,
    /// Those that were refused: a wrong secret, a name that is not one, a device that is taken.
    pub refused: u64,
    /// Motions that were taken.
    pub motions: u64,
    /// Motions that were not newer than the last: doubled, or late.
    pub old: u64,
    /// Datagrams that were no motions.
    pub garbage: u64,
}

#[derive(Default)]
struct Counters {
    connected: AtomicU64,
    refused: AtomicU64,
    motions: AtomicU64,
    old: AtomicU64,
    garbage: AtomicU64,
}

/// The ports that no device has now, by their devices' names; the devices that have one; all names.
struct Seats {
    free: Mutex<HashMap<String, DevicePort>>,
    taken: Mutex<HashMap<String, Taken>>,
    names: Vec<String>,
    counters: Counters,
    start: Instant,
}

/// A device that has a port: where its efforts come from and go to.
struct Taken {
    efforts: Output<Effort>,
    connection: Connection,
    /// The newest that was sent.
    sent: u64,
}

/// Listens for devices. It stops when it is dropped.
pub struct LinkServer {
    runtime: Option<Runtime>,
    endpoint: Endpoint,
    seats: Arc<Seats>,
    over: Arc<AtomicBool>,
    answering: Option<JoinHandle<()>>,
}

impl LinkServer {
    /// Listen at an address for devices of these names. Times count from `start`; a force process with a period of `step_s` [s]
    /// is answering, whose efforts are sent on right after they are there.
    ///
    /// # Errors
    /// When it is an address that others can reach and there is no secret; when the system does not let it listen there.
    pub fn new(
        address: SocketAddr,
        secret: &Secret,
        ports: Vec<(String, DevicePort)>,
        (start, step_s): (Instant, f64),
    ) -> Result<Self, Error> {
        secret.check(address.ip())?;
        let failed = |error: std::io::Error| Error::Setup(format!("cannot listen at {address}: {error}"));
        let crypto = QuicServerConfig::try_from(secret.server()?)
            .map_err(|error| Error::Setup(format!("the link can't be encrypted: {error}")))?;
        let mut config = ServerConfig::with_crypto(Arc::new(crypto));
        config.transport_config(transport());
        let runtime = runtime()?;
        let endpoint = {
            let _inside = runtime.enter();
            let socket = UdpSocket::bind(address).map_err(failed)?;
            let quic = Arc::new(quinn::TokioRuntime);
            Endpoint::new(quinn::EndpointConfig::default(), Some(config), socket, quic).map_err(failed)?
        };
        let names = ports.iter().map(|(name, _)| name.clone()).collect();
        let free = Mutex::new(ports.into_iter().collect());
        let taken = Mutex::new(HashMap::new());
        let seats = Arc::new(Seats { free, taken, names, counters: Counters::default(), start });
        runtime.spawn(listen(endpoint.clone(), seats.clone()));
        let over = Arc::new(AtomicBool::new(false));
        let clock = Clock::new(start, step_s).later(AFTER * step_s).asleep();
        let (answers, until) = (seats.clone(), over.clone());
        let answering = std::thread::Builder::new().name("palpate answers".to_string());
        let answering = answering.spawn(move || answer(&answers, &clock, &until)).map_err(|error| {
            Error::Thread(format!("cannot start a thread for the link's answers: {error}"))
        })?;
        Ok(Self { runtime: Some(runtime), endpoint, seats, over, answering: Some(answering) })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// When the system does not tell.
    pub fn address(&self) -> Result<SocketAddr, Error> {
        self.endpoint.local_addr().map_err(|error| Error::Setup(format!("the link has no address: {error}")))
    }

    /// What has come.
    pub fn counts(&self) -> LinkCounts {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let Counters { connected, refused, motions, old, garbage } = &self.seats.counters;
        LinkCounts {
            connected: of(connected),
            refused: of(refused),
            motions: of(motions),
            old: of(old),
            garbage: of(garbage),
        }
    }
}

impl Drop for LinkServer {
    fn drop(&mut self) {
        self.over.store(true, Ordering::Relaxed);
        if let Some(answering) = self.answering.take() {
            // It has ended, or by a bug of its own.
            let _ = answering.join();
        }
        self.endpoint.close(0_u32.into(), b"the session has ended");
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(Duration::from_millis(100));
        }
    }
}

/// A thread of its own for everything that comes over links.
pub(super) fn runtime() -> Result<Runtime, Error> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("palpate link")
        .enable_all()
        .build()
        .map_err(|error| Error::Thread(format!("cannot start a thread for the link: {error}")))
}

async fn listen(endpoint: Endpoint, seats: Arc<Seats>) {
    while let Some(incoming) = endpoint.accept().await {
        if endpoint.open_connections() > MOST_CONNECTIONS {
            incoming.refuse();
            continue;
        }
        tokio::spawn(serve(incoming, seats.clone()));
    }
}

async fn serve(incoming: Incoming, seats: Arc<Seats>) {
    let add = |counter: &AtomicU64| counter.fetch_add(1, Ordering::Relaxed);
    let Ok(connection) = incoming.await else {
        add(&seats.counters.refused);
        return;
    };
    let Ok(Some((name, port))) = tokio::time::timeout(PATIENCE, greet(&connection, &seats)).await else {
        add(&seats.counters.refused);
        return;
    };
    add(&seats.counters.connected);
    let DevicePort { motion: mut telling, effort: efforts } = port;
    let taken = Taken { efforts, connection: connection.clone(), sent: 0 };
    lock(&seats.taken).insert(name.clone(), taken);
    let mut newest = 0;
    while let Ok(bytes) = connection.read_datagram().await {
        let Some(motion) = motion(&bytes, seats.start.elapsed().as_secs_f64()) else {
            add(&seats.counters.garbage);
            continue;
        };
        if motion.sequence <= newest {
            add(&seats.counters.old);
            continue;
        }
        newest = motion.sequence;
        add(&seats.counters.motions);
        telling.tell(motion);
    }
    let taken = lock(&seats.taken).remove(&name);
    if let Some(Taken { efforts, .. }) = taken {
        lock(&seats.free).insert(name, DevicePort { motion: telling, effort: efforts });
    }
}

/// Send efforts on as they come.
fn answer(seats: &Seats, clock: &Clock, over: &AtomicBool) {
    // What is not granted is done without.
    let _ = Scheduling { priority: Some(PRIORITY), core: None }.claim();
    let mut tick = clock.next_after(0);
    while !over.load(Ordering::Relaxed) {
        clock.wait(tick);
        tick = clock.next_after(tick);
        for taken in lock(&seats.taken).values_mut() {
            let effort = *taken.efforts.read();
            if effort.sequence > taken.sent {
                taken.sent = effort.sequence;
                // A datagram that can't be sent now would be too old later.
                let _ = taken.connection.send_datagram(effort_bytes(&effort).to_vec().into());
            }
        }
    }
}

/// Hear which device it is, and give it its port.
async fn greet(connection: &Connection, seats: &Seats) -> Option<(String, DevicePort)> {
    let (mut send, mut receive) = connection.accept_bi().await.ok()?;
    let bytes = receive.read_to_end(LONGEST_HELLO).await.ok()?;
    let hello: Result<Hello, _> = serde_json::from_slice(&bytes);
    let taken = match &hello {
        Err(_) => Err("it does not say which device it is".to_string()),
        Ok(Hello { device }) => {
            let port = lock(&seats.free).remove(device);
            port.map(|port| (device.clone(), port)).ok_or_else(|| {
                if seats.names.contains(device) {
                    format!("the device {device:?} is taken")
                } else {
                    format!("the scene has no device {device:?} for a link, only {}", seats.names.join(", "))
                }
            })
        }
    };
    let welcome = match &taken {
        Ok(_) => Welcome::Taken,
        Err(why) => Welcome::Refused(why.clone()),
    };
    let text = serde_json::to_vec(&welcome).ok()?;
    let sent = send.write_all(&text).await.is_ok() && send.finish().is_ok();
    match taken {
        Ok(taken) if sent => Some(taken),
        Ok((name, port)) => {
            lock(&seats.free).insert(name, port);
            None
        }
        Err(_) => {
            // Until it is read.
            let _ = send.stopped().await;
            None
        }
    }
}
