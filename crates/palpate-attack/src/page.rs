//! A client that behaves as the page does, to see that others are still served.

use serde_json::Value;
use std::net::TcpStream;
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// Session of a page.
pub struct Page {
    socket: WebSocket<TcpStream>,
}

/// Wait for one message.
const PATIENCE: Duration = Duration::from_secs(10);

impl Page {
    /// Opens a session.
    pub fn open(address: &str, query: &str) -> Result<Self, String> {
        let stream = crate::http::connect(address, PATIENCE)?;
        let url = format!("ws://{address}/session{query}");
        let (socket, _) = tungstenite::client(url, stream).map_err(|error| error.to_string())?;
        Ok(Self { socket })
    }

    pub fn send(&mut self, text: &str) -> Result<(), String> {
        self.socket.send(Message::text(text.to_string())).map_err(|error| error.to_string())
    }

    pub fn next(&mut self) -> Result<Message, String> {
        self.socket.read().map_err(|error| error.to_string())
    }

    /// The next frame's step.
    pub fn step(&mut self) -> Result<u32, String> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Message::Binary(bytes) = self.next()?
                && let Some(step) = bytes.get(12..16)
            {
                return Ok(u32::from_le_bytes([step[0], step[1], step[2], step[3]]));
            }
        }
        Err(format!("no frame within {PATIENCE:?}"))
    }

    /// The next message of a type.
    pub fn message(&mut self, kind: &str) -> Result<Value, String> {
        let start = Instant::now();
        while start.elapsed() < PATIENCE {
            if let Message::Text(text) = self.next()?
                && let Ok(value) = serde_json::from_str::<Value>(text.as_str())
                && value["type"] == kind
            {
                return Ok(value);
            }
        }
        Err(format!("no message {kind:?} within {PATIENCE:?}"))
    }
}

/// Whether a good page is served: its files come, and its frames go on. Gives the seconds until then.
pub fn is_served(address: &str, query: &str) -> Result<f64, String> {
    let start = Instant::now();
    let answer = crate::http::get(address, "/");
    if answer.status != 200 {
        return Err(format!("the page itself got status {} (0: none)", answer.status));
    }
    let mut page =
        Page::open(address, query).map_err(|what| format!("a good page was not let in: {what}"))?;
    let first = page.step()?;
    loop {
        if page.step()? > first {
            return Ok(start.elapsed().as_secs_f64());
        }
        if start.elapsed() > 2 * PATIENCE {
            return Err("the scene stands still".into());
        }
    }
}
