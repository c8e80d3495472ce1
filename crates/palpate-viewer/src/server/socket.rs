//! One page's session.

use super::Hall;
use crate::live::{Command, Live, lock};
use crate::pointers::Holder;
use crate::wire::{Answer, Asked, Doing, Hello, LogTitle, MaterialDescription, StreamForm};
use axum::body::Bytes;
use axum::extract::State;
use axum::extract::ws::{CloseFrame, Message, WebSocket, WebSocketUpgrade, close_code};
use axum::response::Response;
use glam::DVec3;
use palpate::{DeviceMode, Grasp, SurfacePoint};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use tokio::sync::broadcast::error::RecvError;
use tokio::time::{MissedTickBehavior, interval, timeout};

/// What a page may send: bytes at once, messages a second, and as many at once.
const LARGEST_MESSAGE: usize = 64 << 10;
const MESSAGES_PER_S: f64 = 300.0;
const MESSAGES_AT_ONCE: f64 = 600.0;

/// Pages at once.
const MOST_VIEWERS: usize = 32;

/// A page that takes nothing for so long is gone.
const PATIENCE: Duration = Duration::from_secs(10);

/// How often pages of logs are told how far they are.
const LOG_LOOK: Duration = Duration::from_millis(300);

/// Places beyond this [m] are no hand's.
const FARTHEST_M: f64 = 1e4;

pub(super) async fn session(State(hall): State<Arc<Hall>>, upgrade: WebSocketUpgrade) -> Response {
    upgrade
        .max_message_size(LARGEST_MESSAGE)
        .max_frame_size(LARGEST_MESSAGE)
        .on_upgrade(move |socket| async move { Viewer::new(&hall, socket).serve().await })
}

/// The session is over.
struct Over;

/// A page.
struct Viewer<'h> {
    hall: &'h Hall,
    socket: WebSocket,
    number: u64,
    /// Messages that it may send now.
    allowance: f64,
    counted: Instant,
    form: StreamForm,
    every: u32,
    pictures: u32,
}

impl<'h> Viewer<'h> {
    fn new(hall: &'h Hall, socket: WebSocket) -> Self {
        Self {
            hall,
            socket,
            number: hall.next_viewer.fetch_add(1, Ordering::Relaxed),
            allowance: MESSAGES_AT_ONCE,
            counted: Instant::now(),
            form: StreamForm::Modal,
            every: 1,
            pictures: 0,
        }
    }

    async fn serve(mut self) {
        let hello = Hello {
            protocol: 1,
            version: env!("CARGO_PKG_VERSION"),
            kind: match (&self.hall.live, &self.hall.render) {
                (Some(_), _) => "live",
                (None, Some(_)) => "render",
                (None, None) => "logs",
            },
            scenes: self.hall.titles.clone(),
            logs: self.hall.logs.iter().map(|log| LogTitle { name: log.name.clone() }).collect(),
            render: self.hall.render.as_ref().map(|job| job.wish.clone()),
        };
        let hello = serde_json::to_string(&hello).unwrap_or_default();
        if self.send(Message::text(hello)).await.is_err() {
            return;
        }
        match &self.hall.live {
            Some(live) => {
                let before = live.viewers.all.fetch_add(1, Ordering::Relaxed);
                if before < MOST_VIEWERS {
                    let _ = self.serve_live(live).await;
                } else {
                    self.close(close_code::AGAIN, "too many pages look at this scene already").await;
                }
                self.want_vertices(live, false);
                live.viewers.all.fetch_sub(1, Ordering::Relaxed);
                lock(&live.pointers).release_viewer(self.number);
            }
            None => {
                let _ = self.serve_logs().await;
            }
        }
    }

