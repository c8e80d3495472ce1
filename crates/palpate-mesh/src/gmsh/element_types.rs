//! Element type numbers of Gmsh (Gmsh reference manual, "MSH file format", and the
//! `MSH_*` constants of `gmsh/src/common/GmshDefines.h`).

use crate::elements::Shape;

/// The shape and the number of nodes of an element type, corner nodes first; `None` for numbers
/// that Gmsh does not use and for elements without a fixed number of nodes.
#[rustfmt::skip]
pub(super) fn element_type(number: i64) -> Option<(Shape, usize)> {
    use Shape::*;
    Some(match number {
        15 => (Point, 1),

        1 => (Line, 2), 8 => (Line, 3), 26 => (Line, 4), 27 => (Line, 5), 28 => (Line, 6),
        62 => (Line, 7), 63 => (Line, 8), 64 => (Line, 9), 65 => (Line, 10), 66 => (Line, 11),

        2 => (Triangle, 3), 9 => (Triangle, 6), 20 => (Triangle, 9), 21 => (Triangle, 10),
        22 => (Triangle, 12), 23 | 24 => (Triangle, 15), 25 => (Triangle, 21),
        42 => (Triangle, 28), 43 => (Triangle, 36), 44 => (Triangle, 45), 45 => (Triangle, 55),
        46 => (Triangle, 66), 52 => (Triangle, 18), 53 => (Triangle, 21), 54 => (Triangle, 24),
        55 => (Triangle, 27), 56 => (Triangle, 30),

        3 => (Quadrilateral, 4), 10 => (Quadrilateral, 9), 16 => (Quadrilateral, 8),
        36 => (Quadrilateral, 16), 37 => (Quadrilateral, 25), 38 => (Quadrilateral, 36),
        39 => (Quadrilateral, 12), 40 => (Quadrilateral, 16), 41 => (Quadrilateral, 20),
        47 => (Quadrilateral, 49), 48 => (Quadrilateral, 64), 49 => (Quadrilateral, 81),
        50 => (Quadrilateral, 100), 51 => (Quadrilateral, 121), 57 => (Quadrilateral, 24),
        58 => (Quadrilateral, 28), 59 => (Quadrilateral, 32), 60 => (Quadrilateral, 36),
        61 => (Quadrilateral, 40),

        4 => (Tetrahedron, 4), 11 => (Tetrahedron, 10), 29 => (Tetrahedron, 20),
        30 => (Tetrahedron, 35), 31 => (Tetrahedron, 56), 32 => (Tetrahedron, 22),
        33 => (Tetrahedron, 28), 71 => (Tetrahedron, 84), 72 => (Tetrahedron, 120),
        73 => (Tetrahedron, 165), 74 => (Tetrahedron, 220), 75 => (Tetrahedron, 286),
        79 => (Tetrahedron, 34), 80 => (Tetrahedron, 40), 81 => (Tetrahedron, 46),
        82 => (Tetrahedron, 52), 83 => (Tetrahedron, 58), 137 => (Tetrahedron, 16),

        5 => (Hexahedron, 8), 12 => (Hexahedron, 27), 17 => (Hexahedron, 20),
        92 => (Hexahedron, 64), 93 => (Hexahedron, 125), 94 => (Hexahedron, 216),
        95 => (Hexahedron, 343), 96 => (Hexahedron, 512), 97 => (Hexahedron, 729),
        98 => (Hexahedron, 1000), 99 => (Hexahedron, 32), 100 => (Hexahedron, 44),
        101 => (Hexahedron, 56), 102 => (Hexahedron, 68), 103 => (Hexahedron, 80),
        104 => (Hexahedron, 92), 105 => (Hexahedron, 104),

        6 => (Wedge, 6), 13 => (Wedge, 18), 18 => (Wedge, 15), 90 => (Wedge, 40),
        91 => (Wedge, 75), 106 => (Wedge, 126), 107 => (Wedge, 196), 108 => (Wedge, 288),
        109 => (Wedge, 405), 110 => (Wedge, 550), 111 => (Wedge, 24), 112 => (Wedge, 33),
        113 => (Wedge, 42), 114 => (Wedge, 51), 115 => (Wedge, 60), 116 => (Wedge, 69),
        117 => (Wedge, 78),

        7 => (Pyramid, 5), 14 => (Pyramid, 14), 19 => (Pyramid, 13), 118 => (Pyramid, 30),
        119 => (Pyramid, 55), 120 => (Pyramid, 91), 121 => (Pyramid, 140), 122 => (Pyramid, 204),
        123 => (Pyramid, 285), 124 => (Pyramid, 385), 125 => (Pyramid, 21), 126 => (Pyramid, 29),
        127 => (Pyramid, 37), 128 => (Pyramid, 45), 129 => (Pyramid, 53), 130 => (Pyramid, 61),
        131 => (Pyramid, 69),

        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn complete_elements_have_as_many_nodes_as_their_polynomials_have_terms() {
        let line = |p: usize| p + 1;
        let triangle = |p: usize| (p + 1) * (p + 2) / 2;
        /// Shape, nodes by order, and the types of orders 1 to 9.
        type Family = (Shape, fn(usize) -> usize, [i64; 9]);
        let families: [Family; 6] = [
            (Shape::Line, line, [1, 8, 26, 27, 28, 62, 63, 64, 65]),
            (Shape::Triangle, triangle, [2, 9, 21, 23, 25, 42, 43, 44, 45]),
            (Shape::Quadrilateral, |p| (p + 1).pow(2), [3, 10, 36, 37, 38, 47, 48, 49, 50]),
            (Shape::Tetrahedron, |p| (p + 1) * (p + 2) * (p + 3) / 6, [4, 11, 29, 30, 31, 71, 72, 73, 74]),
            (Shape::Hexahedron, |p| (p + 1).pow(3), [5, 12, 92, 93, 94, 95, 96, 97, 98]),
            (
                Shape::Pyramid,
                |p| (p + 1) * (p + 2) * (2 * p + 3) / 6,
                [7, 14, 118, 119, 120, 121, 122, 123, 124],
            ),
        ];
        for (shape, nodes, numbers) in families {
            for (order, number) in (1..).zip(numbers) {
                assert_eq!(element_type(number), Some((shape, nodes(order))));
            }
        }
        for (order, number) in (1..).zip([6, 13, 90, 91, 106, 107, 108, 109, 110]) {
            let nodes = line(order) * triangle(order);
            assert_eq!(element_type(number), Some((Shape::Wedge, nodes)));
        }
    }
}
