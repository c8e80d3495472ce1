//! Recording files: every released one is readable, every damaged one is refused with its kind of error.

use palpate::{Error, Recording, RecordingError, RecordingPart};
use palpate_testkit::{FIXED_BLOCK_FILE as FIXED, FREE_BLOCK_FILE as FREE, fixed_block, free_block};

/// Round-off of a mass that is a sum over elements [kg].
const MASS_ROUND_OFF_KG: f64 = 1e-15;

#[test]
fn files_of_version_1_are_read_and_written_back_to_the_same_bytes() {
    for bytes in [FREE, FIXED] {
        let recording = Recording::from_bytes(bytes).expect("a released recording");
        assert_eq!(recording.to_bytes().expect("it can be written"), bytes);
        let again = Recording::from_bytes(&recording.to_bytes().expect("it can be written"));
        assert_eq!(again.as_ref(), Ok(&recording));
    }
}

#[test]
fn content_of_version_1_files_is_unchanged() {
    let free = free_block();
    assert_eq!((free.surface.positions.len(), free.surface.triangles.len(), free.modes.len()), (12, 20, 12));
    // 0.2 × 0.1 × 0.1 m at 110 kg/m³.
    assert!((free.mass() - 0.22).abs() < MASS_ROUND_OFF_KG);
    assert!(fixed_block().gravity.is_some() && free.gravity.is_none());
}

#[test]
fn truncated_file_is_refused() {
    for length in 0..FREE.len() {
        assert!(Recording::from_bytes(&FREE[..length]).is_err(), "cut to {length} bytes");
    }
}

#[test]
fn changed_byte_is_refused() {
    let mut bytes = FREE.to_vec();
    for at in 0..bytes.len() {
        bytes[at] ^= 0x11;
        assert!(Recording::from_bytes(&bytes).is_err(), "byte {at}");
        bytes[at] ^= 0x11;
    }
    assert!(Recording::from_bytes(&bytes).is_ok());
}

#[test]
fn errors_have_a_kind_and_a_text() {
    let text = |bytes: &[u8]| Recording::from_bytes(bytes).err().map(|e| e.to_string()).unwrap_or_default();
    assert!(
        text(b"").starts_with("not a usable recording: the file is damaged, truncated or of another kind")
    );
    assert!(text(b"step = 0.001\n[[object]]\n").contains("damaged, truncated or of another kind"));
    // A header length far beyond the file's size.
    let mut hostile = u64::MAX.to_le_bytes().to_vec();
    hostile.extend_from_slice(&FREE[8..]);
    assert!(text(&hostile).contains("damaged, truncated or of another kind"));
    let other = b"\x02\0\0\0\0\0\0\0{}";
    assert_eq!(
        text(other),
        "not a usable recording: a safetensors file, but without the metadata of palpate"
    );
    let pattern = b"\\\"format_version\\\":1,";
    let at =
        FREE.windows(pattern.len()).position(|w| w == pattern).expect("the version stands in the header");
    let mut newer = FREE.to_vec();
    newer[at + pattern.len() - 2] = b'9';
    let kind = |bytes: &[u8]| match Recording::from_bytes(bytes) {
        Err(Error::Recording(kind)) => Some(kind),
        _ => None,
    };
    assert!(matches!(kind(b""), Some(RecordingError::Container { .. })));
    assert_eq!(kind(other), Some(RecordingError::NotARecording));
    assert_eq!(kind(&newer), Some(RecordingError::UnsupportedVersion { found: 9, supported: 4 }));
    let mut damaged = FREE.to_vec();
    damaged[FREE.len() - 1] ^= 1;
    assert_eq!(kind(&damaged), Some(RecordingError::HashMismatch));
    assert_eq!(
        text(&damaged),
        "not a usable recording: its content does not fit its hash: the file was damaged or changed after it was written"
    );
    assert!(
        text(&newer).contains("format version 9, this palpate reads versions up to 4"),
        "{}",
        text(&newer)
    );
}

#[test]
fn inconsistent_recordings_are_refused_when_written() {
    let good = Recording::clone(&free_block());
    let refused = |change: fn(&mut Recording)| {
        let mut recording = good.clone();
        change(&mut recording);
        recording.to_bytes().err().map(|e| e.to_string()).unwrap_or_default()
    };
    let mut massless = good.clone();
    massless.metadata.mass.mass_kg = 0.0;
    let what = "mass.mass_kg[0] is 0e0 kg, expected 1e-18 to 1e18".into();
    let kind = RecordingError::Inconsistent { part: RecordingPart::Mass, what };
    assert_eq!(massless.validate(), Err(Error::Recording(kind)));
    assert!(
        refused(|r| r.modes.mode_shapes[3] = f64::NAN)
            .ends_with("modes.mode_shapes[3] is NaN 1/√kg, expected -1e12 to 1e12")
    );
    assert!(refused(|r| r.modes.angular_frequencies.reverse()).contains("ascending"));
    assert!(
        refused(|r| r.modes.damping_ratios[0] = -0.1).contains("modes.damping_ratios[0] is -1e-1, expected")
    );
    assert!(refused(|r| r.surface.triangles[4][1] = 12).contains("name node 12 in triangle 4, beyond"));
    assert!(refused(|r| r.metadata.mass.mass_kg = 0.0).contains("mass.mass_kg[0] is 0e0 kg"));
    assert!(
        refused(|r| r.metadata.mass.inertia_kg_m2[1][1] *= -1.0)
            .contains("mass.inertia_kg_m2 is not one of a body")
    );
    assert!(refused(|r| r.metadata.units = "mm".into()).contains("in units \"mm\""));
}
