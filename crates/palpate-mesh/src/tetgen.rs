//! Pairs of files of TetGen: nodes in `NAME.node`, tetrahedra in `NAME.ele`.
//!
//! ```text
//! NAME.node   count 3 attributes markers     number x y z attributes… marker
//! NAME.ele    count 4|10 attributes          number nodes… attribute
//! ```
//!
//! Numbers begin at 0 or 1. The attribute of a tetrahedron is its region, boundary markers that are not 0 are groups of nodes.
//!
//! Reference: H. Si, TetGen User's Manual, section 5.2, <https://wias-berlin.de/software/tetgen/fformats.html>.

use crate::elements::{Elements, Shape};
use crate::error::MeshError;
use crate::files::Files;
use crate::mid_edge::sort_by_edges;
use crate::numbering::Numbering;
use crate::rows::{Rows, Words};
use crate::volume_mesh::{NodeGroup, VolumeFile};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Header of either file.
enum Header {
    Nodes,
    Tetrahedra,
}

/// Kind of the file that begins with this row.
fn header(row: &[u8]) -> Option<Header> {
    let numbers: Option<Vec<u64>> =
        Words(row).map(|word| std::str::from_utf8(word).ok()?.parse().ok()).collect();
    match *numbers? {
        [_, 3] | [_, 3, _] | [_, 3, _, 0 | 1] => Some(Header::Nodes),
        [_, 4 | 10] | [_, 4 | 10, _] => Some(Header::Tetrahedra),
        _ => None,
    }
}

/// Whether a file that begins with this row is one of the pair.
pub(crate) fn is_header(row: &[u8]) -> bool {
    header(row).is_some()
}

/// Reads the pair of which `bytes` is one, at `path`.
pub(crate) fn parse(files: Files, bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let first = Rows::new(bytes, path, "#").next();
    let is_nodes = matches!(header(first), Some(Header::Nodes));
    let companion = path.with_extension(if is_nodes { "ele" } else { "node" });
    if companion == path {
        let message = format!("the file has the content of a .{}", if is_nodes { "node" } else { "ele" });
        return Rows::new(bytes, path, "#").scan.fail(message);
    }
    let other = files.read_companion(path, &companion)?;
    if is_nodes {
        parse_pair((bytes, path), (&other, &companion))
    } else {
        parse_pair((&other, &companion), (bytes, path))
    }
}

fn parse_pair(
    (node_bytes, node_path): (&[u8], &Path),
    (ele_bytes, ele_path): (&[u8], &Path),
) -> Result<VolumeFile, MeshError> {
    let mut rows = Rows::new(node_bytes, node_path, "#");
    let (positions, numbering, groups) = read_nodes(&mut rows)?;

    let mut rows = Rows::new(ele_bytes, ele_path, "#");
    let mut words = rows.words("the number of tetrahedra")?;
    let stated = rows.number(&mut words, "the number of tetrahedra")?;
    let size: usize = rows.number(&mut words, "the number of nodes of a tetrahedron")?;
    if size != 4 && size != 10 {
        return rows.scan.fail(format!("tetrahedra have {size} nodes, expected 4 or 10"));
    }
    let has_attribute = words.next().is_some_and(|word| word != b"0");
    let count = rows.scan.count(stated, 2 * (1 + size), "tetrahedra")?;
    let mut elements = Elements::default();
    let mut regions = Vec::new();
    let mut fractions = 0_usize;
    for tetrahedron in 0..count {
        let mut words = rows.words("a tetrahedron")?;
        rows.number::<u64>(&mut words, "the number of a tetrahedron")?;
        let mut nodes = [0; 10];
        for node in &mut nodes[..size] {
            let number = rows.number(&mut words, "a node of a tetrahedron")?;
            let Some(found) = numbering.find(number) else {
                return rows
                    .scan
                    .fail(format!("a tetrahedron has node {number}, which is not in the .node file"));
            };
            *node = found;
        }
        // Files of other programs differ in the order of the edges.
        let is_sorted = size == 10 && sort_by_edges(&positions, &mut nodes);
        let used = if is_sorted { 10 } else { 4 };
        elements.add(Shape::Tetrahedron, &nodes[..used], tetrahedron as u32);
        let attribute =
            if has_attribute { rows.number(&mut words, "the region of a tetrahedron")? } else { 0.0 };
        fractions += usize::from(f64::fract(attribute) != 0.0);
        regions.push(attribute as i64);
    }
    let region = |tetrahedron: u32| regions.get(tetrahedron as usize).copied().unwrap_or(0);
    let mut file = elements.into_file("TetGen .node and .ele".into(), positions, groups, region, |_| None);
    if fractions > 0 {
        let warning = format!(
            "attributes of tetrahedra are no whole numbers: {fractions}; they are cut to one for regions"
        );
        file.mesh.warnings.push(warning);
    }
    Ok(file)
}

type Nodes = (Vec<DVec3>, Numbering, Vec<NodeGroup>);

fn read_nodes(rows: &mut Rows) -> Result<Nodes, MeshError> {
    let mut words = rows.words("the number of nodes")?;
    let stated = rows.number(&mut words, "the number of nodes")?;
    let dimension: u64 = rows.number(&mut words, "the dimension")?;
    if dimension != 3 {
        return rows.scan.fail(format!("the dimension is {dimension}, expected 3"));
    }
    let attributes: usize =
        words.next().map_or(Ok(0), |word| rows.parse(word, "the number of attributes"))?;
    let has_marker = words.next().is_some_and(|word| word != b"0");
    let count = rows.scan.count(stated, 8, "nodes")?;
    let mut positions = Vec::with_capacity(count);
    let mut numbering = Numbering::new(count);
    let mut by_marker: BTreeMap<i64, Vec<u32>> = BTreeMap::new();
    for _ in 0..count {
        let mut words = rows.words("a node")?;
        let number = rows.number(&mut words, "the number of a node")?;
        let node = numbering.push(number, "node").or_else(|what| rows.scan.fail(what))?;
        let mut coordinate = || rows.number(&mut words, "a coordinate");
        positions.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
        if has_marker {
            let marker = words.nth(attributes).unwrap_or_default();
            let marker = rows.parse(marker, "the boundary marker of a node")?;
            if marker != 0 {
                by_marker.entry(marker).or_default().push(node);
            }
        }
    }
    let groups = by_marker.into_iter().map(|(marker, nodes)| NodeGroup { name: marker.to_string(), nodes });
    Ok((positions, numbering, groups.collect()))
}
