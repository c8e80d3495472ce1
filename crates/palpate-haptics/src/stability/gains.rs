//! The coupling to begin with: as stiff as the object makes sense of, and as all hands leave a margin for.

use super::closed_loop::{ClosedLoop, Margins};
use super::place::{PlaceResponse, normal_at};
use palpate::{Coupling, Recording, SurfacePoint};

/// A coupling that takes less than this share of what the object gives within a step is not felt as softer.
const SHARE: f64 = 0.1;

/// Both gains, or the age of what a force answers, may be this many times as large before anything is unstable.
const MARGIN: f64 = 2.0;

/// Dampings [N·s/m] beyond this are no device's.
const MOST_DAMPING: f64 = 1e4;

/// Stiffnesses are looked for down to this share of the stiffest; halvings of the search, to a per cent.
const SOFTEST: f64 = 1e-6;
const HALVINGS: u32 = 11;

/// Dampings that are tried, between these times stiffness × age.
const TRIED: u32 = 12;
const LEAST: f64 = 0.2;
const MOST: f64 = 50.0;

/// Places of a surface that are looked at for the stiffest.
const MOST_PLACES: usize = 200;

/// What limits a stiffness.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Limit {
    /// Stiffer than this the coupling would not be felt as stiffer: 10/R\[0\].
    Object,
    /// Device, hand, rate and delay bear no more with the margin.
    Loop,
}

/// A coupling with what it was limited by, and the least margins over the hands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DefaultCoupling {
    /// The gains, to two digits.
    pub coupling: Coupling,
    /// Why it is not stiffer.
    pub limit: Limit,
    /// The smallest margins.
    pub margins: Margins,
}

/// The stiffest coupling that all loops (hands, directions) bear with twice the gains, and also with twice the age of what
/// a force answers; at most 10/R\[0\] with R\[0\] = `within_step` [m/N]. Of the dampings the one that leaves most delay to spare.
/// None if there is no such coupling.
pub fn default_coupling(loops: &[ClosedLoop], within_step: f64) -> Option<DefaultCoupling> {
    let stiffest = 1.0 / (SHARE * within_step);
    if let Some(found) = with_margin(loops, stiffest) {
        return rounded(loops, found, Limit::Object);
    }
    let (mut good, mut bad) = (stiffest * SOFTEST, stiffest);
    let mut best = with_margin(loops, good)?;
    for _ in 0..HALVINGS {
        let middle = (good * bad).sqrt();
        match with_margin(loops, middle) {
            Some(found) => (good, best) = (middle, found),
            None => bad = middle,
        }
    }
    rounded(loops, best, Limit::Loop)
}

/// Of a stiffness, the damping with the most margin; none if it is too little.
fn with_margin(loops: &[ClosedLoop], stiffness: f64) -> Option<Coupling> {
    let [low, high] = stable_damping(loops, stiffness)?;
    let age_s = loops.iter().map(|closed| closed.timing().age_s()).fold(0.0, f64::max);
    // Evenly by ratio, from a share of what would make up for the age.
    let (low, high) = (low.max(LEAST * age_s * stiffness), high.min(MOST * age_s * stiffness));
    let tried = (1..TRIED).map(|k| low * (high / low).powf(f64::from(k) / f64::from(TRIED)));
    let spare = |coupling: Coupling| {
        let scaled =
            |by: f64| Coupling { stiffness: by * coupling.stiffness, damping: by * coupling.damping };
        let bears = |by: f64| loops.iter().all(|closed| closed.is_stable(scaled(by)));
        let all = [1.0 / MARGIN, 1.0, MARGIN.sqrt(), MARGIN].into_iter().all(bears);
        let delay_s =
            loops.iter().map(|closed| closed.delay_margin_s(coupling)).fold(f64::INFINITY, f64::min);
        if all { delay_s / ((MARGIN - 1.0) * age_s) } else { 0.0 }
    };
    let all =
        tried.map(|damping| Coupling { stiffness, damping }).map(|coupling| (spare(coupling), coupling));
    let best = all.filter(|(spare, _)| *spare >= 1.0).max_by(|a, b| a.0.total_cmp(&b.0));
    best.map(|(_, coupling)| coupling)
}

/// The widest range of dampings [N·s/m] with which a stiffness [N/m] is stable in all loops; none if there is none.
pub fn stable_damping(loops: &[ClosedLoop], stiffness: f64) -> Option<[f64; 2]> {
    let mut common = vec![[0.0, MOST_DAMPING]];
    for closed in loops {
        let own = closed.stable_damping(stiffness, MOST_DAMPING);
        let pairs = common.iter().flat_map(|a| own.iter().map(move |b| [a[0].max(b[0]), a[1].min(b[1])]));
        common = pairs.filter(|[low, high]| low < high).collect();
    }
    common.into_iter().max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}

