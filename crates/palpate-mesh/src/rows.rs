//! Rows of a text file: lines without comments and blank ones, and the words in them.

use crate::error::MeshError;
use crate::scan::{Scanner, quoted};
use std::path::Path;
use std::str::FromStr;

/// Cursor over the rows of a text file.
pub(crate) struct Rows<'a> {
    pub scan: Scanner<'a>,
    comment: &'static str,
}

impl<'a> Rows<'a> {
    /// At the start of a file; `comment` begins a comment, up to the end of its line.
    pub fn new(bytes: &'a [u8], path: &'a Path, comment: &'static str) -> Self {
        Self { scan: Scanner::new(bytes, path), comment }
    }

    /// The next row, trimmed; empty at the end of the file.
    pub fn next(&mut self) -> &'a [u8] {
        while !self.scan.is_at_end() {
            let line = self.scan.rest_of_line();
            let comment =
                line.windows(self.comment.len()).position(|window| window == self.comment.as_bytes());
            let row = line.get(..comment.unwrap_or(line.len())).unwrap_or_default().trim_ascii();
            if !row.is_empty() {
                return row;
            }
        }
        self.scan.go_to(self.scan.file_size());
        &[]
    }

    /// The words of the next row; an error at the end of the file.
    pub fn words(&mut self, expected: &str) -> Result<Words<'a>, MeshError> {
        match self.next() {
            [] => Err(self
                .scan
                .error_at(self.scan.file_size(), format!("expected {expected}, found the end of the file"))),
            row => Ok(Words(row)),
        }
    }

    /// A number among words.
    pub fn number<T: FromStr>(&self, words: &mut Words<'a>, expected: &str) -> Result<T, MeshError> {
        self.parse(words.next().unwrap_or_default(), expected)
    }

    /// A number of a word.
    pub fn parse<T: FromStr>(&self, word: &[u8], expected: &str) -> Result<T, MeshError> {
        let number = std::str::from_utf8(word).ok().and_then(|text| text.parse().ok());
        number.ok_or_else(|| {
            let found = if word.is_empty() { "the end of the line".to_owned() } else { quoted(word) };
            self.scan.error(format!("expected {expected}, found {found}"))
        })
    }
}

/// Words of a row, between spaces and commas.
#[derive(Clone)]
pub(crate) struct Words<'a>(pub &'a [u8]);

impl<'a> Iterator for Words<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        let is_gap = |byte: &u8| byte.is_ascii_whitespace() || *byte == b',';
        let start = self.0.iter().position(|byte| !is_gap(byte))?;
        let rest = &self.0[start..];
        let end = rest.iter().position(is_gap).unwrap_or(rest.len());
        let (word, rest) = rest.split_at(end);
        self.0 = rest;
        Some(word)
    }
}
