//! Errors of mesh files, mesh generators and the mesh check.

use glam::DVec3;
use std::fmt;
use std::path::PathBuf;

/// A mesh that cannot be read, made or used. Node and tetrahedron numbers count from 0.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The file could not be opened or read.
    #[error("cannot read mesh {path}: {source}", path = path.display())]
    Read {
        /// Path of the file.
        path: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The content of the file does not follow its format.
    #[error("{path}: {position}: {message}", path = path.display())]
    Format {
        /// Path of the file.
        path: PathBuf,
        /// Position of the error in the file.
        position: FilePosition,
        /// Value that was found, and what is expected.
        message: String,
    },
    /// A file that the mesh needs beside it could not be opened or read.
    #[error("{path} needs {companion} beside it, which cannot be read: {source}", path = path.display(), companion = companion.display())]
    Companion {
        /// Path of the file that was given.
        path: PathBuf,
        /// Path of the file that it needs.
        companion: PathBuf,
        /// Error of the operating system.
        source: std::io::Error,
    },
    /// The file is of a format that is not read.
    #[error("{path}: this is {found}, which palpate does not read: {advice}", path = path.display())]
    Foreign {
        /// Path of the file.
        path: PathBuf,
        /// Format that was recognised, with its article.
        found: &'static str,
        /// Way to a format that is read.
        advice: &'static str,
    },
    /// The file is of no known format.
    #[error(
        "{path}: the file begins with {begins}, and is of no mesh format that palpate knows: expected Gmsh (.msh), VTK (.vtk, .vtu), \
         TetGen (.node with .ele), MEDIT (.mesh, .meshb), Vega (.veg) or Abaqus (.inp), or a surface as STL, OBJ, PLY, OFF or glTF",
        path = path.display()
    )]
    Unrecognised {
        /// Path of the file.
        path: PathBuf,
        /// First line of the file, quoted and shortened.
        begins: String,
    },
    /// A cell size was given for what has tetrahedra already.
    #[error("a cell size is for surfaces, and this has its tetrahedra already: leave --cell-size out")]
    CellSizeOfSolids,
    /// Coordinates of a surface are infinite or not numbers.
    #[error("{vertices} vertices of the surface are not finite")]
    SurfaceNotFinite {
        /// Number of such vertices.
        vertices: usize,
    },
    /// No triangle of the surface has an area.
    #[error("the surface has no triangle with an area")]
    NoArea,
    /// The surface is a sheet, or lacks a side.
    #[error(
        "the surface is open: {edges} edges belong to one triangle only, about holes of {:.0} % of its area, and at most {:.0} % can be \
         closed: close it, or give a sheet a thickness, in the program that made it",
        100.0 * share, 100.0 * limit
    )]
    OpenSurface {
        /// Number of open edges.
        edges: usize,
        /// Area of the holes over that of the surface.
        share: f64,
        /// Largest allowed share.
        limit: f64,
    },
    /// No lattice point lies inside the surface.
    #[error(
        "no tetrahedron of cells of {cell_size:.3e} m fits into the surface, which is about {thickness:.1e} m thick: give a --cell-size \
         below that, in metres"
    )]
    NoInside {
        /// Side of a cell [m].
        cell_size: f64,
        /// Twice the volume over the area [m].
        thickness: f64,
    },
    /// The cell size is not a positive number.
    #[error("cell size is {cell_size} m, expected a positive number")]
    CellSize {
        /// The given size [m].
        cell_size: f64,
    },
    /// The lattice would have too many points.
    #[error(
        "cells of {cell_size:.3e} m about the surface, which is {extent:.3e} m large, need {points:.1e} lattice points, of 1.0e6 at \
         most: give a --cell-size of {smallest:.3e} m or more, or the --scale of the file's unit to metres"
    )]
    TooManyCells {
        /// Side of a cell [m].
        cell_size: f64,
        /// Largest extent of the surface [m].
        extent: f64,
        /// Number of lattice points.
        points: f64,
        /// Smallest allowed size [m].
        smallest: f64,
    },
    /// The caller asked to stop.
    #[error("interrupted")]
    Interrupted,
    /// The scale factor is not a positive number.
    #[error("scale is {factor}, expected a positive number")]
    Scale {
        /// The given factor.
        factor: f64,
    },
    /// A side of a box is not a positive number.
    #[error("box size is {size:?} m, expected three positive numbers")]
    BoxSize {
        /// Sides of the box [m].
        size: [f64; 3],
    },
    /// The number of cells of a box is out of range.
    #[error(
        "box of {cells:?} cells has {tetrahedra} tetrahedra, expected 1 cell or more a side and at most {limit} tetrahedra"
    )]
    BoxCells {
        /// Cells along each side.
        cells: [u32; 3],
        /// Resulting number of tetrahedra.
        tetrahedra: u64,
        /// Largest allowed number of tetrahedra.
        limit: u64,
    },
    /// The radius of a ball is not a positive number.
    #[error("sphere radius is {radius} m, expected a positive number")]
    BallRadius {
        /// The given radius [m].
        radius: f64,
    },
    /// The number of layers of a ball is out of range.
    #[error(
        "sphere of {layers} layers has {tetrahedra} tetrahedra, expected 1 layer or more and at most {limit} tetrahedra"
    )]
    BallLayers {
        /// Layers between centre and surface.
        layers: u32,
        /// Resulting number of tetrahedra.
        tetrahedra: u64,
        /// Largest allowed number of tetrahedra.
        limit: u64,
    },
    /// The mesh is empty, or a mere surface.
    #[error("the mesh has no tetrahedra; palpate needs a volume mesh, not a surface")]
    NoTetrahedra,
    /// A tetrahedron refers to a node that does not exist.
    #[error("tetrahedron {tetrahedron} names node {node} of {nodes}")]
    NodeNumber {
        /// Number of the tetrahedron.
        tetrahedron: usize,
        /// The node that it refers to.
        node: u32,
        /// Number of nodes in the mesh.
        nodes: usize,
    },
    /// A coordinate is infinite or not a number.
    #[error(
        "node {node} is at {position}, which is not finite (in tetrahedron {tetrahedron}; both counted from 0)"
    )]
    NotFinite {
        /// Number of the node.
        node: u32,
        /// Position of the node [m].
        position: DVec3,
        /// A tetrahedron that uses the node.
        tetrahedron: usize,
    },
    /// Tetrahedra without volume.
    #[error(
        "{count} tetrahedra are flat or repeat a node, first tetrahedron {first} (nodes {nodes:?}, all counted from 0) near {}",
        Metres(*near)
    )]
    Degenerate {
        /// Number of such tetrahedra.
        count: usize,
        /// The first of them.
        first: u32,
        /// Its nodes.
        nodes: [u32; 4],
        /// Its centroid [m].
        near: DVec3,
    },
    /// Curved tetrahedra whose Jacobian is not positive.
    #[error(
        "the mid-edge nodes of {count} tetrahedra fold them: the Jacobian is not positive (first tetrahedron {first}, corners {nodes:?}, all \
         counted from 0, near {}); mesh more finely there, or take edges straight: --order 1",
        Metres(*near)
    )]
    FoldedCurve {
        /// Number of such tetrahedra.
        count: usize,
        /// The first of them.
        first: u32,
        /// Its corners.
        nodes: [u32; 4],
        /// Centroid of its corners [m].
        near: DVec3,
    },
    /// Tetrahedra with equal nodes.
    #[error(
        "{count} tetrahedra are duplicated (the same four nodes), first tetrahedra {} and {} (counted from 0) near {}",
        first[0], first[1], Metres(*near)
    )]
    Duplicate {
        /// Number of such pairs.
        count: usize,
        /// The first pair.
        first: [u32; 2],
        /// Centroid of its first tetrahedron [m].
        near: DVec3,
    },
    /// Faces of three or more tetrahedra.
    #[error(
        "{count} faces belong to more than two tetrahedra: parts of the mesh overlap, first tetrahedra {} and {} (counted \
         from 0) near {}",
        first[0], first[1], Metres(*near)
    )]
    Overlap {
        /// Number of such faces.
        count: usize,
        /// Two tetrahedra of the first face.
        first: [u32; 2],
        /// Centroid of the first of the two [m].
        near: DVec3,
    },
    /// Faces with both their tetrahedra on one side.
    #[error(
        "{count} faces have both their tetrahedra on the same side: the mesh is inverted or folded there, first tetrahedra \
         {} and {} (counted from 0) near {}",
        first[0], first[1], Metres(*near)
    )]
    Fold {
        /// Number of such faces.
        count: usize,
        /// The two tetrahedra of the first face.
        first: [u32; 2],
        /// Centroid of the first of the two [m].
        near: DVec3,
    },
    /// There is no piece of the chosen number.
    #[error("piece {number} is to be kept, and the body has {pieces}, counted from 1")]
    NoPiece {
        /// Chosen number.
        number: usize,
        /// Number of pieces.
        pieces: usize,
    },
    /// The tetrahedra are not connected through faces.
    #[error("{}", disconnected(*pieces, first, *coincident))]
    Disconnected {
        /// Number of connected components.
        pieces: usize,
        /// Tetrahedra of the first components, and a centroid in each [m]; four at most.
        first: Vec<(usize, DVec3)>,
        /// Two nodes on one point, if there are any: [`Mesh::merge_coincident_nodes`](super::Mesh::merge_coincident_nodes)
        /// joins them.
        coincident: Option<[u32; 2]>,
    },
}

