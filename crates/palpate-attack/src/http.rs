//! Requests by hand: what a browser would never send.

use socket2::{Domain, Socket, Type};
use std::io::{Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpStream};
use std::time::Duration;

/// Answer of a server.
#[derive(Debug, Clone, Default)]
pub struct Answer {
    /// Status; 0 where there was none.
    pub status: u16,
    /// Head in lower case.
    pub head: String,
    pub body: Vec<u8>,
}

/// Connection with a time-out for each read and write.
pub fn connect(address: &str, patience: Duration) -> Result<TcpStream, String> {
    connect_from(Ipv4Addr::LOCALHOST, address, patience)
}

/// Connection from another address of loopback.
pub fn connect_from(from: Ipv4Addr, address: &str, patience: Duration) -> Result<TcpStream, String> {
    let parsed: SocketAddr = address.parse().map_err(|error| format!("{address}: {error}"))?;
    let connected = || {
        let socket = Socket::new(Domain::IPV4, Type::STREAM, None)?;
        socket.bind(&SocketAddr::from((from, 0)).into())?;
        socket.connect_timeout(&parsed.into(), patience)?;
        Ok::<_, std::io::Error>(TcpStream::from(socket))
    };
    let stream = connected().map_err(|error| error.to_string())?;
    let set = stream.set_read_timeout(Some(patience)).and_then(|()| stream.set_write_timeout(Some(patience)));
    set.map_err(|error| error.to_string())?;
    Ok(stream)
}

/// Sends bytes and reads to the end.
pub fn exchange(address: &str, request: &[u8], patience: Duration) -> Answer {
    let Ok(mut stream) = connect(address, patience) else { return Answer::default() };
    let _ = stream.write_all(request);
    read_answer(&mut stream)
}

/// Reads an answer to the end of the connection.
pub fn read_answer(stream: &mut TcpStream) -> Answer {
    let mut bytes = Vec::new();
    let _ = stream.take(8 << 20).read_to_end(&mut bytes);
    let end = bytes.windows(4).position(|four| four == b"\r\n\r\n").map_or(bytes.len(), |at| at + 4);
    let head = String::from_utf8_lossy(&bytes[..end]).to_lowercase();
    let status = head.split(' ').nth(1).and_then(|status| status.parse().ok()).unwrap_or(0);
    Answer { status, head, body: bytes.split_off(end) }
}

/// Request with a head of its own and the right host unless the head names one.
pub fn request(address: &str, first_line: &str, headers: &str, body: &[u8]) -> Answer {
    let host = if headers.contains("Host:") { String::new() } else { format!("Host: {address}\r\n") };
    let length = body.len();
    let head = format!(
        "{first_line} HTTP/1.1\r\n{host}{headers}Content-Length: {length}\r\nConnection: close\r\n\r\n"
    );
    exchange(address, &[head.as_bytes(), body].concat(), Duration::from_secs(5))
}

pub fn get(address: &str, path: &str) -> Answer {
    request(address, &format!("GET {path}"), "", b"")
}
