//! Sound of a run as a WAV file.

use super::workplace::Workplace;
use std::f64::consts::TAU;

/// A bar of aluminium that is struck at an end for half a millisecond.
const STRUCK: &str = r#"
step = 0.0005
[[object]]
name = "bar"
recording = "bar.palp"
[[device]]
name = "blow"
mode = "force"
attach = { object = "bar", point = [0.1, 0.005, 0.0] }
path = { file = "blow.csv" }
"#;

/// Force of the blow: t [s], N.
const BLOW: &str = "t,fx,fy,fz\n0,0,-4,0\n0.0005,0,-4,0\n0.000500001,0,0,0\n1,0,0,0\n";

fn with_bar() -> Workplace {
    let workplace = Workplace::new();
    workplace.succeed(&[
        "record",
        "box:0.2x0.01x0.02/10x1x2/6",
        "--material",
        "aluminium",
        "--damping-ratio",
        "0.0005",
        "--modes",
        "12",
        "-o",
        "bar.palp",
    ]);
    workplace.write("scene.toml", STRUCK);
    workplace.write("blow.csv", BLOW);
    workplace
}

/// Amplitude of a tone [Hz] in samples at 48 kHz.
fn amplitude(samples: &[f64], frequency: f64) -> f64 {
    let (mut re, mut im) = (0.0, 0.0);
    for (at, sample) in samples.iter().enumerate() {
        let window = 1.0 - (TAU * at as f64 / samples.len() as f64).cos();
        let (sin, cos) = (TAU * frequency / 48e3 * at as f64).sin_cos();
        (re, im) = (re + sample * window * cos, im + sample * window * sin);
    }
    2.0 * f64::hypot(re, im) / samples.len() as f64
}

#[test]
fn a_struck_bar_is_written_as_a_wav_file_with_its_recorded_frequency_and_a_stated_peak() {
    let workplace = with_bar();
    let printed = workplace.succeed(&["run", "scene.toml", "--duration", "0.5", "--sound", "bar.wav"]);
    let file = workplace.read("bar.wav");
    let number = |at: usize| u32::from_le_bytes(file[at..at + 4].try_into().expect("four bytes"));
    assert_eq!((&file[..4], &file[8..16], &file[36..40]), (&b"RIFF"[..], &b"WAVEfmt "[..], &b"data"[..]));
    // PCM, one channel, 48 kHz, 96 kB/s, 2 bytes a sample, 16 bits.
    assert_eq!(
        [number(16), number(20), number(24), number(28), number(32)],
        [16, 0x1_0001, 48_000, 96_000, 0x10_0002]
    );
    assert_eq!([number(4), number(40)], [36 + 48_000, 48_000]);
    assert_eq!(file.len(), 44 + 48_000);
    let samples =
        file[44..].chunks_exact(2).map(|two| f64::from(i16::from_le_bytes([two[0], two[1]])) / 32_767.0);
    let samples: Vec<f64> = samples.collect();
    let first =
        workplace.json(&["inspect", "bar.palp", "--json"])["frequencies_hz"][0].as_f64().expect("a number");
    let strongest = (-40..=40)
        .map(|tenth| first + f64::from(tenth) / 10.0)
        .max_by(|a, b| amplitude(&samples[2400..], *a).total_cmp(&amplitude(&samples[2400..], *b)));
    assert!((strongest.expect("a tone") - first).abs() <= 1.0, "{strongest:?} {first}");
    let peak = samples.iter().fold(0.0_f64, |largest, sample| largest.max(sample.abs()));
    let told = format!("  sound        bar.wav, peak {:.1} dB of full scale", 20.0 * peak.log10());
    assert!(printed.contains(&told) && (0.01..0.5).contains(&peak), "{told}\n{printed}");
    // Half the full scale is twice as loud, to the rounding of samples.
    let summary = workplace.json(&[
        "run",
        "scene.toml",
        "--duration",
        "0.5",
        "--sound",
        "loud.wav",
        "--sound-full-scale",
        "1.5",
        "--json",
    ]);
    let loud = summary["sound"]["peak"].as_f64().expect("a number");
    assert!((loud / peak - 2.0 / 1.5).abs() < 0.01, "{loud} {peak}");
    assert_eq!(summary["sound"]["path"], "loud.wav");
}

#[test]
fn sound_that_cannot_be_written_is_refused_by_name() {
    let workplace = Workplace::with_scene();
    for (arguments, told) in [
        (&["run", "scene.toml", "--sound", "-"][..], "--sound can't be -: its beginning is written last"),
        (
            &["run", "scene.toml", "--sound", "a.wav", "--sound-full-scale", "0"],
            "--sound-full-scale is 0 Pa, expected a positive number",
        ),
        (
            &["run", "scene.toml", "--sound", "a.wav", "--csv", "a.wav"],
            "cannot write a.wav: --csv and --sound name the same file",
        ),
        (&["run", "scene.toml", "--sound", "scene.toml"], "cannot write scene.toml: it is one of the inputs"),
        (
            &["run", "scene.toml", "--realtime", "--sound", "a.wav"],
            "--csv, --contacts, --vtu and --sound take time",
        ),
        (
            &["run", "scene.toml", "--sound", "a.wav", "--duration", "50000"],
            "cannot write a.wav: it would have 50000 s of sound, a WAV file has 44739 s (12 hours) of 48 kHz at most",
        ),
    ] {
        let error = workplace.fail(arguments);
        assert!(error.contains(told), "{arguments:?}: {error}");
    }
    // Soft bodies sway below the range of hearing.
    let printed = workplace.succeed(&["run", "scene.toml", "--sound", "a.wav", "--duration", "0.05"]);
    assert!(printed.contains("  sound        a.wav, "), "{printed}");
}