/// The stiffness [N/m] from which on no damping is enough in all loops; none if there is no such up to `most`.
pub fn unstable_from(loops: &[ClosedLoop], most: f64) -> Option<f64> {
    if stable_damping(loops, most).is_some() {
        return None;
    }
    let (mut good, mut bad) = (most * SOFTEST * SOFTEST, most);
    for _ in 0..2 * HALVINGS {
        let middle = (good * bad).sqrt();
        *(if stable_damping(loops, middle).is_some() { &mut good } else { &mut bad }) = middle;
    }
    Some(bad)
}

/// The stiffest place of a body: where the surface gives least along its normal within a step [s].
pub fn stiffest_place(recording: &Recording, patch_radius: f64, step_s: f64) -> Option<SurfacePoint> {
    let surface = &recording.surface;
    let every = surface.triangles.len().div_ceil(MOST_PLACES).max(1);
    let places = (0..surface.triangles.len()).step_by(every);
    let places = places.map(|triangle| SurfacePoint { triangle: triangle as u32, weights: [1.0, 0.0, 0.0] });
    let gives = |point: &SurfacePoint| {
        PlaceResponse::new(recording, point, patch_radius, normal_at(surface, point)).within_step(step_s)
    };
    // Fixed nodes don't give at all: there is nothing to feel of the body.
    let movable = places.filter(|point| recording.is_movable(point));
    movable.map(|point| (gives(&point), point)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, point)| point)
}

/// The least of each margin over the loops; none if one is not stable.
fn worst_margins(loops: &[ClosedLoop], coupling: Coupling) -> Option<Margins> {
    let mut all = loops.iter().map(|closed| closed.margins(coupling));
    let first = all.next()??;
    all.try_fold(first, |least, next| {
        let next = next?;
        Some(Margins {
            gain: least.gain.min(next.gain),
            least_gain: least.least_gain.max(next.least_gain),
            phase_rad: least.phase_rad.min(next.phase_rad),
            delay_s: least.delay_s.min(next.delay_s),
        })
    })
}

