//! Formats, recognised by their content: names of files lie.

use crate::scan::Scanner;
use std::path::Path;

/// Format of a mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// Gmsh 1, 2.2, 4.0 or 4.1 (`.msh`).
    Gmsh,
    /// VTK legacy (`.vtk`).
    Vtk,
    /// VTK in XML (`.vtu`).
    VtkXml,
    /// One of the pair of TetGen (`.node`, `.ele`).
    TetGen,
    /// MEDIT in text (`.mesh`).
    Medit,
    /// MEDIT in binary (`.meshb`).
    MeditBinary,
    /// glTF, in text or binary (`.gltf`, `.glb`), a surface.
    Gltf,
    /// Vega (`.veg`).
    Vega,
    /// Abaqus (`.inp`).
    Abaqus,
    /// STL (`.stl`), a surface.
    Stl,
    /// Wavefront OBJ (`.obj`), a surface.
    Obj,
    /// PLY (`.ply`), a surface.
    Ply,
    /// OFF (`.off`), a surface.
    Off,
}

/// Content of a file, as far as its begin tells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Recognised {
    /// A format that is read.
    Known(Format),
    /// A format that is not read: its name, and the way to one that is.
    Foreign(&'static str, &'static str),
    /// Nothing that is known.
    Unknown,
}

/// Advice for geometry without a mesh.
const MESH_IT: &str = "mesh it first, for instance with gmsh FILE -3 -format msh41 -o NEW.msh";

/// Advice for meshes in containers.
const CONVERT: &str = "convert it to VTU, for instance with meshio convert OLD NEW.vtu";

/// Advice for surfaces in formats of graphics.
const AS_SURFACE: &str = "save the surface as .stl, .obj or .ply";

/// Starts of formats that are not read.
const FOREIGN: &[(&[u8], &str, &str)] = &[
    (b"\x89HDF", "an HDF5 file (XDMF, MED, CGNS or Exodus)", CONVERT),
    (b"CDF\x01", "a NetCDF file (Exodus)", CONVERT),
    (b"CDF\x02", "a NetCDF file (Exodus)", CONVERT),
    (b"PK\x03\x04", "a ZIP archive (perhaps 3MF)", "unpack it"),
    (b"\x1f\x8b", "a gzip archive", "unpack it with gunzip"),
    (b"Kaydara FBX", "an FBX file", AS_SURFACE),
    (b"ISO-10303-21", "a STEP file of CAD geometry", MESH_IT),
    (b"DBRep_DrawableShape", "a BREP file of CAD geometry", MESH_IT),
    (b"mesh3d", "a Netgen file (.vol)", "export it from Netgen as Gmsh2"),
];

/// Statements that an OBJ file begins with.
const OBJ_STATEMENTS: &[&[u8]] =
    &[b"v", b"vn", b"vt", b"vp", b"f", b"o", b"g", b"s", b"l", b"mtllib", b"usemtl"];

/// Size of a binary STL file's title and count, and of each triangle [bytes].
const STL_HEADER: u64 = 84;
const STL_TRIANGLE: u64 = 50;

impl Format {
    /// Format that the name of a file claims.
    pub(crate) fn of_name(path: &Path) -> Option<Self> {
        Some(match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "msh" => Self::Gmsh,
            "vtk" => Self::Vtk,
            "vtu" => Self::VtkXml,
            "mesh" => Self::Medit,
            "meshb" => Self::MeditBinary,
            "glb" | "gltf" => Self::Gltf,
            "veg" => Self::Vega,
            "inp" => Self::Abaqus,
            "stl" => Self::Stl,
            "obj" => Self::Obj,
            "ply" => Self::Ply,
            "off" => Self::Off,
            _ => return None,
        })
    }
}

