//! Tables of impulse responses of objects.

use super::keys::ObjectEntry;
use super::source::Source;
use crate::error::{SceneError, SceneErrorKind};
#[cfg(feature = "native")]
use crate::tables::check_room;
use crate::warning::{Warning, WarningKind};
use palpate::{ModelObject, Recording, ResponseForm};
#[cfg(feature = "native")]
use palpate_store::{Location, TableStore};
#[cfg(feature = "native")]
use std::path::Path;
use std::sync::Arc;

/// Table of an object with `response = "fir"`, with its body, or with that of the object's recording.
#[cfg(feature = "native")]
pub(super) fn read_table(
    source: &Source,
    object: &ObjectEntry,
    read_recording: impl FnOnce() -> Result<Arc<Recording>, SceneError>,
) -> Result<(Arc<Recording>, ResponseForm), SceneError> {
    let span = object.recording.span();
    let path = source.stored_path(object.recording.get_ref());
    let (table, table_span) = match &object.table {
        Some(table) => (table_location(source, table.get_ref()), table.span()),
        None if path.is_dir() => (Location::Folder(path.clone()), span),
        None => (Location::Folder(path.with_extension("zarr")), span),
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

/// Refusal of a table where there is no store.
#[cfg(not(feature = "native"))]
pub(super) fn read_table(
    source: &Source,
    object: &ObjectEntry,
    _: impl FnOnce() -> Result<Arc<Recording>, SceneError>,
) -> Result<(Arc<Recording>, ResponseForm), SceneError> {
    let message = "tables of impulse responses are not read here: use response = \"modal\"";
    source.fail(object.recording.span(), SceneErrorKind::Table, "response", message)
}

/// Location of a table as the scene names it: a folder, relative to the scene file, or an address.
#[cfg(feature = "native")]
fn table_location(source: &Source, named: &Path) -> Location {
    match Location::parse(&named.to_string_lossy()) {
        Location::Folder(_) => Location::Folder(source.stored_path(named)),
        address => address,
    }
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
#[cfg(feature = "native")]
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
