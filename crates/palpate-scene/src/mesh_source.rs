//! Mesh sources: primitives as text (`box:…`, `sphere:…`, `instrument:…`, `body:…`) and mesh files.

use crate::error::{SceneError, SceneErrorKind};
use palpate_fem::Progress;
use palpate_mesh::{
    ArchedBar, Bell, CellSplit, Duck, Files, Jelly, Liver, Mesh, MeshError, MeshFile, MeshingParameters,
    SurfaceMesh, TuningFork, ball_mesh, split_box_mesh,
};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Makes a primitive, or reads a mesh file: its solid elements, or the inside of its surface; in metres.
///
/// # Errors
/// When the text is no primitive, the file cannot be read, or its surface has no inside.
pub fn read_body(
    source: &str,
    scale: f64,
    meshing: &MeshingParameters,
    progress: &mut dyn Progress,
) -> Result<Mesh, SceneError> {
    UnscaledBody::read(source)?.into_mesh(scale, meshing, progress)
}

/// Body in the units of its source.
pub(crate) struct UnscaledBody<'a> {
    content: Content,
    name: &'a str,
}

enum Content {
    /// Primitive, or a mesh that a program made.
    Mesh(Mesh),
    File(MeshFile),
}

impl<'a> UnscaledBody<'a> {
    /// Primitive or mesh file.
    pub fn read(source: &'a str) -> Result<Self, SceneError> {
        let content = match primitive(source)? {
            Some(mesh) => Content::Mesh(mesh),
            None => Content::File(MeshFile::read(Files::Disk, Path::new(source)).map_err(refused)?),
        };
        Ok(Self { content, name: source })
    }

    /// Mesh file that is in memory: one that names no other file.
    pub fn of_bytes(bytes: &[u8], name: &'a str) -> Result<Self, SceneError> {
        let files = BTreeMap::from([(PathBuf::from(name), bytes.to_vec())]);
        let file = MeshFile::read(Files::Memory(&files), Path::new(name)).map_err(refused)?;
        Ok(Self { content: Content::File(file), name })
    }

    /// Mesh that a program made.
    pub fn of_mesh(mesh: Mesh, name: &'a str) -> Self {
        Self { content: Content::Mesh(mesh), name }
    }

    /// Asks about the unit of a body of an unusual size, before it takes long.
    pub fn ask_unit(&self, scale: f64, progress: &mut dyn Progress) {
        let question = match &self.content {
            Content::Mesh(mesh) => mesh.unit_question(scale),
            Content::File(file) => file.unit_question(scale),
        };
        question.into_iter().for_each(|question| progress.warn(&question));
    }

    /// Mesh in metres.
    pub fn into_mesh(
        self,
        scale: f64,
        meshing: &MeshingParameters,
        progress: &mut dyn Progress,
    ) -> Result<Mesh, SceneError> {
        let Self { content, name } = self;
        match content {
            Content::Mesh(_) if meshing.cell_size.is_some() => {
                Err(mesh_error(format!("{name}: {}", MeshError::CellSizeOfSolids)))
            }
            Content::Mesh(mut mesh) => {
                mesh.scale(scale).map_err(refused)?;
                Ok(mesh)
            }
            Content::File(file) => body_of(file, name, scale, meshing, progress),
        }
    }
}

