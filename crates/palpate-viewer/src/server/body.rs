//! Request bodies, read no longer than a client sends them at a fair rate.

use super::limits::Limits;
use axum::body::Body;
use axum::http::StatusCode;
use axum::response::{IntoResponse, Response};
use http_body_util::BodyExt;
use std::time::Duration;
use tokio::time::{Instant, timeout_at};

/// Size limit of a request body: a mesh file or an image [bytes].
pub(super) const MAX_BODY_BYTES: usize = 64 << 20;

/// Body that cannot be read.
#[derive(Debug, thiserror::Error)]
pub(super) enum BodyError {
    #[error("a body has {} MB at most: use palpate record for a larger mesh", MAX_BODY_BYTES >> 20)]
    Large,
    #[error("the body came too slowly: {received} bytes in {seconds} s, expected {rate} kB/s or more")]
    Slow { received: usize, seconds: u64, rate: f64 },
    #[error("the body ended early")]
    Broken,
}

impl IntoResponse for BodyError {
    fn into_response(self) -> Response {
        let status = match self {
            Self::Large => StatusCode::PAYLOAD_TOO_LARGE,
            Self::Slow { .. } => StatusCode::REQUEST_TIMEOUT,
            Self::Broken => StatusCode::BAD_REQUEST,
        };
        (status, self.to_string()).into_response()
    }
}

/// Hands the parts of a body to `take`.
///
/// # Errors
/// If the body is too large, ends early, or falls behind [`Limits::body_rate`] by more than [`Limits::body_grace`].
pub(super) async fn read_body(
    mut body: Body,
    limits: &Limits,
    mut take: impl FnMut(&[u8]),
) -> Result<(), BodyError> {
    let (start, mut received) = (Instant::now(), 0);
    loop {
        let deadline =
            start + limits.body_grace + Duration::from_secs_f64(received as f64 / limits.body_rate.max(1.0));
        let slow = |_| BodyError::Slow {
            received,
            seconds: start.elapsed().as_secs(),
            rate: limits.body_rate / 1e3,
        };
        let Some(frame) = timeout_at(deadline, body.frame()).await.map_err(slow)? else { return Ok(()) };
        let frame = frame.map_err(|_| BodyError::Broken)?;
        let Some(part) = frame.data_ref() else { continue };
        received += part.len();
        if received > MAX_BODY_BYTES {
            return Err(BodyError::Large);
        }
        take(part);
    }
}
