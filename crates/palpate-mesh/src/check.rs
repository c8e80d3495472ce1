//! The mesh check: one sound body, or an error with its position.

use super::coincident::{COINCIDENT, bounding_box, coincident_pairs};
use super::error::{MeshError, Metres};
use super::faces::EDGES;
use super::faces::{Face, sorted_faces, tet_volume};
use super::pieces::roots;
use super::volume_mesh::{Mesh, MidEdgeNode};
use glam::DVec3;
use std::collections::BTreeMap;

/// Volume of a degenerate tetrahedron, as a share of its longest edge cubed: below it the stiffness is round-off.
const DEGENERATE_VOLUME: f64 = 1e-10;

/// Mean-ratio quality (1: regular, 0: flat) below which a tetrahedron is reported as a sliver.
const SLIVER_QUALITY: f64 = 0.03;

/// Usual range of extents [m]: outside of it the file is most likely in another unit.
const USUAL_EXTENT: [f64; 2] = [1e-3, 3.0];

/// Number of connected components that an error lists.
const LISTED_PIECES: usize = 4;

/// Sound mesh of one or more pieces.
pub(crate) struct CheckedPieces {
    pub mesh: Mesh,
    faces: Vec<Face>,
    /// Two nodes on one point, if there are any.
    coincident: Option<[u32; 2]>,
}

impl Mesh {
    /// Checks that the mesh is one sound body and orients its tetrahedra to positive volume.
    ///
    /// Warnings are added to [`Mesh::warnings`].
    ///
    /// # Errors
    /// [`MeshError`] for a mesh that is empty, not finite, degenerate, duplicated, folded or disconnected.
    pub fn checked(self) -> Result<Self, MeshError> {
        let CheckedPieces { mesh, faces, coincident } = self.check_pieces()?;
        check_connected(&mesh, &faces, coincident)?;
        Ok(mesh)
    }

    /// [`Mesh::checked`] for a mesh that may have several pieces.
    pub(crate) fn check_pieces(mut self) -> Result<CheckedPieces, MeshError> {
        let used = self.used_nodes()?;
        let (low, high) = bounding_box(&self, &used);
        let mut is_left_out = used.iter().map(|used| !used).collect::<Vec<_>>();
        for &node in self.mid_edge_nodes.iter().map(|found| &found.node).chain(&self.mid_side_nodes) {
            // The reader has told of them.
            is_left_out.get_mut(node as usize).into_iter().for_each(|left_out| *left_out = false);
        }
        let unused = is_left_out.into_iter().filter(|left_out| *left_out).count();
        if unused > 0 {
            self.warnings.push(format!("{unused} nodes belong to no tetrahedron and are left out"));
        }
        orient(&mut self)?;
        let faces = sorted_faces(&self.tets);
        check_faces(&self, &faces)?;
        let coincident = coincident_pairs(&self.nodes, &used, COINCIDENT * (high - low).length());
        if let Some(&(a, b)) = coincident.first() {
            self.warnings.push(format!(
                "{} pairs of nodes lie on the same point (nodes {a} and {b}, counted from 0, at {}): the body is slit open there. If it \
                 should not be, use --merge-nodes",
                coincident.len(),
                Metres(self.nodes[a as usize])
            ));
        }
        if !self.is_unit_asked {
            self.warnings.extend(size_question(high - low, 1.0));
        }
        warn_about_quality(&mut self);
        Ok(CheckedPieces { mesh: self, faces, coincident: coincident.first().map(|&(a, b)| [a, b]) })
    }

    /// Question about the unit of a body of an unusual size, by the scale to metres: to be asked before it is recorded, which takes long.
    pub fn unit_question(&self, scale: f64) -> Option<String> {
        let (low, high) = bounding_box(self, &self.used_nodes().ok()?);
        size_question(scale * (high - low), scale)
    }

