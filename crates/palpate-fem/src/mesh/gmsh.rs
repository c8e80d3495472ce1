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
#[cfg(test)]
mod tests;

use std::path::Path;

use self::elements::Elements;
use self::labels::Labels;
use self::nodes::Nodes;
use super::scan::{CURVED_REMARK, Encoding, Scan, quoted, read_bytes, regions};
use super::{Mesh, MeshError};

/// Reads a mesh file of Gmsh.
///
/// # Errors
/// When the file cannot be opened, is damaged or of another version, or holds solid elements
/// other than tetrahedra.
pub fn read(path: &Path) -> Result<Mesh, MeshError> {
    parse(&read_bytes(path)?, path)
}

/// Reads the bytes of a mesh file; `path` is for messages.
pub(crate) fn parse(bytes: &[u8], path: &Path) -> Result<Mesh, MeshError> {
    let mut scan = Scan::new(bytes, path);
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

/// The two layouts that are read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    /// MSH 2.2.
    V2,
    /// MSH 4.1.
    V4,
}

/// The section `$MeshFormat`: `version file-type data-size`, and in a binary file the integer 1.
fn read_format(scan: &mut Scan) -> Result<Version, MeshError> {
    scan.skip_blank();
    while scan.peek() == b"$Comments" {
        scan.skip_past(b"$EndComments")?;
        scan.skip_blank();
    }
    scan.expect_word("$MeshFormat", "$MeshFormat, which a gmsh mesh begins with")?;
    scan.end_of_line()?;
    scan.skip_blank();
    let version = match scan.word_in_line() {
        b"2.2" => Version::V2,
        b"4.1" => Version::V4,
        other => {
            return scan.fail(format!(
                "MSH version {} cannot be read, only 2.2 and 4.1: \
                 convert it with gmsh OLD.msh -save -format msh41 -o NEW.msh",
                quoted(other)
            ));
        }
    };
    let is_binary = match scan.word_in_line() {
        b"0" => false,
        b"1" => true,
        other => {
            let message = format!("file type {}, expected 0 or 1", quoted(other));
            return scan.fail(message);
        }
    };
    let data_size = scan.word_in_line();
    if data_size != b"8" {
        let message = format!("data size {}, expected 8", quoted(data_size));
        return scan.fail(message);
    }
    scan.end_of_line()?;
    if is_binary {
        scan.encoding = Encoding::LittleEndian;
        match scan.binary("the integer 1 in binary")? {
            [1, 0, 0, 0] => {}
            [0, 0, 0, 1] => scan.encoding = Encoding::BigEndian,
            other => {
                let message = format!("expected the integer 1 in binary, found bytes {other:?}");
                return scan.fail(message);
            }
        }
    }
    end_of_section(scan, "MeshFormat", "after the format")?;
    Ok(version)
}

/// The name of the section that begins here, without `$`; `None` at the end of the file.
fn start_of_section<'a>(scan: &mut Scan<'a>) -> Result<Option<&'a str>, MeshError> {
    let word = scan.word();
    if word.is_empty() {
        return Ok(None);
    }
    let name = std::str::from_utf8(word).ok();
    let name = name.and_then(|word| word.strip_prefix('$'));
    let Some(name) = name.filter(|name| !name.starts_with("End")) else {
        let message = format!("expected a section such as $Nodes, found {}", quoted(word));
        return scan.fail(message);
    };
    scan.end_of_line()?;
    Ok(Some(name))
}

/// The end of a section; `after` is for the message.
fn end_of_section(scan: &mut Scan, name: &str, after: &str) -> Result<(), MeshError> {
    let end = format!("$End{name}");
    scan.expect_word(&end, &format!("{end} {after}"))
}

/// The mesh from its sections.
fn assemble(
    scan: &Scan,
    version: Version,
    labels: Labels,
    nodes: Nodes,
    elements: Elements,
) -> Result<Mesh, MeshError> {
    let (regions, tet_regions) = regions(&elements.tet_tags, |tag| labels.name(3, tag));
    let (groups, joined) = labels.groups(scan, version, elements.members)?;

    let mut remarks = Vec::new();
    if elements.curved {
        remarks.push(CURVED_REMARK.to_owned());
    }
    if elements.repeats > 0 {
        remarks.push(format!(
            "tetrahedra listed again under another physical volume: {}; each is kept once, in \
             the volume listed first",
            elements.repeats
        ));
    }
    if elements.unlisted_blocks > 0 {
        remarks.push(format!(
            "element blocks of entities that $Entities does not list, as in a partitioned \
             mesh: {}; they are in no region and no group",
            elements.unlisted_blocks
        ));
    }
    remarks.extend(joined);
    Ok(Mesh { nodes: nodes.positions, tets: elements.tets, tet_regions, regions, groups, remarks })
}
