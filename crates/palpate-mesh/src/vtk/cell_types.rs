//! Cell types of VTK (`vtkCellType.h`).

use crate::elements::{Elements, Shape};

/// Numbers of the types whose elements have corners first, as shape and, where it is fixed, number of points.
#[rustfmt::skip]
fn cell_type(number: i64) -> Option<(Shape, Option<usize>)> {
    use Shape::{Hexahedron, Line, OtherFlat, Point, Pyramid, Quadrilateral, Tetrahedron, Triangle, Wedge};
    Some(match number {
        1 => (Point, Some(1)), 3 => (Line, Some(2)), 5 => (Triangle, Some(3)), 21 => (Line, Some(3)),
        8 | 9 => (Quadrilateral, Some(4)), 22 => (Triangle, Some(6)), 23 => (Quadrilateral, Some(8)),
        28 => (Quadrilateral, Some(9)), 34 => (Triangle, Some(7)), 35 => (Line, Some(4)),
        0 | 2 | 4 | 6 | 7 | 30 | 36 | 60..=63 | 68..=70 | 75..=77 => (OtherFlat, None),
        10 => (Tetrahedron, Some(4)), 24 => (Tetrahedron, Some(10)), 64 | 71 | 78 => (Tetrahedron, None),
        11 | 12 => (Hexahedron, Some(8)), 25 => (Hexahedron, Some(20)), 29 => (Hexahedron, Some(27)),
        33 => (Hexahedron, Some(24)), 67 | 72 | 79 => (Hexahedron, None),
        13 => (Wedge, Some(6)), 26 => (Wedge, Some(15)), 31 => (Wedge, Some(12)), 32 => (Wedge, Some(18)),
        65 | 73 | 80 => (Wedge, None),
        14 => (Pyramid, Some(5)), 27 => (Pyramid, Some(13)), 37 => (Pyramid, Some(19)),
        66 | 74 | 81 => (Pyramid, None),
        _ => return None,
    })
}

/// Solids that are not split, by their singular.
fn unsupported(number: i64) -> Option<&'static str> {
    Some(match number {
        15 => "a pentagonal prism",
        16 => "a hexagonal prism",
        41 => "a convex point set",
        42 => "a polyhedron",
        _ => return None,
    })
}

/// Adds a cell of this type; the reason if that is impossible.
pub(super) fn add_cell(
    elements: &mut Elements,
    number: i64,
    cell: usize,
    points: &[u32],
) -> Result<(), String> {
    let Some((shape, size)) = cell_type(number) else {
        return Err(match unsupported(number) {
            Some(what) => format!(
                "cell {cell} is {what} (type {number}): expected tetrahedra, hexahedra, wedges or pyramids; \
                 ParaView's filter Tetrahedralize makes them"
            ),
            None => format!("unknown cell type {number}"),
        });
    };
    let too_few = points.len() < shape.corners();
    if size.is_some_and(|size| size != points.len()) || too_few {
        return Err(format!("cell {cell} has type {number} and {} points", points.len()));
    }
    if shape.dimension() < 3 {
        elements.count(shape);
        return Ok(());
    }
    // A voxel counts its corners row by row.
    match (number, points) {
        (11, &[a, b, d, c, e, f, h, g]) => elements.add(shape, &[a, b, c, d, e, f, g, h], cell as u32),
        _ => elements.add(shape, points, cell as u32),
    };
    Ok(())
}

/// Warning about cells that are no solids, if there are any.
pub(super) fn ignored_cells(elements: &Elements) -> Option<String> {
    let count = elements.flat();
    (count > 0).then(|| format!("cells of dimension 0 to 2 are ignored: {count}"))
}