    /// Whether each node belongs to a tetrahedron; refuses unknown nodes and coordinates that are not finite.
    pub(crate) fn used_nodes(&self) -> Result<Vec<bool>, MeshError> {
        if self.tets.is_empty() {
            return Err(MeshError::NoTetrahedra);
        }
        let nodes = self.nodes.len();
        let mut used = vec![false; nodes];
        for (tetrahedron, tet) in self.tets.iter().enumerate() {
            for &node in tet {
                match self.nodes.get(node as usize) {
                    None => return Err(MeshError::NodeNumber { tetrahedron, node, nodes }),
                    Some(&position) if !position.is_finite() => {
                        return Err(MeshError::NotFinite { node, position, tetrahedron });
                    }
                    Some(_) => used[node as usize] = true,
                }
            }
        }
        for &MidEdgeNode { ends, node } in &self.mid_edge_nodes {
            let position = self.nodes.get(node as usize).copied();
            if position.is_some_and(DVec3::is_finite) {
                continue;
            }
            let of_edge = |tet: &[u32; 4]| ends.iter().all(|end| tet.contains(end));
            let tetrahedron = self.tets.iter().position(of_edge).unwrap_or(0);
            return Err(match position {
                None => MeshError::NodeNumber { tetrahedron, node, nodes },
                Some(position) => MeshError::NotFinite { node, position, tetrahedron },
            });
        }
        Ok(used)
    }
}

/// Centroid of a tetrahedron [m].
fn centroid(mesh: &Mesh, tet: u32) -> DVec3 {
    mesh.tets[tet as usize].iter().map(|&n| mesh.nodes[n as usize]).sum::<DVec3>() * 0.25
}

/// Swaps two corners where the volume is negative; refuses degenerate tetrahedra.
fn orient(mesh: &mut Mesh) -> Result<(), MeshError> {
    let (mut inverted, mut degenerate) = (0, Vec::new());
    for (number, tet) in mesh.tets.iter_mut().enumerate() {
        let corners = tet.map(|n| mesh.nodes[n as usize]);
        let edges = EDGES.map(|[a, b]| (corners[a] - corners[b]).length());
        let longest = edges.into_iter().fold(0.0, f64::max);
        let volume = tet_volume(&mesh.nodes, tet);
        // Beyond 1e100 m the volume overflows.
        if volume.abs() <= DEGENERATE_VOLUME * longest.powi(3) || !volume.is_finite() {
            degenerate.push(number as u32);
        } else if volume < 0.0 {
            tet.swap(2, 3);
            inverted += 1;
        }
    }
    if let Some(&first) = degenerate.first() {
        let (nodes, near) = (mesh.tets[first as usize], centroid(mesh, first));
        return Err(MeshError::Degenerate { count: degenerate.len(), first, nodes, near });
    }
    if inverted > 0 {
        mesh.warnings.push(format!(
            "{inverted} of {} tetrahedra were inverted (corners in the other order) and were turned",
            mesh.tets.len()
        ));
    }
    Ok(())
}

/// Each face must join at most two tetrahedra, on opposite sides.
fn check_faces(mesh: &Mesh, faces: &[Face]) -> Result<(), MeshError> {
    let mut sorted: Vec<_> = mesh
        .tets
        .iter()
        .enumerate()
        .map(|(number, tet)| {
            let mut key = *tet;
            key.sort_unstable();
            (key, number as u32)
        })
        .collect();
    sorted.sort_unstable();
    let equal = sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0);
    let duplicates: Vec<_> = equal.map(|pair| [pair[0].1, pair[1].1]).collect();
    let (mut overlaps, mut folds) = (Vec::new(), Vec::new());
    for same in faces.chunk_by(|a, b| a.0 == b.0) {
        match same {
            [_] => {}
            [a, b] if a.1 != b.1 => {}
            [a, b] => folds.push([a.2, b.2]),
            more => overlaps.push([more[0].2, more[1].2]),
        }
    }
    if let Some(&first) = duplicates.first() {
        return Err(MeshError::Duplicate { count: duplicates.len(), first, near: centroid(mesh, first[0]) });
    }
    if let Some(&first) = overlaps.first() {
        return Err(MeshError::Overlap { count: overlaps.len(), first, near: centroid(mesh, first[0]) });
    }
    if let Some(&first) = folds.first() {
        return Err(MeshError::Fold { count: folds.len(), first, near: centroid(mesh, first[0]) });
    }
    Ok(())
}

