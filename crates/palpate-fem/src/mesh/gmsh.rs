//! Gmsh mesh files: MSH 2.2 and 4.1, text and binary.
//!
//! A file is a sequence of sections `$Name … $EndName`. Of these, `$MeshFormat`,
//! `$PhysicalNames`, `$Entities` (4.1), `$Nodes` and `$Elements` are read, the others skipped.
//! A tetrahedron's region is its physical volume (the first, where it has several; 0 without a
//! name where it has none), and every physical group that has elements becomes a group of nodes.
//!
//! Reference: Gmsh reference manual, sections "MSH file format" and "MSH file format version 2
//! (Legacy)", <https://gmsh.info/doc/texinfo/gmsh.html>.

mod element_types;
mod elements;
mod labels;
mod nodes;
mod sections;
#[cfg(test)]
mod tests;

use std::path::Path;

use self::elements::Elements;
use self::labels::Labels;
use self::nodes::Nodes;
use self::sections::{Version, read_format, start_of_section};
use super::error::MeshError;
use super::scan::{CURVED_WARNING, Scanner, read_bytes, regions};
use super::volume_mesh::Mesh;

/// Reads a Gmsh mesh file (`.msh`), MSH 2.2 or 4.1, text or binary.
///
/// Physical volumes become regions, physical groups become node groups.
///
/// # Errors
/// [`MeshError::Read`] or [`MeshError::Format`] when the file cannot be opened, is damaged or of another version, or
/// holds solid elements other than tetrahedra.
pub fn read_gmsh(path: &Path) -> Result<Mesh, MeshError> {
    parse(&read_bytes(path)?, path)
}

/// Reads the bytes of a mesh file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let version = read_format(&mut scan)?;

    let mut labels = Labels::default();
    let mut nodes = None;
    let mut elements = None;
    while let Some(section) = start_of_section(&mut scan)? {
        match (section, &nodes, &elements) {
            ("PhysicalNames", ..) => labels.read_names(&mut scan)?,
            ("Entities", _, None) if version == Version::V4 => labels.read_entities(&mut scan)?,
            ("Nodes", None, _) => nodes = Some(Nodes::read(&mut scan, version)?),
            ("Elements", Some(known), None) => {
                elements = Some(Elements::read(&mut scan, version, known, &labels)?);
            }
            ("ParametricNodes", ..) => {
                return scan.fail("$ParametricNodes cannot be read: save without parametric nodes");
            }
            ("Elements", None, _) => return scan.fail("$Elements comes before $Nodes"),
            ("Nodes" | "Elements", ..) => {
                return scan.fail(format!("${section} is in the file twice"));
            }
            ("Entities", ..) if version == Version::V4 => {
                return scan.fail("$Entities comes after $Elements");
            }
            _ => scan.skip_past(format!("$End{section}").as_bytes())?,
        }
    }
    match (nodes, elements) {
        (Some(nodes), Some(elements)) => assemble(&scan, version, labels, nodes, elements),
        (None, _) => scan.fail("the file has no $Nodes"),
        (_, None) => scan.fail("the file has no $Elements"),
    }
}

/// The mesh from its sections.
fn assemble(
    scan: &Scanner,
    version: Version,
    labels: Labels,
    nodes: Nodes,
    elements: Elements,
) -> Result<Mesh, MeshError> {
    let (regions, tet_regions) = regions(&elements.tet_tags, |tag| labels.name(3, tag));
    let (groups, joined) = labels.groups(scan, version, elements.members)?;

    let mut warnings = Vec::new();
    if elements.curved {
        warnings.push(CURVED_WARNING.to_owned());
    }
    if elements.repeats > 0 {
        warnings.push(format!(
            "tetrahedra listed again under another physical volume: {}; each is kept once, in \
             the volume listed first",
            elements.repeats
        ));
    }
    if elements.unlisted_blocks > 0 {
        warnings.push(format!(
            "element blocks of entities that $Entities does not list, as in a partitioned \
             mesh: {}; they are in no region and no group",
            elements.unlisted_blocks
        ));
    }
    warnings.extend(joined);
    Ok(Mesh { nodes: nodes.positions, tets: elements.tets, tet_regions, regions, groups, warnings })
}
