//! Mesh files for other programs: VTK legacy and Gmsh 2.2, as text.
//!
//! Numbers are written so that reading gives the same bits.

use crate::faces::EDGES;
use crate::volume_mesh::Mesh;
use std::fmt::Write;

/// Cell types of a tetrahedron of four and of ten nodes in VTK, element types in Gmsh.
const VTK_TETRA: [u32; 2] = [10, 24];
const GMSH_TETRA: [u32; 2] = [4, 11];

impl Mesh {
    /// Nodes of each tetrahedron: ten where all edges have a node, in the order of VTK, else four.
    fn cells(&self) -> Vec<Vec<u32>> {
        let quadratic = |tet: &[u32; 4]| {
            let middles = EDGES.map(|[a, b]| self.mid_edge_node(tet[a], tet[b]));
            middles.into_iter().try_fold(tet.to_vec(), |mut nodes, middle| {
                nodes.push(middle?);
                Some(nodes)
            })
        };
        self.tets.iter().map(|tet| quadratic(tet).unwrap_or_else(|| tet.to_vec())).collect()
    }

    /// Text of a VTK legacy file, with the regions as cell array `region`.
    pub fn to_vtk(&self) -> String {
        let (nodes, tets) = (self.nodes.len(), self.tets.len());
        let mut text = format!(
            "# vtk DataFile Version 3.0\ntetrahedra of palpate\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {nodes} double\n"
        );
        for node in &self.nodes {
            // Writing to a text cannot fail.
            let _ = writeln!(text, "{} {} {}", node.x, node.y, node.z);
        }
        let cells = self.cells();
        let _ = writeln!(text, "CELLS {tets} {}", cells.iter().map(|cell| 1 + cell.len()).sum::<usize>());
        for cell in &cells {
            let _ = writeln!(text, "{} {}", cell.len(), joined(cell.iter().copied()));
        }
        let _ = writeln!(text, "CELL_TYPES {tets}");
        for cell in &cells {
            let _ = writeln!(text, "{}", VTK_TETRA[usize::from(cell.len() == 10)]);
        }
        let _ = writeln!(text, "CELL_DATA {tets}\nSCALARS region int 1\nLOOKUP_TABLE default");
        for &region in &self.tet_regions {
            let _ = writeln!(text, "{}", self.regions[region as usize].tag);
        }
        text
    }

    /// Text of a Gmsh 2.2 file, with the regions as physical volumes.
    pub fn to_gmsh(&self) -> String {
        let mut text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n".to_owned();
        let named = || self.regions.iter().filter_map(|region| Some((region.tag, region.name.as_ref()?)));
        if named().next().is_some() {
            let _ = writeln!(text, "$PhysicalNames\n{}", named().count());
            for (tag, name) in named() {
                let _ = writeln!(text, "3 {tag} \"{name}\"");
            }
            text += "$EndPhysicalNames\n";
        }
        let _ = writeln!(text, "$Nodes\n{}", self.nodes.len());
        for (number, node) in (1..).zip(&self.nodes) {
            let _ = writeln!(text, "{number} {} {} {}", node.x, node.y, node.z);
        }
        let _ = writeln!(text, "$EndNodes\n$Elements\n{}", self.tets.len());
        for (number, (mut cell, &region)) in (1_u64..).zip(self.cells().into_iter().zip(&self.tet_regions)) {
            let tag = self.regions[region as usize].tag;
            let kind = GMSH_TETRA[usize::from(cell.len() == 10)];
            if cell.len() == 10 {
                // Gmsh has the node of edge 23 before that of 13.
                cell.swap(8, 9);
            }
            let _ =
                writeln!(text, "{number} {kind} 2 {tag} {tag} {}", joined(cell.iter().map(|node| node + 1)));
        }
        text + "$EndElements\n"
    }
}

fn joined(numbers: impl Iterator<Item = u32>) -> String {
    numbers.map(|number| number.to_string()).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use crate::{Files, MeshFile, ball_mesh};
    use std::collections::BTreeMap;
    use std::path::{Path, PathBuf};

    #[test]
    fn curved_meshes_are_written_with_the_nodes_of_their_edges() {
        let mut mesh = ball_mesh(0.05, 2).expect("a good ball");
        mesh.add_mid_edge_nodes();
        for (name, text) in [("a.vtk", mesh.to_vtk()), ("a.msh", mesh.to_gmsh())] {
            let files = BTreeMap::from([(PathBuf::from(name), text.into_bytes())]);
            let found = MeshFile::read(Files::Memory(&files), Path::new(name)).expect("a mesh");
            let MeshFile::Volume(found) = found else { panic!("a surface") };
            assert_eq!((&found.mesh.tets, &found.mesh.nodes), (&mesh.tets, &mesh.nodes), "{name}");
            assert_eq!(found.mesh.mid_edge_nodes, mesh.mid_edge_nodes, "{name}");
        }
    }
}
