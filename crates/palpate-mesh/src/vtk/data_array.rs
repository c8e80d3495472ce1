//! Data arrays of VTK's XML files: text, base64 or raw, whole or in compressed blocks.
//!
//! ```text
//! whole        size (bytes), data
//! compressed   blocks, size of a block, size of the last one or 0, compressed size of each; the blocks
//! ```
//!
//! Sizes are of the type that `header_type` states. In base64 the sizes may be padded on their own.

use crate::error::{FilePosition, MeshError};
use crate::scan::{Encoding, Number, Scanner};
use base64::Engine;
use base64::alphabet;
use base64::engine::{DecodePaddingMode, GeneralPurpose, GeneralPurposeConfig};
use std::cell::Cell;
use std::io::Read;
use std::ops::Range;
use std::path::Path;

/// Base64 without padding: what is padded is cut before it is decoded.
const BASE64: GeneralPurpose = GeneralPurpose::new(
    &alphabet::STANDARD,
    GeneralPurposeConfig::new()
        .with_decode_padding_mode(DecodePaddingMode::RequireNone)
        .with_decode_allow_trailing_bits(true),
);

/// Bytes that compressed arrays may have together, per byte of the file and on top [bytes]: meshes compress by 3 to 20, regular grids by
/// more, and a file that expands without end is a bomb.
const COMPRESSED: [usize; 2] = [100, 64 << 20];

/// Those of arrays that are not compressed: they may overlap in appended data, but have no reason to.
const PLAIN: [usize; 2] = [2, 1 << 20];

/// Place of an array's content.
#[derive(Debug, Clone)]
pub(super) enum Place {
    /// Text of the element, with numbers.
    Text(Range<usize>),
    /// Text of the element, in base64.
    Base64(Range<usize>),
    /// Distance from the begin of the appended data.
    Appended(u64),
}

/// Declaration of an array.
#[derive(Debug, Clone)]
pub(super) struct DataArray {
    pub name: String,
    pub number: Number,
    /// Offset of the element in the file [bytes].
    pub at: usize,
    pub place: Place,
}

/// Encodings that the file states, and its bytes.
pub(super) struct Content<'a> {
    pub bytes: &'a [u8],
    pub path: &'a Path,
    pub byte_order: Encoding,
    /// Type of sizes.
    pub header: Number,
    pub is_compressed: bool,
    /// First byte of the appended data, and whether it is in base64.
    pub appended: Option<(usize, bool)>,
    /// Offsets of all arrays in the appended data, ascending.
    pub offsets: Vec<u64>,
    /// Bytes of all arrays so far.
    decoded: Cell<u64>,
}

