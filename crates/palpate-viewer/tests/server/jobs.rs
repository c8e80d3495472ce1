//! Commands and jobs of pages: the newest counts, and what is not wanted any more gives its place back.

use super::client::{Page, TestServer, read_answer};
use palpate_testkit::wait_until;
use palpate_viewer::Limits;
use std::io::Write;
use std::time::{Duration, Instant};

/// Restarts of a scene in a second, at most (`RESTART_INTERVAL`).
const RESTARTS_PER_S: f64 = 10.0;

const RECORD: &str = "POST /record?young=1&poisson=0.3&density=1";

fn viewer(page: &mut Page) -> u64 {
    page.wait("hello")["viewer"].as_u64().expect("a number")
}

#[test]
fn thousands_of_resets_are_a_few_restarts_and_the_scene_answers_at_once() {
    let served = TestServer::live();
    let mut page = served.page();
    let before = page.wait("scene")["generation"].as_u64().expect("a generation");
    let start = Instant::now();
    // As many as a session may send in a burst, of as many pages as there may be.
    let mut others: Vec<Page> = (0..8).map(|_| served.page()).collect();
    for other in &mut others {
        for _ in 0..500 {
            other.send(r#"{"type":"reset"}"#);
        }
        other.send("{");
    }
    // The answer to what came last: all resets have arrived.
    others.iter_mut().for_each(|other| drop(other.wait("error")));
    page.send(r#"{"type":"open_scene","scene":"nowhere"}"#);
    assert_eq!(page.wait("error")["text"], "there is no scene \"nowhere\"");
    // Nothing waits any more.
    let generation = page.wait("status")["generation"].as_u64().expect("a generation");
    let restarts = generation - before;
    let most = 2.0 + start.elapsed().as_secs_f64() * RESTARTS_PER_S;
    eprintln!("4000 resets: {restarts} restarts in {:.1} s", start.elapsed().as_secs_f64());
    assert!(restarts >= 1 && (restarts as f64) <= most, "{restarts} restarts, at most {most}");
}

#[test]
fn a_recording_is_cancelled_by_a_page_or_when_its_page_leaves() {
    let (served, _gate) = TestServer::live_with_gate();
    let (mut watcher, mut owner) = (served.page(), served.page());
    watcher.wait("scene");
    let number = viewer(&mut owner);
    let begin = |viewer: u64| served.request(&format!("{RECORD}&name=slow.msh&viewer={viewer}"), b"xyz").0;
    assert_eq!(begin(number), 202);
    assert_eq!(begin(number), 409);
    // Any page may cancel it: all show the same scene.
    watcher.send(r#"{"type":"cancel_job"}"#);
    assert_eq!(watcher.wait("info")["text"], "the recording was cancelled");
    wait_until("the place is free", || begin(number) == 202);
    drop(owner);
    assert_eq!(watcher.wait("info")["text"], "the recording was cancelled");
    let mut owner = served.page();
    let number = viewer(&mut owner);
    wait_until("the place is free", || begin(number) == 202);
}

#[test]
fn half_an_upload_gives_its_place_back_when_it_is_slow_or_cancelled_or_left() {
    let limits = Limits { body_grace: Duration::from_millis(500), ..Limits::default() };
    let served = TestServer::limited(limits);
    let mut page = served.page();
    page.wait("scene");
    let half = || {
        let mut stream = served.connect();
        let head =
            format!("{RECORD}&name=half.msh HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000000", served.address);
        write!(stream, "{head}\r\n\r\n{}", "x".repeat(1000)).expect("it reads");
        stream
    };
    let upload = || served.request(&format!("{RECORD}&name=a.msh"), b"xyz").0;
    // Silent, and dripping ten bytes at a time.
    for drips in [false, true] {
        let mut stream = half();
        while drips && stream.write_all(b"0123456789").is_ok() {
            std::thread::sleep(Duration::from_millis(10));
        }
        let (status, _, body) = read_answer(&mut stream);
        let text = String::from_utf8_lossy(&body).into_owned();
        // A client that goes on sending sees its connection reset, perhaps before the answer.
        if !drips || status != 0 {
            assert_eq!(status, 408, "{text}");
            assert!(text.starts_with("the body came too slowly: 1"), "{text}");
            assert!(text.ends_with(" s, expected 64 kB/s or more"), "{text}");
        }
        wait_until("the place is free", || upload() == 202);
        assert_eq!(page.wait("error")["text"], "3 bytes of a.msh");
    }
    let served = TestServer::live();
    let mut page = served.page();
    page.wait("scene");
    let half = || {
        let mut stream = served.connect();
        let head =
            format!("{RECORD}&name=half.msh HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000000", served.address);
        write!(stream, "{head}\r\n\r\n{}", "x".repeat(1000)).expect("it reads");
        stream
    };
    let upload = || served.request(&format!("{RECORD}&name=a.msh"), b"xyz").0;
    // A probe that comes first takes the place itself: then again, once it is over and the place is free.
    let hold = |page: &mut Page| loop {
        let stream = half();
        if upload() == 409 {
            return stream;
        }
        drop(stream);
        page.wait("error");
        wait_until("the place is free", || upload() == 202);
        page.wait("error");
    };
    let mut stream = hold(&mut page);
    page.send(r#"{"type":"cancel_job"}"#);
    let (status, _, body) = read_answer(&mut stream);
    assert_eq!((status, String::from_utf8_lossy(&body).as_ref()), (409, "the upload was cancelled"));
    wait_until("the place is free", || upload() == 202);
    assert_eq!(page.wait("error")["text"], "3 bytes of a.msh");
    let stream = hold(&mut page);
    drop(stream);
    wait_until("the place is free", || upload() == 202);
}
