//! Levels of contact samples: Poisson-disk samples of ever wider spacing ℓ [m], and a decimated surface between those of each.
//!
//! ```text
//! ℓ_j = r·ℓ_{j−1},   ℓ₀ = mean edge        d_H = max(max_{x∈S} d(x, D), max_{y∈D} d(y, S))
//! ```
//!
//! d_H [m] is the Hausdorff distance between the surface S and the decimated one D at rest. Both are sampled, as by Cignoni,
//! Rocchini & Scopigno (1998, "Metro", Comput. Graph. Forum 17, 167): S at its nodes, D on a lattice in each triangle. A search
//! ends at the first triangle within the distance found so far (Taha & Hanbury 2015, IEEE TPAMI 37, 2153).
//!
//! Equations: docs/theory.md (C30).

use super::{SphereTree, Surface, at_weights, decimate, poisson_disk_sample};
use alloc::vec::Vec;
use glam::DVec3;

/// Lower limit of `max_contact_samples`: fewer do not support a face. A chain of levels ends at the first one with at most as
/// many samples.
pub const MIN_CONTACT_SAMPLES: usize = 8;

/// Upper limit of levels of contact samples.
pub(crate) const MAX_LEVELS: usize = 24;

/// Ratio of sample spacings of successive levels: for more samples than `MANY_SAMPLES`, and for fewer.
const SPACING_RATIOS: [f64; 2] = [2.0, 1.45];
const MANY_SAMPLES: usize = 4096;

/// Number of parts into which the lattice of d_H divides a side of a decimated triangle.
const LATTICE: u32 = 4;

/// Level of contact samples, with the decimated surface between them.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleLevel {
    /// Sample spacing ℓ [m].
    pub spacing: f64,
    /// Surface node of each sample.
    pub nodes: Vec<u32>,
    /// Triangles of the decimated surface, between surface nodes that are samples; none where the surface can't be decimated
    /// without folding, as a sheet of no thickness.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Levels of contact samples, finest first, down to the first with at most `max_samples`; none where the surface has no
    /// more nodes. A shorter chain is the beginning of a longer one.
    pub fn sample_levels(&self, max_samples: usize) -> Vec<SampleLevel> {
        let mut levels = Vec::new();
        let mut spacing = self.mean_edge();
        let mut count = self.positions.len();
        for _ in 0..MAX_LEVELS {
            if count <= max_samples {
                break;
            }
            spacing *= SPACING_RATIOS[usize::from(count <= MANY_SAMPLES)];
            let nodes = poisson_disk_sample(self, spacing);
            if nodes.len() < count {
                count = nodes.len();
                let triangles = decimate(self, &nodes).unwrap_or_default();
                levels.push(SampleLevel { spacing, nodes, triangles });
            }
        }
        levels
    }
}

impl SampleLevel {
    /// Hausdorff distance d_H [m] at rest between a surface and this level's decimated one; none without decimated surface.
    pub fn hausdorff_distance(&self, surface: &Surface) -> Option<f64> {
        if self.triangles.is_empty() {
            return None;
        }
        let positions = &surface.positions;
        let mut nodes: Vec<u32> = surface.triangles.iter().flatten().copied().collect();
        nodes.sort_unstable();
        nodes.dedup();
        let nodes = nodes.iter().map(|&node| positions[node as usize]);
        let lattice = self.triangles.iter().flat_map(|corners| {
            let corners = corners.map(|node| positions[node as usize]);
            lattice().map(move |weights| at_weights(corners, weights))
        });
        let from_surface = one_sided_distance(nodes, positions, &self.triangles, 0.0);
        Some(one_sided_distance(lattice, positions, &surface.triangles, from_surface))
    }
}

/// Barycentric weights of the lattice in a triangle, corners left out.
fn lattice() -> impl Iterator<Item = [f64; 3]> {
    let pairs = (0..=LATTICE).flat_map(|i| (0..=LATTICE - i).map(move |j| [i, j, LATTICE - i - j]));
    pairs.filter(|of| !of.contains(&LATTICE)).map(|of| of.map(|k| f64::from(k) / f64::from(LATTICE)))
}

/// Largest distance [m] of points from triangles between positions, or `least` if none is farther.
fn one_sided_distance(
    points: impl Iterator<Item = DVec3>,
    positions: &[DVec3],
    triangles: &[[u32; 3]],
    least: f64,
) -> f64 {
    let tree = SphereTree::new(positions, triangles);
    points.fold(least, |most, point| most.max(tree.distance((positions, triangles), point, most)))
}

#[cfg(test)]
mod tests {
    use super::super::test_surfaces::{ball, cube, sheet};
    use super::*;
    use alloc::vec;

