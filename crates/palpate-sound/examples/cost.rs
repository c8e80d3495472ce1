//! Cost of the sound for numbers of audible modes and steps: capture on the force process, synthesis on the thread of the sound.
//!
//! `cargo run --release -p palpate-sound --example cost`

use palpate::{Input, Model, ModelParameters, State, step};
use palpate_sound::{SoundParameters, StepRecord, Synthesiser};
use palpate_testkit::{free_block, object_at};
use std::sync::Arc;
use std::time::Instant;

fn main() -> Result<(), palpate::Error> {
    println!("modes  step [ms]  capture [µs]  synthesis [µs]  share of a core [%]");
    for step_s in [1e-3, 0.25e-3, 0.3e-3] {
        for bodies in [1_usize, 4, 16] {
            // A block with all of its modes from 100 Hz to 20 kHz.
            let mut recording = (*free_block()).clone();
            let count = recording.modes.angular_frequencies.len() as f64;
            for (at, omega) in recording.modes.angular_frequencies.iter_mut().enumerate() {
                *omega = std::f64::consts::TAU * 100.0 * 200.0_f64.powf(at as f64 / count);
            }
            let recording = Arc::new(recording);
            let place = |at: usize| palpate::glam::DVec3::X * at as f64;
            let objects = (0..bodies).map(|at| object_at(&recording, place(at), place(1))).collect();
            let model = Model::new(ModelParameters { step_s, ..ModelParameters::for_reference() }, objects)?;
            let mut state = State::new(&model);
            let mut synthesiser = Synthesiser::new(&model, &state, &SoundParameters::default());
            let modes: usize = synthesiser.radiators().map(palpate_sound::Radiator::len).sum();
            let mut record = StepRecord::new(&synthesiser);
            let (mut samples, mut captures, mut syntheses) = (Vec::new(), Vec::new(), Vec::new());
            for _ in 0..4000 {
                step(&model, &mut state, &Input::default());
                samples.clear();
                let begun = Instant::now();
                record.capture(&state);
                let captured = Instant::now();
                synthesiser.synthesise(&record, &mut samples);
                captures.push((captured - begun).as_secs_f64());
                syntheses.push(captured.elapsed().as_secs_f64());
            }
            let median = |times: &mut Vec<f64>| {
                times.sort_unstable_by(f64::total_cmp);
                1e6 * times[times.len() / 2]
            };
            let (capture, synthesis) = (median(&mut captures), median(&mut syntheses));
            let share = 1e-4 * synthesis / step_s;
            println!("{modes:>5}  {:>9}  {capture:>12.2}  {synthesis:>14.1}  {share:>18.2}", 1e3 * step_s);
        }
    }
    Ok(())
}
