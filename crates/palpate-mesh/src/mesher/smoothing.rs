//! Optimisation-based smoothing: nodes move where they raise the worst of their tetrahedra, measured by its smallest sine
//!
//! ```text
//! sin θ = 3·V·l / (2·A₁·A₂)      θ: dihedral angle at the edge of length l [m] between faces of areas A₁, A₂ [m²]; V: volume [m³]
//! ```
//!
//! which small and large angles lower alike. Nodes of the boundary slide on the surface. The place is searched by patterns of falling
//! size, since the worst of several tetrahedra has no gradient where they are level.
//!
//! References: Freitag & Ollivier-Gooch, Tetrahedral Mesh Improvement Using Swapping and Smoothing (1997); Hooke & Jeeves, Direct Search
//! (1961).

use super::tree::SurfaceTree;
use super::walls::Walls;
use super::watch::Watch;
use crate::error::MeshError;
use crate::faces::EDGES;
use glam::DVec3;
use std::f64::consts::FRAC_PI_4;

/// Sine of 30°: tetrahedra with all angles from 30° to 150° are left as they are.
const GOOD: f64 = 0.5;

/// Sweeps over all nodes; the worst angle hardly changes after six.
const SWEEPS: usize = 8;

/// Largest and smallest step of a search, in cells.
const STEPS: [f64; 2] = [0.16, 0.01];

/// Gain below which a move is not worth its bits.
const GAIN: f64 = 1e-4;

/// Node that may move.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Freedom {
    /// In all directions.
    Inside,
    /// Along the surface.
    OnSurface,
    /// Along sharp edges of the surface.
    OnCrease,
    /// Nowhere.
    Fixed,
}

/// Mesh with the tetrahedra of each node.
pub(super) struct Stars {
    pub nodes: Vec<DVec3>,
    pub tets: Vec<[u32; 4]>,
    /// Tetrahedra of each node, one after another, and where those of a node begin.
    of_nodes: Vec<u32>,
    begins: Vec<usize>,
}

impl Stars {
    pub fn new(nodes: Vec<DVec3>, tets: Vec<[u32; 4]>) -> Self {
        let mut begins = vec![0; nodes.len() + 1];
        tets.iter().flatten().for_each(|&node| begins[node as usize + 1] += 1);
        (0..nodes.len()).for_each(|node| begins[node + 1] += begins[node]);
        let mut free = begins.clone();
        let mut of_nodes = vec![0; 4 * tets.len()];
        for (number, tet) in (0..).zip(&tets) {
            for &node in tet {
                of_nodes[free[node as usize]] = number;
                free[node as usize] += 1;
            }
        }
        Self { nodes, tets, of_nodes, begins }
    }

    /// Tetrahedra of a node.
    pub fn of(&self, node: u32) -> &[u32] {
        &self.of_nodes[self.begins[node as usize]..self.begins[node as usize + 1]]
    }

    /// Quality of the worst tetrahedron of a node.
    pub fn worst(&self, node: u32) -> f64 {
        let qualities = self.of(node).iter().map(|&tet| quality(&self.nodes, &self.tets[tet as usize]));
        qualities.fold(f64::INFINITY, f64::min)
    }

    /// Quality of the worst tetrahedron of a node if that were elsewhere.
    pub fn worst_at(&mut self, node: u32, place: DVec3) -> f64 {
        let stay = std::mem::replace(&mut self.nodes[node as usize], place);
        let worst = self.worst(node);
        self.nodes[node as usize] = stay;
        worst
    }
}

/// Smallest sine of the dihedral angles of a tetrahedron; negative if it is inverted.
pub(super) fn quality(nodes: &[DVec3], tet: &[u32; 4]) -> f64 {
    let corners = tet.map(|node| nodes[node as usize]);
    let [a, b, c, d] = corners;
    // Twice the area of the face against each corner, six times the volume.
    let across = [(c - b).cross(d - b), (c - a).cross(d - a), (b - a).cross(d - a), (b - a).cross(c - a)];
    let areas = across.map(DVec3::length);
    let volume = across[3].dot(d - a);
    let sine = |[i, j]: [usize; 2]| {
        let (k, l) = opposite(i, j);
        volume * (corners[i] - corners[j]).length() / (areas[k] * areas[l])
    };
    let least = EDGES.map(sine).into_iter().fold(f64::INFINITY, f64::min);
    // A face without area divides by zero.
    if least.is_finite() { least } else { f64::NEG_INFINITY }
}

