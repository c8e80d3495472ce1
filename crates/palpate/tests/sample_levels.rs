//! Levels of contact samples in recording files: the released form is readable, damaged levels are refused, and stored levels are those
//! that a model makes of the surface.

use glam::DVec3;
use palpate::{
    Certificate, CertificateLevel, Error, GravityResponse, Input, MIN_CONTACT_SAMPLES, Model, ModelObject,
    ModelParameters, ObjectStart, Obstacle, Pose, Recording, RecordingError, RecordingPart, Shape, State,
    Twist, step,
};
use palpate_testkit::{EditableRecording, fixed_block, floor, subdivided};
use std::sync::Arc;

const BALL: &[u8] = include_bytes!("../../../data/recordings/v1_levels/ball.palp");

fn ball() -> Recording {
    Recording::from_bytes(BALL).expect("a released recording")
}

/// Recording of the same body with the levels that one made now holds, read back from its file.
fn newly_recorded() -> Recording {
    let mut new = ball();
    new.sample_levels = new.surface.sample_levels(MIN_CONTACT_SAMPLES);
    if let Some(certificate) = new.metadata.certificate.as_mut() {
        let stated = |level| CertificateLevel::new(&new.surface, level);
        certificate.sample_levels = new.sample_levels.iter().map(stated).collect();
    }
    Recording::from_bytes(&new.to_bytes().expect("it can be written")).expect("a new file")
}

/// Recording in the form before levels.
fn without_levels(recording: &Recording) -> Recording {
    let mut old = recording.clone();
    old.sample_levels.clear();
    let certificate = old.metadata.certificate.take();
    old.metadata.certificate =
        certificate.map(|certificate| Certificate { sample_levels: Vec::new(), ..certificate });
    old
}

#[test]
fn files_with_levels_are_read_and_written_back_to_the_same_bytes() {
    let ball = ball();
    assert_eq!(ball.metadata.format_version, 1);
    let counts: Vec<usize> = ball.sample_levels.iter().map(|level| level.nodes.len()).collect();
    assert!(
        counts.len() > 1 && counts.last().is_some_and(|&count| count <= MIN_CONTACT_SAMPLES),
        "{counts:?}"
    );
    assert_eq!(ball.to_bytes().expect("it can be written"), BALL);
}

#[test]
fn certificate_states_the_levels_of_the_file() {
    let ball = ball();
    let stated = &ball.metadata.certificate.as_ref().expect("a certificate").sample_levels;
    let measured: Vec<CertificateLevel> =
        ball.sample_levels.iter().map(|level| CertificateLevel::new(&ball.surface, level)).collect();
    assert_eq!(*stated, measured);
}

#[test]
fn levels_of_an_old_file_are_those_that_a_new_one_holds() {
    let new = newly_recorded();
    let bytes = without_levels(&new).to_bytes().expect("it can be written");
    let text = String::from_utf8_lossy(&bytes);
    assert!(!text.contains("samples.") && !text.contains("sample_levels"), "the form before levels");
    let old = Recording::from_bytes(&bytes).expect("an old file");
    assert!(old.sample_levels.is_empty());
    assert_eq!(old.surface.sample_levels(MIN_CONTACT_SAMPLES), new.sample_levels);
}

#[test]
fn stored_levels_give_the_same_steps_as_levels_made_with_the_model() {
    let ball = newly_recorded();
    let contacts = |recording: &Recording, max_contact_samples: usize| {
        let floor =
            Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction: 0.5 };
        let parameters = ModelParameters {
            gravity: DVec3::Y * -9.81,
            obstacles: vec![floor],
            max_contact_samples,
            ..ModelParameters::for_reference()
        };
        let start = |height: f64| ObjectStart {
            pose: Pose { position: DVec3::new(0.01 * height, height, 0.0), ..Pose::IDENTITY },
            twist: Twist::ZERO,
        };
        let recording = Arc::new(recording.clone());
        let objects = [0.051, 0.155].map(|height| ModelObject::new(recording.clone(), start(height)));
        let model = Model::new(parameters, objects.into()).expect("a model");
        let mut state = State::new(&model);
        let mut all = Vec::new();
        for _ in 0..200 {
            all.extend(step(&model, &mut state, &Input::default()).contacts.iter().cloned());
        }
        all
    };
    for max_contact_samples in [8, 12, 20] {
        let stored = contacts(&ball, max_contact_samples);
        assert!(!stored.is_empty());
        assert_eq!(stored, contacts(&without_levels(&ball), max_contact_samples), "{max_contact_samples}");
    }
}

