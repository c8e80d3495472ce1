//! Simulated devices in simulated hands, in simulated time: what comes out of a port has gone in before.

use super::scenes::{STEP_S, half_width, model, path, process};
use palpate_haptics::device::{DeviceSpec, Hand, Mount, SimulatedDevice};
use palpate_haptics::{HapticUpdate, PassivityController, Safety, SafetyLimits, UpdateCounts};

/// Two fingertips that pinch a body, on ports of the given coupling [N/m], for 6 s. Gives what happened to them, and the most
/// energy [J] that has come out of their ports, and that with what the scene holds beyond what went in.
fn pinch(stiffness: f64, controlled: bool) -> (Vec<UpdateCounts>, f64, f64) {
    let model = model(2, stiffness);
    let edge = half_width(&model) + 0.004;
    let (mut force, ports) = process(&model);
    let traits = DeviceSpec { friction_n: 0.0, damping_n_s_m: 0.0, ..DeviceSpec::TOUCH };
    let limits = SafetyLimits { ramp_up_s: 0.01, slew_n_s: 1e9, speed_m_s: 100.0, ..SafetyLimits::default() };
    let mut updates: Vec<HapticUpdate> = ports
        .into_iter()
        .zip([1.0, -1.0])
        .map(|(port, side)| {
            let wanted = path(&format!("0,{},0,0\n0.3,{},0,0\n", side * 1.1 * edge, side * 0.95 * edge));
            let device = SimulatedDevice::new(traits, Hand::FINGERTIP, wanted);
            let passivity = PassivityController::new(traits.mass_kg, traits.resolution_m, STEP_S);
            let safety = Safety::new(limits);
            HapticUpdate::new(
                Box::new(device),
                port,
                Mount::default(),
                safety,
                controlled.then_some(passivity),
                false,
            )
        })
        .collect();
    let (mut out, mut most) = (0.0_f64, 0.0_f64);
    for tick in 1..=6000_u64 {
        let now_s = tick as f64 * STEP_S;
        updates.iter_mut().for_each(|update| update.cycle(now_s));
        force.cycle(now_s);
        let given: f64 = updates.iter().map(|update| update.counts().work_on_hand_j).sum();
        out = out.max(given);
        // What comes out of the ports beyond what the scene has lost is energy from nowhere.
        most = most.max(given + force.state().output().energy.stored());
    }
    (updates.iter().map(HapticUpdate::counts).collect(), out, most)
}

/// Half a step of the encoder at the force [N] with which these fingertips lean at most, for two: energy [J] that is not seen.
const HIDDEN_J: f64 = 55e-6 * 0.2;

#[test]
fn ports_that_are_controlled_give_no_energy_out_and_a_soft_one_is_left_alone() {
    for stiffness in [50.0, 200.0, 2000.0, 5000.0, 20_000.0] {
        let (free_counts, free_out, free) = pinch(stiffness, false);
        let (counts, out, beyond) = pinch(stiffness, true);
        assert!(out <= HIDDEN_J, "{stiffness} N/m: {out} J come out");
        assert!(beyond <= free * 1.001, "{stiffness} N/m: {beyond} J, {free} J without");
        if stiffness < 100.0 {
            assert!(free < 1e-5, "a soft one is passive by its damper: {free} J");
            assert!((counts[0].force_max_n - free_counts[0].force_max_n).abs() < 1e-3);
        }
        if stiffness > 1000.0 {
            // Without, they swing as far as the safety lets them.
            assert!(free_out > 5e-3 && beyond < 0.03 * free, "{stiffness} N/m: {free_out} J, {beyond} J");
        }
    }
}
