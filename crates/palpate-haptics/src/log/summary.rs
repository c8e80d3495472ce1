//! Summary of a log: schemas, channels, counts, and the places of attachments and metadata.
//!
//! Reference: MCAP specification, summary section.

use super::messages::STEP_TOPIC;
use super::record_layout::{holds_its_fields, parse, split_record};
use mcap::records::{Record, op};
use mcap::{Channel, MAGIC, McapError, Schema, Summary};
use std::sync::Arc;

/// Length of a footer's content [bytes].
const FOOTER: usize = 8 + 8 + 4;

/// Reads the summary at the end of a file; none if there is none, if it does not start at a record, or if a record outside of chunks has
/// lengths that don't fit.
pub(super) fn summary_of(bytes: &[u8]) -> Option<Summary> {
    let Record::Footer(footer) =
        parse(op::FOOTER, bytes.strip_suffix(MAGIC)?.last_chunk::<FOOTER>()?).ok()?
    else {
        return None;
    };
    let mut summary = None;
    let mut rest = bytes.strip_prefix(MAGIC)?;
    while rest.len() > MAGIC.len() {
        if (bytes.len() - rest.len()) as u64 == footer.summary_start {
            summary = Some(Summary::default());
        }
        let (opcode, (content, after)) = (rest[0], split_record(rest)?);
        if !holds_its_fields(opcode, content) {
            return None;
        }
        if let Some(summary) = &mut summary {
            take_summary_record(summary, opcode, content).ok()?;
        }
        rest = after;
    }
    summary
}

/// Takes a record of the summary.
fn take_summary_record(summary: &mut Summary, opcode: u8, content: &[u8]) -> Result<(), McapError> {
    match parse(opcode, content)? {
        Record::AttachmentIndex(index) => summary.attachment_indexes.push(index),
        Record::MetadataIndex(index) => summary.metadata_indexes.push(index),
        Record::Statistics(statistics) => summary.stats = Some(statistics),
        Record::ChunkIndex(index) => summary.chunk_indexes.push(index),
        Record::Schema { .. } | Record::Channel(_) => take_definition(summary, opcode, content)?,
        _ => {}
    }
    Ok(())
}

/// Takes a schema, a channel, or the count of a message.
pub(super) fn take_definition(summary: &mut Summary, opcode: u8, data: &[u8]) -> Result<(), McapError> {
    if !matches!(opcode, op::SCHEMA | op::CHANNEL | op::MESSAGE) {
        return Ok(());
    }
    match parse(opcode, data)? {
        Record::Schema { header, data } => {
            let data = data.into_owned().into();
            let schema = Schema { id: header.id, name: header.name, encoding: header.encoding, data };
            summary.schemas.insert(schema.id, Arc::new(schema));
        }
        Record::Channel(channel) => {
            let schema = summary.schemas.get(&channel.schema_id).cloned();
            let channel = Channel {
                id: channel.id,
                topic: channel.topic,
                schema,
                message_encoding: channel.message_encoding,
                metadata: channel.metadata,
            };
            summary.channels.insert(channel.id, Arc::new(channel));
        }
        Record::Message { header, .. } => {
            let counts = summary.stats.get_or_insert_default();
            *counts.channel_message_counts.entry(header.channel_id).or_default() += 1;
        }
        _ => {}
    }
    Ok(())
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
