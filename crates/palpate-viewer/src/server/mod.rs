//! HTTP and WebSocket server.

mod attempts;
mod body;
mod client;
mod connections;
mod content;
mod frame_ancestor;
mod guard;
mod headers;
mod limits;
mod paced_stream;
mod page;
mod routes;
mod session;
mod state;
mod tls;
mod token;
mod upload;

pub use content::{Live, RenderJob, ServedContent};
pub use frame_ancestor::FrameAncestor;
pub use limits::Limits;
pub use tls::TlsIdentity;
pub use token::Token;

use crate::error::ServerError;
use connections::Connections;
use guard::Guard;
use state::ServerState;
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Threads that encode and copy large data: requests for it wait, and neither memory nor cores are flooded.
const BLOCKING_THREADS: usize = 4;

/// Interval at which the stop flag is polled.
const STOP_POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Address and access settings.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address and port; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Token of every request; required beyond loopback.
    pub token: Option<Token>,
    /// Certificate and key; without them, nothing is encrypted.
    pub tls: Option<TlsIdentity>,
    /// Limits on clients.
    pub limits: Limits,
    /// Pages of others that may show the page in a frame; none by default.
    pub frame_ancestors: Vec<FrameAncestor>,
}

impl Settings {
    /// Settings of an address, without token and TLS.
    pub fn new(listen: SocketAddr) -> Self {
        Self { listen, token: None, tls: None, limits: Limits::default(), frame_ancestors: Vec::new() }
    }
}

/// Bound server that does not answer yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    guard: Guard,
    tls: Option<TlsIdentity>,
    limits: Limits,
    frame_ancestors: Vec<FrameAncestor>,
}

impl Server {
    /// Binds the address.
    ///
    /// # Errors
    /// If the address is in use, or beyond loopback without a token.
    pub fn bind(settings: &Settings) -> Result<Self, ServerError> {
        let Settings { listen, token, tls, limits, frame_ancestors } = settings;
        if !listen.ip().is_loopback() && token.is_none() {
            return Err(ServerError::MissingToken(*listen));
        }
        let listener = TcpListener::bind(listen).map_err(|source| match source.kind() {
            ErrorKind::AddrInUse => ServerError::AddressInUse(*listen),
            _ => ServerError::Bind { address: *listen, source },
        })?;
        listener.set_nonblocking(true)?;
        let guard = Guard::new(listen.ip().is_loopback(), token.as_ref());
        Ok(Self {
            listener,
            guard,
            tls: tls.clone(),
            limits: limits.clone(),
            frame_ancestors: frame_ancestors.clone(),
        })
    }

    /// Bound address.
    ///
    /// # Errors
    /// If the operating system does not report it.
    pub fn address(&self) -> Result<SocketAddr, ServerError> {
        Ok(self.listener.local_addr()?)
    }

    /// Serves the content until `stop` is set. On return the log of a live scene is complete. `notify` gets what the one who
    /// serves should know.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn run(
        self,
        content: ServedContent,
        stop: &AtomicBool,
        notify: &dyn Fn(&str),
    ) -> Result<(), ServerError> {
        let state = Arc::new(ServerState::new(self.guard, self.limits.clone(), content)?);
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .max_blocking_threads(BLOCKING_THREADS)
            .thread_name("palpate viewer")
            .enable_all()
            .build()?;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            let router = routes::routes(state.clone(), &self.frame_ancestors);
            let connections = Connections { listener, router, tls: self.tls, limits: self.limits };
            tokio::select! {
                () = connections.serve(notify) => {}
                () = stopped(stop) => {}
            }
            std::io::Result::Ok(())
        });
        // Sessions may still hold the state: the scene is ended explicitly.
        if let Some(live) = &state.live {
            live.end();
        }
        runtime.shutdown_timeout(Duration::from_secs(1));
        Ok(served?)
    }
}

async fn stopped(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(STOP_POLL_INTERVAL).await;
    }
}
