//! Recovery of a log that was cut: a whole file with all that can be read.

use super::file::{CHUNK_BYTES, failed, write_options};
use super::record_layout;
use super::record_reader::RecordReader;
use super::scan::{Scan, unreadable};
use super::summary::{step_count, summary_of};
use crate::error::{Error, LogError};
use mcap::records::{Record, op};
use mcap::{Attachment, Writer};
use std::io::{Seek, Write};

/// Content of a recovered log.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Recovered {
    /// Number of steps.
    pub steps: u64,
    /// Bytes at the end of the file that could not be read.
    pub lost_bytes: usize,
}

/// Writes a whole log with every record up to the first that is cut or damaged; returns the finished sink.
///
/// # Errors
/// If the log is whole, is no log, or has no whole step, or if writing fails.
pub fn recover<W: Write + Seek>(bytes: &[u8], out: W) -> Result<(Recovered, W), Error> {
    let Scan { summary, whole, is_complete } = Scan::new(bytes)?;
    if is_complete && summary_of(bytes).is_some() {
        return Err(LogError::Whole.into());
    }
    let steps = step_count(&summary);
    if steps == 0 {
        return Err(LogError::NoWholeStep.into());
    }
    let mut writer = write_options().create(out).map_err(failed)?;
    let kept = &bytes[..whole];
    let mut records = RecordReader::new(kept);
    let mut chunk_bytes = 0;
    while let Some(copied) = records.next(kept, |opcode, data| {
        chunk_bytes += data.len();
        copy(&mut writer, opcode, data)
    }) {
        copied.map_err(unreadable)??;
        if chunk_bytes >= CHUNK_BYTES {
            writer.flush().map_err(failed)?;
            chunk_bytes = 0;
        }
    }
    writer.finish().map_err(failed)?;
    let lost_bytes = if is_complete { 0 } else { bytes.len() - whole };
    Ok((Recovered { steps, lost_bytes }, writer.into_inner()))
}

/// Copies a record of the data; the writer makes the others itself.
fn copy<W: Write + Seek>(writer: &mut Writer<W>, opcode: u8, data: &[u8]) -> Result<(), Error> {
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE | op::ATTACHMENT | op::METADATA) {
        return Ok(());
    }
    let copied = match record_layout::parse(opcode, data).map_err(unreadable)? {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data).map(drop)
        }
        Record::Channel(channel) => writer
            .add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )
            .map(drop),
        Record::Message { header, data } => writer.write_to_known_channel(&header, &data),
        Record::Attachment { header, data, .. } => writer.attach(&Attachment {
            log_time: header.log_time,
            create_time: header.create_time,
            name: header.name,
            media_type: header.media_type,
            data,
        }),
        Record::Metadata(metadata) => writer.write_metadata(&metadata),
        _ => Ok(()),
    };
    copied.map_err(failed)
}
