//! The closed loop of a body, a coupling, a device and a hand, in simulated time: three materials, four rates, four delays.
//!
//! Where it begins to swing is found in three ways: by the bound that `palpate inspect --device` gives (the Nyquist criterion, see
//! `palpate_haptics::stability`), by the largest eigenvalue of the loop's state matrix, and by the force process and the haptic update
//! themselves with a simulated device in the worst of hands. Beyond that bound it is let swing, with and without the controller; what
//! comes out and what goes on is counted with the true motion of the device, not with its encoder's.

use super::scene::{Stuff, at};
use super::{Check, scene};
use crate::Failure;
use faer::Mat;
use glam::DVec3;
use palpate::{
    Coupling, DeviceMode, DeviceParameters, Grasp, OscillatorState, Recording, SampledOscillator,
    SurfacePoint,
};
use palpate_fem::element::Order;
use palpate_fem::mesh::box_mesh;
use palpate_haptics::device::{Device, Hand, Mount, Reading, Simulated, Traits};
use palpate_haptics::stability::{ClosedLoop, LoopTiming, PlaceResponse, SLOWEST_S};
use palpate_haptics::{
    Columns, DevicePort, Effort, ForcePort, ForceProcess, HapticUpdate, Motion, MotionPath,
    PassivityController, Safety, SafetyLimits, port,
};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::{Arc, Mutex};

/// E [Pa], ν, ρ [kg/m³]: as soft as fat, as muscle, as rubber.
const MATERIALS: [f64; 3] = [2e3, 5e4, 1e6];
const RATES_HZ: [f64; 4] = [500.0, 1000.0, 2000.0, 4000.0];
const DELAYS_S: [f64; 4] = [0.0, 0.005, 0.02, 0.05];

const SIZE: [f64; 3] = [0.1, 0.05, 0.1];

/// The lowest modes lose about this share of the critical damping.
const DAMPED: f64 = 0.05;

/// The worst of hands: a spring, and the device's own damping.
const HAND: Hand = Hand::FINGERTIP;

/// Damping of the coupling, as a share of the mass over the age of what a force answers: the stiffest is stable near it.
const DAMPING: f64 = 0.2;

/// Stiffer [N/m] is no coupling.
const STIFFEST: f64 = 1e5;

/// The simulated onset is bracketed to this share; a swing that hardly grows takes longer to be seen than the run.
const BRACKET: f64 = 0.04;
const ONSET: f64 = 0.1;

/// Sums of squared movements [m²] below this are round-off of a hand at rest.
const ROUND_OFF: f64 = 1e-18;

/// How far a fingertip wants to be inside [m], and the energy [J] that half a step of its encoder hides at the force with which it
/// leans at most: ½·Δx·k·depth, 5.5 µJ.
const DEPTH: f64 = 0.01;
const HIDDEN_J: f64 = 0.5 * Traits::TOUCH.resolution_m * HAND.stiffness_n_m * DEPTH;

/// How far beyond the bound the ports are with which the controller is tried.
const BEYOND: f64 = 3.0;

/// |A^N| stands for the largest eigenvalue to 1e-8 with N = 2³⁰.
const SQUARINGS: i32 = 30;

/// One cell of the study.
#[derive(Clone)]
struct Cell {
    young: f64,
    body: Arc<Recording>,
    point: SurfacePoint,
    rate_hz: f64,
    delay_s: f64,
}

fn standing(young: f64) -> Result<Arc<Recording>, Failure> {
    let speed = (young / 3.0 / 1000.0_f64).sqrt();
    let omega = 0.5 * std::f64::consts::PI * speed / SIZE[1];
    let stuff = Stuff { young, poisson: 0.45, density: 1000.0, beta: 2.0 * DAMPED / omega };
    stuff.standing(box_mesh(SIZE, [4, 2, 4])?, Order::Quadratic, 40, |node| node.y < -0.499 * SIZE[1])
}

