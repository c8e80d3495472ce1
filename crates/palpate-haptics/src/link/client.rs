//! The device's end of a link.

use super::identity::Secret;
use super::lock;
use super::messages::{Hello, Welcome, effort, motion_bytes};
use super::server::runtime;
use super::transport::transport;
use crate::error::Error;
use crate::port::{DevicePort, Effort, Motion};
use quinn::crypto::rustls::QuicClientConfig;
use quinn::{ClientConfig, Connection, ConnectionError, Endpoint};
use std::net::{Ipv4Addr, Ipv6Addr, SocketAddr};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};
use tokio::runtime::Runtime;
use triple_buffer::{Input, triple_buffer};

/// Between two attempts.
const AGAIN: Duration = Duration::from_millis(100);

/// An attempt takes no longer.
const PATIENCE: Duration = Duration::from_secs(2);

/// The longest answer to a greeting [bytes].
const LONGEST_WELCOME: usize = 4096;

/// How a link is.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum LinkState {
    /// Looking for the other end, with what the last attempt came to.
    Seeking(String),
    /// Both ends know each other.
    Linked,
    /// The other end does not want it.
    Refused(String),
}

/// What the link's thread and the haptic update share.
struct Shared {
    connection: Mutex<Option<Connection>>,
    state: Mutex<LinkState>,
}

/// Where a device sends its motions.
pub(crate) struct LinkSender {
    shared: Arc<Shared>,
}

impl LinkSender {
    /// Send a motion, if the link is there and free.
    pub(crate) fn tell(&self, motion: &Motion) {
        let Ok(connection) = self.shared.connection.try_lock() else { return };
        if let Some(connection) = &*connection {
            // What can't be sent now would be too old later.
            let _ = connection.send_datagram(motion_bytes(motion).to_vec().into());
        }
    }
}

/// Keeps a device linked to a force process elsewhere. The link ends when it is dropped.
pub struct LinkClient {
    runtime: Option<Runtime>,
    endpoint: Endpoint,
    shared: Arc<Shared>,
}

impl LinkClient {
    /// Link to an address as a device of the scene there; gives the port for a haptic update. Times count from `start`. Nothing
    /// is waited for: the link comes when the other end is there, and comes again after every cut.
    ///
    /// # Errors
    /// When the address is of another machine and there is no secret, or the system gives no socket.
    pub fn new(
        address: SocketAddr,
        secret: &Secret,
        device: &str,
        start: Instant,
    ) -> Result<(DevicePort, Self), Error> {
        secret.check(address.ip())?;
        let crypto = QuicClientConfig::try_from(secret.client()?)
            .map_err(|error| Error::Setup(format!("the link can't be encrypted: {error}")))?;
        let mut config = ClientConfig::new(Arc::new(crypto));
        config.transport_config(transport());
        let runtime = runtime()?;
        let own: SocketAddr = match address {
            SocketAddr::V4(_) => (Ipv4Addr::UNSPECIFIED, 0).into(),
            SocketAddr::V6(_) => (Ipv6Addr::UNSPECIFIED, 0).into(),
        };
        let endpoint = {
            let _inside = runtime.enter();
            Endpoint::client(own).map_err(|error| Error::Setup(format!("no socket for the link: {error}")))?
        };
        let state = Mutex::new(LinkState::Seeking("not tried yet".to_string()));
        let shared = Arc::new(Shared { connection: Mutex::new(None), state });
        let (efforts, newest) = triple_buffer(&Effort::default());
        let link = Link {
            endpoint: endpoint.clone(),
            config,
            address,
            device: device.to_string(),
            shared: shared.clone(),
            start,
        };
        runtime.spawn(link.keep(efforts));
        let port = DevicePort::linked(LinkSender { shared: shared.clone() }, newest);
        Ok((port, Self { runtime: Some(runtime), endpoint, shared }))
    }

    /// How the link is now.
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
    start: Instant,
}

impl Link {
    fn set(&self, connection: Option<Connection>, state: LinkState) {
        *lock(&self.shared.connection) = connection;
        *lock(&self.shared.state) = state;
    }

    /// Link, receive until it breaks, link again.
    async fn keep(self, mut efforts: Input<Effort>) {
        // The other end counts on after a cut: so does this one.
        let mut newest = 0;
        loop {
            match tokio::time::timeout(PATIENCE, self.attempt()).await {
                Ok(Ok(connection)) => {
                    self.set(Some(connection.clone()), LinkState::Linked);
                    while let Ok(bytes) = connection.read_datagram().await {
                        let Some(effort) = effort(&bytes, self.start.elapsed().as_secs_f64()) else {
                            continue;
                        };
                        if effort.sequence > newest {
                            newest = effort.sequence;
                            efforts.write(effort);
                        }
                    }
                    // A force process that was started anew counts from the beginning.
                    newest = 0;
                    let why = connection.close_reason().map_or(String::new(), |reason| reason.to_string());
                    self.set(None, LinkState::Seeking(format!("the link broke: {why}")));
                }
                Ok(Err(state)) => self.set(None, state),
                Err(_) => self.set(None, LinkState::Seeking(format!("nobody answers at {}", self.address))),
            }
            tokio::time::sleep(AGAIN).await;
        }
    }

    async fn attempt(&self) -> Result<Connection, LinkState> {
        let seeking = |why: String| LinkState::Seeking(why);
        let connecting = self.endpoint.connect_with(self.config.clone(), self.address, "palpate");
        let connecting = connecting.map_err(|error| seeking(format!("{}: {error}", self.address)))?;
        let connection = connecting.await.map_err(|error| refusal(&error, self.address))?;
        let hello = serde_json::to_vec(&Hello { device: self.device.clone() });
        let hello = hello.map_err(|error| seeking(error.to_string()))?;
        let lost = |what: &str| seeking(format!("the link broke while {what}"));
        let (mut send, mut receive) = connection.open_bi().await.map_err(|_| lost("it was greeted"))?;
        send.write_all(&hello).await.map_err(|_| lost("it was greeted"))?;
        send.finish().map_err(|_| lost("it was greeted"))?;
        // With a wrong secret the other end is heard of here at the latest.
        let answer = receive.read_to_end(LONGEST_WELCOME).await;
        let answer = answer.map_err(|_| match connection.close_reason() {
            Some(reason) => refusal(&reason, self.address),
            None => lost("it was answered"),
        })?;
        match serde_json::from_slice(&answer) {
            Ok(Welcome::Taken) => Ok(connection),
            Ok(Welcome::Refused(why)) => Err(LinkState::Refused(why)),
            Err(_) => Err(lost("it was answered")),
        }
    }
}

/// Why no link came about.
fn refusal(error: &ConnectionError, address: SocketAddr) -> LinkState {
    let text = error.to_string();
    // The alert that a certificate was not accepted, which only another secret explains.
    let secret = matches!(error, ConnectionError::TransportError(_) | ConnectionError::ConnectionClosed(_))
        && text.contains("cert");
    if secret {
        return LinkState::Refused(format!("{address} has another secret"));
    }
    LinkState::Seeking(format!("{address}: {text}"))
}
