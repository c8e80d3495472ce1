//! Scanner of the mesh readers: a cursor over the bytes of a file that reads words and numbers, as text or binary,
//! never past the end, and knows the position for an error.

use std::path::Path;
use std::str::FromStr;

use super::error::{FilePosition, MeshError};
use super::volume_mesh::Region;

/// Encoding of numbers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    LittleEndian,
    BigEndian,
}

/// Type of a number in a binary file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Number {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Number {
    pub fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    pub fn bytes(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }
}

/// Cursor over the bytes of a mesh file.
pub(super) struct Scanner<'a> {
    bytes: &'a [u8],
    at: usize,
    /// Offset of the last word or number: the position of an error.
    token_start: usize,
    path: &'a Path,
    pub encoding: Encoding,
}

impl<'a> Scanner<'a> {
    /// At the start of a file, as text, past a byte-order mark.
    pub fn new(bytes: &'a [u8], path: &'a Path) -> Self {
        let at = if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        Self { bytes, at, token_start: at, path, encoding: Encoding::Text }
    }

    /// Moves to a byte of the file.
    pub fn go_to(&mut self, at: usize) {
        self.at = at;
    }

    pub fn is_text(&self) -> bool {
        self.encoding == Encoding::Text
    }

    /// Whether nothing is left.
    pub fn is_at_end(&self) -> bool {
        self.rest().is_empty()
    }

    /// Size of the file [bytes].
    pub fn file_size(&self) -> usize {
        self.bytes.len()
    }

    /// Offset of the last word or number [bytes], for [`Scanner::error_at`].
    pub fn token_start(&self) -> usize {
        self.token_start
    }

