//! Default coupling: as stiff as the object justifies and all hands allow with a margin; critical stiffness; stiffest point.

use super::closed_loop::{ClosedLoop, Margins};
use super::point_response::{PointResponse, normal_at};
use palpate::{Coupling, Recording, SurfacePoint};

/// Compliance of the coupling, as a share of R\[0\], below which a stiffer coupling would not be felt.
const MIN_COMPLIANCE: f64 = 0.1;

/// Margin: factor by which both gains, or the age of the position behind a force, may grow before the loop is unstable.
const MARGIN: f64 = 2.0;

/// Largest damping that is considered [N·s/m].
const MAX_DAMPING: f64 = 1e4;

/// Smallest stiffness that is considered, as a share of the largest.
const SOFTEST: f64 = 1e-6;

/// Bisection steps on the logarithm of the stiffness, to 1 %.
const BISECTIONS: u32 = 11;

/// Number of dampings that are tried.
const TRIED: u32 = 12;

/// Smallest damping that is tried, over stiffness × age.
const MIN_DAMPING_RATIO: f64 = 0.2;

/// Largest damping that is tried, over stiffness × age.
const MAX_DAMPING_RATIO: f64 = 50.0;

/// Largest number of points that are examined for the stiffest.
const MAX_POINTS: usize = 200;

/// Limit of a default coupling's stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StiffnessLimit {
    /// The object: a coupling above 10/R\[0\] would not be felt as stiffer.
    Object,
    /// The loop of device, hand, update rate and delay: a stiffer coupling lacks the margin.
    Loop,
}

/// Default coupling, with its limit and margins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultCoupling {
    /// Gains, to two significant digits.
    pub coupling: Coupling,
    /// Limit of the stiffness.
    pub limit: StiffnessLimit,
    /// Smallest margins over the loops.
    pub margins: Margins,
}

/// Default coupling: the stiffest that is stable in all loops (hands, directions) with twice the gains, and with twice the age of the
/// position behind a force; at most 10/R\[0\] with R\[0\] = `within_step` [m/N]. Its damping has the largest delay margin. `None` if
/// there is no such coupling.
pub fn default_coupling(loops: &[ClosedLoop], within_step: f64) -> Option<DefaultCoupling> {
    let stiffest = 1.0 / (MIN_COMPLIANCE * within_step);
    if let Some(found) = with_margin(loops, stiffest) {
        return rounded(loops, found, StiffnessLimit::Object);
    }
    let (mut stable, mut unstable) = (stiffest * SOFTEST, stiffest);
    let mut best = with_margin(loops, stable)?;
    for _ in 0..BISECTIONS {
        let middle = (stable * unstable).sqrt();
        match with_margin(loops, middle) {
            Some(found) => (stable, best) = (middle, found),
            None => unstable = middle,
        }
    }
    rounded(loops, best, StiffnessLimit::Loop)
}

/// Coupling with a stiffness [N/m] and the damping of largest delay margin; `None` if the margin is too small.
fn with_margin(loops: &[ClosedLoop], stiffness: f64) -> Option<Coupling> {
    let [low, high] = stable_damping(loops, stiffness)?;
    let age_s = loops.iter().map(|closed| closed.timing().age_s()).fold(0.0, f64::max);
    // Geometric sequence of dampings.
    let (low, high) =
        (low.max(MIN_DAMPING_RATIO * age_s * stiffness), high.min(MAX_DAMPING_RATIO * age_s * stiffness));
    let tried = (1..TRIED).map(|k| low * (high / low).powf(f64::from(k) / f64::from(TRIED)));
    let spare = |coupling: Coupling| {
        let scaled =
            |by: f64| Coupling { stiffness: by * coupling.stiffness, damping: by * coupling.damping };
        let is_stable = |by: f64| loops.iter().all(|closed| closed.is_stable(scaled(by)));
        let all = [1.0 / MARGIN, 1.0, MARGIN.sqrt(), MARGIN].into_iter().all(is_stable);
        let delay_s =
            loops.iter().map(|closed| closed.delay_margin_s(coupling)).fold(f64::INFINITY, f64::min);
        if all { delay_s / ((MARGIN - 1.0) * age_s) } else { 0.0 }
    };
    let all =
        tried.map(|damping| Coupling { stiffness, damping }).map(|coupling| (spare(coupling), coupling));
    let best = all.filter(|(spare, _)| *spare >= 1.0).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, coupling)| coupling)
}

