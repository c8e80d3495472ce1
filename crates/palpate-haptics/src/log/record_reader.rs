//! Reader of the records of an MCAP file, those in chunks too.
//!
//! The readers of the mcap crate trust lengths within chunks. Here a record that is longer than what holds it is an error, and a chunk takes
//! no more memory than [`MIN_LENGTH_LIMIT`] or the file.
//!
//! Reference: MCAP specification, chunk.

use super::record_layout::{parse, split_record};
use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, McapError};
#[cfg(not(target_family = "wasm"))]
use std::io::Read;

/// Largest chunk of a file that is shorter [bytes]: our chunks have 1 MiB and a message.
const MIN_LENGTH_LIMIT: usize = 16 << 20;

/// Upper limit of the length of a chunk's records in a file of a length [bytes].
pub(super) fn length_limit(file_length: usize) -> usize {
    file_length.max(MIN_LENGTH_LIMIT)
}

/// Reader of the records after the first bytes of a file, [`MAGIC`], up to its footer. Every call gets the file's bytes, so that they may lie beside it.
pub(super) struct RecordReader {
    /// Offset of the next record outside of chunks [bytes].
    at: usize,
    /// Whether nothing follows: the footer was read, or an error found.
    is_at_end: bool,
    /// Records of the current chunk.
    chunk: Vec<u8>,
    /// Length of its records that have been read [bytes].
    read: usize,
    /// Upper limit of the length of a chunk's records [bytes].
    length_limit: usize,
}

impl RecordReader {
    /// Reader of a whole file, or of its beginning.
    pub fn new(bytes: &[u8]) -> Self {
        let is_at_end = !bytes.starts_with(MAGIC);
        let length_limit = length_limit(bytes.len());
        Self { at: MAGIC.len(), is_at_end, chunk: Vec::new(), read: 0, length_limit }
    }

    /// Records outside of chunks that are left.
    fn rest<'a>(&self, bytes: &'a [u8]) -> &'a [u8] {
        if self.is_at_end { &[] } else { bytes.get(self.at..).unwrap_or_default() }
    }

    /// Passes the opcode and content of the next record that is no chunk to `visit`; `None` at the end, and after an error.
    pub fn next<T>(
        &mut self,
        bytes: &[u8],
        visit: impl FnOnce(u8, &[u8]) -> T,
    ) -> Option<Result<T, McapError>> {
        match self.find_record(bytes) {
            Ok(true) => {
                let record = &self.chunk[self.read..];
                let (content, after) = split_record(record)?;
                self.read = self.chunk.len() - after.len();
                Some(Ok(visit(record[0], content)))
            }
            Ok(false) => {
                let (content, after) = split_record(self.rest(bytes))?;
                let opcode = bytes[self.at];
                self.is_at_end = opcode == op::FOOTER;
                self.at = bytes.len() - after.len();
                Some(Ok(visit(opcode, content)))
            }
            Err(error) => {
                (self.is_at_end, self.read) = (true, self.chunk.len());
                Some(Err(error))
            }
        }
    }

    /// Unpacks chunks up to the next record, and checks its length. Gives whether it is in the current chunk.
    fn find_record(&mut self, bytes: &[u8]) -> Result<bool, McapError> {
        while self.read == self.chunk.len() {
            let rest = self.rest(bytes);
            if rest.is_empty() {
                return Ok(false);
            }
            let (content, after) = split_record(rest).ok_or(McapError::UnexpectedEof)?;
            if rest[0] != op::CHUNK {
                return Ok(false);
            }
            (self.chunk, self.read) = (unpacked(content, self.length_limit)?, 0);
            self.at = bytes.len() - after.len();
        }
        split_record(&self.chunk[self.read..]).map(|_| true).ok_or(McapError::UnexpectedEoc)
    }
}

/// Records of a chunk from its content, whose checksum is right.
///
/// # Errors
/// If it is damaged, if its records are longer than a limit [bytes], or if its compression is unknown.
pub(super) fn unpacked(content: &[u8], length_limit: usize) -> Result<Vec<u8>, McapError> {
    let Record::Chunk { header, data } = parse(op::CHUNK, content)? else {
        return Err(McapError::UnexpectedEoc);
    };
    let ChunkHeader { uncompressed_size, uncompressed_crc, compression, .. } = header;
    let length = usize::try_from(uncompressed_size).ok().filter(|length| *length <= length_limit);
    let length = length.ok_or(McapError::ChunkTooLarge(uncompressed_size))?;
    let records = match compression.as_str() {
        "" => data.into_owned(),
        "zstd" => decompressed(&data, length)?,
        _ => return Err(McapError::UnsupportedCompression(compression)),
    };
    if records.len() != length {
        return Err(McapError::UnexpectedEoc);
    }
    let calculated = crc32fast::hash(&records);
    // 0 stands for no checksum.
    if uncompressed_crc != 0 && calculated != uncompressed_crc {
        return Err(McapError::BadChunkCrc { saved: uncompressed_crc, calculated });
    }
    Ok(records)
}

/// Decompressed content of Zstandard frames, of which a byte beyond a length is enough to see that they are longer.
#[cfg(not(target_family = "wasm"))]
fn decompressed(data: &[u8], length: usize) -> Result<Vec<u8>, McapError> {
    let mut content = Vec::new();
    let decoder = zstd::stream::read::Decoder::with_buffer(data)?;
    decoder.take(length as u64 + 1).read_to_end(&mut content)?;
    Ok(content)
}

/// Decompressed content of Zstandard frames, at most of a length.
#[cfg(target_family = "wasm")]
fn decompressed(data: &[u8], length: usize) -> Result<Vec<u8>, McapError> {
    let mut content = Vec::with_capacity(length);
    let decoded = ruzstd::decoding::FrameDecoder::new().decode_all_to_vec(data, &mut content);
    decoded.map_err(|error| McapError::DecompressionError(error.to_string()))?;
    Ok(content)
}
