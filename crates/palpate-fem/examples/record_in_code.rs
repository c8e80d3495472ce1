//! Records a rubber block, prints its frequencies and its certificate, and writes the recording.
//!
//! `cargo run --release -p palpate-fem --example record_in_code [OUT.palp]`; the file can be used in a scene.

use palpate::{Damping, Material};
use palpate_fem::{ElementOrder, Precision, Progress, RecordParameters, record};
use palpate_mesh::box_mesh;
use std::time::{Duration, Instant};

/// Sides of the block [m], and its cells.
const SIZE: [f64; 3] = [0.08, 0.04, 0.04];
const CELLS: [u32; 3] = [6, 3, 3];

/// Prints stages and warnings; interrupts when the time limit is over.
struct Listener {
    start: Instant,
    limit: Duration,
}

impl Progress for Listener {
    fn begin(&mut self, stage: &str, total: u64) {
        eprintln!("{stage}: {total} units of work");
    }

    fn advance(&mut self, _units: u64) {}

    fn warn(&mut self, text: &str) {
        eprintln!("warning: {text}");
    }

    fn is_interrupted(&self) -> bool {
        self.start.elapsed() > self.limit
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mesh = box_mesh(SIZE, CELLS)?;
    let rubber = Material::isotropic(1e5, 0.45, 1100.0);
    let damping = Damping::Rayleigh { alpha: 2.0, beta: 2e-4 };
    let parameters = RecordParameters {
        precision: Precision::Compact,
        source: "rubber block".into(),
        ..RecordParameters::new(vec![rubber], ElementOrder::Quadratic, 40, damping)
    };
    let mut listener = Listener { start: Instant::now(), limit: Duration::from_secs(300) };
    let recording = record(mesh, &parameters, &mut listener)?;

    println!("mass                {:.4} kg", recording.mass());
    for (number, omega) in recording.modes.angular_frequencies.iter().take(5).enumerate() {
        println!("mode {:<2}             {:.2} Hz", number + 1, omega / std::f64::consts::TAU);
    }
    if let Some(certificate) = &recording.metadata.certificate {
        println!("force error         {:.2} % at most", 100.0 * certificate.force_error_max);
        println!("bandwidth           {:.0} Hz", certificate.bandwidth_hz);
    }
    let bytes = recording.to_bytes()?;
    println!("recording           {} bytes", bytes.len());
    if let Some(path) = std::env::args_os().nth(1) {
        std::fs::write(path, bytes)?;
    }
    Ok(())
}
