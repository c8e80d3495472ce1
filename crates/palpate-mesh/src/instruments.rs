//! Generated meshes of bodies that ring: an arched bar, a tuning fork, a bell.
//!
//! Each is a lattice of cells in coordinates of its own, of six tetrahedra per cell, placed in space by a map. Edges are straight.

use crate::error::MeshError;
use crate::faces::tet_volume;
use crate::primitives::CellSplit;
use crate::volume_mesh::{Mesh, Region};
use glam::DVec3;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, TAU};

/// Bar along x with an arch cut into its underside (y), as of a vibraphone or marimba.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArchedBar {
    /// Length [m].
    pub length: f64,
    /// Thickness at the ends [m].
    pub thickness: f64,
    /// Width [m].
    pub width: f64,
    /// Depth of the arch in the middle [m].
    pub arch_depth: f64,
    /// Length of the arch [m].
    pub arch_length: f64,
    /// Cells along x, y and z.
    pub cells: [u32; 3],
}

/// Tuning fork: two tines along y, apart in x, on a foot and a stem.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TuningFork {
    /// Length of the tines above the foot [m].
    pub tine_length: f64,
    /// Thickness of a tine in x [m].
    pub tine_thickness: f64,
    /// Gap between the tines, and thickness of the stem in x [m].
    pub gap: f64,
    /// Depth in z [m].
    pub depth: f64,
    /// Height of the foot [m].
    pub foot: f64,
    /// Length of the stem below the foot [m].
    pub stem: f64,
}

/// Bell about the axis y, with its mouth below and a hole in its crown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bell {
    /// Radius of the mouth at the middle of the wall [m].
    pub radius: f64,
    /// Height [m].
    pub height: f64,
    /// Thickness of the wall at the crown [m]; at the lip it is half as much again.
    pub thickness: f64,
    /// Radius of the hole [m].
    pub hole: f64,
    /// Cells around, and from crown to lip.
    pub cells: [u32; 2],
}

impl Default for ArchedBar {
    /// Of aluminium a bar of a vibraphone with A4, 440 Hz.
    fn default() -> Self {
        Self {
            length: 0.28,
            thickness: 0.013,
            width: 0.04,
            arch_depth: 0.00631,
            arch_length: 0.18,
            cells: [28, 2, 3],
        }
    }
}

impl Default for TuningFork {
    /// Of aluminium a fork with A4, 440 Hz.
    fn default() -> Self {
        Self {
            tine_length: 0.08395,
            tine_thickness: 0.004,
            gap: 0.008,
            depth: 0.006,
            foot: 0.008,
            stem: 0.04,
        }
    }
}

impl Default for Bell {
    /// A hand bell.
    fn default() -> Self {
        Self { radius: 0.05, height: 0.08, thickness: 0.003, hole: 0.008, cells: [24, 10] }
    }
}

/// Node of a lattice.
type Node = [u32; 3];

/// Mesh of the cells of a lattice that are kept, with its nodes placed in space. Cells are numbered by their lowest nodes; `around` is the
/// number of cells of a first axis that closes, 0 for one that does not.
fn lattice_mesh(
    cells: Node,
    around: u32,
    keep: impl Fn(Node) -> bool,
    place: impl Fn(Node) -> DVec3,
) -> Result<Mesh, MeshError> {
    let mut mesh = Mesh { regions: vec![Region::default()], ..Mesh::default() };
    let mut numbers = HashMap::new();
    let [nx, ny, nz] = cells;
    let all = (0..nx).flat_map(|i| (0..ny).flat_map(move |j| (0..nz).map(move |k| [i, j, k])));
    for cell in all.filter(|cell| keep(*cell)) {
        for tet in CellSplit::Six.of_cell(0) {
            let mut tet = tet.map(|corner| {
                let mut node: Node = [0, 1, 2].map(|axis| cell[axis] + corner[axis]);
                node[0] = node[0].checked_rem(around).unwrap_or(node[0]);
                *numbers.entry(node).or_insert_with(|| {
                    mesh.nodes.push(place(node));
                    mesh.nodes.len() as u32 - 1
                })
            });
            // Maps of the lattice may mirror it.
            if tet_volume(&mesh.nodes, &tet) < 0.0 {
                tet.swap(2, 3);
            }
            mesh.tets.push(tet);
        }
    }
    mesh.tet_regions = vec![0; mesh.tets.len()];
    mesh.checked()
}

impl ArchedBar {
    /// Mesh about the middle of its box.
    ///
    /// # Errors
    /// When the sizes give no sound body.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let size = DVec3::new(self.length, self.thickness, self.width);
        let cells = DVec3::from(self.cells.map(f64::from));
        lattice_mesh(
            self.cells,
            0,
            |_| true,
            |node| {
                let share = DVec3::from(node.map(f64::from)) / cells - DVec3::splat(0.5);
                let mut at = share * size;
                let from_middle = at.x / (0.5 * self.arch_length);
                let arch = self.arch_depth * (1.0 - from_middle * from_middle).max(0.0);
                // The upper side stays.
                at.y += (0.5 - share.y) * arch;
                at
            },
        )
    }
}

