//! MEDIT files in binary (`.meshb`).
//!
//! ```text
//! 1, version             integers of 32 bits; the first tells the byte order
//! keyword, next, …       32 bits; the place of the next keyword has 32 bits up to version 2, else 64; 0 is the last
//!   Dimension (3)        dimension
//!   Vertices (4)         count, then x y z reference
//!   Tetrahedra (8) …     count, then vertices from 1, reference
//! ```
//!
//! Coordinates have 32 bits in version 1, else 64; counts, vertices and references 64 bits in version 4, else 32.
//!
//! Reference: L. Maréchal, The LibMeshb library (GMF), <https://github.com/LoicMarechal/libMeshb>.

use super::{Content, ELEMENTS};
use crate::elements::Shape;
use crate::error::MeshError;
use crate::scan::Number::{F32, F64, I32, I64};
use crate::scan::{Encoding, Number, Scanner};
use crate::volume_mesh::VolumeFile;
use glam::DVec3;
use std::path::Path;

/// Numbers of the keywords of vertices and of the end.
const VERTICES: i64 = 4;
const DIMENSION: i64 = 3;
const END: i64 = 54;

/// Keywords of elements, by their names in [`ELEMENTS`].
const KEYWORDS: &[(i64, &str)] = &[
    (5, "edges"),
    (6, "triangles"),
    (7, "quadrilaterals"),
    (8, "tetrahedra"),
    (9, "prisms"),
    (10, "hexahedra"),
    (24, "trianglesp2"),
    (25, "edgesp2"),
    (27, "quadrilateralsq2"),
    (30, "tetrahedrap2"),
    (33, "hexahedraq2"),
    (49, "pyramids"),
];

/// Newest version of the format.
const NEWEST: i64 = 4;

/// Whether a file begins as a binary MEDIT file: 1 in either byte order, and a version.
pub(crate) fn is_binary(bytes: &[u8]) -> bool {
    let word = |at: usize| bytes.get(at..at + 4).and_then(|four| four.first_chunk::<4>()).copied();
    let (Some(code), Some(version)) = (word(0), word(4)) else { return false };
    let within = |version: i32| (1..=NEWEST).contains(&i64::from(version));
    (i32::from_le_bytes(code) == 1 && within(i32::from_le_bytes(version)))
        || (i32::from_be_bytes(code) == 1 && within(i32::from_be_bytes(version)))
}

struct Reader<'a> {
    scan: Scanner<'a>,
    /// Types of places, of counts and other integers, and of coordinates.
    place: Number,
    integer: Number,
    real: Number,
    content: Content,
}

/// Reads the bytes of a MEDIT file in binary; `path` is for messages.
pub(crate) fn parse_binary(bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    scan.encoding = if bytes.first() == Some(&1) { Encoding::LittleEndian } else { Encoding::BigEndian };
    scan.integer(I32, "the integer 1")?;
    let version = scan.integer(I32, "a version")?;
    let mut reader = Reader {
        scan,
        place: if version <= 2 { I32 } else { I64 },
        integer: if version >= 4 { I64 } else { I32 },
        real: if version == 1 { F32 } else { F64 },
        content: Content::default(),
    };
    reader.read()?;
    Ok(reader.content.into_file(format!("MEDIT {version}, binary")))
}

impl Reader<'_> {
    fn read(&mut self) -> Result<(), MeshError> {
        let mut at = 8;
        loop {
            self.scan.go_to(at);
            let keyword = self.scan.integer(I32, "a keyword")?;
            let next = self.scan.unsigned(self.place, "the place of the next keyword")?;
            match keyword {
                END => break,
                DIMENSION => {
                    let dimension = self.scan.integer(I32, "the dimension")?;
                    if dimension != 3 {
                        return self.scan.fail(format!("the dimension is {dimension}, expected 3"));
                    }
                }
                VERTICES if !self.content.positions.is_empty() => {
                    return self.scan.fail("Vertices are in the file twice");
                }
                VERTICES => self.read_vertices()?,
                _ => {
                    let name = KEYWORDS.iter().find(|(number, _)| *number == keyword).map(|(_, name)| name);
                    let known = name.and_then(|name| ELEMENTS.iter().find(|(own, ..)| own == name));
                    if let Some(&(_, shape, size, group)) = known {
                        self.read_elements(shape, size, group)?;
                    }
                }
            }
            // Ascending places, so that a file can't send us round.
            match usize::try_from(next) {
                Ok(0) => break,
                Ok(place) if place > at && place <= self.scan.file_size() => at = place,
                _ => return self.scan.fail(format!("the next keyword is said to be at byte {next}")),
            }
        }
        if self.content.positions.is_empty() {
            return self.scan.fail("the file has no Vertices");
        }
        Ok(())
    }

    fn read_vertices(&mut self) -> Result<(), MeshError> {
        let stated = self.scan.unsigned(self.integer, "the number of vertices")?;
        let count = self.scan.count(stated, 3 * self.real.bytes() + self.integer.bytes(), "vertices")?;
        self.content.positions.reserve(count);
        for _ in 0..count {
            let mut coordinate = || self.scan.real(self.real, "a coordinate");
            let position = DVec3::new(coordinate()?, coordinate()?, coordinate()?);
            let reference = self.scan.integer(self.integer, "the reference of a vertex")?;
            self.content.add_vertex(position, reference);
        }
        Ok(())
    }

    fn read_elements(&mut self, shape: Shape, size: usize, group: &'static str) -> Result<(), MeshError> {
        if self.content.positions.is_empty() {
            return self.scan.fail(format!("the {} come before Vertices", shape.name()));
        }
        let stated = self.scan.unsigned(self.integer, "the number of elements")?;
        let count = self.scan.count(stated, (size + 1) * self.integer.bytes(), shape.name())?;
        let mut nodes = [0; 27];
        let nodes = &mut nodes[..size];
        for _ in 0..count {
            for node in nodes.iter_mut() {
                let number = self.scan.unsigned(self.integer, "a vertex of an element")?;
                *node = self.content.vertex(number).or_else(|what| self.scan.fail(what))?;
            }
            let reference = self.scan.integer(self.integer, "the reference of an element")?;
            self.content.add_element(shape, group, nodes, reference);
        }
        Ok(())
    }
}