    fn rest(&self) -> &'a [u8] {
        self.bytes.get(self.at..).unwrap_or_default()
    }

    /// Error at the last word or number.
    pub fn error(&self, message: impl Into<String>) -> MeshError {
        self.error_at(self.token_start, message)
    }

    /// Error at a byte of the file: in text the line is named instead.
    pub fn error_at(&self, at: usize, message: impl Into<String>) -> MeshError {
        let position = if self.is_text() {
            let before = self.bytes.get(..at).unwrap_or(self.bytes);
            let before = if at < self.bytes.len() { before } else { before.trim_ascii_end() };
            let lines_before = before.iter().filter(|&&byte| byte == b'\n').count();
            FilePosition::Line(lines_before + 1)
        } else {
            FilePosition::Byte(at)
        };
        MeshError::Format { path: self.path.to_path_buf(), position, message: message.into() }
    }

    /// [`Scanner::error`] as a result.
    pub fn fail<T>(&self, message: impl Into<String>) -> Result<T, MeshError> {
        Err(self.error(message))
    }

    /// Error at the last word, which is not the expected one.
    pub fn unexpected(&self, expected: &str, found: &[u8]) -> MeshError {
        let found = match found {
            [] if self.rest().is_empty() => "the end of the file".to_owned(),
            [] => "the end of the line".to_owned(),
            word => quoted(word),
        };
        self.error(format!("expected {expected}, found {found}"))
    }

    /// Skips spaces and line ends.
    pub fn skip_blank(&mut self) {
        let blank = self.rest().iter().take_while(|b| b.is_ascii_whitespace());
        self.at += blank.count();
    }

    fn skip_spaces(&mut self) {
        let is_space = |b: &&u8| b.is_ascii_whitespace() && **b != b'\n';
        self.at += self.rest().iter().take_while(is_space).count();
    }

    /// The next word, across line ends; empty at the end of the file.
    pub fn word(&mut self) -> &'a [u8] {
        self.skip_blank();
        self.word_in_line()
    }

    /// The next word of this line; empty at its end.
    pub fn word_in_line(&mut self) -> &'a [u8] {
        self.skip_spaces();
        let word = self.peek();
        self.token_start = self.at;
        self.at += word.len();
        word
    }

    /// Bytes up to the next space or line end, without moving.
    pub fn peek(&self) -> &'a [u8] {
        let rest = self.rest();
        let length = rest.iter().take_while(|b| !b.is_ascii_whitespace()).count();
        rest.get(..length).unwrap_or_default()
    }

    /// Skips this word, or fails; `expected` is for the error.
    pub fn expect_word(&mut self, word: &str, expected: &str) -> Result<(), MeshError> {
        let found = self.word();
        if found == word.as_bytes() {
            return Ok(());
        }
        Err(self.unexpected(expected, found))
    }

    /// Skips this word in upper or lower case, or fails.
    pub fn expect_keyword(&mut self, keyword: &str) -> Result<(), MeshError> {
        let found = self.word();
        if found.eq_ignore_ascii_case(keyword.as_bytes()) {
            return Ok(());
        }
        Err(self.unexpected(keyword, found))
    }

    /// Skips this word if it is the next on this line.
    pub fn skip_word_in_line(&mut self, word: &str) -> bool {
        self.skip_spaces();
        let is_next = self.peek() == word.as_bytes();
        if is_next {
            self.at += word.len();
        }
        is_next
    }

    /// Whether only spaces are left of this line.
    pub fn is_end_of_line(&mut self) -> bool {
        self.skip_spaces();
        self.peek().is_empty()
    }

    /// Rest of this line, trimmed; moves to the next line.
    pub fn rest_of_line(&mut self) -> &'a [u8] {
        self.token_start = self.at;
        let rest = self.rest();
        let length = rest.iter().take_while(|&&b| b != b'\n').count();
        self.at = (self.at + length + 1).min(self.bytes.len());
        rest.get(..length).unwrap_or_default().trim_ascii()
    }

    /// Moves to the next line; fails if words are left on this one.
    pub fn end_of_line(&mut self) -> Result<(), MeshError> {
        match self.word_in_line() {
            [] => {
                self.at = (self.at + 1).min(self.bytes.len());
                Ok(())
            }
            found => Err(self.unexpected("the end of the line", found)),
        }
    }

    /// As [`Scanner::end_of_line`] in a text file; a binary one has no lines.
    pub fn end_of_row(&mut self) -> Result<(), MeshError> {
        if self.is_text() { self.end_of_line() } else { Ok(()) }
    }

    /// Moves to the next line that is not blank in a text file; a binary one has no lines.
    pub fn start_of_row(&mut self) {
        if self.is_text() {
            self.skip_blank();
        }
    }

    /// Skips past `mark`, which is at the start of a line in a text file.
    pub fn skip_past(&mut self, mark: &[u8]) -> Result<(), MeshError> {
        let mut from = self.at;
        while let Some(distance) =
            self.bytes.get(from..).and_then(|rest| rest.windows(mark.len()).position(|window| window == mark))
        {
            let (start, end) = (from + distance, from + distance + mark.len());
            let starts_line = start == 0 || self.bytes.get(start - 1) == Some(&b'\n');
            let ends_word = self.bytes.get(end).is_none_or(u8::is_ascii_whitespace);
            if (starts_line || !self.is_text()) && ends_word {
                self.at = end;
                return Ok(());
            }
            from = end;
        }
        let mark = String::from_utf8_lossy(mark);
        Err(self.error_at(self.at, format!("this section has no {mark}")))
    }

    /// A number that is text in binary files too, on this line.
    pub fn text_number<T: FromStr>(&mut self, expected: &str) -> Result<T, MeshError> {
        let word = self.word_in_line();
        let number = std::str::from_utf8(word).ok().and_then(|w| w.parse().ok());
        number.ok_or_else(|| self.unexpected(expected, word))
    }

    /// The next bytes of a binary file, lowest first.
    pub fn binary<const N: usize>(&mut self, expected: &str) -> Result<[u8; N], MeshError> {
        self.token_start = self.at;
        let Some(&bytes) = self.rest().first_chunk::<N>() else {
            return Err(self.error(format!("expected {expected}, found the end of the file")));
        };
        self.at += N;
        let mut bytes = bytes;
        if self.encoding == Encoding::BigEndian {
            bytes.reverse();
        }
        Ok(bytes)
    }

    /// A whole number, stored like this in a binary file. Above `i64::MAX` it wraps around.
    #[inline]
    pub fn integer(&mut self, number: Number, expected: &str) -> Result<i64, MeshError> {
        Ok(match number {
            Number::F32 | Number::F64 => {
                return self.fail(format!("expected {expected}, found a type with fractions"));
            }
            Number::U64 if self.is_text() => self.text_number::<u64>(expected)? as i64,
            _ if self.is_text() => self.text_number(expected)?,
            Number::I8 => i8::from_le_bytes(self.binary(expected)?).into(),
            Number::U8 => u8::from_le_bytes(self.binary(expected)?).into(),
            Number::I16 => i16::from_le_bytes(self.binary(expected)?).into(),
            Number::U16 => u16::from_le_bytes(self.binary(expected)?).into(),
            Number::I32 => i32::from_le_bytes(self.binary(expected)?).into(),
            Number::U32 => u32::from_le_bytes(self.binary(expected)?).into(),
            Number::I64 => i64::from_le_bytes(self.binary(expected)?),
            Number::U64 => u64::from_le_bytes(self.binary(expected)?) as i64,
        })
    }

    /// A whole number that is not negative, stored like this in a binary file.
    #[inline]
    pub fn unsigned(&mut self, number: Number, expected: &str) -> Result<u64, MeshError> {
        let value = self.integer(number, expected)?;
        if number == Number::U64 {
            return Ok(value as u64);
        }
        u64::try_from(value).map_err(|_| self.error(format!("expected {expected}, found {value}")))
    }

    /// A number, stored like this in a binary file.
    #[inline]
    pub fn real(&mut self, number: Number, expected: &str) -> Result<f64, MeshError> {
        if self.is_text() {
            return self.text_number(expected);
        }
        Ok(match number {
            Number::F32 => f32::from_le_bytes(self.binary(expected)?).into(),
            Number::F64 => f64::from_le_bytes(self.binary(expected)?),
            integer => self.integer(integer, expected)? as f64,
        })
    }

    /// A stated count, if the rest of the file can hold that many items of this size.
    pub fn count(&self, stated: u64, bytes_each: usize, of: &str) -> Result<usize, MeshError> {
        let left = self.rest().len();
        let most = left / bytes_each.max(1) + 1;
        match usize::try_from(stated) {
            Ok(count) if count <= most => Ok(count),
            _ => Err(self.error(format!(
                "the file states {stated} {of}, more than its remaining {left} bytes can hold"
            ))),
        }
    }
}

