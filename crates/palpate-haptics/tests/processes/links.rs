//! Links between processes over QUIC, through a wire that loses, delays, duplicates and cuts. QUIC's own time can't be simulated; what
//! a link does with late and duplicate messages is tested in simulated time in `link/sequence.rs`.

use glam::DVec3;
use palpate_haptics::device::{Device, DeviceSpec, Mount, Reading};
use palpate_haptics::link::{LinkClient, LinkServer, LinkState, Secret};
use palpate_haptics::{Clock, Effort, Error, ForcePort, HapticUpdate, Safety, SafetyLimits, port};
use std::collections::BinaryHeap;
use std::net::{SocketAddr, UdpSocket};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const LOCALHOST: &str = "127.0.0.1:0";

/// Faults of the wire, per thousand datagrams.
#[derive(Default)]
struct Faults {
    lost: AtomicU32,
    doubled: AtomicU32,
    /// Largest delay of a datagram [ms].
    late_ms: AtomicU32,
    cut: AtomicBool,
    over: AtomicBool,
}

/// Wire between a client and a server. Returns the address that the client should send to, and the thread.
fn wire(server: SocketAddr, faults: Arc<Faults>) -> (SocketAddr, std::thread::JoinHandle<()>) {
    let front = UdpSocket::bind(LOCALHOST).expect("a socket");
    let back = UdpSocket::bind(LOCALHOST).expect("a socket");
    let address = front.local_addr().expect("an address");
    for socket in [&front, &back] {
        socket.set_nonblocking(true).expect("a socket that does not wait");
    }
    let thread = std::thread::spawn(move || {
        let mut client: Option<SocketAddr> = None;
        let mut waiting: BinaryHeap<(std::cmp::Reverse<Instant>, bool, Vec<u8>)> = BinaryHeap::new();
        let mut random = 1_u64;
        let mut thousandth = move || {
            random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (random >> 33) as u32 % 1000
        };
        let mut bytes = [0; 2048];
        while !faults.over.load(Ordering::Relaxed) {
            for forth in [true, false] {
                let socket = if forth { &front } else { &back };
                while let Ok((length, from)) = socket.recv_from(&mut bytes) {
                    if forth {
                        client = Some(from);
                    }
                    let lost = faults.cut.load(Ordering::Relaxed)
                        || thousandth() < faults.lost.load(Ordering::Relaxed);
                    let copies = if lost {
                        0
                    } else {
                        1 + u32::from(thousandth() < faults.doubled.load(Ordering::Relaxed))
                    };
                    for _ in 0..copies {
                        let late = faults.late_ms.load(Ordering::Relaxed) * thousandth() / 1000;
                        let due = Instant::now() + Duration::from_millis(late.into());
                        waiting.push((std::cmp::Reverse(due), forth, bytes[..length].to_vec()));
                    }
                }
            }
            while waiting.peek().is_some_and(|(due, ..)| due.0 <= Instant::now()) {
                let Some((_, forth, data)) = waiting.pop() else { break };
                let sent = if forth {
                    back.send_to(&data, server)
                } else {
                    front.send_to(&data, client.unwrap_or(server))
                };
                drop(sent);
            }
            std::thread::sleep(Duration::from_micros(200));
        }
    });
    (address, thread)
}

/// Device that stands still and records its forces.
struct ForceRecorder {
    pushes: Arc<Mutex<Vec<(f64, DVec3)>>>,
}

impl Device for ForceRecorder {
    fn spec(&self) -> DeviceSpec {
        DeviceSpec::TOUCH
    }

    fn read(&mut self, _: f64) -> Result<Reading, Error> {
        Ok(Reading { position: DVec3::X * 0.01, orientation: None, buttons: 0 })
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), Error> {
        self.pushes.lock().expect("no panic").push((now_s, force));
        Ok(())
    }
}

