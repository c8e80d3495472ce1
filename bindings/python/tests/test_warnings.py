"""Mistakes that a run can make: each has its warning, in Python as on the command line."""

import time
import warnings

import numpy as np
import palpate
import pytest

FINGER = palpate.Device("finger", tip_radius=0.005, patch_radius=0.04, coupling={"stiffness": 500.0, "damping": 1.0})
FAR = (
    'the motion of "finger" goes 70.0 m away from the objects, which span 0.173 m: positions are in metres; if these are in '
    "millimetres, divide them by 1000"
)


@pytest.fixture
def scene(cube):
    return palpate.Scene([palpate.Object("cube", cube)], devices=[FINGER])


def press(height, depth):
    """Positions of a hand (steps, 1, 3) that comes down from a height above the cube's centre by a depth [m]."""
    hand = np.zeros((300, 1, 3))
    hand[:, 0, 2] = height - depth * np.sin(np.linspace(0, np.pi, 300)) ** 2
    return hand


def told(work):
    """Texts of the warnings of some work, and its result."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        result = work()
    assert all(issubclass(warning.category, palpate.PalpateWarning) for warning in caught)
    assert all(warning.filename == __file__ for warning in caught)
    return [str(warning.message) for warning in caught], result


def kinds(found):
    return [(warning["kind"], warning["part"]) for warning in found]


def test_positions_in_millimetres_get_the_warning_of_a_path_in_every_call(scene):
    millimetres = 1000 * press(0.07, 0.02)
    simulation = palpate.Simulation(scene)
    texts, series = told(lambda: simulation.run(millimetres))
    assert texts[0] == FAR and kinds(series["warnings"]) == [("units", "finger"), ("no_contact", "finger")]
    assert told(lambda: simulation.run(millimetres))[0] == [], "each is told once"
    stepped = palpate.Simulation(scene)
    assert told(lambda: stepped.step(millimetres[0]))[0] == [FAR]
    assert told(lambda: stepped.step(millimetres[1]))[0] == []
    assert kinds(stepped.warnings) == [("units", "finger"), ("no_contact", "finger")]
    # In one row of three.
    batch = palpate.Batch(scene, 3)
    rows = np.stack([press(0.07, 0.02), millimetres, millimetres], axis=1)
    assert told(lambda: batch.run(rows))[0] == [FAR]
    assert told(lambda: batch.step(rows[0]))[0] == []
    assert kinds(batch.simulation(1).warnings)[0] == ("units", "finger")
    assert told(lambda: palpate.Batch(scene, 3).step(rows[0]))[0] == [FAR]
    with_path = palpate.Device("finger", tip_radius=0.005, patch_radius=0.04, path=[[0, 0, 0, 70], [1, 0, 0, 70]])
    texts, _ = told(lambda: palpate.Scene([palpate.Object("cube", scene_recording(scene))], devices=[with_path]))
    assert texts[-1] == FAR.replace("motion", "path")


def scene_recording(scene):
    return scene._source[2]["<recording of object cube>"]


def test_a_session_tells_of_positions_in_millimetres_once(scene):
    def session():
        with palpate.Session(scene, positions=[[0, 0, 70]]) as running:
            running.move([[0, 0, 60]])
            time.sleep(0.02)
        return running.stop()

    texts, report = told(session)
    assert texts == [FAR] and report["warnings"] == []


def test_poses_in_millimetres_are_told_of(cube):
    tool = palpate.Obstacle(name="tool", sphere={"radius": 0.01}, position=[0, 0, 0.09])
    simulation = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)], obstacles=[tool]))
    texts, _ = told(lambda: simulation.step(obstacles=[[0, 0, 70, 1, 0, 0, 0]]))
    assert texts == [FAR.replace("finger", "tool")]


def test_forces_and_hands_that_take_no_part_are_no_positions(scene, cube):
    push = palpate.Device("push", mode="force", attach={"object": "cube", "point": [0.05, 0, 0]})
    simulation = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)], devices=[push]))
    assert told(lambda: simulation.step([[20.0, 0, 0]]))[0] == []
    parked = palpate.Simulation(scene)
    parked.deactivate("finger")
    assert told(lambda: parked.run(np.full((5, 1, 3), 1e3)))[0] == []


def test_a_run_tells_what_palpate_run_tells(scene, folder, palpate_run):
    simulation = palpate.Simulation(scene)
    texts, series = told(lambda: simulation.run(press(0.2, 0.02)))
    assert texts == ["finger touched nothing"]
    assert series["warnings"] == [{"kind": "no_contact", "part": "finger", "message": texts[0]}] == simulation.warnings
    # A long way in, on a floor.
    floor = palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])
    stiff = palpate.Device(**{**vars(FINGER), "coupling": {"stiffness": 2e4, "damping": 10.0}})
    objects, hand = [palpate.Object("cube", scene_recording(scene))], press(0.06, 0.06)
    texts, series = told(lambda: palpate.Simulation(palpate.Scene(objects, devices=[stiff], planes=[floor])).run(hand))
    assert ("large_deformation", "cube") in kinds(series["warnings"])
    assert "no_contact" not in dict(kinds(series["warnings"]))
    rows = np.column_stack([np.arange(0, 301) * 1e-3, np.concatenate([hand[:1, 0], hand[:, 0]])])
    with_path = palpate.Device(**{**vars(stiff), "path": rows})
    palpate.Scene(objects, devices=[with_path], planes=[floor]).save(folder / "deep.toml")
    out = palpate_run("run", folder / "deep.toml")
    assert "  warning      cube deforms by " in out
    # One that rests is not meant to touch, and a press of the right depth is nothing to tell of.
    assert told(lambda: palpate.Simulation(scene).run(np.full((50, 1, 3), 0.2)))[0] == []
    texts, series = told(lambda: palpate.Simulation(scene).run(press(0.06, 0.01)))
    assert texts == [] and series["warnings"] == []


def test_warnings_of_a_copy_and_after_a_reset(scene):
    simulation = palpate.Simulation(scene)
    simulation.run(press(0.2, 0.02))
    assert told(lambda: simulation.copy().run(press(0.2, 0.02)))[0] == [], "it was told"
    simulation.reset()
    assert simulation.warnings == []


def test_a_warning_that_is_an_error_comes_before_the_step(scene):
    simulation = palpate.Simulation(scene)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(palpate.PalpateWarning, match="millimetres"):
            simulation.run(1000 * press(0.07, 0.02))
    assert simulation.time == 0


def test_youngs_modulus_in_kilopascals_is_asked_about():
    def record():
        return palpate.record("box:0.1x0.1x0.1/4x4x4", young=50, poisson=0.45, density=1000, modes=10, order=1)

    texts, body = told(record)
    # By hand: 1000·9.81·0.1/(2·50) = 9.81.
    assert texts[0].startswith("Young's modulus is 50 Pa, and the density 1000 kg/m³: under its own weight the body, 0.100 m large, would sag by 9.8 times")
    assert texts[1].endswith("(see the certificate): see to Young's modulus first")
    texts, _ = told(lambda: palpate.Scene([palpate.Object("cube", body)]))
    assert texts[0].endswith("it would sag by more than its size under its own weight: are its size in metres and its Young's modulus in Pa?")


@pytest.mark.parametrize("shape", [(10, 3), (10,), (10, 5), (10, 1, 4), (0, 4), (4, 10)])
def test_a_path_of_another_shape_is_named_by_it(cube, shape):
    with pytest.raises(palpate.InputError) as caught:
        palpate.Scene([palpate.Object("cube", cube)], devices=[palpate.Device("finger", path=np.ones(shape))])
    assert str(caught.value) == f"the path of device finger has the shape {shape}, expected (rows, 4): t, x, y, z"


def test_rows_of_a_path_count_from_0(cube):
    with pytest.raises(palpate.SceneError) as caught:
        palpate.Scene([palpate.Object("cube", cube)], devices=[palpate.Device("finger", path=[[1, 0, 0, 0], [0, 0, 0, 0]])])
    assert str(caught.value) == 'device "finger": path: row 1: time 0 s does not come after 1 s'
    with pytest.raises(palpate.InputError, match=r"expected \(rows, 4\): t, x, y, z, or \(rows, 8\) with qw, qx, qy, qz"):
        palpate.Scene([palpate.Object("cube", cube)], planes=[palpate.Plane([0, 0, 1], path=np.ones((3, 7)))])