/// Word of the file for a message, escaped and shortened.
pub(super) fn quoted(word: &[u8]) -> String {
    const SHOWN: usize = 32;
    let (shown, rest) = word.split_at(word.len().min(SHOWN));
    let more = if rest.is_empty() { "" } else { "..." };
    format!("'{}{more}'", String::from_utf8_lossy(shown).escape_debug())
}

/// The regions that tetrahedra with these tags need, by ascending tag, and the position of each
/// tetrahedron's region among them.
pub(super) fn regions(tet_tags: &[i64], name: impl Fn(i64) -> Option<String>) -> (Vec<Region>, Vec<u32>) {
    let mut tags = tet_tags.to_vec();
    tags.dedup();
    tags.sort_unstable();
    tags.dedup();
    let position = |tag| tags.partition_point(|&other| other < tag) as u32;
    let tet_regions = tet_tags.iter().map(|&tag| position(tag)).collect();
    let region = |&tag: &i64| Region { tag, name: name(tag), material: None };
    (tags.iter().map(region).collect(), tet_regions)
}

#[cfg(test)]
pub(super) mod tests {
    /// Random numbers for tests that damage files, the same at every run.
    pub struct XorShift(pub u64);

    impl XorShift {
        fn below(&mut self, limit: usize) -> usize {
            self.0 ^= self.0 << 13;
            self.0 ^= self.0 >> 7;
            self.0 ^= self.0 << 17;
            (self.0 >> 11) as usize % limit
        }

        /// The bytes with up to four of them changed, removed or inserted.
        pub fn damage(&mut self, bytes: &[u8]) -> Vec<u8> {
            let mut bytes = bytes.to_vec();
            for _ in 0..=self.below(4) {
                let at = self.below(bytes.len());
                match self.below(5) {
                    0 => bytes[at] ^= 1 << self.below(8),
                    1 => bytes[at] = b"0123456789-. \n$\0\xff"[self.below(17)],
                    2 => bytes.insert(at, b"0123456789-. \n$\0\xff"[self.below(17)]),
                    3 => drop(bytes.remove(at)),
                    _ => bytes[at] = self.below(256) as u8,
                }
            }
            bytes
        }
    }
}
