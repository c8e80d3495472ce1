//! Server: the force process's end of links.

use super::identity::Secret;
use super::lock;
use super::sequence::SequenceFilter;
use super::transport::transport;
use crate::clock::Clock;
use crate::error::{Error, LinkError};
use crate::link_messages::{Hello, Welcome, effort_bytes, motion, taken};
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

/// Phase at which efforts are sent, as a share of the step after its deadline. The effort of a longer step is sent a step later.
const SEND_PHASE: f64 = 0.2;

/// Real-time priority of the sending thread: below the force process and the haptic updates.
const PRIORITY: u8 = 60;

/// Timeout of a device's greeting.
const GREETING_TIMEOUT: Duration = Duration::from_secs(2);

/// Largest greeting [bytes].
const MAX_HELLO: usize = 1024;

/// Largest number of connections at once.
const MAX_CONNECTIONS: usize = 64;

/// Counters of a link server.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct LinkCounts {
    /// Accepted connections, reconnections included.
    pub connected: u64,
    /// Refused connections: another secret, an unknown device, a device that is connected already.
    pub refused: u64,
    /// Accepted motions.
    pub motions: u64,
    /// Dropped motions: duplicate or late.
    pub old: u64,
    /// Datagrams that are no motions.
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

/// Device slots of a server.
struct DeviceSlots {
    /// Ports of devices without a connection, by name.
    free: Mutex<HashMap<String, DevicePort>>,
    /// Connected devices, by name.
    connected: Mutex<HashMap<String, ConnectedDevice>>,
    names: Vec<String>,
    counters: Counters,
    /// Origin of all times, on the runtime's clock.
    start: tokio::time::Instant,
}

impl DeviceSlots {
    /// Sends every device its newest effort, if it is new.
    fn send_new_efforts(&self) {
        for device in lock(&self.connected).values_mut() {
            let effort = *device.efforts.read();
            if effort.sequence > device.sent {
                device.sent = effort.sequence;
                // A datagram that can't be sent now would be outdated later.
                let _ = device.connection.send_datagram(effort_bytes(&effort).to_vec().into());
            }
        }
    }
}

/// Connected device: source and destination of its efforts.
struct ConnectedDevice {
    efforts: Output<Effort>,
    connection: Connection,
    /// Sequence number of the newest effort that was sent.
    sent: u64,
}

/// Server that listens for devices, until it is dropped.
pub struct LinkServer {
    /// Runtime of its own; none in one that others run.
    runtime: Option<Runtime>,
    endpoint: Endpoint,
    slots: Arc<DeviceSlots>,
    stop: Arc<AtomicBool>,
    sending: Option<JoinHandle<()>>,
}

impl LinkServer {
    /// Server at an address for devices with names and ports. Times count from `start`. Efforts are sent 0.2·`step_s` after each
    /// deadline of the force process, whose period is `step_s` [s].
    ///
    /// # Errors
    /// If other machines can reach the address and there is no secret, or the system refuses to bind it.
    pub fn new(
        address: SocketAddr,
        secret: &Secret,
        ports: Vec<(String, DevicePort)>,
        (start, step_s): (Instant, f64),
    ) -> Result<Self, Error> {
        secret.check(address.ip())?;
        let failed = |error: std::io::Error| LinkError::Bind { address, reason: error.to_string() };
        let config = server_config(secret)?;
        let runtime = runtime()?;
        let endpoint = {
            let _inside = runtime.enter();
            let socket = UdpSocket::bind(address).map_err(failed)?;
            let quic = Arc::new(quinn::TokioRuntime);
            Endpoint::new(quinn::EndpointConfig::default(), Some(config), socket, quic).map_err(failed)?
        };
        let (mut server, listening) = Self::on(endpoint, ports, start);
        runtime.spawn(listening);
        server.runtime = Some(runtime);
        let clock = Clock::new(start, step_s).with_phase(SEND_PHASE * step_s).without_spinning();
        let sending = std::thread::Builder::new().name("palpate efforts".to_string()).spawn({
            let (slots, stop) = (server.slots.clone(), server.stop.clone());
            move || send_efforts(&slots, &clock, &stop)
        });
        let sending = sending.map_err(|error| Error::ThreadSpawn {
            purpose: "link's efforts".to_string(),
            reason: error.to_string(),
        })?;
        server.sending = Some(sending);
        Ok(server)
    }

    /// Server on an endpoint, and the task that accepts connections. Efforts are sent by [`Self::send_new_efforts`].
    pub(super) fn on(
        endpoint: Endpoint,
        ports: Vec<(String, DevicePort)>,
        start: Instant,
    ) -> (Self, impl Future<Output = ()> + Send + use<>) {
        let names = ports.iter().map(|(name, _)| name.clone()).collect();
        let free = Mutex::new(ports.into_iter().collect());
        let connected = Mutex::new(HashMap::new());
        let (counters, start) = (Counters::default(), start.into());
        let slots = Arc::new(DeviceSlots { free, connected, names, counters, start });
        let listening = listen(endpoint.clone(), slots.clone());
        let stop = Arc::new(AtomicBool::new(false));
        (Self { runtime: None, endpoint, slots, stop, sending: None }, listening)
    }

    /// Sends every device its newest effort, if it is new.
    #[cfg(test)]
    pub(super) fn send_new_efforts(&self) {
        self.slots.send_new_efforts();
    }

