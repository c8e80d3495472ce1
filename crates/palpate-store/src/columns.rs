//! Columns of a finished store in a folder, read into memory before a step uses them.
//!
//! A column is read whole, checked against its checksum and decompressed on first use: in [`ImpulseColumns::prepare`], outside of a step.
//! Mapping the file instead would end the process with a bus error, in the middle of a step, when someone cuts the file.

use crate::attributes::Number;
use crate::error::StoreError;
use crate::table_store::TableStore;
use palpate::{Column, ImpulseColumns};
use std::fmt;
use std::sync::OnceLock;
use zarrs::array::ArrayShardedReadableExtCache;

/// Columns of a store.
pub(crate) struct StoredColumns {
    number: Number,
    length: usize,
    /// Numbers of each column, from first use on; zeros if the column is damaged.
    columns: Vec<OnceLock<Box<[u8]>>>,
    store: TableStore,
    cache: ArrayShardedReadableExtCache,
}

impl StoredColumns {
    /// Columns of a finished store; only the indices of its shards are read.
    pub(crate) fn new(store: TableStore) -> Result<Self, StoreError> {
        if store.location().folder().is_none() {
            return Err(StoreError::Remote { location: store.location().to_string() });
        }
        let cache = ArrayShardedReadableExtCache::new(store.array());
        for shard in 0..store.shards() {
            store.check_index(shard, &cache)?;
        }
        let columns = store.content().touchable_dofs.iter().map(|_| OnceLock::new()).collect();
        let (number, length) = (store.content().number, store.content().column_length());
        Ok(Self { number, length, columns, store, cache })
    }
}

impl ImpulseColumns for StoredColumns {
    fn column_length(&self) -> usize {
        self.length
    }

    fn prepare(&self, touchable: usize) -> Result<(), String> {
        let column = &self.columns[touchable];
        if column.get().is_none() {
            let bytes = self.store.read_column(touchable, &self.cache).map_err(|e| e.to_string())?;
            // Another thread may have read it meanwhile.
            let _ = column.set(bytes);
        }
        Ok(())
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        let bytes = self.columns[touchable].get_or_init(|| {
            let zeros = || vec![0; self.length * self.number.bytes()].into_boxed_slice();
            self.store.read_column(touchable, &self.cache).unwrap_or_else(|_| zeros())
        });
        match self.number {
            Number::F32 => Column::F32(bytes),
            Number::F64 => Column::F64(bytes),
        }
    }
}

impl fmt::Debug for StoredColumns {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "StoredColumns({} columns of {} numbers)", self.columns.len(), self.length)
    }
}
