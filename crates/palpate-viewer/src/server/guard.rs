//! Access control.
//!
//! Every page that a browser on this machine opens can reach a server on loopback. Therefore the server checks the host
//! name (against DNS rebinding) and the origin (only its own pages may open sessions or send data). Beyond loopback
//! every request needs the token.

use super::attempts::WrongTokens;
use super::token::{Token, TokenHash};
use axum::extract::Request;
use axum::http::{HeaderMap, Method, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};
use std::net::IpAddr;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

/// Access rules.
#[derive(Debug)]
pub(super) struct Guard {
    loopback: bool,
    token: Option<TokenHash>,
    wrong_tokens: Mutex<WrongTokens>,
}

/// Refusal of a request.
#[derive(Debug, PartialEq, Eq)]
pub(super) enum Rejection {
    /// The request may not come from there, or lacks the token.
    Forbidden(&'static str),
    /// Too many wrong tokens came from this address.
    Wait(Duration),
}

impl IntoResponse for Rejection {
    fn into_response(self) -> Response {
        match self {
            Self::Forbidden(reason) => (StatusCode::FORBIDDEN, reason).into_response(),
            Self::Wait(time) => {
                let seconds = time.as_secs() + 1;
                let text = format!("too many wrong tokens came from your address: try again in {seconds} s");
                let headers = [(header::RETRY_AFTER, seconds.to_string())];
                (StatusCode::TOO_MANY_REQUESTS, headers, text).into_response()
            }
        }
    }
}

impl Guard {
    /// Rules for a server, on loopback or not.
    pub fn new(loopback: bool, token: Option<&Token>) -> Self {
        Self { loopback, token: token.map(Token::hash), wrong_tokens: Mutex::default() }
    }

    /// Checks a request from an address.
    ///
    /// # Errors
    /// If it is refused.
    pub fn check(&self, request: &Request, from: IpAddr, now: Instant) -> Result<(), Rejection> {
        let (headers, uri) = (request.headers(), request.uri());
        let host = host(headers, uri).unwrap_or_default();
        if self.loopback && !is_loopback(&host) {
            return Err(Rejection::Forbidden("this server answers to localhost only"));
        }
        // Files of the page are public.
        let page = request.method() == Method::GET && is_page(uri.path());
        if let (Some(token), false) = (self.token, page) {
            self.check_token(token, uri, from, now)?;
        }
        let has_effect = request.method() != Method::GET || headers.contains_key(header::UPGRADE);
        let origin = headers.get(header::ORIGIN).and_then(|origin| origin.to_str().ok());
        match origin {
            Some(origin) if has_effect && !is_same_origin(origin, &host) => {
                Err(Rejection::Forbidden("this request comes from a page of another origin"))
            }
            _ => Ok(()),
        }
    }

    fn check_token(&self, token: TokenHash, uri: &Uri, from: IpAddr, now: Instant) -> Result<(), Rejection> {
        let refusal = "the token is missing or wrong: open the address that palpate has printed";
        let given = uri.query().and_then(TokenHash::of_query).ok_or(Rejection::Forbidden(refusal))?;
        let mut wrong = self.wrong_tokens.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(time) = wrong.wait(from, now) {
            return Err(Rejection::Wait(time));
        }
        if given != token {
            wrong.count(from, given, now);
            return Err(Rejection::Forbidden(refusal));
        }
        Ok(())
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
    name == "localhost" || name.parse::<IpAddr>().is_ok_and(|address| address.is_loopback())
}

fn is_page(path: &str) -> bool {
    !["/session", "/scene/", "/log/", "/record", "/image/"].iter().any(|own| path.starts_with(own))
}

fn is_same_origin(origin: &str, host: &str) -> bool {
    let stated = origin.split_once("://").map(|(_, rest)| rest.to_lowercase());
    stated.is_some_and(|stated| stated == host)
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::Body;

    const PEER: IpAddr = IpAddr::V4(std::net::Ipv4Addr::new(10, 0, 0, 2));

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
            guard.check(&request(method, path, headers), PEER, Instant::now()).is_ok()
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
        let guard = Guard::new(false, Some(&Token::new("12345678&abcdef#").expect("a token")));
        let passes = |path: &str| {
            let request = request("GET", path, &[("host", "10.0.0.1:7400")]);
            guard.check(&request, PEER, Instant::now()).is_ok()
        };
        assert!(passes("/") && passes("/assets/page.js"));
        assert!(passes("/session?token=12345678%26abcdef%23"));
        assert!(passes("/log/0/frames?from=0&token=12345678%26abcdef%23"));
        for path in [
            "/session",
            "/session?token=12345678&abcdef",
            "/session?token=",
            "/scene/1/object/0/mode_shapes",
            "/log/0/series?t",
        ] {
            assert!(!passes(path), "{path}");
        }
    }

    #[test]
    fn guesses_from_an_address_must_wait_and_the_holder_at_another_need_not() {
        let guard = Guard::new(false, Some(&Token::new("the right one, long").expect("a token")));
        let now = Instant::now();
        let check = |token: &str, from: IpAddr| {
            let path = format!("/session?token={token}");
            guard.check(&request("GET", &path, &[("host", "10.0.0.1:7400")]), from, now)
        };
        let mut compared = 0;
        let mut last = Ok(());
        for guess in 0..2000 {
            last = check(&guess.to_string(), PEER);
            compared += usize::from(matches!(last, Err(Rejection::Forbidden(_))));
        }
        assert_eq!(compared, 6, "five are free, and the sixth makes the address wait");
        assert_eq!(last, Err(Rejection::Wait(Duration::from_secs(1))));
        let right = "the+right+one,+long";
        assert_eq!(check(right, PEER), Err(Rejection::Wait(Duration::from_secs(1))));
        assert_eq!(check(right, [10, 0, 0, 3].into()), Ok(()));
        let answer = Rejection::Wait(Duration::from_millis(1500)).into_response();
        assert_eq!(
            (answer.status().as_u16(), &answer.headers()["retry-after"]),
            (429, &"2".parse().expect("a header"))
        );
    }
}
