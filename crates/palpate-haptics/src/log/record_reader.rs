//! Reader of the records of an MCAP file, those in chunks too.
//!
//! The readers of the mcap crate trust lengths within chunks. Here a record that is longer than what holds it is an error, and a chunk takes
//! no more memory than [`MIN_LENGTH_LIMIT`] or the file.
//!
//! Reference: MCAP specification, chunk.

use super::record_layout::{parse, split_record};
use mcap::records::{ChunkHeader, Record, op};
use mcap::{MAGIC, McapError};
use std::io::Read;

/// Largest chunk of a file that is shorter [bytes]: our chunks have 1 MiB and a message.
const MIN_LENGTH_LIMIT: usize = 16 << 20;

/// Upper limit of the length of a chunk's records in a file of a length [bytes].
pub(super) fn length_limit(file_length: usize) -> usize {
    file_length.max(MIN_LENGTH_LIMIT)
}

/// Reader of the records after the first bytes of a file, [`MAGIC`], up to its footer.
pub(super) struct RecordReader<'a> {
    /// Records that are left outside of chunks.
    rest: &'a [u8],
    /// Records of the current chunk.
    chunk: Vec<u8>,
    /// Length of its records that have been read [bytes].
    read: usize,
    /// Upper limit of the length of a chunk's records [bytes].
    length_limit: usize,
}

impl<'a> RecordReader<'a> {
    /// Records of a whole file, or of its beginning.
    pub fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(MAGIC).unwrap_or_default();
        Self { rest, chunk: Vec::new(), read: 0, length_limit: length_limit(bytes.len()) }
    }

    /// Passes the opcode and content of the next record that is no chunk to `visit`; `None` at the end, and after an error.
    pub fn next<T>(&mut self, visit: impl FnOnce(u8, &[u8]) -> T) -> Option<Result<T, McapError>> {
        match self.find_record() {
            Ok(true) => {
                let record = &self.chunk[self.read..];
                let (content, after) = split_record(record)?;
                self.read = self.chunk.len() - after.len();
                Some(Ok(visit(record[0], content)))
            }
            Ok(false) if self.rest.is_empty() => None,
            Ok(false) => {
                let (opcode, (content, after)) = (self.rest[0], split_record(self.rest)?);
                self.rest = if opcode == op::FOOTER { &[] } else { after };
                Some(Ok(visit(opcode, content)))
            }
            Err(error) => {
                (self.rest, self.read) = (&[], self.chunk.len());
                Some(Err(error))
            }
        }
    }

    /// Unpacks chunks up to the next record, and checks its length. Gives whether it is in the current chunk.
    fn find_record(&mut self) -> Result<bool, McapError> {
        while self.read == self.chunk.len() {
            if self.rest.is_empty() {
                return Ok(false);
            }
            let (content, after) = split_record(self.rest).ok_or(McapError::UnexpectedEof)?;
            if self.rest[0] != op::CHUNK {
                return Ok(false);
            }
            (self.chunk, self.read) = (unpacked(content, self.length_limit)?, 0);
            self.rest = after;
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
    let mut records = Vec::new();
    match compression.as_str() {
        "" => records.extend_from_slice(&data),
        "zstd" => {
            let decoder = zstd::stream::read::Decoder::with_buffer(&data[..])?;
            decoder.take(length as u64 + 1).read_to_end(&mut records)?;
        }
        _ => return Err(McapError::UnsupportedCompression(compression)),
    }
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
