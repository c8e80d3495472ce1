//! Recording files, and their certificates in words.

use crate::error::{SceneError, SceneErrorKind};
use crate::files::read_regular_file;
use palpate::{Certificate, PeakForceError, Recording};
use std::fmt::Write;
use std::path::Path;

/// Reads a recording file.
///
/// # Errors
/// When the path is no regular file, the file is empty, or its content is refused by the runtime.
pub fn read_recording(path: &Path) -> Result<Recording, SceneError> {
    let failed = |error: std::io::Error| SceneError::io("read the recording", path, &error);
    recording_of_bytes(path, &read_regular_file(path).map_err(failed)?)
}

/// Recording of the bytes of a file, which errors name.
pub(crate) fn recording_of_bytes(path: &Path, bytes: &[u8]) -> Result<Recording, SceneError> {
    let refused = |message: String| SceneError::of_file(SceneErrorKind::Recording, path, message);
    if bytes.is_empty() {
        return Err(refused(format!("{}: the file is empty", path.display())));
    }
    Recording::from_bytes(bytes).map_err(|error| refused(format!("{}: {error}", path.display())))
}

/// Certificate of a recording in words, as an indented table for a terminal.
pub fn certificate_table(certificate: &Certificate) -> String {
    let mut text = String::new();
    // A string takes every write.
    let _ = write_certificate(&mut text, certificate);
    text
}

/// Certificate of a recording in words, a line per statement; empty without a certificate.
pub fn certificate_lines(recording: &Recording) -> Vec<String> {
    let table = recording.metadata.certificate.as_ref().map(certificate_table).unwrap_or_default();
    let words = |line: &str| line.split_whitespace().collect::<Vec<_>>().join(" ");
    table.lines().map(words).collect()
}

fn write_certificate(out: &mut String, certificate: &Certificate) -> std::fmt::Result {
    let Certificate { event, samples, modes_of: [kept, all], .. } = certificate;
    writeln!(
        out,
        "  certificate  against the unreduced mesh with all its {all} modes; {kept} are kept; {samples} points and patches"
    )?;
    let ms = |s: f64| 1000.0 * s;
    writeln!(
        out,
        "    force error          {} at most, {} in the median (one place pressed in {} ms, over {} ms)",
        percent(certificate.force_error_max),
        percent(certificate.force_error_median),
        ms(event.rise_s),
        ms(event.duration_s)
    )?;
    if let Some(PeakForceError { held, touched }) = &certificate.peak_force_error_max {
        for (name, errors) in [("held", held), ("touched", touched)] {
            let [one, two, three] = errors.map(percent);
            let name = format!("peak error, {name}");
            writeln!(
                out,
                "    {name:<21}{one} at one place, {two} at two, {three} at three that move, the body free"
            )?;
        }
    }
    writeln!(out, "    static compliance    {} at most", percent(certificate.static_compliance_error_max))?;
    writeln!(
        out,
        "    sudden jump          R[0] off by {} at most, within one step of {} ms; smooth motion does not feel it",
        percent(certificate.instantaneous_compliance_error_max),
        ms(event.step_s)
    )?;
    writeln!(
        out,
        "    bandwidth            {:.1} Hz (dynamic compliance within 5 % of the static)",
        certificate.bandwidth_hz
    )?;
    writeln!(out, "    reference            its own error is {}", percent(certificate.reference_error))?;
    for (at, level) in certificate.sample_levels.iter().enumerate() {
        let name = format!("level {}", at + 1);
        let mm = |metres: f64| 1000.0 * metres;
        write!(
            out,
            "    {name:<21}{} contact samples, spacing {:.3} mm, ",
            level.samples,
            mm(level.spacing_m)
        )?;
        match level.hausdorff_distance_m {
            Some(distance) => writeln!(out, "decimated surface within {:.3} mm", mm(distance))?,
            None => writeln!(out, "no decimated surface")?,
        }
    }
    Ok(())
}

fn percent(share: f64) -> String {
    match 100.0 * share {
        percent if percent > 1000.0 => "more than 1000 %".into(),
        percent if percent >= 10.0 => format!("{percent:.0} %"),
        percent if percent >= 0.005 => format!("{percent:.2} %"),
        _ => "below 0.01 %".into(),
    }
}