/// Widest range of damping [N·s/m] that is stable with a stiffness [N/m] in all loops; `None` if there is none.
pub fn stable_damping(loops: &[ClosedLoop], stiffness: f64) -> Option<[f64; 2]> {
    let mut common = vec![[0.0, MAX_DAMPING]];
    for closed in loops {
        let own = closed.stable_damping(stiffness, MAX_DAMPING);
        let pairs = common.iter().flat_map(|a| own.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
        common = pairs.filter(|[low, high]| low < high).collect();
    }
    common.into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}

/// Critical stiffness [N/m], beyond which no damping is stable in all loops; `None` if it is above `max`.
pub fn critical_stiffness(loops: &[ClosedLoop], max: f64) -> Option<f64> {
    if stable_damping(loops, max).is_some() {
        return None;
    }
    let (mut stable, mut unstable) = (max * SOFTEST * SOFTEST, max);
    for _ in 0..2 * BISECTIONS {
        let middle = (stable * unstable).sqrt();
        *(if stable_damping(loops, middle).is_some() { &mut stable } else { &mut unstable }) = middle;
    }
    Some(unstable)
}

/// Stiffest point of a body: that with the smallest R\[0\] along its normal, for a step [s]. `None` if no point is movable.
pub fn stiffest_point(recording: &Recording, patch_radius: f64, step_s: f64) -> Option<SurfacePoint> {
    let surface = &recording.surface;
    let every = surface.triangles.len().div_ceil(MAX_POINTS).max(1);
    let points = (0..surface.triangles.len()).step_by(every);
    let points = points.map(|triangle| SurfacePoint { triangle: triangle as u32, weights: [1.0, 0.0, 0.0] });
    let compliance = |point: &SurfacePoint| {
        PointResponse::new(recording, point, patch_radius, normal_at(surface, point))
            .instantaneous_compliance(step_s)
    };
    // Fixed nodes have no compliance: they tell nothing about the body.
    let movable = points.filter(|point| recording.is_movable(point));
    movable
        .map(|point| (compliance(&point), point))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, point)| point)
}

/// Smallest of each margin over the loops; `None` if a loop is unstable.
fn worst_margins(loops: &[ClosedLoop], coupling: Coupling) -> Option<Margins> {
    let mut all = loops.iter().map(|closed| closed.margins(coupling));
    let first = all.next()??;
    all.try_fold(first, |least, next| {
        let next = next?;
        Some(Margins {
            gain: least.gain.min(next.gain),
            min_gain: least.min_gain.max(next.min_gain),
            phase_rad: least.phase_rad.min(next.phase_rad),
            delay_s: least.delay_s.min(next.delay_s),
        })
    })
}

/// Default coupling with gains rounded to two significant digits.
fn rounded(loops: &[ClosedLoop], found: Coupling, limit: StiffnessLimit) -> Option<DefaultCoupling> {
    let stiffness = two_digits(found.stiffness, f64::floor);
    let coupling = Coupling { stiffness, damping: two_digits(found.damping, f64::round) };
    worst_margins(loops, coupling).map(|margins| DefaultCoupling { coupling, limit, margins })
}

