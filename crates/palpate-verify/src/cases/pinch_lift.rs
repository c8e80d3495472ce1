//! Two fingers pinch the paper's cube, lift it from the floor, shake and throw it.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Collider, Coupling, DeviceInput, DeviceParameters, Input, Output, State, step};
use palpate_fem::ElementOrder;
use palpate_fem::paper_cube::{self, CELLS};
use palpate_testkit::{ElasticMaterial, GRAVITY_M_S2, PAPER_MATERIAL, floor, object_at, scene, smoothstep};
use std::f64::consts::{PI, TAU};

const TIP: f64 = 0.005;
const STEP: f64 = 1e-3;

/// As much damping as keeps the cube from ringing through the whole case.
const JELLY: ElasticMaterial = ElasticMaterial { stiffness_damping_s: 1e-3, ..PAPER_MATERIAL };

/// Times at which the fingers close, lift, shake, throw and release [s].
const CLOSE: f64 = 0.3;
const LIFT: f64 = 0.8;
const SHAKE: f64 = 2.0;
const THROW: f64 = 4.0;
const RELEASE: f64 = 4.25;
const END: f64 = 4.4;

/// A hundredth of the cube [m].
const SLIP_M: f64 = 1e-3;

/// Rounding of a hundred steps of flight [m].
const PARABOLA_M: f64 = 1e-12;

/// Squeeze of each finger [m].
const SQUEEZE: f64 = 0.015;
/// Height of the lift [m].
const HEIGHT: f64 = 0.05;

/// From 0 to 1 between two times.
fn ramp(t: f64, from: f64, to: f64) -> f64 {
    smoothstep((t - from) / (to - from))
}

/// Distance of the tips' centres from the middle, and their height [m].
fn hand(t: f64) -> [f64; 2] {
    /// Speed at which the cube is thrown [m/s].
    const SPEED: f64 = 0.6;
    let open = if t > RELEASE { 0.5 * (t - RELEASE) } else { 0.0 };
    let apart = 0.05 + TIP + 0.003 - (SQUEEZE + 0.003) * ramp(t, CLOSE, LIFT) + open;
    // 2 Hz, ±1 cm, coming and going within a quarter of a second.
    let swing = ramp(t, SHAKE, SHAKE + 0.25) * ramp(t, THROW - 0.25, THROW - 0.75);
    let shake = 0.01 * swing * (TAU * 2.0 * (t - SHAKE)).sin();
    // Faster and faster, then even.
    let run = RELEASE - 0.05 - THROW;
    let s = (t - THROW).max(0.0);
    let thrown =
        if s < run { 0.5 * SPEED * (s - run / PI * (PI * s / run).sin()) } else { SPEED * (s - 0.5 * run) };
    [apart, 0.05 + HEIGHT * ramp(t, LIFT, SHAKE - 0.4) + shake + thrown]
}

/// Slip [m] of the fingers over the step: that of the finger that slips more.
fn slip(output: &Output) -> f64 {
    let fingers = output.contacts.iter().filter(|contact| matches!(contact.against, Collider::Device(_)));
    fingers.map(|contact| contact.slip_speed * STEP).fold(0.0, f64::max)
}

/// Without and with virtual couplings.
pub fn pinch_lift() -> Result<Vec<Check>, VerifyError> {
    let cube = JELLY.free_body(paper_cube::mesh(CELLS)?, ElementOrder::Linear, 100)?;
    let mut checks = Vec::new();
    for (name, coupling) in [("rigid", None), ("coupled", Some(Coupling { stiffness: 500.0, damping: 1.0 }))]
    {
        let finger = DeviceParameters { tip_radius: TIP, patch_radius: 0.03, friction: 0.8, coupling };
        let objects = vec![object_at(&cube, DVec3::Y * 0.05, DVec3::ZERO)];
        let model = scene(STEP, DVec3::Y * -GRAVITY_M_S2, vec![floor(0.5)], vec![finger; 2], objects)?;
        let mut state = State::new(&model);
        let (mut invariants, mut slipped, mut on_floor) = (RunInvariants::default(), 0.0, 0.0_f64);
        let (mut held, mut flight, mut off) = ([DVec3::ZERO; 2], None, 0.0_f64);
        invariants.observe(state.output());
        for number in 1..=(END / STEP).round() as usize {
            let t = number as f64 * STEP;
            let [apart, height] = hand(t);
            let tips = [-1.0, 1.0].map(|side| DeviceInput::touching(DVec3::new(side * apart, height, 0.0)));
            let output = step(&model, &mut state, &Input { devices: tips.into(), ..Input::default() });
            invariants.observe(output);
            let object = &output.objects[0];
            if (SHAKE - 0.05..THROW).contains(&t) {
                slipped += slip(output);
                on_floor =
                    on_floor
                        .max(output.contacts.iter().filter(|c| c.against == Collider::Obstacle(0)).count()
                            as f64);
            }
            let above = object.pose.position - DVec3::Y * height;
            if number == ((SHAKE - 0.05) / STEP) as usize {
                held[0] = above;
            } else if number == ((THROW - 0.01) / STEP) as usize {
                held[1] = above;
            }
            // From the first step without contact on: a parabola.
            if t > RELEASE && output.contacts.is_empty() {
                let (from, place, speed) =
                    *flight.get_or_insert((t, object.pose.position, object.twist.linear));
                let s = t - from;
                let fallen = place + speed * s - DVec3::Y * (0.5 * GRAVITY_M_S2 * s * s);
                off = off.max((object.pose.position - fallen).length());
            }
        }
        let (_, _, speed) = flight.ok_or(VerifyError::NotReached("the fingers do not let go"))?;
        checks.push(Check::new(
            format!("{name}: slip of the fingers while they shake [m]"),
            slipped,
            0.0,
            SLIP_M,
        ));
        checks.push(Check::new(
            format!("{name}: place in the hand, before and after [m]"),
            (held[1] - held[0]).length(),
            0.0,
            SLIP_M,
        ));
        checks.push(Check::new(format!("{name}: contacts with the floor meanwhile"), on_floor, 0.0, 0.0));
        // It bobs in the grip, so that it leaves slower or faster than the fingers; at half their speed it still rises.
        let short = (0.3 - speed.y).max(0.0);
        checks.push(Check::new(format!("{name}: shortfall of its speed when let go [m/s]"), short, 0.0, 0.0));
        checks.push(Check::new(format!("{name}: flight against a parabola [m]"), off, 0.0, PARABOLA_M));
        checks.extend(invariants.checks(name));
    }
    Ok(checks)
}
