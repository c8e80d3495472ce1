//! Haply's Inverse Service: axes, its one answer per message, and a service that goes away and comes back.

#[path = "../standins/inverse_service.rs"]
mod inverse_service;

use super::standin::Hand;
use glam::{DQuat, DVec3};
use inverse_service::{Mood, Service};
use palpate_haptics::device::Driver;
use palpate_testkit::wait_until;
use serde_json::json;
use std::net::TcpListener;

/// Round-off of an angle between rotations [rad]: the root of that of their product.
const TURN_RAD: f64 = 1e-9;

fn open(service: &Service) -> Hand {
    Hand::open(Driver::Haply, "0", &service.place())
}

/// Push until the service has the force.
fn push(hand: &mut Hand, service: &Service, force: DVec3, theirs: [f64; 3]) {
    wait_until("the force arrives", || {
        hand.set_force(force).expect("it pushes");
        service.force() == theirs
    });
}

#[test]
fn connected_devices_are_listed() {
    let service = Service::new();
    let found = Driver::Haply.find(Some(&service.place())).expect("a device");
    assert_eq!(found.iter().map(ToString::to_string).collect::<Vec<_>>(), ["0: inverse3 (049D)"]);
    let device = Driver::Haply.open("049D", Some(&service.address.to_string())).expect("by its name").1;
    assert_eq!((device.spec().kind, device.spec().force_n), ("haply", 10.0));
    drop(device);
    service.set(|world| world.basis = "XZY");
    let turned = Driver::Haply.open("0", Some(&service.place())).err().expect("other axes").to_string();
    assert!(
        turned.starts_with("haply: 0: inverse3 (049D) can't be had: the service turns its axes to XZY"),
        "{turned}"
    );
    service.set(|world| world.mood = Mood::NoDevice);
    let error = Driver::Haply.find(Some(&service.place())).expect_err("none").to_string();
    assert!(error.starts_with("haply: the Inverse Service has no Inverse3"), "{error}");
}

#[test]
fn without_a_service_it_says_where_it_was_looked_for_and_what_to_do() {
    let nobody =
        TcpListener::bind("127.0.0.1:0").and_then(|socket| socket.local_addr()).expect("a free port");
    let error = Driver::Haply.find(Some(&nobody.to_string())).expect_err("nobody is there").to_string();
    assert!(error.starts_with(&format!("haply: no Inverse Service at {nobody} (")), "{error}");
    assert!(error.contains("install and start Haply's Inverse Service"), "{error}");
    assert!(error.ends_with("or give its address in the environment variable PALPATE_HAPLY"), "{error}");
    // Somebody else's server.
    let other = TcpListener::bind("127.0.0.1:0").expect("a port");
    let address = other.local_addr().expect("an address").to_string();
    let error = Driver::Haply.find(Some(&address)).expect_err("it does not answer").to_string();
    assert!(error.contains("it does not speak WebSocket"), "{error}");
}

#[test]
fn positions_forces_orientations_and_buttons_are_in_the_device_frame() {
    let service = Service::new();
    // A quarter turn about their z, which points up.
    let half = std::f64::consts::FRAC_PI_4;
    service.set(|world| {
        (world.grip, world.pressed) = ([half.cos(), 0.0, 0.0, half.sin()], true);
    });
    let mut hand = open(&service);
    let reading = hand.next();
    assert_eq!(reading.position, DVec3::new(0.01, 0.15, 0.12), "to the right, up, towards the user");
    let turned = reading.orientation.expect("it has a grip");
    assert!(turned.angle_between(DQuat::from_rotation_y(2.0 * half)) < TURN_RAD, "{turned}");
    assert_eq!(reading.buttons, 0b10);
    push(&mut hand, &service, DVec3::new(1.0, 2.0, 3.0), [1.0, -3.0, 2.0]);
    push(&mut hand, &service, DVec3::new(f64::NAN, 2.0, 3.0), [0.0; 3]);
    // Nobody pushes any more: whoever did may have died.
    push(&mut hand, &service, DVec3::X, [1.0, 0.0, 0.0]);
    wait_until("the force goes", || service.force() == [0.0; 3]);
    push(&mut hand, &service, DVec3::X, [1.0, 0.0, 0.0]);
    drop(hand);
    assert_eq!(service.force(), [0.0; 3], "it is left without force");
    let sessions = service.world.lock().expect("no panic").sessions.clone();
    assert_eq!(sessions, [json!([1, { "configure": { "profile": { "name": "palpate:device" } } }])]);
}

#[test]
fn a_device_that_is_closed_at_once_is_left_without_force_all_the_same() {
    let service = Service::new();
    for _ in 0..20 {
        service.set(|world| world.force = [1.0, 2.0, 3.0]);
        drop(open(&service));
        assert_eq!(service.force(), [0.0; 3]);
    }
}

#[test]
fn replies_without_a_reading_count_as_silence() {
    let service = Service::new();
    let mut hand = open(&service);
    hand.next();
    for mood in [Mood::Garbage, Mood::NoDevice, Mood::Nothing] {
        service.set(|world| world.mood = mood);
        let mut why = None;
        wait_until("silence", || {
            why = hand.read().err();
            why.is_some()
        });
        let why = why.expect("it was waited for");
        assert!(why.starts_with("haply: no reading for 20 ms; last failure: "), "{why}");
        service.set(|world| world.mood = Mood::States);
        wait_until("it tells again", || hand.read().is_ok());
    }
}

#[test]
fn a_service_that_goes_away_is_found_again() {
    let mut service = Service::new();
    let mut hand = open(&service);
    hand.next();
    service.stop();
    wait_until("it is gone, and said to be", || {
        hand.read().is_err_and(|why| why.contains("no Inverse Service at 127.0.0.1:"))
    });
    let again = Service::at(&service.address.to_string(), service.world.clone());
    again.set(|world| world.cursor = [0.0, 0.0, 0.1]);
    wait_until("it is found", || {
        hand.read().is_ok_and(|reading| reading.position == DVec3::new(0.0, 0.1, 0.0))
    });
    push(&mut hand, &again, DVec3::Y, [0.0, 0.0, 1.0]);
    // One that has gone for good holds up nobody who leaves.
    drop(again);
    drop(hand);
}