    /// Address that the server listens at.
    ///
    /// # Errors
    /// If the system does not tell.
    pub fn address(&self) -> Result<SocketAddr, Error> {
        let address = self.endpoint.local_addr();
        Ok(address.map_err(|error| LinkError::NoAddress { reason: error.to_string() })?)
    }

    /// Counters since the start.
    pub fn counts(&self) -> LinkCounts {
        let of = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        let Counters { connected, refused, motions, old, garbage } = &self.slots.counters;
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
        self.stop.store(true, Ordering::Relaxed);
        if let Some(sending) = self.sending.take() {
            // A panic of the thread was printed; nothing more can be done.
            let _ = sending.join();
        }
        self.endpoint.close(0_u32.into(), b"the session has ended");
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(Duration::from_millis(100));
        }
    }
}

/// QUIC settings of a server with a secret.
pub(super) fn server_config(secret: &Secret) -> Result<ServerConfig, Error> {
    let crypto = QuicServerConfig::try_from(secret.server()?)
        .map_err(|error| LinkError::Encryption { reason: error.to_string() })?;
    let mut config = ServerConfig::with_crypto(Arc::new(crypto));
    config.transport_config(transport());
    Ok(config)
}

/// Tokio runtime with one thread, for everything that links receive.
pub(super) fn runtime() -> Result<Runtime, Error> {
    tokio::runtime::Builder::new_multi_thread()
        .worker_threads(1)
        .thread_name("palpate link")
        .enable_all()
        .build()
        .map_err(|error| Error::ThreadSpawn { purpose: "link".to_string(), reason: error.to_string() })
}

/// Accepts connections until the endpoint is closed.
async fn listen(endpoint: Endpoint, slots: Arc<DeviceSlots>) {
    while let Some(incoming) = endpoint.accept().await {
        if endpoint.open_connections() > MAX_CONNECTIONS {
            incoming.refuse();
            continue;
        }
        tokio::spawn(serve(incoming, slots.clone()));
    }
}

/// Serves one connection: gives the device its port, then passes its motions on until the link breaks.
async fn serve(incoming: Incoming, slots: Arc<DeviceSlots>) {
    let add = |counter: &AtomicU64| counter.fetch_add(1, Ordering::Relaxed);
    let Ok(connection) = incoming.await else {
        add(&slots.counters.refused);
        return;
    };
    let Ok(Some((name, port))) = tokio::time::timeout(GREETING_TIMEOUT, greet(&connection, &slots)).await
    else {
        add(&slots.counters.refused);
        return;
    };
    add(&slots.counters.connected);
    let DevicePort { motion: mut motions, effort: efforts } = port;
    let device = ConnectedDevice { efforts, connection: connection.clone(), sent: 0 };
    lock(&slots.connected).insert(name.clone(), device);
    let mut filter = SequenceFilter::default();
    while let Ok(bytes) = connection.read_datagram().await {
        let Some(motion) = motion(&bytes, slots.start.elapsed().as_secs_f64()) else {
            add(&slots.counters.garbage);
            continue;
        };
        if !filter.is_newer(motion.sequence) {
            add(&slots.counters.old);
            continue;
        }
        add(&slots.counters.motions);
        motions.send(motion);
    }
    let device = lock(&slots.connected).remove(&name);
    if let Some(ConnectedDevice { efforts, .. }) = device {
        lock(&slots.free).insert(name, DevicePort { motion: motions, effort: efforts });
    }
}

/// Sends new efforts at every tick until `stop` is set.
fn send_efforts(slots: &DeviceSlots, clock: &Clock, stop: &AtomicBool) {
    // Goes on without a real-time priority that is not granted.
    let _ = Scheduling { priority: Some(PRIORITY), core: None }.apply();
    let mut tick = clock.next_after(0);
    while !stop.load(Ordering::Relaxed) {
        clock.wait(tick);
        tick = clock.next_after(tick);
        slots.send_new_efforts();
    }
}

/// Receives a greeting, replies, and returns the device's name and port if it is accepted.
async fn greet(connection: &Connection, slots: &DeviceSlots) -> Option<(String, DevicePort)> {
    let (mut send, mut receive) = connection.accept_bi().await.ok()?;
    let bytes = receive.read_to_end(MAX_HELLO).await.ok()?;
    let hello: Result<Hello, _> = serde_json::from_slice(&bytes);
    let accepted = match &hello {
        Err(_) => Err("it does not say which device it is".to_string()),
        Ok(Hello { device }) => {
            let port = lock(&slots.free).remove(device);
            port.map(|port| (device.clone(), port)).ok_or_else(|| {
                if slots.names.contains(device) {
                    taken(device)
                } else {
                    format!("the scene has no device {device:?} for a link, only {}", slots.names.join(", "))
                }
            })
        }
    };
    let welcome = match &accepted {
        Ok(_) => Welcome::Accepted,
        Err(why) => Welcome::Refused(why.clone()),
    };
    let text = serde_json::to_vec(&welcome).ok()?;
    let sent = send.write_all(&text).await.is_ok() && send.finish().is_ok();
    match accepted {
        Ok(accepted) if sent => Some(accepted),
        Ok((name, port)) => {
            lock(&slots.free).insert(name, port);
            None
        }
        Err(_) => {
            // Keeps the connection open until the refusal is read.
            let _ = send.stopped().await;
            None
        }
    }
}
