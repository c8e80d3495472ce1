"""The environments of examples/gymnasium_press.py: what Gymnasium asks of them, and a controller that reaches the wanted force."""

import importlib.util
import pathlib

import numpy as np
import pytest

gymnasium = pytest.importorskip("gymnasium")
FILE = pathlib.Path(__file__).parents[3] / "examples" / "gymnasium_press.py"


@pytest.fixture(scope="module")
def press():
    """The example, as a module."""
    spec = importlib.util.spec_from_file_location("gymnasium_press", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def scene(press):
    return press.make_scene()


@pytest.mark.filterwarnings("error")
def test_the_environment_is_what_gymnasium_expects(press, scene):
    from gymnasium.utils.env_checker import check_env

    check_env(press.PressEnv(scene), skip_render_check=True)


def test_a_controller_presses_to_the_wanted_force(press, scene):
    environment = press.PressEnv(scene)
    heights = []
    for seed in range(4):
        observation, _ = environment.reset(seed=seed)
        for _ in range(press.LONGEST):
            observation, reward, well, cut, _ = environment.step(press.controller(observation))
            if well or cut:
                break
        force, height, wanted = observation
        assert well and abs(force - wanted) < 0.03 * wanted and -0.03 < reward <= 0
        heights.append((wanted, height))
    # The more force, the deeper.
    heights.sort()
    assert [depth for _, depth in heights] == sorted((depth for _, depth in heights), reverse=True)
    # A finger that stays above presses nothing, and is cut off.
    observation, _ = environment.reset(seed=0)
    for _ in range(press.LONGEST):
        observation, reward, well, cut, _ = environment.step(np.zeros(1, np.float32))
    assert cut and not well and reward == -1 and observation[0] == 0


def test_the_vector_environment_has_the_numbers_of_single_ones_to_the_bit(press, scene):
    rows = 3
    many = press.PressVectorEnv(rows, scene)
    single = gymnasium.vector.SyncVectorEnv([lambda: press.PressEnv(scene)] * rows)
    for ours, theirs in [
        (many.observation_space, single.observation_space),
        (many.action_space, single.action_space),
        (many.metadata["autoreset_mode"], single.metadata["autoreset_mode"]),
    ]:
        assert ours == theirs
    observations, _ = many.reset(seed=3)
    assert np.array_equal(observations, single.reset(seed=3)[0]) and observations in many.observation_space
    ended = np.zeros(rows, int)
    for _ in range(330):
        actions = press.controller(observations)
        expected = single.step(actions)
        results = many.step(actions)
        for ours, theirs in zip(results[:4], expected[:4]):
            assert np.array_equal(ours, theirs)
        observations = results[0]
        ended += results[2]
    # Each has come to its end, and has begun again.
    assert (ended >= 1).all()
