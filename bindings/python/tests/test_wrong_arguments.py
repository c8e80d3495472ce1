"""Wrong arguments of every function: an exception of palpate with a text, or a TypeError; never a bare error of Python or NumPy, nor a panic."""

import dataclasses
import math

import numpy as np
import palpate
import pytest

HUGE = 10**30

#: Values that are wrong nearly everywhere.
WRONG = [
    None,
    "",
    "x",
    "a\0b",
    "\ud800",
    b"x",
    -1,
    0,
    1.5,
    10**9,
    HUGE,
    -HUGE,
    math.nan,
    math.inf,
    1j,
    True,
    np.int64(-5),
    [],
    {},
    (),
    set(),
    object(),
    [None],
    ["x"],
    [1, 2],
    [[1, 2], [3]],
    [HUGE],
    {"a": 1},
    np.zeros(3),
    np.zeros((2, 3)),
    np.full((2, 3), np.nan),
    np.zeros((0, 3)),
    np.zeros((2, 3), complex),
    np.array(["a"]),
    len,
]


def check(call, given, *arguments, **keywords):
    """Call with a wrong value, which may be a good one here."""
    try:
        call(*arguments, **keywords)
    except palpate.PalpateError as error:
        text = str(error)
        assert text and "failed inside" not in text, (given, text)
    except TypeError as error:
        assert str(error), given
    except MemoryError:
        pass
    except Exception as error:
        raise AssertionError(f"{given!r} gives {type(error).__name__}: {error}") from error


@pytest.fixture(scope="module")
def small():
    """Cube of eight cells."""
    return palpate.record("box:0.1x0.1x0.1/2x2x2", young=2e4, poisson=0.3, density=1000, modes=6, order=1)


@pytest.fixture(scope="module")
def scene(small):
    """Cube on a floor, a hand that holds it, and a tip."""
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [0.05, 0, 0]})
    floor = palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])
    return palpate.Scene([palpate.Object("cube", small)], devices=[hand, palpate.Device("tip")], planes=[floor])


@pytest.mark.parametrize("given", WRONG, ids=lambda given: repr(given).split(" at ")[0])
class TestWrongArguments:
    def test_of_a_recording(self, given, small, tmp_path):
        body = {"young": 2e4, "poisson": 0.3, "density": 1000, "modes": 3, "order": 1}
        check(palpate.record, given, given, **body)
        # An enumerated word with half a surrogate pair is a UnicodeEncodeError.
        enumerated = [] if isinstance(given, str) and not given.isascii() else ["merge_nodes", "precision"]
        numbers = ["young", "poisson", "density", "rayleigh", "damping_ratio", "modes", "force_error", "bandwidth", "order", "scale", "cell_size"]
        for key in [*numbers, "material", "materials", "fix", "spring", "piece", "residual", "progress", *enumerated]:
            check(palpate.record, (key, given), "box:0.1x0.1x0.1/1x1x1", **{**body, key: given})
        check(palpate.Recording.open, given, given)
        check(palpate.Recording.from_bytes, given, given)
        check(small.residual_compliance, given, given)
        check(palpate.Log, given, given)
        if not isinstance(given, str) or not given.isascii():
            check(small.save, given, given)

    def test_of_a_scene(self, given, small, scene):
        good = palpate.Object("cube", small)
        check(palpate.Scene, given, given)
        check(palpate.Scene, given, [given])
        parts = ["devices", "planes", "obstacles", "clamps", "probes"]
        numbers = ["gravity", "step", "max_contact_points", "max_contact_samples", "solver_budget", "sleep_after"]
        for key in [*parts, *numbers, "integrator", "rigid_compliance", "folder", "reference"]:
            check(palpate.Scene, (key, given), [good], **{key: given})
        for key in parts:
            check(palpate.Scene, (key, given), [good], **{key: [given]})
        for call in [palpate.Scene.load, palpate.Scene.from_toml, scene.triangles, scene.rest_positions, palpate.Simulation]:
            check(call, given, given)
        check(palpate.Scene.from_toml, given, "", given)
        if not isinstance(given, str) or not given.isascii():
            check(scene.save, given, given)

    def test_of_a_part(self, given, small):
        good = palpate.Object("cube", small)
        for kind, keys in [
            (palpate.Object, {"name": "other", "recording": small}),
            (palpate.Device, {"name": "tip"}),
            (palpate.Plane, {"normal": [0, 0, 1]}),
            (palpate.Obstacle, {"sphere": {"radius": 0.1}}),
            (palpate.Clamp, {"name": "jaw", "object": "cube", "face": {"point": [0, 0, -0.05]}}),
            (palpate.Probe, {"name": "top", "object": "cube", "point": [0, 0, 0.05]}),
        ]:
            for field in dataclasses.fields(kind):
                part = kind(**{**keys, field.name: given})
                group = {"objects": [good, part]} if kind is palpate.Object else {"objects": [good], f"{kind.__name__.lower()}s": [part]}
                check(palpate.Scene, (kind.__name__, field.name, given), **group)

    def test_of_a_simulation(self, given, scene):
        simulation, batch = palpate.Simulation(scene), palpate.Batch(scene, 2)
        for key in ["positions", "obstacles", "clamps"]:
            for call in [simulation.step, simulation.run, batch.step, batch.run]:
                check(call, (key, given), **{key: given})
        if not isinstance(given, int) or given <= 1 or given >= HUGE:
            for key in ["steps", "duration"]:
                check(simulation.run, (key, given), **{key: given})
        for call in [simulation.surface, simulation.restore, simulation.release, simulation.deactivate]:
            check(call, given, given)
        for one in [simulation, batch]:
            check(one.reset, given, poses=given)
            check(one.reset, given, velocities=given)
            for arguments in [(given, "cube", [0.05, 0, 0]), ("tip", given, [0.05, 0, 0]), ("tip", "cube", given)]:
                check(one.grasp, arguments, *arguments)

    def test_of_a_batch(self, given, scene):
        batch, snapshot = palpate.Batch(scene, 2), palpate.Simulation(scene).snapshot()
        check(palpate.Batch, given, given, 2)
        check(palpate.Batch, given, scene, given)
        check(palpate.Batch, given, scene, 2, given)
        for call in [batch.simulation, batch.reset, batch.snapshot, batch.restore, batch.release, batch.deactivate]:
            check(call, given, given)
        check(batch.restore, given, snapshot, given)
        check(batch.grasp, given, "tip", "cube", [0.05, 0, 0], given)
        check(batch.release, given, "tip", given)

    def test_of_a_coupling(self, given, small):
        good, pose = [palpate.Object("cube", small)], [[0, 0, 0.2, 1, 0, 0, 0]]
        ball = palpate.Obstacle(sphere={"radius": 0.01})

        def coupling(objects=good, shapes=((ball,),), poses=pose, step=1e-3, **options):
            return palpate.RigidCoupling(objects, shapes, poses, step=step, **options)

        keys = ["objects", "shapes", "poses", "step", "centers", "moving", "iterations", "tolerance", "gravity"]
        for key in [*keys, *([] if isinstance(given, int) and given == 10**9 else ["substeps"])]:
            check(coupling, (key, given), **{key: given})
        check(coupling, given, shapes=[given])
        for shape in [
            given,
            palpate.Plane(normal=given),
            palpate.Plane(normal=[0, 0, 1], point=given),
            palpate.Obstacle(sphere={"radius": 0.1}, position=given),
            palpate.Obstacle(sphere={"radius": 0.1}, orientation=given),
            palpate.Obstacle(sphere={"radius": 0.1}, name=given),
            palpate.Obstacle(sphere=given),
        ]:
            check(coupling, shape, shapes=[[shape]])
        made = coupling()
        for call in [made.follow, made.reset, made.advance]:
            check(call, given, given)
        check(made.advance, given, lambda wrenches: given)


