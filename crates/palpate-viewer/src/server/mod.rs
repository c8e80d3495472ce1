//! HTTP and WebSocket server.

mod content;
mod guard;
mod page;
mod routes;
mod session;
mod state;
mod upload;

pub use content::{Live, RenderJob, ServedContent};

use crate::error::ServerError;
use guard::Guard;
use state::ServerState;
use std::io::ErrorKind;
use std::net::{SocketAddr, TcpListener};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

/// Minimum length of a token [characters].
const MIN_TOKEN_LENGTH: usize = 8;

/// Interval at which the stop flag is polled.
const STOP_POLL_INTERVAL: Duration = Duration::from_millis(50);

/// Address and access settings.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address and port; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Token of every request; required beyond loopback.
    pub token: Option<String>,
}

/// Bound server that does not answer yet.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    guard: Guard,
}

impl Server {
    /// Binds the address.
    ///
    /// # Errors
    /// If the address is in use, or beyond loopback without a token.
    pub fn bind(settings: &Settings) -> Result<Self, ServerError> {
        let Settings { listen, token } = settings;
        let short = |token: &String| token.len() < MIN_TOKEN_LENGTH;
        if !listen.ip().is_loopback() && token.as_ref().is_none_or(short) {
            return Err(ServerError::MissingToken(*listen));
        }
        let listener = TcpListener::bind(listen).map_err(|source| match source.kind() {
            ErrorKind::AddrInUse => ServerError::AddressInUse(*listen),
            _ => ServerError::Bind { address: *listen, source },
        })?;
        listener.set_nonblocking(true)?;
        let guard = Guard::new(listen.ip().is_loopback(), token.clone());
        Ok(Self { listener, guard })
    }

    /// Bound address.
    ///
    /// # Errors
    /// If the operating system does not report it.
    pub fn address(&self) -> Result<SocketAddr, ServerError> {
        Ok(self.listener.local_addr()?)
    }

    /// Serves the content until `stop` is set. On return the log of a live scene is complete.
    ///
    /// # Errors
    /// If a thread cannot be started.
    pub fn run(self, content: ServedContent, stop: &AtomicBool) -> Result<(), ServerError> {
        let state = Arc::new(ServerState::new(self.guard, content)?);
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .thread_name("palpate viewer")
            .enable_all()
            .build()?;
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener)?;
            let router = routes::routes(state.clone());
            tokio::select! {
                served = axum::serve(listener, router) => served,
                () = stopped(stop) => Ok(()),
            }
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
