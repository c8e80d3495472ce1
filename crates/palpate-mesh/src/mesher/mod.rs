//! From a closed surface to tetrahedra.
//!
//! The surface is repaired ([`prepare`]), a lattice is stuffed into it ([`stuffing`]), corners and edges of the boundary are moved onto
//! sharp ones of the surface ([`creases`]), and the tetrahedra are smoothed ([`smoothing`]); elements of order 2 get curved edges ([`curving`]). Nothing is random: the same surface gives the
//! same mesh, to the bit.

mod creases;
mod curving;
mod fidelity;
mod lattice;
mod manifold;
mod prepare;
mod smoothing;
mod stuffing;
mod tree;
mod walls;
mod watch;

use crate::error::MeshError;
use crate::faces::{dihedral_angles, tet_volume};
use crate::surface_mesh::SurfaceMesh;
use crate::volume_mesh::{Mesh, Region};
use glam::DVec3;
use lattice::Lattice;
use prepare::{Prepared, prepare};
use serde::Serialize;
use smoothing::{Stars, smooth};
use walls::Walls;
use watch::Watch;
pub use watch::WatchFn;

/// Nodes that a body gets by default: with quadratic elements recording takes one to two minutes on two cores.
const DEFAULT_NODES: f64 = 2000.0;

/// Nodes that a thin body may get, for cells no larger than it is thick, as a multiple of those of others.
const THIN: f64 = 7.5;

/// Largest number of lattice points. A cube of 480,000 takes 24 CPU-seconds and 0.44 GB, so a full one about twice that.
const MAX_POINTS: f64 = 1e6;

/// Nodes of the lattice in a cell, and nodes on the boundary by the area of a cell's face, as counted on balls.
const NODES_PER_CELL: f64 = 2.0;
const NODES_PER_FACE: f64 = 1.5;

/// Offset of the lattice from the bounding box, in cells: no simple fraction, so that faces of a box on round numbers do not lie on
/// lattice planes, where a point is neither inside nor outside.
const OFFSET: f64 = 0.292_893;

/// Volume of a piece, in cells, below which it is a crumb of a part too thin for the lattice.
const CRUMB: f64 = 1.0;

/// Error of the volume above which a warning advises smaller cells.
const LARGE_VOLUME_ERROR: f64 = 0.03;

/// Parameters of [`tetrahedralise`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct MeshingParameters {
    /// Side of a cell [m]: edges are 0.87 to 1 of it long inside. None for a number of nodes.
    pub cell_size: Option<f64>,
    /// About how many nodes the body gets without a cell size, more if it is thin. None for 2,000.
    pub nodes: Option<u32>,
    /// Whether edges of the boundary follow the surface by mid-edge nodes on it, for elements of order 2.
    pub curved: bool,
}

/// Report on a mesh that was made of a surface.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MeshingReport {
    /// Side of a cell [m].
    pub cell_size_m: f64,
    /// Number of nodes, without those on curved edges.
    pub nodes: usize,
    /// Number of tetrahedra.
    pub tetrahedra: usize,
    /// Smallest and largest dihedral angle [°].
    pub dihedral_range_deg: [f64; 2],
    /// Volume over that of the surface, less 1; none where parts of the surface overlap.
    pub volume_error: Option<f64>,
    /// Distance between boundary and surface, either way, in cells: 95th percentile and maximum (Hausdorff distance).
    pub distance_cells: [f64; 2],
}