impl TuningFork {
    /// Mesh with the origin between the tines' roots.
    ///
    /// # Errors
    /// When the sizes give no sound body.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        /// Cells of a tine and the gap in x, of stem, foot and tines in y, and in z.
        const X: [u32; 3] = [2, 2, 2];
        const Y: [u32; 3] = [8, 2, 20];
        const Z: u32 = 2;
        let half_gap = 0.5 * self.gap;
        let x =
            along([-half_gap - self.tine_thickness, -half_gap, half_gap, half_gap + self.tine_thickness], X);
        let y = along([-self.foot - self.stem, -self.foot, 0.0, self.tine_length], Y);
        let keep = |[i, j, _]: Node| {
            let in_middle = (X[0]..X[0] + X[1]).contains(&i);
            match j {
                j if j < Y[0] => in_middle,
                j if j < Y[0] + Y[1] => true,
                _ => !in_middle,
            }
        };
        let place = |[i, j, k]: Node| {
            let z = self.depth * (f64::from(k) / f64::from(Z) - 0.5);
            DVec3::new(x[i as usize], y[j as usize], z)
        };
        lattice_mesh([X.iter().sum(), Y.iter().sum(), Z], 0, keep, place)
    }
}

/// Coordinates of lattice nodes with numbers of cells between given places.
fn along(places: [f64; 4], cells: [u32; 3]) -> Vec<f64> {
    let mut all = vec![places[0]];
    for (pair, count) in places.windows(2).zip(cells) {
        all.extend((1..=count).map(|n| pair[0] + (pair[1] - pair[0]) * f64::from(n) / f64::from(count)));
    }
    all
}

impl Bell {
    /// Mesh with the origin in the middle of the mouth.
    ///
    /// # Errors
    /// When the sizes give no sound body.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        /// Radius of the waist, of that of the mouth, and power of the flare.
        const WAIST: f64 = 0.72;
        const FLARE: f64 = 4.0;
        let waist = WAIST * self.radius;
        let start = (self.hole / waist).clamp(0.0, 1.0).asin();
        // Profile of the middle of the wall: an ellipse from the hole down, with a flare to the lip; radius and height.
        let profile = |u: f64| {
            let angle = start + u * (FRAC_PI_2 - start);
            let flare = (self.radius - waist) * u.powf(FLARE);
            (waist * angle.sin() + flare, self.height * angle.cos())
        };
        let [around, down] = self.cells;
        let place = |[i, j, k]: Node| {
            let u = f64::from(j) / f64::from(down);
            let ((r, y), (before, after)) = (profile(u), (profile(u - 1e-4), profile(u + 1e-4)));
            // Outwards normal of the profile, and the share of the wall's thickness.
            let (dr, dy) = (after.0 - before.0, after.1 - before.1);
            let length = dr.hypot(dy);
            let out = self.thickness * (1.0 + 0.5 * u.powf(FLARE)) * (f64::from(k) - 0.5);
            let (r, y) = (r - dy / length * out, y + dr / length * out);
            let (sin, cos) = (TAU * f64::from(i) / f64::from(around)).sin_cos();
            DVec3::new(r * cos, y, r * sin)
        };
        lattice_mesh([around, down, 1], around, |_| true, place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &Mesh) -> f64 {
        mesh.tets.iter().map(|tet| tet_volume(&mesh.nodes, tet)).sum()
    }

    #[test]
    fn instruments_are_sound_bodies_with_the_volume_of_their_sizes() {
        let bar = ArchedBar::default();
        let mesh = bar.mesh().expect("a bar");
        // A parabola takes two thirds of its box; the arch is cut at the lattice.
        let box_volume = bar.length * bar.thickness * bar.width;
        let arch = 2.0 / 3.0 * bar.arch_depth * bar.arch_length * bar.width;
        assert!((volume(&mesh) / (box_volume - arch) - 1.0).abs() < 0.005, "{}", volume(&mesh));
        let fork = TuningFork::default();
        let foot = (2.0 * fork.tine_thickness + fork.gap) * fork.foot;
        let area = 2.0 * fork.tine_thickness * fork.tine_length + foot + fork.gap * fork.stem;
        let mesh = fork.mesh().expect("a fork");
        assert!((volume(&mesh) / (area * fork.depth) - 1.0).abs() < 1e-12);
        // A shell: half of its surface times its thickness, which grows towards the lip.
        let bell = Bell::default();
        let mesh = bell.mesh().expect("a bell");
        let faces = mesh.boundary();
        let area: f64 = faces
            .iter()
            .map(|face| {
                let [a, b, c] = face.map(|node| mesh.nodes[node as usize]);
                0.5 * (b - a).cross(c - a).length()
            })
            .sum();
        let shell = 0.5 * area * bell.thickness;
        assert!((1.0..1.35).contains(&(volume(&mesh) / shell)), "{} {shell}", volume(&mesh));
        assert!(mesh.warnings.is_empty(), "{:?}", mesh.warnings);
    }

    #[test]
    fn the_bell_is_closed_around_its_axis() {
        let bell = Bell::default();
        let mesh = bell.mesh().expect("a bell");
        let [around, down] = bell.cells;
        assert_eq!(mesh.nodes.len() as u32, around * (down + 1) * 2);
        assert_eq!(mesh.tets.len() as u32, around * down * 6);
        let centre: DVec3 = mesh.nodes.iter().sum::<DVec3>() / mesh.nodes.len() as f64;
        assert!(centre.x.hypot(centre.z) < 1e-12 && centre.y > 0.0);
    }

    #[test]
    fn impossible_sizes_are_refused() {
        assert!(ArchedBar { arch_depth: 0.014, ..ArchedBar::default() }.mesh().is_err());
        assert!(TuningFork { gap: 0.0, ..TuningFork::default() }.mesh().is_err());
        assert!(Bell { cells: [0, 3], ..Bell::default() }.mesh().is_err());
    }
}
