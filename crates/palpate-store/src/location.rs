//! Location of a store: a folder, or a prefix in a bucket of object storage.

use crate::error::{StoreError, StoreOperation, root_cause};
use crate::object_storage::ObjectStorage;
use object_store::ObjectStore;
use object_store::local::LocalFileSystem;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Location of a store: a folder, or `s3://bucket/prefix`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// Path of a folder, local or shared over the network.
    Folder(PathBuf),
    /// Address with a scheme.
    Address(String),
}

impl Location {
    /// Location from text: an address if it has a scheme other than `file`, else a path.
    pub fn parse(text: &str) -> Self {
        match text.split_once("://") {
            Some(("file", path)) => Self::Folder(PathBuf::from(path)),
            Some(_) => Self::Address(text.trim_end_matches('/').into()),
            None => Self::Folder(PathBuf::from(text)),
        }
    }

    /// Path of the folder; none for object storage.
    pub fn folder(&self) -> Option<&Path> {
        match self {
            Self::Folder(path) => Some(path),
            Self::Address(_) => None,
        }
    }

    /// Opens the location; with `create` a missing folder is made.
    pub(crate) fn storage(&self, create: bool) -> Result<ObjectStorage, StoreError> {
        match self {
            Self::Folder(path) => {
                let failed = |operation: StoreOperation, reason: String| StoreError::Access {
                    operation,
                    location: self.to_string(),
                    reason,
                };
                if path.exists() && !path.is_dir() {
                    return Err(StoreError::NotAFolder { path: path.clone() });
                }
                if create {
                    std::fs::create_dir_all(path).map_err(|e| failed(StoreOperation::Make, e.to_string()))?;
                }
                let store = LocalFileSystem::new_with_prefix(path)
                    .map_err(|e| failed(StoreOperation::Open, root_cause(&e)))?;
                // A finished shard survives a loss of power.
                let store: Arc<dyn ObjectStore> = Arc::new(store.with_fsync(true));
                ObjectStorage::new(store, object_store::path::Path::default(), self.to_string())
            }
            Self::Address(address) => remote(address),
        }
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Folder(path) => write!(f, "{}", path.display()),
            Self::Address(address) => f.write_str(address),
        }
    }
}

#[cfg(feature = "s3")]
fn remote(address: &str) -> Result<ObjectStorage, StoreError> {
    use object_store::aws::AmazonS3Builder;
    let failed = |reason: &dyn fmt::Display| open_error(address, reason.to_string());
    let url = url::Url::parse(address).map_err(|e| failed(&e))?;
    if url.scheme() != "s3" {
        return Err(failed(&format!(
            "{}: is no scheme that palpate knows; write s3://BUCKET/PREFIX",
            url.scheme()
        )));
    }
    let store = AmazonS3Builder::from_env().with_url(address).build().map_err(|e| failed(&root_cause(&e)))?;
    let prefix = object_store::path::Path::parse(url.path()).map_err(|e| failed(&e))?;
    ObjectStorage::new(Arc::new(store), prefix, address.to_string())
}

#[cfg(not(feature = "s3"))]
fn remote(address: &str) -> Result<ObjectStorage, StoreError> {
    Err(open_error(address, "this palpate was built without object storage (feature s3)".into()))
}

fn open_error(location: &str, reason: String) -> StoreError {
    StoreError::Access { operation: StoreOperation::Open, location: location.into(), reason }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_addresses_are_distinguished() {
        assert_eq!(Location::parse("a/b.zarr"), Location::Folder("a/b.zarr".into()));
        assert_eq!(Location::parse("file:///a/b.zarr"), Location::Folder("/a/b.zarr".into()));
        assert_eq!(Location::parse("s3://bucket/b.zarr/"), Location::Address("s3://bucket/b.zarr".into()));
    }

    #[test]
    fn a_file_is_no_store() {
        let file = tempfile::NamedTempFile::new().expect("a file");
        let refused = Location::Folder(file.path().into()).storage(true).err().map(|e| e.to_string());
        assert!(refused.is_some_and(|text| text.contains("is a file; a store")));
    }
}
