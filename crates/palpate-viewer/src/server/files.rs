//! The page, as it is embedded.

use axum::http::{StatusCode, Uri, header};
use axum::response::{Html, IntoResponse, Response};
use rust_embed::{EmbeddedFile, RustEmbed};

/// What `npm run build` leaves. In a debug build it is read from the disk when it is asked for.
#[derive(RustEmbed)]
#[folder = "../../viewer/dist/"]
#[allow_missing = true]
struct Page;

/// What the page may do: talk to its own server, nothing else.
const POLICY: &str = "default-src 'self'; img-src 'self' blob: data:; style-src 'self' 'unsafe-inline'; \
                      connect-src 'self' ws: wss:; worker-src 'self' blob:; frame-ancestors 'none'; base-uri 'none'; \
                      form-action 'none'";

const NOT_BUILT: &str = "<!doctype html><meta charset=utf-8><title>palpate</title>\
<p style='font:1rem/1.5 system-ui;max-width:40rem;margin:4rem auto'>This palpate was built without its viewer. In the repository, with \
Node.js 20 or newer: <code>cargo xtask viewer</code>, and build palpate again.";

pub(super) async fn file(uri: Uri) -> Response {
    let path = uri.path().trim_start_matches('/');
    let path = if path.is_empty() { "index.html" } else { path };
    match Page::get(path) {
        Some(file) => answer(path, file),
        None if path == "index.html" => (StatusCode::OK, Html(NOT_BUILT)).into_response(),
        None => (StatusCode::NOT_FOUND, "there is nothing here").into_response(),
    }
}

fn answer(path: &str, file: EmbeddedFile) -> Response {
    // Names of assets change with what is in them.
    let keep = if path.starts_with("assets/") { "public, max-age=31536000, immutable" } else { "no-cache" };
    let headers = [
        (header::CONTENT_TYPE, kind(path)),
        (header::CACHE_CONTROL, keep),
        (header::CONTENT_SECURITY_POLICY, POLICY),
        (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
        (header::REFERRER_POLICY, "no-referrer"),
    ];
    (headers, file.data.into_owned()).into_response()
}

fn kind(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("json" | "map") => "application/json",
        Some("woff2") => "font/woff2",
        _ => "application/octet-stream",
    }
}