/// Two digits are enough for gains.
fn rounded(loops: &[ClosedLoop], found: Coupling, limit: Limit) -> Option<DefaultCoupling> {
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
    use crate::device::{Hand, Traits};
    use crate::stability::LoopTiming;
    use glam::DVec3;

    fn recording() -> Recording {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        Recording::from_bytes(bytes).expect("a released recording")
    }

    fn place() -> PlaceResponse {
        let recording = recording();
        let (point, _) = recording.surface.nearest(DVec3::X).expect("a surface");
        PlaceResponse::new(&recording, &point, 0.0, normal_at(&recording.surface, &point))
    }

    /// No body that gives: the place on a wall.
    fn wall(mass_kg: f64, damping_n_s_m: f64, step_s: f64, delay_updates: u32) -> ClosedLoop {
        let mut wall = recording();
        wall.modes.mode_shapes.fill(0.0);
        wall.residual = palpate::ResidualCompliance::None;
        wall.metadata.mass.mass_kg = 1e15;
        wall.metadata.mass.inertia_kg_m2 = [[1e15, 0.0, 0.0], [0.0, 1e15, 0.0], [0.0, 0.0, 1e15]];
        let (point, _) = wall.surface.nearest(DVec3::X).expect("a surface");
        let place = PlaceResponse::new(&wall, &point, 0.0, DVec3::X);
        let traits = Traits { mass_kg, damping_n_s_m, ..Traits::TOUCH };
        ClosedLoop::new(&place, traits, None, LoopTiming { step_s, delay_updates })
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
            assert!((ranges[0][1] / expected - 1.0).abs() < 1e-4, "{share}: {ranges:?} {expected}");
            assert!(ranges[0][0] < 1e-3 * expected);
            // And the damping for a stiffness: α(1+β) = 2β(1−β) has two roots.
            let stiffness = 0.5 * expected;
            let alpha = stiffness * h * h / (2.0 * mass);
            let root = ((2.0 - alpha).powi(2) - 8.0 * alpha).sqrt();
            let roots = [(2.0 - alpha - root) / 4.0, (2.0 - alpha + root) / 4.0].map(|b| b * 2.0 * mass / h);
            let found = closed.stable_damping(stiffness, 1e6);
            assert_eq!(found.len(), 1, "{found:?}");
            for (found, root) in found[0].into_iter().zip(roots) {
                assert!((found / root - 1.0).abs() < 1e-3, "{share}: {found} {root}");
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
            assert!((spring / expected - 1.0).abs() < 1e-3, "{delay}: {spring} {expected}");
            let damper = closed.damping_for_passivity(Coupling { stiffness: 1e-6, damping: 2.0 });
            assert!((damper / 2.0 - 1.0).abs() < 1e-3, "{delay}: {damper}");
        }
        let closed = wall(0.05, 0.0, 1e-3, 0);
        let both = closed.damping_for_passivity(Coupling { stiffness: 1000.0, damping: 2.0 });
        assert!((both / 2.5 - 1.0).abs() < 1e-3, "kh/2 + b: {both}");
    }

    /// A loop in time, one mass after the other: how much its size grows over the last half of so many steps.
    fn grows(place: &PlaceResponse, hand: Hand, timing: LoopTiming, coupling: Coupling, steps: usize) -> f64 {
        let (h, delay) = (timing.step_s, timing.delay_updates as usize);
        let rate = coupling.damping / h;
        let sum = coupling.stiffness + rate;
        // Semi-implicit steps of a thousandth: the second route to the exact maps.
        const PARTS: u32 = 400;
        let dt = h / f64::from(PARTS);
        let swings: Vec<[f64; 3]> = place.swings().collect();
        let mut modes = vec![[0.0_f64, 0.0]; swings.len()];
        let fly = |[mut q, mut v]: [f64; 2], omega: f64, zeta: f64, p: f64| {
            for _ in 0..PARTS {
                // Implicit midpoint.
                let (c, k) = (2.0 * zeta * omega, omega * omega);
                let next = ((1.0 - 0.5 * dt * c - 0.25 * dt * dt * k) * v + dt * (p - k * q))
                    / (1.0 + 0.5 * dt * c + 0.25 * dt * dt * k);
                q += 0.5 * dt * (v + next);
                v = next;
            }
            [q, v]
        };
        let traits = Traits::TOUCH;
        let mass = traits.mass_kg + hand.mass_kg;
        let omega = (hand.stiffness_n_m / mass).sqrt();
        let zeta = 0.5 * (hand.damping_n_s_m + traits.damping_n_s_m) / (mass * omega);
        let (mut device, mut stretch) = ([1e-3_f64, 0.0], 0.0);
        let mut line = vec![0.0; delay];
        let within = place.within_step(h);
        let (mut first, mut second) = (0.0_f64, 0.0_f64);
        for step in 0..steps {
            let free: Vec<[f64; 2]> =
                modes.iter().zip(&swings).map(|(m, [omega, zeta, _])| fly(*m, *omega, *zeta, 0.0)).collect();
            let there: f64 = free.iter().zip(&swings).map(|(m, s)| m[0] * s[2].sqrt()).sum();
            let force = (device[0] - there - rate / sum * stretch) / (within + 1.0 / sum);
            for (mode, [omega, zeta, gain]) in modes.iter_mut().zip(&swings) {
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
        let place = place();
        let hand = Hand::FINGERTIP;
        for (step_s, link) in [(1e-3, 0.0), (2e-3, 0.0), (1e-3, 0.005)] {
            let timing = LoopTiming::new(step_s, link);
            let closed = ClosedLoop::new(&place, Traits::TOUCH, Some(hand), timing);
            let damping = 0.2;
            let ranges = closed.stable_stiffness(damping, 1e6);
            let [_, most] = *ranges.last().expect("some stiffness is stable");
            for (share, stable) in [(0.9, true), (1.1, false)] {
                let coupling = Coupling { stiffness: share * most, damping };
                assert_eq!(closed.is_stable(coupling), stable);
                let grows = grows(&place, hand, timing, coupling, 3000);
                assert_eq!(grows < 1.0, stable, "{step_s} {link} {share}: {grows}, {ranges:?}");
            }
        }
    }

    #[test]
    fn default_gains_have_their_margin_and_are_softer_the_later_the_answer() {
        let place = place();
        let mut last = f64::INFINITY;
        for link in [0.0, 0.005, 0.02, 0.05] {
            let timing = LoopTiming::new(1e-3, link);
            let hands = [None, Some(Hand::FINGERTIP), Some(Hand::LIGHT), Some(Hand::FIRM)];
            let loops = hands.map(|hand| ClosedLoop::new(&place, Traits::TOUCH, hand, timing));
            let found = default_coupling(&loops, place.within_step(1e-3)).expect("a soft one always is");
            assert!(
                found.margins.gain > 1.9 && found.margins.delay_s > 0.9 * timing.age_s(),
                "{link}: {found:?}"
            );
            assert!(
                found.coupling.stiffness <= last
                    && found.coupling.stiffness <= 10.0 / place.within_step(1e-3)
            );
            let twice =
                Coupling { stiffness: 1.9 * found.coupling.stiffness, damping: 1.9 * found.coupling.damping };
            assert!(loops.iter().all(|closed| closed.is_stable(twice)));
            last = found.coupling.stiffness;
        }
    }
}