/// Recognises a mesh file by its content.
pub fn recognise(bytes: &[u8]) -> Recognised {
    use Format::{Gmsh, Medit, Off, Ply, Stl, Vtk};
    use Recognised::{Foreign, Known, Unknown};
    // The title of a binary STL may begin with anything, so its length decides.
    if is_binary_stl(bytes) {
        return Known(Stl);
    }
    if crate::medit::is_binary(bytes) {
        return Known(Format::MeditBinary);
    }
    if bytes.starts_with(b"glTF") {
        return Known(Format::Gltf);
    }
    if let Some((_, name, advice)) = FOREIGN.iter().find(|(start, ..)| bytes.starts_with(start)) {
        return Foreign(name, advice);
    }
    let mut scan = Scanner::new(bytes, Path::new(""));
    scan.skip_blank();
    let line = scan.rest_of_line();
    let first = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    let lower = line.to_ascii_lowercase();
    if lower.starts_with(b"# vtk") || lower.starts_with(b"#vtk") {
        return Known(Vtk);
    }
    match first {
        b"ply" => return Known(Ply),
        [b'$', b'A'..=b'Z', ..] => return Known(Gmsh),
        [b'<', ..] => return recognise_xml(bytes),
        [b'{', ..] => return Known(Format::Gltf),
        _ if first.eq_ignore_ascii_case(b"solid") => return Known(Stl),
        _ => {}
    }
    // The first line that is no comment.
    let mut line = line;
    while line.is_empty() || line.starts_with(b"#") || line.starts_with(b"**") {
        if scan.is_at_end() {
            return Unknown;
        }
        line = scan.rest_of_line();
    }
    let first = line.split(u8::is_ascii_whitespace).next().unwrap_or_default();
    if first.eq_ignore_ascii_case(b"MeshVersionFormatted") {
        return Known(Medit);
    }
    if crate::off::is_header(first) {
        return Known(Off);
    }
    if line.starts_with(b"*") {
        return recognise_deck(line, &mut scan);
    }
    if OBJ_STATEMENTS.contains(&first) {
        return Known(Format::Obj);
    }
    if lower.starts_with(b"begin bulk") || first == b"GRID" || lower.starts_with(b"sol ") {
        return Foreign("a Nastran file", CONVERT);
    }
    if crate::tetgen::is_header(line) { Known(Format::TetGen) } else { Unknown }
}

fn is_binary_stl(bytes: &[u8]) -> bool {
    let stated =
        bytes.get(80..84).and_then(|count| count.first_chunk()).map(|count| u32::from_le_bytes(*count));
    stated
        .is_some_and(|count| count > 0 && STL_HEADER + STL_TRIANGLE * u64::from(count) == bytes.len() as u64)
}

/// An XML file, by the first of the elements that tell.
fn recognise_xml(bytes: &[u8]) -> Recognised {
    /// Bytes that are looked at: declarations and comments come before.
    const LOOKED_AT: usize = 4096;
    let start = &bytes[..bytes.len().min(LOOKED_AT)];
    let has = |text: &[u8]| start.windows(text.len()).any(|window| window == text);
    if has(b"<VTKFile") {
        Recognised::Known(Format::VtkXml)
    } else if has(b"<Xdmf") {
        Recognised::Foreign("an XDMF file", CONVERT)
    } else if has(b"<COLLADA") || has(b"<X3D") {
        Recognised::Foreign("a scene of graphics in XML", AS_SURFACE)
    } else if has(b"<dolfin") {
        Recognised::Foreign("a mesh of DOLFIN in XML", CONVERT)
    } else {
        Recognised::Foreign("an XML file without <VTKFile>", "save it as VTU, Gmsh or VTK legacy")
    }
}

/// A deck of lines that begin with `*KEYWORD`: Vega or Abaqus, by the first keyword that only one of them has.
fn recognise_deck(first: &[u8], scan: &mut Scanner) -> Recognised {
    let mut line = first;
    loop {
        if let Some(keyword) = line.strip_prefix(b"*") {
            let has_parameters = keyword.contains(&b',');
            let word = keyword.split(|b| b.is_ascii_whitespace() || *b == b',').next().unwrap_or_default();
            match word.to_ascii_uppercase().as_slice() {
                b"VERTICES" | b"ELEMENTS" | b"REGION" | b"SET" => {
                    return Recognised::Known(Format::Vega);
                }
                b"HEADING" | b"NODE" | b"ELEMENT" | b"PART" | b"NSET" | b"ELSET" => {
                    return Recognised::Known(Format::Abaqus);
                }
                b"INCLUDE" | b"MATERIAL" if has_parameters => return Recognised::Known(Format::Abaqus),
                b"INCLUDE" => return Recognised::Known(Format::Vega),
                b"KEYWORD" => return Recognised::Foreign("an LS-DYNA file", CONVERT),
                _ => {}
            }
        }
        if scan.is_at_end() {
            return Recognised::Unknown;
        }
        line = scan.rest_of_line();
    }
}