/// Force process that replies to every motion with 1 N until `over` is set.
fn force_process(mut port: ForcePort, clock: Clock, over: Arc<AtomicBool>) -> std::thread::JoinHandle<u64> {
    std::thread::spawn(move || {
        let mut tick = clock.next_after(0);
        let mut silent = 0;
        while !over.load(Ordering::Relaxed) {
            clock.wait(tick);
            tick = clock.next_after(tick);
            let (motion, now_s) = (port.newest(), clock.now_s());
            silent += u64::from(motion.sequence > 0 && now_s - motion.time_s > 0.1);
            port.send(Effort {
                sequence: tick,
                in_reply_to: motion.sequence,
                time_s: now_s,
                force: DVec3::Z,
                absorbed_j: 0.0,
            });
        }
        silent
    })
}

fn limits() -> SafetyLimits {
    SafetyLimits { ramp_up_s: 0.05, recovery_s: 0.05, ..SafetyLimits::default() }
}

#[test]
fn a_force_ramps_down_when_the_link_is_cut_and_comes_back_by_itself() {
    let start = Instant::now();
    let clock = Clock::new(start, 1e-3);
    let secret = Secret::new("only for this test").expect("long enough");
    let (device_port, force_port) = port();
    let ports = vec![("finger".to_string(), device_port)];
    let server = LinkServer::new(LOCALHOST.parse().expect("an address"), &secret, ports, (start, 1e-3))
        .expect("it listens");
    let faults = Arc::new(Faults::default());
    let (address, wire) = wire(server.address().expect("an address"), faults.clone());
    let over = Arc::new(AtomicBool::new(false));
    let forces = force_process(force_port, clock, over.clone());
    let (port, client) = LinkClient::new(address, &secret, "finger", start).expect("a socket");
    let pushes = Arc::new(Mutex::new(Vec::new()));
    let device = Box::new(ForceRecorder { pushes: pushes.clone() });
    let mut update = HapticUpdate::new(device, port, Mount::default(), Safety::new(limits()), None, false);
    let mut tick = clock.next_after(0);
    // Update until the force is as it should be; gives when [s]. The time bounds a failure, not a success.
    let mut until = |wanted: &dyn Fn(DVec3) -> bool, what: &str| {
        let since = Instant::now();
        loop {
            clock.wait(tick);
            tick = clock.next_after(tick);
            update.cycle(clock.now_s());
            let (time, force) = *pushes.lock().expect("no panic").last().expect("a push each time");
            if wanted(force) {
                return time;
            }
            assert!(since.elapsed() < Duration::from_secs(30), "{what}: {force}, {:?}", client.state());
        }
    };
    let whole = |force: DVec3| force.z > 0.999;
    until(&whole, "the link comes");
    assert_eq!(client.state(), LinkState::Connected);

    // Bad weather: a fifth is lost, some come twice, all late by up to 30 ms, so that many overtake others.
    faults.lost.store(200, Ordering::Relaxed);
    faults.doubled.store(100, Ordering::Relaxed);
    faults.late_ms.store(30, Ordering::Relaxed);
    let fine = clock.now_s() + 0.5;
    until(&|_| clock.now_s() > fine, "half a second of bad weather");
    until(&whole, "force all the same");
    let counts = server.counts();
    assert!(counts.motions > 100 && counts.old > 10 && counts.garbage == 0, "{counts:?}");
    faults.lost.store(0, Ordering::Relaxed);
    faults.doubled.store(0, Ordering::Relaxed);
    faults.late_ms.store(0, Ordering::Relaxed);

    // Two cuts: one shorter than QUIC's idle timeout of 1 s, one longer. That time can't be simulated.
    for long_s in [0.4, 1.3] {
        until(&whole, "force before the cut");
        faults.cut.store(true, Ordering::Relaxed);
        let cut = clock.now_s();
        until(&|_| clock.now_s() > cut + long_s, "the cut");
        let after: Vec<_> =
            pushes.lock().expect("no panic").iter().copied().filter(|(time, _)| *time > cut).collect();
        // Under way for some ms on a busy machine; then the watchdog's 20 ms, and 20 ms to take it away.
        let gone = after.iter().find(|(_, force)| *force == DVec3::ZERO).expect("it goes");
        assert!(gone.0 - cut < 0.3, "gone after {} s", gone.0 - cut);
        assert!(after.iter().filter(|(time, _)| *time > gone.0).all(|(_, force)| *force == DVec3::ZERO));
        faults.cut.store(false, Ordering::Relaxed);
        until(&whole, "it heals");
    }
    assert!(server.counts().connected >= 2, "{:?}", server.counts());
    assert!(update.counts().safety.trips >= 2 && update.counts().force_max_n <= 1.0 + 1e-9);

    over.store(true, Ordering::Relaxed);
    assert!(forces.join().expect("no panic") > 100, "the force process noticed the silence");
    faults.over.store(true, Ordering::Relaxed);
    wire.join().expect("no panic");
}

