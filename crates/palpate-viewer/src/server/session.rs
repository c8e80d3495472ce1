//! WebSocket session of one page.

use super::client::Client;
use super::state::ServerState;
use crate::live::{Command, LiveScene};
use crate::page_requests::{Effect, SceneControls, SceneRequest, unreadable};
use crate::pointers::lock;
use crate::protocol::{FrameFormat, Hello, LogEntry, PROTOCOL};
use axum::Extension;
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::response::Response;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{Interval, MissedTickBehavior, interval, timeout};

/// Size limit of a message from a page [bytes].
const MAX_MESSAGE_BYTES: usize = 64 << 10;

/// Rate limit of messages from a page [1/s].
const MESSAGES_PER_S: f64 = 300.0;

/// Burst limit of messages from a page.
const MAX_MESSAGE_BURST: f64 = 600.0;

/// Maximum number of pages.
const MAX_VIEWERS: usize = 32;

/// Interval of progress messages of logs.
const LOG_PROGRESS_INTERVAL: Duration = Duration::from_millis(300);

/// Handler of `/session`.
pub(super) async fn connect(
    State(state): State<Arc<ServerState>>,
    Extension(client): Extension<Client>,
    upgrade: WebSocketUpgrade,
) -> Response {
    upgrade.max_message_size(MAX_MESSAGE_BYTES).max_frame_size(MAX_MESSAGE_BYTES).on_upgrade(
        move |socket| async move {
            PageSession::new(&state, socket).serve().await;
            drop(client.place);
        },
    )
}

/// End of a session.
struct SessionEnd;

/// Session of one page.
struct PageSession<'s> {
    state: &'s ServerState,
    socket: WebSocket,
    viewer: u64,
    /// Number of messages that the page may send now (token bucket).
    allowance: f64,
    allowance_updated: Instant,
    format: FrameFormat,
    /// Every n-th frame is sent; 0: none.
    stride: u32,
    frames: u32,
    /// Whether it gets the sound.
    hears: bool,
    /// Time of the newest message or pong.
    heard: Instant,
}

impl<'s> PageSession<'s> {
    fn new(state: &'s ServerState, socket: WebSocket) -> Self {
        Self {
            state,
            socket,
            viewer: state.next_viewer.fetch_add(1, Ordering::Relaxed),
            allowance: MAX_MESSAGE_BURST,
            allowance_updated: Instant::now(),
            format: FrameFormat::Modal,
            stride: 1,
            frames: 0,
            hears: false,
            heard: Instant::now(),
        }
    }

    async fn serve(mut self) {
        let hello = Hello {
            protocol: PROTOCOL,
            version: env!("CARGO_PKG_VERSION"),
            kind: match (&self.state.live, &self.state.render) {
                (Some(_), _) => "live",
                (None, Some(_)) => "render",
                (None, None) => "logs",
            },
            viewer: self.viewer,
            records: self.state.live.is_some(),
            scenes: self.state.scenes.clone(),
            logs: self.state.logs.iter().map(|log| LogEntry { name: log.name.clone() }).collect(),
            render: self.state.render.as_ref().map(|job| job.request.clone()),
        };
        let hello = serde_json::to_string(&hello).unwrap_or_default();
        if self.send(Message::text(hello)).await.is_err() {
            return;
        }
        match &self.state.live {
            Some(live) => {
                let before = live.viewers.all.fetch_add(1, Ordering::Relaxed);
                if before < MAX_VIEWERS {
                    let _ = self.serve_live(live).await;
                } else {
                    self.close(close_code::AGAIN, "too many pages show this scene already").await;
                }
                self.count_vertex_stream(live, false);
                self.switch_sound(live, false);
                live.viewers.all.fetch_sub(1, Ordering::Relaxed);
                lock(&live.pointers).release_viewer(self.viewer);
                live.job_slot.cancel_of(self.viewer);
            }
            None => {
                let _ = self.serve_logs().await;
            }
        }
    }

    async fn serve_live(&mut self, live: &LiveScene) -> Result<(), SessionEnd> {
        let mut events = live.events.subscribe();
        let (mut modal, mut vertices) = (live.modal.clone(), live.vertices.clone());
        let scene = live.current.borrow().message.clone();
        self.send(Message::text(&*scene)).await?;
        let first = modal.borrow_and_update().clone();
        self.send(Message::Binary(first)).await?;
        live.commands.push(Command::SendStatus);
        let mut pings = self.pings();
        let mut sound = live.sound.subscribe();
        loop {
            tokio::select! {
                biased;
                received = self.socket.recv() => match received {
                    Some(Ok(Message::Text(text))) => self.receive(live, &text).await?,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(SessionEnd),
                    Some(Ok(_)) => self.count_message().await?,
                },
                _ = pings.tick() => self.ping().await?,
                event = events.recv() => match event {
                    Ok(text) => self.send(Message::text(&*text)).await?,
                    // Some messages were skipped, perhaps the scene message.
                    Err(RecvError::Lagged(_)) => {
                        let scene = live.current.borrow().message.clone();
                        self.send(Message::text(&*scene)).await?;
                    }
                    Err(RecvError::Closed) => return Err(SessionEnd),
                },
                block = sound.recv(), if self.hears => match block {
                    Ok(block) => self.send(Message::Binary(block)).await?,
                    // What is late is not heard any more.
                    Err(RecvError::Lagged(_)) => sound = sound.resubscribe(),
                    Err(RecvError::Closed) => return Err(SessionEnd),
                },
                changed = modal.changed(), if self.format == FrameFormat::Modal && self.stride > 0 => {
                    changed.map_err(|_| SessionEnd)?;
                    let frame = modal.borrow_and_update().clone();
                    self.send_frame(frame).await?;
                }
                changed = vertices.changed(), if self.format == FrameFormat::Vertices && self.stride > 0 => {
                    changed.map_err(|_| SessionEnd)?;
                    let frame = vertices.borrow_and_update().clone();
                    self.send_frame(frame).await?;
                }
            }
        }
    }