    async fn serve_live(&mut self, live: &Live) -> Result<(), Over> {
        let mut events = live.events.subscribe();
        let (mut modal, mut vertices) = (live.modal.clone(), live.vertices.clone());
        let scene = live.shown.borrow().message.clone();
        self.send(Message::text(&*scene)).await?;
        let first = modal.borrow_and_update().clone();
        self.send(Message::Binary(first)).await?;
        let _ = live.commands.send(Command::ProgressCallback);
        loop {
            tokio::select! {
                biased;
                asked = self.socket.recv() => match asked {
                    Some(Ok(Message::Text(text))) => self.hear(live, &text).await?,
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Over),
                    Some(Ok(_)) => self.count().await?,
                },
                event = events.recv() => match event {
                    Ok(text) => self.send(Message::text(&*text)).await?,
                    // Some were missed: the scene may have been among them.
                    Err(RecvError::Lagged(_)) => {
                        let scene = live.shown.borrow().message.clone();
                        self.send(Message::text(&*scene)).await?;
                    }
                    Err(RecvError::Closed) => return Err(Over),
                },
                changed = modal.changed(), if self.form == StreamForm::Modal && self.every > 0 => {
                    changed.map_err(|_| Over)?;
                    let picture = modal.borrow_and_update().clone();
                    self.send_picture(picture).await?;
                }
                changed = vertices.changed(), if self.form == StreamForm::Vertices && self.every > 0 => {
                    changed.map_err(|_| Over)?;
                    let picture = vertices.borrow_and_update().clone();
                    self.send_picture(picture).await?;
                }
            }
        }
    }

    /// Logs are fetched: there is nothing to hear but that the page goes.
    async fn serve_logs(&mut self) -> Result<(), Over> {
        for log in &self.hall.logs {
            self.send(Message::text(log.message())).await?;
        }
        let mut looks = interval(LOG_LOOK);
        looks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let mut told = vec![false; self.hall.logs.len()];
        loop {
            tokio::select! {
                asked = self.socket.recv() => match asked {
                    Some(Ok(Message::Close(_)) | Err(_)) | None => return Err(Over),
                    Some(Ok(_)) => self.count().await?,
                },
                _ = looks.tick() => {
                    for (log, told) in self.hall.logs.iter().zip(&mut told).filter(|(_, told)| !**told) {
                        let (text, done) = log.progress();
                        *told = done;
                        self.send(Message::text(text)).await?;
                    }
                }
            }
        }
    }

    async fn send_picture(&mut self, picture: Bytes) -> Result<(), Over> {
        self.pictures = self.pictures.wrapping_add(1);
        if self.pictures.is_multiple_of(self.every.max(1)) {
            self.send(Message::Binary(picture)).await?;
        }
        Ok(())
    }

    async fn send(&mut self, message: Message) -> Result<(), Over> {
        match timeout(PATIENCE, self.socket.send(message)).await {
            Ok(Ok(())) => Ok(()),
            Ok(Err(_)) | Err(_) => Err(Over),
        }
    }

    async fn tell(&mut self, answer: Answer<'_>) -> Result<(), Over> {
        self.send(Message::text(answer.text())).await
    }

    async fn close(&mut self, code: u16, reason: &'static str) {
        let _ = self.send(Message::Close(Some(CloseFrame { code, reason: reason.into() }))).await;
    }

    /// Count a message; a page that sends too many is sent away.
    async fn count(&mut self) -> Result<(), Over> {
        let now = Instant::now();
        let earned = now.duration_since(self.counted).as_secs_f64() * MESSAGES_PER_S;
        (self.allowance, self.counted) = ((self.allowance + earned).min(MESSAGES_AT_ONCE) - 1.0, now);
        if self.allowance < 0.0 {
            self.close(close_code::POLICY, "too many messages").await;
            return Err(Over);
        }
        Ok(())
    }

    async fn hear(&mut self, live: &Live, text: &str) -> Result<(), Over> {
        self.count().await?;
        match serde_json::from_str(text) {
            Ok(asked) => self.obey(live, asked).await,
            Err(error) => {
                let text = format!("the page has sent what the server does not understand: {error}");
                self.tell(Answer::Error { text: &text }).await
            }
        }
    }

    async fn obey(&mut self, live: &Live, asked: Asked) -> Result<(), Over> {
        let command = match asked {
            Asked::Press { pointer, mode, position, object, triangle, weights } => {
                return self.press(live, pointer, mode, position, (object, triangle, weights)).await;
            }
            Asked::Move { pointers } => {
                let mut all = lock(&live.pointers);
                for at in pointers {
                    if let Some(position) = place(at.position) {
                        all.go((self.number, at.pointer), position);
                    }
                }
                return Ok(());
            }
            Asked::Release { pointer } => {
                lock(&live.pointers).release((self.number, pointer));
                return Ok(());
            }
            Asked::Stream { form, every } => {
                self.want_vertices(live, form == StreamForm::Vertices && every > 0);
                (self.form, self.every) = (form, every);
                return Ok(());
            }
            Asked::Pause { paused } => {
                live.playback.pause(paused);
                Command::ProgressCallback
            }
            Asked::Step => {
                live.playback.step();
                return Ok(());
            }
            Asked::Slow { slowness } => {
                live.playback.slow(slowness.clamp(1, 1000));
                Command::ProgressCallback
            }
            Asked::Reset => Command::Reset,
            Asked::Open { scene } => Command::Open(scene),
            Asked::Set(rules) => Command::PhysicsSettings(rules),
            Asked::Material { object, young, poisson, density } => {
                Command::Material(object, MaterialDescription { young, poisson, density })
            }
        };
        live.commands.send(command).map_err(|_| Over)
    }

    async fn press(
        &mut self,
        live: &Live,
        pointer: u64,
        doing: Doing,
        position: [f64; 3],
        grasp: (Option<usize>, Option<u32>, Option<[f64; 3]>),
    ) -> Result<(), Over> {
        let Some(position) = place(position) else {
            return self.tell(Answer::Error { text: "a pointer's place is three finite numbers [m]" }).await;
        };
        let mode = match doing {
            Doing::Touch => Some(DeviceMode::Touch),
            Doing::Hold => self.grasp(live, grasp).map(DeviceMode::Held),
        };
        let Some(mode) = mode else {
            let text = "what is to be held is an object, a triangle and weights of its corners, on nodes that can move";
            return self.tell(Answer::Error { text }).await;
        };
        let holder: Holder = (self.number, pointer);
        let device = lock(&live.pointers).press(holder, mode, position);
        self.tell(Answer::Granted { pointer, device }).await
    }

    fn grasp(
        &self,
        live: &Live,
        (object, triangle, weights): (Option<usize>, Option<u32>, Option<[f64; 3]>),
    ) -> Option<Grasp> {
        let (object, triangle, weights) = (object?, triangle?, weights?);
        let shown = live.shown.borrow();
        let recording = shown.stage.model.recordings().nth(object)?;
        let sum: f64 = weights.iter().sum();
        let good = weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0) && sum > 0.0;
        if !good || triangle as usize >= recording.surface.triangles.len() {
            return None;
        }
        let point = SurfacePoint { triangle, weights: weights.map(|weight| weight / sum) };
        recording.is_movable(&point).then_some(Grasp { object, point })
    }

    /// Whether surfaces are made for this page.
    fn want_vertices(&self, live: &Live, wanted: bool) {
        let before = self.form == StreamForm::Vertices && self.every > 0;
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

fn place(position: [f64; 3]) -> Option<DVec3> {
    let position = DVec3::from_array(position);
    (position.is_finite() && position.length() < FARTHEST_M).then_some(position)
}
