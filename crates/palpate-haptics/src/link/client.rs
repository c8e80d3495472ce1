//! Client: the device's end of a link.

use super::identity::Secret;
use super::lock;
use super::sequence::SequenceFilter;
use super::server::runtime;
use super::transport::transport;
use crate::error::{Error, LinkError};
use crate::link_messages::{Hello, Welcome, effort, motion_bytes, taken};
use crate::port::{DevicePort, Effort, Motion};
use quinn::crypto::rustls::QuicClientConfig;
use quinn::{ClientConfig, Connection, ConnectionError, Endpoint};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use triple_buffer::{Input, triple_buffer};

/// Pause between two attempts to connect.
const RETRY_INTERVAL: Duration = Duration::from_millis(100);

/// Timeout of an attempt to connect.
const ATTEMPT_TIMEOUT: Duration = Duration::from_secs(2);

/// Largest reply to a greeting [bytes].
const MAX_WELCOME: usize = 4096;

/// State of a link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkState {
    /// Connecting, with the result of the last attempt.
    Connecting(String),
    /// Connected: both ends have authenticated.
    Connected,
    /// Refused while another device has the name; tried again.
    Taken(String),
    /// Refused by the server, with its reason.
    Refused(String),
}

/// State that the link's thread shares with the haptic update.
struct Shared {
    connection: Mutex<Option<Connection>>,
    state: Mutex<LinkState>,
}

impl Shared {
    /// Sends a motion, if the link is connected and not locked.
    fn send(&self, motion: &Motion) {
        let Ok(connection) = self.connection.try_lock() else { return };
        if let Some(connection) = &*connection {
            // A datagram that can't be sent now would be outdated later.
            let _ = connection.send_datagram(motion_bytes(motion).to_vec().into());
        }
    }
}

/// Client that keeps a device connected to a force process elsewhere, until it is dropped.
pub struct LinkClient {
    /// Runtime of its own; none in one that others run.
    runtime: Option<Runtime>,
    endpoint: Endpoint,
    shared: Arc<Shared>,
}

impl LinkClient {
    /// Client of the server at an address, as the named device of its scene, and the port for a haptic update. Times count from
    /// `start`. Returns at once: the link is connected when the server is there, and again after every interruption.
    ///
    /// # Errors
    /// If the address is of another machine and there is no secret, or the system gives no socket.
    pub fn new(
        address: SocketAddr,
        secret: &Secret,
        device: &str,
        start: Instant,
    ) -> Result<(DevicePort, Self), Error> {
        secret.check(address.ip())?;
        let runtime = runtime()?;
        let own: SocketAddr = match address {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let endpoint = {
            let _inside = runtime.enter();
            Endpoint::client(own).map_err(|error| LinkError::NoSocket { reason: error.to_string() })?
        };
        let (port, mut client, connected) = Self::on(endpoint, address, secret, device, start)?;
        runtime.spawn(connected);
        client.runtime = Some(runtime);
        Ok((port, client))
    }

    /// Client on an endpoint, and the task that keeps it connected.
    pub(super) fn on(
        endpoint: Endpoint,
        address: SocketAddr,
        secret: &Secret,
        device: &str,
        start: Instant,
    ) -> Result<(DevicePort, Self, impl Future<Output = ()> + Send + use<>), Error> {
        let crypto = QuicClientConfig::try_from(secret.client()?)
            .map_err(|error| LinkError::Encryption { reason: error.to_string() })?;
        let mut config = ClientConfig::new(Arc::new(crypto));
        config.transport_config(transport());
        let state = Mutex::new(LinkState::Connecting("not tried yet".to_string()));
        let shared = Arc::new(Shared { connection: Mutex::new(None), state });
        let (efforts, newest) = triple_buffer(&Effort::default());
        let link = Link {
            endpoint: endpoint.clone(),
            config,
            address,
            device: device.to_string(),
            shared: shared.clone(),
            start: start.into(),
        };
        let sender = shared.clone();
        let port = DevicePort::remote(Box::new(move |motion| sender.send(&motion)), newest);
        Ok((port, Self { runtime: None, endpoint, shared }, link.keep_connected(efforts)))
    }

    /// State of the link.
    pub fn state(&self) -> LinkState {
        lock(&self.shared.state).clone()
    }
}

impl Drop for LinkClient {
    fn drop(&mut self) {
        self.endpoint.close(0_u32.into(), b"the device has gone");
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_timeout(Duration::from_millis(100));
        }
    }
}

