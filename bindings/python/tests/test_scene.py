"""Scenes of files, texts and dataclasses: one parser, one set of messages."""

import dataclasses
import pickle
import warnings

import numpy as np
import palpate
import pytest

TEXT = """step = 0.002
gravity = [0, 0, -9.81]
[[object]]
name = "cube"
recording = "cube.palp"
friction = 0.6
[[plane]]
name = "floor"
point = [0, 0, -0.06]
normal = [0, 0, 1]
[[obstacle]]
name = "ball"
sphere = { radius = 0.02 }
position = [0, 0, 0.2]
[[device]]
name = "finger"
mode = "touch"
coupling = { stiffness = 500.0 }
"""


def test_files_texts_and_dataclasses_are_the_same_scene(folder, cube):
    (folder / "scene.toml").write_text(TEXT)
    built = palpate.Scene(
        [palpate.Object("cube", cube, friction=0.6)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -0.06], normal=[0, 0, 1])],
        obstacles=[palpate.Obstacle(name="ball", sphere={"radius": 0.02}, position=np.array([0, 0, 0.2]))],
        devices=[palpate.Device("finger", coupling={"stiffness": 500.0})],
        gravity=(0, 0, -9.81),
        step=0.002,
    )
    by_dicts = palpate.Scene(
        [{"name": "cube", "recording": folder / "cube.palp", "friction": np.float64(0.6)}],
        planes=[{"name": "floor", "point": [0, 0, -0.06], "normal": [0, 0, 1]}],
        obstacles=[{"name": "ball", "sphere": {"radius": 0.02}, "position": [0, 0, 0.2]}],
        devices=[{"name": "finger", "mode": "touch", "coupling": {"stiffness": 500}}],
        gravity=[0, 0, -9.81],
        step=0.002,
    )
    hand = np.tile([0, 0, 0.3], (100, 1, 1))
    loaded = palpate.Scene.load(folder / "scene.toml")
    expected = palpate.Simulation(loaded).run(hand)["poses"]
    for scene in [built, by_dicts, palpate.Scene.from_toml(TEXT, folder), palpate.Scene.from_toml(built_text(built), folder)]:
        assert scene.step == 0.002 and list(scene.gravity) == [0, 0, -9.81] and scene.duration == 0
        names = [scene.object_names, scene.device_names, scene.obstacle_names, scene.clamp_names, scene.probe_names]
        assert names == [["cube"], ["finger"], ["floor", "ball"], [], []]
        assert np.array_equal(palpate.Simulation(scene).run(hand)["poses"], expected)


def built_text(scene):
    """Text of a scene that is built in code, with the file in place of the recording in memory."""
    return scene.toml.replace("<recording of object cube>", "cube.palp")


def test_names_with_quotes_and_other_letters_are_kept(cube):
    with pytest.raises(palpate.SceneError, match="expected letters, digits, - and _"):
        palpate.Scene([palpate.Object('a"b\n\x7f', cube)])
    assert palpate.Scene([palpate.Object("würfel_1", cube)]).object_names == ["würfel_1"]


def test_remarks_are_python_warnings_at_the_line_of_the_caller(cube):
    with pytest.warns(palpate.PalpateWarning, match="begins 50.00 mm inside") as caught:
        scene = palpate.Scene(
            [palpate.Object("cube", cube)], planes=[palpate.Plane(name="floor", point=[0, 0, 0], normal=[0, 0, 1])]
        )
    assert caught[0].filename == __file__
    assert [warning["kind"] for warning in scene.warnings] == ["begins_inside"]
    assert scene.warnings[0]["part"] == "cube"


def test_choices_are_told(cube):
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [0.05, 0, 0]}, coupling="auto")
    (choice,) = palpate.Scene([palpate.Object("cube", cube)], devices=[hand]).choices
    assert "hand" in choice


def test_gravity_and_bases_follow_rows():
    bar = palpate.record("box:0.2x0.05x0.05/4x1x1", material="rubber", modes=10, damping_ratio=0.3, fix="x<-0.099")
    base = [[0, 0, 0, 0], [1, 0.1, 0, 0]]
    scene = palpate.Scene(
        [palpate.Object("bar", bar, path={"file": base, "repeat": False})],
        gravity={"file": [[0, 0, 0, 0], [0.5, 0, 0, -9.81]]},
    )
    assert scene.duration == 1.0
    series = palpate.Simulation(scene).run()
    assert len(series["time"]) == 1000
    assert np.allclose(series["poses"][-2, 0, 0], 0.1, atol=1e-3)


