//! Generated meshes of soft bodies: a liver with a lump, and a jelly that was turned out of its mould.

use crate::error::MeshError;
use crate::faces::{EDGES, tet_volume};
use crate::mesher::{MeshingParameters, tetrahedralise};
use crate::primitives::ball_mesh;
use crate::surface_mesh::SurfaceMesh;
use crate::volume_mesh::{Mesh, MidEdgeNode, NodeGroup, Region};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::{FRAC_PI_3, TAU};
use std::ops::ControlFlow;

/// Name of the group of the nodes of a flat underside.
const UNDERSIDE: &str = "underside";

/// Body in the shape of a liver, flat below, with a ball of its own region inside: regions `liver` and `lump`, group `underside`.
///
/// Sections across x are symmetric about [`Liver::ridge_z`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Liver {
    /// Half of the length along x [m].
    pub half_length: f64,
    /// Height above the rim, along y, in the middle [m].
    pub above: f64,
    /// Height below the rim, along y [m].
    pub below: f64,
    /// Half of the width along z, in the middle [m].
    pub half_width: f64,
    /// Middle of the lump [m].
    pub lump: DVec3,
    /// Radius of the lump [m]; 0 for none.
    pub lump_radius: f64,
    /// Side of the cells [m].
    pub cell_size: f64,
}

impl Default for Liver {
    /// 16 cm long, with a lump of 2.4 cm, 7 mm below its surface.
    fn default() -> Self {
        Self {
            half_length: 0.08,
            above: 0.034,
            below: 0.012,
            half_width: 0.052,
            lump: DVec3::new(0.03, 0.012, 0.032),
            lump_radius: 0.012,
            cell_size: 0.01,
        }
    }
}

impl Liver {
    /// Share by which the body is wider and higher at one end, and narrower at the other.
    const TAPER: f64 = 0.3;
    /// Share of the lower half's height below which the underside is flat.
    const FLAT_FROM: f64 = 0.6;
    /// Shift of the ends across, as a share of the half width.
    const BEND: f64 = 0.45;
    /// Layers of the ball whose surface is mapped.
    const LAYERS: u32 = 16;

    /// Middle of the section at x along z [m].
    pub fn ridge_z(&self, x: f64) -> f64 {
        let share = x / self.half_length;
        -Self::BEND * self.half_width * (share * share - 0.4)
    }

    /// Point of the body for one of the unit ball.
    fn place(&self, unit: DVec3) -> DVec3 {
        let width = 1.0 + Self::TAPER * unit.x;
        let y = if unit.y > 0.0 {
            self.above * width * unit.y
        } else {
            let missing = 1.0 - (-unit.y / Self::FLAT_FROM).min(1.0);
            -self.below * (1.0 - missing * missing)
        };
        let x = self.half_length * unit.x;
        DVec3::new(x, y, self.ridge_z(x) + self.half_width * width * unit.z)
    }

    /// Mesh with the rim at y = 0. The lump is of the cells whose middle lies in it.
    ///
    /// # Errors
    /// When the sizes give no sound body.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let mut surface = SurfaceMesh::from_boundary(ball_mesh(1.0, Self::LAYERS)?)?;
        surface.positions.iter_mut().for_each(|position| *position = self.place(*position));
        let meshing = MeshingParameters { cell_size: Some(self.cell_size), ..MeshingParameters::default() };
        let (mut mesh, _) = tetrahedralise(&surface, &meshing, &mut |_| ControlFlow::Continue(()))?;
        mesh.warnings.clear();
        let region = |tag, name: &str| Region { tag, name: Some(name.into()), material: None };
        mesh.regions = vec![region(0, "liver"), region(1, "lump")];
        let middle = |tet: &[u32; 4]| tet.iter().map(|&node| mesh.nodes[node as usize]).sum::<DVec3>() / 4.0;
        let in_lump = |tet: &[u32; 4]| (middle(tet) - self.lump).length() < self.lump_radius;
        mesh.tet_regions = mesh.tets.iter().map(|tet| u32::from(in_lump(tet))).collect();
        // Corners of the boundary lie close to the surface, not on it.
        let flat = -self.below * (1.0 - 0.02);
        mesh.groups = vec![below(&mesh, flat)];
        mesh.checked()
    }
}

