//! Zarr arrays of a store: the table, and the arrays beside it.

use crate::attributes::{CHECKSUM, Compression, Number, TableAttributes, TableContent};
use crate::object_storage::ObjectStorage;
use glam::DVec3;
use palpate::Surface;
use serde_json::{Map, json};
use std::sync::Arc;
use zarrs::array::codec::{
    BloscCodec, BloscCompressionLevel, BloscCompressor, BloscShuffleMode, Crc32cCodec, ShardingCodecOptions,
    SubchunkWriteOrder,
    api::{BytesToBytesCodecTraits, CodecSpecificOptions},
};
use zarrs::array::{
    Array, ArrayBuilder, ArrayShardedExt, CodecOptions, DataType, Element, ElementOwned, IntoArrayBytes,
    data_type,
};
use zarrs::storage::ReadableStorageTraits;

/// Path of the table in the store.
const TABLE: &str = "/impulse_response";

/// Whether a key belongs to a store whose group is not yet written, because its creation was interrupted.
pub(crate) fn is_store_key(key: &str) -> bool {
    let folder = key.split('/').next().unwrap_or_default();
    folder == "impulse_response" || SIDE_ARRAYS.contains(&folder)
}

/// Names of the arrays beside the table.
const SIDE_ARRAYS: [&str; 7] = [
    "touchable_dofs",
    "observed_dofs",
    "observed_positions",
    "surface_positions",
    "surface_triangles",
    "surface_source_nodes",
    "gravity_response",
];

/// Error of any kind, for messages.
pub(crate) type BoxError = Box<dyn std::error::Error>;

