//! Levels of contact samples of a fine body: time to make them, bytes in the recording, and the time of a model with and without them.
//!
//! ```sh
//! cargo run --release -p palpate-testkit --example contact_sample_levels -- CUBE.palp REFINEMENTS
//! ```
//!
//! Each refinement splits every surface triangle in four.

use glam::DVec3;
use palpate::{CertificateLevel, MIN_CONTACT_SAMPLES, Model, ModelObject, ModelParameters, Recording};
use palpate_testkit::{floor, start_at, subdivided_near_field};
use std::error::Error;
use std::sync::Arc;
use std::time::Instant;

/// Number of repeats of each measurement; the least time is printed.
const REPEATS: usize = 3;

/// Upper limit of contact samples in real time.
const MAX_CONTACT_SAMPLES: usize = 48;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [path, refinements] = arguments.as_slice() else {
        return Err("usage: contact_sample_levels CUBE.palp REFINEMENTS".into());
    };
    let coarse = Recording::from_bytes(&std::fs::read(path)?)?;
    let mut recording =
        (0..refinements.parse()?).fold(coarse, |recording, _| subdivided_near_field(&recording));
    recording.sample_levels.clear();
    let without = recording.clone();
    let surface = &recording.surface;
    println!("surface nodes {}", surface.positions.len());

    let (levels, seconds) = least_time(|| Ok(surface.sample_levels(MIN_CONTACT_SAMPLES)))?;
    println!("levels        {} in {seconds:.2} s", levels.len());
    let (errors, seconds) = least_time(|| {
        Ok(levels.iter().map(|level| CertificateLevel::new(surface, level)).collect::<Vec<_>>())
    })?;
    println!("their errors  in {seconds:.2} s");
    for error in errors {
        let CertificateLevel { samples, spacing_m, hausdorff_distance_m } = error;
        println!("  {samples:>7} samples, spacing {spacing_m:.6} m, distance {hausdorff_distance_m:?} m");
    }

    recording.sample_levels = levels;
    let (small, large) = (without.to_bytes()?.len(), recording.to_bytes()?.len());
    println!(
        "bytes         {small} without levels, {large} with: {:.3} % more",
        100.0 * (large as f64 / small as f64 - 1.0)
    );
    for (recording, what) in [(without, "made with the model"), (recording, "from the recording")] {
        let recording = Arc::new(recording);
        let (_, seconds) = least_time(|| {
            let parameters = ModelParameters {
                obstacles: vec![floor(0.5)],
                max_contact_samples: MAX_CONTACT_SAMPLES,
                ..ModelParameters::for_reference()
            };
            let object = ModelObject::new(recording.clone(), start_at(DVec3::Y));
            Ok(Model::new(parameters, vec![object])?)
        })?;
        println!("Model::new    {seconds:.2} s, levels {what}");
    }
    Ok(())
}

/// Result of a computation, and the least time of its repeats [s].
fn least_time<T>(compute: impl Fn() -> Result<T, Box<dyn Error>>) -> Result<(T, f64), Box<dyn Error>> {
    let mut least = f64::INFINITY;
    let mut result = None;
    for _ in 0..REPEATS {
        let begun = Instant::now();
        result = Some(compute()?);
        least = least.min(begun.elapsed().as_secs_f64());
    }
    Ok((result.ok_or("no repeat")?, least))
}
