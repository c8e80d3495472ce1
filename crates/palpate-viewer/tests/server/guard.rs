//! Access control and hostile pages.

use super::client::{TestServer, live_content, local, mode_shapes};
use palpate_viewer::{Server, ServerError, Settings, Token};
use tungstenite::Message;
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::protocol::frame::coding::CloseCode;

#[test]
fn foreign_hosts_foreign_origins_and_path_traversal_are_refused() {
    let served = TestServer::live();
    assert_eq!(served.request("GET / HTTP/1.1\r\nHost: evil.example\r\nX-A: b\r\nX-B:", b"").0, 403);
    let mut request = format!("ws://{}/session", served.address).into_client_request().expect("a request");
    request.headers_mut().insert("Origin", HeaderValue::from_static("http://evil.example"));
    assert!(tungstenite::connect(request).is_err(), "a page of another origin");
    let mut request = format!("ws://{}/session", served.address).into_client_request().expect("a request");
    let own = HeaderValue::from_str(&format!("http://{}", served.address)).expect("an origin");
    request.headers_mut().insert("Origin", own);
    assert!(tungstenite::connect(request).is_ok(), "its own page");
    assert_eq!(served.get("/").0, 200);
    for path in [
        "/../Cargo.toml",
        "/..%2f..%2fCargo.toml",
        "/%2e%2e/%2e%2e/Cargo.toml",
        "//etc/passwd",
        "/assets/../../Cargo.toml",
        "/log/0/frames?from=0&count=1",
        "/log/99999999999999999999/series",
    ] {
        let (status, body) = served.get(path);
        assert!((400..500).contains(&status), "{path}: {status}");
        assert!(!String::from_utf8_lossy(&body).contains("[package]"), "{path}");
    }
    assert_eq!(served.request("POST /record?name=a", b"x").0, 400);
    assert_eq!(served.request("POST /record?name=a&young=NaN&poisson=0&density=1", b"x").0, 400);
    assert_eq!(served.request("POST /image/0", b"x").0, 404);
    let large = vec![0; (64 << 20) + 1];
    assert_eq!(served.request("POST /record?name=a.msh&young=1&poisson=0&density=1", &large).0, 413);
}

#[test]
fn beyond_loopback_a_token_is_required() {
    let listen = ([0, 0, 0, 0], 0).into();
    let refused = Server::bind(&Settings::new(listen)).expect_err("no token");
    assert!(matches!(refused, ServerError::MissingToken(address) if address == listen), "{refused}");
    assert_eq!(
        refused.to_string(),
        "0.0.0.0:0 can be reached from other machines: give a token (--token-file, or PALPATE_TOKEN), without which nobody \
         gets in"
    );
    let token = Some(Token::new("a token, long enough").expect("a token"));
    assert!(Server::bind(&Settings { token, ..Settings::new(listen) }).is_ok());
    let served = TestServer::live();
    let taken = Server::bind(&Settings::new(served.address)).expect_err("taken");
    assert!(matches!(taken, ServerError::AddressInUse(address) if address == served.address), "{taken}");
    let text =
        format!("something listens at {} already: stop it, or take another port (--listen)", served.address);
    assert_eq!(taken.to_string(), text);
}