impl<'a> Content<'a> {
    pub fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        Self {
            bytes,
            path,
            byte_order: Encoding::LittleEndian,
            header: Number::U32,
            is_compressed: false,
            appended: None,
            offsets: Vec::new(),
            decoded: Cell::new(0),
        }
    }

    /// Error at a byte of the file, in its text.
    pub fn error_at(&self, at: usize, message: impl Into<String>) -> MeshError {
        Scanner::new(self.bytes, self.path).error_at(at, message)
    }

    /// Counts bytes of an array before they are made; refuses more than a file of this size may have.
    fn allow(&self, array: &DataArray, bytes: u64) -> Result<(), MeshError> {
        let [times, free] = if self.is_compressed { COMPRESSED } else { PLAIN };
        let most = self.bytes.len().saturating_mul(times).saturating_add(free) as u64;
        self.decoded.set(self.decoded.get().saturating_add(bytes));
        if self.decoded.get() <= most {
            return Ok(());
        }
        Err(self.error(
            array,
            &format!("states {bytes} bytes more: the arrays would expand to more than {most} bytes"),
        ))
    }

    /// Error in an array.
    pub fn error(&self, array: &DataArray, message: &str) -> MeshError {
        self.error_at(array.at, format!("array '{}' {message}", array.name))
    }

    /// Numbers of an array; `expected` is their count, where it is known.
    pub fn numbers<T>(
        &self,
        array: &DataArray,
        expected: Option<u64>,
        number: impl Fn(&mut Scanner, Number) -> Result<T, MeshError>,
    ) -> Result<Vec<T>, MeshError> {
        let mut numbers = Vec::new();
        if let Place::Text(range) = &array.place {
            let mut scan = Scanner::new(self.bytes.get(..range.end).unwrap_or(self.bytes), self.path);
            scan.go_to(range.start);
            scan.skip_blank();
            while !scan.is_at_end() {
                numbers.push(number(&mut scan, array.number)?);
                scan.skip_blank();
            }
        } else {
            let decoded = self.decode(array)?;
            let size = array.number.bytes();
            if decoded.len() % size != 0 {
                let message = format!("has {} bytes, expected a multiple of {size}", decoded.len());
                return Err(self.error(array, &message));
            }
            let mut scan = Scanner::new(&decoded, self.path);
            // Bytes that look like a byte-order mark are none.
            scan.go_to(0);
            scan.encoding = self.byte_order;
            numbers.reserve_exact(decoded.len() / size);
            for _ in 0..decoded.len() / size {
                numbers.push(number(&mut scan, array.number)?);
            }
        }
        match expected {
            Some(expected) if numbers.len() as u64 != expected => {
                Err(self.error(array, &format!("has {} numbers, expected {expected}", numbers.len())))
            }
            _ => Ok(numbers),
        }
    }

    /// Bytes of an array that is no text.
    fn decode(&self, array: &DataArray) -> Result<Vec<u8>, MeshError> {
        let (stored, at) = match &array.place {
            Place::Text(_) => (Vec::new(), None),
            Place::Base64(range) => {
                (self.decode_base64(array, self.bytes.get(range.clone()).unwrap_or_default())?, None)
            }
            Place::Appended(offset) => {
                let Some((start, is_base64)) = self.appended else {
                    return Err(self.error(array, "is appended, and the file has no <AppendedData>"));
                };
                let begin = usize::try_from(*offset).ok().and_then(|offset| start.checked_add(offset));
                let Some(rest) = begin.and_then(|begin| self.bytes.get(begin..)) else {
                    let message = format!("has offset {offset}, behind the end of the file");
                    return Err(self.error(array, &message));
                };
                if is_base64 {
                    // Up to the next array, or to the end of the element.
                    let next = self.offsets.iter().find(|other| *other > offset);
                    let length = next.map_or(rest.len() as u64, |next| next - offset);
                    let text = rest.get(..length.try_into().unwrap_or(usize::MAX)).unwrap_or(rest);
                    (self.decode_base64(array, text)?, None)
                } else {
                    return self.unpack(array, rest, begin);
                }
            }
        };
        self.unpack(array, &stored, at)
    }

    /// Decodes base64 up to its end, with spaces, line ends and padding anywhere.
    fn decode_base64(&self, array: &DataArray, text: &[u8]) -> Result<Vec<u8>, MeshError> {
        let end = text.iter().position(|byte| *byte == b'<').unwrap_or(text.len());
        let text: Vec<u8> = text[..end].iter().copied().filter(|byte| !byte.is_ascii_whitespace()).collect();
        let mut decoded = Vec::with_capacity(text.len() / 4 * 3);
        for part in text.split(|byte| *byte == b'=').filter(|part| !part.is_empty()) {
            BASE64
                .decode_vec(part, &mut decoded)
                .map_err(|error| self.error(array, &format!("is no base64: {error}")))?;
        }
        Ok(decoded)
    }

    /// Removes the sizes and inflates the blocks; `at` is the offset in the file of raw data.
    fn unpack(&self, array: &DataArray, stored: &[u8], at: Option<usize>) -> Result<Vec<u8>, MeshError> {
        let cut = |what: &str| {
            let message = format!("array '{}' is cut: {what}", array.name);
            match at {
                Some(at) => MeshError::Format {
                    path: self.path.to_path_buf(),
                    position: FilePosition::Byte(at),
                    message,
                },
                None => self.error_at(array.at, message),
            }
        };
        let size = self.header.bytes();
        let header = |index: usize| {
            let mut scan = Scanner::new(stored, self.path);
            scan.encoding = self.byte_order;
            scan.go_to(index.saturating_mul(size));
            scan.unsigned(self.header, "a size").ok()
        };
        let Some(first) = header(0) else {
            // An empty array may have no sizes at all.
            return if stored.is_empty() { Ok(Vec::new()) } else { Err(cut("it has no size")) };
        };
        if !self.is_compressed {
            let length = usize::try_from(first).unwrap_or(usize::MAX);
            let left = stored.len() - size;
            let data = stored.get(size..).and_then(|data| data.get(..length));
            let Some(data) = data else {
                return Err(cut(&format!("it states {first} bytes, and {left} are left")));
            };
            self.allow(array, first)?;
            return Ok(data.to_vec());
        }
        let blocks = usize::try_from(first).unwrap_or(usize::MAX);
        if blocks > stored.len() / size {
            return Err(cut(&format!("it states {first} blocks")));
        }
        let (Some(block), Some(last)) = (header(1), header(2)) else {
            return Err(cut("it has no size of blocks"));
        };
        let mut inflated = Vec::new();
        let mut begin = (3 + blocks) * size;
        for index in 0..blocks {
            let length = header(3 + index).and_then(|length| usize::try_from(length).ok());
            let packed = length.and_then(|length| stored.get(begin..begin.checked_add(length)?));
            let Some(packed) = packed else {
                return Err(cut(&format!("block {index} of {blocks} is not whole")));
            };
            begin += packed.len();
            let expected = if index + 1 == blocks && last > 0 { last } else { block };
            self.inflate(array, packed, expected, &mut inflated)?;
        }
        Ok(inflated)
    }

    /// Inflates one zlib block of a stated size.
    fn inflate(
        &self,
        array: &DataArray,
        packed: &[u8],
        expected: u64,
        inflated: &mut Vec<u8>,
    ) -> Result<(), MeshError> {
        self.allow(array, expected)?;
        let before = inflated.len();
        let decoder = flate2::read::ZlibDecoder::new(packed);
        // One byte more shows a block that is longer than stated.
        let read = decoder.take(expected.saturating_add(1)).read_to_end(inflated);
        let found = (inflated.len() - before) as u64;
        match read {
            Ok(_) if found == expected => Ok(()),
            Ok(_) => {
                Err(self
                    .error(array, &format!("has a block of {found} bytes or more, which states {expected}")))
            }
            Err(error) => Err(self.error(array, &format!("has a damaged zlib block: {error}"))),
        }
    }
}
