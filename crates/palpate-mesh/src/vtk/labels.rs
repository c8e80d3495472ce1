//! Arrays of VTK files that make regions and groups.

use crate::volume_mesh::NodeGroup;

/// Names of the cell arrays that tell regions apart; case does not matter.
const REGION_ARRAYS: [&str; 11] = [
    "material",
    "materials",
    "materialids",
    "region",
    "regions",
    "regionid",
    "gmsh:physical",
    "cellentityids",
    "medit:ref",
    "physical",
    "part",
];

/// Whether a cell array of this name tells regions apart.
pub(super) fn is_region_array(name: &str) -> bool {
    REGION_ARRAYS.iter().any(|known| name.eq_ignore_ascii_case(known))
}

/// Region of each cell, and groups of points.
#[derive(Default)]
pub(super) struct Labels {
    /// Region of each cell.
    pub regions: Option<Vec<i64>>,
    pub groups: Vec<NodeGroup>,
    pub warnings: Vec<String>,
}

impl Labels {
    /// Group of the points with a value that is not zero; `first` is the number of the first point.
    pub fn keep_points(&mut self, name: String, values: &[i64], first: u32) {
        let in_group = (first..).zip(values).filter(|&(_, value)| *value != 0);
        let nodes = in_group.map(|(node, _)| node);
        match self.groups.iter_mut().find(|group| group.name == name) {
            Some(group) if first > 0 => group.nodes.extend(nodes),
            _ => self.groups.push(NodeGroup { name, nodes: nodes.collect() }),
        }
    }

    /// Warning about a region array that isn't of whole numbers.
    pub fn refuse_fractions(&mut self, name: &str) {
        self.warnings.push(format!("cell array '{name}' is ignored: its type is no integer"));
    }

    /// Region of a cell; 0 without an array.
    pub fn region(&self, cell: u32) -> i64 {
        self.regions.as_ref().and_then(|regions| regions.get(cell as usize)).copied().unwrap_or(0)
    }
}
