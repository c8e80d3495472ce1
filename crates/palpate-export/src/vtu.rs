//! VTU files with a PVD index, which ParaView opens as a time series.
//!
//! Inline base64, float32, so that VTK and meshio both read it. Reference: VTK file formats, XML formats.

use crate::atomic_file::AtomicFile;
use crate::error::ExportError;
use crate::output_folder::OutputFolder;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// Cells of a grid.
#[derive(Debug, Clone, Copy)]
pub enum Cells<'a> {
    /// Triangles.
    Triangles(&'a [[u32; 3]]),
    /// One vertex cell per point.
    Points,
}

/// Point data.
pub struct Field {
    name: &'static str,
    components: usize,
    values: Vec<f32>,
}

/// Unstructured grid.
pub struct Grid<'a> {
    /// Points [m].
    pub points: Vec<DVec3>,
    /// Cells.
    pub cells: Cells<'a>,
    /// Point data.
    pub fields: Vec<Field>,
    /// Field data: scalars of the whole grid, by name.
    pub facts: Vec<(&'static str, f64)>,
}

/// Writer of a series of VTU files, all renamed to their final paths at the end.
pub struct VtuSeries {
    index: PathBuf,
    inputs: Vec<PathBuf>,
    /// Time [s], part and file, by entry of the index.
    entries: Vec<(f64, usize, String)>,
    files: Vec<AtomicFile>,
    // Dropped after the files.
    folder: OutputFolder,
}

impl Field {
    /// Vector per point.
    pub fn vectors(name: &'static str, values: impl IntoIterator<Item = DVec3>) -> Self {
        Self { name, components: 3, values: floats(values) }
    }

    /// Scalar per point.
    pub fn numbers(name: &'static str, values: impl IntoIterator<Item = f64>) -> Self {
        Self { name, components: 1, values: values.into_iter().map(|v| v as f32).collect() }
    }
}

impl VtuSeries {
    /// Creates the folder.
    ///
    /// # Errors
    /// As [`OutputFolder::create`].
    pub fn new(folder: &Path, index: &str, inputs: &[PathBuf]) -> Result<Self, ExportError> {
        let folder = OutputFolder::create(folder)?;
        let index = folder.path().join(index);
        Ok(Self { index, inputs: inputs.to_vec(), entries: Vec::new(), files: Vec::new(), folder })
    }

    /// Writes a grid as `NAME_NUMBER.vtu`; returns the file name.
    ///
    /// # Errors
    /// As [`AtomicFile::create`].
    pub fn write(&mut self, name: &str, number: usize, grid: &Grid) -> Result<String, ExportError> {
        let name = format!("{name}_{number:05}.vtu");
        let text = document(grid);
        self.write_as(&self.folder.path().join(&name), text.as_bytes())?;
        Ok(name)
    }

    /// Adds an entry to the index.
    pub fn show(&mut self, time_s: f64, part: usize, name: String) {
        self.entries.push((time_s, part, name));
    }

    fn write_as(&mut self, path: &Path, bytes: &[u8]) -> Result<(), ExportError> {
        let inputs: Vec<&Path> = self.inputs.iter().map(PathBuf::as_path).collect();
        let mut file = AtomicFile::create(path, &inputs)?;
        file.write(bytes)?;
        file.close()?;
        self.files.push(file);
        Ok(())
    }

    /// Writes the index, and renames all files; returns the path of the index.
    ///
    /// # Errors
    /// When the system refuses.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
        );
        for (time, part, name) in &self.entries {
            text.push_str(&format!("<DataSet timestep=\"{time}\" part=\"{part}\" file=\"{name}\"/>\n"));
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        let index = self.index.clone();
        self.write_as(&index, text.as_bytes())?;
        // The index is last: the files that it lists exist.
        for file in self.files.drain(..) {
            file.finish()?;
        }
        Ok(index)
    }
}

fn floats(vectors: impl IntoIterator<Item = DVec3>) -> Vec<f32> {
    // −0 + 0 = 0.
    vectors.into_iter().flat_map(|v| v.to_array()).map(|v| v as f32 + 0.0).collect()
}

/// XML document of a grid.
fn document(grid: &Grid) -> String {
    let mut text = String::new();
    // A string takes every write.
    let _ = write_document(&mut text, grid);
    text
}

fn write_document(text: &mut String, grid: &Grid) -> std::fmt::Result {
    // VTK cell types of triangle and vertex.
    let (kind, corners, connectivity) = match grid.cells {
        Cells::Triangles(triangles) => (5_u8, 3, triangles.iter().flatten().copied().collect()),
        Cells::Points => (1_u8, 1, (0..grid.points.len() as u32).collect::<Vec<u32>>()),
    };
    let cells = connectivity.len() / corners;
    let array = |name: &str, kind: &str, components: usize, data: Vec<u8>| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">{}</DataArray>",
            encoded(data)
        )
    };
    let bytes = |values: &[f32]| values.iter().flat_map(|v| v.to_le_bytes()).collect();
    writeln!(text, "<?xml version=\"1.0\"?>")?;
    writeln!(
        text,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(text, "<UnstructuredGrid>")?;
    if !grid.facts.is_empty() {
        write!(text, "<FieldData>")?;
        for (name, value) in &grid.facts {
            let data = encoded(value.to_le_bytes().to_vec());
            write!(
                text,
                "<DataArray type=\"Float64\" Name=\"{name}\" NumberOfTuples=\"1\" format=\"binary\">{data}</DataArray>"
            )?;
        }
        writeln!(text, "</FieldData>")?;
    }
    writeln!(text, "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{cells}\">", grid.points.len())?;
    match grid.fields.iter().find(|field| field.components == 3) {
        Some(field) => write!(text, "<PointData Vectors=\"{}\">", field.name)?,
        None => write!(text, "<PointData>")?,
    }
    for Field { name, components, values } in &grid.fields {
        write!(text, "{}", array(name, "Float32", *components, bytes(values)))?;
    }
    writeln!(text, "</PointData>")?;
    let points = floats(grid.points.iter().copied());
    writeln!(text, "<Points>{}</Points>", array("Points", "Float32", 3, bytes(&points)))?;
    let offsets = (1..=cells).flat_map(|cell| ((corners * cell) as i64).to_le_bytes()).collect();
    writeln!(
        text,
        "<Cells>{}{}{}</Cells>",
        array(
            "connectivity",
            "Int64",
            1,
            connectivity.iter().flat_map(|&n| i64::from(n).to_le_bytes()).collect()
        ),
        array("offsets", "Int64", 1, offsets),
        array("types", "UInt8", 1, vec![kind; cells])
    )?;
    writeln!(text, "</Piece></UnstructuredGrid></VTKFile>")
}

/// Length and data in base64.
fn encoded(data: Vec<u8>) -> String {
    let mut bytes = (data.len() as u64).to_le_bytes().to_vec();
    bytes.extend(data);
    STANDARD.encode(bytes)
}
