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

/// A hash of all that a recording follows from.
fn fingerprint(mesh: &Mesh, parameters: &RecordParameters) -> u64 {
    let mut hasher = DefaultHasher::new();
    for node in &mesh.nodes {
        node.to_array().map(f64::to_bits).hash(&mut hasher);
    }
    mesh.tets.hash(&mut hasher);
    mesh.tet_regions.hash(&mut hasher);
    format!("{parameters:?}").hash(&mut hasher);
    hasher.finish()
}

#[cfg(test)]
mod tests {
    use crate::PAPER_MATERIAL;
    use palpate_fem::ElementOrder;
    use palpate_mesh::box_mesh;
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
}