/// Makes tetrahedra inside a closed surface.
///
/// Holes of up to 5 % of the area, triangles that stand twice or face the wrong way, and parts that intersect are repaired or united, with
/// a warning in [`Mesh::warnings`]. Several bodies stay several pieces.
///
/// # Errors
/// [`MeshError`] for a surface without an inside, or a cell size that is out of range; [`MeshError::Interrupted`] when `watch` says so.
pub fn tetrahedralise(
    surface: &SurfaceMesh,
    parameters: &MeshingParameters,
    watch: WatchFn,
) -> Result<(Mesh, MeshingReport), MeshError> {
    let mut watch = Watch::new(watch);
    let mut prepared = prepare(surface)?;
    let cell = cell_size(&prepared, parameters)?;
    let lattice = lattice_about(&prepared, cell)?;
    let (mut nodes, mut tets) = stuffing::stuff(&lattice, &prepared.tree, watch.stage(0.5))?;
    tets.iter_mut().filter(|tet| tet_volume(&nodes, tet) < 0.0).for_each(|tet| tet.swap(2, 3));
    if tets.is_empty() {
        return Err(MeshError::NoInside { cell_size: cell, thickness: prepared.thickness() });
    }
    let warnings = &mut prepared.warnings;
    drop_crumbs(&nodes, &mut tets, cell, warnings);
    let removed = manifold::open_touching_edges(&mut tets);
    if removed > 0 {
        warnings.push(format!("{removed} tetrahedra were removed where the boundary touched itself"));
    }
    manifold::split_touching_nodes(&mut nodes, &mut tets);
    renumber(&mut nodes, &mut tets);
    let mut stars = Stars::new(nodes, tets);
    let walls = Walls::new(&prepared, &stars, cell);
    let mut freedoms = walls.freedoms(&stars);
    let mut creases = creases::Creases::of(&prepared.surface);
    // Smoothing makes room for nodes that could not go to sharp edges before.
    for done in [0.6, 0.7, 0.8, 0.9] {
        let moved = creases.as_mut().map_or(0, |creases| creases.snap(&mut stars, &mut freedoms, &walls));
        let edges = creases.as_ref().map(|creases| &creases.edges);
        smooth(&mut stars, &freedoms, &walls, edges, watch.stage(done))?;
        if moved == 0 {
            break;
        }
    }
    let (nodes, tets) = (stars.nodes, stars.tets);
    let mut mesh = Mesh {
        tet_regions: vec![0; tets.len()],
        nodes,
        tets,
        regions: vec![Region::default()],
        ..Mesh::default()
    };
    if parameters.curved {
        curving::curve(&mut mesh, &prepared.tree);
    }
    watch.stage(1.0).at(0.0)?;
    let report = report(&mesh, &prepared, cell);
    mesh.warnings = prepared.warnings;
    mesh.warnings.push(report.summary());
    mesh.warnings.extend(report.warning());
    Ok((mesh, report))
}

/// Repairs a surface that is to be embedded in a body: vertices on one point are merged, triangles that stand twice left out, and those that
/// face inwards turned. Gives the repairs, a sentence each.
///
/// # Errors
/// [`MeshError`] for a surface that is not closed, or has no area.
pub fn closed_surface(surface: &SurfaceMesh) -> Result<(SurfaceMesh, Vec<String>), MeshError> {
    let Prepared { surface, warnings, open: (edges, share), .. } = prepare(surface)?;
    if edges > 0 {
        return Err(MeshError::OpenSurface { edges, share, limit: 0.0 });
    }
    Ok((surface, warnings))
}

impl MeshingReport {
    /// Sentence that tells of the mesh.
    fn summary(&self) -> String {
        let [least, most] = self.dihedral_range_deg;
        let volume = self.volume_error.map_or(String::new(), |e| format!(", {:+.2} % volume", 100.0 * e));
        format!(
            "the surface was filled with {} tetrahedra in cells of {:.3e} m: {least:.0}° to {most:.0}° between faces{volume}, {:.2} cells \
             from the surface at most",
            self.tetrahedra, self.cell_size_m, self.distance_cells[1]
        )
    }

    /// Advice to take smaller cells, where the volume is far off.
    fn warning(&self) -> Option<String> {
        let error = self.volume_error.filter(|error| error.abs() > LARGE_VOLUME_ERROR)?;
        Some(format!(
            "the tetrahedra have {:.1} % {} volume than the surface encloses: parts are thin beside cells of {:.3e} m; smaller cells \
             (--cell-size) keep more of them",
            100.0 * error.abs(),
            if error < 0.0 { "less" } else { "more" },
            self.cell_size_m
        ))
    }
}

/// Cell size of the parameters, or for their number of nodes.
fn cell_size(prepared: &Prepared, parameters: &MeshingParameters) -> Result<f64, MeshError> {
    let &Prepared { volume, area, .. } = prepared;
    let cell = parameters.cell_size.unwrap_or_else(|| {
        let nodes = parameters.nodes.map_or(DEFAULT_NODES, f64::from);
        let [usual, thin] = [nodes, THIN * nodes].map(|nodes| cell_for(nodes, volume, area));
        usual.min(prepared.thickness()).max(thin)
    });
    if !(cell.is_finite() && cell > 0.0) {
        return Err(MeshError::CellSize { cell_size: cell });
    }
    Ok(cell)
}

/// Cell size [m] at which a body has about so many nodes, by bisection of its logarithm.
fn cell_for(nodes: f64, volume: f64, area: f64) -> f64 {
    let estimate = |cell: f64| NODES_PER_CELL * volume / cell.powi(3) + NODES_PER_FACE * area / cell.powi(2);
    let (mut low, mut high) = (1e-6 * area.sqrt(), area.sqrt());
    for _ in 0..60 {
        let middle = (low * high).sqrt();
        *(if estimate(middle) > nodes { &mut low } else { &mut high }) = middle;
    }
    high
}

