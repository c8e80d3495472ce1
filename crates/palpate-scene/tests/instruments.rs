//! Built-in scenes that ring: what the mallet strikes has the frequency that it is made for, and rings for long.

use glam::DVec3;
use palpate::{DeviceInput, DeviceMode, State, step};
use palpate_scene::{OpenedScene, SceneLibrary, SilentProgress};
use palpate_sound::{CEILING, KNEE, SoundParameters, StepRecord, Synthesiser};
use palpate_testkit::{Random, RandomPointer};
use std::f64::consts::TAU;

/// Amplitude of a tone [Hz] in samples at 48 kHz, by a Hann window.
fn amplitude(samples: &[f32], frequency: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (at, sample) in samples.iter().enumerate() {
        let window = 1.0 - (TAU * (at as f64 + 0.5) / samples.len() as f64).cos();
        let (sin, cos) = (TAU * frequency / 48e3 * at as f64).sin_cos();
        re += f64::from(*sample) * window * cos;
        im += f64::from(*sample) * window * sin;
    }
    2.0 * f64::hypot(re, im) / samples.len() as f64
}

fn opened(id: &str) -> (OpenedScene, u64) {
    let folder = tempfile::TempDir::new().expect("a folder");
    let library = SceneLibrary::new(Some(folder.path())).expect("a library");
    let opened = library.open_built_in(id, &mut SilentProgress).expect("a scene");
    let files = std::fs::read_dir(folder.path()).expect("a folder").flatten();
    let bytes = files.map(|file| file.metadata().expect("a file").len()).sum();
    (opened, bytes)
}

/// Samples of the first seconds; a pointer holds or touches from a time on [s] where it is told to.
fn sound(opened: &OpenedScene, seconds: f64, held: Option<(f64, DeviceInput)>) -> Vec<f32> {
    let scene = &opened.scene;
    let h = scene.model.parameters().step_s;
    let mut state = State::new(&scene.model);
    let mut synthesiser = Synthesiser::new(&scene.model, &state, &SoundParameters::default());
    let mut record = StepRecord::new(&synthesiser);
    let mut samples = Vec::new();
    for number in 1..=(seconds / h).round() as u32 {
        let time = f64::from(number) * h;
        let mut input = scene.input_at(time);
        for (slot, device) in scene.devices.iter().enumerate().filter(|(_, device)| device.pointer) {
            let is_first = scene.devices.iter().position(|other| other.pointer) == Some(slot);
            let given = held.filter(|(from_s, _)| time > *from_s && is_first);
            input.devices[slot] = given.map_or(DeviceInput::inactive(), |(_, input)| input);
            assert!(device.mode == DeviceMode::Touch);
        }
        step(&scene.model, &mut state, &input);
        record.capture(&state);
        synthesiser.synthesise(&record, &mut samples);
    }
    samples
}

/// Window of half a second from a time on [s].
fn half_second(samples: &[f32], from_s: f64) -> &[f32] {
    &samples[(from_s * 48e3) as usize..][..24_000]
}

#[test]
fn struck_instruments_ring_at_the_frequencies_that_they_are_made_for() {
    for (id, expected, tolerance) in [("bar", 440.0, 2.0), ("fork", 440.0, 2.0), ("bell", 1016.0, 5.0)] {
        let (opened, bytes) = opened(id);
        assert!(bytes < 3_000_000, "{id}: {bytes} bytes");
        let recording = opened.scene.model.recordings().next().expect("an object");
        let samples = sound(&opened, 1.3, None);
        let early = half_second(&samples, 0.2);
        let grid = (-200..=200).map(|tenth| expected + f64::from(tenth) / 10.0);
        let loudest =
            grid.max_by(|a, b| amplitude(early, *a).total_cmp(&amplitude(early, *b))).expect("a tone");
        assert!((loudest - expected).abs() <= tolerance, "{id}: {loudest} Hz");
        let peak = samples.iter().fold(0.0_f32, |largest, sample| largest.max(sample.abs()));
        assert!(f64::from(peak) <= CEILING && peak > 0.01, "{id}: peak {peak}");
        // It rings: its supports take no more than half as much as its own damping.
        let (before, after) = (amplitude(early, loudest), amplitude(half_second(&samples, 0.7), loudest));
        let own = recording.modes.damping_ratios[0] * TAU * loudest;
        let rate = (before / after).ln() / 0.5;
        println!(
            "{id}: {loudest:.1} Hz, peak {peak:.3} (knee {KNEE}), decay {rate:.3} 1/s, its own {own:.3} 1/s, {} kB",
            bytes / 1000
        );
        assert!(rate > 0.8 * own && rate < 1.5 * own, "{id}: {rate} {own}");
    }
}