def test_a_number_is_no_file(capfd):
    # It would be an open file, which is closed after it was read.
    with pytest.raises(TypeError, match="expected str, bytes or os.PathLike object, not int"):
        palpate.Scene.load(2)
    with pytest.raises(TypeError):
        palpate.Scene.load(True)


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda scene: palpate.Batch(scene, HUGE), f"{HUGE} is too large for a whole number of 64 bits"),
        (lambda scene: palpate.Simulation(scene).grasp("tip", "cube", [1, 2]), "point has the shape (2,), expected (3,)"),
        (lambda scene: palpate.Scene.load("a\0b"), "the path 'a\\x00b' is not one of a file: embedded null byte"),
        (lambda scene: palpate.Scene.from_toml("# \ud800"), "'# \\ud800' has characters that no text has (half of a surrogate pair)"),
        (lambda scene: palpate.Batch(scene, 2).reset([[1, 2], [3]]), "rows is no array (setting an array element with a sequence"),
        (lambda scene: palpate.record("box:1x1x1/1x1x1", rayleigh=(1, 2, 3), material="rubber"), "rayleigh has the shape (3,), expected (2,)"),
        (lambda scene: palpate.RigidCoupling([], "ball", [], step=1), "shapes is 'ball', expected a list for each body"),
        (lambda scene: palpate.RigidCoupling([], [["ball"]], [], step=1), "body 0 has the shape 'ball', expected a list for each body"),
        (lambda scene: palpate.RigidCoupling([], [], [], step=math.nan), "step is nan, expected a number of seconds above 0"),
        (lambda scene: palpate.RigidCoupling([], [[]], [[0] * 7], step=1, moving=[1, 1]), "moving holds int64 in the shape (2,), expected bool of shape (1,)"),
        (lambda scene: palpate.RigidCoupling([], [], np.zeros((0, 7)), step=1, substeps=1.5), "substeps is 1.5, expected a whole number, 1 or more"),
    ],
)
def test_what_was_bare_is_an_input_error(call, text, scene):
    with pytest.raises(palpate.InputError) as caught:
        call(scene)
    assert str(caught.value).startswith(text) and isinstance(caught.value, ValueError)
