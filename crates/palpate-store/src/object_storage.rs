//! Adapter from object_store to the storage traits of zarrs: whole objects are put at once or not at all.

use crate::error::{StoreError, StoreOperation, root_cause};
use futures::TryStreamExt;
use object_store::path::Path;
use object_store::{ObjectStore, ObjectStoreExt};
use std::sync::Arc;
use tokio::runtime::Runtime;
use zarrs::storage::byte_range::{ByteRange, ByteRangeIterator};
use zarrs::storage::{
    Bytes, MaybeBytes, MaybeBytesIterator, OffsetBytesIterator, ReadableStorageTraits, StorageError,
    StoreKey, StorePrefix, WritableStorageTraits, store_set_partial_many,
};

/// Objects under a prefix.
#[derive(Debug)]
pub(crate) struct ObjectStorage {
    store: Arc<dyn ObjectStore>,
    prefix: Path,
    runtime: Runtime,
    /// Location of the store, for errors.
    name: String,
}

/// Key and size of an object.
pub(crate) struct StoredObject {
    pub(crate) key: String,
    pub(crate) bytes: u64,
}

impl ObjectStorage {
    pub(crate) fn new(store: Arc<dyn ObjectStore>, prefix: Path, name: String) -> Result<Self, StoreError> {
        let runtime = tokio::runtime::Builder::new_multi_thread()
            .worker_threads(1)
            .enable_all()
            .build()
            .map_err(StoreError::Runtime)?;
        Ok(Self { store, prefix, runtime, name })
    }

    fn path(&self, key: &str) -> Path {
        let parts = key.split('/').filter(|part| !part.is_empty());
        parts.fold(self.prefix.clone(), |path, part| path.join(part))
    }

    /// All objects below a folder of the store.
    pub(crate) fn list(&self, folder: &str) -> Result<Vec<StoredObject>, StoreError> {
        let below = self.path(folder);
        let objects: Result<Vec<_>, _> = self.runtime.block_on(self.store.list(Some(&below)).try_collect());
        let objects = objects.map_err(|e| StoreError::Access {
            operation: StoreOperation::List,
            location: self.name.clone(),
            reason: root_cause(&e),
        })?;
        let prefix = self.prefix.as_ref();
        let found = |meta: object_store::ObjectMeta| StoredObject {
            key: meta
                .location
                .as_ref()
                .strip_prefix(prefix)
                .unwrap_or_default()
                .trim_start_matches('/')
                .into(),
            bytes: meta.size,
        };
        Ok(objects.into_iter().map(found).collect())
    }

    fn failed(&self, doing: &str, key: &StoreKey, error: &object_store::Error) -> StorageError {
        StorageError::Other(format!("cannot {doing} {}/{key}: {}", self.name, root_cause(error)))
    }
}

impl ReadableStorageTraits for ObjectStorage {
    fn get(&self, key: &StoreKey) -> Result<MaybeBytes, StorageError> {
        let path = self.path(key.as_str());
        let read = self.runtime.block_on(async { self.store.get(&path).await?.bytes().await });
        match read {
            Ok(bytes) => Ok(Some(bytes)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(self.failed("read", key, &error)),
        }
    }

    fn get_partial_many<'a>(
        &'a self,
        key: &StoreKey,
        byte_ranges: ByteRangeIterator<'a>,
    ) -> Result<MaybeBytesIterator<'a>, StorageError> {
        let Some(size) = self.size_key(key)? else { return Ok(None) };
        let path = self.path(key.as_str());
        let within = |range: ByteRange| {
            let (start, end) = match range {
                ByteRange::FromStart(start, None) => (start, Some(size)),
                ByteRange::FromStart(start, Some(length)) => (start, start.checked_add(length)),
                ByteRange::Suffix(length) => (size.checked_sub(length)?, Some(size)),
            };
            end.filter(|end| start <= *end && *end <= size).map(|end| start..end)
        };
        let ranges: Option<Vec<_>> = byte_ranges.map(within).collect();
        let Some(ranges) = ranges else {
            let what = format!("{}/{key} is cut short: it has {size} bytes", self.name);
            return Err(StorageError::Other(what));
        };
        let read = self.runtime.block_on(self.store.get_ranges(&path, &ranges));
        let parts = read.map_err(|error| self.failed("read", key, &error))?;
        Ok(Some(Box::new(parts.into_iter().map(Ok))))
    }

    fn size_key(&self, key: &StoreKey) -> Result<Option<u64>, StorageError> {
        let path = self.path(key.as_str());
        match self.runtime.block_on(self.store.head(&path)) {
            Ok(meta) => Ok(Some(meta.size)),
            Err(object_store::Error::NotFound { .. }) => Ok(None),
            Err(error) => Err(self.failed("read", key, &error)),
        }
    }

    fn supports_get_partial(&self) -> bool {
        true
    }
}

impl WritableStorageTraits for ObjectStorage {
    fn set(&self, key: &StoreKey, value: Bytes) -> Result<(), StorageError> {
        let path = self.path(key.as_str());
        let put = self.runtime.block_on(self.store.put(&path, value.into()));
        put.map(drop).map_err(|error| self.failed("write", key, &error))
    }

    fn set_partial_many(
        &self,
        key: &StoreKey,
        offset_values: OffsetBytesIterator,
    ) -> Result<(), StorageError> {
        store_set_partial_many(self, key, offset_values)
    }

    fn erase(&self, key: &StoreKey) -> Result<(), StorageError> {
        let path = self.path(key.as_str());
        match self.runtime.block_on(self.store.delete(&path)) {
            Ok(()) | Err(object_store::Error::NotFound { .. }) => Ok(()),
            Err(error) => Err(self.failed("remove", key, &error)),
        }
    }

    fn erase_prefix(&self, prefix: &StorePrefix) -> Result<(), StorageError> {
        let found = self.list(prefix.as_str()).map_err(|e| StorageError::Other(e.to_string()))?;
        for object in found {
            self.erase(&StoreKey::new(object.key)?)?;
        }
        Ok(())
    }

    fn supports_set_partial(&self) -> bool {
        false
    }
}
