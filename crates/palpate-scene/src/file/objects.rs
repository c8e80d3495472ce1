//! `[[object]]`: elastic bodies.

use super::keys::ObjectEntry;
use super::source::Source;
use crate::error::{SceneError, SceneErrorKind};
use crate::recording_file::read_recording;
use crate::tables::check_room;
use crate::warning::{Warning, WarningKind};
use glam::{DQuat, DVec3};
use palpate::{InitialDeformation, ModelObject, ObjectStart, Pose, Recording, ResponseForm, Support, Twist};
use palpate_fem::FORCE_ERROR_WARNING;
use palpate_haptics::{Columns, MotionPath};
use palpate_store::{Location, TableStore};
use std::path::Path;
use std::sync::Arc;

pub(super) fn read_object(source: &Source, object: &ObjectEntry) -> Result<ModelObject, SceneError> {
    let (recording, response) = read_responses(source, object)?;
    let path = read_base_path(source, object, (&recording, &response))?;
    let given =
        object.position.as_ref().map_or(DVec3::ZERO, |position| DVec3::from_array(position.get_ref().0));
    let position = path.map_or(given, |path| path.at(0.0).position);
    let [w, x, y, z] = object.orientation.0;
    let start = ObjectStart {
        pose: Pose { position, orientation: DQuat::from_xyzw(x, y, z, w) },
        twist: Twist {
            linear: DVec3::from_array(object.velocity.0),
            angular: DVec3::from_array(object.angular_velocity.0),
        },
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
    let (table, table_span) = match &object.table {
        Some(table) => (table_location(source, table.get_ref()), table.span()),
        None if path.is_dir() => (Location::Folder(path.clone()), span.clone()),
        None => (Location::Folder(path.with_extension("zarr")), span.clone()),
    };
    if table.folder().is_some_and(|folder| !folder.exists()) {
        return source.fail(
            table_span,
            SceneErrorKind::Table,
            "table",
            format!(
                "response = \"fir\" needs a store of impulse responses, and there is no {}: make one with `palpate record … \
                 --dense`, and name it with table = \"…\"",
                table
            ),
        );
    }
    let loaded = TableStore::open(&table).and_then(TableStore::load);
    let (body, table) =
        loaded.or_else(|error| source.fail(table_span.clone(), SceneErrorKind::Table, "table", error))?;
    let recording = if path.is_dir() {
        Arc::new(body)
    } else {
        let recording = read_recording()?;
        if recording.metadata.provenance.mesh_hash != body.metadata.provenance.mesh_hash {
            return source.fail(
                table_span,
                SceneErrorKind::Table,
                "table",
                format!(
                    "the store is of another mesh ({}) than the recording ({})",
                    body.metadata.provenance.source, recording.metadata.provenance.source
                ),
            );
        }
        recording
    };
    Ok((recording, ResponseForm::Fir(Arc::new(table))))
}

/// Location of a table as the scene names it: a folder, relative to the scene file, or an address.
fn table_location(source: &Source, named: &Path) -> Location {
    match Location::parse(&named.to_string_lossy()) {
        Location::Folder(_) => Location::Folder(source.stored_path(named)),
        address => address,
    }
}

/// Remarks on recordings whose certificates state a large force error.
pub(super) fn doubtful_recordings<'a>(
    objects: &'a [ModelObject],
    names: &'a [String],
) -> impl Iterator<Item = Warning> + 'a {
    objects.iter().zip(names).filter_map(move |(object, name)| {
        let certificate = object.recording.metadata.certificate.as_ref()?;
        let error = certificate.force_error_max;
        (error > FORCE_ERROR_WARNING).then(|| {
            let message = format!(
                "even in a smooth press at one place the force of {name:?} is off by up to {:.0} % (certificate of its \
                 recording): record it with more modes",
                100.0 * error
            );
            Warning::new(WarningKind::ForceError, name, message)
        })
    })
}

/// Amplitude of the slowest mode at the end of a table, from which there is a warning: in a hold the force is off by about as much [1].
const SHORT_TABLE: f64 = 0.02;

/// Warnings about tables that end before their bodies have come to rest.
pub(super) fn short_tables<'a>(
    objects: &'a [ModelObject],
    names: &'a [String],
) -> impl Iterator<Item = Warning> + 'a {
    objects.iter().zip(names).filter_map(|(object, name)| {
        let ResponseForm::Fir(table) = &object.response else { return None };
        let modes = &object.recording.modes;
        let rates = modes.angular_frequencies.iter().zip(&modes.damping_ratios);
        let slowest = rates.map(|(omega, zeta)| omega * zeta).fold(f64::INFINITY, f64::min);
        let duration = table.step_s * table.samples as f64;
        let left = (-slowest * duration).exp();
        (left > SHORT_TABLE && slowest.is_finite()).then(|| {
            let advice = if slowest > 0.0 {
                format!("record it with --duration {:.1}, or damp the body more", (1.0 / SHORT_TABLE).ln() / slowest)
            } else {
                "an undamped body needs response = \"modal\"".to_string()
            };
            let message = format!(
                "the table of {name:?} ends after {duration:.2} s, when the slowest mode still has {:.0} % of its amplitude: what a force \
                 does later is lost, and energy with it; {advice}",
                100.0 * left
            );
            Warning::new(WarningKind::ShortTable, name, message)
        })
    })
}

/// Loads the tables of a scene in which contacts may come anywhere, and warns of what they leave out.
pub(super) fn prepare_tables(
    source: &Source,
    entries: &[ObjectEntry],
    objects: &[ModelObject],
) -> Result<Vec<Warning>, SceneError> {
    let mut warnings = Vec::new();
    for (entry, object) in entries.iter().zip(objects) {
        let ResponseForm::Fir(table) = &object.response else { continue };
        let name = entry.name.get_ref();
        let fail = |message: String| source.fail(entry.name.span(), SceneErrorKind::Table, "table", message);
        if let Err(what) = check_room(name, table) {
            return fail(what);
        }
        if let Err(error) = table.prepare_all() {
            return fail(format!("the table of {name:?}: {error}"));
        }
        let (touchable, nodes) = table.touchable_share(&object.recording.surface);
        if touchable < nodes {
            let message = format!(
                "the table of {name:?} knows the response to forces at {touchable} of its {nodes} surface nodes: where something \
                 touches it elsewhere, it is rigid; record it with --touchable surface"
            );
            warnings.push(Warning::new(WarningKind::PartlyTouchable, name, message));
        }
        if object.recording.modes.is_empty() {
            let message = format!(
                "the table of {name:?} stands alone: contacts are searched for on its undeformed surface, and forces may be off by \
                 some per cent where it deforms much; name its recording too: recording = \"….palp\", table = \"….zarr\""
            );
            warnings.push(Warning::new(WarningKind::UndeformedSurface, name, message));
        }
    }
    Ok(warnings)
}
