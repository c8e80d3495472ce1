//! Clients that send or take slowly: they lose their place, and nobody waits for them.

use super::client::{TestServer, mode_shapes, read_answer};
use palpate_testkit::wait_until;
use palpate_viewer::Limits;
use std::io::Write;
use std::time::Duration;

/// Limit that a test waits for; the others stay as they are.
const SHORT: Duration = Duration::from_secs(1);

#[test]
fn two_hundred_slow_heads_beside_a_page_that_is_served() {
    let served = TestServer::limited(Limits { header_time: SHORT, ..Limits::default() });
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let surface = format!("/scene/{generation}/object/0/surface");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    let before = page.frame(&shapes, |_| true).step;
    let mut slow: Vec<_> = (0..200).map(|_| served.connect()).collect();
    for stream in &mut slow {
        // On a busy machine the first ones may be closed by now.
        let _ = write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\nX-Slow: ", served.address);
    }
    // A byte now and then does not keep the place.
    for _ in 0..20 {
        slow.iter_mut().for_each(|stream| drop(stream.write_all(b"x")));
        assert_eq!(served.get(&surface).0, 200);
        let now = page.frame(&shapes, |_| true).step;
        page.frame(&shapes, |frame| frame.step > now);
    }
    assert!(page.frame(&shapes, |_| true).step > before);
    for stream in &mut slow {
        // Reading ends: the server closes the connection, without an answer or with a refusal.
        let (status, ..) = read_answer(stream);
        assert!(matches!(status, 0 | 408), "{status}");
    }
    assert_eq!(*served.notices.lock().expect("no panic"), [""; 0]);
}

#[test]
fn an_idle_connection_is_closed() {
    let served = TestServer::limited(Limits { header_time: SHORT, connections: 1, ..Limits::default() });
    let mut idle = served.connect();
    write!(idle, "GET / HTTP/1.1\r\nHost: {}\r\n\r\n", served.address).expect("it reads");
    let (status, ..) = read_answer(&mut idle);
    assert_eq!(status, 200, "it is answered, and closed after a while");
    wait_until("its place is free", || served.get("/").0 == 200);
}

#[test]
fn a_client_that_takes_no_answers_loses_its_place() {
    let served = TestServer::limited(Limits { write_time: SHORT, connections: 1, ..Limits::default() });
    let mut greedy = served.connect();
    greedy.set_write_timeout(Some(Duration::from_secs(60))).expect("a timeout");
    let request = format!("GET /scene/1/object/0/mode_shapes HTTP/1.1\r\nHost: {}\r\n\r\n", served.address);
    // It asks until the server takes no more, since it can't answer, and closes.
    while greedy.write_all(request.as_bytes()).is_ok() {}
    wait_until("its place is free", || served.get("/").0 == 200);
}

#[test]
fn a_page_that_does_not_answer_is_disconnected_and_the_others_are_served() {
    let served = TestServer::limited(Limits { silence: SHORT, ..Limits::default() });
    let mut page = served.page();
    // It reads nothing, so that it answers no ping.
    let mut deaf = served.page();
    deaf.send(r#"{"type":"stream","format":"vertices","stride":1}"#);
    deaf.send(r#"{"type":"press","pointer":1,"mode":"touch","position":[-9,0,0]}"#);
    while page.wait("status")["viewers"] != 2 {}
    while page.wait("status")["viewers"] != 1 {}
    // Its pointer is free: there are two.
    for pointer in 1..=2 {
        page.send(&format!(r#"{{"type":"press","pointer":{pointer},"mode":"touch","position":[-9,0,0]}}"#));
        assert!(page.wait("assigned")["device"].is_u64(), "pointer {pointer}");
    }
}

#[test]
fn a_page_that_answers_pings_stays_though_it_says_nothing() {
    let served = TestServer::limited(Limits { silence: SHORT, ..Limits::default() });
    let mut page = served.page();
    let first = page.wait("status")["steps"].as_u64().expect("steps");
    // Three times as long.
    while page.wait("status")["steps"].as_u64().is_none_or(|steps| steps < first + 3000) {}
    assert_eq!(page.wait("status")["viewers"], 1);
}
