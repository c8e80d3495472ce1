//! Gmsh mesh files: MSH 1 (text), 2.2, 4.0 and 4.1 (text and binary).
//!
//! A file is a sequence of sections `$Name … $EndName`. Of these, `$MeshFormat`,
//! `$PhysicalNames`, `$Entities` (4), `$Nodes` and `$Elements` are read, the others skipped; MSH 1 has `$NOD` and `$ELM` alone.
//! A solid's region is its physical volume (the first, where it has several; 0 without a
//! name where it has none), and every physical group that has elements becomes a group of nodes.
//!
//! Reference: Gmsh reference manual, sections "MSH file format", "MSH file format version 2
//! (Legacy)" and "MSH file format version 1 (Legacy)", <https://gmsh.info/doc/texinfo/gmsh.html>.

mod element_types;
mod elements;
mod labels;
mod nodes;
mod sections;
#[cfg(test)]
mod tests;

use std::path::Path;

use self::elements::ElementSection;
use self::labels::Labels;
use self::nodes::Nodes;
use self::sections::{Version, read_format, start_of_section};
use crate::error::MeshError;
use crate::scan::{Encoding, Scanner};
use crate::volume_mesh::VolumeFile;

/// Reads the bytes of a mesh file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut scan = Scanner::new(bytes, path);
    let version = read_format(&mut scan)?;

    let mut labels = Labels::default();
    let mut nodes = None;
    let mut elements = None;
    while let Some(section) = start_of_section(&mut scan)? {
        match (section, &nodes, &elements) {
            ("PhysicalNames", ..) => labels.read_names(&mut scan)?,
            ("Entities", _, None) if version.has_entities() => labels.read_entities(&mut scan, version)?,
            ("Nodes" | "NOD", None, _) => nodes = Some(Nodes::read(&mut scan, version)?),
            ("Elements" | "ELM", Some(known), None) => {
                elements = Some(ElementSection::read(&mut scan, version, known, &labels)?);
            }
            ("ParametricNodes", ..) => {
                return scan.fail("$ParametricNodes cannot be read: save without parametric nodes");
            }
            ("Elements" | "ELM", None, _) => {
                return scan.fail(format!("${section} comes before ${}", version.nodes()));
            }
            ("Nodes" | "NOD" | "Elements" | "ELM", ..) => {
                return scan.fail(format!("${section} is in the file twice"));
            }
            ("Entities", ..) if version.has_entities() => {
                return scan.fail("$Entities comes after $Elements");
            }
            _ => scan.skip_past(format!("$End{section}").as_bytes())?,
        }
    }
    match (nodes, elements) {
        (Some(nodes), Some(elements)) => assemble(&scan, version, labels, nodes, elements),
        (None, _) => scan.fail(format!("the file has no ${}", version.nodes())),
        (_, None) => scan.fail(format!("the file has no ${}", version.elements())),
    }
}

/// The mesh from its sections.
fn assemble(
    scan: &Scanner,
    version: Version,
    labels: Labels,
    nodes: Nodes,
    section: ElementSection,
) -> Result<VolumeFile, MeshError> {
    let (groups, joined) = labels.groups(scan, version, section.members)?;
    let encoding = if scan.encoding == Encoding::Text { "text" } else { "binary" };
    let mut file = section.elements.into_file(
        format!("Gmsh {}, {encoding}", version.name()),
        nodes.positions,
        groups,
        |solid| section.tags.get(solid as usize).copied().unwrap_or(0),
        |tag| labels.name(3, tag),
    );
    let warnings = &mut file.mesh.warnings;
    if section.repeats > 0 {
        warnings.push(format!(
            "elements listed again under another physical volume: {}; each is kept once, in \
             the volume listed first",
            section.repeats
        ));
    }
    if section.unlisted_blocks > 0 {
        warnings.push(format!(
            "element blocks of entities that $Entities does not list, as in a partitioned \
             mesh: {}; they are in no region and no group",
            section.unlisted_blocks
        ));
    }
    warnings.extend(joined);
    Ok(file)
}