impl Cell {
    fn timing(&self) -> LoopTiming {
        LoopTiming::new(1.0 / self.rate_hz, self.delay_s)
    }

    fn damping(&self) -> f64 {
        DAMPING * Traits::TOUCH.mass_kg / self.timing().age_s()
    }

    /// The place along the axes, which do not mix in the middle of the face.
    fn places(&self) -> [PlaceResponse; 3] {
        DVec3::AXES.map(|axis| PlaceResponse::new(&self.body, &self.point, 0.0, axis))
    }

    fn loops(&self) -> [ClosedLoop; 3] {
        self.places().map(|place| ClosedLoop::new(&place, Traits::TOUCH, Some(HAND), self.timing()))
    }

    /// The stiffness [N/m] up to which all axes are stable; none where the stiffest coupling is.
    fn bound(&self) -> Option<f64> {
        let damping = self.damping();
        let most = |closed: &ClosedLoop| {
            closed.stable_stiffness(damping, STIFFEST).first().map_or(0.0, |[_, most]| *most)
        };
        let least = self.loops().iter().map(most).fold(STIFFEST, f64::min);
        (least < STIFFEST).then_some(least)
    }

    fn name(&self) -> String {
        let Self { young, rate_hz, delay_s, .. } = self;
        format!("{:.0} kPa, {rate_hz:.0} Hz, {:.0} ms", 1e-3 * young, 1e3 * delay_s)
    }
}

/// Motions and efforts that take a while, in whole updates.
struct Line {
    device: ForcePort,
    scene: DevicePort,
    there: u64,
    back: u64,
    motions: VecDeque<(u64, Motion)>,
    efforts: VecDeque<(u64, Effort)>,
}

impl Line {
    fn carry(&mut self, tick: u64, now_s: f64) {
        self.motions.push_back((tick + self.there, self.device.newest()));
        while self.motions.front().is_some_and(|(due, _)| *due <= tick) {
            let Some((_, motion)) = self.motions.pop_front() else { break };
            if motion.sequence > 0 {
                self.scene.tell(Motion { time_s: now_s, ..motion });
            }
        }
    }

    fn carry_back(&mut self, tick: u64, now_s: f64) {
        self.efforts.push_back((tick + self.back, self.scene.newest()));
        while self.efforts.front().is_some_and(|(due, _)| *due <= tick) {
            let Some((_, effort)) = self.efforts.pop_front() else { break };
            if effort.sequence > 0 {
                self.device.answer(Effort { time_s: now_s, ..effort });
            }
        }
    }
}

/// A simulated device whose true place [m] and work on the hand [J] can be seen.
struct Seen {
    device: Simulated,
    truth: Arc<Mutex<(DVec3, f64)>>,
}

impl Device for Seen {
    fn traits(&self) -> Traits {
        self.device.traits()
    }

    fn read(&mut self, now_s: f64) -> Result<Reading, palpate_haptics::Error> {
        let reading = self.device.read(now_s);
        if let Ok(mut truth) = self.truth.lock() {
            *truth = (self.device.position(), self.device.given_j());
        }
        reading
    }

    fn push(&mut self, force: DVec3, now_s: f64) -> Result<(), palpate_haptics::Error> {
        self.device.push(force, now_s)
    }
}

/// What came of a run.
struct Ran {
    /// Most energy [J] that the hand had got beyond what it gave.
    out: f64,
    /// Movements of the handle in an update, squared, summed over the fifth and the last eighth of the run [m²].
    early: f64,
    late: f64,
    /// Mean kinetic energy [J] in the last eighth.
    kinetic: f64,
}

/// How a run goes.
struct Way {
    coupling: Coupling,
    traits: Traits,
    mode: DeviceMode,
    path: String,
    limits: SafetyLimits,
    controlled: bool,
    seconds: f64,
}

