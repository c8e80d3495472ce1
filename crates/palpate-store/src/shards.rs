//! Reading of shards: their indices, and one column after another, each checked before anything is allocated for it.

use crate::attributes::{CHECKSUM, Compression, Number};
use crate::error::StoreError;
use crate::table_store::TableStore;
use std::ops::Range;
use zarrs::array::{ArrayShardedReadableExt, ArrayShardedReadableExtCache, CodecOptions};
use zarrs::storage::ReadableStorageTraits;
use zarrs::storage::byte_range::ByteRange;

/// Size of a column's place in the index of a shard [bytes].
const INDEX_ENTRY: u64 = 16;

/// Upper limit of the ratio by which a column is compressed; zeros reach some ten thousand.
const MAX_COMPRESSION: u64 = 100_000;

/// Place of the size before compression in a Blosc header, little-endian.
const BLOSC_SIZE: Range<usize> = 4..8;

impl TableStore {
    /// Check that a shard has a place for every column, within its file and of a size that the column can have.
    pub(crate) fn check_index(
        &self,
        shard: usize,
        cache: &ArrayShardedReadableExtCache,
    ) -> Result<(), StoreError> {
        let attributes = &self.content().attributes;
        let raw = (self.content().column_length() * self.content().number.bytes()) as u64;
        let key = self.array().chunk_key(&[shard as u64, 0, 0]);
        let size = self.storage().size_key(&key).map_err(|e| self.damaged(shard, &e.to_string()))?;
        let size = size.ok_or_else(|| self.damaged(shard, "it is missing"))?;
        if attributes.columns_per_shard.saturating_mul(INDEX_ENTRY) > size {
            return Err(self.damaged(shard, &format!("{size} bytes are less than its index")));
        }
        for touchable in self.columns_of(shard) {
            let range = self
                .array()
                .subchunk_byte_range(cache, &[touchable as u64, 0, 0])
                .map_err(|e| self.damaged(shard, &e.to_string()))?;
            let Some(ByteRange::FromStart(start, Some(length))) = range else {
                return Err(self.damaged(shard, &format!("column {touchable} is missing in it")));
            };
            let fits = match attributes.compression {
                Compression::None => length == raw + CHECKSUM,
                Compression::Zstd => raw / MAX_COMPRESSION <= length,
            };
            if !fits || start.checked_add(length).is_none_or(|end| end > size) {
                let what = format!(
                    "column {touchable} has {length} bytes at {start} of {size}, for {raw} bytes of numbers"
                );
                return Err(self.damaged(shard, &what));
            }
        }
        Ok(())
    }

    /// Numbers of a column, decompressed and checked against its checksum. Its shard's index is known to be good.
    pub(crate) fn read_column(
        &self,
        touchable: usize,
        cache: &ArrayShardedReadableExtCache,
    ) -> Result<Box<[u8]>, StoreError> {
        let place = [touchable as u64, 0, 0];
        let options = CodecOptions::default();
        let array = self.array();
        let shard = self.shard_of(touchable);
        let raw = self.content().column_length() * self.content().number.bytes();
        let encoded = array.retrieve_encoded_subchunk(cache, &place);
        let encoded = encoded.map_err(|e| self.damaged(shard, &e.to_string()))?.unwrap_or_default();
        // The partial decoder of the library does not look at checksums.
        let is_whole = encoded
            .split_last_chunk()
            .is_some_and(|(content, checksum)| crc32c::crc32c(content) == u32::from_le_bytes(*checksum));
        if !is_whole {
            return Err(self.damaged(shard, &format!("column {touchable} does not have its checksum")));
        }
        if self.content().attributes.compression == Compression::Zstd {
            // The decoder allocates what the header says.
            let stated = encoded
                .get(BLOSC_SIZE)
                .map(|size| size.iter().rev().fold(0, |n, &byte| n << 8 | usize::from(byte)));
            if stated != Some(raw) {
                let what = format!("column {touchable} states a size of {stated:?} bytes, expected {raw}");
                return Err(self.damaged(shard, &what));
            }
        }
        let bytes: Result<Box<[u8]>, _> = match self.content().number {
            Number::F32 => array
                .retrieve_subchunk_opt::<Vec<f32>>(cache, &place, &options)
                .map(|values| values.into_iter().flat_map(f32::to_le_bytes).collect()),
            Number::F64 => array
                .retrieve_subchunk_opt::<Vec<f64>>(cache, &place, &options)
                .map(|values| values.into_iter().flat_map(f64::to_le_bytes).collect()),
        };
        let bytes = bytes.map_err(|e| self.damaged(shard, &e.to_string()))?;
        let is_finite = match self.content().number {
            Number::F32 => bytes.as_chunks::<4>().0.iter().all(|b| f32::from_le_bytes(*b).is_finite()),
            Number::F64 => bytes.as_chunks::<8>().0.iter().all(|b| f64::from_le_bytes(*b).is_finite()),
        };
        if bytes.len() != raw || !is_finite {
            return Err(self.damaged(shard, &format!("column {touchable} holds no numbers")));
        }
        Ok(bytes)
    }

    /// Reads a whole shard and checks its checksums and that all numbers are finite.
    ///
    /// # Errors
    /// [`StoreError::Damaged`].
    pub fn check_shard(&self, shard: usize) -> Result<(), StoreError> {
        let cache = ArrayShardedReadableExtCache::new(self.array());
        self.check_index(shard, &cache)?;
        self.columns_of(shard).try_for_each(|touchable| self.read_column(touchable, &cache).map(drop))
    }

    /// Shard of a column.
    pub(crate) fn shard_of(&self, touchable: usize) -> usize {
        touchable / self.columns_of(0).len().max(1)
    }
}
