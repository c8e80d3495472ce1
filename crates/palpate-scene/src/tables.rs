//! Recorded tables of a scene, loaded before a device uses them.

use crate::error::{SceneError, SceneErrorKind};
use crate::scene::Scene;
use palpate::{DeviceMode, Error, ImpulseResponse, ModelError};
#[cfg(feature = "native")]
use palpate_fem::check_memory;

impl Scene {
    /// Check a mode that a program gives a device, and load what its steps need of recorded tables: the columns of a point that it holds or pushes,
    /// all of them for a tip. What is loaded already costs no reading.
    ///
    /// # Errors
    /// [`SceneErrorKind::Grasp`] for a point that cannot be held, [`SceneErrorKind::Table`] for a table that does not fit into memory or cannot
    /// be read.
    pub fn prepare_device(&self, device: usize, mode: &DeviceMode) -> Result<(), SceneError> {
        for (object, table) in self.model.whole_tables(device, mode) {
            check_room(&self.object_names[object], table)
                .map_err(|what| SceneError::new(SceneErrorKind::Table, what))?;
        }
        self.model.prepare_device(device, mode).map_err(|error| {
            let Error::Model(ModelError::Object { object, error: reason }) = &error else {
                return SceneError::new(SceneErrorKind::Grasp, error);
            };
            let kind = match &**reason {
                ModelError::ImpulseResponse { .. } => SceneErrorKind::Table,
                _ => SceneErrorKind::Grasp,
            };
            match self.object_names.get(*object) {
                Some(name) => SceneError::new(kind, format!("object {name:?}: {reason}")),
                None => SceneError::new(kind, error),
            }
        })
    }
}

/// Check that what is not loaded yet of a table fits into memory.
#[cfg(feature = "native")]
pub(crate) fn check_room(name: &str, table: &ImpulseResponse) -> Result<(), String> {
    check_memory(table.columns.missing_bytes() as f64).map_err(|error| {
        format!(
            "contacts may come anywhere on {name:?}, so that all of its table must be in memory: {error}; record it for fewer nodes \
             (--touchable), or use response = \"modal\""
        )
    })
}

/// Nothing: tables are not read without a file system.
#[cfg(not(feature = "native"))]
fn check_room(_: &str, _: &ImpulseResponse) -> Result<(), String> {
    Ok(())
}
