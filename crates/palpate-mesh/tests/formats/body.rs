//! A body with regions and a group, and readers of files in memory.

use palpate_mesh::{Files, Mesh, MeshError, MeshFile, NodeGroup, Region, SurfaceFile, VolumeFile, box_mesh};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A box of 40 tetrahedra in regions 3 and 5, and a group of the nodes at its low end of x.
pub fn body() -> Mesh {
    let mut mesh = box_mesh([0.1, 0.2, 0.3], [2; 3]).expect("a good box");
    let region = |tag| Region { tag, ..Region::default() };
    mesh.regions = vec![region(3), region(5)];
    mesh.tet_regions = (0..mesh.tets.len() as u32).map(|tet| tet % 3 / 2).collect();
    let low = (0_u32..).zip(&mesh.nodes).filter(|(_, node)| node.x < -0.04).map(|(at, _)| at).collect();
    mesh.groups = vec![NodeGroup { name: "low".into(), nodes: low }];
    mesh
}

/// Files in memory.
pub fn files<const N: usize>(list: [(&str, Vec<u8>); N]) -> BTreeMap<PathBuf, Vec<u8>> {
    list.into_iter().map(|(name, bytes)| (PathBuf::from(name), bytes)).collect()
}

/// Reads the first of some files.
pub fn read<const N: usize>(list: [(&str, Vec<u8>); N]) -> Result<MeshFile, MeshError> {
    let first = list[0].0.to_owned();
    MeshFile::read(Files::Memory(&files(list)), Path::new(&first))
}

/// Reads solids.
#[track_caller]
pub fn volume<const N: usize>(list: [(&str, Vec<u8>); N]) -> VolumeFile {
    match read(list) {
        Ok(MeshFile::Volume(file)) => file,
        Ok(MeshFile::Surface(file)) => panic!("a surface: {}", file.format),
        Err(error) => panic!("{error}"),
    }
}

/// Reads a surface.
#[track_caller]
pub fn surface(name: &str, bytes: Vec<u8>) -> SurfaceFile {
    match read([(name, bytes)]) {
        Ok(MeshFile::Surface(file)) => file,
        Ok(MeshFile::Volume(file)) => panic!("solids: {}", file.format),
        Err(error) => panic!("{error}"),
    }
}

/// Error text of some files.
#[track_caller]
pub fn refusal<const N: usize>(list: [(&str, Vec<u8>); N]) -> String {
    read(list).expect_err("the file is wrong").to_string()
}

/// Rows of a text: each item's numbers, with a separator.
pub fn rows<T: ToString>(items: impl IntoIterator<Item = Vec<T>>, separator: &str) -> String {
    let row = |item: Vec<T>| item.iter().map(T::to_string).collect::<Vec<_>>().join(separator) + "\n";
    items.into_iter().map(row).collect()
}

/// Number, and three coordinates, of each node.
pub fn node_rows(mesh: &Mesh, first: usize, separator: &str) -> String {
    rows(
        (first..).zip(&mesh.nodes).map(|(number, node)| {
            vec![number.to_string(), node.x.to_string(), node.y.to_string(), node.z.to_string()]
        }),
        separator,
    )
}

/// Number, and four nodes, of each tetrahedron.
pub fn tet_rows(mesh: &Mesh, first: usize, separator: &str) -> String {
    rows(
        (first..)
            .zip(&mesh.tets)
            .map(|(number, tet)| [&[number][..], &tet.map(|node| node as usize + first)].concat()),
        separator,
    )
}

/// Number in the file of a tetrahedron's region.
pub fn tag(mesh: &Mesh, tet: usize) -> i64 {
    mesh.regions[mesh.tet_regions[tet] as usize].tag
}

/// Signed volume of all tetrahedra [m³].
pub fn total_volume(mesh: &Mesh) -> f64 {
    let of = |tet: &[u32; 4]| {
        let [a, b, c, d] = tet.map(|node| mesh.nodes[node as usize]);
        (b - a).cross(c - a).dot(d - a) / 6.0
    };
    mesh.tets.iter().map(of).sum()
}
