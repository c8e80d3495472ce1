//! Scan of a log from its beginning: finds what is whole in a file that was cut, and makes the summary that it lacks.
//!
//! ```text
//! magic | header, attachments, metadata | chunk | chunk | … | half a chunk
//!                                                           ^ whole bytes
//! ```
//!
//! A chunk counts when its checksum is right. Reference: MCAP specification, records and chunks.

use super::record_layout::{self, RECORD_HEADER, split_record};
use super::record_reader::{length_limit, unpacked};
use super::summary::take_definition;
use crate::error::{Error, LogError};
use mcap::records::{AttachmentIndex, MetadataIndex, Record, Statistics, op};
use mcap::{MAGIC, McapError, Summary};

/// Opcode of no record: a power cut leaves zeros where the disk had room but no data yet.
const NO_RECORD: u8 = 0;

/// Error of what is no log, or a damaged one.
pub(super) fn unreadable(error: impl std::fmt::Display) -> Error {
    LogError::Unreadable { reason: error.to_string() }.into()
}

/// Whole part of a log.
pub(super) struct Scan {
    /// Summary of the whole part.
    pub summary: Summary,
    /// Length of the whole part [bytes].
    pub whole: usize,
    /// Whether the end of the data was reached: nothing of them is missing.
    pub is_complete: bool,
}

impl Scan {
    /// Scans a file up to its end, or its first damage.
    ///
    /// # Errors
    /// If it is no MCAP file.
    pub fn new(bytes: &[u8]) -> Result<Self, Error> {
        if !bytes.starts_with(MAGIC) {
            return Err(unreadable(McapError::BadMagic));
        }
        let mut scan = Self { summary: Summary::default(), whole: MAGIC.len(), is_complete: false };
        scan.summary.stats = Some(Statistics::default());
        while let Some((content, after)) = split_record(&bytes[scan.whole..]) {
            let (start, end) = (scan.whole, bytes.len() - after.len());
            if scan.take(bytes, start, content).is_err() {
                break;
            }
            scan.whole = end;
            if scan.is_complete {
                break;
            }
        }
        Ok(scan)
    }

    /// Takes the record at a place of the file, with its content.
    fn take(&mut self, file: &[u8], start: usize, data: &[u8]) -> Result<(), McapError> {
        let (opcode, offset) = (file[start], start as u64);
        let length = (RECORD_HEADER + data.len()) as u64;
        match opcode {
            NO_RECORD => return Err(McapError::UnexpectedEof),
            op::DATA_END => self.is_complete = true,
            op::CHUNK => return self.take_chunk(data, file.len()),
            op::ATTACHMENT => {
                if let Record::Attachment { header, data, .. } = record_layout::parse(opcode, data)? {
                    self.summary.attachment_indexes.push(AttachmentIndex {
                        offset,
                        length,
                        log_time: header.log_time,
                        create_time: header.create_time,
                        data_size: data.len() as u64,
                        name: header.name,
                        media_type: header.media_type,
                    });
                }
            }
            op::METADATA => {
                if let Record::Metadata(metadata) = record_layout::parse(opcode, data)? {
                    self.summary.metadata_indexes.push(MetadataIndex { offset, length, name: metadata.name });
                }
            }
            _ => take_definition(&mut self.summary, opcode, data)?,
        }
        Ok(())
    }

    /// Takes the records of a chunk of a file, if all of them are whole.
    fn take_chunk(&mut self, content: &[u8], file_length: usize) -> Result<(), McapError> {
        let before = self.summary.clone();
        let records = unpacked(content, length_limit(file_length))?;
        let mut rest = &records[..];
        while !rest.is_empty() {
            let taken = match split_record(rest) {
                Some((content, after)) => {
                    let opcode = rest[0];
                    rest = after;
                    take_definition(&mut self.summary, opcode, content)
                }
                None => Err(McapError::UnexpectedEoc),
            };
            if let Err(error) = taken {
                self.summary = before;
                return Err(error);
            }
        }
        Ok(())
    }
}
