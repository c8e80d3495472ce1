//! Isosurface stuffing: tetrahedra of a lattice, warped and cut at a surface.
//!
//! 1. Every lattice point is inside or outside, and every edge between the two has a cut point on the surface.
//! 2. A point that lies too close to a cut point is moved onto it, and lies on the surface from then on.
//! 3. Of each tetrahedron with a point inside, the part inside is kept: a tetrahedron, pyramid or wedge.
//!
//! Reference: Labelle & Shewchuk, Isosurface Stuffing: Fast Tetrahedral Meshes with Good Dihedral Angles (2007).

use super::lattice::Lattice;
use super::tree::SurfaceTree;
use super::watch::Watch;
use crate::elements::{Elements, Shape};
use crate::error::MeshError;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;

/// Share of a long and of a short edge within which a cut point moves its end: table 1 of the reference, for the best
/// bound on dihedral angles of a mesh of equal cells.
const WARPED_LONG: f64 = 0.24999;
const WARPED_SHORT: f64 = 0.41189;

/// Bisections of an edge that does not meet exactly one triangle: a 10⁻⁶ of a cell is below what a file in f32 holds.
const BISECTIONS: u32 = 20;

/// Lattice points between two questions of the watch.
const CHUNK: usize = 20_000;

/// Side of the surface that a lattice point is on.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Side {
    Inside,
    On,
    Outside,
}

/// Cut point of an edge of the lattice.
struct Cut {
    ends: [u32; 2],
    point: DVec3,
    is_long: bool,
}

/// Nodes and tetrahedra of positive volume inside a surface.
///
/// # Errors
/// [`MeshError::Interrupted`].
pub(super) fn stuff(
    lattice: &Lattice,
    tree: &SurfaceTree,
    watch: &mut Watch,
) -> Result<(Vec<DVec3>, Vec<[u32; 4]>), MeshError> {
    let mut sides = Vec::with_capacity(lattice.len());
    let points: Vec<u32> = (0..lattice.len() as u32).collect();
    for (done, chunk) in points.chunks(CHUNK).enumerate() {
        watch.at((done * CHUNK) as f64 / points.len() as f64)?;
        let side = |&point: &u32| {
            if tree.has_inside(lattice.position(point)) { Side::Inside } else { Side::Outside }
        };
        sides.par_extend(chunk.par_iter().map(side));
    }
    let cuts = cuts(lattice, tree, &sides);
    watch.at(1.0)?;
    let (moved, cuts) = warp(lattice, cuts, &mut sides);
    Ok(fill(lattice, &sides, &moved, &cuts))
}

/// Cut points of all edges that cross the surface, in the order of their ends.
fn cuts(lattice: &Lattice, tree: &SurfaceTree, sides: &[Side]) -> Vec<Cut> {
    let of_point = |point: u32| {
        let crosses =
            move |(other, _): &(u32, bool)| point < *other && sides[point as usize] != sides[*other as usize];
        lattice.neighbours(point).filter(crosses).map(move |(other, is_long)| {
            let inside_first =
                if sides[point as usize] == Side::Inside { [point, other] } else { [other, point] };
            let [from, to] = inside_first.map(|end| lattice.position(end));
            Cut { ends: [point, other], point: surface_point(tree, from, to), is_long }
        })
    };
    (0..sides.len() as u32).into_par_iter().flat_map_iter(of_point).collect()
}

/// Point at which a segment leaves the inside.
fn surface_point(tree: &SurfaceTree, inside: DVec3, outside: DVec3) -> DVec3 {
    let crossings = tree.crossings(inside, outside);
    // Triangles that share an edge are met there at one share, to rounding.
    if let Some(&share) =
        crossings.first().filter(|first| crossings.iter().all(|t| (t - *first).abs() < 1e-9))
    {
        return inside.lerp(outside, share);
    }
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        let is_inside = tree.has_inside(inside.lerp(outside, middle));
        *(if is_inside { &mut low } else { &mut high }) = middle;
    }
    inside.lerp(outside, 0.5 * (low + high))
}

