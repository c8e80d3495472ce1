//! Upload of a mesh file that is to be recorded.

use super::state::ServerState;
use crate::error::SceneError;
use crate::live::Command;
use crate::protocol::MaterialDescription;
use crate::scene_provider::Upload;
use axum::body::to_bytes;
use axum::extract::{Query, Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use std::sync::Arc;

/// Size limit of a request body: a mesh file or an image [bytes].
pub(super) const MAX_BODY_BYTES: usize = 64 << 20;

/// Default number of modes.
const DEFAULT_MODES: usize = 100;

/// Maximum number of modes.
const MAX_MODES: usize = 400;

/// Query parameters of `/record`.
#[derive(Deserialize)]
pub(super) struct RecordQuery {
    name: String,
    young: f64,
    poisson: f64,
    density: f64,
    scale: Option<f64>,
    modes: Option<usize>,
}

/// Handler of `/record`.
pub(super) async fn record(
    State(state): State<Arc<ServerState>>,
    Query(query): Query<RecordQuery>,
    request: Request,
) -> Response {
    let Some(live) = &state.live else {
        return (StatusCode::NOT_FOUND, "there is nothing here").into_response();
    };
    let Ok(_permit) = state.uploads.try_acquire() else {
        return (StatusCode::SERVICE_UNAVAILABLE, "another mesh is being uploaded").into_response();
    };
    let Ok(body) = to_bytes(request.into_body(), MAX_BODY_BYTES).await else {
        let text = format!("a mesh file has {} MB at most: use palpate record", MAX_BODY_BYTES >> 20);
        return (StatusCode::PAYLOAD_TOO_LARGE, text).into_response();
    };
    let RecordQuery { name, young, poisson, density, scale, modes } = query;
    let scale = scale.unwrap_or(1.0);
    if ![young, poisson, density, scale].iter().all(|value| value.is_finite()) || scale <= 0.0 {
        let text = "young, poisson, density and scale are numbers, and scale is above 0";
        return (StatusCode::BAD_REQUEST, text).into_response();
    }
    let upload = Upload {
        name,
        bytes: body.to_vec(),
        scale,
        material: MaterialDescription { young, poisson, density },
        modes: modes.unwrap_or(DEFAULT_MODES).clamp(1, MAX_MODES),
    };
    if !live.claim_job() {
        return (StatusCode::CONFLICT, SceneError::BUSY_JOB.to_string()).into_response();
    }
    match live.commands.send(Command::Record(upload)) {
        Ok(()) => StatusCode::ACCEPTED.into_response(),
        Err(_) => StatusCode::SERVICE_UNAVAILABLE.into_response(),
    }
}
