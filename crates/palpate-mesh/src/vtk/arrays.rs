//! Arrays of a VTK legacy file: those that make regions and groups are kept, the others skipped.

use super::labels::is_region_array;
use super::reader::{ArraysOf, Reader};
use crate::error::MeshError;
use crate::scan::{Number, quoted};

impl Reader<'_> {
    /// `POINT_DATA` or `CELL_DATA`.
    pub(super) fn start_arrays(&mut self, keyword: &[u8]) -> Result<(), MeshError> {
        let points = self.points.as_ref().map(Vec::len);
        let cells = self.cells.as_ref().map(|cells| cells.ends.len());
        let (of, tuples, arrays_of) = match (keyword, points, cells) {
            (b"POINT_DATA", Some(points), _) => ("points", points, ArraysOf::Points(points)),
            (b"CELL_DATA", _, Some(cells)) => ("cells", cells, ArraysOf::Cells(cells)),
            _ => {
                return self.scan.fail("data comes before the points or cells it is of");
            }
        };
        let stated: usize = self.scan.text_number("the number of tuples")?;
        if stated != tuples {
            let message = format!("data of {stated} {of} is stated, and there are {tuples}");
            return self.scan.fail(message);
        }
        self.arrays_of = arrays_of;
        Ok(())
    }

    /// One array, or the several of a `FIELD`.
    pub(super) fn read_attribute(&mut self, keyword: &[u8]) -> Result<(), MeshError> {
        let fixed_components = match keyword {
            b"FIELD" | b"SCALARS" | b"TEXTURE_COORDINATES" | b"COLOR_SCALARS" => 0,
            b"GLOBAL_IDS" | b"PEDIGREE_IDS" | b"EDGE_FLAGS" => 1,
            b"VECTORS" | b"NORMALS" => 3,
            b"LOOKUP_TABLE" => 4,
            b"TENSORS6" => 6,
            b"TENSORS" => 9,
            other => return Err(self.scan.unexpected("a keyword such as POINT_DATA", other)),
        };
        let tuples = match self.arrays_of {
            ArraysOf::Points(count) | ArraysOf::Cells(count) => count as u64,
            ArraysOf::File if matches!(keyword, b"FIELD" | b"LOOKUP_TABLE") => 0,
            ArraysOf::File => {
                return self.scan.fail("an array comes before POINT_DATA and CELL_DATA");
            }
        };
        let name = self.scan.word_in_line();
        if keyword == b"FIELD" {
            let arrays: u64 = self.scan.text_number("the number of arrays")?;
            for _ in 0..arrays {
                self.read_field_array()?;
            }
            return Ok(());
        }

        let (number, components, tuples) = match keyword {
            b"SCALARS" => {
                let number = self.number_type()?;
                let components = if self.scan.is_end_of_line() {
                    1
                } else {
                    self.scan.text_number("the number of components")?
                };
                (number, components, tuples)
            }
            b"TEXTURE_COORDINATES" => {
                let components = self.scan.text_number("the number of components")?;
                (self.number_type()?, components, tuples)
            }
            b"COLOR_SCALARS" | b"LOOKUP_TABLE" => {
                let stated = self.scan.text_number("the number of colours")?;
                let number = if self.scan.is_text() { Number::F32 } else { Number::U8 };
                match keyword {
                    b"LOOKUP_TABLE" => (number, fixed_components, stated),
                    _ => (number, stated, tuples),
                }
            }
            _ => (self.number_type()?, fixed_components, tuples),
        };
        self.scan.end_of_line()?;
        if keyword == b"SCALARS" {
            self.scan.start_of_row();
            if self.scan.peek().eq_ignore_ascii_case(b"LOOKUP_TABLE") {
                self.scan.rest_of_line();
            }
        }
        let values = self.read_numbers(number, components, tuples)?;
        if keyword == b"SCALARS" && components == 1 {
            self.keep(name, number, values);
        }
        Ok(())
    }

    /// A row `name components tuples type`, then the numbers.
    pub(super) fn read_field_array(&mut self) -> Result<(), MeshError> {
        let name = self.keyword();
        if name == b"NULL_ARRAY" {
            return Ok(());
        }
        let components: u64 = self.scan.text_number("the number of components")?;
        let tuples = self.scan.text_number("the number of tuples")?;
        match self.arrays_of {
            ArraysOf::Points(expected) | ArraysOf::Cells(expected) if tuples != expected as u64 => {
                let name = quoted(name);
                let message = format!("array {name} has {tuples} tuples, expected {expected}");
                return self.scan.fail(message);
            }
            _ => {}
        }
        if self.scan.is_text() && self.scan.skip_word_in_line("string") {
            // A line for each.
            let strings = components.saturating_mul(tuples);
            let strings = self.scan.count(strings, 1, "strings")?;
            self.scan.end_of_line()?;
            for _ in 0..strings {
                self.scan.rest_of_line();
            }
            return Ok(());
        }
        let number = self.number_type()?;
        self.scan.end_of_line()?;
        let values = self.read_numbers(number, components, tuples)?;
        if components == 1 {
            self.keep(name, number, values);
        }
        Ok(())
    }

    /// Keeps the values of an array, if they are a group or the regions.
    fn keep(&mut self, name: &[u8], number: Number, values: Vec<i64>) {
        let name = decoded(name);
        let labels = &mut self.labels;
        match self.arrays_of {
            ArraysOf::Points(_) if number.is_integer() => labels.keep_points(name, &values, 0),
            ArraysOf::Cells(_) if is_region_array(&name) && !number.is_integer() => {
                labels.refuse_fractions(&name);
            }
            ArraysOf::Cells(_) if is_region_array(&name) && labels.regions.is_none() => {
                labels.regions = Some(values);
            }
            _ => {}
        }
    }

    /// The numbers of an array; empty for one that is not of integers.
    fn read_numbers(&mut self, number: Number, components: u64, tuples: u64) -> Result<Vec<i64>, MeshError> {
        let count = components.saturating_mul(tuples);
        let count = self.scan.count(count, self.least_bytes(number), "numbers")?;
        if !number.is_integer() {
            for _ in 0..count {
                self.scan.start_of_row();
                self.scan.real(number, "a number")?;
            }
            return Ok(Vec::new());
        }
        let mut values = Vec::with_capacity(count);
        for _ in 0..count {
            values.push(self.integer(number, "a whole number")?);
        }
        Ok(values)
    }
}

/// A name as VTK writes it, with `%20` for a space.
fn decoded(name: &[u8]) -> String {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name;
    while let Some((&byte, after)) = rest.split_first() {
        let digits = after.get(..2).filter(|_| byte == b'%');
        let digits = digits.and_then(|digits| std::str::from_utf8(digits).ok());
        let escaped = digits.and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(escaped.unwrap_or(byte));
        rest = match escaped {
            Some(_) => after.get(2..).unwrap_or_default(),
            None => after,
        };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}