/// Array of a new table.
pub(crate) fn table_array(
    content: &TableContent,
    storage: Arc<ObjectStorage>,
) -> Result<Array<ObjectStorage>, BoxError> {
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

/// Array of an existing table. It writes the columns of a shard in order, so that a table always gives the same bytes.
pub(crate) fn open_array(storage: &Arc<ObjectStorage>) -> Result<Array<ObjectStorage>, BoxError> {
    let array = Array::open(storage.clone(), TABLE)?;
    let order = ShardingCodecOptions::default().with_subchunk_write_order(SubchunkWriteOrder::C);
    let options = CodecSpecificOptions::default().with_option(order);
    Ok(array.with_codec_specific_options(&options))
}

/// Writes the arrays beside the table.
pub(crate) fn write_side_arrays(
    content: &TableContent,
    storage: &Arc<ObjectStorage>,
) -> Result<(), BoxError> {
    let surface = &content.surface;
    let positions: Vec<f64> = surface.positions.iter().flat_map(|p| p.to_array()).collect();
    let triangles: Vec<u32> = surface.triangles.iter().flatten().copied().collect();
    let (nodes, faces) = (positions.len() as u64 / 3, triangles.len() as u64 / 3);
    let observed_rest: Vec<f64> = content.observed_positions.iter().flat_map(|p| p.to_array()).collect();
    let observed_nodes = content.observed_positions.len() as u64;
    let numbers = |name: &str, shape: Vec<u64>, values: &[u32], meaning: &str| {
        write_array(storage, name, data_type::uint32(), shape, values, meaning)
    };
    let lengths = |name: &str, shape: Vec<u64>, values: &[f64], meaning: &str| {
        write_array(storage, name, data_type::float64(), shape, values, meaning)
    };
    let list = |values: &[u32]| vec![values.len() as u64];
    let [touchable, observed, rest, places, corners, sources, gravity] = SIDE_ARRAYS;
    numbers(touchable, list(&content.touchable_dofs), &content.touchable_dofs, "3·node + axis")?;
    numbers(observed, list(&content.observed_dofs), &content.observed_dofs, "3·node + axis")?;
    lengths(rest, vec![observed_nodes, 3], &observed_rest, "m, body frame, of every observed node")?;
    lengths(places, vec![nodes, 3], &positions, "m, body frame: origin at the centre of mass")?;
    numbers(corners, vec![faces, 3], &triangles, "surface nodes, counter-clockwise from outside")?;
    numbers(sources, list(&surface.source_nodes), &surface.source_nodes, "node of the mesh")?;
    if let Some(response) = &content.gravity {
        let shape = vec![3, content.samples as u64, content.observed_dofs.len() as u64];
        lengths(gravity, shape, response, "m per m/s² held for one step, along each axis")?;
    }
    Ok(())
}

/// Writes an array as one chunk with a checksum.
fn write_array<T: Element + Clone>(
    storage: &Arc<ObjectStorage>,
    name: &str,
    number: DataType,
    shape: Vec<u64>,
    values: &[T],
    meaning: &str,
) -> Result<(), BoxError>
where
    Vec<T>: IntoArrayBytes<'static>,
{
    let mut attributes = Map::new();
    attributes.insert("meaning".into(), json!(meaning));
    let place = vec![0; shape.len()];
    let array = ArrayBuilder::new(shape.clone(), shape, number, 0)
        .bytes_to_bytes_codecs(vec![Arc::new(Crc32cCodec::new())])
        .attributes(attributes)
        .build(storage.clone(), &format!("/{name}"))?;
    let options = CodecOptions::default().with_store_empty_chunks(true);
    array.store_chunk_opt(&place, values.to_vec(), &options)?;
    array.store_metadata()?;
    Ok(())
}

/// Reads an array; the error names it. It was written as one chunk without compression, whose size tells what there is to allocate.
fn read_array<T: ElementOwned>(
    storage: &Arc<ObjectStorage>,
    name: &str,
    (number, columns): (DataType, &[u64]),
) -> Result<Vec<T>, String>
where
    Vec<T>: zarrs::array::FromArrayBytes,
{
    let said = |e: &dyn std::fmt::Display| format!("{name}: {e}");
    let array = Array::open(storage.clone(), &format!("/{name}")).map_err(|e| said(&e))?;
    let (shape, place) = (array.shape(), vec![0; array.shape().len()]);
    if *array.data_type() != number || shape.len() != 1 + columns.len() || shape[1..] != *columns {
        let found = (array.data_type(), shape);
        return Err(said(&format!(
            "it has the type and shape {found:?}, expected {number:?} in rows of {columns:?}"
        )));
    }
    let chunk = array.chunk_shape_usize(&place).map_err(|e| said(&e))?;
    if !chunk.iter().zip(shape).all(|(part, whole)| *part as u64 == *whole) {
        return Err(said(&format!("its chunks have the shape {chunk:?}, expected {shape:?}")));
    }
    let size = size_of::<T>() as u64;
    let bytes = shape.iter().try_fold(size, |bytes, extent| bytes.checked_mul(*extent));
    let stored = storage.size_key(&array.chunk_key(&place)).map_err(|e| said(&e))?;
    match (bytes.and_then(|bytes| bytes.checked_add(CHECKSUM)), stored) {
        (Some(expected), Some(stored)) if expected == stored => {}
        (_, Some(stored)) => return Err(said(&format!("{stored} bytes don't hold the shape {shape:?}"))),
        (_, None) => return Err(said(&"its numbers are missing")),
    }
    array.retrieve_array_subset::<Vec<T>>(&array.subset_all()).map_err(|e| said(&e))
}

/// Check that the table is divided into shards and columns as its attributes say.
fn check_division(array: &Array<ObjectStorage>, columns_per_shard: u64) -> Result<(), String> {
    let &[_, samples, observed] = array.shape() else {
        return Err(format!("its table has {} dimensions, expected 3", array.shape().len()));
    };
    let expected = [columns_per_shard, samples, observed];
    let numbers =
        expected.iter().try_fold(size_of::<f64>() as u64, |bytes, extent| bytes.checked_mul(*extent));
    if expected.contains(&0) || numbers.is_none_or(|bytes| bytes > isize::MAX as u64) {
        return Err(format!(
            "its shards have the shape {expected:?}, expected numbers above 0 that fit into memory"
        ));
    }
    let chunk = array.chunk_shape_usize(&[0, 0, 0]).map_err(|e| e.to_string())?;
    let column = array.subchunk_shape().map(|shape| shape.iter().map(|extent| extent.get()).collect());
    let is_divided = chunk.iter().map(|extent| *extent as u64).eq(expected);
    if !is_divided || column != Some(vec![1, samples, observed]) {
        return Err(format!(
            "its shards have the shape {chunk:?} and columns {column:?}, expected {expected:?}"
        ));
    }
    Ok(())
}

/// Reads the content of a store without the numbers of the table.
pub(crate) fn read_content(
    attributes: TableAttributes,
    array: &Array<ObjectStorage>,
    storage: &Arc<ObjectStorage>,
) -> Result<TableContent, String> {
    let number = match array.data_type() {
        t if *t == data_type::float32() => Number::F32,
        t if *t == data_type::float64() => Number::F64,
        other => return Err(format!("its numbers are {other:?}, expected float32 or float64")),
    };
    check_division(array, attributes.columns_per_shard)?;
    let &[touchable, samples, observed] = array.shape() else { return Err("its table has no shape".into()) };
    let whole = (data_type::uint32(), &[][..]);
    let [corner, vector] = [data_type::uint32(), data_type::float64()].map(|number| (number, &[3][..]));
    let [touchables, observeds, rest, places, corners, sources, gravity] = SIDE_ARRAYS;
    let touchable_dofs: Vec<u32> = read_array(storage, touchables, whole.clone())?;
    let observed_dofs: Vec<u32> = read_array(storage, observeds, whole.clone())?;
    if touchable_dofs.len() as u64 != touchable || observed_dofs.len() as u64 != observed {
        return Err("its table and its lists of degrees of freedom don't fit together".into());
    }
    let rest: Vec<f64> = read_array(storage, rest, vector.clone())?;
    let positions: Vec<f64> = read_array(storage, places, vector)?;
    let triangles: Vec<u32> = read_array(storage, corners, corner)?;
    let surface = Surface {
        positions: positions.chunks_exact(3).map(DVec3::from_slice).collect(),
        triangles: triangles.chunks_exact(3).map(|t| [t[0], t[1], t[2]]).collect(),
        source_nodes: read_array(storage, sources, whole)?,
    };
    let fixed = attributes.recording.support == palpate::Support::Fixed;
    let response = (data_type::float64(), &[samples, observed][..]);
    let gravity: Option<Vec<f64>> = if fixed { Some(read_array(storage, gravity, response)?) } else { None };
    if gravity.as_ref().is_some_and(|g| g.len() as u64 != 3 * samples * observed) {
        return Err("its gravity response does not fit its table".into());
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
