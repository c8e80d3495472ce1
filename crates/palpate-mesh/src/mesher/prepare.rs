//! Surfaces of files on their way to the mesher: welded, each triangle once, oriented outwards; holes are measured.

use super::tree::SurfaceTree;
use crate::error::MeshError;
use crate::faces::Sets;
use crate::surface_mesh::SurfaceMesh;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::{BTreeMap, HashMap, HashSet};

/// Largest area of the holes, as a share of the surface: beyond it nobody knows where the inside ends. A cube without a side
/// lacks 0.2.
const LARGEST_HOLES: f64 = 0.05;

/// A surface with an inside.
pub(super) struct Prepared {
    pub tree: SurfaceTree,
    pub surface: SurfaceMesh,
    /// Enclosed volume [m³], counted twice where parts overlap.
    pub volume: f64,
    /// Area [m²].
    pub area: f64,
    /// Whether parts of the surface lie inside others.
    pub overlaps: bool,
    /// Number of open edges, and the area of the holes about them as a share.
    pub open: (usize, f64),
    /// Repairs, a sentence each.
    pub warnings: Vec<String>,
}

impl Prepared {
    /// Twice the volume over the area [m]: the thickness of a plate.
    pub fn thickness(&self) -> f64 {
        2.0 * self.volume / self.area
    }
}

/// Repairs a surface.
///
/// # Errors
/// [`MeshError::SurfaceNotFinite`], [`MeshError::NoArea`] or [`MeshError::OpenSurface`].
pub(super) fn prepare(surface: &SurfaceMesh) -> Result<Prepared, MeshError> {
    let not_finite = surface.positions.iter().filter(|position| !position.is_finite()).count();
    if not_finite > 0 {
        return Err(MeshError::SurfaceNotFinite { vertices: not_finite });
    }
    let mut surface = surface.clone();
    let mut warnings = Vec::new();
    let before = surface.triangles.len();
    surface.weld();
    if surface.triangles.len() < before {
        warnings.push(format!(
            "{} triangles had corners on one point and were left out",
            before - surface.triangles.len()
        ));
    }
    let repeated = drop_repeated(&mut surface);
    if repeated > 0 {
        warnings.push(format!("{repeated} triangles stood twice and were left out the second time"));
    }
    let parts = orient_parts(&mut surface, &mut warnings);
    orient_outwards(&mut surface, &parts, &mut warnings);
    let area: f64 = surface.corners().iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() * 0.5).sum();
    let (edges, holes) = holes(&surface);
    if area == 0.0 {
        return Err(MeshError::NoArea);
    }
    let share = holes / area;
    if share > LARGEST_HOLES {
        return Err(MeshError::OpenSurface { edges, share, limit: LARGEST_HOLES });
    }
    if edges > 0 {
        warnings.push(format!(
            "the surface is open at {edges} edges, by {:.2} % of its area: the holes were closed smoothly",
            100.0 * share
        ));
    }
    let tree = SurfaceTree::new(surface.corners());
    let volume = surface.volume().abs();
    let overlaps = overlaps(&surface, &tree, volume / area);
    Ok(Prepared { tree, surface, volume, area, overlaps, open: (edges, share), warnings })
}

/// Triangles of which it is asked at most whether they lie inside other parts.
const ASKED: usize = 40_000;

/// Distance of a point beside its triangle, as a share of half the thickness or of the triangle.
const BESIDE: f64 = 1e-3;

/// Whether the centroid of a triangle is inside on both sides of it.
fn overlaps(surface: &SurfaceMesh, tree: &SurfaceTree, half_thickness: f64) -> bool {
    let corners = surface.corners();
    let every = corners.len().div_ceil(ASKED).max(1);
    corners.par_iter().step_by(every).any(|[a, b, c]| {
        let away = (*b - *a).cross(*c - *a).normalize_or_zero() * (BESIDE * half_thickness);
        let centroid = (*a + *b + *c) / 3.0;
        away != DVec3::ZERO && tree.has_inside(centroid + away) && tree.has_inside(centroid - away)
    })
}

/// Leaves out triangles of three corners that another has, whatever its orientation; returns their number.
fn drop_repeated(surface: &mut SurfaceMesh) -> usize {
    let before = surface.triangles.len();
    let mut known = HashSet::with_capacity(before);
    surface.triangles.retain(|triangle| {
        let mut key = *triangle;
        key.sort_unstable();
        known.insert(key)
    });
    before - surface.triangles.len()
}

/// Uses of each edge: triangles, and whether they go from its smaller to its larger node.
fn edge_uses(surface: &SurfaceMesh) -> HashMap<[u32; 2], Vec<(u32, bool)>> {
    let mut edges: HashMap<[u32; 2], Vec<(u32, bool)>> = HashMap::new();
    for (number, &[a, b, c]) in (0..).zip(&surface.triangles) {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            edges.entry([from.min(to), from.max(to)]).or_default().push((number, from < to));
        }
    }
    edges
}

