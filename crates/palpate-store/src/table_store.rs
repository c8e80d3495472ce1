//! Store of one table, written shard by shard.

use crate::arrays::{is_store_key, open_array, read_content, table_array, write_side_arrays};
use crate::attributes::{Number, STORE_VERSION, TableAttributes, TableContent};
use crate::error::{StoreError, StoreOperation};
use crate::location::Location;
use crate::object_storage::ObjectStorage;
use serde_json::Value;
use std::ops::Range;
use std::sync::Arc;
use zarrs::array::{Array, CodecOptions};
use zarrs::group::{Group, GroupBuilder};

/// Share K of N of the work: the shards with number K, K + N, K + 2N, …
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// Number K of the share, from 1 to N (0 stands for N).
    pub number: usize,
    /// Number N of shares, at least 1.
    pub of: usize,
}

/// Store of one table.
pub struct TableStore {
    location: Location,
    content: TableContent,
    storage: Arc<ObjectStorage>,
    array: Array<ObjectStorage>,
}

impl Part {
    /// All shards.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// Whether a shard belongs to the share.
    pub fn holds(self, shard: usize) -> bool {
        shard % self.of == self.number % self.of
    }
}

impl TableStore {
    /// Makes a store, or opens the existing one of the same table, whose compression then counts. `gravity` computes
    /// [`TableContent::gravity`] for a new store.
    ///
    /// # Errors
    /// [`StoreError`] when the location cannot be written, or holds another table or other files.
    pub fn create(
        location: &Location,
        mut content: TableContent,
        gravity: impl FnOnce() -> Option<Vec<f64>>,
    ) -> Result<Self, StoreError> {
        if let Some(existing) = Self::open_existing(location)? {
            return match existing.content.difference(&content) {
                None => Ok(existing),
                Some(difference) => {
                    Err(StoreError::OtherTable { location: location.to_string(), difference })
                }
            };
        }
        let storage = Arc::new(location.storage(true)?);
        let others = storage.list("")?;
        if let Some(other) = others.first().filter(|other| !is_store_key(&other.key)) {
            return Err(StoreError::NotEmpty { location: location.to_string(), found: other.key.clone() });
        }
        let failed = |reason: &dyn std::fmt::Display| StoreError::Access {
            operation: StoreOperation::Write,
            location: location.to_string(),
            reason: reason.to_string(),
        };
        content.gravity = gravity();
        let array = table_array(&content, storage.clone()).map_err(|e| failed(&e))?;
        write_side_arrays(&content, &storage).map_err(|e| failed(&e))?;
        array.store_metadata().map_err(|e| failed(&e))?;
        // The group is written last and marks a completely created store.
        let attributes = serde_json::to_value(&content.attributes).map_err(|e| failed(&e))?;
        let group = GroupBuilder::new()
            .attributes(attributes.as_object().cloned().unwrap_or_default())
            .build(storage, "/")
            .map_err(|e| failed(&e))?;
        group.store_metadata().map_err(|e| failed(&e))?;
        Self::open(location)
    }

    /// Opens a store.
    ///
    /// # Errors
    /// [`StoreError`] when there is no store, or its metadata or arrays cannot be read.
    pub fn open(location: &Location) -> Result<Self, StoreError> {
        Self::open_existing(location)?.ok_or_else(|| StoreError::NotFound { location: location.to_string() })
    }

    fn open_existing(location: &Location) -> Result<Option<Self>, StoreError> {
        if location.folder().is_some_and(|folder| !folder.exists()) {
            return Ok(None);
        }
        let storage = Arc::new(location.storage(false)?);
        if !storage.list("")?.iter().any(|found| found.key == "zarr.json") {
            return Ok(None);
        }
        let invalid = |reason: String| StoreError::Invalid { location: location.to_string(), reason };
        let group = Group::open(storage.clone(), "/").map_err(|e| invalid(e.to_string()))?;
        let attributes = Value::Object(group.attributes().clone());
        let version = attributes.get("store_version").and_then(Value::as_u64);
        if version != Some(u64::from(STORE_VERSION)) {
            return Err(match version {
                Some(version) => {
                    StoreError::Version { location: location.to_string(), version, supported: STORE_VERSION }
                }
                None => invalid("a Zarr group, but not one that palpate wrote".into()),
            });
        }
        let attributes: TableAttributes =
            serde_json::from_value(attributes).map_err(|e| invalid(format!("its attributes: {e}")))?;
        let array = open_array(&storage).map_err(|e| invalid(e.to_string()))?;
        let content = read_content(attributes, &array, &storage).map_err(invalid)?;
        Ok(Some(Self { location: location.clone(), content, storage, array }))
    }

