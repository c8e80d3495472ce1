//! A struck bar of aluminium: frequencies, decay, loudness, clicks, and what happens where steps are missing.

use crate::listening::{amplitude, largest_second_difference, peak, strongest_near};
use crate::studio::{Strike, Studio};
use palpate::glam::DVec3;
use palpate_sound::{CEILING, KNEE, Radiator, SoundParameters, StepRecord, Synthesiser};
use palpate_testkit::{BAR_DAMPING, BAR_MATERIAL, BAR_SIZE_M, aluminium_bar};
use std::f64::consts::TAU;

/// Step [s]: that of a hard mallet's blow.
const STEP_S: f64 = 0.25e-3;

/// Amplitude of a partial [1, of full scale] that is compared: 80 dB below the first, far above the side lobes of the window.
const AUDIBLE: f64 = 3e-6;

/// Blow to a corner of the bar from above [N], for a quarter of a millisecond.
fn blow(newtons: f64) -> Strike {
    let [length, thickness, width] = BAR_SIZE_M;
    let at = DVec3::new(0.5 * length, 0.5 * thickness, 0.5 * width);
    Strike { at, force: DVec3::NEG_Y * newtons, duration_s: STEP_S }
}

fn struck(newtons: f64, duration_s: f64) -> Studio {
    let bar = aluminium_bar().expect("a bar");
    let mut studio = Studio::new(&bar, STEP_S, &SoundParameters::default(), None);
    studio.run(&bar, &blow(newtons), None, duration_s, |_| {});
    studio
}

#[test]
fn spectrum_of_a_struck_bar_has_its_recorded_frequencies_and_the_first_is_that_of_timoshenko() {
    let bar = aluminium_bar().expect("a bar");
    let sound = &struck(10.0, 0.4).samples[960..];
    let radiator = Radiator::new(&bar, &SoundParameters::default());
    let loud: Vec<f64> = radiator
        .angular_frequencies
        .iter()
        .map(|omega| omega / TAU)
        .filter(|frequency| amplitude(sound, *frequency) > AUDIBLE)
        .collect();
    println!("{loud:.1?} Hz");
    assert!(loud.len() >= 6, "{loud:?}");
    for frequency in loud {
        let found = strongest_near(sound, frequency, 10.0);
        assert!((found - frequency).abs() <= 1.0, "{frequency}: {found}");
    }
    // Free bar of Euler and Bernoulli, f = 4.7300²/(2π)·√(EI/ρA)/L², less 0.8·4.73²·(t/L)² per mille by shear and rotary inertia.
    let ([length, thickness, _], (young, _, density)) = (BAR_SIZE_M, BAR_MATERIAL);
    let slender = 4.730_04_f64.powi(2) / TAU * (young / density / 12.0).sqrt() * thickness / length.powi(2);
    let first = radiator.angular_frequencies[0] / TAU;
    assert!((first / slender - 1.0).abs() < 0.01, "{first} {slender}");
    assert!(first < slender, "shear and rotary inertia lower it");
}

#[test]
fn partials_decay_as_their_damping_says() {
    let bar = aluminium_bar().expect("a bar");
    let sound = struck(10.0, 0.4).samples;
    let omegas = &Radiator::new(&bar, &SoundParameters::default()).angular_frequencies;
    let mut compared = 0;
    for omega in omegas {
        let window = |from_s: f64| {
            let first = (from_s * 48e3) as usize;
            amplitude(&sound[first..first + 9600], omega / TAU)
        };
        let (early, late) = (window(0.02), window(0.07));
        // Ten times as loud as what the partials beside it leave in the window.
        if late < 10.0 * AUDIBLE {
            continue;
        }
        compared += 1;
        let frequency = omega / TAU;
        let expected = BAR_DAMPING * omega;
        let found = (early / late).ln() / 0.05;
        assert!((found / expected - 1.0).abs() < 0.01, "{frequency} Hz: {found} {expected} 1/s");
    }
    assert!(compared >= 5, "{compared}");
}

#[test]
fn no_click_and_no_sample_above_the_ceiling_however_hard_the_blow() {
    let gentle = struck(1.0, 0.5).samples;
    // A tone of amplitude A and frequency f has second differences up to A·(2π·f/48 kHz)²; of all audible ones, those up to 20 kHz.
    assert!(peak(&gentle) < KNEE as f32 && peak(&gentle) > 0.001, "{}", peak(&gentle));
    let bar = aluminium_bar().expect("a bar");
    let radiator = Radiator::new(&bar, &SoundParameters::default());
    let highest = radiator.angular_frequencies.last().expect("modes") / 48e3;
    assert!(largest_second_difference(&gentle) < peak(&gentle) * (highest * highest) as f32);
    for newtons in [1e3, 1e6] {
        let loud = peak(&struck(newtons, 0.2).samples);
        assert!(loud > KNEE as f32 && loud <= CEILING as f32, "{newtons} N: {loud}");
    }
}

#[test]
fn a_body_at_rest_is_silent() {
    let samples = struck(0.0, 0.1).samples;
    assert_eq!((samples.len(), peak(&samples)), (4800, 0.0));
}

#[test]
fn missing_steps_leave_a_gap_without_a_click() {
    let bar = aluminium_bar().expect("a bar");
    let parameters = SoundParameters::default();
    let mut studio = Studio::new(&bar, STEP_S, &parameters, None);
    let mut synthesiser = Synthesiser::new(&studio.model, &studio.state, &parameters);
    let mut record = StepRecord::new(&synthesiser);
    let (mut samples, mut number) = (Vec::new(), 0);
    studio.run(&bar, &blow(1.0), None, 0.4, |state| {
        number += 1;
        if !(800..920).contains(&number) {
            record.capture(state);
            synthesiser.synthesise(&record, &mut samples);
        }
    });
    // 120 steps are missing, and the one after them has no start.
    assert_eq!(samples.len(), (1600 - 121) * 12);
    let step = |samples: &[f32]| samples.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f32::max);
    let gap = 799 * 12;
    let smooth = step(&samples[gap - 4800..gap - 1]);
    assert!(step(&samples[gap - 2..gap + 200]) < 1.5 * smooth);
}

#[test]
fn modes_above_the_limit_are_left_out_from_the_top() {
    let bar = aluminium_bar().expect("a bar");
    let few = SoundParameters { max_modes: 4, ..SoundParameters::default() };
    let studio = Studio::new(&bar, STEP_S, &few, None);
    let kept = studio.synthesiser.radiators().next().expect("a body");
    let all = Radiator::new(&bar, &SoundParameters::default());
    assert_eq!(kept.angular_frequencies, all.angular_frequencies[..4]);
    assert!(all.len() > 20 && (all.angular_frequencies[0] - bar.modes.angular_frequencies[0]).abs() == 0.0);
}