/// State of a client that has connected or was refused.
fn settled(client: &LinkClient) -> LinkState {
    for _ in 0..600 {
        match client.state() {
            LinkState::Connecting(_) => std::thread::sleep(Duration::from_millis(20)),
            state => return state,
        }
    }
    client.state()
}

#[test]
fn clients_with_another_secret_are_refused_and_garbage_is_dropped() {
    let start = Instant::now();
    let secret = Secret::new("only for this test").expect("long enough");
    let (device_port, mut force_port) = port();
    let ports = vec![("finger".to_string(), device_port)];
    let server = LinkServer::new(LOCALHOST.parse().expect("an address"), &secret, ports, (start, 1e-3))
        .expect("it listens");
    let address = server.address().expect("an address");
    let link = |secret: &Secret, name: &str| LinkClient::new(address, secret, name, start).expect("a socket");

    let (_port, other) = link(&Secret::new("another secret, too").expect("long enough"), "finger");
    assert_eq!(settled(&other), LinkState::Refused(format!("{address} has another secret")));
    let (_port, none) = link(&Secret::none(), "finger");
    assert_eq!(settled(&none), LinkState::Refused(format!("{address} has another secret")));
    let (_port, nobody) = link(&secret, "toe");
    let refused = "the scene has no device \"toe\" for a link, only finger".to_string();
    assert_eq!(settled(&nobody), LinkState::Refused(refused));
    drop((other, none, nobody));

    let (mut first_port, first) = link(&secret, "finger");
    assert_eq!(settled(&first), LinkState::Connected);
    let (_port, second) = link(&secret, "finger");
    assert_eq!(settled(&second), LinkState::Refused("the device \"finger\" is taken".to_string()));
    drop(second);

    // Whatever is thrown at the socket, what is linked goes on.
    let stranger = UdpSocket::bind(LOCALHOST).expect("a socket");
    for length in 0..1500_usize {
        let bytes: Vec<u8> = (0..length).map(|at| (at * 31 + length * 17) as u8).collect();
        drop(stranger.send_to(&bytes, address));
    }
    let mut sequence = 0;
    while force_port.newest().sequence < 10 {
        assert!(start.elapsed() < Duration::from_secs(60), "{:?}", first.state());
        sequence += 1;
        first_port.send(palpate_haptics::Motion { sequence, ..Default::default() });
        std::thread::sleep(Duration::from_millis(1));
    }
    assert_eq!(first.state(), LinkState::Connected);
    let counts = server.counts();
    assert!(counts.refused >= 4 && counts.garbage == 0, "{counts:?}");
}

#[test]
fn other_machines_need_a_secret() {
    let start = Instant::now();
    let listens =
        LinkServer::new("0.0.0.0:0".parse().expect("an address"), &Secret::none(), Vec::new(), (start, 1e-3));
    let error = listens.err().map(|error| error.to_string());
    assert_eq!(error.as_deref(), Some("0.0.0.0 is reached from other machines: a link there needs a secret"));
    let links =
        LinkClient::new("192.0.2.1:7400".parse().expect("an address"), &Secret::none(), "finger", start);
    assert!(links.is_err());
}
