//! Where a mesh comes from: a primitive's text or a file.

use crate::Failure;
use palpate_fem::mesh::{Mesh, SurfaceMesh, ball_mesh, box_mesh, gmsh, obj, stl, vtk};
use std::path::Path;

/// Read or make a mesh.
pub fn mesh(source: &str) -> Result<Mesh, Failure> {
    if let Some(text) = source.strip_prefix("box:") {
        let parsed = text.split_once('/').and_then(|(size, cells)| Some((triple(size)?, triple(cells)?)));
        let Some((size, cells)) = parsed else {
            return Err(Failure(format!(
                "{source:?} is no box; write box:LXxLYxLZ/NXxNYxNZ, as in box:0.1x0.1x0.1/12x12x12"
            )));
        };
        return Ok(box_mesh(size, cells)?);
    }
    if let Some(text) = source.strip_prefix("sphere:") {
        let parsed = text.split_once('/').and_then(|(r, n)| Some((r.parse().ok()?, n.parse().ok()?)));
        let Some((radius, layers)) = parsed else {
            return Err(Failure(format!(
                "{source:?} is no sphere; write sphere:RADIUS/N, as in sphere:0.05/8"
            )));
        };
        return Ok(ball_mesh(radius, layers)?);
    }
    let path = Path::new(source);
    match extension(path).as_str() {
        "msh" => Ok(gmsh::read(path)?),
        "vtk" => Ok(vtk::read(path)?),
        _ => Err(Failure(format!(
            "{source:?} is no mesh that palpate reads: give a Gmsh file (.msh), a VTK legacy file (.vtk), \
             box:LXxLYxLZ/NXxNYxNZ or sphere:RADIUS/N"
        ))),
    }
}

/// Read the surface of something rigid: triangles, or the boundary of tetrahedra.
pub fn surface(path: &Path) -> Result<SurfaceMesh, Failure> {
    let around = |mesh: Mesh| {
        if mesh.tets.is_empty() {
            return Err(Failure(format!(
                "{}: the mesh has no tetrahedra; give a surface as .obj or .stl",
                path.display()
            )));
        }
        SurfaceMesh::around(mesh).map_err(|error| Failure(format!("{}: {error}", path.display())))
    };
    let mut surface = match extension(path).as_str() {
        "obj" => obj::read(path)?,
        "stl" => stl::read(path)?,
        "msh" => return around(gmsh::read(path)?),
        "vtk" => return around(vtk::read(path)?),
        _ => {
            return Err(Failure(format!(
                "{} is no mesh that palpate reads: give a closed surface (.obj, .stl) or a body of tetrahedra (.msh, .vtk)",
                path.display()
            )));
        }
    };
    surface.weld();
    Ok(surface)
}

fn extension(path: &Path) -> String {
    path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase()
}

/// What to call the source in a recording: no folders.
pub fn name(source: &str) -> String {
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

    fn text<T>(result: Result<T, Failure>) -> String {
        result.err().map(|failure| failure.0).unwrap_or_default()
    }

    #[test]
    fn primitives_are_read_and_misspelt_ones_are_explained() {
        assert_eq!(mesh("box:1x2x3/1x2x3").map(|m| m.tets.len()).ok(), Some(30));
        assert_eq!(mesh("sphere:0.05/2").map(|m| m.tets.len()).ok(), Some(160));
        assert!(
            text(mesh("box:1x2/1x2x3"))
                .starts_with("\"box:1x2/1x2x3\" is no box; write box:LXxLYxLZ/NXxNYxNZ")
        );
        assert!(text(mesh("sphere:x/2")).contains("write sphere:RADIUS/N"));
        assert!(text(mesh("cow.stl")).contains("no mesh that palpate reads"));
        assert!(text(mesh("no-such-file.msh")).starts_with("cannot read mesh no-such-file.msh"));
    }
}
