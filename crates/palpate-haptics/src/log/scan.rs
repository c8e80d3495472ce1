//! Scan of a log from its beginning: finds what is whole in a file that was cut, and makes the summary that it lacks.
//!
//! ```text
//! magic | header, attachments, metadata | chunk | chunk | … | half a chunk
//!                                                           ^ whole bytes
//! ```
//!
//! A chunk counts when its checksum is right. Reference: MCAP specification, records and chunks.

use super::messages::STEP_TOPIC;
use crate::error::{Error, LogError};
use mcap::read::parse_record;
use mcap::records::{AttachmentIndex, MetadataIndex, Record, Statistics, op};
use mcap::sans_io::linear_reader::{LinearReadEvent, LinearReader, LinearReaderOptions};
use mcap::{Channel, MAGIC, McapError, Schema, Summary};
use std::sync::Arc;

/// Bytes of a record before its content: opcode and length.
const RECORD_HEADER: usize = 1 + 8;

/// Largest record or chunk of a file that is shorter [bytes]: our chunks have 1 MiB and a message.
const MIN_LENGTH_LIMIT: usize = 16 << 20;

/// Opcode of no record: a power cut leaves zeros where the disk had room but no data yet.
const NO_RECORD: u8 = 0;

/// Error of what is no log, or a damaged one.
pub(super) fn unreadable(error: impl std::fmt::Display) -> Error {
    LogError::Unreadable { reason: error.to_string() }.into()
}

/// Records of a piece of an MCAP file.
pub(super) struct RecordReader<'a> {
    bytes: &'a [u8],
    reader: LinearReader,
}

impl<'a> RecordReader<'a> {
    /// Records of a whole file, or of its beginning, with those in chunks; no message of a damaged chunk is read. No more memory is
    /// taken for a length than the file has, or a chunk.
    pub fn new(bytes: &'a [u8]) -> Self {
        Self::with_options(bytes, LinearReaderOptions::default().with_prevalidate_chunk_crcs(true))
    }

    fn with_options(bytes: &'a [u8], options: LinearReaderOptions) -> Self {
        let limit = bytes.len().max(MIN_LENGTH_LIMIT);
        let options = options.with_record_length_limit(limit).with_skip_end_magic(true);
        Self { bytes, reader: LinearReader::new_with_options(options) }
    }

    /// Passes the opcode and content of the next record to `visit`; `None` at the end.
    pub fn next<T>(&mut self, visit: impl FnOnce(u8, &[u8]) -> T) -> Option<Result<T, McapError>> {
        loop {
            match self.reader.next_event()? {
                Ok(LinearReadEvent::ReadRequest(requested)) => {
                    let (now, later) = self.bytes.split_at(requested.min(self.bytes.len()));
                    self.reader.insert(now.len()).copy_from_slice(now);
                    self.reader.notify_read(now.len());
                    self.bytes = later;
                }
                Ok(LinearReadEvent::Record { opcode, data }) => return Some(Ok(visit(opcode, data))),
                Err(error) => return Some(Err(error)),
            }
        }
    }
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
        let whole_chunks = LinearReaderOptions::default().with_emit_chunks(true);
        let mut records = RecordReader::with_options(bytes, whole_chunks);
        while let Some(Ok(taken)) = records.next(|opcode, data| {
            let end = scan.whole + RECORD_HEADER + data.len();
            let taken = scan.take(opcode, data, &bytes[scan.whole..end.min(bytes.len())]);
            if taken.is_ok() {
                scan.whole = end;
            }
            taken.is_ok()
        }) {
            if !taken || scan.is_complete {
                break;
            }
        }
        Ok(scan)
    }

    /// Takes a record of the file: its content, and all its bytes.
    fn take(&mut self, opcode: u8, data: &[u8], record: &[u8]) -> Result<(), McapError> {
        match opcode {
            NO_RECORD => return Err(McapError::UnexpectedEof),
            op::DATA_END => self.is_complete = true,
            op::CHUNK => return self.take_chunk(record),
            op::ATTACHMENT => {
                if let Record::Attachment { header, data, .. } = parse_record(opcode, data)? {
                    self.summary.attachment_indexes.push(AttachmentIndex {
                        offset: self.whole as u64,
                        length: record.len() as u64,
                        log_time: header.log_time,
                        create_time: header.create_time,
                        data_size: data.len() as u64,
                        name: header.name,
                        media_type: header.media_type,
                    });
                }
            }
            op::METADATA => {
                if let Record::Metadata(metadata) = parse_record(opcode, data)? {
                    let (offset, length) = (self.whole as u64, record.len() as u64);
                    self.summary.metadata_indexes.push(MetadataIndex { offset, length, name: metadata.name });
                }
            }
            _ => self.take_in_chunk(opcode, data)?,
        }
        Ok(())
    }

    /// Takes the records of a chunk, if all of them are whole.
    fn take_chunk(&mut self, record: &[u8]) -> Result<(), McapError> {
        let before = self.summary.clone();
        let options = LinearReaderOptions::default().with_prevalidate_chunk_crcs(true);
        let mut records = RecordReader::with_options(record, options.with_skip_start_magic(true));
        while let Some(taken) = records.next(|opcode, data| self.take_in_chunk(opcode, data)) {
            if let Err(error) = taken.and_then(|taken| taken) {
                self.summary = before;
                return Err(error);
            }
        }
        Ok(())
    }

    /// Takes a schema, a channel or a message.
    fn take_in_chunk(&mut self, opcode: u8, data: &[u8]) -> Result<(), McapError> {
        if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
            return Ok(());
        }
        match parse_record(opcode, data)? {
            Record::Schema { header, data } => {
                let data = data.into_owned().into();
                let schema = Schema { id: header.id, name: header.name, encoding: header.encoding, data };
                self.summary.schemas.insert(schema.id, Arc::new(schema));
            }
            Record::Channel(channel) => {
                let schema = self.summary.schemas.get(&channel.schema_id).cloned();
                let channel = Channel {
                    id: channel.id,
                    topic: channel.topic,
                    schema,
                    message_encoding: channel.message_encoding,
                    metadata: channel.metadata,
                };
                self.summary.channels.insert(channel.id, Arc::new(channel));
            }
            Record::Message { header, .. } => {
                let counts = self.summary.stats.get_or_insert_default();
                *counts.channel_message_counts.entry(header.channel_id).or_default() += 1;
            }
            _ => {}
        }
        Ok(())
    }
}

/// Channel id of the steps.
pub(super) fn step_channel(summary: &Summary) -> Option<u16> {
    summary.channels.iter().find(|(_, channel)| channel.topic == STEP_TOPIC).map(|(id, _)| *id)
}

/// Number of steps.
pub(super) fn step_count(summary: &Summary) -> u64 {
    let counts = summary.stats.as_ref().map(|stats| &stats.channel_message_counts);
    step_channel(summary).and_then(|id| counts?.get(&id).copied()).unwrap_or(0)
}
