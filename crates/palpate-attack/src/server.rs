//! Attacks on the viewer's server: strangers, floods, clients that stall, guessed tokens.

use crate::attack::{Attack, Verdict, require};
use crate::child::{PATIENCE, Running, wait_until};
use crate::http::{self, connect, connect_from, get, read_answer, request};
use crate::page::{Page, is_served};
use crate::random::Random;
use crate::workplace::Workplace;
use std::io::Write;
use std::net::{Ipv4Addr, TcpStream};
use std::time::{Duration, Instant};

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "server", name: "names of another host (DNS rebinding)", run: foreign_hosts },
    Attack {
        group: "server",
        name: "sessions and uploads from pages of another origin",
        run: foreign_origins,
    },
    Attack { group: "server", name: "paths out of the page's folder", run: traversal },
    Attack { group: "server", name: "2,000 connections with random bytes", run: garbage },
    Attack { group: "server", name: "200 clients that never end their request's head", run: slow_heads },
    Attack { group: "server", name: "uploads that stop half-way", run: half_uploads },
    Attack { group: "server", name: "1,000 connections held open", run: many_connections },
    Attack { group: "server", name: "20,000 messages at once from one page", run: message_flood },
    Attack { group: "server", name: "a message of 8 MiB", run: outsized_message },
    Attack { group: "server", name: "20,000 random messages", run: random_messages },
    Attack { group: "server", name: "2,500 resets", run: resets },
    Attack { group: "server", name: "ten pages that never read", run: deaf_pages },
    Attack { group: "server", name: "tokens guessed for three seconds", run: guessed_tokens },
    Attack { group: "server", name: "a token seen in the list of processes", run: token_in_processes },
    Attack { group: "server", name: "script of others in the page (content security policy)", run: policy },
];

/// A token as one would generate it.
const TOKEN: &str = "8f1d2c3b4a5968778695a4b3c2d1e0ff";

/// Address of loopback from which tokens are guessed.
const GUESSER: Ipv4Addr = Ipv4Addr::new(127, 0, 0, 3);

/// Wait for an answer to a hostile request.
const BRIEF: Duration = Duration::from_secs(2);

/// Memory that a flood may leave behind [MiB].
const MEMORY_MIB: f64 = 64.0;

/// `palpate serve` of the scene with two fingers.
fn serve(workplace: &Workplace) -> Result<(Running, String), String> {
    let address = workplace.free_address()?;
    let server = workplace.start(&format!("serve fingers.toml --no-browser --listen {address}"))?;
    server.wait_for("open http")?;
    is_served(&address, "")?;
    Ok((server, address))
}

/// `palpate serve` for other machines, with a token from the environment; the query of a page that has it.
fn serve_with_token(workplace: &Workplace) -> Result<(Running, String, String), String> {
    let address = workplace.free_address()?;
    let everywhere = address.replace("127.0.0.1", "0.0.0.0");
    let mut command = workplace.palpate(&format!("serve fingers.toml --no-browser --listen {everywhere}"));
    let server = Running::start(command.env("PALPATE_TOKEN", TOKEN))?;
    server.wait_for("open http")?;
    let query = format!("?token={TOKEN}");
    is_served(&address, &query)?;
    Ok((server, address, query))
}

/// Verdict of a server after an attack: it serves, and holds no more memory than before.
fn still_serves(server: &mut Running, address: &str, before_mib: f64, what: &str) -> Verdict {
    require(server.is_alive(), || format!("{what}: the server has ended: {}", server.printed()))?;
    let seconds = is_served(address, "").map_err(|error| format!("{what}: {error}"))?;
    let more = server.memory_mib() - before_mib;
    require(more < MEMORY_MIB, || format!("{what}: {more:.0} MiB of memory remain"))?;
    Ok(format!("{what}; a good page was served in {seconds:.2} s; {more:+.1} MiB"))
}

fn foreign_hosts(workplace: &Workplace) -> Verdict {
    let (_server, address) = serve(workplace)?;
    for host in ["evil.example", "localhost.evil.example", "127.0.0.1.evil.example", "[::ffff:10.0.0.1]", ""]
    {
        for path in ["/", "/session", "/scene/1/object/0/surface"] {
            let answer = request(&address, &format!("GET {path}"), &format!("Host: {host}\r\n"), b"");
            require([400, 403].contains(&answer.status), || format!("{host:?} {path}: {}", answer.status))?;
        }
    }
    Ok("all 15 refused".into())
}

