//! Body-centred cubic lattice, and its tetrahedra.
//!
//! Points have doubled integer coordinates: corners of the cubes even ones, their centres odd ones. A tetrahedron has two neighbouring
//! centres and an edge of the face between them: two long edges, as long as a cell, and four short ones of √3/2 cells. Its dihedral angles
//! are 60° and 90°.

use glam::DVec3;

/// Body-centred cubic lattice over a box.
pub(super) struct Lattice {
    /// Position of the first corner [m].
    pub origin: DVec3,
    /// Side of a cube [m].
    pub cell: f64,
    /// Cubes along each axis.
    pub cells: [i64; 3],
}

/// Doubled coordinates of a point.
type Place = [i64; 3];

impl Lattice {
    /// Number of points.
    pub fn len(&self) -> usize {
        let [nx, ny, nz] = self.cells;
        ((nx + 1) * (ny + 1) * (nz + 1) + nx * ny * nz) as usize
    }

    fn corners(&self) -> i64 {
        self.cells.iter().map(|n| n + 1).product()
    }

    fn place(&self, point: u32) -> Place {
        let point = i64::from(point);
        let (odd, index) = if point < self.corners() { (0, point) } else { (1, point - self.corners()) };
        let [_, ny, nz] = self.cells.map(|n| n + 1 - odd);
        [index / (ny * nz), index / nz % ny, index % nz].map(|x| 2 * x + odd)
    }

    fn point(&self, place: Place) -> Option<u32> {
        if (0..3).any(|axis| place[axis] < 0 || place[axis] > 2 * self.cells[axis]) {
            return None;
        }
        let odd = place[0] & 1;
        let [_, ny, nz] = self.cells.map(|n| n + 1 - odd);
        let [x, y, z] = place.map(|x| x / 2);
        Some(((x * ny + y) * nz + z + odd * self.corners()) as u32)
    }

    /// Position of a point [m].
    pub fn position(&self, point: u32) -> DVec3 {
        let [x, y, z] = self.place(point);
        self.origin + DVec3::new(x as f64, y as f64, z as f64) * (0.5 * self.cell)
    }

    /// Neighbours of a point along long and short edges, and whether the edge is long.
    pub fn neighbours(&self, point: u32) -> impl Iterator<Item = (u32, bool)> {
        const LONG: [Place; 6] = [[2, 0, 0], [-2, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 2], [0, 0, -2]];
        let place = self.place(point);
        let shifted = move |by: Place| [0, 1, 2].map(|axis| place[axis] + by[axis]);
        let long = LONG.into_iter().filter_map(move |by| Some((self.point(shifted(by))?, true)));
        let short = (0..8).filter_map(move |corner: i64| {
            let by = [0, 1, 2].map(|axis| (corner >> axis & 1) * 2 - 1);
            Some((self.point(shifted(by))?, false))
        });
        long.chain(short)
    }

    /// Calls a function with the four points of each tetrahedron.
    pub fn for_each_tet(&self, mut call: impl FnMut([u32; 4])) {
        let [nx, ny, nz] = self.cells;
        for (x, y, z) in (0..nx).flat_map(|x| (0..ny).flat_map(move |y| (0..nz).map(move |z| (x, y, z)))) {
            let centre = [2 * x + 1, 2 * y + 1, 2 * z + 1];
            for axis in 0..3 {
                let shifted = |by: [i64; 3]| {
                    let mut place = centre;
                    (0..3).for_each(|at| place[(axis + at) % 3] += by[at]);
                    self.point(place)
                };
                let (Some(here), Some(there)) = (shifted([0; 3]), shifted([2, 0, 0])) else { continue };
                const AROUND: [[i64; 3]; 5] = [[1, -1, -1], [1, 1, -1], [1, 1, 1], [1, -1, 1], [1, -1, -1]];
                for pair in AROUND.windows(2) {
                    if let (Some(a), Some(b)) = (shifted(pair[0]), shifted(pair[1])) {
                        call([here, there, a, b]);
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_have_numbers_and_tetrahedra_two_long_edges() {
        let lattice = Lattice { origin: DVec3::ZERO, cell: 1.0, cells: [2, 3, 4] };
        for point in 0..lattice.len() as u32 {
            assert_eq!(lattice.point(lattice.place(point)), Some(point));
            for (other, is_long) in lattice.neighbours(point) {
                let length = (lattice.position(other) - lattice.position(point)).length();
                assert_eq!(length, if is_long { 1.0 } else { 0.75_f64.sqrt() });
                assert!(lattice.neighbours(other).any(|(back, _)| back == point));
            }
        }
        let mut volume = 0.0;
        lattice.for_each_tet(|tet| {
            let [a, b, c, d] = tet.map(|point| lattice.position(point));
            let own = (b - a).cross(c - a).dot(d - a) / 6.0;
            assert_eq!(own, 1.0 / 12.0);
            volume += own;
        });
        // Four tetrahedra about each face between two cubes.
        assert!((volume - (4 * (3 * 4 + 2 * 2 * 4 + 2 * 3 * 3)) as f64 / 12.0).abs() < 1e-12);
    }
}
