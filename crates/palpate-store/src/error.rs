//! Why a store can't be used, in words for the person at the terminal.

/// What is wrong, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The place can't be reached, read or written.
    #[error("{0}")]
    Place(String),
    /// What stands there is no table of palpate, or not one that fits.
    #[error("{0}")]
    Content(String),
    /// A shard does not decode, or its checksum is wrong.
    #[error(
        "shard {shard} ({key}) is damaged: {why}. Remove it and record again with the same command: the rest is kept"
    )]
    Damaged {
        /// Number of the shard.
        shard: usize,
        /// Where it lies.
        key: String,
        /// What the decoder said.
        why: String,
    },
}