fn foreign_origins(workplace: &Workplace) -> Verdict {
    let (_server, address) = serve(workplace)?;
    let upgrade = "Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n\
                   Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n";
    let port = address.rsplit(':').next().unwrap_or_default();
    for origin in
        ["http://evil.example", "null", "http://localhost:1", &format!("https://{address}.evil:{port}")]
    {
        let origin = format!("Origin: {origin}\r\n");
        let session = request(&address, "GET /session", &format!("{origin}{upgrade}"), b"");
        let upload = request(
            &address,
            "POST /record?name=a.msh&young=1&poisson=0&density=1&scale=1&modes=1",
            &origin,
            b"x",
        );
        require(session.status == 403 && upload.status == 403, || {
            format!("{origin:?}: session {}, upload {}", session.status, upload.status)
        })?;
    }
    Ok("4 origins refused, for sessions and for uploads".into())
}

fn traversal(workplace: &Workplace) -> Verdict {
    let (_server, address) = serve(workplace)?;
    let paths = [
        "/../../../../etc/passwd",
        "/..%2f..%2f..%2fetc%2fpasswd",
        "//etc/passwd",
        "/%2e%2e/%2e%2e/etc/passwd",
        "/assets/../../fingers.toml",
        "/fingers.toml",
        "/cube.palp",
        "/..\\..\\etc\\passwd",
        "/\0",
        "/scene/1/object/99999999999999999999/surface",
        "/log/0/frames?from=18446744073709551615&count=18446744073709551615",
    ];
    for path in paths {
        let answer = get(&address, path);
        let text = String::from_utf8_lossy(&answer.body);
        require(!text.contains("root:") && !text.contains("[[device]]") && answer.status != 200, || {
            format!("{path}: status {}, {} bytes", answer.status, answer.body.len())
        })?;
    }
    Ok(format!("{} paths gave nothing", paths.len()))
}

fn garbage(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut random = Random(7);
    for _ in 0..2000 {
        if let Ok(mut stream) = connect(&address, BRIEF) {
            let count = 1 + random.below(400);
            let _ = stream.write_all(&random.bytes(count));
        }
    }
    still_serves(&mut server, &address, before, "2,000 connections")
}

fn slow_heads(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut slow: Vec<TcpStream> = Vec::new();
    for _ in 0..200 {
        if let Ok(mut stream) = connect(&address, BRIEF) {
            let _ = stream.write_all(format!("GET / HTTP/1.1\r\nHost: {address}\r\nX-A: ").as_bytes());
            slow.push(stream);
        }
    }
    let verdict = still_serves(&mut server, &address, before, &format!("{} half requests held", slow.len()))?;
    let closed = wait_until(Duration::from_secs(60), || slow.iter().all(is_closed));
    require(closed, || {
        format!("after 60 s {} of them were still open", slow.iter().filter(|s| !is_closed(s)).count())
    })?;
    Ok(verdict + "; all were closed")
}

/// Whether the other end has closed a connection, with or without an answer before.
fn is_closed(stream: &TcpStream) -> bool {
    let mut byte = [0; 64];
    let _ = stream.set_nonblocking(true);
    loop {
        match std::io::Read::read(&mut &*stream, &mut byte) {
            Ok(0) => return true,
            Ok(_) => {}
            Err(error) => return error.kind() != std::io::ErrorKind::WouldBlock,
        }
    }
}

fn half_uploads(workplace: &Workplace) -> Verdict {
    let (_server, address) = serve(workplace)?;
    let head = "POST /record?name=a.msh&young=2000&poisson=0.3&density=110&scale=1&modes=5 HTTP/1.1";
    let mut held = Vec::new();
    for _ in 0..8 {
        let mut stream = connect(&address, BRIEF)?;
        let _ = write!(stream, "{head}\r\nHost: {address}\r\nContent-Length: 1000000\r\n\r\n$MeshFormat\n");
        held.push(stream);
    }
    let start = Instant::now();
    let mut status = 0;
    let accepted = wait_until(Duration::from_secs(90), || {
        status = request(&address, head.trim_end_matches(" HTTP/1.1"), "", b"$MeshFormat\n").status;
        status == 202 || status == 400 || status == 422
    });
    require(accepted, || format!("after 90 s the next upload still got {status}"))?;
    is_served(&address, "")?;
    Ok(format!("8 half uploads held; the next one was accepted after {:.1} s", start.elapsed().as_secs_f64()))
}

