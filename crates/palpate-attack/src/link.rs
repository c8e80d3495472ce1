//! Attacks on the link between a scene and devices in other processes.

use crate::attack::{Attack, Verdict, require};
use crate::child::Running;
use crate::random::Random;
use crate::workplace::{Workplace, json};
use std::net::{SocketAddr, UdpSocket};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "link", name: "100,000 random datagrams", run: datagrams },
    Attack { group: "link", name: "a stranger with another secret", run: strangers },
    Attack { group: "link", name: "a device whose name is taken", run: taken_name },
    Attack { group: "link", name: "motions cut, forces not", run: motions_cut },
    Attack { group: "link", name: "forces cut, motions not", run: forces_cut },
    Attack { group: "link", name: "both ways late by 300 ms", run: late },
    Attack { group: "link", name: "positions in millimetres", run: millimetres },
];

/// A scene with a linked finger, which runs for some seconds.
fn scene(workplace: &Workplace, seconds: u32) -> Result<(Running, String), String> {
    let address = workplace.free_address()?;
    let run = workplace
        .start(&format!("run linked.toml --realtime --duration {seconds} --json --listen {address}"))?;
    run.wait_for("waiting at")?;
    Ok((run, address))
}

/// JSON of a run that has ended well.
fn report(run: Running, seconds: u64) -> Result<serde_json::Value, String> {
    let ended = run.end_within(Duration::from_secs(seconds + 30))?;
    require(ended.code == Some(0), || format!("it ended with {:?}: {}", ended.code, ended.printed))?;
    json(&ended.output)
}

fn datagrams(workplace: &Workplace) -> Verdict {
    let (run, address) = scene(workplace, 8)?;
    let socket = UdpSocket::bind("127.0.0.1:0").map_err(|error| error.to_string())?;
    let mut random = Random(3);
    for _ in 0..100_000 {
        let count = 1 + random.below(1300);
        let _ = socket.send_to(&random.bytes(count), &address);
    }
    let finger = json(
        &workplace
            .succeed(&format!("device left --path left.csv --connect {address} --duration 1 --json"))?,
    )?;
    let linked = finger["linked_s"].as_f64().unwrap_or(0.0);
    require(linked > 0.5, || format!("a good device was linked for {linked} s of 1 s"))?;
    let report = report(run, 8)?;
    Ok(format!(
        "a good device was linked for {linked:.2} s of 1 s; own overruns {}",
        report["force_process"]["own_overruns"]
    ))
}

fn strangers(workplace: &Workplace) -> Verdict {
    workplace.write("secret.txt", "9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08\n")?;
    workplace.write("wrong.txt", "60303ae22b998861bce3b28f33eec1be758a213c86c93c076dbe9f558c11c752\n")?;
    let address = workplace.free_address()?;
    let run = workplace.start(&format!(
        "run linked.toml --realtime --duration 6 --json --secret secret.txt --listen {address}"
    ))?;
    run.wait_for("waiting at")?;
    let device = format!("device left --path left.csv --connect {address} --duration 1 --wait 1");
    let wrong = workplace.fail(&format!("{device} --secret wrong.txt"))?;
    let none = workplace.fail(&device)?;
    workplace.succeed(&format!("{device} --secret secret.txt"))?;
    let report = report(run, 6)?;
    Ok(format!("{wrong}; without a secret: {none}; refused {}", report["links"]["refused"]))
}

fn taken_name(workplace: &Workplace) -> Verdict {
    let (run, address) = scene(workplace, 8)?;
    let device = format!("device left --path left.csv --connect {address}");
    let first = workplace.start(&format!("{device} --duration 3"))?;
    first.wait_for("linked to")?;
    let second = workplace.fail(&format!("{device} --duration 1 --wait 0.5"))?;
    // One that waits gets the name when the first has gone.
    workplace.succeed(&format!("{device} --duration 1 --wait 10"))?;
    let ended = first.end()?;
    require(ended.code == Some(0), || format!("the first one was disturbed: {}", ended.printed))?;
    report(run, 8)?;
    Ok(format!("{second}; one that waited came in after the first had gone"))
}

