//! Upload of a mesh file that is to be recorded.

use super::body::read_body;
use super::state::ServerState;
use crate::error::SceneError;
use crate::live::Command;
use crate::protocol::MaterialDescription;
use crate::scene_provider::Upload;
use axum::extract::{Query, Request, State};
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use serde::Deserialize;
use std::sync::Arc;

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
    /// Page that asks for it: the recording is cancelled when it leaves.
    viewer: Option<u64>,
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
    let RecordQuery { name, young, poisson, density, scale, modes, viewer } = query;
    let scale = scale.unwrap_or(1.0);
    if ![young, poisson, density, scale].iter().all(|value| value.is_finite()) || scale <= 0.0 {
        let text = "young, poisson, density and scale are numbers, and scale is above 0";
        return (StatusCode::BAD_REQUEST, text).into_response();
    }
    // The whole job has one place, from here to the end of the recording.
    let Some(permit) = live.job_slot.claim(viewer) else {
        // A browser shows the answer only after it has sent the body.
        let _ = read_body(request.into_body(), &state.limits, |_| {}).await;
        return (StatusCode::CONFLICT, SceneError::BUSY_JOB.to_string()).into_response();
    };
    let mut bytes = Vec::new();
    tokio::select! {
        read = read_body(request.into_body(), &state.limits, |part| bytes.extend_from_slice(part)) => {
            if let Err(error) = read {
                return error.into_response();
            }
        }
        () = permit.cancellation() => {
            return (StatusCode::CONFLICT, "the upload was cancelled").into_response();
        }
    }
    let upload = Upload {
        name,
        bytes,
        scale,
        material: MaterialDescription { young, poisson, density },
        modes: modes.unwrap_or(DEFAULT_MODES).clamp(1, MAX_MODES),
    };
    live.commands.push(Command::Record(upload, permit));
    StatusCode::ACCEPTED.into_response()
}
