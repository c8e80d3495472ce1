//! Columns of a finished store, read into memory before a step uses them.
//!
//! A column is read whole, put in the order that a convolution reads it in, checked against its checksum and decompressed on first use: in [`ImpulseColumns::prepare`], outside of a step.
//! Mapping the file instead would end the process with a bus error, in the middle of a step, when someone cuts the file.

use crate::attributes::Number;
use crate::error::StoreError;
use crate::table_store::TableStore;
use palpate::{Column, ImpulseColumns, arrange_column};
use std::fmt;
use std::sync::OnceLock;
use zarrs::array::ArrayShardedReadableExtCache;

/// Columns of a store.
pub(crate) struct StoredColumns {
    length: usize,
    numbers: Numbers,
    /// Column of zeros, for those that cannot be read.
    zeros: Zeros,
    store: TableStore,
    cache: ArrayShardedReadableExtCache,
}

/// Numbers of each column, from first use on.
enum Numbers {
    F32(Vec<OnceLock<Box<[f32]>>>),
    F64(Vec<OnceLock<Box<[f64]>>>),
}

/// Zeros in place of a column, made on first use.
#[derive(Default)]
struct Zeros {
    f32: OnceLock<Box<[f32]>>,
    f64: OnceLock<Box<[f64]>>,
}

impl StoredColumns {
    /// Columns of a finished store; only the indices of its shards are read.
    pub(crate) fn new(store: TableStore) -> Result<Self, StoreError> {
        let cache = ArrayShardedReadableExtCache::new(store.array());
        for shard in 0..store.shards() {
            store.check_index(shard, &cache)?;
        }
        let (content, columns) = (store.content(), store.content().touchable_dofs.len());
        let numbers = match content.number {
            Number::F32 => Numbers::F32((0..columns).map(|_| OnceLock::new()).collect()),
            Number::F64 => Numbers::F64((0..columns).map(|_| OnceLock::new()).collect()),
        };
        Ok(Self { length: content.column_length(), numbers, zeros: Zeros::default(), store, cache })
    }

    /// Column, read from the store when it is not known yet.
    fn load<'c, const N: usize, X: Copy>(
        &self,
        (touchable, known): (usize, &'c OnceLock<Box<[X]>>),
        number: impl Fn([u8; N]) -> X,
    ) -> Result<&'c [X], StoreError> {
        if let Some(known) = known.get() {
            return Ok(known);
        }
        let bytes = self.store.read_column(touchable, &self.cache)?;
        let numbers: Vec<X> = bytes.as_chunks().0.iter().map(|bytes| number(*bytes)).collect();
        let column = arrange_column(&numbers, self.store.content().samples);
        // Another thread may have read it meanwhile.
        Ok(known.get_or_init(|| column))
    }
}

impl ImpulseColumns for StoredColumns {
    fn column_length(&self) -> usize {
        self.length
    }

    fn prepare(&self, touchable: usize) -> Result<(), String> {
        let prepared = match &self.numbers {
            Numbers::F32(columns) => {
                self.load((touchable, &columns[touchable]), f32::from_le_bytes).map(drop)
            }
            Numbers::F64(columns) => {
                self.load((touchable, &columns[touchable]), f64::from_le_bytes).map(drop)
            }
        };
        prepared.map_err(|error| error.to_string())
    }

    fn missing_bytes(&self) -> u64 {
        let missing = match &self.numbers {
            Numbers::F32(columns) => columns.iter().filter(|column| column.get().is_none()).count(),
            Numbers::F64(columns) => columns.iter().filter(|column| column.get().is_none()).count(),
        };
        (missing * self.length * self.store.content().number.bytes()) as u64
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        // What cannot be read is not kept, so that preparing it later fails.
        match &self.numbers {
            Numbers::F32(columns) => {
                let known = self.load((touchable, &columns[touchable]), f32::from_le_bytes);
                let zeros = || self.zeros.f32.get_or_init(|| vec![0.0; self.length].into());
                Column::F32(known.unwrap_or_else(|_| zeros()))
            }
            Numbers::F64(columns) => {
                let known = self.load((touchable, &columns[touchable]), f64::from_le_bytes);
                let zeros = || self.zeros.f64.get_or_init(|| vec![0.0; self.length].into());
                Column::F64(known.unwrap_or_else(|_| zeros()))
            }
        }
    }
}

impl fmt::Debug for StoredColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "StoredColumns({} columns of {} numbers)",
            self.store.content().touchable_dofs.len(),
            self.length
        )
    }
}
