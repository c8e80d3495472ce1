//! Headers of every response: nothing of the page comes from elsewhere, nothing of it goes elsewhere, and no cache keeps it.

use super::frame_ancestor::FrameAncestor;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::Response;

/// Content security policy: scripts, styles and connections of this server only, no inline code, and no frame of another page. Images may be made
/// by the page. The stand-in of the page's tests reads it here.
const CONTENT_SECURITY_POLICY: &str = "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
    connect-src 'self'; object-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'";

/// Headers of every response. Addresses hold the token: no referrer.
const HEADERS: [(HeaderName, &str); 4] = [
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Content security policy, in frames of these pages only.
pub(super) fn content_security_policy(ancestors: &[FrameAncestor]) -> HeaderValue {
    let default = HeaderValue::from_static(CONTENT_SECURITY_POLICY);
    if ancestors.is_empty() {
        return default;
    }
    let named: Vec<String> = ancestors.iter().map(FrameAncestor::to_string).collect();
    let framed = format!("frame-ancestors {}", named.join(" "));
    HeaderValue::try_from(CONTENT_SECURITY_POLICY.replace("frame-ancestors 'none'", &framed))
        .unwrap_or(default)
}

/// Response with a content security policy and these headers, kept by no cache unless it says so.
pub(super) async fn harden(policy: HeaderValue, mut response: Response) -> Response {
    let headers = response.headers_mut();
    headers.insert(header::CONTENT_SECURITY_POLICY, policy);
    for (name, value) in HEADERS {
        headers.insert(name, HeaderValue::from_static(value));
    }
    headers.entry(header::CACHE_CONTROL).or_insert(HeaderValue::from_static("no-store"));
    response
}
