//! Links in simulated time: both ends with QUIC and encryption, over a network in memory that loses, duplicates, delays and cuts.
//!
//! All clocks are tokio's, which is paused: time moves on to the next timer when every task waits, so a second takes milliseconds
//! and a busy machine makes no difference.

use super::client::{LinkClient, LinkState};
use super::identity::Secret;
use super::lock;
use super::server::{LinkServer, server_config};
use crate::device::{Device, DeviceSpec, Mount, Reading};
use crate::{Effort, Error, ForcePort, HapticUpdate, Safety, SafetyLimits, port};
use glam::DVec3;
use palpate_testkit::Random;
use quinn::udp::{RecvMeta, Transmit};
use quinn::{AsyncUdpSocket, Endpoint, EndpointConfig, TokioRuntime, UdpPoller};
use std::collections::{BTreeMap, VecDeque};
use std::io::{IoSliceMut, Result as IoResult};
use std::net::{Ipv4Addr, SocketAddr};
use std::pin::Pin;
use std::sync::{Arc, Mutex};
use std::task::{Context, Poll, Waker};
use std::time::Duration;
use tokio::time::Instant;

/// Period of force process and haptic update [ms].
const TICK_MS: u64 = 1;

/// Time that a datagram is under way at least [ms].
const LATENCY_MS: u64 = 2;

/// Ports of the server and of the client.
const SERVER: u16 = 1;
const CLIENT: u16 = 2;

/// Ticks after which a wait has failed.
const MAX_TICKS: u64 = 30_000;

/// Force from which on it is whole [N]: the last thousandth of its ramp.
const WHOLE_N: f64 = 0.999;

/// Round-off of a force that is ramped and limited [N].
const LIMITED_N: f64 = 1e-9;

/// Longest time from a cut to no force [ms]: under way, then the watchdog's 20 ms, 20 ms of ramp, and a tick at either end.
const GONE_AFTER_MS: f64 = (LATENCY_MS + 20 + 20 + 2 * TICK_MS) as f64;

/// Round-off of a time in seconds that is compared in milliseconds [ms].
const TIME_ROUND_OFF_MS: f64 = 1e-6;

/// Faults of the network.
#[derive(Debug, Clone, Copy, Default)]
struct Faults {
    /// Share of datagrams that are lost.
    lost: f64,
    /// Share of datagrams that come twice.
    doubled: f64,
    /// Largest delay of a datagram beyond the latency [ms].
    late_ms: f64,
    /// Whether nothing passes.
    cut: bool,
    /// Whether nothing passes from the device to the scene.
    cut_motions: bool,
    /// Latency beyond the usual one [ms].
    slow_ms: u64,
}

/// Datagrams that have arrived at a socket, with their senders.
#[derive(Debug, Default)]
struct Inbox {
    datagrams: VecDeque<(SocketAddr, Vec<u8>)>,
    waiting: Option<Waker>,
}

/// Network in memory.
#[derive(Debug)]
struct Network {
    inboxes: Mutex<BTreeMap<SocketAddr, Arc<Mutex<Inbox>>>>,
    faults: Mutex<Faults>,
    random: Mutex<Random>,
}

impl Network {
    fn new(seed: u64) -> Arc<Self> {
        Arc::new(Self {
            inboxes: Mutex::default(),
            faults: Mutex::default(),
            random: Mutex::new(Random::new(seed)),
        })
    }

    fn set(&self, faults: Faults) {
        *lock(&self.faults) = faults;
    }

    /// Endpoint at a port of this machine.
    fn endpoint(self: &Arc<Self>, port: u16, server: Option<quinn::ServerConfig>) -> Endpoint {
        let address = SocketAddr::from((Ipv4Addr::LOCALHOST, port));
        let inbox = Arc::<Mutex<Inbox>>::default();
        lock(&self.inboxes).insert(address, inbox.clone());
        let socket = Arc::new(MemorySocket { address, inbox, network: self.clone() });
        Endpoint::new_with_abstract_socket(EndpointConfig::default(), server, socket, Arc::new(TokioRuntime))
            .expect("an endpoint")
    }

    /// Sends a datagram; it arrives later, once, twice or never.
    fn send(&self, from: SocketAddr, to: SocketAddr, datagram: &[u8]) {
        let (faults, mut random) = (*lock(&self.faults), lock(&self.random));
        let Some(inbox) = lock(&self.inboxes).get(&to).cloned() else { return };
        let cut = faults.cut || faults.cut_motions && to.port() == SERVER;
        let lost = cut || random.chance(faults.lost);
        let copies = if lost { 0 } else { 1 + u32::from(random.chance(faults.doubled)) };
        for _ in 0..copies {
            let late_ms = LATENCY_MS + faults.slow_ms + random.within(0.0, faults.late_ms) as u64;
            let (inbox, datagram) = (inbox.clone(), datagram.to_vec());
            tokio::spawn(async move {
                tokio::time::sleep(Duration::from_millis(late_ms)).await;
                let mut inbox = lock(&inbox);
                inbox.datagrams.push_back((from, datagram));
                inbox.waiting.take().into_iter().for_each(Waker::wake);
            });
        }
    }
}