/// Bytes of a tensor after a change, in a file whose hash fits; `None` leaves the tensor out.
fn changed(name: &str, change: impl Fn(&[u8]) -> Option<Vec<u8>>) -> Vec<u8> {
    let mut file = EditableRecording::new(BALL).expect("a recording");
    file.tensors.retain_mut(|tensor| {
        if tensor.name != name {
            return true;
        }
        let Some(bytes) = change(&tensor.bytes) else { return false };
        tensor.shape[0] = tensor.shape[0] * bytes.len() / tensor.bytes.len();
        tensor.bytes = bytes;
        true
    });
    file.to_bytes().expect("a container")
}

/// A change of the u32 at an index; from the end where it is negative.
fn with_u32(at: isize, value: u32) -> impl Fn(&[u8]) -> Option<Vec<u8>> {
    move |bytes| {
        let mut bytes = bytes.to_vec();
        let start = (4 * at).rem_euclid(bytes.len() as isize) as usize;
        bytes[start..start + 4].copy_from_slice(&value.to_le_bytes());
        Some(bytes)
    }
}

fn with_f64(at: usize, value: f64) -> impl Fn(&[u8]) -> Option<Vec<u8>> {
    move |bytes| {
        let mut bytes = bytes.to_vec();
        bytes[8 * at..8 * at + 8].copy_from_slice(&value.to_le_bytes());
        Some(bytes)
    }
}

#[test]
fn damaged_levels_are_refused_with_the_finding() {
    let same = |bytes: &[u8]| Some(bytes.to_vec());
    assert!(
        Recording::from_bytes(&changed("samples.nodes", same)) == Ok(ball()),
        "the hash is computed here"
    );
    let ball = ball();
    let (first, second) = (ball.sample_levels[0].nodes[0], ball.sample_levels[0].nodes[1]);
    let other = (0..).find(|node| !ball.sample_levels[0].nodes.contains(node)).expect("a node");
    let inner = ball.sample_levels[0].nodes.len();
    let offsets = "the offsets of the levels of contact samples do not fit together";
    let level = "level 0 of contact samples: ";
    let cases: [(Vec<u8>, String); 15] = [
        (
            changed("samples.nodes", with_u32(0, 42)),
            format!("{level}sample node 42 is beyond the surface's 42 nodes"),
        ),
        (
            changed("samples.nodes", with_u32(0, u32::MAX)),
            format!("{level}sample node 4294967295 is beyond the surface's 42 nodes"),
        ),
        (changed("samples.nodes", with_u32(0, second)), format!("{level}node {second} is a sample twice")),
        (
            changed("samples.triangles", with_u32(0, u32::MAX)),
            format!("{level}triangle 0 names node 4294967295, which is no sample"),
        ),
        (
            changed("samples.triangles", with_u32(0, other)),
            format!("{level}triangle 0 names node {other}, which is no sample"),
        ),
        (changed("samples.offsets", with_u32(0, 1)), offsets.into()),
        (changed("samples.offsets", with_u32(1, u32::MAX)), offsets.into()),
        (changed("samples.offsets", with_u32(-1, u32::MAX)), offsets.into()),
        (changed("samples.triangle_offsets", with_u32(-1, 1)), offsets.into()),
        (
            changed("samples.offsets", with_u32(1, 0)),
            format!("{level}0 samples, expected 1 or more and below 42"),
        ),
        (
            changed("samples.spacings", with_f64(0, f64::NAN)),
            format!("{level}the spacing is NaN m, expected a finite number above 0e0"),
        ),
        (
            changed("samples.spacings", with_f64(0, -0.01)),
            format!("{level}the spacing is -1e-2 m, expected a finite number above 0e0"),
        ),
        (
            changed("samples.spacings", with_f64(0, 1e300)),
            format!("{level}the spacing is 1e300 m, expected a finite number above 0e0"),
        ),
        (
            changed("samples.spacings", with_f64(0, 0.001)),
            "the certificate states other levels of contact samples than the recording holds".into(),
        ),
        (changed("samples.triangles", |_| None), "the tensor samples.triangles is missing".into()),
    ];
    for (bytes, expected) in cases {
        let refusal = Recording::from_bytes(&bytes).expect_err(&expected);
        assert_eq!(refusal.to_string(), format!("not a usable recording: {expected}"));
    }
    let short = changed("samples.offsets", |bytes| Some(bytes[4..].to_vec()));
    assert!(matches!(
        Recording::from_bytes(&short),
        Err(Error::Recording(RecordingError::WrongShape { .. }))
    ));
    let kind = |change: &dyn Fn(&mut Recording)| {
        let mut recording = ball.clone();
        change(&mut recording);
        match recording.validate() {
            Err(Error::Recording(RecordingError::Inconsistent { part, what })) => Some((part, what)),
            _ => None,
        }
    };
    let part = RecordingPart::SampleLevels;
    let what = format!("level 0 of contact samples: sample node {first} is a corner of no triangle");
    let found = kind(&|recording| {
        recording.sample_levels[0].triangles.retain(|corners| !corners.contains(&first));
    });
    assert_eq!(found, Some((part, what)));
    let what = format!("level 1 of contact samples: {inner} samples, expected 1 or more and below {inner}");
    let found = kind(&|recording| {
        let mut level = recording.sample_levels[0].clone();
        level.spacing *= 1.1;
        recording.sample_levels.insert(1, level);
    });
    assert_eq!(found, Some((part, what)));
    let what = "25 levels of contact samples, expected 24 at most".into();
    let found = kind(&|recording| {
        let level = recording.sample_levels[0].clone();
        recording.sample_levels = vec![level; 25];
    });
    assert_eq!(found, Some((part, what)));
}

