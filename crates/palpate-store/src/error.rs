//! Errors of a store.

use std::fmt;
use std::path::PathBuf;

/// A store that cannot be made, opened, read or written. The text includes the remedy.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// There is no store at this location.
    #[error("{location}: there is no store of impulse responses")]
    NotFound {
        /// Location of the store.
        location: String,
    },
    /// The location is a file.
    #[error("{path} is a file; a store of impulse responses is a folder", path = path.display())]
    NotAFolder {
        /// Path of the file.
        path: PathBuf,
    },
    /// The location holds something else than a store.
    #[error(
        "{location} is not empty and no store of impulse responses (it holds {found}): give another name"
    )]
    NotEmpty {
        /// Location of the store.
        location: String,
        /// Key of an object that is there.
        found: String,
    },
    /// The location holds the store of another table.
    #[error("the store {location} holds another table: {difference}. Give another name, or remove it")]
    OtherTable {
        /// Location of the store.
        location: String,
        /// First difference of the two tables.
        difference: TableDifference,
    },
    /// The layout of the store has another version.
    #[error(
        "{location} is no usable store of impulse responses: its version is {version}, this palpate reads {supported}: record \
         it again or use a newer palpate"
    )]
    Version {
        /// Location of the store.
        location: String,
        /// Version of the store.
        version: u64,
        /// Version that this library reads.
        supported: u32,
    },
    /// The content of the store makes no sense.
    #[error("{location} is no usable store of impulse responses: {reason}")]
    Invalid {
        /// Location of the store.
        location: String,
        /// Value that was found, and what is expected.
        reason: String,
    },
    /// Shards of the table are missing.
    #[error(
        "the store {location} is not finished: {missing} of {shards} shards are missing. Record it to the end with the command \
         that began it"
    )]
    Incomplete {
        /// Location of the store.
        location: String,
        /// Number of missing shards.
        missing: usize,
        /// Number of all shards.
        shards: usize,
    },
    /// The store cannot be accessed.
    #[error("cannot {operation} the store {location}: {reason}")]
    Access {
        /// Attempted operation.
        operation: StoreOperation,
        /// Location of the store.
        location: String,
        /// Message of the system or of the server.
        reason: String,
    },
    /// A file or folder of the store cannot be read.
    #[error("cannot read {path}: {source}", path = path.display())]
    ReadFile {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// A shard cannot be written. The store is as it was before.
    #[error(
        "{reason}. What is finished is kept: make room or repair the cause, then run the same command again"
    )]
    WriteShard {
        /// Number of the shard.
        shard: usize,
        /// Message of the system or of the server.
        reason: String,
    },
    /// The runtime of input and output cannot be started.
    #[error("cannot start input and output: {0}")]
    Runtime(std::io::Error),
    /// A shard does not decode, or its checksum is wrong.
    #[error(
        "shard {shard} ({key}) is damaged: {reason}. Remove it and record again with the same command: the rest is kept"
    )]
    Damaged {
        /// Number of the shard.
        shard: usize,
        /// Location of the shard.
        key: String,
        /// Message of the decoder.
        reason: String,
    },
}

/// Operation on a store, for errors.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StoreOperation {
    /// Making the folder.
    Make,
    /// Opening.
    Open,
    /// Listing the objects.
    List,
    /// Writing.
    Write,
}

impl fmt::Display for StoreOperation {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Make => "make",
            Self::Open => "open",
            Self::List => "list",
            Self::Write => "write",
        })
    }
}

/// Difference of a stored table and a requested one.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TableDifference {
    /// Name of the differing property, with its unit.
    pub property: &'static str,
    /// Value in the store.
    pub stored: String,
    /// Requested value.
    pub requested: String,
}

impl fmt::Display for TableDifference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { property, stored, requested } = self;
        write!(f, "{property} is {stored} there, and {requested} is asked for")
    }
}

/// Message of the innermost cause of an error.
pub(crate) fn root_cause(error: &dyn std::error::Error) -> String {
    let mut cause = error;
    while let Some(inner) = cause.source() {
        cause = inner;
    }
    // Servers append an XML document to their message.
    let text = cause.to_string();
    text.split("<?xml").next().unwrap_or_default().trim_end_matches([':', ' ']).to_string()
}
