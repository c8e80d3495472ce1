//! Links between processes over QUIC and sockets of the system. Loss, delay and cuts are tested in simulated time, in
//! `link/simulated.rs`.

use glam::DVec3;
use palpate_haptics::link::{LinkClient, LinkServer, LinkState, Secret};
use palpate_haptics::{DevicePort, Effort, ForcePort, Motion, port};
use palpate_testkit::wait_until;
use std::net::{SocketAddr, UdpSocket};
use std::time::Instant;

const LOCALHOST: &str = "127.0.0.1:0";

fn secret() -> Secret {
    Secret::new("only for this test").expect("long enough")
}

/// Server of a device `finger`, its address, and the force process's end of its port.
fn server(start: Instant) -> (LinkServer, SocketAddr, ForcePort) {
    let (device_port, force_port) = port();
    let ports = vec![("finger".to_string(), device_port)];
    let listen = LOCALHOST.parse().expect("an address");
    let server = LinkServer::new(listen, &secret(), ports, (start, 1e-3)).expect("it listens");
    let address = server.address().expect("an address");
    (server, address, force_port)
}

/// Sends motions until ten have arrived.
fn pass_motions(device: &mut DevicePort, force: &mut ForcePort) {
    let mut sequence = 0;
    wait_until("ten motions", || {
        sequence += 1;
        device.send(Motion { sequence, ..Motion::default() });
        force.newest().sequence >= 10
    });
}

#[test]
fn motions_and_efforts_pass_between_sockets() {
    let start = Instant::now();
    let (server, address, mut force_port) = server(start);
    let (mut device_port, client) = LinkClient::new(address, &secret(), "finger", start).expect("a socket");
    pass_motions(&mut device_port, &mut force_port);
    assert_eq!(client.state(), LinkState::Connected);
    let mut sequence = 0;
    wait_until("ten efforts", || {
        sequence += 1;
        force_port.send(Effort { sequence, force: DVec3::Z, ..Effort::default() });
        device_port.newest().sequence >= 10
    });
    assert_eq!(device_port.newest().force, DVec3::Z);
    let counts = server.counts();
    assert!(counts.connected == 1 && counts.motions > 0 && counts.garbage == 0, "{counts:?}");
}

/// State of a client that has connected or was refused.
fn settled(client: &LinkClient) -> LinkState {
    wait_until("an answer", || !matches!(client.state(), LinkState::Connecting(_)));
    client.state()
}

#[test]
fn clients_with_another_secret_are_refused_and_garbage_is_dropped() {
    let start = Instant::now();
    let secret = secret();
    let (server, address, mut force_port) = server(start);
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
    assert_eq!(settled(&second), LinkState::Taken("the device \"finger\" is taken".to_string()));
    drop(second);

    // Whatever is thrown at the socket, what is linked goes on.
    let stranger = UdpSocket::bind(LOCALHOST).expect("a socket");
    for length in 0..1500_usize {
        let bytes: Vec<u8> = (0..length).map(|at| (at * 31 + length * 17) as u8).collect();
        drop(stranger.send_to(&bytes, address));
    }
    pass_motions(&mut first_port, &mut force_port);
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
