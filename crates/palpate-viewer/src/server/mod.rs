//! Listening, and what is answered.

mod files;
mod guard;
mod socket;

use crate::live;
use crate::log_show::LogFrames;
use crate::stage::{SceneProvider, Upload, ViewerScene};
use crate::wire::{MaterialDescription, RenderRequest, SceneSummary, shapes_bytes, surface_bytes};
use axum::body::{Bytes, to_bytes};
use axum::extract::{DefaultBodyLimit, Path, Query, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use guard::Guard;
use palpate::Shape;
use palpate_haptics::Scheduling;
use serde::Deserialize;
use std::collections::HashMap;
use std::net::{SocketAddr, TcpListener};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;
use tokio::sync::Semaphore;

/// Largest mesh file that a page may send, and largest picture.
const LARGEST_BODY: usize = 64 << 20;

/// Pictures of a log go out in pieces of so many bytes.
const LARGEST_PIECE: usize = 8 << 20;

/// Modes that are recorded when nothing is said, and at most.
const MODES: usize = 100;
const MOST_MODES: usize = 400;

/// Between two looks at whether to stop.
const LOOK: Duration = Duration::from_millis(50);

/// Where and for whom.
#[derive(Debug, Clone)]
pub struct Settings {
    /// Address and port; port 0 takes a free one.
    pub listen: SocketAddr,
    /// What every request must bring; needed beyond loopback.
    pub token: Option<String>,
}

/// A scene to run and look at.
pub struct Live {
    /// Makes its scenes.
    pub workshop: Arc<dyn SceneProvider>,
    /// What is shown first.
    pub first: ViewerScene,
    /// What the force process asks of the system.
    pub scheduling: Scheduling,
}

/// Pictures that a page is to draw, and where they go by their numbers.
pub struct RenderJob {
    /// What to draw.
    pub wish: RenderRequest,
    /// PNG files.
    pub pictures: Sender<(u64, Vec<u8>)>,
}

/// What there is to see.
pub enum ServedContent {
    /// A scene that runs.
    Live(Box<Live>),
    /// Logs, beside one another.
    Logs(Vec<Arc<LogFrames>>),
    /// A log whose pictures are drawn by a page without a person.
    Render(Arc<LogFrames>, RenderJob),
}

/// A server that listens and has not begun to answer.
#[derive(Debug)]
pub struct Server {
    listener: TcpListener,
    guard: Guard,
}

/// What all requests share.
pub(crate) struct Hall {
    live: Option<live::Live>,
    titles: Vec<SceneSummary>,
    logs: Vec<Arc<LogFrames>>,
    render: Option<RenderJob>,
    guard: Guard,
    kept: Kept,
    /// Whether a mesh is on its way: one at a time.
    uploads: Semaphore,
    /// Viewers are known by numbers.
    next_viewer: AtomicU64,
}

impl Server {
    /// Listen.
    ///
    /// # Errors
    /// When the address is taken, or beyond loopback without a token.
    pub fn bind(settings: &Settings) -> Result<Self, String> {
        let Settings { listen, token } = settings;
        if !listen.ip().is_loopback() && token.as_ref().is_none_or(|token| token.len() < 8) {
            return Err(format!(
                "{listen} can be reached from other machines: give a token of 8 characters or more (--token), without which \
                 nobody gets in"
            ));
        }
        let listener = TcpListener::bind(listen).map_err(|e| match e.kind() {
            std::io::ErrorKind::AddrInUse => {
                format!("something listens at {listen} already: stop it, or take another port (--listen)")
            }
            _ => format!("cannot listen at {listen}: {e}"),
        })?;
        listener.set_nonblocking(true).map_err(|e| e.to_string())?;
        let guard = Guard::new(listen.ip().is_loopback(), token.clone());
        Ok(Self { listener, guard })
    }

    /// Where it listens.
    ///
    /// # Errors
    /// When the system does not tell.
    pub fn address(&self) -> Result<SocketAddr, String> {
        self.listener.local_addr().map_err(|e| e.to_string())
    }

    /// Answer until `stop` is set.
    ///
    /// # Errors
    /// When a thread can't be started.
    pub fn run(self, exhibit: ServedContent, stop: &AtomicBool) -> Result<(), String> {
        let said = |e: std::io::Error| e.to_string();
        let mut hall = Hall {
            live: None,
            titles: Vec::new(),
            logs: Vec::new(),
            render: None,
            guard: self.guard,
            kept: Kept::default(),
            uploads: Semaphore::new(1),
            next_viewer: AtomicU64::new(1),
        };
        match exhibit {
            ServedContent::Live(live) => {
                let Live { workshop, first, scheduling } = *live;
                hall.titles = workshop.titles();
                hall.live = Some(live::Live::new(workshop, first, scheduling).map_err(said)?);
            }
            ServedContent::Logs(logs) => hall.logs = logs,
            ServedContent::Render(log, job) => (hall.logs, hall.render) = (vec![log], Some(job)),
        }
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(2)
            .thread_name("palpate viewer")
            .enable_all()
            .build()
            .map_err(said)?;
        let hall = Arc::new(hall);
        let served = runtime.block_on(async {
            let listener = tokio::net::TcpListener::from_std(self.listener).map_err(said)?;
            let routes = routes(hall.clone());
            tokio::select! {
                served = axum::serve(listener, routes) => served.map_err(said),
                () = stopped(stop) => Ok(()),
            }
        });
        // Whoever still holds the hall: the scene ends here.
        if let Some(live) = &hall.live {
            live.end();
        }
        runtime.shutdown_timeout(Duration::from_secs(1));
        served
    }
}

async fn stopped(stop: &AtomicBool) {
    while !stop.load(Ordering::Relaxed) {
        tokio::time::sleep(LOOK).await;
    }
}

fn routes(hall: Arc<Hall>) -> Router {
    Router::new()
        .route("/session", get(socket::session))
        .route("/scene/{generation}/object/{at}/surface", get(object_surface))
        .route("/scene/{generation}/object/{at}/shapes", get(object_shapes))
        .route("/scene/{generation}/obstacle/{at}/surface", get(obstacle_surface))
        .route("/log/{log}/frames", get(log_frames))
        .route("/log/{log}/series", get(log_series))
        .route("/record", post(record))
        .route("/picture/{number}", post(picture))
        .fallback(get(files::file))
        .layer(DefaultBodyLimit::max(LARGEST_BODY))
        .layer(from_fn_with_state(hall.clone(), guarded))
        .with_state(hall)
}

async fn guarded(State(hall): State<Arc<Hall>>, request: Request, next: Next) -> Response {
    match hall.guard.refuses(&request) {
        Some(why) => (StatusCode::FORBIDDEN, why).into_response(),
        None => next.run(request).await,
    }
}

fn missing() -> Response {
    (StatusCode::NOT_FOUND, "there is nothing here").into_response()
}

/// Work that takes long enough to keep others waiting.
async fn aside(work: impl FnOnce() -> Response + Send + 'static) -> Response {
    let failed = |_| StatusCode::INTERNAL_SERVER_ERROR.into_response();
    tokio::task::spawn_blocking(work).await.unwrap_or_else(failed)
}

/// What never changes under its address: made once, however many ask for it.
#[derive(Default)]
struct Kept(Mutex<HashMap<Address, Bytes>>);

/// A generation, what of it, and of which of its parts.
type Address = (u32, &'static str, usize);

impl Kept {
    fn get(&self, address: Address, make: impl FnOnce() -> Option<Vec<u8>>) -> Response {
        let mut kept = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        // Of a scene that is shown no more nobody asks; two logs have two generations.
        kept.retain(|(generation, ..), _| *generation + 1 >= address.0);
        let bytes = match kept.get(&address) {
            Some(bytes) => bytes.clone(),
            None => {
                let Some(made) = make() else { return missing() };
                kept.entry(address).or_insert(made.into()).clone()
            }
        };
        let headers = [
            (header::CONTENT_TYPE, "application/octet-stream"),
            (header::CACHE_CONTROL, "private, max-age=3600, immutable"),
        ];
        (headers, bytes).into_response()
    }
}

impl Hall {
    /// The scene of a generation, if it is shown.
    fn model(&self, generation: u32) -> Option<Arc<palpate::Model>> {
        match &self.live {
            Some(live) => {
                let shown = live.shown.borrow().clone();
                (shown.generation == generation).then(|| shown.stage.model.clone())
            }
            None => self.logs.get(generation as usize).map(|log| log.model.clone()),
        }
    }
}

async fn object_surface(
    State(hall): State<Arc<Hall>>,
    Path((generation, at)): Path<(u32, usize)>,
) -> Response {
    let Some(model) = hall.model(generation) else { return missing() };
    let make = move || {
        let surface = &model.recordings().nth(at)?.surface;
        Some(surface_bytes(&surface.positions, &surface.triangles))
    };
    aside(move || hall.kept.get((generation, "surface", at), make)).await
}

async fn object_shapes(
    State(hall): State<Arc<Hall>>,
    Path((generation, at)): Path<(u32, usize)>,
) -> Response {
    let Some(model) = hall.model(generation) else { return missing() };
    let make = move || {
        let recording = model.recordings().nth(at)?;
        Some(shapes_bytes(&recording.modes, recording.surface.positions.len()))
    };
    aside(move || hall.kept.get((generation, "shapes", at), make)).await
}

async fn obstacle_surface(
    State(hall): State<Arc<Hall>>,
    Path((generation, at)): Path<(u32, usize)>,
) -> Response {
    let Some(model) = hall.model(generation) else { return missing() };
    let make = move || match &model.parameters().obstacles.get(at)?.shape {
        Shape::Mesh(mesh) => Some(surface_bytes(&mesh.surface().positions, &mesh.surface().triangles)),
        _ => None,
    };
    aside(move || hall.kept.get((generation, "obstacle", at), make)).await
}

#[derive(Deserialize)]
struct Span {
    from: usize,
    count: usize,
}

async fn log_frames(
    State(hall): State<Arc<Hall>>,
    Path(log): Path<usize>,
    Query(Span { from, count }): Query<Span>,
) -> Response {
    let Some(log) = hall.logs.get(log).cloned() else { return missing() };
    aside(move || {
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        (headers, log.frames(from, count, LARGEST_PIECE)).into_response()
    })
    .await
}

async fn log_series(State(hall): State<Arc<Hall>>, Path(log): Path<usize>) -> Response {
    let Some(log) = hall.logs.get(log).cloned() else { return missing() };
    aside(move || Json(log.series()).into_response()).await
}

#[derive(Deserialize)]
struct RecordWish {
    name: String,
    young: f64,
    poisson: f64,
    density: f64,
    scale: Option<f64>,
    modes: Option<usize>,
}

async fn record(State(hall): State<Arc<Hall>>, Query(wish): Query<RecordWish>, request: Request) -> Response {
    let Some(live) = &hall.live else { return missing() };
    let Ok(_alone) = hall.uploads.try_acquire() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "another mesh is on its way").into_response();
    };
    let Ok(body) = to_bytes(request.into_body(), LARGEST_BODY).await else {
        let text = format!("a mesh file has {} MB at most: use palpate record", LARGEST_BODY >> 20);
        return (StatusCode::PAYLOAD_TOO_LARGE, text).into_response();
    };
    let scale = wish.scale.unwrap_or(1.0);
    let numbers = [wish.young, wish.poisson, wish.density, scale];
    if !numbers.iter().all(|number| number.is_finite()) || scale <= 0.0 {
        let text = "young, poisson, density and scale are numbers, and scale is above 0";
        return (StatusCode::BAD_REQUEST, text).into_response();
    }
    let upload = Upload {
        name: wish.name,
        bytes: body.to_vec(),
        scale,
        material: MaterialDescription { young: wish.young, poisson: wish.poisson, density: wish.density },
        modes: wish.modes.unwrap_or(MODES).clamp(1, MOST_MODES),
    };
    if !live.claim() {
        return (StatusCode::CONFLICT, live::BUSY).into_response();
    }
    match live.commands.send(live::Command::Record(upload)) {
        Ok(()) => StatusCode::ACCEPTED.into_response(),
        Err(_) => StatusCode::SERVICE_UNAVAILABLE.into_response(),
    }
}

async fn picture(State(hall): State<Arc<Hall>>, Path(number): Path<u64>, body: Bytes) -> Response {
    let Some(job) = &hall.render else { return missing() };
    match job.pictures.send((number, body.to_vec())) {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(_) => StatusCode::GONE.into_response(),
    }
}
