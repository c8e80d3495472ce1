//! Types of solid elements: a family, a number of nodes, and letters for the formulation, as in C3D10MH.

use crate::elements::Shape;

/// Families of solids: continuum, heat, acoustic, and CalculiX's fluids; continuum shells have the nodes of solids.
const FAMILIES: &[&str] = &["C3D", "DC3D", "DCC3D", "AC3D", "QC3D", "CC3D", "F3D", "SC", "CSS"];

/// Shape and number of nodes of a solid; none of any other type.
pub(super) fn solid(kind: &str) -> Option<(Shape, usize)> {
    let kind = kind.to_ascii_uppercase();
    let rest = FAMILIES.iter().find_map(|family| kind.strip_prefix(family))?;
    let digits = rest.find(|c: char| !c.is_ascii_digit()).unwrap_or(rest.len());
    let nodes: usize = rest[..digits].parse().ok()?;
    let shape = match nodes {
        4 | 10 => Shape::Tetrahedron,
        5 | 13 => Shape::Pyramid,
        6 | 15 => Shape::Wedge,
        8 | 20 | 27 => Shape::Hexahedron,
        _ => return None,
    };
    Some((shape, nodes))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solids_are_told_by_family_and_nodes() {
        for (kind, expected) in [
            ("C3D4", Some((Shape::Tetrahedron, 4))),
            ("c3d10mh", Some((Shape::Tetrahedron, 10))),
            ("C3D8R", Some((Shape::Hexahedron, 8))),
            ("DC3D20", Some((Shape::Hexahedron, 20))),
            ("C3D15V", Some((Shape::Wedge, 15))),
            ("C3D5", Some((Shape::Pyramid, 5))),
            ("SC8R", Some((Shape::Hexahedron, 8))),
            ("C3D", None),
            ("C3D99999999999999999999", None),
            ("S4R", None),
            ("CPS3", None),
            ("", None),
        ] {
            assert_eq!(solid(kind), expected, "{kind}");
        }
    }
}
