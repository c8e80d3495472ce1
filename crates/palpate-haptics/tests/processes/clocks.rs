//! Clocks that jump and threads that stall: every jump and every stall is counted on each hand, and no force beyond the limits passes.

use super::scenes::{STEP_S, model, path};
use glam::DVec3;
use palpate::{Coupling, DeviceMode, DeviceParameters, Model, ModelObject, ModelParameters};
use palpate_haptics::device::{Mount, PathDevice};
use palpate_haptics::{
    AttachedDevice, ForceProcess, HapticUpdate, Motion, MotionLimits, SafetyCounts, SafetyLimits, port,
};
use palpate_testkit::{finger, fixed_block, half_extent, start_at};
use std::sync::Arc;

/// Round-off of a force that is limited to a length [N].
const LIMITED_N: f64 = 1e-9;

/// Ticks from one event to the next: the force is whole again.
const APART: u64 = 900;

/// Two fingers that press a block, fixed at one end, from both sides, in simulated time.
struct Hands {
    force: ForceProcess,
    updates: Vec<HapticUpdate>,
    limits: SafetyLimits,
    tick: u64,
    /// Forces that the hands felt last [N].
    felt: [DVec3; 2],
}

impl Hands {
    fn new() -> Self {
        let recording = fixed_block();
        let edge = half_extent(&recording, 1) + 0.004;
        let coupling = Some(Coupling { stiffness: 300.0, damping: 0.2 });
        let parameters = ModelParameters {
            step_s: STEP_S,
            devices: vec![DeviceParameters { coupling, ..finger(0.004, 0.0, 0.5) }; 2],
            ..ModelParameters::for_reference()
        };
        let block = ModelObject::new(recording, start_at(DVec3::ZERO));
        let model = Arc::new(Model::new(parameters, vec![block]).expect("a good model"));
        let limits = SafetyLimits { force_n: 0.5, step_n: 0.25, ..SafetyLimits::default() };
        let (updates, slots) = [1.0, -1.0]
            .map(|side| {
                let (begin, end) = (side * (edge + 0.002), side * (edge - 0.002));
                let device = Box::new(PathDevice::new(path(&format!("0,0,{begin},0\n0.3,0,{end},0\n"))));
                let (mode, mount, rate_hz) = (DeviceMode::Touch, Mount::default(), 1.0 / STEP_S);
                let (passive, arm_by_button) = (false, false);
                let (device_port, force_port) = port();
                let attached =
                    AttachedDevice { device, mode, mount, rate_hz, limits, passive, arm_by_button };
                (attached.update(device_port), (force_port, mode))
            })
            .into_iter()
            .unzip();
        let force = ForceProcess::new(model, slots, Vec::new(), 0.1);
        Self { force, updates, limits, tick: 0, felt: [DVec3::ZERO; 2] }
    }

    /// A tick by the clocks of the force process and of each hand [s]; `None` is a process that stalls.
    fn tick(&mut self, force_s: Option<f64>, hands_s: [Option<f64>; 2]) {
        self.tick += 1;
        for ((update, now_s), felt) in self.updates.iter_mut().zip(hands_s).zip(&mut self.felt) {
            let Some(now_s) = now_s else { continue };
            update.cycle(now_s);
            let given = update.held_force();
            assert!(given.is_finite() && given.length() <= self.limits.force_n + LIMITED_N, "{given}");
            let change = (given - *felt).length();
            assert!(change <= self.limits.step_n + LIMITED_N || given == DVec3::ZERO, "{felt} {given}");
            *felt = given;
        }
        if let Some(now_s) = force_s {
            let output = self.force.cycle(now_s);
            assert!(output.energy.stored().is_finite() && output.status.unsolved_islands == 0);
        }
    }

    /// Ticks until the force is whole, by clocks that are ahead of the ticks [s].
    fn run(&mut self, ticks: u64, ahead_s: [f64; 3]) {
        for _ in 0..ticks {
            let now_s = (self.tick + 1) as f64 * STEP_S;
            let [force_s, left_s, right_s] = ahead_s.map(|ahead_s| Some(now_s + ahead_s));
            self.tick(force_s, [left_s, right_s]);
        }
    }

    fn safety(&self) -> [SafetyCounts; 2] {
        [0, 1].map(|hand| self.updates[hand].counts().safety)
    }