#[test]
fn truncated_or_changed_file_with_levels_is_refused() {
    for length in (0..BALL.len()).step_by(7) {
        assert!(Recording::from_bytes(&BALL[..length]).is_err(), "cut to {length} bytes");
    }
    let mut bytes = BALL.to_vec();
    for at in (0..bytes.len()).step_by(7) {
        bytes[at] ^= 0x11;
        assert!(Recording::from_bytes(&bytes).is_err(), "byte {at}");
        bytes[at] ^= 0x11;
    }
}

/// Largest difference of the floor's force on contact samples and on all nodes, of the greater: samples support the end of a block a little
/// farther in than its edge.
const SAMPLED_FORCE_ERROR: f64 = 0.3;

/// Sag beyond the modes per acceleration and distance from the fixed end [s²/m].
const SAG_S2_M: f64 = 5e-4;

#[test]
fn a_fixed_body_sags_onto_a_floor_with_contact_samples_as_with_all_nodes() {
    // Held at one end, 1 µm above the floor: beyond its modes it sags by a millimetre at the other end.
    let mut recording = subdivided(&fixed_block(), 1);
    let low_x = recording.surface.extent().0.x;
    let sag = |position: &DVec3| [0.0, 0.0, 0.0, 0.0, SAG_S2_M * (position.x - low_x), 0.0, 0.0, 0.0, 0.0];
    let modal_forces = fixed_block().gravity.as_ref().expect("fixed nodes").modal_forces.clone();
    let residual_displacements = recording.surface.positions.iter().flat_map(sag).collect();
    recording.gravity = Some(GravityResponse { modal_forces, residual_displacements });
    let recording = Arc::new(recording);
    let low = -recording.surface.extent().0.y;
    let force = |max_contact_samples: usize| {
        let parameters = ModelParameters {
            gravity: DVec3::Y * -9.81,
            obstacles: vec![floor(0.5)],
            max_contact_samples,
            ..ModelParameters::for_reference()
        };
        let start = ObjectStart {
            pose: Pose { position: DVec3::Y * (low + 1e-6), ..Pose::IDENTITY },
            twist: Twist::ZERO,
        };
        let model =
            Model::new(parameters, vec![ModelObject::new(recording.clone(), start)]).expect("a model");
        let mut state = State::new(&model);
        let mut sum = 0.0;
        for _ in 0..500 {
            let output = step(&model, &mut state, &Input::default());
            sum += output.contacts.iter().map(|contact| contact.force.y).sum::<f64>() / 500.0;
        }
        sum
    };
    let all = force(usize::MAX);
    for max_contact_samples in MIN_CONTACT_SAMPLES..16 {
        let sampled = force(max_contact_samples);
        println!("{sampled} N on {max_contact_samples} contact samples at most, {all} N on all nodes");
        assert!(sampled > 0.0 && all > 0.0, "{sampled} {all}");
        assert!((sampled - all).abs() < SAMPLED_FORCE_ERROR * all.max(sampled), "{sampled} {all}");
    }
}
