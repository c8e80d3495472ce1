"""Exceptions: every mistake has its class, and a text that says what to do; nothing panics."""

import errno
import subprocess
import sys

import numpy as np
import palpate
import pytest

BODY = {"young": 2e4, "poisson": 0.45, "density": 1000}
BOX = "box:0.1x0.1x0.1/1x1x1"


def refusal(kind, call):
    """Text of the exception of exactly this class that a call raises."""
    with pytest.raises(palpate.PalpateError) as caught:
        call()
    assert type(caught.value) is kind
    return str(caught.value)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ([0, 0, 0], "positions has the shape (3,), expected (1, 3)"),
        (np.zeros((2, 3)), "positions has the shape (2, 3), expected (1, 3)"),
        (np.zeros((1, 1, 3)), "positions has the shape (1, 1, 3), expected (1, 3)"),
        ([[0, 0, np.nan]], "row 0 of positions is [0.0, 0.0, NaN], expected finite numbers"),
        ([[np.inf, 0, 0]], "row 0 of positions is [inf, 0.0, 0.0], expected finite numbers"),
        (np.zeros((1, 3), complex), "positions holds complex128, expected an array of float64 of shape (1, 3)"),
        ("here", "positions holds <U4, expected an array of float64 of shape (1, 3)"),
        ([[object(), 0, 0]], "positions holds object, expected an array of float64 of shape (1, 3)"),
        (np.ones((1, 3), bool), "positions holds bool, expected an array of float64 of shape (1, 3)"),
        (
            None,
            'device "hand" has no path in the scene: give positions, an array of shape (1, 3) with a row per device',
        ),
    ],
)
def test_positions_that_cannot_be_used_move_nothing(held, given, text):
    simulation = palpate.Simulation(held)
    assert refusal(palpate.InputError, lambda: simulation.step(given)) == text
    assert simulation.time == 0 and not simulation.forces.any()


def test_a_series_that_stops_early_is_in_the_exception(held):
    simulation = palpate.Simulation(held)
    hands = np.repeat(simulation.held_points()[None], 20, axis=0)
    hands[12] += 1e4  # m, within one step
    with pytest.raises(palpate.StepError, match="at 0.013000 s the held points can't be met") as caught:
        simulation.run(hands)
    series = caught.value.series
    assert np.array_equal(series["time"], np.arange(1, 13) * 1e-3) and caught.value.rows is None