/// Socket of the network.
#[derive(Debug)]
struct MemorySocket {
    address: SocketAddr,
    inbox: Arc<Mutex<Inbox>>,
    network: Arc<Network>,
}

impl AsyncUdpSocket for MemorySocket {
    fn create_io_poller(self: Arc<Self>) -> Pin<Box<dyn UdpPoller>> {
        Box::pin(AlwaysWritable)
    }

    fn try_send(&self, transmit: &Transmit<'_>) -> IoResult<()> {
        self.network.send(self.address, transmit.destination, transmit.contents);
        Ok(())
    }

    fn poll_recv(
        &self,
        context: &mut Context<'_>,
        buffers: &mut [IoSliceMut<'_>],
        metas: &mut [RecvMeta],
    ) -> Poll<IoResult<usize>> {
        let mut inbox = lock(&self.inbox);
        let Some((from, datagram)) = inbox.datagrams.pop_front() else {
            inbox.waiting = Some(context.waker().clone());
            return Poll::Pending;
        };
        let length = datagram.len();
        buffers[0][..length].copy_from_slice(&datagram);
        metas[0] = RecvMeta { addr: from, len: length, stride: length, ecn: None, dst_ip: None };
        Poll::Ready(Ok(1))
    }

    fn local_addr(&self) -> IoResult<SocketAddr> {
        Ok(self.address)
    }
}

/// A socket in memory takes every datagram at once.
#[derive(Debug)]
struct AlwaysWritable;

impl UdpPoller for AlwaysWritable {
    fn poll_writable(self: Pin<&mut Self>, _: &mut Context<'_>) -> Poll<IoResult<()>> {
        Poll::Ready(Ok(()))
    }
}

/// Device that stands still and records its forces with their times [s].
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
        lock(&self.pushes).push((now_s, force));
        Ok(())
    }
}

/// A device and a force process that pushes it with 1 N along z, with a link between them.
struct Linked {
    network: Arc<Network>,
    server: LinkServer,
    client: LinkClient,
    update: HapticUpdate,
    force_port: ForcePort,
    start: Instant,
    tick: u64,
    /// Ticks at which the newest motion was older than 0.1 s.
    silent: u64,
    pushes: Arc<Mutex<Vec<(f64, DVec3)>>>,
}

impl Linked {
    fn new(limits: SafetyLimits) -> Self {
        let network = Network::new(1);
        let secret = Secret::new("only for this test").expect("long enough");
        let start = Instant::now();
        let (device_port, force_port) = port();
        let config = server_config(&secret).expect("a configuration");
        let ports = vec![("finger".to_string(), device_port)];
        let (server, listening) =
            LinkServer::on(network.endpoint(SERVER, Some(config)), ports, start.into_std());
        tokio::spawn(listening);
        let address = server.address().expect("an address");
        let own = network.endpoint(CLIENT, None);
        let (port, client, connected) =
            LinkClient::on(own, address, &secret, "finger", start.into_std()).expect("a client");
        tokio::spawn(connected);
        let pushes = Arc::new(Mutex::new(Vec::new()));
        let device = Box::new(ForceRecorder { pushes: pushes.clone() });
        let limits = SafetyLimits { ramp_up_s: 0.05, recovery_s: 0.05, ..limits };
        let update = HapticUpdate::new(device, port, Mount::default(), Safety::new(limits), None, false);
        Self { network, server, client, update, force_port, start, tick: 0, silent: 0, pushes }
    }

    /// Time since the start [s].
    fn now_s(&self) -> f64 {
        self.start.elapsed().as_secs_f64()
    }

    /// A tick of all processes. Gives the force [N].
    async fn tick(&mut self) -> DVec3 {
        tokio::time::sleep(Duration::from_millis(TICK_MS)).await;
        self.tick += 1;
        let (motion, now_s) = (self.force_port.newest(), self.now_s());
        self.silent += u64::from(motion.sequence > 0 && now_s - motion.time_s > 0.1);
        self.force_port.send(Effort {
            sequence: self.tick,
            in_reply_to: motion.sequence,
            time_s: now_s,
            force: DVec3::Z,
            absorbed_j: 0.0,
        });
        self.server.send_new_efforts();
        self.update.cycle(now_s);
        lock(&self.pushes).last().expect("a push each time").1
    }

    /// Ticks until the whole force is there.
    async fn until_whole(&mut self, what: &str) {
        for _ in 0..MAX_TICKS {
            if self.tick().await.z > WHOLE_N {
                return;
            }
        }
        panic!("never: {what}, {:?}", self.client.state());
    }
}

