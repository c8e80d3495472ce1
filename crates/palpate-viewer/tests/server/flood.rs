//! Floods: many connections, large heads and bodies. Memory stays bounded, and the page that is there is served.

use super::client::{TestServer, mode_shapes, read_answer};
use palpate_testkit::wait_until;
use std::io::{ErrorKind, Write};
use std::net::TcpStream;

/// Growth of the process under a flood of 2 GB [bytes], at most: 256 heads of 32 kB, and the test's own sockets.
const MAX_GROWTH_BYTES: u64 = 96 << 20;

const FULL: &str = "no connection of the viewer is free, of 256 in all and 128 for an address of another machine: close a page and try \
                    again, or allow more (--max-connections)";

/// Resident memory of this process [bytes].
#[cfg(target_os = "linux")]
fn resident_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").expect("the process");
    let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:")).expect("its memory");
    line.trim().trim_end_matches(" kB").parse::<u64>().expect("a number") << 10
}

/// Whether the server has sent something, or closed the connection.
fn is_answered(stream: &TcpStream) -> bool {
    stream.set_nonblocking(true).expect("a mode");
    let peeked = stream.peek(&mut [0]);
    stream.set_nonblocking(false).expect("a mode");
    !peeked.is_err_and(|error| error.kind() == ErrorKind::WouldBlock)
}

#[test]
fn five_hundred_connections_are_bounded_and_told_and_a_page_is_served_on() {
    let served = TestServer::live();
    let mut page = served.page();
    let generation = page.wait("scene")["generation"].as_u64().expect("a generation");
    let shapes = mode_shapes(&served.get(&format!("/scene/{generation}/object/0/mode_shapes")).1);
    let mut crowd: Vec<_> = (0..500).map(|_| served.connect()).collect();
    wait_until("it is told in the terminal", || !served.notices.lock().expect("no panic").is_empty());
    let before = page.frame(&shapes, |_| true).step;
    page.frame(&shapes, |frame| frame.step > before + 100);
    // The page has one place, and the request before may still have one.
    wait_until("the others are refused", || crowd.iter().filter(|stream| is_answered(stream)).count() >= 244);
    for stream in &mut crowd {
        let _ = write!(stream, "GET / HTTP/1.1\r\nHost: {}\r\nConnection: close\r\n\r\n", served.address);
    }
    let answers: Vec<_> = crowd.iter_mut().map(read_answer).collect();
    let served_ones = answers.iter().filter(|(status, ..)| *status == 200).count();
    let told = answers.iter().filter(|(status, ..)| *status == 503).count();
    eprintln!("500 connections: {served_ones} served, {told} told 503, {} closed", 500 - served_ones - told);
    assert!((254..=256).contains(&served_ones) && told >= 1, "{served_ones} {told}");
    for (status, _, body) in answers {
        let text = String::from_utf8_lossy(&body).into_owned();
        assert!(status == 200 || status == 503 && text == FULL || status == 0, "{status}: {text}");
    }
    assert_eq!(*served.notices.lock().expect("no panic"), [FULL]);
    drop(crowd);
    wait_until("there is room again", || served.get("/").0 == 200);
}

#[test]
#[cfg(target_os = "linux")]
fn large_heads_and_bodies_without_a_use_are_not_kept() {
    let served = TestServer::live();
    let mut page = served.page();
    page.wait("scene");
    let before = resident_bytes();
    let heap = "x".repeat(1 << 20);
    let mut clients: Vec<_> = (0..200).map(|_| served.connect()).collect();
    for (number, stream) in clients.iter_mut().enumerate() {
        let head = match number % 2 {
            0 => format!("GET / HTTP/1.1\r\nHost: {}\r\nX-Large: ", served.address),
            _ => format!(
                "POST /image/0 HTTP/1.1\r\nHost: {}\r\nContent-Length: 1000000000\r\n\r\n",
                served.address
            ),
        };
        let _ = stream.write_all(head.as_bytes());
        // Ten megabytes each, unless the server has closed the connection.
        for _ in 0..10 {
            if stream.write_all(heap.as_bytes()).is_err() {
                break;
            }
        }
    }
    let growth = resident_bytes().saturating_sub(before);
    eprintln!("200 clients with 10 MB each: {:.1} MB more", growth as f64 / 1e6);
    assert!(growth < MAX_GROWTH_BYTES, "{growth} bytes");
    for (number, stream) in clients.iter_mut().enumerate() {
        let (status, ..) = read_answer(stream);
        // The connection may be reset before the answer is read.
        let expected = if number % 2 == 0 { 431 } else { 404 };
        assert!(status == expected || status == 0, "{number}: {status}");
    }
    page.wait("status");
}