/// Relay of datagrams that can be cut in each direction, and delays.
struct Relay {
    address: SocketAddr,
    cut_to_scene: Arc<AtomicBool>,
    cut_to_device: Arc<AtomicBool>,
    delay_ms: Arc<AtomicU64>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Relay {
    fn start(scene: &str) -> Result<Self, String> {
        let scene: SocketAddr = scene.parse().map_err(|error| format!("{scene}: {error}"))?;
        let bind = || UdpSocket::bind("127.0.0.1:0").map_err(|error| error.to_string());
        let (front, back) = (bind()?, bind()?);
        let nonblocking = front.set_nonblocking(true).and_then(|()| back.set_nonblocking(true));
        nonblocking.map_err(|error| error.to_string())?;
        let address = front.local_addr().map_err(|error| error.to_string())?;
        let flag = || Arc::new(AtomicBool::new(false));
        let mut relay = Self {
            address,
            cut_to_scene: flag(),
            cut_to_device: flag(),
            delay_ms: Arc::default(),
            stop: flag(),
            thread: None,
        };
        let (to_scene, to_device) = (relay.cut_to_scene.clone(), relay.cut_to_device.clone());
        let (delay_ms, stop) = (relay.delay_ms.clone(), relay.stop.clone());
        relay.thread = Some(std::thread::spawn(move || {
            let mut device = None;
            let mut late: std::collections::VecDeque<(Instant, bool, Vec<u8>)> = Default::default();
            let mut buffer = [0; 2048];
            while !stop.load(Ordering::Relaxed) {
                let due = Instant::now() + Duration::from_millis(delay_ms.load(Ordering::Relaxed));
                while let Ok((count, from)) = front.recv_from(&mut buffer) {
                    device = Some(from);
                    if !to_scene.load(Ordering::Relaxed) {
                        late.push_back((due, true, buffer[..count].to_vec()));
                    }
                }
                while let Ok((count, _)) = back.recv_from(&mut buffer) {
                    if !to_device.load(Ordering::Relaxed) {
                        late.push_back((due, false, buffer[..count].to_vec()));
                    }
                }
                while late.front().is_some_and(|(due, ..)| *due <= Instant::now()) {
                    let Some((_, is_to_scene, bytes)) = late.pop_front() else { break };
                    match (is_to_scene, device) {
                        (true, _) => drop(back.send_to(&bytes, scene)),
                        (false, Some(device)) => drop(front.send_to(&bytes, device)),
                        (false, None) => {}
                    }
                }
                std::thread::sleep(Duration::from_micros(100));
            }
        }));
        Ok(relay)
    }
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

/// Links a device through a relay, does harm five times for 0.4 s each, and gives the device's report.
fn through_relay(workplace: &Workplace, harm: impl Fn(&Relay, bool)) -> Result<serde_json::Value, String> {
    let (run, address) = scene(workplace, 14)?;
    let relay = Relay::start(&address)?;
    let device = workplace.start(&format!(
        "device left --path left.csv --simulated touch --connect {} --duration 8 --json",
        relay.address
    ))?;
    device.wait_for("linked to")?;
    for _ in 0..5 {
        std::thread::sleep(Duration::from_millis(800));
        harm(&relay, true);
        std::thread::sleep(Duration::from_millis(400));
        harm(&relay, false);
    }
    let ended = device.end()?;
    require(ended.code == Some(0), || format!("the device ended with {:?}: {}", ended.code, ended.printed))?;
    report(run, 14)?;
    json(&ended.output)
}

/// Trips of a device's safety, as its report states them.
fn trips(device: &serde_json::Value) -> Result<u64, String> {
    let trips = device["safety"]["trips"].as_u64();
    trips.ok_or_else(|| format!("the device's report has no trips: {device}"))
}

fn motions_cut(workplace: &Workplace) -> Verdict {
    let device = through_relay(workplace, |relay, cut| relay.cut_to_scene.store(cut, Ordering::Relaxed))?;
    let trips = trips(&device)?;
    require(trips >= 5, || format!("5 cuts gave {trips} trips: {device}"))?;
    Ok(format!("5 cuts of 0.4 s, {trips} trips: {}", device["safety"]))
}

fn forces_cut(workplace: &Workplace) -> Verdict {
    let device = through_relay(workplace, |relay, cut| relay.cut_to_device.store(cut, Ordering::Relaxed))?;
    let trips = trips(&device)?;
    require(trips >= 5, || format!("5 cuts gave {trips} trips: {device}"))?;
    Ok(format!("5 cuts of 0.4 s, {trips} trips: {}", device["safety"]))
}

fn late(workplace: &Workplace) -> Verdict {
    let device = through_relay(workplace, |relay, late| {
        relay.delay_ms.store(if late { 300 } else { 0 }, Ordering::Relaxed)
    })?;
    let trips = trips(&device)?;
    require(trips >= 5, || format!("5 times a round trip of 600 ms gave {trips} trips: {device}"))?;
    Ok(format!("5 times a round trip of 600 ms, {trips} trips: {}", device["safety"]))
}

fn millimetres(workplace: &Workplace) -> Verdict {
    workplace.write("millimetres.csv", "t,x,y,z\n0,-58,0,50\n1,-52,0,50\n2,-58,0,50\n")?;
    let (run, address) = scene(workplace, 5)?;
    let ended = workplace
        .run(&format!("device left --path millimetres.csv --connect {address} --duration 2 --json"))?;
    require(ended.code.is_some(), || format!("the device was ended by a signal: {}", ended.printed))?;
    let report = report(run, 5)?;
    let unsolved = report["unsolved_steps"].as_u64();
    require(unsolved == Some(0), || format!("{unsolved:?} steps were left unsolved"))?;
    let text = format!("{report}{}", ended.printed);
    require(text.contains("millimetres"), || format!("nobody said what is wrong: {text}"))?;
    Ok(format!(
        "no step unsolved; {}",
        ended.printed.lines().find(|line| line.contains("millimetres")).unwrap_or("told by the scene")
    ))
}
