//! Connections: a bounded number, each with a time for what it must send and take.

use super::client::{Client, Place, Shares};
use super::limits::Limits;
use super::paced_stream::PacedStream;
use super::tls::TlsIdentity;
use axum::Router;
use hyper::server::conn::http1;
use hyper::service::service_fn;
use hyper_util::rt::{TokioIo, TokioTimer};
use std::io::{self, ErrorKind};
use std::sync::Arc;
use std::time::Duration;
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};
use tokio::net::{TcpListener, TcpStream};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{sleep, timeout};
use tower_service::Service;

/// Size limit of the head of a request [bytes]; also of what is buffered to be sent.
const MAX_HEAD_BYTES: usize = 32 << 10;

/// Refused connections that are told so at a time; further ones are closed.
const MAX_REFUSALS: usize = 32;

/// Longest time to tell a client that it is refused.
const REFUSAL_TIME: Duration = Duration::from_secs(2);

/// Pause after a connection that cannot be accepted: no file descriptor is left.
const ACCEPT_RETRY_INTERVAL: Duration = Duration::from_millis(100);

/// Listener with the rules of its connections.
pub(super) struct Connections {
    pub listener: TcpListener,
    pub router: Router,
    pub tls: Option<TlsIdentity>,
    pub limits: Limits,
}

impl Connections {
    /// Serves all connections; tells once that there were too many.
    pub async fn serve(self, notify: &dyn Fn(&str)) {
        let Self { listener, router, tls, limits } = self;
        let places = Arc::new(Semaphore::new(limits.connections));
        let shares = Arc::new(Shares::default());
        let refusals = Arc::new(Semaphore::new(MAX_REFUSALS));
        let mut told = false;
        loop {
            let (stream, address) = match listener.accept().await {
                Ok(accepted) => accepted,
                // The client has left already.
                Err(error) if error.kind() == ErrorKind::ConnectionAborted => continue,
                Err(_) => {
                    sleep(ACCEPT_RETRY_INTERVAL).await;
                    continue;
                }
            };
            let address = address.ip().to_canonical();
            // Half of the places for one network: a stranger without the token does not keep all others out.
            let most = if address.is_loopback() { limits.connections } else { share_of(limits.connections) };
            let share = shares.take(address, most);
            let (Ok(permit), Some(share)) = (places.clone().try_acquire_owned(), share) else {
                if !told {
                    told = true;
                    notify(&refusal(limits.connections));
                }
                // A client of TLS could not read it.
                if let (Ok(permit), None) = (refusals.clone().try_acquire_owned(), &tls) {
                    tokio::spawn(refuse(stream, limits.connections, permit));
                }
                continue;
            };
            let client = Client { address, place: Arc::new(Place { _permit: permit, _share: share }) };
            tokio::spawn(serve_connection(stream, client, router.clone(), tls.clone(), limits.clone()));
        }
    }
}

/// Connections that one network beyond this machine may have.
fn share_of(connections: usize) -> usize {
    connections.div_ceil(2)
}

/// Text for a client that is refused, and for the terminal.
fn refusal(connections: usize) -> String {
    format!(
        "no connection of the viewer is free, of {connections} in all and {} for an address of another machine: close a page and \
         try again, or allow more (--max-connections)",
        share_of(connections)
    )
}

/// Tells a client that there is no place for it.
async fn refuse(mut stream: TcpStream, connections: usize, _permit: OwnedSemaphorePermit) {
    let text = refusal(connections);
    let head = "HTTP/1.1 503 Service Unavailable\r\ncontent-type: text/plain; charset=utf-8\r\nretry-after: 10\r\nconnection: close";
    let answer = format!("{head}\r\ncontent-length: {}\r\n\r\n{text}", text.len());
    let told = async {
        stream.write_all(answer.as_bytes()).await?;
        stream.shutdown().await?;
        // Closing with unread data would reset the connection, and the client might not see the answer.
        let mut unread = [0; 1024];
        while stream.read(&mut unread).await? > 0 {}
        io::Result::Ok(())
    };
    let _ = timeout(REFUSAL_TIME, told).await;
}

async fn serve_connection(
    stream: TcpStream,
    client: Client,
    router: Router,
    tls: Option<TlsIdentity>,
    limits: Limits,
) {
    // Frames and forces are small, and late ones are useless.
    let _ = stream.set_nodelay(true);
    let stream = PacedStream::new(stream, &limits);
    match &tls {
        None => serve_http(stream, client, router, &limits).await,
        Some(tls) => {
            if let Ok(Ok(stream)) = timeout(limits.header_time, tls.acceptor().accept(stream)).await {
                serve_http(stream, client, router, &limits).await;
            }
        }
    }
}

/// Serves the requests of a connection, which may end as a session.
async fn serve_http(
    stream: impl AsyncRead + AsyncWrite + Unpin + Send + 'static,
    client: Client,
    router: Router,
    limits: &Limits,
) {
    let service = service_fn(move |mut request| {
        axum::http::Request::extensions_mut(&mut request).insert(client.clone());
        router.clone().call(request)
    });
    // Whatever ends a connection concerns its client alone.
    let _ = http1::Builder::new()
        .timer(TokioTimer::new())
        .header_read_timeout(limits.header_time)
        .max_buf_size(MAX_HEAD_BYTES)
        .serve_connection(TokioIo::new(stream), service)
        .with_upgrades()
        .await;
}
