"""Objects on stored tables: what a new point or a tip needs is read when it is asked for, not within a step."""

import shutil

import numpy as np
import palpate
import pytest

SIDE = 0.1  # m
BODY = ["box:0.1x0.1x0.1/2x2x2", "--order", "1", "--young", "2e4", "--poisson", "0.3", "--density", "1000", "--rayleigh", "2,2e-4"]
#: Chunks of the store: all that its columns are in.
CHUNKS = "impulse_response/c"


@pytest.fixture
def stored(tmp_path, palpate_run):
    """Folder with a cube and its table."""
    table = ["--dense", tmp_path / "cube.zarr", "--step", "0.001", "--duration", "0.05", "--method", "closed-form"]
    palpate_run("record", *BODY, "--modes", "20", "-o", tmp_path / "cube.palp", *table)
    return tmp_path


def scene_on(folder, patch_radius=None):
    """A cube in free space, which a hand holds on one side."""
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [SIDE / 2, 0, 0]})
    cube = palpate.Object("cube", folder / "cube.palp", response="fir", table=folder / "cube.zarr")
    return palpate.Scene([cube], devices=[hand])


def lose(folder):
    shutil.rmtree(folder / "cube.zarr" / CHUNKS)


@pytest.mark.parametrize("make", [palpate.Simulation, lambda scene: palpate.Batch(scene, 2)], ids=["simulation", "batch"])
def test_columns_of_a_new_point_are_read_when_it_is_grasped(stored, make):
    kept, lost = make(scene_on(stored)), make(scene_on(stored))
    for one in [kept, lost]:
        one.grasp("hand", "cube", [-SIDE / 2, 0, 0])
    lose(stored)
    hand = kept.held_points() + [0.001, 0, 0]
    assert np.array_equal(lost.step(hand), kept.step(hand))
    assert (kept.forces[..., 0] < -0.01).all()


def test_columns_of_a_tip_are_read_when_a_hand_lets_go(stored):
    kept, lost = palpate.Simulation(scene_on(stored)), palpate.Simulation(scene_on(stored))
    for one in [kept, lost]:
        one.release("hand")
    lose(stored)
    for height in np.linspace(SIDE / 2 + 0.001, SIDE / 2 - 0.002, 30):
        hand = [[0, 0, height]]
        assert np.array_equal(lost.step(hand), kept.step(hand))
    assert kept.forces[0, 2] > 0.01 and len(kept.contacts) == 1


def test_columns_that_are_lost_are_a_scene_error_and_no_rigid_point(stored):
    simulation = palpate.Simulation(scene_on(stored))
    lose(stored)
    for call, text in [
        (lambda: simulation.grasp("hand", "cube", [-SIDE / 2, 0, 0]), "the point [-0.05, 0, 0] of \"cube\" cannot be held: object \"cube\": "),
        (lambda: simulation.release("hand"), "object \"cube\": "),
    ]:
        with pytest.raises(palpate.SceneError) as caught:
            call()
        assert str(caught.value).startswith(text) and caught.value.kind == "table"
        assert "cube.zarr" in str(caught.value)
    # The hand goes on as before; what needs nothing new works.
    assert simulation.modes == ["held"]
    simulation.step(simulation.held_points() + [0.001, 0, 0])
    assert simulation.forces[0, 0] < -0.01
    simulation.grasp("hand", "cube", [SIDE / 2, 0, 0])
    simulation.deactivate("hand")
    assert simulation.modes == ["inactive"]
