//! The front door: a file of any format, recognised by its content.

use crate::check::size_question;
use crate::error::MeshError;
use crate::files::Files;
use crate::format::{Format, Recognised, recognise};
use crate::mesher::{MeshingParameters, WatchFn, tetrahedralise};
use crate::scan::{Scanner, quoted};
use crate::surface_mesh::{SurfaceFile, SurfaceMesh};
use crate::volume_mesh::{Mesh, VolumeFile};
use crate::{abaqus, gltf, gmsh, medit, obj, off, ply, stl, tetgen, vega, vtk};
use glam::DVec3;
use std::path::Path;

/// Content of a mesh file.
#[derive(Debug, Clone, PartialEq)]
pub enum MeshFile {
    /// Solid elements.
    Volume(VolumeFile),
    /// Triangles.
    Surface(SurfaceFile),
}

impl MeshFile {
    /// Reads a mesh file and those that it names.
    ///
    /// # Errors
    /// [`MeshError::Read`] or [`MeshError::Companion`] when a file cannot be opened; [`MeshError::Unrecognised`],
    /// [`MeshError::Foreign`] or [`MeshError::Format`] when its format is not read or it is damaged.
    pub fn read(files: Files, path: &Path) -> Result<Self, MeshError> {
        let bytes = files.read(path)?;
        let surface = |format: &str, mesh: SurfaceMesh| {
            Ok(Self::Surface(SurfaceFile { format: format.to_owned(), mesh }))
        };
        let format = match recognise(&bytes) {
            Recognised::Known(format) => format,
            Recognised::Foreign(found, advice) => {
                return Err(MeshError::Foreign { path: path.to_path_buf(), found, advice });
            }
            // What a name says is good for an error that says more.
            Recognised::Unknown => match Format::of_name(path) {
                Some(format) => format,
                None => {
                    let path = path.to_path_buf();
                    return Err(MeshError::Unrecognised { path, begins: begin_of(&bytes) });
                }
            },
        };
        Ok(Self::Volume(match format {
            Format::Gmsh => gmsh::parse(&bytes, path)?,
            Format::Vtk => vtk::parse(&bytes, path)?,
            Format::VtkXml => vtk::parse_xml(&bytes, path)?,
            Format::TetGen => tetgen::parse(files, &bytes, path)?,
            Format::Medit => medit::parse(&bytes, path)?,
            Format::MeditBinary => medit::parse_binary(&bytes, path)?,
            Format::Vega => vega::parse(files, &bytes, path)?,
            Format::Abaqus => abaqus::parse(files, &bytes, path)?,
            Format::Gltf => {
                let (mesh, encoding) = gltf::parse(files, &bytes, path)?;
                return surface(&format!("glTF 2.0, {encoding}"), mesh);
            }
            Format::Obj => return surface("OBJ", obj::parse(&bytes, path)?),
            Format::Off => return surface("OFF", off::parse(&bytes, path)?),
            Format::Stl => {
                let (mesh, encoding) = stl::parse(&bytes, path)?;
                return surface(&format!("STL, {encoding}"), mesh);
            }
            Format::Ply => {
                let (mesh, encoding) = ply::parse(&bytes, path)?;
                return surface(&format!("PLY, {encoding}"), mesh);
            }
        }))
    }
}

impl MeshFile {
    /// Question about the unit of a body of an unusual size, by the scale from the file's units to metres: to be asked before a surface is
    /// filled and a body recorded, which take long where the size is wrong.
    pub fn unit_question(&self, scale: f64) -> Option<String> {
        match self {
            Self::Volume(VolumeFile { mesh, .. }) => mesh.unit_question(scale),
            Self::Surface(SurfaceFile { mesh, .. }) => {
                let finite = || mesh.positions.iter().copied().filter(|point| point.is_finite());
                let extent = finite().reduce(DVec3::max)? - finite().reduce(DVec3::min)?;
                size_question(scale * extent, scale)
            }
        }
    }

    /// Tetrahedra in metres: the solid elements, or the inside of the surface, by [`tetrahedralise`]; `scale` is from the file's units to
    /// metres.
    ///
    /// # Errors
    /// [`MeshError::Scale`]; [`MeshError::CellSizeOfSolids`] for a cell size beside solid elements; as [`tetrahedralise`].
    pub fn into_body(
        self,
        scale: f64,
        meshing: &MeshingParameters,
        watch: WatchFn,
    ) -> Result<Mesh, MeshError> {
        match self {
            Self::Volume(_) if meshing.cell_size.is_some() => Err(MeshError::CellSizeOfSolids),
            Self::Volume(VolumeFile { mut mesh, .. }) => {
                mesh.scale(scale)?;
                Ok(mesh)
            }
            Self::Surface(SurfaceFile { mut mesh, .. }) => {
                mesh.scale(scale)?;
                tetrahedralise(&mesh, meshing, watch).map(|(mesh, _)| mesh)
            }
        }
    }
}

/// First line that is not blank, for an error.
fn begin_of(bytes: &[u8]) -> String {
    let mut scan = Scanner::new(bytes, Path::new(""));
    scan.skip_blank();
    match scan.rest_of_line() {
        [] => "nothing (it is empty)".into(),
        line => quoted(line),
    }
}

/// Reads a body as tetrahedra in metres: solid elements, or the inside of a surface.
///
/// # Errors
/// As [`MeshFile::read`] and [`MeshFile::into_body`].
pub fn read_body(
    path: &Path,
    scale: f64,
    meshing: &MeshingParameters,
    watch: WatchFn,
) -> Result<Mesh, MeshError> {
    MeshFile::read(Files::Disk, path)?.into_body(scale, meshing, watch)
}

/// Reads the surface of a rigid body, welded: triangles, or the boundary of solid elements.
///
/// # Errors
/// As [`MeshFile::read`], and as [`SurfaceMesh::from_boundary`].
pub fn read_surface(path: &Path) -> Result<SurfaceMesh, MeshError> {
    match MeshFile::read(Files::Disk, path)? {
        MeshFile::Surface(SurfaceFile { mut mesh, .. }) => {
            mesh.weld();
            Ok(mesh)
        }
        MeshFile::Volume(file) => SurfaceMesh::from_boundary(file.mesh),
    }
}
