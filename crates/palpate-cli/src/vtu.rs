//! Deformed surfaces as VTU files with a PVD index: what ParaView opens as a movie.
//!
//! Inline base64, float32, so that VTK and meshio both read it. Reference: VTK file formats, XML formats.

use crate::Failure;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::DVec3;
use palpate::{Model, State};
use std::fmt::Write;
use std::path::{Path, PathBuf};

/// A series of frames of all objects of a scene.
pub struct VtuSeries {
    folder: PathBuf,
    names: Vec<String>,
    /// Time [s], object and file of each written frame.
    written: Vec<(f64, usize, String)>,
    frames: usize,
    displacement: Vec<DVec3>,
}

impl VtuSeries {
    /// Make the folder.
    pub fn new(folder: &Path, names: Vec<String>) -> Result<Self, Failure> {
        std::fs::create_dir_all(folder).map_err(|e| Failure::file("make the folder", folder, &e))?;
        Ok(Self {
            folder: folder.to_path_buf(),
            names,
            written: Vec::new(),
            frames: 0,
            displacement: Vec::new(),
        })
    }

    /// Number of frames so far.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Write the present state.
    pub fn write_frame(&mut self, model: &Model, state: &State) -> Result<(), Failure> {
        let output = state.output();
        for (object, recording) in model.recordings().enumerate() {
            let surface = &recording.surface;
            self.displacement.resize(surface.positions.len(), DVec3::ZERO);
            state.surface_displacement(model, object, &mut self.displacement);
            let pose = output.objects[object].pose;
            let deformed = surface.positions.iter().zip(&self.displacement);
            let points: Vec<f32> = deformed
                .flat_map(|(rest, u)| pose.world_from_body(*rest + *u).to_array())
                .map(|v| v as f32)
                .collect();
            let displacement: Vec<f32> = self
                .displacement
                .iter()
                .flat_map(|u| (pose.orientation * *u).to_array())
                .map(|v| v as f32)
                .collect();
            let name = format!("{}_{:05}.vtu", self.names[object], self.frames);
            let path = self.folder.join(&name);
            let text =
                document(&points, &displacement, &surface.triangles).map_err(|e| Failure(e.to_string()))?;
            std::fs::write(&path, text).map_err(|e| Failure::file("write", &path, &e))?;
            self.written.push((output.time_s, object, name));
        }
        self.frames += 1;
        Ok(())
    }

    /// Write the index; gives its path.
    pub fn finish(mut self) -> Result<PathBuf, Failure> {
        let mut text = String::from(
            "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
        );
        for (time, object, name) in &self.written {
            text.push_str(&format!("<DataSet timestep=\"{time}\" part=\"{object}\" file=\"{name}\"/>\n"));
        }
        text.push_str("</Collection>\n</VTKFile>\n");
        let path = self.folder.join("scene.pvd");
        std::fs::write(&path, text).map_err(|e| Failure::file("write", &path, &e))?;
        self.written.clear();
        Ok(path)
    }
}

impl Drop for VtuSeries {
    /// Frames of a run that failed go with it; after [`Self::finish`] there are none to remove.
    fn drop(&mut self) {
        for (_, _, name) in &self.written {
            let _ = std::fs::remove_file(self.folder.join(name));
        }
    }
}

/// One unstructured grid of triangles.
fn document(points: &[f32], displacement: &[f32], triangles: &[[u32; 3]]) -> Result<String, std::fmt::Error> {
    let floats = |values: &[f32]| encoded(values.iter().flat_map(|v| v.to_le_bytes()).collect());
    let connectivity =
        encoded(triangles.iter().flatten().flat_map(|&n| i64::from(n).to_le_bytes()).collect());
    let offsets = encoded((1..=triangles.len() as i64).flat_map(|i| (3 * i).to_le_bytes()).collect());
    let types = encoded(vec![5_u8; triangles.len()]);
    let mut text = String::new();
    let array = |name: &str, kind: &str, components: usize, data: &str| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"binary\">{data}</DataArray>"
        )
    };
    writeln!(text, "<?xml version=\"1.0\"?>")?;
    writeln!(
        text,
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">"
    )?;
    writeln!(
        text,
        "<UnstructuredGrid><Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">",
        points.len() / 3,
        triangles.len()
    )?;
    writeln!(
        text,
        "<PointData Vectors=\"displacement\">{}</PointData>",
        array("displacement", "Float32", 3, &floats(displacement))
    )?;
    writeln!(text, "<Points>{}</Points>", array("Points", "Float32", 3, &floats(points)))?;
    writeln!(
        text,
        "<Cells>{}{}{}</Cells>",
        array("connectivity", "Int64", 1, &connectivity),
        array("offsets", "Int64", 1, &offsets),
        array("types", "UInt8", 1, &types)
    )?;
    writeln!(text, "</Piece></UnstructuredGrid></VTKFile>")?;
    Ok(text)
}

/// Length and data as one base64 text.
fn encoded(data: Vec<u8>) -> String {
    let mut bytes = (data.len() as u64).to_le_bytes().to_vec();
    bytes.extend(data);
    STANDARD.encode(bytes)
}
