//! A store that is written shard by shard, and read.

use crate::arrays::{is_ours, open_array, read_content, table_array, write_side_arrays};
use crate::attributes::{Number, STORE_VERSION, TableAttributes, TableContent};
use crate::error::StoreError;
use crate::location::Location;
use crate::mapped::MappedColumns;
use crate::object_storage::ObjectStorage;
use palpate::{GravityResponse, ImpulseResponse, ModalBasis, Recording, ResidualCompliance};
use serde_json::Value;
use std::ops::Range;
use std::sync::Arc;
use zarrs::array::{Array, CodecOptions};
use zarrs::group::{Group, GroupBuilder};

/// Which shards one of several machines writes: those with number K, K + N, K + 2N, …
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Part {
    /// K, from 1 to N (0 stands for N).
    pub number: usize,
    /// N, at least 1.
    pub of: usize,
}

/// A store of one table.
pub struct TableStore {
    location: Location,
    content: TableContent,
    storage: Arc<ObjectStorage>,
    array: Array<ObjectStorage>,
}

impl Part {
    /// Everything.
    pub const ALL: Self = Self { number: 1, of: 1 };

    /// Whether a shard belongs to it.
    pub fn holds(self, shard: usize) -> bool {
        shard % self.of == self.number % self.of
    }
}

impl TableStore {
    /// Make a store, or open the one that stands there if it is of the same table; its way of packing then counts.
    /// `gravity` gives [`TableContent::gravity`] for a new one.
    ///
    /// # Errors
    /// When the place can't be written, or what stands there is another table: the text says which difference.
    pub fn create(
        location: &Location,
        mut content: TableContent,
        gravity: impl FnOnce() -> Option<Vec<f64>>,
    ) -> Result<Self, StoreError> {
        if let Some(standing) = Self::open_if_there(location)? {
            return match standing.content.difference(&content) {
                None => Ok(standing),
                Some(difference) => Err(StoreError::Content(format!(
                    "the store {location} holds another table: {difference}. Give another name, or remove it"
                ))),
            };
        }
        let storage = Arc::new(location.storage(true)?);
        let others = storage.list("")?;
        if let Some(other) = others.first().filter(|other| !is_ours(&other.key)) {
            return Err(StoreError::Place(format!(
                "{location} is not empty and no store of impulse responses (it holds {}): give another name",
                other.key
            )));
        }
        let failed =
            |e: &dyn std::fmt::Display| StoreError::Place(format!("cannot write the store {location}: {e}"));
        content.gravity = gravity();
        let array = table_array(&content, storage.clone()).map_err(|e| failed(&e))?;
        write_side_arrays(&content, &storage).map_err(|e| failed(&e))?;
        array.store_metadata().map_err(|e| failed(&e))?;
        // The group comes last: a store without it was never finished being made.
        let attributes = serde_json::to_value(&content.attributes).map_err(|e| failed(&e))?;
        let group = GroupBuilder::new()
            .attributes(attributes.as_object().cloned().unwrap_or_default())
            .build(storage, "/")
            .map_err(|e| failed(&e))?;
        group.store_metadata().map_err(|e| failed(&e))?;
        Self::open(location)
    }

    /// Open a store.
    ///
    /// # Errors
    /// When there is none, or it is damaged, or no table of palpate.
    pub fn open(location: &Location) -> Result<Self, StoreError> {
        let nothing = || StoreError::Place(format!("{location}: there is no store of impulse responses"));
        Self::open_if_there(location)?.ok_or_else(nothing)
    }

    fn open_if_there(location: &Location) -> Result<Option<Self>, StoreError> {
        if location.folder().is_some_and(|folder| !folder.exists()) {
            return Ok(None);
        }
        let storage = Arc::new(location.storage(false)?);
        if !storage.list("")?.iter().any(|found| found.key == "zarr.json") {
            return Ok(None);
        }
        let bad = |what: String| {
            StoreError::Content(format!("{location} is no usable store of impulse responses: {what}"))
        };
        let group = Group::open(storage.clone(), "/").map_err(|e| bad(e.to_string()))?;
        let attributes = Value::Object(group.attributes().clone());
        let version = attributes.get("store_version").and_then(Value::as_u64);
        if version != Some(u64::from(STORE_VERSION)) {
            return Err(bad(match version {
                Some(version) => format!(
                    "its version is {version}, this palpate reads {STORE_VERSION}: record it again or use a newer palpate"
                ),
                None => "a Zarr group, but not one that palpate wrote".into(),
            }));
        }
        let attributes: TableAttributes =
            serde_json::from_value(attributes).map_err(|e| bad(format!("its attributes: {e}")))?;
        let array = open_array(&storage).map_err(|e| bad(e.to_string()))?;
        let content = read_content(attributes, &array, &storage).map_err(bad)?;
        Ok(Some(Self { location: location.clone(), content, storage, array }))
    }

    /// Everything but the numbers.
    pub fn content(&self) -> &TableContent {
        &self.content
    }