/// Jelly as it is turned out of its mould: a truncated cone about y with a domed top; group `underside`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Jelly {
    /// Radius at the underside [m].
    pub lower_radius: f64,
    /// Radius at the top [m].
    pub upper_radius: f64,
    /// Height of the axis [m].
    pub height: f64,
    /// Share of the height by which the rim of the top is lower.
    pub dome: f64,
    /// Rings of cells about the axis; as many layers.
    pub rings: u32,
}

impl Default for Jelly {
    /// A pudding for two.
    fn default() -> Self {
        Self { lower_radius: 0.05, upper_radius: 0.033, height: 0.065, dome: 0.12, rings: 4 }
    }
}

/// Place of a node in a cylinder: ring, angle [rad] and share of the height.
#[derive(Clone, Copy)]
struct CylinderPlace {
    ring: f64,
    angle: f64,
    height: f64,
}

impl Jelly {
    fn place(&self, at: CylinderPlace) -> DVec3 {
        let share = at.ring / f64::from(self.rings);
        let radius = self.lower_radius + (self.upper_radius - self.lower_radius) * at.height;
        let height = self.height * at.height * (1.0 - self.dome * share * share * at.height);
        DVec3::new(radius * share * at.angle.cos(), height, radius * share * at.angle.sin())
    }

    /// Mesh with the middle of the underside at the origin. Edges of the wall have mid-edge nodes on it.
    ///
    /// # Errors
    /// When the sizes give no sound body.
    pub fn mesh(&self) -> Result<Mesh, MeshError> {
        let rings = self.rings;
        let in_disk = 1 + 3 * rings * (rings + 1);
        // Ring k has 6k nodes, after those of the rings within.
        let number = |ring: u32, at: u32| match ring {
            0 => 0,
            _ => 1 + 3 * ring * (ring - 1) + at % (6 * ring),
        };
        let mut places = Vec::new();
        for layer in 0..=rings {
            let height = f64::from(layer) / f64::from(rings.max(1));
            for ring in 0..=rings {
                for at in 0..(6 * ring).max(1) {
                    let angle = f64::from(at) * FRAC_PI_3 / f64::from(ring.max(1));
                    places.push(CylinderPlace { ring: f64::from(ring), angle, height });
                }
            }
        }
        let mut triangles = Vec::new();
        for ring in 1..=rings {
            for sector in 0..6 {
                let (outer, inner) = (sector * ring, sector * (ring - 1));
                for at in 0..ring {
                    let [a, b] = [at, at + 1].map(|at| number(ring, outer + at));
                    triangles.push([a, b, number(ring - 1, inner + at)]);
                    if at + 1 < ring {
                        let [c, d] = [at, at + 1].map(|at| number(ring - 1, inner + at));
                        triangles.push([c, b, d]);
                    }
                }
            }
        }
        let mut mesh = Mesh {
            nodes: places.iter().map(|place| self.place(*place)).collect(),
            regions: vec![Region::default()],
            ..Mesh::default()
        };
        for layer in 0..rings {
            let up = |node: u32| node + in_disk;
            for triangle in &triangles {
                // A prism in three tetrahedra: each side is cut from its lower number below to its higher one above.
                let mut corners = triangle.map(|node| node + layer * in_disk);
                corners.sort_unstable();
                let [a, b, c] = corners;
                for mut tet in [[a, b, c, up(c)], [a, b, up(b), up(c)], [a, up(a), up(b), up(c)]] {
                    if tet_volume(&mesh.nodes, &tet) < 0.0 {
                        tet.swap(2, 3);
                    }
                    mesh.tets.push(tet);
                }
            }
        }
        mesh.tet_regions = vec![0; mesh.tets.len()];
        self.round_wall(&mut mesh, &places);
        mesh.groups = vec![below(&mesh, 1e-9 * self.height)];
        mesh.checked()
    }

    /// Adds mid-edge nodes to the edges of the wall.
    fn round_wall(&self, mesh: &mut Mesh, places: &[CylinderPlace]) {
        let rim = f64::from(self.rings);
        let mut middles = BTreeMap::new();
        for tet in &mesh.tets {
            for [a, b] in EDGES.map(|edge| edge.map(|corner| tet[corner])) {
                let [p, q] = [a, b].map(|node| places[node as usize]);
                let between = f64::midpoint(p.angle, q.angle);
                let angle = if (p.angle - q.angle).abs() < 0.5 * TAU { between } else { between + 0.5 * TAU };
                if p.ring == rim && q.ring == rim {
                    let height = f64::midpoint(p.height, q.height);
                    middles.insert([a.min(b), a.max(b)], CylinderPlace { ring: rim, angle, height });
                }
            }
        }
        for (ends, place) in middles {
            let node = mesh.nodes.len() as u32;
            mesh.nodes.push(self.place(place));
            mesh.mid_edge_nodes.push(MidEdgeNode { ends, node });
        }
    }
}