#[test]
fn a_finger_that_holds_the_middle_of_the_bar_silences_it() {
    let (opened, _) = opened("bar");
    let recording = opened.scene.model.recordings().next().expect("an object");
    let middle = DVec3::new(0.0, 0.005, 0.02);
    let (point, _) = recording.surface.nearest(middle).expect("a surface");
    let hand =
        DeviceInput::held(recording.surface.rest_position(&point), palpate::Grasp { object: 0, point });
    let [free, held] = [None, Some((0.3, hand))].map(|held| {
        let samples = sound(&opened, 1.2, held);
        amplitude(half_second(&samples, 0.7), recording.modes.angular_frequencies[0] / TAU)
    });
    println!("free {free:.5}, held {held:.2e}");
    assert!(held < 0.05 * free && free > 1e-3, "{free} {held}");
}

/// Energy that no term explains, and that is gained, as a share of what is exchanged: contacts are solved to 1e-5 of the size.
const UNEXPLAINED: f64 = 1e-9;

#[test]
fn random_fingers_on_instruments_gain_no_energy_and_the_sound_stays_below_the_ceiling() {
    for id in ["bar", "fork", "bell"] {
        let (opened, _) = opened(id);
        let scene = &opened.scene;
        let h = scene.model.parameters().step_s;
        let mut state = State::new(&scene.model);
        let mut synthesiser = Synthesiser::new(&scene.model, &state, &SoundParameters::default());
        let mut record = StepRecord::new(&synthesiser);
        let (mut samples, mut peak, mut random) = (Vec::new(), 0.0_f32, Random::new(7));
        let slots = scene.devices.iter().enumerate().filter(|(_, device)| device.pointer);
        let mut fingers: Vec<(usize, RandomPointer)> =
            slots.map(|(slot, device)| (slot, RandomPointer::new(device.parameters.tip_radius))).collect();
        let start = state.output().energy;
        let (mut gained, mut exchanged, mut last) = (0.0_f64, 1e-6, start);
        for number in 1..=(4.0 / h) as u32 {
            let mut input = scene.input_at(f64::from(number) * h);
            for (slot, finger) in &mut fingers {
                input.devices[*slot] = finger.next(&mut random, &scene.model, state.output(), h);
            }
            let energy = step(&scene.model, &mut state, &input).energy;
            exchanged += (energy.input - last.input).abs() + (energy.kinetic - last.kinetic).abs();
            gained = gained.max(energy.stored() - start.stored() - energy.input).max(energy.defect.abs());
            last = energy;
            record.capture(&state);
            samples.clear();
            synthesiser.synthesise(&record, &mut samples);
            peak = samples.iter().fold(peak, |largest, sample| largest.max(sample.abs()));
        }
        println!("{id}: peak {peak:.3}, gained {:.1e} of {exchanged:.2e} J", gained / exchanged);
        assert!(gained < UNEXPLAINED * exchanged, "{id}: {gained:e} of {exchanged:e} J");
        assert!(peak > 0.01 && f64::from(peak) <= CEILING, "{id}: {peak}");
        let twist = state.output().objects[0].twist.linear.length();
        assert!(twist < 10.0, "{id}: {twist} m/s");
    }
}