/// Position of an error in a mesh file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FilePosition {
    /// Line of a text, counted from 1.
    Line(usize),
    /// Byte offset in a binary file, counted from 0.
    Byte(usize),
}

impl fmt::Display for FilePosition {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(f, "line {line}"),
            Self::Byte(byte) => write!(f, "byte {byte}"),
        }
    }
}

/// A position for a message [m].
pub(super) struct Metres(pub DVec3);

impl fmt::Display for Metres {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "({:.4e}, {:.4e}, {:.4e}) m", self.0.x, self.0.y, self.0.z)
    }
}

fn disconnected(pieces: usize, first: &[(usize, DVec3)], coincident: Option<[u32; 2]>) -> String {
    let list: Vec<String> =
        first.iter().map(|(size, near)| format!("{size} tetrahedra near {}", Metres(*near))).collect();
    let more = if pieces > first.len() { ", …" } else { "" };
    let advice = match coincident {
        Some([a, b]) => {
            format!("; nodes {a} and {b} lie on the same point, --merge-nodes joins such nodes")
        }
        None => "; --piece largest keeps the largest, --piece N another (palpate mesh lists them)".into(),
    };
    format!(
        "the mesh is disconnected: {pieces} pieces that share no face ({}{more}){advice}",
        list.join(", ")
    )
}
