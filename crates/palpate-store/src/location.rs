//! Where a store lies: a folder, or a prefix in a bucket of object storage.

use crate::error::StoreError;
use crate::object_storage::ObjectStorage;
use object_store::ObjectStore;
use object_store::local::LocalFileSystem;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// A folder, or `s3://bucket/prefix`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Location {
    /// A folder of this machine, or one that is shared over the network.
    Folder(PathBuf),
    /// An address with a scheme.
    Address(String),
}

impl Location {
    /// From what a user wrote.
    pub fn parse(text: &str) -> Self {
        match text.split_once("://") {
            Some(("file", path)) => Self::Folder(PathBuf::from(path)),
            Some(_) => Self::Address(text.trim_end_matches('/').into()),
            None => Self::Folder(PathBuf::from(text)),
        }
    }

    /// The folder, if it is one.
    pub fn folder(&self) -> Option<&Path> {
        match self {
            Self::Folder(path) => Some(path),
            Self::Address(_) => None,
        }
    }

    /// Open it; with `create` a folder is made.
    pub(crate) fn storage(&self, create: bool) -> Result<ObjectStorage, StoreError> {
        match self {
            Self::Folder(path) => {
                let failed = |what: &str, e: &dyn fmt::Display| {
                    StoreError::Place(format!("cannot {what} the store {}: {e}", path.display()))
                };
                if path.exists() && !path.is_dir() {
                    return Err(StoreError::Place(format!(
                        "{} is a file; a store of impulse responses is a folder",
                        path.display()
                    )));
                }
                if create {
                    std::fs::create_dir_all(path).map_err(|e| failed("make", &e))?;
                }
                let store =
                    LocalFileSystem::new_with_prefix(path).map_err(|e| failed("open", &root_cause(&e)))?;
                // What is said to be finished survives a loss of power.
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
    let failed = |e: &dyn fmt::Display| StoreError::Place(format!("cannot open the store {address}: {e}"));
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
    Err(StoreError::Place(format!(
        "cannot open the store {address}: this palpate was built without object storage (feature s3)"
    )))
}

/// The innermost cause of an error: the one that says what happened.
pub(crate) fn root_cause(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    // What a server answers may be a page of its own.
    let text = cause.to_string();
    text.split("<?xml").next().unwrap_or_default().trim_end_matches([':', ' ']).to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn folders_and_addresses_are_told_apart() {
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