/// Device, line and scene in turns.
fn run(cell: &Cell, way: &Way) -> Result<Ran, Failure> {
    let step_s = 1.0 / cell.rate_hz;
    let finger =
        DeviceParameters { tip_radius: 0.004, coupling: Some(way.coupling), ..DeviceParameters::default() };
    let objects = vec![at(&cell.body, DVec3::ZERO, DVec3::ZERO)];
    let model = Arc::new(scene::scene(step_s, DVec3::ZERO, Vec::new(), vec![finger], objects)?);
    let ((device_port, from_device), (to_scene, scene_port)) = (port(), port());
    let delay = u64::from(cell.timing().delay_updates - 1);
    let mut line = Line {
        device: from_device,
        scene: to_scene,
        there: delay / 2,
        back: delay - delay / 2,
        motions: VecDeque::new(),
        efforts: VecDeque::new(),
    };
    let mut process = ForceProcess::new(model, vec![(scene_port, way.mode)], Vec::new(), 1.0);
    let path = MotionPath::parse(&way.path, Columns::Position).map_err(|e| Failure(e.to_string()))?;
    let truth = Arc::new(Mutex::new((DVec3::ZERO, 0.0)));
    let device = Seen { device: Simulated::new(way.traits, HAND, path), truth: truth.clone() };
    let controller = PassivityController::new(way.traits.mass_kg, way.traits.resolution_m, step_s);
    let controller = way.controlled.then_some(controller);
    let safety = Safety::new(way.limits);
    let mut update =
        HapticUpdate::new(Box::new(device), device_port, Mount::default(), safety, controller, false);
    let (mut ran, mut last) = (Ran { out: 0.0, early: 0.0, late: 0.0, kinetic: 0.0 }, None);
    let ticks = (way.seconds / step_s) as u64;
    for tick in 1..=ticks {
        let now_s = tick as f64 * step_s;
        update.cycle(now_s);
        line.carry(tick, now_s);
        process.cycle(now_s);
        line.carry_back(tick, now_s);
        let (place, given) = truth.lock().map_or((DVec3::NAN, f64::NAN), |truth| *truth);
        ran.out = if given.is_nan() { given } else { ran.out.max(given) };
        let moved: DVec3 = place - last.replace(place).unwrap_or(place);
        match 8 * tick / ticks {
            4 => ran.early += moved.length_squared(),
            7 => ran.late += moved.length_squared(),
            _ => {}
        }
    }
    // ½·m·Σ(Δx/h)² over so many updates.
    let mass = way.traits.mass_kg + HAND.mass_kg;
    ran.kinetic = 0.5 * mass * ran.late / (step_s * step_s * (ticks as f64 / 8.0));
    Ok(ran)
}

/// No limits: what is looked for is the linear loop.
const FREE: SafetyLimits = SafetyLimits {
    force_n: f64::MAX,
    slew_n_s: f64::MAX,
    speed_m_s: f64::MAX,
    stale_s: 1.0,
    ramp_up_s: 0.0,
    ramp_down_s: 0.02,
    calm_s: 0.0,
};

/// Whether a hand that holds the place and moves a little swings more and more.
fn swings(cell: &Cell, stiffness: f64) -> Result<bool, Failure> {
    let place = cell.body.surface.rest_position(&cell.point);
    let row = |t: f64, by: DVec3| {
        let p = place + by * 1e-4;
        format!("{t},{},{},{}\n", p.x, p.y, p.z)
    };
    let path = row(0.0, DVec3::ZERO) + &row(0.02, DVec3::ZERO) + &row(0.03, DVec3::new(1.0, 0.8, 0.6));
    let traits = Traits { friction_n: 0.0, resolution_m: 0.0, force_n: f64::INFINITY, ..Traits::TOUCH };
    let way = Way {
        coupling: Coupling { stiffness, damping: cell.damping() },
        traits,
        mode: DeviceMode::Held(Grasp { object: 0, point: cell.point }),
        path,
        limits: FREE,
        controlled: false,
        seconds: 8.0 + 100.0 * cell.timing().age_s(),
    };
    let Ran { early, late, .. } = run(cell, &way)?;
    Ok((late > early && late > ROUND_OFF) || !late.is_finite())
}

