//! Lengths within MCAP records, checked before a record is parsed: the parser reserves as much memory as a string claims to have, up to
//! 4 GiB, before it looks whether the record holds it, and panics at an attachment that ends before its checksum.
//!
//! Reference: MCAP specification, records.

use mcap::McapError;
use mcap::read::parse_record;
use mcap::records::{Record, op};

/// Bytes of a record before its content: opcode and length.
pub(super) const RECORD_HEADER: usize = 1 + 8;

/// Field of a record.
#[derive(Debug, Clone, Copy)]
enum Field {
    /// Number of bytes.
    Fixed(usize),
    /// Length of 4 bytes, and as many bytes.
    Text,
    /// Length of 4 bytes, and texts of as many bytes.
    Texts,
}

/// First fields that every record of a kind has: up to its last text, and up to the checksum of an attachment.
const fn fields(opcode: u8) -> &'static [Field] {
    use Field::{Fixed, Text, Texts};
    match opcode {
        op::HEADER => &[Text, Text],
        op::SCHEMA => &[Fixed(2), Text, Text, Text],
        op::CHANNEL => &[Fixed(4), Text, Text, Texts],
        op::CHUNK => &[Fixed(28), Text],
        op::CHUNK_INDEX => &[Fixed(32), Text, Fixed(8), Text],
        op::ATTACHMENT => &[Fixed(16), Text, Text, Fixed(12)],
        op::ATTACHMENT_INDEX => &[Fixed(40), Text, Text],
        op::STATISTICS => &[Fixed(42), Text],
        op::METADATA => &[Text, Texts],
        op::METADATA_INDEX => &[Fixed(16), Text],
        _ => &[],
    }
}

/// Bytes after a text; none if it is longer than they are.
fn after_text(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}

/// Whether the content of a record holds its first fields at the lengths that it claims.
pub(super) fn holds_its_fields(opcode: u8, content: &[u8]) -> bool {
    let mut rest = content;
    for field in fields(opcode) {
        let after = match field {
            Field::Fixed(length) => rest.split_at_checked(*length),
            Field::Text | Field::Texts => after_text(rest),
        };
        let Some((own, after)) = after else { return false };
        let mut texts = if matches!(field, Field::Texts) { own } else { &[] };
        while !texts.is_empty() {
            let Some((_, after)) = after_text(texts) else { return false };
            texts = after;
        }
        rest = after;
    }
    true
}

/// Parses a record whose lengths fit.
///
/// # Errors
/// If they don't, or if its content is not that of such a record.
pub(super) fn parse(opcode: u8, content: &[u8]) -> Result<Record<'_>, McapError> {
    if holds_its_fields(opcode, content) {
        parse_record(opcode, content)
    } else {
        Err(McapError::UnexpectedEof)
    }
}

/// Parses the record at an offset of a file.
///
/// # Errors
/// If there is none, as where the index of a damaged summary points to, or if its lengths don't fit.
pub(super) fn record_at(bytes: &[u8], offset: u64) -> Result<Record<'_>, McapError> {
    let record = usize::try_from(offset).ok().and_then(|offset| bytes.get(offset..));
    let record = record.and_then(|record| Some((*record.first()?, split_record(record)?.0)));
    let (opcode, content) = record.ok_or(McapError::BadIndex)?;
    parse(opcode, content)
}

/// Content of the first record, and the bytes after it; none if it is longer than they are.
pub(super) fn split_record(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (header, rest) = bytes.split_first_chunk::<RECORD_HEADER>()?;
    let length = u64::from_le_bytes(*header.last_chunk::<8>()?);
    rest.split_at_checked(usize::try_from(length).ok()?)
}