/// Moves lattice points onto cut points nearby; returns their positions, and the cuts that are left.
fn warp(lattice: &Lattice, cuts: Vec<Cut>, sides: &mut [Side]) -> (HashMap<u32, DVec3>, Vec<Cut>) {
    let mut of_point: Vec<(u32, u32)> =
        (0..).zip(&cuts).flat_map(|(number, cut)| cut.ends.map(|end| (end, number))).collect();
    of_point.sort_unstable();
    let mut is_left = vec![true; cuts.len()];
    let mut moved = HashMap::new();
    for own in of_point.chunk_by(|a, b| a.0 == b.0) {
        let point = own[0].0;
        let position = lattice.position(point);
        let left = own.iter().map(|(_, cut)| *cut as usize).filter(|&cut| is_left[cut]);
        let share = |cut: usize| {
            let Cut { point, is_long, .. } = cuts[cut];
            let allowed = if is_long { WARPED_LONG } else { WARPED_SHORT * 0.75_f64.sqrt() };
            (point - position).length() / (allowed * lattice.cell)
        };
        let nearest = left.map(|cut| (share(cut), cut)).min_by(|a, b| a.0.total_cmp(&b.0));
        if let Some((_, cut)) = nearest.filter(|(share, _)| *share < 1.0) {
            moved.insert(point, cuts[cut].point);
            sides[point as usize] = Side::On;
            own.iter().for_each(|(_, cut)| is_left[*cut as usize] = false);
        }
    }
    let mut is_left = is_left.into_iter();
    (moved, cuts.into_iter().filter(|_| is_left.next().unwrap_or(false)).collect())
}

/// Parts inside of all tetrahedra of the lattice.
///
/// Cut points come first, those of long edges before others: solids are split at the node with the smallest number, and a diagonal from
/// the cut point of a long edge gives the better angles.
fn fill(
    lattice: &Lattice,
    sides: &[Side],
    moved: &HashMap<u32, DVec3>,
    cuts: &[Cut],
) -> (Vec<DVec3>, Vec<[u32; 4]>) {
    let mut nodes = Vec::new();
    let mut of_edge = HashMap::new();
    for is_long in [true, false] {
        for cut in cuts.iter().filter(|cut| cut.is_long == is_long) {
            of_edge.insert(cut.ends, nodes.len() as u32);
            nodes.push(cut.point);
        }
    }
    let mut of_point = vec![u32::MAX; sides.len()];
    let mut node_of = |nodes: &mut Vec<DVec3>, point: u32| {
        let node = &mut of_point[point as usize];
        if *node == u32::MAX {
            *node = nodes.len() as u32;
            nodes.push(moved.get(&point).copied().unwrap_or_else(|| lattice.position(point)));
        }
        *node
    };
    let mut elements = Elements::default();
    lattice.for_each_tet(|tet| {
        let on_side = |side: Side| tet.into_iter().filter(move |&point| sides[point as usize] == side);
        let inside: Vec<u32> = on_side(Side::Inside).collect();
        if inside.is_empty() {
            return;
        }
        let on: Vec<u32> = on_side(Side::On).map(|point| node_of(&mut nodes, point)).collect();
        let outside: Vec<u32> = on_side(Side::Outside).collect();
        let cut = |a: u32, b: u32| of_edge.get(&[a.min(b), a.max(b)]).copied();
        // Cut points of each inner point's edges, outer points in order.
        let cuts: Vec<u32> =
            inside.iter().flat_map(|&a| outside.iter().filter_map(move |&b| cut(a, b))).collect();
        let own: Vec<u32> = inside.iter().map(|&point| node_of(&mut nodes, point)).collect();
        let (shape, corners) = match (own.as_slice(), cuts.as_slice()) {
            (&[a, b, c], &[ca, cb, cc]) => (Shape::Wedge, vec![a, b, c, ca, cb, cc]),
            (&[a, b], &[a1, a2, b1, b2]) => (Shape::Wedge, vec![a, a1, a2, b, b1, b2]),
            (&[a, b], &[ca, cb]) => (Shape::Pyramid, vec![a, b, cb, ca, on[0]]),
            // No quadrilateral is cut off.
            _ => (Shape::Tetrahedron, [own, cuts, on].concat()),
        };
        elements.add(shape, &corners, 0);
    });
    let mesh = elements.into_file(String::new(), nodes, Vec::new(), |_| 0, |_| None).mesh;
    (mesh.nodes, mesh.tets)
}
