//! A chapter of the report, and its numbers.

use crate::findings::Finding;
use crate::page::Section;
use std::fmt::Write;

/// One part of the report.
pub struct Chapter {
    /// Section of the page.
    pub section: Section,
    /// Numbers behind it.
    pub data: Vec<DataFile>,
    /// Rows of the table at the top of the page.
    pub findings: Vec<Finding>,
}

/// A file of numbers beside the report.
pub struct DataFile {
    /// Its name.
    pub name: String,
    /// Its text.
    pub text: String,
}

/// Lines of comma-separated numbers under a header.
pub fn csv(name: &str, header: &str, rows: impl Iterator<Item = Vec<f64>>) -> DataFile {
    let mut text = format!("{header}\n");
    for row in rows {
        let numbers: Vec<String> = row.iter().map(f64::to_string).collect();
        let _ = writeln!(text, "{}", numbers.join(","));
    }
    DataFile { name: name.into(), text }
}