    /// Depth [m] below the unit sphere of the deepest point of a triangle with corners on it: the foot of the centre, or the
    /// middle of the longest chord where the foot lies outside.
    fn sag([a, b, c]: [DVec3; 3]) -> f64 {
        let normal = (b - a).cross(c - a).normalize();
        let foot = normal * a.dot(normal);
        let inside = |p: DVec3, q: DVec3| (q - p).cross(foot - p).dot(normal) >= 0.0;
        let chord = [(a, b), (b, c), (c, a)].map(|(p, q)| (p - q).length()).into_iter().fold(0.0, f64::max);
        if inside(a, b) && inside(b, c) && inside(c, a) {
            1.0 - foot.length()
        } else {
            1.0 - (1.0 - 0.25 * chord * chord).sqrt()
        }
    }

    #[test]
    fn hausdorff_distance_of_a_balls_levels_is_the_largest_chord_sag() {
        let ball = ball(5);
        let corners = |t: &[u32; 3]| t.map(|node| ball.positions[node as usize]);
        // The surface is a polyhedron itself: its facets lie up to their own sag inside the ball.
        let facets = ball.triangles.iter().map(|t| sag(corners(t))).fold(0.0, f64::max);
        // A point of the lattice lies within 1/n of the circumradius from the deepest point.
        let on_lattice = |sag: f64| {
            let foot_squared = (1.0 - sag) * (1.0 - sag);
            1.0 - (foot_squared + (1.0 - foot_squared) * f64::from(LATTICE).powi(-2)).sqrt()
        };
        let levels = ball.sample_levels(MIN_CONTACT_SAMPLES);
        assert!(levels.len() > 5, "{}", levels.len());
        for level in &levels {
            let sag = level.triangles.iter().map(|t| sag(corners(t))).fold(0.0, f64::max);
            let distance = level.hausdorff_distance(&ball).expect("a ball has a decimated surface");
            assert!(distance <= sag, "{}: {distance} {sag}", level.nodes.len());
            assert!(distance >= on_lattice(sag) - facets, "{}: {distance} {sag}", level.nodes.len());
        }
    }

    #[test]
    fn levels_of_a_cube_lie_in_its_faces() {
        for cells in [6, 12, 24] {
            let cube = cube(cells);
            for level in cube.sample_levels(MIN_CONTACT_SAMPLES) {
                let distance = level.hausdorff_distance(&cube);
                assert!(distance.is_some_and(|d| d < 1e-12), "{cells}, {}: {distance:?}", level.nodes.len());
            }
        }
    }

    #[test]
    fn hausdorff_distance_is_that_of_all_pairs() {
        let ball = ball(3);
        for level in ball.sample_levels(MIN_CONTACT_SAMPLES) {
            let decimated = Surface { triangles: level.triangles.clone(), ..ball.clone() };
            let to =
                |surface: &Surface, p: DVec3| surface.nearest(p).map_or(f64::NAN, |(_, distance)| distance);
            let nodes = ball.positions.iter().map(|&p| to(&decimated, p));
            let inner = level.triangles.iter().flat_map(|t| {
                let corners = t.map(|node| ball.positions[node as usize]);
                lattice().map(move |weights| at_weights(corners, weights))
            });
            let most = nodes.chain(inner.map(|p| to(&ball, p))).fold(0.0, f64::max);
            // A sphere's bound is subject to round-off.
            let distance = level.hausdorff_distance(&ball).expect("a ball has a decimated surface");
            assert!((distance - most).abs() < 1e-15, "{} samples: {distance} {most}", level.nodes.len());
        }
    }

    #[test]
    fn a_chain_ends_at_the_first_level_with_few_enough_samples() {
        let ball = ball(4);
        let whole = ball.sample_levels(MIN_CONTACT_SAMPLES);
        assert!(whole.is_sorted_by(|a, b| a.nodes.len() > b.nodes.len() && a.spacing < b.spacing));
        assert!(whole.last().is_some_and(|level| level.nodes.len() <= MIN_CONTACT_SAMPLES));
        for max_samples in [9, 48, 300] {
            let levels = ball.sample_levels(max_samples);
            assert_eq!(levels[..], whole[..levels.len()], "{max_samples}");
            let (last, before) = levels.split_last().expect("a level");
            assert!(last.nodes.len() <= max_samples);
            assert!(before.iter().all(|level| level.nodes.len() > max_samples));
        }
        assert_eq!(ball.sample_levels(ball.positions.len()), []);
    }

    #[test]
    fn a_sheet_of_no_thickness_has_samples_without_surface() {
        let sheet = sheet();
        let levels = sheet.sample_levels(MIN_CONTACT_SAMPLES);
        assert!(!levels.is_empty());
        for level in levels {
            assert_eq!((level.triangles.clone(), level.hausdorff_distance(&sheet)), (vec![], None));
        }
    }
}