    fn is_felt(&self) -> bool {
        self.felt.iter().all(|felt| felt.length() > 0.02)
    }
}

#[test]
fn six_stalls_of_half_a_second_are_six_trips_on_each_hand() {
    /// Ticks of a stall.
    const STALL: u64 = 500;
    // All threads, as when the process is stopped; each hand alone; the force process alone.
    for stalls in [[true, true, true], [false, true, false], [false, false, true], [true, false, false]] {
        let mut hands = Hands::new();
        for _ in 0..6 {
            hands.run(APART, [0.0; 3]);
            assert!(hands.is_felt(), "{:?} N", hands.felt);
            for _ in 0..STALL {
                let now_s = (hands.tick + 1) as f64 * STEP_S;
                let [force_s, left_s, right_s] = stalls.map(|stalls| (!stalls).then_some(now_s));
                hands.tick(force_s, [left_s, right_s]);
            }
            hands.run(1, [0.0; 3]);
        }
        for (hand, safety) in hands.safety().into_iter().enumerate() {
            let (own, force) = (stalls[hand + 1], stalls[0]);
            let trips = if own || force { 6 } else { 0 };
            let gaps = if own { 6 } else { 0 };
            assert_eq!((safety.trips, safety.gaps), (trips, gaps), "hand {hand}, {stalls:?}: {safety:?}");
            assert_eq!(safety.stale > 0, force, "hand {hand}, {stalls:?}: {safety:?}");
        }
    }
}

#[test]
fn clocks_that_jump_trip_each_hand_once_and_the_force_comes_back() {
    /// Tick after two hours, to which the clocks jump first.
    const LATE: u64 = 7_200_000;
    for jump_s in [-1.0, -3600.0, 3600.0] {
        let mut hands = Hands::new();
        // The path has ended before and after the jump.
        hands.run(APART, [0.0; 3]);
        hands.tick = LATE;
        hands.run(APART, [0.0; 3]);
        assert!(hands.is_felt(), "{:?} N", hands.felt);
        hands.run(APART, [jump_s; 3]);
        for safety in hands.safety() {
            assert_eq!((safety.trips, safety.gaps), (2, 2), "{jump_s} s: {safety:?}");
        }
        assert!(hands.is_felt(), "{jump_s} s: {:?} N", hands.felt);
        // One clock apart from the others gives no force for as long as it is apart.
        for apart in 0..3 {
            let mut ahead_s = [jump_s; 3];
            ahead_s[apart] = 0.0;
            hands.run(APART, ahead_s);
            let is_felt = hands.felt.map(|felt| felt != DVec3::ZERO);
            let expected = [0, 1].map(|hand| apart != 0 && apart != hand + 1);
            assert_eq!(is_felt, expected, "{jump_s} s, clock {apart}: {:?}", hands.safety());
            hands.run(APART, [jump_s; 3]);
            assert!(hands.is_felt(), "{jump_s} s, clock {apart}: {:?} N", hands.felt);
        }
    }
}

#[test]
fn millimetres_for_metres_are_refused_at_the_port_and_leave_the_object_in_peace() {
    let model = model(1, 300.0);
    let floor = model.parameters().obstacles[0].pose;
    let (mut device, linked) = port();
    let slots = vec![(linked.with_limits(MotionLimits::default()), DeviceMode::Touch)];
    let mut force = ForceProcess::new(model, slots, vec![Box::new(move |_| floor)], 0.1);
    for tick in 1..=1000_u64 {
        let now_s = tick as f64 * STEP_S;
        // A hand on its way through the body at 0.1 m/s, from 55 mm on its left.
        let position = DVec3::X * (-55.2 + 100.0 * now_s);
        device.send(Motion { sequence: tick, time_s: now_s, position, ..Motion::default() });
        let output = force.cycle(now_s);
        assert_eq!((output.status.unsolved_islands, output.status.rejected_inputs), (0, 0));
        assert_eq!(device.newest().force, DVec3::ZERO);
    }
    let refused = force.refused_motions().next().expect("a device");
    assert_eq!(refused.count, 1000);
    let reason = refused.first.expect("a reason").to_string();
    assert_eq!(
        reason,
        "a position is 54.978 m from the scene's objects, expected within 2 m (limit range): is it in millimetres?"
    );
}
