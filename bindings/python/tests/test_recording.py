"""Recordings as arrays, against the finite element model's identities, and against the file."""

import multiprocessing
import pickle

import numpy as np
import palpate
import pytest


def test_arrays_have_their_shapes_and_identities(cube):
    nodes, modes = len(cube.positions), 40
    assert cube.positions.shape == (nodes, 3) and cube.positions.dtype == np.float64
    assert cube.triangles.shape == (12 * 4 * 4, 3) and cube.triangles.dtype == np.uint32
    assert cube.mode_shapes.shape == (nodes, 3, modes) and cube.source_nodes.shape == (nodes,)
    assert cube.frequencies.shape == cube.damping_ratios.shape == (modes,)
    assert cube.mass == pytest.approx(1.0, rel=1e-12)  # 1000 kg/m³ · (0.1 m)³
    assert np.allclose(cube.inertia, np.eye(3) * 0.1**2 / 6, atol=1e-9)
    # Rayleigh's damping: ζ = α/2ω + βω/2.
    omega = 2 * np.pi * cube.frequencies
    assert cube.rayleigh == (2, 2e-4)
    assert np.allclose(cube.damping_ratios, 1 / omega + 1e-4 * omega, rtol=1e-12)
    # The surface is closed, and encloses the cube: the divergence theorem.
    a, b, c = (cube.positions[cube.triangles[:, corner]] for corner in range(3))
    assert np.isclose(np.einsum("ij,ij->", a, np.cross(b, c)) / 6, 1e-3, rtol=1e-12)
    assert not cube.is_fixed and cube.metadata["mesh"]["order"] == 1
    assert 0 < cube.certificate["force_error_max"] < 0.2


def test_arrays_cannot_be_written_to(cube):
    for array in [cube.positions, cube.triangles, cube.mode_shapes]:
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    assert cube.mode_shapes is cube.mode_shapes


def test_the_static_compliance_is_what_a_long_press_meets(cube):
    S = cube.residual_compliance()
    size = 3 * len(cube.positions)
    assert S.shape == (size, size) and np.allclose(S, S.T, rtol=1e-6)
    some = cube.residual_compliance([5, 2])
    assert np.array_equal(some[:3, 3:], S[15:18, 6:9])
    # Of a node and a direction: a force that grows slowly moves it by (modes + S) · force beyond the rigid motion.
    node = int(np.argmax(cube.positions @ [1.0, 0.3, 0.2]))
    row = cube.mode_shapes[node]
    omega = 2 * np.pi * cube.frequencies
    compliance = (row / omega**2) @ row.T + S[3 * node : 3 * node + 3, 3 * node : 3 * node + 3]
    load = palpate.Device("load", mode="force", attach={"object": "cube", "point": cube.positions[node]})
    probe = palpate.Probe("corner", "cube", cube.positions[node])
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[load], probes=[probe])
    # Through the centre of mass, so that the cube does not turn.
    direction = cube.positions[node] / np.linalg.norm(cube.positions[node])
    ramp = np.minimum(np.arange(1, 2001) / 1000, 1)[:, None, None]
    displacement = palpate.Simulation(scene).run(1e-2 * ramp * direction)["probe_displacements"][-1, 0]
    # What swings still: α/2 = 1 1/s at least for a second after a slow ramp.
    assert np.allclose(displacement, 1e-2 * compliance @ direction, rtol=5e-3)


def test_files_bytes_and_pickles_hold_the_same(cube, folder, palpate_run):
    again = palpate.Recording.open(folder / "cube.palp")
    assert again.to_bytes() == cube.to_bytes() == (folder / "cube.palp").read_bytes()
    assert palpate.Recording.from_bytes(cube.to_bytes()).mass == cube.mass
    assert np.array_equal(pickle.loads(pickle.dumps(cube)).mode_shapes, cube.mode_shapes)
    # The command line writes the same bytes of the same options.
    options = "--young 2e4 --poisson 0.45 --density 1000 --rayleigh 2,2e-4 --modes 40 --order 1 --precision full"
    palpate_run("record", "box:0.1x0.1x0.1/4x4x4", *options.split(), "-o", folder / "other.palp")
    assert (folder / "other.palp").read_bytes() == cube.to_bytes()


def test_a_mesh_may_be_arrays(cube):
    # The box of the command line: its nodes by number, five tetrahedra per cell, from a recording of all of its nodes.
    nodes = np.array([[x, y, z] for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.1)], dtype=float)
    tetrahedra = [[0, 3, 5, 6], [1, 0, 3, 5], [2, 0, 6, 3], [4, 0, 5, 6], [7, 3, 6, 5]]
    options = {"young": 2e4, "poisson": 0.45, "density": 1000, "modes": 20, "order": 1}
    ours = palpate.record((nodes, tetrahedra), **options)
    box = palpate.record("box:0.1x0.1x0.1/1x1x1", **options)
    assert np.allclose(ours.frequencies, box.frequencies, rtol=1e-9) and ours.mass == pytest.approx(box.mass)
    scaled = palpate.record((nodes * 1000, np.asarray(tetrahedra, dtype=np.uint8)), scale=0.001, **options)
    assert np.allclose(scaled.frequencies, box.frequencies, rtol=1e-9)