/// Where it begins to swing [N/m].
fn onset(cell: &Cell, bound: f64) -> Result<f64, Failure> {
    let (mut low, mut high) = (bound / 1.15, bound * 1.15);
    while high / low > 1.0 + BRACKET {
        let middle = (low * high).sqrt();
        *(if swings(cell, middle)? { &mut high } else { &mut low }) = middle;
    }
    Ok((low * high).sqrt())
}

/// The largest eigenvalue of the loop along an axis: modes, stretch, forces under way, device.
fn spectral_radius(cell: &Cell, place: &PlaceResponse, coupling: Coupling) -> Result<f64, Failure> {
    let LoopTiming { step_s: h, delay_updates } = cell.timing();
    let swings: Vec<(SampledOscillator, f64)> = place
        .swings()
        .map(|[omega, zeta, gain]| (SampledOscillator::new(omega, zeta, h), gain.sqrt()))
        .collect();
    let mass = Traits::TOUCH.mass_kg + HAND.mass_kg;
    let omega = (HAND.stiffness_n_m / mass).sqrt();
    let zeta = 0.5 * (HAND.damping_n_s_m + Traits::TOUCH.damping_n_s_m) / (mass * omega);
    let device = SampledOscillator::new(omega, zeta, h);
    let (rate, within) = (coupling.damping / h, place.within_step(h));
    let sum = coupling.stiffness + rate;
    let (m, d) = (swings.len(), delay_updates as usize);
    let n = 2 * m + 1 + d + 2;
    let next = |state: &[f64]| -> Vec<f64> {
        let mode = |at: usize| OscillatorState { q: state[2 * at], v: state[2 * at + 1] };
        let free: f64 =
            swings.iter().enumerate().map(|(at, (map, phi))| phi * map.advance(mode(at), 0.0).q).sum();
        let (stretch, line) = (state[2 * m], &state[2 * m + 1..2 * m + 1 + d]);
        let hand = OscillatorState { q: state[n - 2], v: state[n - 1] };
        let force = (hand.q - free - rate / sum * stretch) / (within + 1.0 / sum);
        let mut next = Vec::with_capacity(n);
        for (at, (map, phi)) in swings.iter().enumerate() {
            let moved = map.advance(mode(at), phi * force);
            next.extend([moved.q, moved.v]);
        }
        next.push((force + rate * stretch) / sum);
        // The force of now comes in, the oldest is held.
        next.push(force);
        next.extend(&line[..d - 1]);
        let moved = device.advance(hand, -line[d - 1] / mass);
        next.extend([moved.q, moved.v]);
        next
    };
    let mut matrix = Mat::<f64>::zeros(n, n);
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        next(&unit).into_iter().enumerate().for_each(|(row, value)| matrix[(row, column)] = value);
    }
    // Gelfand's formula, |A^N|^(1/N), by squaring: the delays' nilpotent part keeps QR steps from converging.
    let mut logarithm = 0.0;
    for _ in 0..SQUARINGS {
        let size = matrix.norm_max();
        let scaled = matrix.map(|value| value / size);
        logarithm = 2.0 * (logarithm + size.ln());
        matrix = &scaled * &scaled;
    }
    Ok(((logarithm + matrix.norm_max().ln()) / 2_f64.powi(SQUARINGS)).exp())
}

/// How many couplings around the bound the eigenvalues judge differently, over all axes.
fn disagreements(cell: &Cell) -> Result<u32, Failure> {
    let mut differ = 0;
    for (place, closed) in cell.places().iter().zip(cell.loops()) {
        let Some(most) = closed.stable_stiffness(cell.damping(), STIFFEST).first().map(|range| range[1])
        else {
            differ += 1;
            continue;
        };
        for share in [0.5, 0.999, 1.001, 2.0] {
            let coupling = Coupling { stiffness: share * most, damping: cell.damping() };
            let stable = spectral_radius(cell, place, coupling)? < 1.0 + cell.timing().step_s / SLOWEST_S;
            differ += u32::from(stable != closed.is_stable(coupling));
        }
    }
    Ok(differ)
}

