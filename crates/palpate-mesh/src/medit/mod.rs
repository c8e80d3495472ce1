//! MEDIT files in text (`.mesh`) and binary (`.meshb`), as TetGen, fTetWild, MMG, Gmsh and CGAL write them.
//!
//! ```text
//! MeshVersionFormatted 2   Dimension 3
//! Vertices n      x y z reference
//! Tetrahedra m    four vertices from 1, reference
//! ```
//!
//! References of solids are regions; those of faces, edges and vertices that are not 0 are groups, called `faces:3`.
//!
//! Reference: P. Frey, MEDIT: an interactive mesh visualization software, INRIA RT-0253 (2001), appendix.

mod binary;

pub(crate) use binary::{is_binary, parse_binary};

use crate::elements::{Elements, Shape};
use crate::error::MeshError;
use crate::mid_edge::sort_by_edges;
use crate::rows::{Rows, Words};
use crate::scan::quoted;
use crate::volume_mesh::{NodeGroup, VolumeFile};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Sections with elements: shape, number of vertices, name of groups.
#[rustfmt::skip]
const ELEMENTS: &[(&str, Shape, usize, &str)] = &[
    ("edges", Shape::Line, 2, "edges"), ("edgesp2", Shape::Line, 3, "edges"),
    ("triangles", Shape::Triangle, 3, "faces"), ("trianglesp2", Shape::Triangle, 6, "faces"),
    ("quadrilaterals", Shape::Quadrilateral, 4, "faces"), ("quadrilateralsq2", Shape::Quadrilateral, 9, "faces"),
    ("tetrahedra", Shape::Tetrahedron, 4, ""), ("tetrahedrap2", Shape::Tetrahedron, 10, ""),
    ("hexahedra", Shape::Hexahedron, 8, ""), ("hexahedraq2", Shape::Hexahedron, 27, ""), ("hexaedra", Shape::Hexahedron, 8, ""),
    ("prisms", Shape::Wedge, 6, ""), ("pentahedra", Shape::Wedge, 6, ""), ("prismsp2", Shape::Wedge, 18, ""),
    ("pyramids", Shape::Pyramid, 5, ""), ("pyramidsp2", Shape::Pyramid, 14, ""),
];

/// Vertices and elements of a file.
#[derive(Default)]
struct Content {
    positions: Vec<DVec3>,
    elements: Elements,
    /// Region of each solid.
    regions: Vec<i64>,
    /// Nodes by the name and the reference of a group.
    groups: BTreeMap<(&'static str, i64), Vec<u32>>,
}

impl Content {
    fn add_vertex(&mut self, position: DVec3, reference: i64) {
        if reference != 0 {
            self.groups.entry(("vertices", reference)).or_default().push(self.positions.len() as u32);
        }
        self.positions.push(position);
    }

    /// Number of a vertex that a file counts from 1.
    fn vertex(&self, number: u64) -> Result<u32, String> {
        let vertices = self.positions.len();
        if number == 0 || number > vertices as u64 {
            return Err(format!("an element has vertex {number}, expected 1 to {vertices}"));
        }
        Ok((number - 1) as u32)
    }

    fn add_element(&mut self, shape: Shape, group: &'static str, nodes: &mut [u32], reference: i64) {
        if shape.dimension() < 3 {
            self.elements.count(shape);
            if reference != 0 {
                self.groups.entry((group, reference)).or_default().extend(nodes.iter());
            }
            return;
        }
        // Writers differ in the order of the edges of P2.
        let is_sorted =
            <&mut [u32; 10]>::try_from(&mut *nodes).is_ok_and(|ten| sort_by_edges(&self.positions, ten));
        let used = if shape == Shape::Tetrahedron && !is_sorted { 4 } else { nodes.len() };
        self.elements.add(shape, &nodes[..used], self.regions.len() as u32);
        self.regions.push(reference);
    }