/// Turns triangles against the majority of their part, so that neighbours agree; returns the part of each triangle.
///
/// Parts are connected through edges of two triangles.
fn orient_parts(surface: &mut SurfaceMesh, warnings: &mut Vec<String>) -> Vec<u32> {
    let count = surface.triangles.len();
    let edges = edge_uses(surface);
    let mut neighbours: Vec<Vec<(u32, bool)>> = vec![Vec::new(); count];
    for uses in edges.values() {
        if let &[(a, forward), (b, other)] = uses.as_slice() {
            neighbours[a as usize].push((b, forward == other));
            neighbours[b as usize].push((a, forward == other));
        }
    }
    let mut parts = vec![u32::MAX; count];
    let mut is_turned = vec![false; count];
    let mut turned = 0;
    for start in 0..count {
        if parts[start] != u32::MAX {
            continue;
        }
        parts[start] = start as u32;
        let mut part = vec![start];
        let mut at = 0;
        while at < part.len() {
            let triangle = part[at];
            for &(next, opposes) in &neighbours[triangle] {
                let next = next as usize;
                if parts[next] == u32::MAX {
                    parts[next] = start as u32;
                    is_turned[next] = is_turned[triangle] != opposes;
                    part.push(next);
                }
            }
            at += 1;
        }
        let minority = part.iter().filter(|&&triangle| is_turned[triangle]).count();
        let flip_others = 2 * minority > part.len();
        turned += if flip_others { part.len() - minority } else { minority };
        for &triangle in &part {
            if is_turned[triangle] != flip_others {
                surface.triangles[triangle].swap(1, 2);
            }
        }
    }
    if turned > 0 {
        warnings
            .push(format!("{turned} triangles faced the other way than their neighbours and were turned"));
    }
    parts
}

/// Turns parts that face inwards, except those that lie within others: these are the walls of cavities.
fn orient_outwards(surface: &mut SurfaceMesh, parts: &[u32], warnings: &mut Vec<String>) {
    if surface.volume() < 0.0 {
        surface.flip_orientation();
        warnings.push("the surface faced inwards and was turned".to_owned());
    }
    let mut of_part: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    parts.iter().enumerate().for_each(|(triangle, part)| of_part.entry(*part).or_default().push(triangle));
    let middle = surface.positions.iter().sum::<DVec3>() / surface.positions.len().max(1) as f64;
    let volume = |surface: &SurfaceMesh, part: &[usize]| -> f64 {
        let of = |&triangle: &usize| {
            let [a, b, c] = surface.triangles[triangle].map(|node| surface.positions[node as usize] - middle);
            a.dot(b.cross(c)) / 6.0
        };
        part.iter().map(of).sum()
    };
    let inward: Vec<u32> =
        of_part.iter().filter(|(_, part)| volume(surface, part) < 0.0).map(|(part, _)| *part).collect();
    if inward.is_empty() {
        return;
    }
    // All face outwards, to see which lie within others.
    let turn = |surface: &mut SurfaceMesh, part: &[usize]| {
        part.iter().for_each(|&triangle| surface.triangles[triangle].swap(1, 2));
    };
    inward.iter().for_each(|part| turn(surface, &of_part[part]));
    let mut outwards = 0;
    let tree = SurfaceTree::new(surface.corners());
    for part in &inward {
        let own = &of_part[part];
        let [a, b, c] = surface.triangles[own[0]].map(|node| surface.positions[node as usize]);
        // Just outside of its own part, which so counts nothing.
        let area = (b - a).cross(c - a);
        let beside = (a + b + c) / 3.0 + area.normalize_or_zero() * (BESIDE * area.length().sqrt());
        if tree.has_inside(beside) {
            turn(surface, own);
        } else {
            outwards += 1;
        }
    }
    if outwards > 0 {
        warnings.push(format!("{outwards} parts of the surface faced inwards and were turned"));
    }
}

/// Number of edges without a balance of triangles, and the area of the holes that they surround [m²].
///
/// A hole has at least the area of its vector area ½·Σ p×q over its edges (p, q).
fn holes(surface: &SurfaceMesh) -> (usize, f64) {
    let mut open = Vec::new();
    for (&[from, to], uses) in &edge_uses(surface) {
        let balance = uses.iter().map(|(_, forward)| if *forward { 1 } else { -1 }).sum::<i32>();
        if balance != 0 {
            open.push(([from, to], f64::from(balance)));
        }
    }
    open.sort_unstable_by_key(|(edge, _)| *edge);
    let mut sets = Sets::new(surface.positions.len());
    open.iter().for_each(|([a, b], _)| sets.join(*a, *b));
    let mut areas: BTreeMap<u32, DVec3> = BTreeMap::new();
    for ([a, b], balance) in &open {
        // About a point of the hole, since far from the origin the sum would cancel.
        let root = sets.root(*a);
        let at = |node: u32| surface.positions[node as usize] - surface.positions[root as usize];
        *areas.entry(root).or_default() += at(*a).cross(at(*b)) * (0.5 * balance);
    }
    (open.len(), areas.values().map(|area| area.length()).sum())
}