    /// Where it lies.
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
        shard * width..((shard + 1) * width).min(self.content.touchable_dofs.len())
    }

    /// Length [bytes] of each shard that is there.
    ///
    /// # Errors
    /// When the store can't be listed.
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

    /// Shards of a part that are still to be written.
    ///
    /// # Errors
    /// When the store can't be listed.
    pub fn missing(&self, part: Part) -> Result<Vec<usize>, StoreError> {
        let present = self.present()?;
        Ok((0..self.shards()).filter(|&shard| part.holds(shard) && present[shard].is_none()).collect())
    }

    /// Write one shard at once; its columns in order.
    ///
    /// # Errors
    /// When it can't be written: the store stays as it was.
    pub fn write_shard(&self, shard: usize, columns: Vec<Vec<f64>>) -> Result<(), StoreError> {
        // The last shard is filled up with NaN, the fill value, which is not stored.
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
            Err(e) => Err(StoreError::Place(format!(
                "{e}. What is finished is kept: make room or repair the cause, then run the same command again"
            ))),
        }
    }

    /// Remove what interrupted writers left beside the files of the store, once it is finished.
    ///
    /// # Errors
    /// When a folder of it can't be read.
    pub fn tidy(&self) -> Result<(), StoreError> {
        let Some(folder) = self.location.folder() else { return Ok(()) };
        if !self.missing(Part::ALL)?.is_empty() {
            return Ok(());
        }
        let mut waiting = vec![folder.to_path_buf()];
        while let Some(place) = waiting.pop() {
            let failed =
                |e: std::io::Error| StoreError::Place(format!("cannot read {}: {e}", place.display()));
            for entry in std::fs::read_dir(&place).map_err(failed)? {
                let entry = entry.map_err(failed)?;
                if entry.file_type().map_err(failed)?.is_dir() {
                    waiting.push(entry.path());
                } else if is_unfinished(&entry.file_name().to_string_lossy()) {
                    let _ = std::fs::remove_file(entry.path());
                }
            }
        }
        Ok(())
    }

    /// Read a whole shard and check its checksums, and that it holds numbers.
    ///
    /// # Errors
    /// [`StoreError::Damaged`].
    pub fn check_shard(&self, shard: usize) -> Result<(), StoreError> {
        let place = [shard as u64, 0, 0];
        let used = self.columns_of(shard).len() * self.content.column_length();
        let whole = match self.content.number {
            Number::F32 => self
                .array
                .retrieve_chunk::<Vec<f32>>(&place)
                .map(|values| values[..used.min(values.len())].iter().all(|v| v.is_finite())),
            Number::F64 => self
                .array
                .retrieve_chunk::<Vec<f64>>(&place)
                .map(|values| values[..used.min(values.len())].iter().all(|v| v.is_finite())),
        };
        match whole {
            Ok(true) => Ok(()),
            Ok(false) => Err(self.damaged(shard, "columns are missing in it or hold no numbers")),
            Err(error) => Err(self.damaged(shard, &error.to_string())),
        }
    }

    pub(crate) fn damaged(&self, shard: usize, why: &str) -> StoreError {
        let key = format!("{}/impulse_response/c/{shard}/0/0", self.location);
        StoreError::Damaged { shard, key, why: why.into() }
    }

    /// The body and its table, ready for a scene: shards are mapped into memory, columns read when they are used.
    ///
    /// # Errors
    /// When shards are missing, the store is not a folder of this machine, or its body makes no sense.
    pub fn load(self) -> Result<(Recording, ImpulseResponse), StoreError> {
        let missing = self.missing(Part::ALL)?.len();
        if missing > 0 {
            return Err(StoreError::Content(format!(
                "the store {} is not finished: {missing} of {} shards are missing. Record it to the end with the command \
                 that began it",
                self.location,
                self.shards()
            )));
        }
        let bad = |what: String| {
            StoreError::Content(format!("{} is no usable store of impulse responses: {what}", self.location))
        };
        let sampling =
            self.content.attributes.sampling().ok_or_else(|| bad("its sampling is unknown".into()))?;
        let recording = body(&self.content);
        recording.validate().map_err(|e| bad(e.to_string()))?;
        let content = self.content.clone();
        let columns = MappedColumns::new(self)?;
        let table = ImpulseResponse {
            step_s: content.attributes.step_s,
            samples: content.samples,
            sampling,
            touchable_dofs: content.touchable_dofs,
            observed_dofs: content.observed_dofs,
            gravity: content.gravity,
            columns: Box::new(columns),
        };
        Ok((recording, table))
    }

    pub(crate) fn array(&self) -> &Array<ObjectStorage> {
        &self.array
    }
}

/// Whether a file was being written: the writer's files have names like `zarr.json#1` until they are whole.
fn is_unfinished(name: &str) -> bool {
    name.rsplit_once('#')
        .is_some_and(|(_, count)| !count.is_empty() && count.bytes().all(|b| b.is_ascii_digit()))
}

/// The body as a recording without modes.
fn body(content: &TableContent) -> Recording {
    let fixed = content.attributes.recording.support == palpate::Support::Fixed;
    let nodes = content.surface.positions.len();
    Recording {
        metadata: content.attributes.recording.clone(),
        surface: content.surface.clone(),
        modes: ModalBasis { angular_frequencies: vec![], damping_ratios: vec![], mode_shapes: vec![] },
        residual: ResidualCompliance::None,
        gravity: fixed
            .then(|| GravityResponse { modal_forces: vec![], residual_displacements: vec![0.0; 9 * nodes] }),
    }
}