#[test]
fn a_flooding_page_is_disconnected_and_garbage_does_not_stop_the_scene() {
    let served = TestServer::live();
    let mut good = served.page();
    let generation = good.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    let before = good.frame(&shapes, |_| true).step;
    let mut bad = served.page();
    for garbage in [
        "",
        "{",
        r#"{"type":"move","pointers":[{"pointer":1,"position":[1e999,0,0]}]}"#,
        r#"{"type":"press","pointer":1,"mode":"touch","position":[1e300,0,0]}"#,
        r#"{"type":"set_material","object":99,"young":-1,"poisson":9,"density":0}"#,
        r#"{"type":"slow_motion","slowdown":4294967295}"#,
        r#"{"type":"slow_motion","slowdown":1}"#,
    ] {
        bad.send(garbage);
    }
    bad.wait("error");
    bad.wait("error");
    let _ = bad.socket.send(Message::Binary(vec![0; 1000].into()));
    for _ in 0..3000 {
        if bad.socket.write(Message::text(r#"{"type":"release","pointer":1}"#)).is_err() {
            break;
        }
    }
    let _ = bad.socket.flush();
    let closed = std::iter::from_fn(|| bad.socket.read().ok()).find_map(|message| match message {
        Message::Close(frame) => frame.map(|frame| frame.code),
        _ => None,
    });
    assert!(closed.is_none_or(|code| code == CloseCode::Policy), "{closed:?}");
    let mut huge = served.page();
    huge.send(&"x".repeat(70_000));
    let ended = std::iter::from_fn(|| huge.socket.read().ok()).take(10_000).count();
    assert!(ended < 10_000, "a message that is too large ends the session");
    let after = good.frame(&shapes, |frame| frame.step > before + 100);
    assert!(after.time_s > 0.0);
}

#[test]
fn wrong_tokens_make_their_address_wait_and_the_right_one_gets_in() {
    let token = Token::new("a&b#c d%20, and long").expect("a token");
    let query = token.query();
    let served = TestServer::bind(&Settings { token: Some(token), ..local() }, live_content().0);
    assert_eq!(served.get("/").0, 200, "the page is public");
    assert_eq!(served.get(&format!("/scene/1/object/0/surface?{query}")).0, 200);
    let answers: Vec<_> = (0..200)
        .map(|guess| served.answer(&format!("GET /scene/1/object/0/surface?token=guess-{guess}"), b""))
        .collect();
    let text = |body: &[u8]| String::from_utf8_lossy(body).into_owned();
    let compared = answers.iter().filter(|(status, ..)| *status == 403).count();
    assert_eq!(
        (answers[0].0, text(&answers[0].2).as_str()),
        (403, "the token is missing or wrong: open the address that palpate has printed")
    );
    // Five are free; each further one doubles the wait, so that ten more would take over a quarter of an hour.
    assert!((6..16).contains(&compared), "{compared} guesses were compared");
    let (status, head, body) =
        answers.iter().find(|(status, ..)| *status == 429).expect("an address that waits");
    assert_eq!(
        (*status, text(body)),
        (429, "too many wrong tokens came from your address: try again in 1 s".into())
    );
    assert!(head.contains("retry-after: 1\r\n"), "{head}");
}

#[test]
fn every_answer_says_what_a_page_may_do_and_is_kept_by_no_cache() {
    let served = TestServer::live();
    for request in
        ["GET /", "GET /nowhere", "GET /scene/1/object/0/surface", "POST /record?name=a", "PUT /record"]
    {
        let (status, head, _) = served.answer(request, b"");
        for line in [
            "content-security-policy: default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data:; \
             connect-src 'self'; object-src 'none'; frame-ancestors 'none'; base-uri 'none'; form-action 'none'\r\n",
            "x-content-type-options: nosniff\r\n",
            "referrer-policy: no-referrer\r\n",
            "cross-origin-resource-policy: same-origin\r\n",
            "cache-control: no-store\r\n",
        ] {
            assert!(head.contains(line), "{request}, {status}: {line} is missing in {head}");
        }
    }
    let (status, head, _) = served.answer("GET / HTTP/1.1\r\nHost: evil.example\r\nX:", b"");
    assert!(status == 403 && head.contains("content-security-policy: "), "{head}");
}

#[test]
fn pages_that_are_named_may_show_the_page_in_a_frame() {
    let frame_ancestors =
        ["http://localhost:*", "vscode-webview:"].map(|text| text.parse().expect("an ancestor"));
    let settings = Settings { frame_ancestors: frame_ancestors.to_vec(), ..local() };
    let served = TestServer::bind(&settings, live_content().0);
    let (_, head, _) = served.answer("GET /", b"");
    assert!(head.contains("; frame-ancestors http://localhost:* vscode-webview:; base-uri 'none'"), "{head}");
}
