//! Embedded files of the page.

use axum::http::{StatusCode, Uri, header};
use axum::response::{Html, IntoResponse, Response};
use rust_embed::{EmbeddedFile, RustEmbed};

/// Output of `npm run build`, behind a link so that packages of the crate have it. Debug builds read it from disk at each request.
#[derive(RustEmbed)]
#[folder = "page/"]
#[allow_missing = true]
struct PageFiles;

/// Page of a build without the viewer.
const NOT_BUILT: &str = "<!doctype html><meta charset=utf-8><title>palpate</title>\
<p>This palpate was built without its viewer. In the repository, with \
Node.js 20 or newer: <code>cargo xtask viewer</code>, and build palpate again.";

/// Handler of all other addresses: a file of the page.
pub(super) async fn file(uri: Uri) -> Response {
    let path = uri.path().trim_start_matches('/');
    let path = if path.is_empty() { "index.html" } else { path };
    match PageFiles::get(path) {
        Some(file) => response(path, file),
        None if path == "index.html" => (StatusCode::OK, Html(NOT_BUILT)).into_response(),
        None => (StatusCode::NOT_FOUND, "there is nothing here").into_response(),
    }
}

/// Response with a file and its headers.
fn response(path: &str, file: EmbeddedFile) -> Response {
    // Asset names contain a content hash, and their addresses no token.
    let cache_control =
        if path.starts_with("assets/") { "public, max-age=31536000, immutable" } else { "no-store" };
    let headers = [(header::CONTENT_TYPE, content_type(path)), (header::CACHE_CONTROL, cache_control)];
    (headers, file.data.into_owned()).into_response()
}

/// Media type by file extension.
fn content_type(path: &str) -> &'static str {
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
