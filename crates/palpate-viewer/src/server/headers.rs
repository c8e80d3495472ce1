//! Headers of every response: nothing of the page comes from elsewhere, nothing of it goes elsewhere, and no cache keeps it.

use super::frame_ancestor::FrameAncestor;
use axum::http::{HeaderName, HeaderValue, header};
use axum::response::Response;

/// Headers of every response. Addresses hold the token: no referrer.
const HEADERS: [(HeaderName, &str); 4] = [
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
];

/// Content security policy: scripts, styles and connections of this server only, and no inline code. Images may be made by the page. It is
/// in frames of these pages only.
pub(super) fn content_security_policy(ancestors: &[FrameAncestor]) -> HeaderValue {
    let named: Vec<String> = ancestors.iter().map(FrameAncestor::to_string).collect();
    let ancestors = if named.is_empty() { "'none'".to_string() } else { named.join(" ") };
    let policy = format!(
        "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; connect-src 'self'; object-src 'none'; \
         frame-ancestors {ancestors}; base-uri 'none'; form-action 'none'"
    );
    HeaderValue::try_from(policy).unwrap_or(HeaderValue::from_static("default-src 'none'"))
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
