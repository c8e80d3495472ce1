//! Memory-mapped columns of a store in a folder.
//!
//! The system loads the pages of a column on first access. Uncompressed columns are read from the mapped file;
//! compressed ones are decompressed into memory on first use.

use crate::attributes::{Compression, Number};
use crate::error::StoreError;
use crate::table_store::TableStore;
use memmap2::Mmap;
use palpate::{Column, ImpulseColumns};
use std::fmt;
use std::fs::File;
use std::ops::Range;
use std::sync::OnceLock;
use zarrs::array::{ArrayShardedReadableExt, ArrayShardedReadableExtCache, CodecOptions};

/// Memory-mapped columns of a store.
pub(crate) struct MappedColumns {
    number: Number,
    length: usize,
    columns: Vec<OneColumn>,
    shards: Vec<Mmap>,
    store: TableStore,
    cache: ArrayShardedReadableExtCache,
}

struct OneColumn {
    shard: usize,
    /// Byte range in the shard without the checksum; none if the column is compressed.
    bytes: Option<Range<usize>>,
    /// Decompressed bytes, from first use on; zeros if the column is damaged.
    decompressed: OnceLock<Box<[u8]>>,
}

impl MappedColumns {
    /// Maps the shards of a finished store; only their indices are read.
    pub(crate) fn new(store: TableStore) -> Result<Self, StoreError> {
        let Some(folder) = store.location().folder().map(std::path::Path::to_path_buf) else {
            return Err(StoreError::Remote { location: store.location().to_string() });
        };
        let number = store.content().number;
        let length = store.content().column_length();
        let plain = store.content().attributes.compression == Compression::None;
        let mut shards = Vec::with_capacity(store.shards());
        let mut columns = Vec::with_capacity(store.content().touchable_dofs.len());
        let cache = ArrayShardedReadableExtCache::new(store.array());
        for shard in 0..store.shards() {
            let path = folder.join(format!("impulse_response/c/{shard}/0/0"));
            let failed = |source| StoreError::ReadFile { path: path.clone(), source };
            let file = File::open(&path).map_err(failed)?;
            // SAFETY: a shard is never changed in place: it takes its name when it is whole, and a new one replaces the
            // file, not its content. Someone who cuts the file short while it is mapped stops the program.
            let map = unsafe { Mmap::map(&file) }.map_err(failed)?;
            for touchable in store.columns_of(shard) {
                let range = store
                    .array()
                    .subchunk_byte_range(&cache, &[touchable as u64, 0, 0])
                    .map_err(|e| store.damaged(shard, &e.to_string()))?;
                let Some(range) = range else {
                    return Err(store.damaged(shard, &format!("column {touchable} is missing in it")));
                };
                let size = map.len() as u64;
                let (start, end) = (range.start(size) as usize, range.end(size) as usize);
                // The checksum follows the numbers.
                let bytes = start..start + length * number.bytes();
                if end > map.len() || plain && bytes.end > end {
                    return Err(store.damaged(shard, &format!("column {touchable} is cut short")));
                }
                columns.push(OneColumn {
                    shard,
                    bytes: plain.then_some(bytes),
                    decompressed: OnceLock::new(),
                });
            }
            shards.push(map);
        }
        Ok(Self { number, length, columns, shards, store, cache })
    }

    /// Decompresses a column and checks its checksum.
    fn decode(&self, touchable: usize) -> Result<Box<[u8]>, StoreError> {
        let place = [touchable as u64, 0, 0];
        let options = CodecOptions::default();
        let array = self.store.array();
        let bytes = match self.number {
            Number::F32 => array
                .retrieve_subchunk_opt::<Vec<f32>>(&self.cache, &place, &options)
                .map(|values| values.into_iter().flat_map(f32::to_le_bytes).collect()),
            Number::F64 => array
                .retrieve_subchunk_opt::<Vec<f64>>(&self.cache, &place, &options)
                .map(|values| values.into_iter().flat_map(f64::to_le_bytes).collect()),
        };
        bytes.map_err(|e| self.store.damaged(self.columns[touchable].shard, &e.to_string()))
    }
}

impl ImpulseColumns for MappedColumns {
    fn column_length(&self) -> usize {
        self.length
    }

    fn prepare(&self, touchable: usize) -> Result<(), String> {
        let column = &self.columns[touchable];
        let bytes = self.decode(touchable).map_err(|e| e.to_string())?;
        match &column.bytes {
            // The column is checked, and its pages are in memory.
            Some(_) => {}
            None => drop(column.decompressed.set(bytes)),
        }
        Ok(())
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        let column = &self.columns[touchable];
        let bytes = match &column.bytes {
            Some(range) => &self.shards[column.shard][range.clone()],
            None => column.decompressed.get_or_init(|| {
                let zeros = || vec![0; self.length * self.number.bytes()].into_boxed_slice();
                self.decode(touchable).unwrap_or_else(|_| zeros())
            }),
        };
        match self.number {
            Number::F32 => Column::F32(bytes),
            Number::F64 => Column::F64(bytes),
        }
    }
}

impl fmt::Debug for MappedColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "MappedColumns({} columns of {} numbers)", self.columns.len(), self.length)
    }
}