/// Nodes at or below a height: the underside.
fn below(mesh: &Mesh, height: f64) -> NodeGroup {
    let low = |node: &u32| mesh.nodes[*node as usize].y <= height;
    NodeGroup { name: UNDERSIDE.into(), nodes: (0..mesh.nodes.len() as u32).filter(low).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volume(mesh: &Mesh, region: u32) -> f64 {
        let tets = mesh.tets.iter().zip(&mesh.tet_regions).filter(|(_, of)| **of == region);
        tets.map(|(tet, _)| tet_volume(&mesh.nodes, tet)).sum()
    }

    #[test]
    fn the_lump_of_the_liver_has_its_volume_and_lies_inside() {
        let liver = Liver::default();
        for (cell_size, tolerance) in [(0.01, 0.15), (0.005, 0.05)] {
            let mesh = Liver { cell_size, ..liver }.mesh().expect("a liver");
            assert!(mesh.warnings.is_empty(), "{:?}", mesh.warnings);
            let lump = volume(&mesh, 1) / (TAU * 2.0 / 3.0 * liver.lump_radius.powi(3));
            assert!((lump - 1.0).abs() < tolerance, "{cell_size}: {lump}");
            let boundary = mesh.boundary();
            let in_lump = |node: &u32| (mesh.nodes[*node as usize] - liver.lump).length() < liver.lump_radius;
            assert!(!boundary.iter().flatten().any(in_lump), "{cell_size}");
            // Half of an ellipsoid above the rim, and a flat underside.
            let above = TAU / 3.0 * liver.half_length * liver.above * liver.half_width;
            let all = (volume(&mesh, 0) + volume(&mesh, 1)) / above;
            assert!((1.2..1.6).contains(&all), "{cell_size}: {all}");
            let flat = mesh.groups[0].nodes.len() as f64 * cell_size * cell_size;
            let ellipse = 0.5 * TAU * liver.half_length * liver.half_width;
            assert!((0.5..1.5).contains(&(flat / ellipse)), "{cell_size}: {}", flat / ellipse);
        }
    }

    #[test]
    fn the_jelly_is_a_sound_cone_whose_volume_converges() {
        let jelly = Jelly { dome: 0.0, ..Jelly::default() };
        let (a, b) = (jelly.lower_radius, jelly.upper_radius);
        let cone = TAU / 6.0 * jelly.height * (a * a + a * b + b * b);
        let missing = |rings: u32| {
            let mesh = Jelly { rings, ..jelly }.mesh().expect("a jelly");
            assert!(mesh.warnings.is_empty(), "{:?}", mesh.warnings);
            assert_eq!(mesh.tets.len() as u32, 18 * rings.pow(3));
            let corners = 1 + 3 * rings * (rings + 1);
            assert_eq!(
                mesh.groups[0].nodes.len() as u32,
                corners + 6 * rings,
                "with mid-edge nodes of the rim"
            );
            // On the wall: the radius is that of the height.
            for middle in &mesh.mid_edge_nodes {
                let at = mesh.nodes[middle.node as usize];
                let radius = a + (b - a) * at.y / jelly.height;
                assert!((at.x.hypot(at.z) - radius).abs() < 1e-15, "{at}");
            }
            1.0 - volume(&mesh, 0) / cone
        };
        let order = (missing(4) / missing(8)).log2();
        assert!((order - 2.0).abs() < 0.1, "observed order {order}");
    }

    #[test]
    fn impossible_sizes_are_refused() {
        assert!(Liver { half_width: 0.0, ..Liver::default() }.mesh().is_err());
        assert!(Liver { cell_size: -1.0, ..Liver::default() }.mesh().is_err());
        assert!(Jelly { rings: 0, ..Jelly::default() }.mesh().is_err());
        assert!(Jelly { upper_radius: -0.1, ..Jelly::default() }.mesh().is_err());
    }
}