/// A fingertip that leans on the face, as devices are: with their encoder, amplifier and safety, and with a damping of their own
/// [N·s/m], but without friction.
fn leans(cell: &Cell, stiffness: f64, own: f64, controlled: bool) -> Result<Ran, Failure> {
    let top = cell.body.surface.rest_position(&cell.point).y + 0.004;
    let path = format!("0,0,{},0\n0.3,0,{},0\n", top + 0.005, top - DEPTH);
    let way = Way {
        coupling: Coupling { stiffness, damping: cell.damping() },
        traits: Traits { friction_n: 0.0, damping_n_s_m: own, ..Traits::TOUCH },
        mode: DeviceMode::Touch,
        path,
        limits: SafetyLimits { ramp_up_s: 0.01, ..SafetyLimits::default() },
        controlled,
        seconds: 4.0,
    };
    run(cell, &way)
}

/// What a cell of the study gives.
struct Found {
    bound: Option<f64>,
    onset: Option<f64>,
    differ: u32,
    /// Far beyond the bound without the controller, and with it: as the device is, and without losses of its own.
    free: Ran,
    controlled: [Ran; 2],
}

fn look(cell: &Cell) -> Result<Found, Failure> {
    let bound = cell.bound();
    let onset = bound.map(|bound| onset(cell, bound)).transpose()?;
    let differ = disagreements(cell)?;
    let stiffness = bound.map_or(STIFFEST, |bound| BEYOND * bound);
    let own = Traits::TOUCH.damping_n_s_m;
    let free = leans(cell, stiffness, own, false)?;
    let controlled = [leans(cell, stiffness, own, true)?, leans(cell, stiffness, 0.0, true)?];
    Ok(Found { bound, onset, differ, free, controlled })
}

/// Three materials, four rates, four delays.
pub fn study() -> Result<Vec<Check>, Failure> {
    let mut cells = Vec::new();
    for young in MATERIALS {
        let body = standing(young)?;
        let Some((point, _)) = body.surface.nearest(DVec3::new(0.0, 0.5 * SIZE[1], 0.0)) else {
            return Err(Failure("the block has no surface".into()));
        };
        for (rate_hz, delay_s) in RATES_HZ.into_iter().flat_map(|rate| DELAYS_S.map(|delay| (rate, delay))) {
            cells.push(Cell { young, body: body.clone(), point, rate_hz, delay_s });
        }
    }
    let looked: Result<Vec<Found>, Failure> = cells.par_iter().map(look).collect();
    let mut checks = Vec::new();
    for (cell, found) in cells.iter().zip(looked?) {
        let name = cell.name();
        if let (Some(bound), Some(onset)) = (found.bound, found.onset) {
            checks.push(Check::new(
                format!("{name}: swings from [N/m], against the bound"),
                onset,
                bound,
                ONSET,
            ));
        }
        checks.push(Check::new(
            format!("{name}: couplings that eigenvalues judge otherwise"),
            f64::from(found.differ),
            0.0,
            0.0,
        ));
        let Found { free, controlled, .. } = &found;
        for (losses, with) in ["", ", no losses"].into_iter().zip(controlled) {
            let without = format!("{:.2e} without the controller", free.out);
            let out = format!("{name}{losses}: energy out [J] ({without})");
            checks.push(Check::new(out, with.out, 0.0, HIDDEN_J));
            let without = format!("{:.2e} without the controller", free.kinetic);
            let moves = format!("{name}{losses}: kinetic energy at rest [J] ({without})");
            checks.push(Check::new(moves, with.kinetic, 0.0, HIDDEN_J));
        }
    }
    Ok(checks)
}
