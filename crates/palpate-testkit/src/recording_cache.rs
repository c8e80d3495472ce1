//! Recordings that are made once per process.

use palpate::Recording;
use palpate_fem::{RecordError, RecordParameters, RecordedBody, SilentProgress};
use palpate_mesh::Mesh;
use std::collections::HashMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// One recording; its lock is held while it is made, so that whoever needs it waits for it.
type Entry = Arc<Mutex<Option<Arc<Recording>>>>;

/// Recordings by the hash of what they are made of.
static RECORDINGS: OnceLock<Mutex<HashMap<u64, Entry>>> = OnceLock::new();

/// Record a mesh without progress messages, with all that is known of the body.
///
/// # Errors
/// As [`RecordedBody::new`].
pub fn recorded(mesh: Mesh, parameters: &RecordParameters) -> Result<RecordedBody, RecordError> {
    RecordedBody::new(mesh, parameters, &mut SilentProgress)
}

/// The recording of a mesh; the same mesh with the same parameters is recorded once per process.
///
/// # Errors
/// As [`RecordedBody::new`]. What has failed is tried again.
pub(crate) fn recorded_once(
    mesh: Mesh,
    parameters: &RecordParameters,
) -> Result<Arc<Recording>, RecordError> {
    let entry: Entry = {
        let all = RECORDINGS.get_or_init(Mutex::default);
        let mut all = all.lock().unwrap_or_else(PoisonError::into_inner);
        all.entry(fingerprint(&mesh, parameters)).or_default().clone()
    };
    let mut entry = entry.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(recording) = entry.as_ref() {
        return Ok(recording.clone());
    }
    let recording = Arc::new(recorded(mesh, parameters)?.recording);
    *entry = Some(recording.clone());
    Ok(recording)
}

/// Hash of all that a recording follows from: every field, also those that come later.
fn fingerprint(mesh: &Mesh, parameters: &RecordParameters) -> u64 {
    let mut hasher = DefaultHasher::new();
    format!("{mesh:?} {parameters:?}").hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use crate::PAPER_MATERIAL;
    use palpate_fem::ElementOrder;
    use palpate_mesh::{ball_mesh, box_mesh};
    use std::sync::Arc;

    #[test]
    fn a_body_is_recorded_once_and_another_one_is_another() {
        let body = |cells, modes| {
            let mesh = box_mesh([0.1; 3], [cells; 3]).expect("a good box");
            PAPER_MATERIAL.free_body(mesh, ElementOrder::Linear, modes).expect("a good body")
        };
        assert!(Arc::ptr_eq(&body(2, 10), &body(2, 10)));
        assert!(!Arc::ptr_eq(&body(2, 10), &body(2, 11)));
        assert!(!Arc::ptr_eq(&body(2, 10), &body(3, 10)));
    }

    #[test]
    fn bodies_that_differ_by_the_curves_of_their_edges_are_different_bodies() {
        let curved = ball_mesh(0.05, 2).expect("a good ball");
        let mut straight = curved.clone();
        straight.straighten();
        let body = |mesh| PAPER_MATERIAL.free_body(mesh, ElementOrder::Quadratic, 10).expect("a good body");
        assert!(body(curved).mass() > body(straight).mass());
    }
}