fn many_connections(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut page = Page::open(&address, "")?;
    let mut held = Vec::new();
    let mut refused = 0;
    for _ in 0..1000 {
        match connect(&address, BRIEF) {
            Ok(stream) => held.push(stream),
            Err(_) => refused += 1,
        }
    }
    let first = page.step()?;
    let goes_on = page.step()? > first;
    require(goes_on, || "a page that was there before stands still".into())?;
    let told = held.last_mut().map(read_answer).unwrap_or_default();
    drop(held);
    let verdict = still_serves(&mut server, &address, before, "after they left")?;
    Ok(format!(
        "{refused} not let in; the last one was told {}; the page before them went on; {verdict}",
        told.status
    ))
}

fn message_flood(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut page = Page::open(&address, "")?;
    let sent = (0..20_000).take_while(|_| page.send(r#"{"type":"pause","paused":false}"#).is_ok()).count();
    let closed = wait_until(PATIENCE, || page.next().is_err());
    require(closed, || "the connection was not closed".into())?;
    still_serves(&mut server, &address, before, &format!("{sent} messages went out before it was closed"))
}

fn outsized_message(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut page = Page::open(&address, "")?;
    let _ = page.send(&"x".repeat(8 << 20));
    let closed = wait_until(PATIENCE, || page.next().is_err());
    require(closed, || "the connection was not closed".into())?;
    still_serves(&mut server, &address, before, "closed")
}

fn random_messages(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut random = Random(11);
    let samples = [
        r#"{"type":"press","pointer":7,"mode":"touch","position":[0,0,0]}"#,
        r#"{"type":"press","pointer":7,"mode":"hold","position":[0,0,0],"object":0,"triangle":12,"weights":[0.2,0.3,0.5]}"#,
        r#"{"type":"move","pointers":[{"pointer":7,"position":[0,0,0.05]}]}"#,
        r#"{"type":"set_physics","gravity":[0,0,-9.81],"step":0.001,"friction":0.5}"#,
        r#"{"type":"stream","format":"modal","stride":1}"#,
        r#"{"type":"slow_motion","slowdown":10}"#,
    ];
    let values = ["1e308", "-1", "null", "NaN", "4294967296", "\"\"", "[]", "{}", "0.0000001", "true"];
    let mut sent = 0;
    while sent < 20_000 {
        let Ok(mut page) = Page::open(&address, "") else { break };
        for _ in 0..250 {
            let mut text = samples[random.below(samples.len())].to_string();
            for _ in 0..random.below(3) {
                let at = random.below(text.len());
                let value = values[random.below(values.len())];
                if random.below(2) == 0 && text.is_char_boundary(at) {
                    text.insert_str(at, value);
                } else {
                    text = text.replacen("0", value, 1);
                }
            }
            sent += 1;
            if page.send(&text).is_err() {
                break;
            }
        }
    }
    // Whatever they have set, a good page comes back from it.
    let mut page = Page::open(&address, "")?;
    for text in [
        r#"{"type":"slow_motion","slowdown":1}"#,
        r#"{"type":"pause","paused":false}"#,
        r#"{"type":"set_physics","gravity":[0,0,-9.81],"step":0.001}"#,
        r#"{"type":"reset"}"#,
    ] {
        page.send(text)?;
    }
    still_serves(&mut server, &address, before, &format!("{sent} messages"))
}

fn resets(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let mut page = Page::open(&address, "")?;
    let mut sent = 0;
    let start = Instant::now();
    while sent < 2500 && start.elapsed() < Duration::from_secs(20) {
        // Below the rate at which a page is closed.
        for _ in 0..25 {
            page.send(r#"{"type":"reset"}"#)?;
            sent += 1;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    let asked = Instant::now();
    page.send(r#"{"type":"pause","paused":true}"#)?;
    while page.message("status")?["paused"] != true {
        require(asked.elapsed() < Duration::from_secs(10), || {
            format!("{sent} resets kept it busy for 10 s and more")
        })?;
    }
    let seconds = asked.elapsed().as_secs_f64();
    page.send(r#"{"type":"pause","paused":false}"#)?;
    drop(page);
    still_serves(
        &mut server,
        &address,
        before,
        &format!("{sent} resets; a pause took effect {seconds:.2} s later"),
    )
}

fn deaf_pages(workplace: &Workplace) -> Verdict {
    let (mut server, address) = serve(workplace)?;
    let before = server.memory_mib();
    let deaf: Vec<_> = (0..10).filter_map(|_| Page::open(&address, "").ok()).collect();
    let mut page = Page::open(&address, "")?;
    let (start, first) = (Instant::now(), page.step()?);
    let mut last = first;
    while start.elapsed() < Duration::from_secs(15) {
        last = page.step()?;
    }
    let rate = f64::from(last - first) / start.elapsed().as_secs_f64();
    require(rate > 500.0, || format!("{} deaf pages slowed the scene to {rate:.0} steps/s", deaf.len()))?;
    drop(page);
    still_serves(
        &mut server,
        &address,
        before,
        &format!("{rate:.0} steps/s beside {} deaf pages", deaf.len()),
    )
}

fn guessed_tokens(workplace: &Workplace) -> Verdict {
    let (_server, address, query) = serve_with_token(workplace)?;
    let start = Instant::now();
    let (mut guesses, mut answered) = (0, 0_u32);
    while start.elapsed() < Duration::from_secs(3) {
        let path = format!("/scene/1/object/0/surface?token={guesses:032x}");
        let mut stream = connect_from(GUESSER, &address, BRIEF)?;
        let sent = write!(stream, "GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n");
        let answer = sent.map_or_else(|_| http::Answer::default(), |()| read_answer(&mut stream));
        guesses += 1;
        answered += u32::from(answer.status == 403);
        require(answer.status != 200, || format!("{path} was let in"))?;
    }
    let rate = f64::from(answered) / start.elapsed().as_secs_f64();
    require(rate < 50.0, || format!("{rate:.0} guesses a second were looked at"))?;
    // The right holder on another address is not locked out.
    let seconds = is_served(&address, &query)?;
    Ok(format!(
        "{guesses} guesses, {answered} looked at ({rate:.1} a second); the right token from another address was let in after {seconds:.2} s"
    ))
}

fn token_in_processes(workplace: &Workplace) -> Verdict {
    let (server, ..) = serve_with_token(workplace)?;
    let line = std::fs::read(format!("/proc/{}/cmdline", server.id())).map_err(|error| error.to_string())?;
    let text = String::from_utf8_lossy(&line).into_owned();
    require(!text.contains(TOKEN), || "the token stands in the command line".into())?;
    let short = workplace
        .palpate("serve fingers.toml --no-browser --listen 0.0.0.0:0")
        .env("PALPATE_TOKEN", "12345678")
        .output();
    let short = short.map_err(|error| error.to_string())?;
    require(short.status.code() == Some(1), || "a token of 8 characters is accepted".into())?;
    let error = String::from_utf8_lossy(&short.stderr).trim().to_string();
    Ok(format!("taken from the environment, not in the command line; a short one: {error:?}"))
}

fn policy(workplace: &Workplace) -> Verdict {
    let (_server, address) = serve(workplace)?;
    let answer = get(&address, "/");
    let policy = answer.head.lines().find_map(|line| line.strip_prefix("content-security-policy:"));
    let policy = policy.ok_or("the page has no content security policy")?.trim();
    require(
        !policy.contains("unsafe-inline") && !policy.contains("unsafe-eval") && !policy.contains('*'),
        || format!("the policy has holes: {policy}"),
    )?;
    for part in ["default-src", "frame-ancestors", "base-uri", "object-src"] {
        require(policy.contains(part), || format!("the policy lacks {part}: {policy}"))?;
    }
    for header in ["x-content-type-options: nosniff", "referrer-policy: no-referrer"] {
        require(answer.head.contains(header), || format!("the answer lacks {header}"))?;
    }
    Ok(policy.into())
}