/// Body of a mesh file, in metres.
fn body_of(
    file: MeshFile,
    name: &str,
    scale: f64,
    meshing: &MeshingParameters,
    progress: &mut dyn Progress,
) -> Result<Mesh, SceneError> {
    let mut told = 0;
    if matches!(file, MeshFile::Surface(_)) {
        progress.begin("tetrahedra", PERCENT);
    }
    let mut watch = |share: f64| {
        let now = (share * PERCENT as f64) as u64;
        progress.advance(now.saturating_sub(told));
        told = told.max(now);
        if progress.is_interrupted() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    file.into_body(scale, meshing, &mut watch).map_err(|error| match error {
        MeshError::Scale { .. } => refused(error),
        error => mesh_error(format!("{name}: {error}")),
    })
}

/// Units of work of the mesher.
const PERCENT: u64 = 100;

/// A primitive, if the text is one.
fn primitive(source: &str) -> Result<Option<Mesh>, SceneError> {
    if let Some(text) = source.strip_prefix("box:") {
        let mut parts = text.split('/');
        let mut parsed = || {
            let (size, cells) = (triple(parts.next()?)?, triple(parts.next()?)?);
            let split = match parts.next() {
                None | Some("5") => CellSplit::Five,
                Some("6") => CellSplit::Six,
                Some(_) => return None,
            };
            parts.next().is_none().then_some((size, cells, split))
        };
        let Some((size, cells, split)) = parsed() else {
            return Err(mesh_error(format!(
                "{source:?} is no box; write box:LXxLYxLZ/NXxNYxNZ, as in box:0.1x0.1x0.1/12x12x12, and /6 after it for six tetrahedra \
                 per cell"
            )));
        };
        return split_box_mesh(size, cells, split).map(Some).map_err(refused);
    }
    if let Some(text) = source.strip_prefix("sphere:") {
        let parsed = text.split_once('/').and_then(|(r, n)| Some((r.parse().ok()?, n.parse().ok()?)));
        let Some((radius, layers)) = parsed else {
            return Err(mesh_error(format!(
                "{source:?} is no sphere; write sphere:RADIUS/N, as in sphere:0.05/8"
            )));
        };
        return ball_mesh(radius, layers).map(Some).map_err(refused);
    }
    if let Some(name) = source.strip_prefix("instrument:") {
        let mesh = match name {
            "bar" => ArchedBar::default().mesh(),
            "fork" => TuningFork::default().mesh(),
            "bell" => Bell::default().mesh(),
            _ => {
                return Err(mesh_error(format!(
                    "{source:?} is no instrument; write instrument:bar, instrument:fork or instrument:bell"
                )));
            }
        };
        return mesh.map(Some).map_err(refused);
    }
    if let Some(text) = source.strip_prefix("body:") {
        let (name, fineness) = text.split_once('/').map_or((text, None), |(name, rest)| (name, Some(rest)));
        let mesh = match (name, fineness.map(str::parse::<f64>)) {
            ("liver", None) => Liver::default().mesh(),
            ("liver", Some(Ok(cell_size))) => Liver { cell_size, ..Liver::default() }.mesh(),
            ("duck", None) => Duck::default().mesh(),
            ("duck", Some(Ok(cell_size))) => Duck { cell_size }.mesh(),
            ("jelly", None) => Jelly::default().mesh(),
            ("jelly", Some(Ok(rings))) if (1.0..=100.0).contains(&rings) && rings.fract() == 0.0 => {
                Jelly { rings: rings as u32, ..Jelly::default() }.mesh()
            }
            _ => {
                return Err(mesh_error(format!(
                    "{source:?} is no body; write body:liver or body:liver/CELL, as in body:liver/0.01, in metres; body:duck or \
                     body:duck/CELL; body:jelly or body:jelly/RINGS, as in body:jelly/4, 1 to 100"
                )));
            }
        };
        return mesh.map(Some).map_err(refused);
    }
    Ok(None)
}

/// Reads the surface of a rigid body: triangles, or the boundary of solid elements.
///
/// # Errors
/// When the file cannot be read, or has neither.
pub fn read_surface(path: &Path) -> Result<SurfaceMesh, SceneError> {
    palpate_mesh::read_surface(path).map_err(|error| match error {
        MeshError::NoTetrahedra => mesh_error(format!(
            "{}: the mesh has no solid elements; give a surface as .obj, .stl, .ply or .off",
            path.display()
        )),
        // Errors of files have their path.
        MeshError::Read { .. }
        | MeshError::Companion { .. }
        | MeshError::Foreign { .. }
        | MeshError::Unrecognised { .. }
        | MeshError::Format { .. } => refused(error),
        other => mesh_error(format!("{}: {other}", path.display())),
    })
}

fn refused(error: MeshError) -> SceneError {
    match &error {
        MeshError::Read { path: file, source } | MeshError::Companion { companion: file, source, .. } => {
            let (file, os_error) = (Some(file.clone()), source.raw_os_error());
            SceneError { file, os_error, ..SceneError::new(SceneErrorKind::Io, error) }
        }
        _ => mesh_error(error),
    }
}

fn mesh_error(message: impl std::fmt::Display) -> SceneError {
    SceneError::new(SceneErrorKind::Mesh, message)
}

/// Whether a text names a primitive, not a file.
pub(crate) fn is_primitive(source: &str) -> bool {
    ["box:", "sphere:", "instrument:", "body:"].iter().any(|kind| source.starts_with(kind))
}

/// Name of a source in a recording: without folders.
pub fn source_name(source: &str) -> String {
    let file = Path::new(source).file_name().and_then(|name| name.to_str());
    if is_primitive(source) { source.to_string() } else { file.unwrap_or(source).to_string() }
}

fn triple<T: std::str::FromStr>(text: &str) -> Option<[T; 3]> {
    let parts: Result<Vec<T>, _> = text.split('x').map(str::parse).collect();
    parts.ok()?.try_into().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_fem::SilentProgress;

    fn read_mesh(source: &str) -> Result<Mesh, SceneError> {
        read_body(source, 1.0, &MeshingParameters::default(), &mut SilentProgress)
    }

    fn text<T>(result: Result<T, SceneError>) -> String {
        result.err().map(|error| error.message).unwrap_or_default()
    }

    #[test]
    fn primitives_are_read_and_misspelt_ones_are_explained() {
        assert_eq!(read_mesh("box:1x2x3/1x2x3").map(|m| m.tets.len()).ok(), Some(30));
        assert_eq!(read_mesh("box:1x2x3/1x2x3/6").map(|m| m.tets.len()).ok(), Some(36));
        assert!(text(read_mesh("box:1x2x3/1x2x3/7")).contains("/6 after it"));
        assert_eq!(read_mesh("sphere:0.05/2").map(|m| m.tets.len()).ok(), Some(160));
        assert!(
            text(read_mesh("box:1x2/1x2x3"))
                .starts_with("\"box:1x2/1x2x3\" is no box; write box:LXxLYxLZ/NXxNYxNZ")
        );
        assert!(text(read_mesh("sphere:x/2")).contains("write sphere:RADIUS/N"));
        for name in ["bar", "fork", "bell"] {
            let mesh = read_mesh(&format!("instrument:{name}"));
            assert!(mesh.is_ok_and(|mesh| mesh.tets.len() > 500), "{name}");
        }
        assert!(text(read_mesh("instrument:drum")).contains("write instrument:bar, instrument:fork"));
        let fine = |source| read_mesh(source).map(|mesh| mesh.tets.len()).ok();
        assert_eq!([fine("body:jelly/3"), fine("body:jelly")], [Some(486), Some(1152)]);
        assert!(fine("body:liver/0.02") < fine("body:liver"));
        assert!(fine("body:duck/0.013") < fine("body:duck"));
        for wrong in ["body:heart", "body:liver/x", "body:duck/x", "body:jelly/0", "body:jelly/2.5"] {
            assert!(
                text(read_mesh(wrong)).contains("is no body; write body:liver or body:liver/CELL"),
                "{wrong}"
            );
        }
        assert!(text(read_mesh("no-such-file.msh")).starts_with("cannot read mesh no-such-file.msh"));
    }
}