/// The two corners that an edge does not have.
fn opposite(i: usize, j: usize) -> (usize, usize) {
    match (i.min(j), i.max(j)) {
        (0, 1) => (2, 3),
        (0, 2) => (1, 3),
        (0, 3) => (1, 2),
        (1, 2) => (0, 3),
        (1, 3) => (0, 2),
        _ => (0, 1),
    }
}

/// Smooths a mesh; `freedoms` has one entry a node, `creases` the sharp edges of the surface, if it has any.
///
/// # Errors
/// [`MeshError::Interrupted`].
pub(super) fn smooth(
    stars: &mut Stars,
    freedoms: &[Freedom],
    walls: &Walls,
    creases: Option<&SurfaceTree>,
    watch: &mut Watch,
) -> Result<(), MeshError> {
    for sweep in 0..SWEEPS {
        watch.at(sweep as f64 / SWEEPS as f64)?;
        let mut has_moved = false;
        for (node, freedom) in (0..).zip(freedoms) {
            let along = || {
                let (u, v) = walls.normal(node).any_orthonormal_pair();
                (0..8).map(move |at| {
                    let (sin, cos) = (f64::from(at) * FRAC_PI_4).sin_cos();
                    u * sin + v * cos
                })
            };
            let directions: Vec<DVec3> = match freedom {
                Freedom::Fixed => continue,
                Freedom::Inside => (0..27).filter(|at| *at != 13).map(direction).collect(),
                Freedom::OnSurface | Freedom::OnCrease => along().collect(),
            };
            let project = |place: DVec3| {
                let place = match (freedom, creases) {
                    (Freedom::OnSurface, _) => walls.surface.closest(place).0,
                    (Freedom::OnCrease, Some(creases)) => creases.closest(place).0,
                    _ => return Some(place),
                };
                walls.are_at(node, place).then_some(place)
            };
            has_moved |= search(stars, node, &directions, project, walls.cell);
        }
        if !has_moved {
            break;
        }
    }
    Ok(())
}

/// One of the 26 directions to the neighbours in a grid.
fn direction(at: i32) -> DVec3 {
    (DVec3::new(f64::from(at % 3), f64::from(at / 3 % 3), f64::from(at / 9)) - DVec3::ONE).normalize_or_zero()
}

/// Moves a node to the best place of each pattern; whether it has moved.
fn search(
    stars: &mut Stars,
    node: u32,
    directions: &[DVec3],
    project: impl Fn(DVec3) -> Option<DVec3>,
    cell: f64,
) -> bool {
    let mut worst = stars.worst(node);
    let start = worst;
    if worst >= GOOD {
        return false;
    }
    let [mut step, least] = STEPS.map(|share| share * cell);
    while step >= least && worst < GOOD {
        let here = stars.nodes[node as usize];
        let mut best = (worst + GAIN, here);
        for direction in directions {
            let Some(place) = project(here + *direction * step) else { continue };
            let quality = stars.worst_at(node, place);
            if quality > best.0 {
                best = (quality, place);
            }
        }
        if best.1 == here {
            step *= 0.5;
        } else {
            (worst, stars.nodes[node as usize]) = best;
        }
    }
    worst > start
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use crate::faces::{dihedral_angles, tet_volume};

    #[test]
    fn quality_is_the_smallest_sine_of_the_dihedral_angles() {
        let nodes = vec![DVec3::ZERO, DVec3::X, DVec3::new(0.3, 1.1, 0.1), DVec3::new(0.4, 0.2, 0.3)];
        let tet = [0, 1, 2, 3];
        let sines = dihedral_angles(&nodes, &tet).map(f64::sin);
        let least = sines.into_iter().fold(f64::INFINITY, f64::min);
        assert!((quality(&nodes, &tet) - least).abs() < 1e-14);
        assert!((quality(&nodes, &[1, 0, 2, 3]) + sines.into_iter().fold(0.0, f64::max)).abs() < 1e-14);
        assert!(tet_volume(&nodes, &tet) > 0.0);
    }
}