    /// Content without the numbers of the table.
    pub fn content(&self) -> &TableContent {
        &self.content
    }

    /// Location of the store.
    pub fn location(&self) -> &Location {
        &self.location
    }

    /// Number of shards.
    pub fn shards(&self) -> usize {
        self.content.touchable_dofs.len().div_ceil(self.columns_per_shard())
    }

    fn columns_per_shard(&self) -> usize {
        (self.content.attributes.columns_per_shard as usize).max(1)
    }

    /// Columns of a shard.
    pub fn columns_of(&self, shard: usize) -> Range<usize> {
        let width = self.columns_per_shard();
        let end = self.content.touchable_dofs.len();
        shard.saturating_mul(width).min(end)..(shard + 1).saturating_mul(width).min(end)
    }

    /// Size of each shard [bytes]; none for a missing shard.
    ///
    /// # Errors
    /// [`StoreError::Access`] when the store cannot be listed.
    pub fn present(&self) -> Result<Vec<Option<u64>>, StoreError> {
        let mut present = vec![None; self.shards()];
        for found in self.storage.list("impulse_response/c")? {
            let shard =
                found.key.strip_prefix("impulse_response/c/").and_then(|key| key.strip_suffix("/0/0"));
            if let Some(slot) = shard.and_then(|s| s.parse::<usize>().ok()).and_then(|s| present.get_mut(s)) {
                *slot = Some(found.bytes);
            }
        }
        Ok(present)
    }

    /// Missing shards of a share.
    ///
    /// # Errors
    /// [`StoreError::Access`] when the store cannot be listed.
    pub fn missing(&self, part: Part) -> Result<Vec<usize>, StoreError> {
        let present = self.present()?;
        Ok((0..self.shards()).filter(|&shard| part.holds(shard) && present[shard].is_none()).collect())
    }

    /// Writes one shard at once; its columns in order.
    ///
    /// # Errors
    /// [`StoreError::WriteShard`]; the store is then as it was before.
    pub fn write_shard(&self, shard: usize, columns: Vec<Vec<f64>>) -> Result<(), StoreError> {
        // The last shard is padded with NaN, the fill value, which is not stored.
        let length = self.columns_per_shard() * self.content.column_length();
        let place = [shard as u64, 0, 0];
        let options = CodecOptions::default();
        let written = match self.content.number {
            Number::F32 => {
                let mut values = Vec::with_capacity(length);
                columns.into_iter().for_each(|column| values.extend(column.into_iter().map(|v| v as f32)));
                values.resize(length, f32::NAN);
                self.array.store_chunk_opt(&place, values, &options)
            }
            Number::F64 => {
                let mut values = Vec::with_capacity(length);
                columns.into_iter().for_each(|column| values.extend(column));
                values.resize(length, f64::NAN);
                self.array.store_chunk_opt(&place, values, &options)
            }
        };
        match written {
            Ok(()) => Ok(()),
            // Another run wrote the same shard meanwhile.
            Err(_) if self.present().is_ok_and(|present| present[shard].is_some()) => Ok(()),
            Err(e) => Err(StoreError::WriteShard { shard, reason: e.to_string() }),
        }
    }

    /// Removes temporary files of interrupted writers from a finished store.
    ///
    /// # Errors
    /// [`StoreError::ReadFile`] when a folder cannot be read.
    pub fn tidy(&self) -> Result<(), StoreError> {
        let Some(folder) = self.location.folder() else { return Ok(()) };
        if !self.missing(Part::ALL)?.is_empty() {
            return Ok(());
        }
        let mut folders = vec![folder.to_path_buf()];
        while let Some(folder) = folders.pop() {
            let failed = |source| StoreError::ReadFile { path: folder.clone(), source };
            for entry in std::fs::read_dir(&folder).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                if entry.file_type().map_err(failed)?.is_dir() {
                    folders.push(entry.path());
                } else if is_unfinished(&entry.file_name().to_string_lossy()) {
                    let _ = std::fs::remove_file(entry.path());
                }
            }
        }
        Ok(())
    }

    /// Error of a damaged shard.
    pub(crate) fn damaged(&self, shard: usize, reason: &str) -> StoreError {
        let key = format!("{}/impulse_response/c/{shard}/0/0", self.location);
        StoreError::Damaged { shard, key, reason: reason.into() }
    }

    pub(crate) fn storage(&self) -> &ObjectStorage {
        &self.storage
    }

    /// Zarr array of the table.
    pub(crate) fn array(&self) -> &Array<ObjectStorage> {
        &self.array
    }
}

/// Whether a file is a temporary one of a writer, with a name like `zarr.json#1`.
fn is_unfinished(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, count)| !count.is_empty() && count.bytes().all(|b| b.is_ascii_digit()))
}
