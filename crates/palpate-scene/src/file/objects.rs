//! `[[object]]`: elastic bodies.

use super::keys::{Numbers, ObjectEntry};
use super::source::Source;
use super::tables;
use crate::error::{SceneError, SceneErrorKind};
use crate::recording_file::read_recording;
use crate::warning::{Warning, WarningKind};
use glam::{DQuat, DVec3};
use palpate::{
    Certificate, InitialDeformation, Material, ModelObject, ObjectStart, Pose, Recording, ResponseForm,
    Support, Twist,
};
use palpate_haptics::{Columns, MotionPath};
use std::sync::Arc;

pub(super) fn read_object(source: &Source, object: &ObjectEntry) -> Result<ModelObject, SceneError> {
    let (recording, response) = read_responses(source, object)?;
    let path = read_base_path(source, object, (&recording, &response))?;
    let given =
        object.position.as_ref().map_or(DVec3::ZERO, |position| DVec3::from_array(position.get_ref().0));
    let position = path.map_or(given, |path| path.at(0.0).position);
    let [w, x, y, z] = object.orientation.map_or([1.0, 0.0, 0.0, 0.0], |given| given.0);
    let vector = |given: Option<Numbers<3>>| given.map_or(DVec3::ZERO, |given| DVec3::from_array(given.0));
    let start = ObjectStart {
        pose: Pose { position, orientation: DQuat::from_xyzw(x, y, z, w) },
        twist: Twist { linear: vector(object.velocity), angular: vector(object.angular_velocity) },
    };
    let deformations =
        [("undeformed", InitialDeformation::Undeformed), ("equilibrium", InitialDeformation::Equilibrium)];
    let deformation = source.word("start", object.start.as_ref(), deformations)?;
    let friction = source.friction(object.friction.as_ref())?;
    Ok(ModelObject { recording, response, start, deformation, friction })
}

/// Path of the base of an object with fixed nodes, if it moves.
pub(super) fn read_base_path(
    source: &Source,
    object: &ObjectEntry,
    (recording, response): (&Recording, &ResponseForm),
) -> Result<Option<MotionPath>, SceneError> {
    let Some(entry) = &object.path else { return Ok(None) };
    let fail = |message: &str| {
        source.fail(
            entry.file.span(),
            SceneErrorKind::Conflict,
            "path",
            format!("object {:?}: {message}", object.name.get_ref()),
        )
    };
    if let Some(position) = &object.position {
        let message = "the position is in the path: leave one of the two out";
        return source.fail(position.span(), SceneErrorKind::Conflict, "position", message);
    }
    if recording.metadata.support != Support::Fixed {
        return fail(
            "only a body with fixed nodes has a base that follows a path: record it with --fix, or drive a free one by a clamp",
        );
    }
    if !matches!(response, ResponseForm::Modal) {
        return fail("a base that moves needs response = \"modal\"");
    }
    let path = source.motion_path(entry, Columns::Pose)?;
    if path.has_orientations() {
        return fail(
            "a base follows a path without rotation: give the columns t,x,y,z, or drive a free body by a clamp, which may turn",
        );
    }
    Ok(Some(path))
}

/// Recording and form of the response: from a recording file, a store of impulse responses, or both.
fn read_responses(
    source: &Source,
    object: &ObjectEntry,
) -> Result<(Arc<Recording>, ResponseForm), SceneError> {
    let path = source.stored_path(object.recording.get_ref());
    let span = object.recording.span();
    let form = object.response.as_ref().map(|form| (form.get_ref().as_str(), form.span()));
    let fir = match form {
        None => path.is_dir(),
        Some(("modal", _)) if path.is_dir() => {
            return source.fail(
                span,
                SceneErrorKind::Recording,
                "response",
                "response = \"modal\" needs a recording file (.palp); this is a store of impulse responses",
            );
        }
        Some(("modal", _)) => false,
        Some(("fir", _)) => true,
        Some((other, span)) => {
            let message = format!("response is {other:?}, expected \"modal\" or \"fir\"");
            return source.fail(span, SceneErrorKind::UnknownValue, "response", message);
        }
    };
    if let (Some(table), false) = (&object.table, fir) {
        let message = "a table is used with response = \"fir\" only";
        return source.fail(table.span(), SceneErrorKind::Conflict, "table", message);
    }
    let read_recording = || match source.parts.recordings.get(object.recording.get_ref()) {
        Some(recording) => Ok(Arc::clone(recording)),
        None => read_recording(&path)
            .map(Arc::new)
            .or_else(|error| source.fail(span.clone(), SceneErrorKind::Recording, "recording", error)),
    };
    if !fir {
        return Ok((read_recording()?, ResponseForm::Modal));
    }
    tables::read_table(source, object, read_recording)
}

/// Remarks on recordings whose certificates state a large force error.
pub(super) fn doubtful_recordings<'a>(
    objects: &'a [ModelObject],
    names: &'a [String],
) -> impl Iterator<Item = Warning> + 'a {
    objects.iter().zip(names).filter_map(move |(object, name)| {
        let certificate = object.recording.metadata.certificate.as_ref()?;
        let error = certificate.force_error_max;
        (error > Certificate::FORCE_ERROR_WARNING).then(|| {
            let (low, high) = object.recording.surface.extent();
            let size = (high - low).max_element();
            let sags = |material: &Material| material.sag(size) > 1.0;
            let advice = if object.recording.metadata.materials.iter().all(sags) {
                "it would sag by more than its size under its own weight: are its size in metres and its Young's modulus in Pa?"
            } else {
                "record it with more modes"
            };
            let message = format!(
                "even in a smooth press at one place the force of {name:?} is off by up to {:.0} % (certificate of its \
                 recording): {advice}",
                100.0 * error
            );
            Warning::new(WarningKind::ForceError, name, message)
        })
    })
}
