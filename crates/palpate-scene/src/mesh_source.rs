//! Mesh sources: primitives as text (`box:…`, `sphere:…`) and mesh files.

use crate::error::{SceneError, SceneErrorKind};
use palpate_fem::mesh::{
    Mesh, MeshError, SurfaceMesh, ball_mesh, box_mesh, read_gmsh, read_obj, read_stl, read_vtk,
};
use std::path::Path;

/// Makes a primitive, or reads a mesh file of tetrahedra.
///
/// # Errors
/// When the text is no primitive, or the file cannot be read.
pub fn read_mesh(source: &str) -> Result<Mesh, SceneError> {
    if let Some(text) = source.strip_prefix("box:") {
        let parsed = text.split_once('/').and_then(|(size, cells)| Some((triple(size)?, triple(cells)?)));
        let Some((size, cells)) = parsed else {
            return Err(mesh_error(format!(
                "{source:?} is no box; write box:LXxLYxLZ/NXxNYxNZ, as in box:0.1x0.1x0.1/12x12x12"
            )));
        };
        return box_mesh(size, cells).map_err(refused);
    }
    if let Some(text) = source.strip_prefix("sphere:") {
        let parsed = text.split_once('/').and_then(|(r, n)| Some((r.parse().ok()?, n.parse().ok()?)));
        let Some((radius, layers)) = parsed else {
            return Err(mesh_error(format!(
                "{source:?} is no sphere; write sphere:RADIUS/N, as in sphere:0.05/8"
            )));
        };
        return ball_mesh(radius, layers).map_err(refused);
    }
    let path = Path::new(source);
    match extension(path).as_str() {
        "msh" => read_gmsh(path).map_err(refused),
        "vtk" => read_vtk(path).map_err(refused),
        _ => Err(mesh_error(format!(
            "{source:?} is no mesh that palpate reads: give a Gmsh file (.msh), a VTK legacy file (.vtk), \
             box:LXxLYxLZ/NXxNYxNZ or sphere:RADIUS/N"
        ))),
    }
}

/// Reads the surface of a rigid body: triangles, or the boundary of tetrahedra.
///
/// # Errors
/// When the file cannot be read, or has neither.
pub fn read_surface(path: &Path) -> Result<SurfaceMesh, SceneError> {
    let around = |mesh: Mesh| {
        if mesh.tets.is_empty() {
            return Err(mesh_error(format!(
                "{}: the mesh has no tetrahedra; give a surface as .obj or .stl",
                path.display()
            )));
        }
        SurfaceMesh::from_boundary(mesh).map_err(|error| mesh_error(format!("{}: {error}", path.display())))
    };
    let mut surface = match extension(path).as_str() {
        "obj" => read_obj(path).map_err(refused)?,
        "stl" => read_stl(path).map_err(refused)?,
        "msh" => return around(read_gmsh(path).map_err(refused)?),
        "vtk" => return around(read_vtk(path).map_err(refused)?),
        _ => {
            return Err(mesh_error(format!(
                "{} is no mesh that palpate reads: give a closed surface (.obj, .stl) or a body of tetrahedra (.msh, .vtk)",
                path.display()
            )));
        }
    };
    surface.weld();
    Ok(surface)
}

fn refused(error: MeshError) -> SceneError {
    mesh_error(error)
}

fn mesh_error(message: impl std::fmt::Display) -> SceneError {
    SceneError::new(SceneErrorKind::Mesh, message)
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// Name of a source in a recording: without folders.
pub fn source_name(source: &str) -> String {
    let file = Path::new(source).file_name().and_then(|name| name.to_str());
    if source.starts_with("box:") || source.starts_with("sphere:") {
        source.to_string()
    } else {
        file.unwrap_or(source).to_string()
    }
}

fn triple<T: std::str::FromStr>(text: &str) -> Option<[T; 3]> {
    let parts: Result<Vec<T>, _> = text.split('x').map(str::parse).collect();
    parts.ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn text<T>(result: Result<T, SceneError>) -> String {
        result.err().map(|error| error.message).unwrap_or_default()
    }

    #[test]
    fn primitives_are_read_and_misspelt_ones_are_explained() {
        assert_eq!(read_mesh("box:1x2x3/1x2x3").map(|m| m.tets.len()).ok(), Some(30));
        assert_eq!(read_mesh("sphere:0.05/2").map(|m| m.tets.len()).ok(), Some(160));
        assert!(
            text(read_mesh("box:1x2/1x2x3"))
                .starts_with("\"box:1x2/1x2x3\" is no box; write box:LXxLYxLZ/NXxNYxNZ")
        );
        assert!(text(read_mesh("sphere:x/2")).contains("write sphere:RADIUS/N"));
        assert!(text(read_mesh("cow.stl")).contains("no mesh that palpate reads"));
        assert!(text(read_mesh("no-such-file.msh")).starts_with("cannot read mesh no-such-file.msh"));
    }
}