    fn into_file(self, format: String) -> VolumeFile {
        let Self { positions, elements, regions, groups } = self;
        let groups = groups.into_iter().map(|((name, reference), mut nodes)| {
            nodes.sort_unstable();
            nodes.dedup();
            NodeGroup { name: format!("{name}:{reference}"), nodes }
        });
        let region = |solid: u32| regions.get(solid as usize).copied().unwrap_or(0);
        elements.into_file(format, positions, groups.collect(), region, |_| None)
    }
}

/// Words of a file, across its rows.
struct Reader<'a> {
    rows: Rows<'a>,
    words: Words<'a>,
    content: Content,
}

/// Reads the bytes of a MEDIT file in text; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut reader =
        Reader { rows: Rows::new(bytes, path, "#"), words: Words(&[]), content: Content::default() };
    reader.read()?;
    Ok(reader.content.into_file("MEDIT, text".into()))
}

impl<'a> Reader<'a> {
    /// The next word; empty at the end of the file.
    fn word(&mut self) -> &'a [u8] {
        loop {
            if let Some(word) = self.words.next() {
                return word;
            }
            match self.rows.next() {
                [] => return &[],
                row => self.words = Words(row),
            }
        }
    }

    fn number<T: std::str::FromStr>(&mut self, expected: &str) -> Result<T, MeshError> {
        match self.word() {
            [] => self.rows.scan.fail(format!("expected {expected}, found the end of the file")),
            word => self.rows.parse(word, expected),
        }
    }

    fn read(&mut self) -> Result<(), MeshError> {
        let mut has_vertices = false;
        loop {
            let word = self.word();
            let keyword = String::from_utf8_lossy(word).to_ascii_lowercase();
            let elements = ELEMENTS.iter().find(|(name, ..)| *name == keyword);
            match (keyword.as_str(), elements) {
                ("" | "end", _) => break,
                ("meshversionformatted", _) => drop(self.number::<u32>("a version")?),
                ("dimension", _) => {
                    let dimension: u32 = self.number("the dimension")?;
                    if dimension != 3 {
                        return self.rows.scan.fail(format!("the dimension is {dimension}, expected 3"));
                    }
                }
                ("vertices", _) if has_vertices => {
                    return self.rows.scan.fail("Vertices are in the file twice");
                }
                ("vertices", _) => {
                    has_vertices = true;
                    self.read_vertices()?;
                }
                (_, Some(&(_, shape, size, group))) => {
                    if !has_vertices {
                        let name = quoted(word);
                        return self.rows.scan.fail(format!("the section {name} comes before Vertices"));
                    }
                    self.read_elements(shape, size, group)?;
                }
                // Ridges, corners, normals and the like: their numbers are skipped.
                _ if keyword.starts_with(|c: char| c.is_ascii_alphabetic()) || is_number(word) => {}
                _ => {
                    let found = quoted(word);
                    return self
                        .rows
                        .scan
                        .fail(format!("expected a section such as Vertices, found {found}"));
                }
            }
        }
        if !has_vertices {
            return self.rows.scan.fail("the file has no Vertices");
        }
        Ok(())
    }

    fn read_vertices(&mut self) -> Result<(), MeshError> {
        let stated = self.number("the number of vertices")?;
        let count = self.rows.scan.count(stated, 8, "vertices")?;
        self.content.positions.reserve(count);
        for _ in 0..count {
            let mut coordinate = || self.number("a coordinate");
            let position = DVec3::new(coordinate()?, coordinate()?, coordinate()?);
            let reference = self.number("the reference of a vertex")?;
            self.content.add_vertex(position, reference);
        }
        Ok(())
    }

    fn read_elements(&mut self, shape: Shape, size: usize, group: &'static str) -> Result<(), MeshError> {
        let stated = self.number("the number of elements")?;
        let count = self.rows.scan.count(stated, 2 * (size + 1), shape.name())?;
        let mut nodes = [0; 27];
        let nodes = &mut nodes[..size];
        for _ in 0..count {
            for node in nodes.iter_mut() {
                let number: u64 = self.number("a vertex of an element")?;
                *node = self.content.vertex(number).or_else(|what| self.rows.scan.fail(what))?;
            }
            let reference = self.number("the reference of an element")?;
            self.content.add_element(shape, group, nodes, reference);
        }
        Ok(())
    }
}

fn is_number(word: &[u8]) -> bool {
    std::str::from_utf8(word).is_ok_and(|text| text.parse::<f64>().is_ok())
}
