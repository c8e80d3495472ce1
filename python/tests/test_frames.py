"""Frames that `palpate export --vtu` wrote, as a notebook reads them: with meshio, and with VTK where it is.

The binary is what PALPATE names: PALPATE=target/release/palpate pytest python/tests
"""

import xml.etree.ElementTree

import numpy as np
import pytest
from test_store import BODY, palpate, run

meshio = pytest.importorskip("meshio")

MASS = 0.11  # kg
GRAVITY = 9.81  # m/s²
SCENE = """step = 0.002
gravity = [0.0, 0.0, -9.81]
[[object]]
name = "cube"
recording = "cube.palp"
position = [0.0, 0.0, 0.0501]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
[[obstacle]]
name = "ball"
sphere = { radius = 0.02 }
position = [0.2, 0.0, 0.02]
"""


@pytest.fixture(scope="module")
def frames(tmp_path_factory):
    """A cube that comes to rest on a floor: the folder, and (time, part, file) of each entry of its index."""
    place = tmp_path_factory.mktemp("frames")
    (place / "scene.toml").write_text(SCENE)
    run(palpate(), "record", *BODY, "-o", place / "cube.palp")
    log = place / "run.mcap"
    run(palpate(), "run", place / "scene.toml", "--realtime", "--duration", "3", "--log", log)
    run(palpate(), "export", log, "--vtu", place / "frames", "--fps", "10")
    index = xml.etree.ElementTree.parse(place / "frames" / "scene.pvd")
    entries = [(float(e.get("timestep")), e.get("part"), e.get("file")) for e in index.iter("DataSet")]
    return place / "frames", entries


def test_every_part_is_there_at_every_time(frames):
    _, entries = frames
    times = sorted({time for time, _, _ in entries})
    assert np.allclose(times, np.arange(31) / 10, atol=1e-9)
    for time in times:
        names = [file.rsplit("_", 1)[0] for at, _, file in entries if at == time]
        assert names == ["cube", "floor", "ball", "scene.contacts"]


def test_a_cube_at_rest_is_carried_by_the_forces_that_the_frames_show(frames):
    folder, _ = frames
    # What swings still is a thousandth of the weight.
    forces = [meshio.read(folder / f"scene.contacts_{at:05}.vtu").point_data["force"] for at in range(26, 31)]
    total = np.mean([force.sum(axis=0) for force in forces], axis=0)
    assert np.allclose(total, [0, 0, MASS * GRAVITY], atol=1e-2 * MASS * GRAVITY)
    contacts = meshio.read(folder / "scene.contacts_00030.vtu")
    cube = meshio.read(folder / "cube_00030.vtu")
    away = np.linalg.norm(contacts.points[:, None] - cube.points[None], axis=2).min(axis=1)
    assert away.max() < 1e-3, "contacts are on the cube's surface"
    assert np.abs(contacts.points[:, 2]).max() < 1e-3, "and on the floor"


def test_obstacles_are_closed_surfaces_where_the_scene_has_them(frames):
    folder, _ = frames
    ball = meshio.read(folder / "ball_00000.vtu")
    radius = np.linalg.norm(ball.points - [0.2, 0, 0.02], axis=1)
    assert np.allclose(radius, 0.02, atol=1e-7)
    a, b, c = (ball.points[ball.cells_dict["triangle"][:, k]] - [0.2, 0, 0.02] for k in range(3))
    volume = np.einsum("ij,ij->", a, np.cross(b, c)) / 6
    assert 0.97 < volume / (4 / 3 * np.pi * 0.02**3) < 1, "its triangles face outwards"
    floor = meshio.read(folder / "floor_00000.vtu")
    assert np.all(floor.points[:, 2] == 0)


def test_vtk_reads_every_file_without_complaint(frames):
    vtk = pytest.importorskip("vtk")
    folder, entries = frames
    for _, _, file in entries:
        reader = vtk.vtkXMLUnstructuredGridReader()
        reader.SetFileName(str(folder / file))
        reader.Update()
        assert reader.GetErrorCode() == 0, file
        assert file.startswith("scene.contacts") or reader.GetOutput().GetNumberOfCells() > 0, file