# A process that may have 0.4 GB more than it has, and a run whose series take 0.8 GB.
LIMITED = """
import resource, sys
import palpate
cube = palpate.Recording.open(sys.argv[1])
simulation = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)]))
with open("/proc/self/statm") as file:
    now = int(file.read().split()[0]) * resource.getpagesize()
resource.setrlimit(resource.RLIMIT_AS, (now + 400_000_000, now + 400_000_000))
try:
    simulation.run(steps=int(sys.argv[2]))
except MemoryError as error:
    print(type(error).__name__, error)
print(len(simulation.run(steps=3)["time"]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="limits of the address space are Linux'")
def test_a_series_without_room_is_a_memory_error(folder):
    # 208 bytes a step.
    steps = 4_000_000
    command = [sys.executable, "-c", LIMITED, folder / "cube.palp", steps]
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    first, last = done.stdout.splitlines()
    assert first.startswith(f"MemoryError the series of {steps} steps: memory allocation failed")
    assert last == "3"


def test_arrays_at_odd_addresses_are_copied(held):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()
    odd = np.zeros(hand.nbytes + 1, np.uint8)[1:].view(np.float64).reshape(hand.shape)
    odd[:] = hand + 1e-4
    assert not odd.flags.aligned and odd.flags.c_contiguous
    twin = simulation.copy()
    assert np.array_equal(simulation.step(odd), twin.step(hand + 1e-4)) and simulation.forces.any()


def test_rows_of_other_lengths_are_no_array(held):
    text = refusal(palpate.InputError, lambda: palpate.Simulation(held).step([[0, 0], [0]]))
    assert text.startswith("positions is no array (setting an array element with a sequence")


def test_series_of_other_lengths_are_refused(cube):
    ball = palpate.Obstacle(name="ball", sphere={"radius": 0.01}, position=[0, 0, 1])
    scene = palpate.Scene([palpate.Object("cube", cube)], obstacles=[ball], devices=[palpate.Device("finger")])
    simulation = palpate.Simulation(scene)
    hand = np.ones((5, 1, 3))
    pose = np.tile([0.0, 0, 1, 1, 0, 0, 0], (4, 1, 1))
    for arguments, text in [
        ({"obstacles": pose}, "obstacles has the shape (4, 1, 7), expected (5, 1, 7)"),
        ({"steps": 5}, "the motions have a row per step: leave steps and duration out"),
        ({"obstacles": np.zeros((5, 1, 7))}, "row 0 of obstacles: the quaternion (qw, qx, qy, qz) has the length 0, expected 1"),
    ]:
        assert refusal(palpate.InputError, lambda arguments=arguments: simulation.run(hand, **arguments)) == text
    assert simulation.time == 0
    fall = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)]))
    assert refusal(palpate.InputError, fall.run) == "the scene has no path that ends: give positions, steps or duration"
    assert refusal(palpate.InputError, lambda: fall.run(steps=1, duration=1)) == "give steps or duration, not both"
    for bad in [-1, float("nan"), 1e9]:
        assert "expected 0 to 100000000" in refusal(palpate.InputError, lambda bad=bad: fall.run(duration=bad))
    assert len(fall.run(steps=0)["time"]) == 0


def test_series_that_do_not_fit_into_memory_are_refused(cube):
    # 5.7 kB a step.
    many = [palpate.Object(f"cube{at}", cube, position=[at, 0, 0]) for at in range(50)]
    simulation = palpate.Simulation(palpate.Scene(many))
    text = refusal(palpate.InputError, lambda: simulation.run(steps=100_000_000))
    assert text.startswith("the series of 100000000 steps: ") and text.endswith("; run fewer at a time")


def test_a_hand_that_jumps_away_is_a_step_error(held):
    simulation = palpate.Simulation(held)
    text = refusal(palpate.StepError, lambda: simulation.step(simulation.held_points() + 1e3))
    assert text.startswith("at 0.001000 s the held points can't be met: ") and "check that paths are in metres" in text


def test_scene_errors_have_file_line_and_key(folder):
    scene = folder / "scene.toml"
    scene.write_text('[[object]]\nname = "cube"\nrecording = "cube.palp"\nfriction = -1\n')
    with pytest.raises(palpate.SceneError) as caught:
        palpate.Scene.load(scene)
    error = caught.value
    assert (error.kind, error.file, error.line, error.key) == ("out_of_range", str(scene), 4, "friction")
    assert str(error) == f"{scene}: line 4: friction is -1, expected at least 0 and below 1e6"
    scene.write_text('[[object]]\nname = "cube"\nrecording = "none.palp"\n')
    with pytest.raises(palpate.SceneError, match="cannot read the recording .*none.palp") as caught:
        palpate.Scene.load(scene)
    assert (caught.value.kind, caught.value.line) == ("recording", 3)
    scene.write_bytes(b"\xff")
    assert refusal(palpate.SceneError, lambda: palpate.Scene.load(scene)).endswith("it is not a text file; a scene is TOML")


def test_parts_in_code_are_named_in_place_of_lines(cube):
    good = palpate.Object("cube", cube)
    for call, text, key in [
        (lambda: palpate.Scene([palpate.Object("cube", cube, friction=-1)]), 'object "cube": friction is -1, expected at least 0 and below 1e6', "friction"),
        (lambda: palpate.Scene([good], devices=[palpate.Device("f", tip_radius=-1)]), 'device "f": tip_radius is -1 m, expected at least 0 and below 1e6', "tip_radius"),
        (lambda: palpate.Scene([good], devices=[palpate.Device("f", mode="hold")]), 'device "f": mode is "hold", expected "held", "touch" or "force"', "mode"),
        (lambda: palpate.Scene([good, good]), 'object "cube": the name "cube" is taken already', "name"),
        (lambda: palpate.Scene([good], sleep_after=-1.0), "scene: sleep_after is -1 s, expected a positive number; inf for never", "sleep_after"),
        (lambda: palpate.Scene([]), "scene: the scene has no [[object]]", "object"),
    ]:
        with pytest.raises(palpate.SceneError) as caught:
            call()
        assert (str(caught.value), caught.value.key) == (text, key)
    rows = palpate.Device("f", path=[[0, 0, 0, 0], [0, 1, 1, 1]])
    assert 'device "f": path' in refusal(palpate.SceneError, lambda: palpate.Scene([good], devices=[rows]))


def test_parts_of_a_wrong_type_are_refused(cube):
    good = palpate.Object("cube", cube)
    for call, text in [
        (lambda: palpate.Scene([palpate.Device("f")]), "objects has Device("),
        (lambda: palpate.Scene(good), "objects is Object("),
        (lambda: palpate.Scene([good], devices=[palpate.Device("f", path=[1, 2])]), "the path of device f has the shape (2,)"),
        (lambda: palpate.Scene([good], devices=[palpate.Device("f", path=[["a"]])]), "the path of device f is no file and no array"),
        (lambda: palpate.Scene([good], gravity=object()), "gravity is <object"),
    ]:
        assert refusal(palpate.InputError, call).startswith(text)
    unknown = refusal(palpate.SceneError, lambda: palpate.Scene([{"name": "a", "recording": cube, "colour": 3}]))
    assert "unknown field `colour`, expected one of `name`" in unknown


def test_missing_files_are_file_errors(tmp_path, cube):
    for call, text in [
        (lambda: palpate.Recording.open(tmp_path / "no.palp"), "cannot read the recording "),
        (lambda: palpate.Scene.load(tmp_path / "no.toml"), "cannot read the scene "),
        (lambda: palpate.Log(tmp_path / "no.mcap"), "cannot read the log "),
        (lambda: palpate.record(tmp_path / "no.msh", **BODY), "cannot read mesh "),
        (lambda: cube.save(tmp_path / "no" / "cube.palp"), "cannot "),
    ]:
        assert refusal(palpate.FileError, call).startswith(text)
    assert issubclass(palpate.FileError, OSError) and issubclass(palpate.InputError, ValueError)
    for name, call in [
        ("no.palp", lambda: palpate.Recording.open(tmp_path / "no.palp")),
        ("no.toml", lambda: palpate.Scene.load(tmp_path / "no.toml")),
        ("no.mcap", lambda: palpate.Log(tmp_path / "no.mcap")),
        ("no.txt", lambda: palpate.record(BOX, materials=tmp_path / "no.txt")),
        ("no.msh", lambda: palpate.record(tmp_path / "no.msh", **BODY)),
    ]:
        with pytest.raises(OSError) as caught:
            call()
        assert caught.value.errno == errno.ENOENT and caught.value.filename == str(tmp_path / name) == caught.value.file
    # A folder is refused by palpate, not by the system.
    with pytest.raises(palpate.FileError, match="it is a folder, not a file") as caught:
        palpate.Recording.open(tmp_path)
    assert caught.value.errno is None and caught.value.filename == str(tmp_path)


def test_damaged_files_are_refused(tmp_path, cube):
    bytes_ = bytearray(cube.to_bytes())
    bytes_[len(bytes_) // 2] ^= 1
    (tmp_path / "bad.palp").write_bytes(bytes_)
    assert "does not fit its hash" in refusal(palpate.RecordingError, lambda: palpate.Recording.open(tmp_path / "bad.palp"))
    refusal(palpate.RecordingError, lambda: palpate.Recording.from_bytes(b""))
    (tmp_path / "bad.mcap").write_bytes(b"no log")
    refusal(palpate.LogError, lambda: palpate.Log(tmp_path / "bad.mcap"))
    (tmp_path / "bad.msh").write_text("no mesh")
    refusal(palpate.MeshError, lambda: palpate.record(tmp_path / "bad.msh", **BODY))


@pytest.mark.parametrize(
    ("options", "kind", "text"),
    [
        ({"young": -1}, palpate.RecordingError, "Young's modulus is -1e0 Pa"),
        ({"density": None}, palpate.InputError, "give young, poisson and density together, or material alone"),
        ({"material": "liver"}, palpate.InputError, "give young, poisson and density together, or material alone"),
        ({"modes": -3}, palpate.InputError, "modes is -3, expected at least 1"),
        ({"modes": 0}, palpate.RecordingError, ""),
        ({"order": 3}, palpate.InputError, "order is 3, expected 1 or 2"),
        ({"scale": float("nan")}, palpate.MeshError, "scale"),
        ({"cell_size": 0.1}, palpate.MeshError, "box:0.1x0.1x0.1/1x1x1: "),
        ({"fix": "q<1"}, palpate.MeshError, "neither a group of the mesh nor a condition"),
        ({"fix": 3}, palpate.InputError, "fix is no text, and no list of texts"),
        ({"spring": "x"}, palpate.MeshError, "expected 'STIFFNESS: NODES'"),
        ({"residual": "some"}, palpate.InputError, "residual is 'some', expected"),
        ({"residual": float("nan")}, palpate.RecordingError, ""),
        ({"merge_nodes": "some"}, palpate.InputError, 'merge_nodes is "some", expected "auto", "always" or "never"'),
        ({"piece": 0}, palpate.InputError, 'piece is 0, expected "largest", or a number from 1'),
        ({"piece": 7}, palpate.MeshError, "box:0.1x0.1x0.1/1x1x1: "),
        ({"materials": []}, palpate.InputError, "give materials, or material"),
        ({"precision": "half"}, palpate.InputError, 'precision is "half", expected "compact" or "full"'),
        ({"rayleigh": (1, 1), "damping_ratio": 0.1}, palpate.InputError, "give rayleigh or damping_ratio, not both"),
        ({"damping_ratio": -1}, palpate.RecordingError, ""),
        ({"force_error": -1.0}, palpate.RecordingError, ""),
    ],
)
def test_options_of_a_recording_are_checked(options, kind, text):
    assert text in refusal(kind, lambda: palpate.record(BOX, **{**BODY, **options}))


def test_messages_name_keywords_and_not_options(tmp_path):
    text = refusal(palpate.MeshError, lambda: palpate.record(BOX))
    assert text == "region '0' has no material in the mesh file: give young, poisson and density, material, or materials"
    text = refusal(palpate.InputError, lambda: palpate.record(BOX, material="cheese"))
    assert text.startswith('material: there is no material "cheese"')
    assert refusal(palpate.MeshError, lambda: palpate.record(BOX, fix="q<1", **BODY)).startswith('fix "q<1" is neither')
    assert refusal(palpate.MeshError, lambda: palpate.record(BOX, cell_size=0.1, **BODY)).endswith("leave cell_size out")
    file = tmp_path / "no--order.msh"
    assert str(file) in refusal(palpate.FileError, lambda: palpate.record(file, **BODY))


def test_tables_of_materials_are_checked():
    for materials, kind, text in [
        ({"young": 1}, palpate.InputError, "materials is {'young': 1}, expected a file, or a list of dicts"),
        (["liver"], palpate.InputError, "materials has 'liver', expected a dict"),
        ([{"region": "skin", "name": "liver"}], palpate.RecordingError, "materials: "),
        ([{"colour": 3}], palpate.RecordingError, "materials: "),
    ]:
        assert text in refusal(kind, lambda materials=materials: palpate.record(BOX, materials=materials))


def test_meshes_of_arrays_are_checked():
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    whole = [[0, 1, 2, 3]]
    flat = nodes * [1, 1, 0]
    for mesh, kind, text in [
        ((nodes, [[0, 1, 2, 4]]), palpate.MeshError, "tetrahedron 0 has the node 4, expected 0 to 3"),
        ((nodes, [[0, 1, 2, -1]]), palpate.MeshError, "tetrahedron 0 has the node -1, expected 0 to 3"),
        ((nodes * np.nan, whole), palpate.InputError, "row 0 of nodes is [NaN, NaN, NaN], expected finite numbers"),
        ((nodes[:, :2], whole), palpate.InputError, "nodes has the shape (4, 2), expected (any, 3)"),
        ((nodes, [[0.0, 1, 2, 3]]), palpate.InputError, "tetrahedra holds float64 in the shape (1, 4), expected integers of shape (any, 4)"),
        ((nodes, [0, 1, 2, 3]), palpate.InputError, "tetrahedra holds int64 in the shape (4,), expected integers of shape (any, 4)"),
        ((nodes, np.zeros((0, 4), int)), None, ""),
        ((flat, whole), None, ""),
        ((nodes, [[0, 0, 1, 2]]), None, ""),
        ((nodes * 1e300, whole), None, ""),
        ((nodes,), palpate.InputError, "mesh is no path, no primitive"),
        (3, palpate.InputError, "mesh is no path, no primitive"),
    ]:
        with pytest.raises(palpate.PalpateError) as caught:
            palpate.record(mesh, modes=5, **BODY)
        assert text in str(caught.value) and "failed inside" not in str(caught.value)
        assert kind is None or type(caught.value) is kind


def test_unknown_objects_and_nodes_are_named(held, cube):
    simulation = palpate.Simulation(held)
    for given in ["ball", 1, -1, None, 0.5]:
        text = f"there is no object {given}; the scene has cube"
        assert refusal(palpate.InputError, lambda given=given: simulation.surface(given)) == text
    nodes = len(cube.positions)
    text = refusal(palpate.InputError, lambda: cube.residual_compliance([nodes]))
    assert text == f"nodes has {nodes}, expected 0 to {nodes - 1}"
    refusal(palpate.InputError, lambda: cube.residual_compliance([0] * 5000))


def test_snapshots_of_other_scenes_are_refused(held, on_floor):
    snapshot = palpate.Simulation(held).snapshot()
    text = refusal(palpate.InputError, lambda: palpate.Simulation(on_floor).restore(snapshot))
    assert text.startswith("the snapshot is of another scene")


def test_devices_that_live_in_real_time_are_refused(cube):
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[{"name": "hand", "mode": "touch", "driver": {"kind": "dhd"}}])
    assert refusal(palpate.InputError, lambda: palpate.Simulation(scene)).startswith('device "hand" has a driver')


def test_the_forces_of_a_simulation_cannot_be_made_read_only_unnoticed(held):
    simulation = palpate.Simulation(held)
    simulation.forces.setflags(write=False)
    text = refusal(palpate.PalpateError, lambda: simulation.step(simulation.held_points()))
    assert "cannot be written to" in text