fn two_digits(value: f64, round: fn(f64) -> f64) -> f64 {
    let scale = 10_f64.powf(value.log10().floor() - 1.0);
    if value > 0.0 { round(value / scale) * scale } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::{DeviceSpec, Hand};
    use crate::stability::LoopTiming;
    use glam::DVec3;
    use palpate_testkit::free_block;

    /// Relative error of a border of stability [1]: it is sought in steps on a logarithmic scale.
    const BORDER: f64 = 1e-3;

    /// Relative error of a border of stiffness [1]: it is refined.
    const REFINED_BORDER: f64 = 1e-4;

    /// Share of a border that counts as zero [1].
    const NO_STIFFNESS: f64 = 1e-3;

    /// Relative error of a damping for passivity [1]: its frequencies are sampled.
    const SAMPLED: f64 = 1e-3;

    fn response() -> PointResponse {
        let recording = free_block();
        let (point, _) = recording.surface.nearest(DVec3::X).expect("a surface");
        PointResponse::new(&recording, &point, 0.0, normal_at(&recording.surface, &point))
    }

    /// Loop with a rigid wall in place of an object.
    fn wall(mass_kg: f64, damping_n_s_m: f64, step_s: f64, delay_updates: u32) -> ClosedLoop {
        let mut wall = Recording::clone(&free_block());
        wall.modes.mode_shapes.fill(0.0);
        wall.residual = palpate::ResidualCompliance::None;
        wall.metadata.mass.mass_kg = 1e15;
        wall.metadata.mass.inertia_kg_m2 = [[1e15, 0.0, 0.0], [0.0, 1e15, 0.0], [0.0, 0.0, 1e15]];
        let (point, _) = wall.surface.nearest(DVec3::X).expect("a surface");
        let response = PointResponse::new(&wall, &point, 0.0, DVec3::X);
        let spec = DeviceSpec { mass_kg, damping_n_s_m, ..DeviceSpec::TOUCH };
        ClosedLoop::new(&response, spec, None, LoopTiming { step_s, delay_updates })
    }

    #[test]
    fn a_mass_at_a_wall_without_delay_is_stable_as_jury_s_criterion_says() {
        // z³ + (α+β−2)·z² + (1+α)·z − β with α = kh²/2M, β = bh/2M: stable for α < 2β(1−β)/(1+β).
        let (mass, h) = (0.05, 1e-3);
        let closed = wall(mass, 0.0, h, 0);
        for share in [0.05, 0.3, 0.6, 0.9] {
            let damping = share * 2.0 * mass / h;
            let expected = 2.0 * share * (1.0 - share) / (1.0 + share) * 2.0 * mass / (h * h);
            let ranges = closed.stable_stiffness(damping, 1e7);
            assert_eq!(ranges.len(), 1, "{ranges:?}");
            assert!((ranges[0][1] / expected - 1.0).abs() < REFINED_BORDER, "{share}: {ranges:?} {expected}");
            assert!(ranges[0][0] < NO_STIFFNESS * expected);
            // And the damping for a stiffness: α(1+β) = 2β(1−β) has two roots.
            let stiffness = 0.5 * expected;
            let alpha = stiffness * h * h / (2.0 * mass);
            let root = ((2.0 - alpha).powi(2) - 8.0 * alpha).sqrt();
            let roots = [(2.0 - alpha - root) / 4.0, (2.0 - alpha + root) / 4.0].map(|b| b * 2.0 * mass / h);
            let found = closed.stable_damping(stiffness, 1e6);
            assert_eq!(found.len(), 1, "{found:?}");
            for (found, root) in found[0].into_iter().zip(roots) {
                assert!((found / root - 1.0).abs() < BORDER, "{share}: {found} {root}");
            }
        }
    }

    #[test]
    fn a_wall_is_passive_as_colgate_and_schenkel_say() {
        // k·h·(d + ½) − b·cos 0 at low frequencies; b + … at the frequency where the delay turns its damping round.
        for delay in [0, 1, 4] {
            let closed = wall(0.05, 0.0, 1e-3, delay);
            let spring = closed.damping_for_passivity(Coupling { stiffness: 1000.0, damping: 0.0 });
            let expected = f64::from(delay) + 0.5;
            assert!((spring / expected - 1.0).abs() < SAMPLED, "{delay}: {spring} {expected}");
            let damper = closed.damping_for_passivity(Coupling { stiffness: 1e-6, damping: 2.0 });
            assert!((damper / 2.0 - 1.0).abs() < SAMPLED, "{delay}: {damper}");
        }
        let closed = wall(0.05, 0.0, 1e-3, 0);
        let both = closed.damping_for_passivity(Coupling { stiffness: 1000.0, damping: 2.0 });
        assert!((both / 2.5 - 1.0).abs() < SAMPLED, "kh/2 + b: {both}");
    }

    /// Growth of a loop that is simulated in time: its mean square at the end over that at the middle.
    fn grows(
        response: &PointResponse,
        hand: Hand,
        timing: LoopTiming,
        coupling: Coupling,
        steps: usize,
    ) -> f64 {
        let (h, delay) = (timing.step_s, timing.delay_updates as usize);
        let rate = coupling.damping / h;
        let sum = coupling.stiffness + rate;
        // Implicit midpoint rule with small steps: the second route to the exact maps.
        const PARTS: u32 = 400;
        let dt = h / f64::from(PARTS);
        let oscillators: Vec<[f64; 3]> = response.oscillators().collect();
        let mut modes = vec![[0.0_f64, 0.0]; oscillators.len()];
        let fly = |[mut q, mut v]: [f64; 2], omega: f64, zeta: f64, p: f64| {
            for _ in 0..PARTS {
                let (c, k) = (2.0 * zeta * omega, omega * omega);
                let next = ((1.0 - 0.5 * dt * c - 0.25 * dt * dt * k) * v + dt * (p - k * q))
                    / (1.0 + 0.5 * dt * c + 0.25 * dt * dt * k);
                q += 0.5 * dt * (v + next);
                v = next;
            }
            [q, v]
        };
        let traits = DeviceSpec::TOUCH;
        let mass = traits.mass_kg + hand.mass_kg;
        let omega = (hand.stiffness_n_m / mass).sqrt();
        let zeta = 0.5 * (hand.damping_n_s_m + traits.damping_n_s_m) / (mass * omega);
        let (mut device, mut stretch) = ([1e-3_f64, 0.0], 0.0);
        let mut line = vec![0.0; delay];
        let within = response.instantaneous_compliance(h);
        let (mut first, mut second) = (0.0_f64, 0.0_f64);
        for step in 0..steps {
            let free: Vec<[f64; 2]> = modes
                .iter()
                .zip(&oscillators)
                .map(|(m, [omega, zeta, _])| fly(*m, *omega, *zeta, 0.0))
                .collect();
            let there: f64 = free.iter().zip(&oscillators).map(|(m, s)| m[0] * s[2].sqrt()).sum();
            let force = (device[0] - there - rate / sum * stretch) / (within + 1.0 / sum);
            for (mode, [omega, zeta, gain]) in modes.iter_mut().zip(&oscillators) {
                *mode = fly(*mode, *omega, *zeta, gain.sqrt() * force);
            }
            stretch = (force + rate * stretch) / sum;
            line.push(force);
            let held = line.remove(0);
            device = fly(device, omega, zeta, -held / mass);
            let part = if step < steps / 2 { steps / 4..steps / 2 } else { 3 * steps / 4..steps };
            if part.contains(&step) {
                *(if step < steps / 2 { &mut first } else { &mut second }) +=
                    device[1].powi(2) + force.powi(2);
            }
        }
        second / first
    }

    #[test]
    fn what_is_stable_settles_and_what_is_not_grows() {
        let response = response();
        let hand = Hand::FINGERTIP;
        for (step_s, link) in [(1e-3, 0.0), (2e-3, 0.0), (1e-3, 0.005)] {
            let timing = LoopTiming::new(step_s, link);
            let closed = ClosedLoop::new(&response, DeviceSpec::TOUCH, Some(hand), timing);
            let damping = 0.2;
            let ranges = closed.stable_stiffness(damping, 1e6);
            let [_, most] = *ranges.last().expect("some stiffness is stable");
            for (share, stable) in [(0.9, true), (1.1, false)] {
                let coupling = Coupling { stiffness: share * most, damping };
                assert_eq!(closed.is_stable(coupling), stable);
                let grows = grows(&response, hand, timing, coupling, 3000);
                assert_eq!(grows < 1.0, stable, "{step_s} {link} {share}: {grows}, {ranges:?}");
            }
        }
    }

    #[test]
    fn default_gains_have_their_margin_and_are_softer_the_later_the_answer() {
        let response = response();
        let mut last = f64::INFINITY;
        for link in [0.0, 0.005, 0.02, 0.05] {
            let timing = LoopTiming::new(1e-3, link);
            let hands = [None, Some(Hand::FINGERTIP), Some(Hand::LIGHT), Some(Hand::FIRM)];
            let loops = hands.map(|hand| ClosedLoop::new(&response, DeviceSpec::TOUCH, hand, timing));
            let found = default_coupling(&loops, response.instantaneous_compliance(1e-3))
                .expect("a soft one always is");
            assert!(
                found.margins.gain > 1.9 && found.margins.delay_s > 0.9 * timing.age_s(),
                "{link}: {found:?}"
            );
            assert!(
                found.coupling.stiffness <= last
                    && found.coupling.stiffness <= 10.0 / response.instantaneous_compliance(1e-3)
            );
            let twice =
                Coupling { stiffness: 1.9 * found.coupling.stiffness, damping: 1.9 * found.coupling.damping };
            assert!(loops.iter().all(|closed| closed.is_stable(twice)));
            last = found.coupling.stiffness;
        }
    }
}