def test_bodies_are_fixed_and_named_as_on_the_command_line():
    bar = palpate.record("box:0.2x0.05x0.05/4x1x1", material="rubber", modes=10, fix="x<-0.099", residual="none", force_error=None)
    assert bar.is_fixed and bar.metadata["mesh"]["fixed_nodes"] > 0
    sprung = palpate.record("box:0.2x0.05x0.05/4x1x1", material="rubber", modes=10, spring=["1e6: z<-0.024"], residual=0.02)
    assert sprung.is_fixed and sprung.frequencies[0] < bar.frequencies[-1]


# Two tetrahedra of 1/6000 m³ that do not touch, and one of 1/750 m³ on the same corner as the second; skin and bone by number.
MESH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
12
1 0 0 0
2 0.1 0 0
3 0 0.1 0
4 0 0 0.1
5 1 0 0
6 1.1 0 0
7 1 0.1 0
8 1 0 0.1
9 2 0 0
10 2.2 0 0
11 2 0.2 0
12 2 0 0.2
$EndNodes
$Elements
3
1 4 2 1 1 1 2 3 4
2 4 2 1 1 5 6 7 8
3 4 2 2 2 9 10 11 12
$EndElements
"""


def test_pieces_and_materials_of_regions_are_chosen_as_on_the_command_line(tmp_path, palpate_run):
    mesh = tmp_path / "three.msh"
    mesh.write_text(MESH)
    materials = [
        {"region": "1", "name": "liver"},
        {"region": "2", "young": 1e6, "poisson": 0.3, "density": 2000.0},
    ]
    options = {"modes": 3, "order": 1}
    with pytest.raises(palpate.RecordingError, match="three.msh: the mesh is disconnected: 3 pieces"):
        palpate.record(mesh, materials=materials, **options)
    first = palpate.record(mesh, materials=materials[:1], piece=2, **options)
    largest = palpate.record(mesh, materials=materials[1:], piece="largest", **options)
    assert first.mass == pytest.approx(1060 * 0.1**3 / 6) and largest.mass == pytest.approx(2000 * 0.2**3 / 6)
    file = tmp_path / "materials.toml"
    file.write_text('[[material]]\nregion = "2"\nyoung = 1e6\npoisson = 0.3\ndensity = 2000.0\n')
    assert palpate.record(mesh, materials=file, piece=1, **options).to_bytes() == largest.to_bytes()
    other = tmp_path / "other.palp"
    palpate_run("record", mesh, "--material", "liver", "--piece", "2", "--modes", "3", "--order", "1", "-o", other)
    assert palpate.record(mesh, material="liver", piece=2, **options).to_bytes() == other.read_bytes()


def test_nodes_on_one_point_are_merged_when_asked():
    # Two tetrahedra with a face in common, whose nodes are there twice.
    corners = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1], [0.1, 0.1, 0.1]])
    mesh = (corners, [[0, 1, 2, 3], [4, 5, 6, 7]])
    options = {"young": 1e4, "poisson": 0.3, "density": 1000, "modes": 3, "order": 1}
    for merge in ["auto", "always"]:
        assert len(palpate.record(mesh, merge_nodes=merge, **options).positions) == 5
    with pytest.raises(palpate.RecordingError, match="2 pieces"):
        palpate.record(mesh, merge_nodes="never", **options)


def test_progress_is_told_by_stage():
    stages = {}
    palpate.record(
        "box:0.1x0.1x0.1/3x3x3", material="paper", modes=10, progress=lambda stage, share: stages.setdefault(stage, []).append(share)
    )
    assert len(stages) >= 2
    for shares in stages.values():
        told = [share for share in shares if share is not None]
        assert told == sorted(told) and len(told) <= 101 and all(0 <= share <= 1 for share in told)


def _record_after_fork(queue):
    queue.put(palpate.record("box:0.1x0.1x0.1/3x3x3", material="paper", modes=5).to_bytes())


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_forked_process_records_too():
    here = palpate.record("box:0.1x0.1x0.1/3x3x3", material="paper", modes=5).to_bytes()
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_record_after_fork, args=(queue,), daemon=True)
    child.start()
    assert queue.get(timeout=120) == here
    child.join(timeout=60)


def test_a_body_in_millimetres_is_asked_about_before_the_work():
    warnings_at_first_stage = []

    with pytest.warns(palpate.PalpateWarning) as caught:
        palpate.record(
            "box:100x100x100/2x2x2",
            material="rubber",
            modes=5,
            order=1,
            progress=lambda stage, share: warnings_at_first_stage.append(len(caught)),
        )
    question = "the body is 100 m large; if the file is in millimetres, use scale=0.001"
    assert str(caught[0].message) == question and caught[0].filename == __file__
    assert warnings_at_first_stage[0] == 1
    assert [str(warning.message) for warning in caught].count(question) == 1
