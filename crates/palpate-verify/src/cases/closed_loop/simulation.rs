//! The loop in simulated time: a simulated device and hand, a line with delay, the force process, in turns.

use super::{Cell, DEPTH, HAND};
use crate::error::{VerifyError, numerics};
use glam::DVec3;
use palpate::{Coupling, DeviceMode, DeviceParameters, Grasp};
use palpate_haptics::device::{Device, DeviceSpec, Mount, Reading, SimulatedDevice};
use palpate_haptics::{
    Columns, DevicePort, Effort, ForcePort, ForceProcess, HapticUpdate, Motion, MotionPath,
    PassivityController, Safety, SafetyLimits, port,
};
use palpate_testkit::{object_at, scene};
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// Round-off of a hand at rest: sums of squared movements [m²] below this.
const ROUND_OFF: f64 = 1e-18;

/// Radius of the fingertip [m].
const TIP_RADIUS: f64 = 0.004;

/// A line with delays, in whole updates, between a device and a scene.
struct DelayLine {
    device: ForcePort,
    scene: DevicePort,
    motion_delay: u64,
    effort_delay: u64,
    motions: VecDeque<(u64, Motion)>,
    efforts: VecDeque<(u64, Effort)>,
}

impl DelayLine {
    fn carry_motions(&mut self, tick: u64, now_s: f64) {
        self.motions.push_back((tick + self.motion_delay, self.device.newest()));
        while self.motions.front().is_some_and(|(due, _)| *due <= tick) {
            let Some((_, motion)) = self.motions.pop_front() else { break };
            if motion.sequence > 0 {
                self.scene.send(Motion { time_s: now_s, ..motion });
            }
        }
    }

    fn carry_efforts(&mut self, tick: u64, now_s: f64) {
        self.efforts.push_back((tick + self.effort_delay, self.scene.newest()));
        while self.efforts.front().is_some_and(|(due, _)| *due <= tick) {
            let Some((_, effort)) = self.efforts.pop_front() else { break };
            if effort.sequence > 0 {
                self.device.send(Effort { time_s: now_s, ..effort });
            }
        }
    }
}

/// A simulated device whose true position [m] and work on the hand [J] can be read from outside.
struct ObservedDevice {
    device: SimulatedDevice,
    truth: Arc<Mutex<(DVec3, f64)>>,
}