/// All tetrahedra must be connected through faces.
fn check_connected(mesh: &Mesh, faces: &[Face], coincident: Option<[u32; 2]>) -> Result<(), MeshError> {
    let mut sizes = BTreeMap::new();
    for root in roots(mesh.tets.len(), faces) {
        *sizes.entry(root).or_insert(0_usize) += 1;
    }
    if sizes.len() == 1 {
        return Ok(());
    }
    let first = sizes.iter().take(LISTED_PIECES).map(|(&tet, &size)| (size, centroid(mesh, tet))).collect();
    Err(MeshError::Disconnected { pieces: sizes.len(), first, coincident })
}

/// Units of length that files are written in, and their scales to metres.
const UNITS: [(&str, f64); 3] = [("metres", 1.0), ("millimetres", 1e-3), ("micrometres", 1e-6)];

/// Question about the unit of a body of this extent [m], which its file has been scaled to; none for a usual one.
pub(crate) fn size_question(extent: DVec3, scale: f64) -> Option<String> {
    let largest = four_digits(extent.max_element());
    let [small, large] = USUAL_EXTENT;
    if scale <= 0.0 || (small..=large).contains(&largest) || largest.is_nan() {
        return None;
    }
    let only = if largest < small { "only " } else { "" };
    let by = if scale == 1.0 { String::new() } else { format!(" with --scale {}", short(scale)) };
    let in_file = extent.max_element() / scale;
    let fits = |(_, unit): &&(&str, f64)| (small..=large).contains(&(unit * in_file));
    let hint = match UNITS.iter().find(fits) {
        Some((unit, scale)) => format!("if the file is in {unit}, use --scale {}", short(*scale)),
        None => "is the scale right? (--scale)".into(),
    };
    Some(format!("the body is {only}{largest} m large{by}; {hint}"))
}

/// Scale with few digits.
fn short(scale: f64) -> String {
    if (1e-4..1e7).contains(&scale) { scale.to_string() } else { format!("{scale:e}") }
}

/// Number rounded to four digits; 0 as it is.
fn four_digits(number: f64) -> f64 {
    let unit = 10.0_f64.powi(3_i32.saturating_sub(number.log10().floor() as i32));
    let rounded = (number * unit).round() / unit;
    if rounded.is_finite() { rounded } else { number }
}

/// Mean ratio 12·(3V)^(2/3)/Σ edge² (Liu & Joe 1994).
fn warn_about_quality(mesh: &mut Mesh) {
    let quality = |tet: &[u32; 4]| {
        let corners = tet.map(|n| mesh.nodes[n as usize]);
        let squares: f64 = EDGES.iter().map(|&[a, b]| (corners[a] - corners[b]).length_squared()).sum();
        12.0 * (3.0 * tet_volume(&mesh.nodes, tet)).powf(2.0 / 3.0) / squares
    };
    let qualities = mesh.tets.iter().enumerate().map(|(number, tet)| (number, quality(tet)));
    let slivers = qualities.clone().filter(|(_, q)| *q < SLIVER_QUALITY).count();
    if let Some((number, q)) = qualities.min_by(|a, b| a.1.total_cmp(&b.1)).filter(|_| slivers > 0) {
        mesh.warnings.push(format!(
            "{slivers} tetrahedra are slivers, the worst is {number} near {} with quality {q:.4} (1 is regular): \
             responses are too stiff there",
            Metres(centroid(mesh, number as u32))
        ));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_of_any_size_have_four_digits() {
        for (number, rounded) in
            [(0.0, 0.0), (12.345_67, 12.35), (1e-300, 1e-300), (1e300, 1e300), (5e-324, 5e-324)]
        {
            assert!((four_digits(number) - rounded).abs() <= 1e-15 * rounded, "{number}");
        }
        assert!(four_digits(f64::NAN).is_nan() && four_digits(f64::INFINITY).is_infinite());
    }
}