struct Link {
    endpoint: Endpoint,
    config: ClientConfig,
    address: SocketAddr,
    device: String,
    shared: Arc<Shared>,
    /// Origin of all times, on the runtime's clock.
    start: tokio::time::Instant,
}

impl Link {
    fn set(&self, connection: Option<Connection>, state: LinkState) {
        *lock(&self.shared.connection) = connection;
        *lock(&self.shared.state) = state;
    }

    /// Connects, receives efforts until the link breaks, connects again.
    async fn keep_connected(self, mut efforts: Input<Effort>) {
        loop {
            match tokio::time::timeout(ATTEMPT_TIMEOUT, self.attempt()).await {
                Ok(Ok(connection)) => {
                    self.set(Some(connection.clone()), LinkState::Connected);
                    // A restarted force process counts from 1.
                    let mut filter = SequenceFilter::default();
                    while let Ok(bytes) = connection.read_datagram().await {
                        let Some(effort) = effort(&bytes, self.start.elapsed().as_secs_f64()) else {
                            continue;
                        };
                        if filter.is_newer(effort.sequence) {
                            efforts.write(effort);
                        }
                    }
                    let why = connection.close_reason().map_or(String::new(), |reason| reason.to_string());
                    self.set(None, LinkState::Connecting(format!("the link broke: {why}")));
                }
                Ok(Err(state)) => self.set(None, state),
                Err(_) => self.set(None, LinkState::Connecting(format!("no reply from {}", self.address))),
            }
            tokio::time::sleep(RETRY_INTERVAL).await;
        }
    }

    async fn attempt(&self) -> Result<Connection, LinkState> {
        let connecting_because = |why: String| LinkState::Connecting(why);
        let connecting = self.endpoint.connect_with(self.config.clone(), self.address, "palpate");
        let connecting =
            connecting.map_err(|error| connecting_because(format!("{}: {error}", self.address)))?;
        let connection = connecting.await.map_err(|error| refusal(&error, self.address))?;
        let hello = serde_json::to_vec(&Hello { device: self.device.clone() });
        let hello = hello.map_err(|error| connecting_because(error.to_string()))?;
        let lost = |what: &str| connecting_because(format!("the link broke while {what}"));
        let (mut send, mut receive) = connection.open_bi().await.map_err(|_| lost("it was greeted"))?;
        send.write_all(&hello).await.map_err(|_| lost("it was greeted"))?;
        send.finish().map_err(|_| lost("it was greeted"))?;
        // A server with another secret closes the connection here at the latest.
        let answer = receive.read_to_end(MAX_WELCOME).await;
        let answer = answer.map_err(|_| match connection.close_reason() {
            Some(reason) => refusal(&reason, self.address),
            None => lost("it was answered"),
        })?;
        match serde_json::from_slice(&answer) {
            Ok(Welcome::Accepted) => Ok(connection),
            Ok(Welcome::Refused(why)) if why == taken(&self.device) => Err(LinkState::Taken(why)),
            Ok(Welcome::Refused(why)) => Err(LinkState::Refused(why)),
            Err(_) => Err(lost("it was answered")),
        }
    }
}

/// State of a link after a connection error.
fn refusal(error: &ConnectionError, address: SocketAddr) -> LinkState {
    let text = error.to_string();
    // The TLS alert for a rejected certificate: the other end has another secret.
    let secret = matches!(error, ConnectionError::TransportError(_) | ConnectionError::ConnectionClosed(_))
        && text.contains("cert");
    if secret {
        return LinkState::Refused(format!("{address} has another secret"));
    }
    LinkState::Connecting(format!("{address}: {text}"))
}