/// Lattice that covers the surface with a cell to spare.
fn lattice_about(prepared: &Prepared, cell: f64) -> Result<Lattice, MeshError> {
    let points = || prepared.surface.positions.iter().copied();
    let low = points().reduce(DVec3::min).unwrap_or_default();
    let extent = points().reduce(DVec3::max).unwrap_or_default() - low;
    let counts = |cell: f64| (extent / cell).ceil() + DVec3::splat(3.0);
    let points = |cell: f64| NODES_PER_CELL * counts(cell).element_product();
    if points(cell) > MAX_POINTS {
        let (mut too_small, mut enough) = (cell, extent.max_element());
        for _ in 0..60 {
            let middle = (too_small * enough).sqrt();
            *(if points(middle) > MAX_POINTS { &mut too_small } else { &mut enough }) = middle;
        }
        let (points, extent) = (points(cell), extent.max_element());
        return Err(MeshError::TooManyCells { cell_size: cell, extent, points, smallest: enough });
    }
    let origin = low - DVec3::splat((1.0 + OFFSET) * cell);
    Ok(Lattice { origin, cell, cells: counts(cell).to_array().map(|count| count as i64) })
}

/// Removes pieces that are smaller than a cell, unless there is nothing else.
fn drop_crumbs(nodes: &[DVec3], tets: &mut Vec<[u32; 4]>, cell: f64, warnings: &mut Vec<String>) {
    let mesh = Mesh { nodes: nodes.to_vec(), tets: std::mem::take(tets), ..Mesh::default() };
    let pieces = mesh.pieces();
    let is_kept = |volume: f64| volume >= CRUMB * cell.powi(3);
    let crumbs = pieces.iter().skip(1).filter(|piece| !is_kept(piece.volume)).count();
    if crumbs > 0 {
        warnings.push(format!(
            "{crumbs} pieces smaller than a cell of {cell:.3e} m were left out: the surface is too thin for it there"
        ));
    }
    let mut kept: Vec<u32> =
        pieces.into_iter().take_while(|piece| is_kept(piece.volume)).flat_map(|piece| piece.tets).collect();
    kept.sort_unstable();
    *tets = if kept.is_empty() {
        mesh.tets
    } else {
        kept.into_iter().map(|tet| mesh.tets[tet as usize]).collect()
    };
}

/// Leaves out nodes without tetrahedra.
fn renumber(nodes: &mut Vec<DVec3>, tets: &mut [[u32; 4]]) {
    let mut number = vec![u32::MAX; nodes.len()];
    let mut kept = Vec::new();
    for node in tets.iter_mut().flatten() {
        let known = &mut number[*node as usize];
        if *known == u32::MAX {
            *known = kept.len() as u32;
            kept.push(nodes[*node as usize]);
        }
        *node = *known;
    }
    *nodes = kept;
}

fn report(mesh: &Mesh, prepared: &Prepared, cell: f64) -> MeshingReport {
    let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
    for angle in mesh.tets.iter().flat_map(|tet| dihedral_angles(&mesh.nodes, tet)).map(f64::to_degrees) {
        (least, most) = (least.min(angle), most.max(angle));
    }
    let volume: f64 = mesh.tets.iter().map(|tet| mesh.quadratic_volume(tet)).sum();
    MeshingReport {
        cell_size_m: cell,
        nodes: mesh.nodes.len() - mesh.mid_edge_nodes.len(),
        tetrahedra: mesh.tets.len(),
        dihedral_range_deg: [least, most],
        volume_error: (!prepared.overlaps).then(|| volume / prepared.volume - 1.0),
        distance_cells: fidelity::distances(mesh, prepared, cell).map(|distance| distance / cell),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_volume_that_is_far_off_is_told_as_less_or_more() {
        let told = |volume_error: f64| {
            MeshingReport {
                cell_size_m: 0.01,
                nodes: 4,
                tetrahedra: 1,
                dihedral_range_deg: [60.0, 80.0],
                volume_error: Some(volume_error),
                distance_cells: [0.1, 0.2],
            }
            .warning()
        };
        let rest = "volume than the surface encloses: parts are thin beside cells of 1.000e-2 m; smaller cells (--cell-size) keep more of them";
        assert_eq!(told(-0.033), Some(format!("the tetrahedra have 3.3 % less {rest}")));
        assert_eq!(told(0.052), Some(format!("the tetrahedra have 5.2 % more {rest}")));
        assert_eq!(told(-0.01), None);
    }
}