    /// Sends progress until the page disconnects; it fetches the frames by HTTP.
    async fn serve_logs(&mut self) -> Result<(), SessionEnd> {
        for log in &self.state.logs {
            self.send(Message::text(log.scene_message())).await?;
        }
        let mut ticks = interval(LOG_PROGRESS_INTERVAL);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut finished = vec![false; self.state.logs.len()];
        let mut pings = self.pings();
        loop {
            tokio::select! {
                received = self.socket.recv() => match received {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(SessionEnd),
                    Some(Ok(_)) => self.count_message().await?,
                },
                _ = pings.tick() => self.ping().await?,
                _ = ticks.tick() => {
                    for (log, finished) in self.state.logs.iter().zip(&mut finished).filter(|(_, finished)| !**finished) {
                        let (text, done) = log.progress();
                        *finished = done;
                        self.send(Message::text(text)).await?;
                    }
                }
            }
        }
    }

    async fn send_frame(&mut self, frame: Bytes) -> Result<(), SessionEnd> {
        self.frames = self.frames.wrapping_add(1);
        if self.frames.is_multiple_of(self.stride.max(1)) {
            self.send(Message::Binary(frame)).await?;
        }
        Ok(())
    }

    async fn send(&mut self, message: Message) -> Result<(), SessionEnd> {
        match timeout(self.state.limits.write_time, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(SessionEnd),
        }
    }

    fn pings(&self) -> Interval {
        let mut pings = interval((self.state.limits.silence / 3).max(Duration::from_millis(1)));
        pings.set_missed_tick_behavior(MissedTickBehavior::Delay);
        pings
    }

    /// Pings the page; one that is silent is disconnected.
    async fn ping(&mut self) -> Result<(), SessionEnd> {
        if self.heard.elapsed() > self.state.limits.silence {
            self.close(close_code::AWAY, "the page does not answer").await;
            return Err(SessionEnd);
        }
        self.send(Message::Ping(Bytes::new())).await
    }

    async fn close(&mut self, code: u16, reason: &'static str) {
        let _ = self.send(Message::Close(Some(CloseFrame { code, reason: reason.into() }))).await;
    }

    /// Counts a message; a page that exceeds the rate limit is disconnected.
    async fn count_message(&mut self) -> Result<(), SessionEnd> {
        let now = Instant::now();
        self.heard = now;
        let earned = now.duration_since(self.allowance_updated).as_secs_f64() * MESSAGES_PER_S;
        (self.allowance, self.allowance_updated) =
            ((self.allowance + earned).min(MAX_MESSAGE_BURST) - 1.0, now);
        if self.allowance < 0.0 {
            self.close(close_code::POLICY, "too many messages").await;
            return Err(SessionEnd);
        }
        Ok(())
    }

    async fn receive(&mut self, live: &LiveScene, text: &str) -> Result<(), SessionEnd> {
        self.count_message().await?;
        let message = match serde_json::from_str(text) {
            Ok(message) => message,
            Err(error) => return self.send(Message::text(unreadable(&error))).await,
        };
        let current = live.current.borrow().clone();
        let (pointers, playback) = (&*live.pointers, &*live.playback);
        let controls = SceneControls { model: &current.scene.model, pointers, playback };
        match controls.apply(self.viewer, message) {
            Effect::None => {}
            Effect::Reply(text) => return self.send(Message::text(text)).await,
            Effect::Stream(format, stride) => {
                self.count_vertex_stream(live, format == FrameFormat::Vertices && stride > 0);
                (self.format, self.stride) = (format, stride);
                // A page that has loaded a paused scene needs a frame.
                let newest = match format {
                    FrameFormat::Modal => live.modal.borrow().clone(),
                    FrameFormat::Vertices => live.vertices.borrow().clone(),
                };
                if stride > 0 && !newest.is_empty() {
                    return self.send(Message::Binary(newest)).await;
                }
            }
            Effect::Sound(on) => self.switch_sound(live, on),
            Effect::Scene(request) => self.request(live, request),
        }
        Ok(())
    }

    fn request(&self, live: &LiveScene, request: SceneRequest) {
        live.commands.push(match request {
            SceneRequest::CancelJob => return live.job_slot.cancel(),
            SceneRequest::Open(scene) => Command::Open(scene, self.viewer),
            SceneRequest::Reset => Command::Reset,
            SceneRequest::ChangePhysics(settings) => Command::ChangePhysics(settings),
            SceneRequest::ChangeMaterial(object, material) => {
                Command::ChangeMaterial(object, material, self.viewer)
            }
            SceneRequest::SendStatus => Command::SendStatus,
        });
    }

    /// Begins or ends to send the sound.
    fn switch_sound(&mut self, live: &LiveScene, on: bool) {
        if on != self.hears {
            self.hears = on;
            live.sound.count(on);
        }
    }

    /// Updates the number of vertex streams; `wanted`: whether this page streams vertex frames from now on.
    fn count_vertex_stream(&self, live: &LiveScene, wanted: bool) {
        let before = self.format == FrameFormat::Vertices && self.stride > 0;
        match (before, wanted) {
            (false, true) => {
                live.viewers.vertices.fetch_add(1, Ordering::Relaxed);
            }
            (true, false) => {
                live.viewers.vertices.fetch_sub(1, Ordering::Relaxed);
            }
            _ => {}
        }
    }
}
