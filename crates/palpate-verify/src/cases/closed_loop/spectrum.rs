//! The loop as a linear map of its state, and its spectral radius.

use super::{Cell, HAND, STIFFEST};
use faer::Mat;
use palpate::{Coupling, OscillatorState, SampledOscillator};
use palpate_haptics::device::DeviceSpec;
use palpate_haptics::stability::{LoopTiming, PointResponse, SLOWEST_GROWTH_S};

/// log₂ of the power N in |A^N|^(1/N), which is the spectral radius to 1e-8 with N = 2³⁰.
const SQUARINGS: i32 = 30;

/// Stiffnesses that are judged, over the stable bound.
const SHARES: [f64; 4] = [0.5, 0.999, 1.001, 2.0];

/// Largest |eigenvalue| of the loop along an axis. The state: modes, stretch of the coupling, delayed forces, device, relaxed
/// displacement of the residual compliance. The last force is the first of the delayed ones.
fn spectral_radius(cell: &Cell, place: &PointResponse, coupling: Coupling) -> f64 {
    let LoopTiming { step_s: h, delay_updates } = cell.timing();
    let swings: Vec<(SampledOscillator, f64)> = place
        .oscillators()
        .map(|[omega, zeta, gain]| (SampledOscillator::new(omega, zeta, h), gain.sqrt()))
        .collect();
    let mass = DeviceSpec::TOUCH.mass_kg + HAND.mass_kg;
    let omega = (HAND.stiffness_n_m / mass).sqrt();
    let zeta = 0.5 * (HAND.damping_n_s_m + DeviceSpec::TOUCH.damping_n_s_m) / (mass * omega);
    let device = SampledOscillator::new(omega, zeta, h);
    let (rate, within) = (coupling.damping / h, place.instantaneous_compliance(h));
    let sum = coupling.stiffness + rate;
    let (m, d) = (swings.len(), delay_updates as usize);
    let n = 2 * m + 1 + d + 3;
    let sampled = place.sampled_residual(h);
    let next = |state: &[f64]| -> Vec<f64> {
        let mode = |at: usize| OscillatorState { q: state[2 * at], v: state[2 * at + 1] };
        let swung: f64 =
            swings.iter().enumerate().map(|(at, (map, phi))| phi * map.advance(mode(at), 0.0).q).sum();
        let (stretch, line) = (state[2 * m], &state[2 * m + 1..2 * m + 1 + d]);
        let relaxed = sampled.decay() * state[n - 1];
        let free = swung + relaxed - sampled.lead() * place.residual() * line[0];
        let hand = OscillatorState { q: state[n - 3], v: state[n - 2] };
        let force = (hand.q - free - rate / sum * stretch) / (within + 1.0 / sum);
        let mut next = Vec::with_capacity(n);
        for (at, (map, phi)) in swings.iter().enumerate() {
            let moved = map.advance(mode(at), phi * force);
            next.extend([moved.q, moved.v]);
        }
        next.push((force + rate * stretch) / sum);
        // The new force enters the line, the oldest is held.
        next.push(force);
        next.extend(&line[..d - 1]);
        let moved = device.advance(hand, -line[d - 1] / mass);
        next.extend([moved.q, moved.v]);
        next.push(relaxed + (1.0 - sampled.decay()) * place.residual() * force);
        next
    };
    let mut matrix = Mat::<f64>::zeros(n, n);
    for column in 0..n {
        let mut unit = vec![0.0; n];
        unit[column] = 1.0;
        next(&unit).into_iter().enumerate().for_each(|(row, value)| matrix[(row, column)] = value);
    }
    // Gelfand's formula, ρ(A) = lim |A^N|^(1/N), by squaring: QR iterations do not converge on the delays' nilpotent part.
    let mut logarithm = 0.0;
    for _ in 0..SQUARINGS {
        let size = matrix.norm_max();
        let scaled = matrix.map(|value| value / size);
        logarithm = 2.0 * (logarithm + size.ln());
        matrix = &scaled * &scaled;
    }
    ((logarithm + matrix.norm_max().ln()) / 2_f64.powi(SQUARINGS)).exp()
}

/// Number of couplings around the bound that eigenvalues judge differently from the Nyquist criterion, over all axes.
pub fn disagreements(cell: &Cell) -> u32 {
    let mut differ = 0;
    for (place, closed) in cell.places().iter().zip(cell.loops()) {
        let Some(most) = closed.stable_stiffness(cell.damping(), STIFFEST).first().map(|range| range[1])
        else {
            differ += 1;
            continue;
        };
        for share in SHARES {
            let coupling = Coupling { stiffness: share * most, damping: cell.damping() };
            let stable =
                spectral_radius(cell, place, coupling) < 1.0 + cell.timing().step_s / SLOWEST_GROWTH_S;
            differ += u32::from(stable != closed.is_stable(coupling));
        }
    }
    differ
}