def test_a_saved_scene_is_the_same_for_python_and_the_command_line(cube, tmp_path, palpate_run):
    rows = np.array([[0, 0, 0, 0.06], [0.05, 0.01, 0, 0.048]])
    folder, other = tmp_path / "one", tmp_path / "two"
    folder.mkdir(), other.mkdir()
    cube.save(folder / "file.palp")
    scene = palpate.Scene(
        [
            palpate.Object("first", cube),
            palpate.Object("second", cube, position=[0.3, 0, 0]),
            palpate.Object("third", "file.palp", position=[0, 0.3, 0]),
        ],
        devices=[palpate.Device("finger", tip_radius=0.005, path=rows)],
        gravity={"file": [[0, 0, 0, 0], [0.05, 0, 0, -1]]},
        folder=folder,
    )
    expected = palpate.Simulation(scene).run()
    scene.save(other / "scene.toml")
    # Objects that share a recording share its file; the one that was a file still is.
    names = ["scene-device-finger.csv", "scene-gravity.csv", "scene-object-first.palp", "scene.toml"]
    assert sorted(path.name for path in other.iterdir()) == names
    loaded = palpate.Scene.load(other / "scene.toml")
    again = palpate.Simulation(loaded).run()
    assert np.array_equal(again["poses"], expected["poses"]) and expected["forces"].any()
    palpate_run("run", other / "scene.toml", "--csv", other / "out.csv")
    table = np.genfromtxt(other / "out.csv", delimiter=",", names=True, deletechars="")
    assert np.array_equal(table["finger.fz"], expected["forces"][:, 0, 2])
    # A scene of a file may be saved elsewhere, too, and a second time in its place.
    loaded.save(folder / "moved.toml")
    assert "../two/scene-object-first.palp" in (folder / "moved.toml").read_text()
    assert np.array_equal(palpate.Simulation(palpate.Scene.load(folder / "moved.toml")).run()["poses"], expected["poses"])
    text = (other / "scene.toml").read_text()
    loaded.save(other / "scene.toml")
    assert (other / "scene.toml").read_text() == text
    with pytest.raises(palpate.FileError, match="cannot write .*none/scene.toml: there is no folder"):
        loaded.save(tmp_path / "none" / "scene.toml")


def test_scenes_are_pickled_with_all_that_is_in_memory(cube):
    scene = palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, 0], normal=[0, 0, 1])],
        devices=[palpate.Device("finger", path=[[0, 0, 0, 0.06], [0.02, 0, 0, 0.045]])],
    )
    with warnings.catch_warnings():
        # The cube begins in the floor, as was said before.
        warnings.simplefilter("error")
        again = pickle.loads(pickle.dumps(scene))
    assert type(again) is palpate.Scene and again.toml == scene.toml
    assert np.array_equal(palpate.Simulation(again).run()["forces"], palpate.Simulation(scene).run()["forces"])


def test_parts_are_those_classes_and_their_heirs(cube):
    class Object(palpate.Object):
        """Body with a default friction of its own."""

        def __init__(self, name, recording):
            super().__init__(name, recording, friction=0.25)

    assert "friction = 0.25" in palpate.Scene([Object("cube", cube)]).toml

    @dataclasses.dataclass
    class Device:
        name: str

    with pytest.raises(palpate.InputError, match="devices has .*Device.*, expected palpate.Device"):
        palpate.Scene([palpate.Object("cube", cube)], devices=[Device("finger")])


def test_a_part_named_as_the_number_of_another_keeps_its_own_path(cube):
    def slab(name, height):
        path = [[0, 0, 0, height, 1, 0, 0, 0], [1, 0, 0, height, 1, 0, 0, 0]]
        return palpate.Plane(normal=[0, 0, 1], name=name, path=path)

    scene = palpate.Scene([palpate.Object("cube", cube)], planes=[slab("1", -0.0499), slab(None, -0.2)], gravity=[0, 0, -9.81])
    simulation = palpate.Simulation(scene)
    simulation.run(steps=40)
    assert set(simulation.contacts["against"]) == {"1"}