impl Device for ObservedDevice {
    fn spec(&self) -> DeviceSpec {
        self.device.spec()
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, palpate_haptics::Error> {
        let reading = self.device.read(now_s);
        if let Ok(mut truth) = self.truth.lock() {
            *truth = (self.device.position(), self.device.work_on_hand_j());
        }
        reading
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) -> Result<(), palpate_haptics::Error> {
        self.device.set_force(force, now_s)
    }
}

/// Results of a run of the loop.
pub struct LoopRun {
    /// Largest energy [J] that the hand had received beyond what it gave.
    pub energy_out_j: f64,
    /// Σ|Δx|² of the handle over the fifth eighth of the run [m²].
    early: f64,
    /// The sum over the last eighth [m²].
    late: f64,
    /// Mean kinetic energy [J] in the last eighth.
    pub kinetic_at_end_j: f64,
}

/// Parameters of a run.
struct Setup {
    coupling: Coupling,
    traits: DeviceSpec,
    mode: DeviceMode,
    path: String,
    limits: SafetyLimits,
    controlled: bool,
    seconds: f64,
}

/// Runs device, line and scene in turns.
fn run(cell: &Cell, setup: &Setup) -> Result<LoopRun, VerifyError> {
    let step_s = 1.0 / cell.rate_hz;
    let finger = DeviceParameters {
        tip_radius: TIP_RADIUS,
        coupling: Some(setup.coupling),
        ..DeviceParameters::default()
    };
    let objects = vec![object_at(&cell.body, DVec3::ZERO, DVec3::ZERO)];
    let model = Arc::new(scene(step_s, DVec3::ZERO, Vec::new(), vec![finger], objects)?);
    let ((device_port, from_device), (to_scene, scene_port)) = (port(), port());
    let delay = u64::from(cell.timing().delay_updates - 1);
    let mut line = DelayLine {
        device: from_device,
        scene: to_scene,
        motion_delay: delay / 2,
        effort_delay: delay - delay / 2,
        motions: VecDeque::new(),
        efforts: VecDeque::new(),
    };
    let mut process = ForceProcess::new(model, vec![(scene_port, setup.mode)], Vec::new(), 1.0);
    let path = MotionPath::parse(&setup.path, Columns::Position).map_err(numerics)?;
    let truth = Arc::new(Mutex::new((DVec3::ZERO, 0.0)));
    let device =
        ObservedDevice { device: SimulatedDevice::new(setup.traits, HAND, path), truth: truth.clone() };
    let controller = PassivityController::new(setup.traits.mass_kg, setup.traits.resolution_m, step_s);
    let controller = setup.controlled.then_some(controller);
    let safety = Safety::new(setup.limits);
    let mut update =
        HapticUpdate::new(Box::new(device), device_port, Mount::default(), safety, controller, false);
    let (mut ran, mut last) =
        (LoopRun { energy_out_j: 0.0, early: 0.0, late: 0.0, kinetic_at_end_j: 0.0 }, None);
    let ticks = (setup.seconds / step_s) as u64;
    for tick in 1..=ticks {
        let now_s = tick as f64 * step_s;
        update.cycle(now_s);
        line.carry_motions(tick, now_s);
        process.cycle(now_s);
        line.carry_efforts(tick, now_s);
        let (place, given) = truth.lock().map_or((DVec3::NAN, f64::NAN), |truth| *truth);
        ran.energy_out_j = if given.is_nan() { given } else { ran.energy_out_j.max(given) };
        let moved: DVec3 = place - last.replace(place).unwrap_or(place);
        match 8 * tick / ticks {
            4 => ran.early += moved.length_squared(),
            7 => ran.late += moved.length_squared(),
            _ => {}
        }
    }
    // ½·m·Σ(Δx/h)² over so many updates.
    let mass = setup.traits.mass_kg + HAND.mass_kg;
    ran.kinetic_at_end_j = 0.5 * mass * ran.late / (step_s * step_s * (ticks as f64 / 8.0));
    Ok(ran)
}

/// No limits, so that the loop stays linear.
const UNLIMITED: SafetyLimits = SafetyLimits::NONE;

/// Whether the oscillation grows of a hand that holds the point and is displaced a little.
pub fn diverges(cell: &Cell, stiffness: f64) -> Result<bool, VerifyError> {
    let place = cell.body.surface.rest_position(&cell.point);
    let row = |t: f64, by: DVec3| {
        let p = place + by * 1e-4;
        format!("{t},{},{},{}\n", p.x, p.y, p.z)
    };
    let path = row(0.0, DVec3::ZERO) + &row(0.02, DVec3::ZERO) + &row(0.03, DVec3::new(1.0, 0.8, 0.6));
    let traits =
        DeviceSpec { friction_n: 0.0, resolution_m: 0.0, force_n: f64::INFINITY, ..DeviceSpec::TOUCH };
    let setup = Setup {
        coupling: Coupling { stiffness, damping: cell.damping() },
        traits,
        mode: DeviceMode::Held(Grasp { object: 0, point: cell.point }),
        path,
        limits: UNLIMITED,
        controlled: false,
        seconds: 8.0 + 100.0 * cell.timing().age_s(),
    };
    let LoopRun { early, late, .. } = run(cell, &setup)?;
    Ok((late > early && late > ROUND_OFF) || !late.is_finite())
}

/// A fingertip that presses on the face through a device with its encoder, amplifier, safety limits and damping [N·s/m], without
/// friction.
pub fn press_with_fingertip(
    cell: &Cell,
    stiffness: f64,
    device_damping: f64,
    controlled: bool,
) -> Result<LoopRun, VerifyError> {
    let top = cell.body.surface.rest_position(&cell.point).y + TIP_RADIUS;
    let path = format!("0,0,{},0\n0.3,0,{},0\n", top + 0.005, top - DEPTH);
    let setup = Setup {
        coupling: Coupling { stiffness, damping: cell.damping() },
        traits: DeviceSpec { friction_n: 0.0, damping_n_s_m: device_damping, ..DeviceSpec::TOUCH },
        mode: DeviceMode::Touch,
        path,
        // Delays are what the cases are about.
        limits: SafetyLimits {
            ramp_up_s: 0.01,
            motion_age_s: 1.0,
            round_trip_s: 1.0,
            ..SafetyLimits::default()
        },
        controlled,
        seconds: 4.0,
    };
    run(cell, &setup)
}
