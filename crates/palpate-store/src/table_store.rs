//! A store that is written shard by shard, and read.

use crate::attributes::{Compression, Number, STORE_VERSION, TableAttributes, TableContent};
use crate::error::StoreError;
use crate::location::Location;
use crate::mapped::MappedColumns;
use crate::object_storage::ObjectStorage;
use glam::DVec3;
use palpate::{GravityResponse, ImpulseResponse, ModalBasis, Recording, ResidualCompliance, Surface};
use serde_json::{Map, Value, json};
use std::ops::Range;
use std::sync::Arc;
use zarrs::array::codec::{
    BloscCodec, BloscCompressionLevel, BloscCompressor, BloscShuffleMode, Crc32cCodec, ShardingCodecOptions,
    SubchunkWriteOrder,
    api::{BytesToBytesCodecTraits, CodecSpecificOptions},
};
use zarrs::array::{Array, ArrayBuilder, ArraySubset, CodecOptions, DataType, ElementOwned, data_type};
use zarrs::group::{Group, GroupBuilder};

/// The array of the table, in the store.
const TABLE: &str = "/impulse_response";

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
    ///
    /// # Errors
    /// When the place can't be written, or what stands there is another table: the text says which difference.
    pub fn create(location: &Location, content: &TableContent) -> Result<Self, StoreError> {
        if let Some(standing) = Self::open_if_there(location)? {
            return match standing.content.difference(content) {
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
        let array = table_array(content, storage.clone()).map_err(|e| failed(&e))?;
        write_side_arrays(content, &storage).map_err(|e| failed(&e))?;
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

    /// Remove what interrupted writers left beside the shards, once the store is finished.
    ///
    /// # Errors
    /// When the folder can't be read.
    pub fn tidy(&self) -> Result<(), StoreError> {
        let Some(folder) = self.location.folder() else { return Ok(()) };
        if !self.missing(Part::ALL)?.is_empty() {
            return Ok(());
        }
        for shard in 0..self.shards() {
            let place = folder.join(format!("impulse_response/c/{shard}/0"));
            let failed =
                |e: std::io::Error| StoreError::Place(format!("cannot read {}: {e}", place.display()));
            for entry in std::fs::read_dir(&place).map_err(failed)? {
                let path = entry.map_err(failed)?.path();
                // The writer's files have names like 0#1 until they are whole.
                if path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("0#")) {
                    let _ = std::fs::remove_file(path);
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

    /// Columns of some touchable degrees of freedom, decoded.
    ///
    /// # Errors
    /// When they can't be read.
    pub fn read_columns(&self, range: Range<usize>) -> Result<Vec<Vec<f64>>, StoreError> {
        let read = |touchable: usize| {
            let shape = [1, self.content.samples as u64, self.content.observed_dofs.len() as u64];
            let subset = ArraySubset::new_with_start_shape(vec![touchable as u64, 0, 0], shape.to_vec())
                .map_err(|e| self.damaged(touchable / self.columns_per_shard(), &e.to_string()))?;
            let numbers = match self.content.number {
                Number::F32 => self
                    .array
                    .retrieve_array_subset::<Vec<f32>>(&subset)
                    .map(|values| values.into_iter().map(f64::from).collect()),
                Number::F64 => self.array.retrieve_array_subset::<Vec<f64>>(&subset),
            };
            numbers.map_err(|e| self.damaged(touchable / self.columns_per_shard(), &e.to_string()))
        };
        range.map(read).collect()
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

/// Keys that a store may hold before its group is written: it was interrupted while being made.
fn is_ours(key: &str) -> bool {
    let folder = key.split('/').next().unwrap_or_default();
    folder == "impulse_response" || SIDE_ARRAYS.contains(&folder)
}

const SIDE_ARRAYS: [&str; 7] = [
    "touchable_dofs",
    "observed_dofs",
    "observed_positions",
    "surface_positions",
    "surface_triangles",
    "surface_source_nodes",
    "gravity_response",
];

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

type Anyhow = Box<dyn std::error::Error>;

fn table_array(content: &TableContent, storage: Arc<ObjectStorage>) -> Result<Array<ObjectStorage>, Anyhow> {
    let attributes = &content.attributes;
    let (samples, observed) = (content.samples as u64, content.observed_dofs.len() as u64);
    let shape = vec![content.touchable_dofs.len() as u64, samples, observed];
    let shard = vec![attributes.columns_per_shard, samples, observed];
    let mut builder = match content.number {
        Number::F32 => ArrayBuilder::new(shape, shard, data_type::float32(), f32::NAN),
        Number::F64 => ArrayBuilder::new(shape, shard, data_type::float64(), f64::NAN),
    };
    let mut codecs: Vec<Arc<dyn BytesToBytesCodecTraits>> = Vec::new();
    if attributes.compression == Compression::Zstd {
        let level =
            BloscCompressionLevel::try_from(1).map_err(|level| format!("compression level {level}"))?;
        let size = Some(content.number.bytes());
        codecs.push(Arc::new(BloscCodec::new(
            BloscCompressor::Zstd,
            level,
            None,
            BloscShuffleMode::Shuffle,
            size,
        )?));
    }
    codecs.push(Arc::new(Crc32cCodec::new()));
    let mut own = Map::new();
    own.insert("units".into(), json!("m/N"));
    own.insert("step_s".into(), json!(attributes.step_s));
    own.insert("sampling".into(), json!(attributes.sampling));
    own.insert("hold".into(), json!(attributes.recording.hold));
    own.insert("mesh_hash".into(), json!(attributes.recording.provenance.mesh_hash));
    builder
        .subchunk_shape(vec![1, samples, observed])
        .bytes_to_bytes_codecs(codecs)
        .attributes(own)
        .dimension_names(Some(["touchable_dof", "sample", "observed_dof"]));
    Ok(builder.build(storage, TABLE)?)
}

/// The table's array as it stands in a store, set to write the columns of a shard in their order, so that the same
/// table gives the same bytes.
fn open_array(storage: &Arc<ObjectStorage>) -> Result<Array<ObjectStorage>, Anyhow> {
    let array = Array::open(storage.clone(), TABLE)?;
    let order = ShardingCodecOptions::default().with_subchunk_write_order(SubchunkWriteOrder::C);
    let options = CodecSpecificOptions::default().with_option(order);
    Ok(array.with_codec_specific_options(&options))
}

fn write_side_arrays(content: &TableContent, storage: &Arc<ObjectStorage>) -> Result<(), Anyhow> {
    let surface = &content.surface;
    let positions: Vec<f64> = surface.positions.iter().flat_map(|p| p.to_array()).collect();
    let triangles: Vec<u32> = surface.triangles.iter().flatten().copied().collect();
    let (nodes, faces) = (positions.len() as u64 / 3, triangles.len() as u64 / 3);
    let list = |values: &[u32]| vec![values.len() as u64];
    let [touchable, observed, rest, places, corners, sources, gravity] = SIDE_ARRAYS;
    write_u32(storage, touchable, list(&content.touchable_dofs), &content.touchable_dofs, "3·node + axis")?;
    write_u32(storage, observed, list(&content.observed_dofs), &content.observed_dofs, "3·node + axis")?;
    let observed_rest: Vec<f64> = content.observed_positions.iter().flat_map(|p| p.to_array()).collect();
    let observed_nodes = content.observed_positions.len() as u64;
    write_f64(
        storage,
        rest,
        vec![observed_nodes, 3],
        &observed_rest,
        "m, body frame, of every observed node",
    )?;
    write_f64(storage, places, vec![nodes, 3], &positions, "m, body frame: origin at the centre of mass")?;
    write_u32(storage, corners, vec![faces, 3], &triangles, "surface nodes, counter-clockwise from outside")?;
    write_u32(storage, sources, list(&surface.source_nodes), &surface.source_nodes, "node of the mesh")?;
    if let Some(response) = &content.gravity {
        let shape = vec![3, content.samples as u64, content.observed_dofs.len() as u64];
        write_f64(storage, gravity, shape, response, "m per m/s² held for one step, along each axis")?;
    }
    Ok(())
}

fn write_u32(
    storage: &Arc<ObjectStorage>,
    name: &str,
    shape: Vec<u64>,
    values: &[u32],
    meaning: &str,
) -> Result<(), Anyhow> {
    write_array(storage, name, shape, data_type::uint32(), meaning, |array, place| {
        Ok(array.store_chunk_opt(
            place,
            values.to_vec(),
            &CodecOptions::default().with_store_empty_chunks(true),
        )?)
    })
}

fn write_f64(
    storage: &Arc<ObjectStorage>,
    name: &str,
    shape: Vec<u64>,
    values: &[f64],
    meaning: &str,
) -> Result<(), Anyhow> {
    write_array(storage, name, shape, data_type::float64(), meaning, |array, place| {
        Ok(array.store_chunk_opt(
            place,
            values.to_vec(),
            &CodecOptions::default().with_store_empty_chunks(true),
        )?)
    })
}

/// One chunk with a checksum.
fn write_array(
    storage: &Arc<ObjectStorage>,
    name: &str,
    shape: Vec<u64>,
    number: DataType,
    meaning: &str,
    store: impl Fn(&Array<ObjectStorage>, &[u64]) -> Result<(), Anyhow>,
) -> Result<(), Anyhow> {
    let mut attributes = Map::new();
    attributes.insert("meaning".into(), json!(meaning));
    let place = vec![0; shape.len()];
    let array = ArrayBuilder::new(shape.clone(), shape, number, 0)
        .bytes_to_bytes_codecs(vec![Arc::new(Crc32cCodec::new())])
        .attributes(attributes)
        .build(storage.clone(), &format!("/{name}"))?;
    store(&array, &place)?;
    array.store_metadata()?;
    Ok(())
}

fn read_array<T: ElementOwned>(storage: &Arc<ObjectStorage>, name: &str) -> Result<Vec<T>, String>
where
    Vec<T>: zarrs::array::FromArrayBytes,
{
    let said = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let array = Array::open(storage.clone(), &format!("/{name}")).map_err(|e| said(&e))?;
    array.retrieve_array_subset::<Vec<T>>(&array.subset_all()).map_err(|e| said(&e))
}

fn read_content(
    attributes: TableAttributes,
    array: &Array<ObjectStorage>,
    storage: &Arc<ObjectStorage>,
) -> Result<TableContent, String> {
    let number = match array.data_type() {
        t if *t == data_type::float32() => Number::F32,
        t if *t == data_type::float64() => Number::F64,
        other => return Err(format!("its numbers are {other:?}, expected float32 or float64")),
    };
    let shape = array.shape().to_vec();
    let &[touchable, samples, observed] = shape.as_slice() else {
        return Err(format!("its table has {} dimensions, expected 3", shape.len()));
    };
    let [touchables, observeds, rest, places, corners, sources, gravity] = SIDE_ARRAYS;
    let touchable_dofs: Vec<u32> = read_array(storage, touchables)?;
    let observed_dofs: Vec<u32> = read_array(storage, observeds)?;
    if touchable_dofs.len() as u64 != touchable || observed_dofs.len() as u64 != observed {
        return Err("its table and its lists of degrees of freedom don't fit together".into());
    }
    let rest: Vec<f64> = read_array(storage, rest)?;
    let positions: Vec<f64> = read_array(storage, places)?;
    let triangles: Vec<u32> = read_array(storage, corners)?;
    let surface = Surface {
        positions: positions.chunks_exact(3).map(DVec3::from_slice).collect(),
        triangles: triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        source_nodes: read_array(storage, sources)?,
    };
    let fixed = attributes.recording.support == palpate::Support::Fixed;
    let gravity: Option<Vec<f64>> = if fixed { Some(read_array(storage, gravity)?) } else { None };
    if gravity.as_ref().is_some_and(|g| g.len() as u64 != 3 * samples * observed) {
        return Err("its gravity response does not fit its table".into());
    }
    if attributes.columns_per_shard == 0 {
        return Err("its shards hold no columns".into());
    }
    Ok(TableContent {
        attributes,
        number,
        samples: samples as usize,
        touchable_dofs,
        observed_dofs,
        observed_positions: rest.chunks_exact(3).map(DVec3::from_slice).collect(),
        surface,
        gravity,
    })
}
