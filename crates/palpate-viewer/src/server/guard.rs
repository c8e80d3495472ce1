//! Access control.
//!
//! Every page that a browser on this machine opens can reach a server on loopback. Therefore the server checks the host
//! name (against DNS rebinding) and the origin (only its own pages may open sessions or send data). Beyond loopback
//! every request needs the token.

use axum::extract::Request;
use axum::http::{HeaderMap, Method, Uri, header};

/// Access rules.
#[derive(Debug, Clone)]
pub(super) struct Guard {
    loopback: bool,
    token: Option<String>,
}

impl Guard {
    /// Rules for a server, on loopback or not.
    pub fn new(loopback: bool, token: Option<String>) -> Self {
        Self { loopback, token }
    }

    /// Reason to reject a request, if any.
    pub fn rejection(&self, request: &Request) -> Option<&'static str> {
        let (headers, uri) = (request.headers(), request.uri());
        let host = host(headers, uri).unwrap_or_default();
        if self.loopback && !is_loopback(&host) {
            return Some("this server answers to localhost only");
        }
        // Files of the page are public.
        let page = request.method() == Method::GET && is_page(uri.path());
        if let (Some(token), false) = (&self.token, page)
            && !token_of(uri).is_some_and(|given| tokens_match(&given, token))
        {
            return Some("the token is missing or wrong: open the address that palpate has printed");
        }
        let has_effect = request.method() != Method::GET || headers.contains_key(header::UPGRADE);
        let origin = headers.get(header::ORIGIN).and_then(|origin| origin.to_str().ok());
        match origin {
            Some(origin) if has_effect && !is_same_origin(origin, &host) => {
                Some("this request comes from a page of another origin")
            }
            _ => None,
        }
    }
}

fn host(headers: &HeaderMap, uri: &Uri) -> Option<String> {
    let stated = headers.get(header::HOST).and_then(|host| host.to_str().ok());
    stated.or(uri.authority().map(|authority| authority.as_str())).map(str::to_lowercase)
}

fn is_loopback(host: &str) -> bool {
    let name = match host.strip_prefix('[') {
        Some(rest) => rest.split(']').next().unwrap_or_default(),
        None => host.split(':').next().unwrap_or_default(),
    };
    name == "localhost" || name.parse::<std::net::IpAddr>().is_ok_and(|address| address.is_loopback())
}

fn is_page(path: &str) -> bool {
    !["/session", "/scene/", "/log/", "/record", "/image/"].iter().any(|own| path.starts_with(own))
}

fn is_same_origin(origin: &str, host: &str) -> bool {
    let stated = origin.split_once("://").map(|(_, rest)| rest.to_lowercase());
    stated.is_some_and(|stated| stated == host)
}

fn token_of(uri: &Uri) -> Option<String> {
    let mut pairs = uri.query()?.split('&').filter_map(|pair| pair.split_once('='));
    pairs.find(|(key, _)| *key == "token").map(|(_, value)| value.to_string())
}

/// Comparison in constant time.
fn tokens_match(given: &str, token: &str) -> bool {
    blake3::hash(given.as_bytes()) == blake3::hash(token.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    fn request(method: &str, path: &str, headers: &[(&str, &str)]) -> Request {
        let mut request = Request::builder().method(method).uri(path);
        for (name, value) in headers {
            request = request.header(*name, *value);
        }
        request.body(Body::empty()).expect("a request")
    }

    #[test]
    fn rebound_names_and_foreign_origins_are_refused() {
        let guard = Guard::new(true, None);
        let passes = |method, path, headers: &[(&str, &str)]| {
            guard.rejection(&request(method, path, headers)).is_none()
        };
        for host in ["localhost:7400", "127.0.0.1:7400", "[::1]:7400", "LOCALHOST:1"] {
            assert!(passes("GET", "/", &[("host", host)]), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example:7400", "10.0.0.1", ""]
        {
            assert!(!passes("GET", "/", &[("host", host)]), "{host}");
        }
        let own = ("host", "localhost:7400");
        let upgrade = ("upgrade", "websocket");
        assert!(passes("GET", "/session", &[own, upgrade, ("origin", "http://localhost:7400")]));
        assert!(passes("GET", "/session", &[own, upgrade]), "clients other than browsers send no origin");
        for origin in ["http://evil.example", "http://localhost:7401", "null", "http://localhost:7400.evil"] {
            assert!(!passes("GET", "/session", &[own, upgrade, ("origin", origin)]), "{origin}");
            assert!(!passes("POST", "/record", &[own, ("origin", origin)]), "{origin}");
        }
    }

    #[test]
    fn beyond_loopback_a_token_is_required() {
        let guard = Guard::new(false, Some("12345678".into()));
        let passes =
            |path: &str| guard.rejection(&request("GET", path, &[("host", "10.0.0.1:7400")])).is_none();
        assert!(passes("/") && passes("/assets/page.js"));
        assert!(passes("/session?token=12345678") && passes("/log/0/frames?from=0&token=12345678"));
        for path in [
            "/session",
            "/session?token=1234567",
            "/session?token=",
            "/scene/1/object/0/mode_shapes",
            "/log/0/series?t",
        ] {
            assert!(!passes(path), "{path}");
        }
    }
}
