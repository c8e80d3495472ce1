//! Silent devices.

use super::scenes::{STEP_S, half_width, model, process};
use glam::DVec3;
use palpate::DeviceMode;
use palpate_haptics::{Effort, Motion};

#[test]
fn a_silent_device_is_suspended_and_comes_back_while_the_object_moves_on() {
    let model = model(1, 300.0);
    let edge = half_width(&model) + 0.004;
    let (mut force, mut ports) = process(&model);
    let port = &mut ports[0];
    let mut last = Effort::default();
    let (mut silent_force, mut speed_then) = (f64::NAN, f64::NAN);
    let mut back = 0.0_f64;
    for tick in 1..=900_u64 {
        let now_s = tick as f64 * STEP_S;
        let talks = !(300..600).contains(&tick);
        let x = force.state().output().objects[0].pose.position.x;
        if talks {
            // The finger comes from the right of where the body is, and presses.
            let since = (tick % 600) as f64 * STEP_S;
            let position = DVec3::X * (x + edge + (0.004 - 0.06 * since).max(-0.002));
            // A number that is none is as good as silence.
            let position = if tick % 100 == 50 { position * f64::NAN } else { position };
            port.send(Motion { sequence: tick, time_s: now_s, position, ..Motion::default() });
        }
        let output = force.cycle(now_s);
        assert!(output.devices[0].force_on_hand.is_finite() && output.energy.stored().is_finite());
        last = port.newest();
        assert_eq!((last.sequence, last.time_s), (tick, now_s));
        if tick == 360 {
            assert_eq!(force.input().devices[0].mode, DeviceMode::Suspended, "60 ms later it is away");
            silent_force = last.force.length();
            speed_then = force.state().output().objects[0].twist.linear.x;
        }
        if tick == 599 {
            let speed = force.state().output().objects[0].twist.linear.x;
            assert!(speed < 0.0 && (speed - speed_then).abs() < 1e-9, "it flies on: {speed} {speed_then}");
        }
        if tick > 600 {
            back = back.max(last.force.length());
        }
    }
    assert_eq!(silent_force, 0.0);
    assert!(back > 0.05, "it is felt again: {back} N");
    assert!(last.absorbed_j.is_finite() && last.absorbed_j > 0.0);
}

#[test]
fn a_press_is_felt_again_after_a_stall() {
    let model = model(1, 300.0);
    let (mut force, mut ports) = process(&model);
    let mut forces = [0.0; 2];
    for tick in 1..=1200_u64 {
        let now_s = tick as f64 * STEP_S;
        // The hand stays 2 mm inside the body, which moves on under the press; its thread stalls for 0.2 s.
        let x = force.state().output().objects[0].pose.position.x;
        if !(600..800).contains(&tick) {
            let depth = (0.004 - 2e-5 * tick as f64).max(-0.002);
            let position = DVec3::X * (x + half_width(&model) + 0.004 + depth);
            ports[0].send(Motion { sequence: tick, time_s: now_s, position, ..Motion::default() });
        }
        force.cycle(now_s);
        let felt = ports[0].newest().force.length();
        match tick {
            600 => forces[0] = felt,
            700 => assert_eq!(felt, 0.0, "nothing while it is silent"),
            1200 => forces[1] = felt,
            _ => {}
        }
    }
    assert!(forces[0] > 0.03 && forces[1] > 0.5 * forces[0], "{forces:?} N");
}
