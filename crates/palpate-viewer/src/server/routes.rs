//! HTTP routes.

use super::body::read_body;
use super::client::Client;
use super::frame_ancestor::FrameAncestor;
use super::headers::{content_security_policy, harden};
use super::page;
use super::session;
use super::state::ServerState;
use super::upload;
use crate::static_data::StaticData;
use axum::Extension;
use axum::body::Body;
use axum::extract::{Path, Query, Request, State};
use axum::http::{StatusCode, header};
use axum::middleware::{Next, from_fn_with_state, map_response};
use axum::response::{IntoResponse, Response};
use axum::routing::{get, post};
use axum::{Json, Router};
use serde::Deserialize;
use std::sync::Arc;
use std::time::Instant;

/// Size limit of a response with frames of a log [bytes].
const MAX_FRAMES_BYTES: usize = 8 << 20;

/// Router of all addresses.
pub(super) fn routes(state: Arc<ServerState>, frame_ancestors: &[FrameAncestor]) -> Router {
    let policy = content_security_policy(frame_ancestors);
    Router::new()
        .route("/session", get(session::connect))
        .route("/scene/{generation}/object/{index}/surface", get(object_surface))
        .route("/scene/{generation}/object/{index}/mode_shapes", get(object_mode_shapes))
        .route("/scene/{generation}/obstacle/{index}/surface", get(obstacle_surface))
        .route("/log/{log}/frames", get(log_frames))
        .route("/log/{log}/series", get(log_series))
        .route("/record", post(upload::record))
        .route("/image/{index}", post(image))
        .fallback(get(page::file))
        .layer(from_fn_with_state(state.clone(), check_access))
        .layer(map_response(move |response| harden(policy.clone(), response)))
        .with_state(state)
}

async fn check_access(
    State(state): State<Arc<ServerState>>,
    Extension(client): Extension<Client>,
    request: Request,
    next: Next,
) -> Response {
    match state.guard.check(&request, client.address, Instant::now()) {
        Err(rejection) => rejection.into_response(),
        Ok(()) => next.run(request).await,
    }
}

fn not_found() -> Response {
    (StatusCode::NOT_FOUND, "there is nothing here").into_response()
}

/// Runs blocking work outside of the async threads.
async fn blocking(work: impl FnOnce() -> Response + Send + 'static) -> Response {
    let failed = |_| StatusCode::INTERNAL_SERVER_ERROR.into_response();
    tokio::task::spawn_blocking(work).await.unwrap_or_else(failed)
}

/// Response with static data of a generation, from the cache.
async fn static_data(state: Arc<ServerState>, generation: u32, data: StaticData) -> Response {
    let Some(model) = state.model(generation) else { return not_found() };
    blocking(move || {
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        let bytes = state.cache.get((generation, data), || data.encode(&model));
        bytes.map_or_else(not_found, |bytes| (headers, bytes).into_response())
    })
    .await
}

async fn object_surface(State(state): State<Arc<ServerState>>, Path(part): Path<(u32, usize)>) -> Response {
    static_data(state, part.0, StaticData::ObjectSurface(part.1)).await
}

async fn object_mode_shapes(
    State(state): State<Arc<ServerState>>,
    Path(part): Path<(u32, usize)>,
) -> Response {
    static_data(state, part.0, StaticData::ModeShapes(part.1)).await
}

async fn obstacle_surface(State(state): State<Arc<ServerState>>, Path(part): Path<(u32, usize)>) -> Response {
    static_data(state, part.0, StaticData::ObstacleSurface(part.1)).await
}

#[derive(Deserialize)]
struct FrameRange {
    from: usize,
    count: usize,
}

async fn log_frames(
    State(state): State<Arc<ServerState>>,
    Path(log): Path<usize>,
    Query(FrameRange { from, count }): Query<FrameRange>,
) -> Response {
    let Some(log) = state.logs.get(log).cloned() else { return not_found() };
    blocking(move || {
        let headers = [(header::CONTENT_TYPE, "application/octet-stream")];
        (headers, log.frames(from, count, MAX_FRAMES_BYTES)).into_response()
    })
    .await
}

async fn log_series(State(state): State<Arc<ServerState>>, Path(log): Path<usize>) -> Response {
    let Some(log) = state.logs.get(log).cloned() else { return not_found() };
    blocking(move || Json(log.series()).into_response()).await
}

async fn image(State(state): State<Arc<ServerState>>, Path(index): Path<u64>, body: Body) -> Response {
    let Some(job) = &state.render else { return not_found() };
    let mut png = Vec::new();
    if let Err(error) = read_body(body, &state.limits, |part| png.extend_from_slice(part)).await {
        return error.into_response();
    }
    match job.images.send((index, png)) {
        Ok(()) => StatusCode::NO_CONTENT.into_response(),
        Err(_) => StatusCode::GONE.into_response(),
    }
}
