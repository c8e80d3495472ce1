//! The force process's end of links.

use super::identity::Secret;
use super::messages::{Hello, Welcome, effort_bytes, motion};
use super::transport::transport;
use crate::error::Error;
use crate::port::DevicePort;
use quinn::crypto::rustls::QuicServerConfig;
use quinn::{Connection, Endpoint, Incoming, ServerConfig};
use std::collections::HashMap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;

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

/// The ports that no device has now, by their devices' names; all names.
struct Seats {
    free: Mutex<HashMap<String, DevicePort>>,
    names: Vec<String>,
    counters: Counters,
    start: Instant,
}

/// Listens for devices. It stops when it is dropped.
pub struct LinkServer {
    runtime: Option<Runtime>,
    endpoint: Endpoint,
    seats: Arc<Seats>,
}

impl LinkServer {
    /// Listen at an address for devices of these names. Times count from `start`.
    ///
    /// # Errors
    /// When it is an address that others can reach and there is no secret; when the system does not let it listen there.
    pub fn new(
        address: SocketAddr,
        secret: &Secret,
        ports: Vec<(String, DevicePort)>,
        start: Instant,
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
        let seats = Arc::new(Seats { free, names, counters: Counters::default(), start });
        runtime.spawn(listen(endpoint.clone(), seats.clone()));
        Ok(Self { runtime: Some(runtime), endpoint, seats })
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
        self.endpoint.close(0_u32.into(), b"the session has ended");
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(Duration::from_millis(100));
        }
    }
}

/// A thread of its own for everything that goes over links.
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
    let Ok(Some((name, mut port))) = tokio::time::timeout(PATIENCE, greet(&connection, &seats)).await else {
        add(&seats.counters.refused);
        return;
    };
    add(&seats.counters.connected);
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
        port.tell(motion);
        let effort = port.newest();
        if effort.sequence > 0 {
            // A datagram that can't be sent now would be too old later.
            let _ = connection.send_datagram(effort_bytes(&effort).to_vec().into());
        }
    }
    seats.free.lock().unwrap_or_else(PoisonError::into_inner).insert(name, port);
}

/// Hear which device it is, and give it its port.
async fn greet(connection: &Connection, seats: &Seats) -> Option<(String, DevicePort)> {
    let (mut send, mut receive) = connection.accept_bi().await.ok()?;
    let bytes = receive.read_to_end(LONGEST_HELLO).await.ok()?;
    let hello: Result<Hello, _> = serde_json::from_slice(&bytes);
    let taken = match &hello {
        Err(_) => Err("it does not say which device it is".to_string()),
        Ok(Hello { device }) => {
            let port = seats.free.lock().unwrap_or_else(PoisonError::into_inner).remove(device);
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
            seats.free.lock().unwrap_or_else(PoisonError::into_inner).insert(name, port);
            None
        }
        Err(_) => {
            // Until it is read.
            let _ = send.stopped().await;
            None
        }
    }
}