/// Runs a test in simulated time.
fn in_simulated_time(test: impl Future<Output = ()>) {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_time().start_paused(true).build();
    runtime.expect("a runtime").block_on(test);
}

#[test]
fn a_force_ramps_down_when_the_link_is_cut_and_comes_back_by_itself() {
    in_simulated_time(async {
        // Both ways are late by up to 32 ms.
        let weather = SafetyLimits { motion_age_s: 0.2, round_trip_s: 0.2, ..SafetyLimits::default() };
        let mut linked = Linked::new(weather);
        linked.until_whole("the link comes").await;
        assert_eq!(linked.client.state(), LinkState::Connected);

        // Bad weather: a fifth is lost, some come twice, all late by up to 30 ms, so that many overtake others.
        linked.network.set(Faults { lost: 0.2, doubled: 0.1, late_ms: 30.0, ..Faults::default() });
        for _ in 0..500 {
            linked.tick().await;
        }
        linked.until_whole("force all the same").await;
        let counts = linked.server.counts();
        assert!(counts.motions > 100 && counts.old > 10 && counts.garbage == 0, "{counts:?}");
        linked.network.set(Faults::default());
        // What is late has arrived.
        for _ in 0..50 {
            linked.tick().await;
        }

        // Two cuts: one shorter than QUIC's idle timeout of 1 s, one longer.
        for (long_ms, connected) in [(400, 1), (1300, 2)] {
            linked.until_whole("force before the cut").await;
            linked.network.set(Faults { cut: true, ..Faults::default() });
            let cut_s = linked.now_s();
            for _ in 0..long_ms {
                linked.tick().await;
            }
            let after: Vec<_> =
                lock(&linked.pushes).iter().copied().filter(|(time, _)| *time > cut_s).collect();
            let gone = after.iter().find(|(_, force)| *force == DVec3::ZERO).expect("it goes").0;
            let took_ms = (gone - cut_s) * 1e3;
            assert!((20.0..=GONE_AFTER_MS + TIME_ROUND_OFF_MS).contains(&took_ms), "gone after {took_ms} ms");
            assert!(after.iter().filter(|(time, _)| *time > gone).all(|(_, force)| *force == DVec3::ZERO));
            linked.network.set(Faults::default());
            linked.until_whole("it heals").await;
            assert_eq!(linked.server.counts().connected, connected, "connections after {long_ms} ms");
        }
        let counts = linked.update.counts();
        assert!(counts.safety.trips >= 2 && counts.force_max_n <= 1.0 + LIMITED_N, "{counts:?}");
        assert!(linked.silent > 100, "the force process noticed the silence: {}", linked.silent);
    });
}

#[test]
fn forces_that_answer_an_old_motion_are_taken_away_and_counted_though_they_arrive() {
    in_simulated_time(async {
        let mut linked = Linked::new(SafetyLimits::default());
        for cut in 1..=5 {
            linked.until_whole("force before the cut").await;
            // Shorter than the 0.1 s after which the force process suspends a silent device.
            linked.network.set(Faults { cut_motions: true, ..Faults::default() });
            let cut_s = linked.now_s();
            for _ in 0..90 {
                linked.tick().await;
            }
            linked.network.set(Faults::default());
            let gone =
                lock(&linked.pushes).iter().find(|push| push.0 > cut_s && push.1 == DVec3::ZERO).copied();
            let took_ms = (gone.expect("it goes").0 - cut_s) * 1e3;
            // The limit of 50 ms, 20 ms of ramp, and a tick at either end.
            assert!((50.0..=72.0 + TIME_ROUND_OFF_MS).contains(&took_ms), "gone after {took_ms} ms");
            let safety = linked.update.counts().safety;
            assert_eq!((safety.trips, safety.stale, safety.slow_replies), (cut, 0, 0), "{safety:?}");
            assert!(safety.old_motions >= 35 * cut, "{safety:?}");
        }
    });
}

#[test]
fn a_round_trip_of_600_ms_gives_no_force_unless_it_is_allowed() {
    let allowed = SafetyLimits { motion_age_s: 0.7, round_trip_s: 0.7, ..SafetyLimits::default() };
    for (limits, is_felt) in [(SafetyLimits::default(), false), (allowed, true)] {
        in_simulated_time(async {
            let mut linked = Linked::new(limits);
            linked.until_whole("the link comes").await;
            linked.network.set(Faults { slow_ms: 298, ..Faults::default() });
            for _ in 0..2000 {
                linked.tick().await;
            }
            let safety = linked.update.counts().safety;
            let slow = safety.slow_replies > 900 && safety.old_motions > 900;
            let force = linked.tick().await;
            assert_eq!((slow, force.z > WHOLE_N), (!is_felt, is_felt), "{safety:?}, {force}");
        });
    }
}
