//! State of a reader, its points and number types, and the mesh at the end.

use super::cell_types::ignored_cells;
use super::labels::Labels;
use crate::elements::Elements;
use crate::error::MeshError;
use crate::scan::{Number, Scanner, quoted};
use crate::volume_mesh::VolumeFile;
use glam::DVec3;

/// Points of all cells, and the end of each cell among them.
pub(super) struct Cells {
    pub(super) ends: Vec<usize>,
    pub(super) points: Vec<u32>,
}

/// Owner of the arrays that follow, and its number of tuples.
#[derive(Clone, Copy)]
pub(super) enum ArraysOf {
    File,
    Points(usize),
    Cells(usize),
}

pub(super) struct Reader<'a> {
    pub(super) scan: Scanner<'a>,
    pub(super) points: Option<Vec<DVec3>>,
    pub(super) cells: Option<Cells>,
    pub(super) elements: Option<Elements>,
    pub(super) arrays_of: ArraysOf,
    pub(super) labels: Labels,
    /// Version in the header, as in "3.0".
    pub(super) version: String,
}

impl<'a> Reader<'a> {
    /// The next word that is not in a `METADATA` block, which ends with a blank line.
    pub(super) fn keyword(&mut self) -> &'a [u8] {
        loop {
            let word = self.scan.word();
            if !word.eq_ignore_ascii_case(b"METADATA") {
                return word;
            }
            self.scan.rest_of_line();
            while !self.scan.rest_of_line().is_empty() {}
        }
    }

    pub(super) fn read_points(&mut self) -> Result<(), MeshError> {
        if self.points.is_some() {
            return self.scan.fail("POINTS is in the file twice");
        }
        let stated = self.scan.text_number("the number of points")?;
        let number = self.number_type()?;
        let count = self.scan.count(stated, 3 * self.least_bytes(number), "points")?;
        self.scan.end_of_line()?;
        if u32::try_from(count).is_err() {
            return self.scan.fail(format!("{count} points are more than can be numbered"));
        }
        let mut points = Vec::with_capacity(count);
        for _ in 0..count {
            let mut coordinate = || {
                self.scan.start_of_row();
                self.scan.real(number, "a coordinate")
            };
            points.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
        }
        self.points = Some(points);
        Ok(())
    }

    /// A whole number; in a text file it may be on a later line.
    pub(super) fn integer(&mut self, number: Number, expected: &str) -> Result<i64, MeshError> {
        self.scan.start_of_row();
        self.scan.integer(number, expected)
    }

    /// Least size of a number of this type [bytes].
    pub(super) fn least_bytes(&self, number: Number) -> usize {
        if self.scan.is_text() { 2 } else { number.bytes() }
    }

    /// The name of a number type.
    pub(super) fn number_type(&mut self) -> Result<Number, MeshError> {
        let name = self.scan.word_in_line();
        Ok(match name.to_ascii_lowercase().as_slice() {
            b"bit" if self.scan.is_text() => Number::U8,
            b"char" | b"signed_char" | b"vtktypeint8" => Number::I8,
            b"unsigned_char" | b"vtktypeuint8" => Number::U8,
            b"short" | b"vtktypeint16" => Number::I16,
            b"unsigned_short" | b"vtktypeuint16" => Number::U16,
            // In legacy files vtkIdType is a C int.
            b"int" | b"vtkidtype" | b"vtktypeint32" => Number::I32,
            b"unsigned_int" | b"vtktypeuint32" => Number::U32,
            b"long" | b"long_long" | b"vtktypeint64" => Number::I64,
            b"unsigned_long" | b"unsigned_long_long" | b"vtktypeuint64" => Number::U64,
            b"float" => Number::F32,
            b"double" => Number::F64,
            b"bit" | b"string" | b"utf8_string" | b"variant" => {
                let name = quoted(name);
                let message = format!("arrays of type {name} cannot be read: save as ASCII");
                return self.scan.fail(message);
            }
            _ => return Err(self.scan.unexpected("a number type such as double", name)),
        })
    }

    /// The mesh, at the end of the file.
    pub(super) fn assemble(self) -> Result<VolumeFile, MeshError> {
        let (nodes, elements) = match (self.points, self.elements) {
            (Some(points), Some(elements)) => (points, elements),
            (None, _) => return self.scan.fail("the file has no POINTS"),
            (_, None) => return self.scan.fail("the file has no CELL_TYPES"),
        };
        let mut labels = self.labels;
        let groups = std::mem::take(&mut labels.groups);
        let encoding = if self.scan.is_text() { "text" } else { "binary" };
        let format = format!("VTK legacy {}, {encoding}", self.version);
        labels.warnings.extend(ignored_cells(&elements));
        let mut file = elements.into_file(format, nodes, groups, |cell| labels.region(cell), |_| None);
        file.mesh.warnings.extend(labels.warnings);
        Ok(file)
    }
}
