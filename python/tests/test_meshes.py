"""Meshes that meshio and VTK wrote, as `palpate mesh` reads them.

The binary is what PALPATE names: PALPATE=target/release/palpate pytest python/tests
"""

import itertools
import json
import os
import pathlib
import subprocess

import meshio
import numpy as np
import pytest

# Cells along each side of the block, and its sides [m].
CELLS, SIDES = 3, np.array([0.1, 0.2, 0.15])
VOLUME = SIDES.prod()


def palpate():
    """The binary under test."""
    if not os.environ.get("PALPATE"):
        pytest.skip("PALPATE is not set: set it to the palpate binary, as in PALPATE=target/release/palpate")
    return str(pathlib.Path(os.environ["PALPATE"]).resolve())


def report(path, *options):
    """What `palpate mesh --json` says of a file."""
    done = subprocess.run([palpate(), "mesh", path, "--json", *options], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


def block(kind):
    """A block of cells of one kind: points, and nodes of each cell. Its nodes are in a random order."""
    side = CELLS + 1
    grid = np.array(list(itertools.product(range(side), repeat=3)))
    points = list(grid / CELLS * SIDES)
    at = lambda i, j, k: (i * side + j) * side + k
    cells = []
    for i, j, k in itertools.product(range(CELLS), repeat=3):
        corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
        h = [at(i + x, j + y, k + z) for x, y, z in corners]
        if kind == "hexahedron":
            cells.append(h)
        elif kind == "wedge":
            cells += [[h[0], h[1], h[2], h[4], h[5], h[6]], [h[0], h[2], h[3], h[4], h[6], h[7]]]
        elif kind == "pyramid":
            middle = len(points)
            points.append(np.mean([points[node] for node in h], axis=0))
            faces = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
            cells += [[*(h[corner] for corner in face), middle] for face in faces]
        else:
            # Six tetrahedra about a diagonal.
            ring = [1, 2, 3, 7, 4, 5, 1]
            cells += [[h[0], h[a], h[b], h[6]] for a, b in itertools.pairwise(ring) if 6 not in (a, b)]
    points, cells = np.array(points), np.array(cells)
    order = np.random.default_rng(7).permutation(len(points))
    shuffled = np.empty_like(points)
    shuffled[order] = points
    return shuffled, order[cells]


def quadratic(points, cells):
    """Tetrahedra with a node in the middle of each edge."""
    edges = [(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)]
    numbers, points = {}, list(points)
    rows = []
    for cell in cells:
        row = list(cell)
        for a, b in edges:
            key = tuple(sorted((cell[a], cell[b])))
            if key not in numbers:
                numbers[key] = len(points)
                points.append((points[cell[a]] + points[cell[b]]) / 2)
            row.append(numbers[key])
        rows.append(row)
    return np.array(points), np.array(rows)


# File name, format of meshio, and options of its writer.
VOLUMES = [
    ("a.vtu", "vtu", {"binary": False}),
    ("a.vtu", "vtu", {"binary": True, "compression": "zlib"}),
    ("a.vtu", "vtu", {"binary": True, "compression": None}),
    ("a.vtk", "vtk42", {"binary": False}),
    ("a.vtk", "vtk42", {"binary": True}),
    ("a.vtk", "vtk51", {"binary": False}),
    ("a.vtk", "vtk51", {"binary": True}),
    ("a.msh", "gmsh22", {"binary": False}),
    ("a.msh", "gmsh22", {"binary": True}),
    ("a.msh", "gmsh", {"binary": False}),
    ("a.msh", "gmsh", {"binary": True}),
    ("a.msh", "gmsh40", {"binary": False}),
    ("a.msh", "gmsh40", {"binary": True}),
    ("a.mesh", "medit", {}),
    ("a.meshb", "medit", {}),
    ("a.inp", "abaqus", {}),
]


def check(found, tetrahedra):
    """A report of the whole block."""
    body = found["volume"]
    assert body["tetrahedra"] == tetrahedra
    assert body["volume_m3"] == pytest.approx(VOLUME, rel=1e-6)
    assert len(body["pieces"]) == 1
    # Two triangles for each square of the surface: neighbours are cut alike.
    assert found["surface"]["triangles"] == 6 * 2 * CELLS**2
    assert found["surface"]["open_edges"] == 0
    assert np.allclose(found["bounding_box_m"], [[0, 0, 0], SIDES], atol=1e-6)
    assert found["problem"] is None


@pytest.mark.parametrize("name, file_format, options", VOLUMES)
@pytest.mark.parametrize("kind, per_cell", [("tetra", 6), ("hexahedron", 6), ("wedge", 6), ("pyramid", 12)])
def test_solids_that_meshio_wrote(tmp_path, name, file_format, options, kind, per_cell):
    if (file_format, kind) == ("abaqus", "pyramid"):
        pytest.skip("meshio writes no pyramids as Abaqus")
    points, cells = block(kind)
    write(tmp_path / name, meshio.Mesh(points, [(kind, cells)]), file_format, options)
    check(report(tmp_path / name), per_cell * CELLS**3)


def write(path, mesh, file_format, options):
    """Writes with meshio, which calls Gmsh 4.0 by an option."""
    if file_format == "gmsh40":
        meshio.gmsh.write(path, mesh, fmt_version="4.0", **options)
    else:
        meshio.write(path, mesh, file_format=file_format, **options)


@pytest.mark.parametrize("name, file_format, options", VOLUMES)
def test_quadratic_tetrahedra_that_meshio_wrote(tmp_path, name, file_format, options):
    if file_format == "medit":
        pytest.skip("meshio writes no quadratic elements as MEDIT")
    points, cells = quadratic(*block("tetra"))
    write(tmp_path / name, meshio.Mesh(points, [("tetra10", cells)]), file_format, options)
    found = report(tmp_path / name)
    check(found, 6 * CELLS**3)
    assert not [text for text in found["warnings"] if "edges" in text]
    # Nodes on edges off their middle: the volume by a rule of degree 3, of the mapping's determinant.
    corners = (CELLS + 1) ** 3
    points[corners:] += np.random.default_rng(3).uniform(-1, 1, points[corners:].shape) * 0.04 * SIDES / CELLS
    write(tmp_path / name, meshio.Mesh(points, [("tetra10", cells)]), file_format, options)
    body = report(tmp_path / name)["volume"]
    assert body["curved_tetrahedra"] == 6 * CELLS**3
    assert body["volume_m3"] == pytest.approx(quadratic_volume(points[cells]), rel=1e-6)
    assert body["volume_m3"] != pytest.approx(VOLUME, rel=1e-5)


def quadratic_volume(elements):
    """Volume of tetrahedra of ten nodes (Zienkiewicz & Taylor, rule of five points)."""
    rule = [(-0.8, [0.25] * 4)] + [(0.45, [0.5 if k == at else 1 / 6 for k in range(4)]) for at in range(4)]
    total = 0.0
    for weight, l in rule:
        # Derivatives of the shape functions by the four barycentric coordinates.
        slopes = np.zeros((10, 4))
        for a in range(4):
            slopes[a, a] = 4 * l[a] - 1
        for row, (a, b) in enumerate([(0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)], 4):
            slopes[row, a], slopes[row, b] = 4 * l[b], 4 * l[a]
        by = slopes[:, 1:] - slopes[:, :1]
        total += weight / 6 * np.linalg.det(np.einsum("eni,nk->eik", elements, by)).sum()
    return total


def test_tetgen_pairs_that_meshio_wrote(tmp_path):
    points, cells = block("tetra")
    mesh = meshio.Mesh(points, [("tetra", cells)])
    meshio.write(tmp_path / "a.node", mesh, file_format="tetgen")
    for name in ("a.node", "a.ele"):
        check(report(tmp_path / name), 6 * CELLS**3)


def test_regions_are_kept(tmp_path):
    points, cells = block("tetra")
    tags = np.arange(len(cells)) % 3 + 4
    for name, file_format, data in [
        ("a.vtu", "vtu", "region"),
        ("a.msh", "gmsh22", "gmsh:physical"),
        ("a.mesh", "medit", "medit:ref"),
    ]:
        extra = {"gmsh:geometrical": [tags]} if file_format == "gmsh22" else {}
        mesh = meshio.Mesh(points, [("tetra", cells)], cell_data={data: [tags], **extra})
        meshio.write(tmp_path / name, mesh, file_format=file_format)
        regions = report(tmp_path / name)["volume"]["regions"]
        assert [(r["number"], r["tetrahedra"]) for r in regions] == [(n, (tags == n).sum()) for n in (4, 5, 6)]


@pytest.mark.parametrize(
    "name, options",
    [("a.ply", {"binary": False}), ("a.ply", {"binary": True}), ("a.stl", {"binary": False}), ("a.stl", {"binary": True}), ("a.off", {}), ("a.obj", {})],
)
def test_surfaces_that_meshio_wrote(tmp_path, name, options):
    points, cells = block("hexahedron")
    meshio.write(tmp_path / "a.vtu", meshio.Mesh(points, [("hexahedron", cells)]))
    # The boundary of the block: quadrilaterals that one cell has.
    faces = [(0, 3, 2, 1), (0, 1, 5, 4), (0, 4, 7, 3), (1, 2, 6, 5), (2, 3, 7, 6), (4, 5, 6, 7)]
    quads = np.concatenate([cells[:, face] for face in faces])
    _, first, count = np.unique(np.sort(quads, axis=1), axis=0, return_index=True, return_counts=True)
    outer = quads[first[count == 1]]
    triangles = np.concatenate([outer[:, [0, 1, 2]], outer[:, [0, 2, 3]]])
    meshio.write(tmp_path / name, meshio.Mesh(points.astype("f4"), [("triangle", triangles)]), **options)
    found = report(tmp_path / name)
    surface = found["surface"]
    assert (surface["triangles"], surface["open_edges"], surface["crossing_edges"], surface["parts"]) == (6 * 2 * CELLS**2, 0, 0, 1)
    assert surface["volume_m3"] == pytest.approx(VOLUME, rel=1e-5)
    # It can be a body.
    assert found["problem"] is None
    assert found["volume"]["volume_m3"] == pytest.approx(VOLUME, rel=1e-2)


@pytest.mark.parametrize("mode", ["Ascii", "Binary", "Appended", "AppendedRaw"])
@pytest.mark.parametrize("header", [32, 64])
@pytest.mark.parametrize("order", ["LittleEndian", "BigEndian"])
@pytest.mark.parametrize("compressed", [False, True])
def test_grids_that_vtk_wrote(tmp_path, mode, header, order, compressed):
    vtk = pytest.importorskip("vtk")
    points, cells = block("hexahedron")
    meshio.write(tmp_path / "a.vtk", meshio.Mesh(points, [("hexahedron", cells)]), file_format="vtk42")
    reader = vtk.vtkUnstructuredGridReader()
    reader.SetFileName(str(tmp_path / "a.vtk"))
    writer = vtk.vtkXMLUnstructuredGridWriter()
    writer.SetInputConnection(reader.GetOutputPort())
    writer.SetFileName(str(tmp_path / "a.vtu"))
    getattr(writer, f"SetDataModeTo{mode.removesuffix('Raw')}")()
    writer.SetEncodeAppendedData(mode == "Appended")
    getattr(writer, f"SetHeaderTypeToUInt{header}")()
    getattr(writer, f"SetByteOrderTo{order}")()
    getattr(writer, "SetCompressorTypeToZLib" if compressed else "SetCompressorTypeToNone")()
    assert writer.Write() == 1
    check(report(tmp_path / "a.vtu"), 6 * CELLS**3)
