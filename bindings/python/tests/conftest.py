"""Fixtures: a small cube, its file, scenes of it, and the command line that the numbers are compared with.

The binary is what PALPATE names: PALPATE=target/release/palpate pytest bindings/python/tests
"""

import os
import subprocess

import numpy as np
import palpate
import pytest

SIDE = 0.1  # m


def pytest_configure(config):
    # Remarks on coarse meshes are meant; tests of warnings catch them.
    config.addinivalue_line("filterwarnings", "ignore::palpate.PalpateWarning")


@pytest.fixture(scope="session")
def cube():
    """Free cube of 4³ cells in linear elements, damped."""
    return palpate.record(
        "box:0.1x0.1x0.1/4x4x4", young=2e4, poisson=0.45, density=1000, rayleigh=(2, 2e-4), modes=40, order=1, precision="full"
    )


@pytest.fixture
def folder(tmp_path, cube):
    """Folder with cube.palp."""
    cube.save(tmp_path / "cube.palp")
    return tmp_path


@pytest.fixture
def held(cube):
    """Scene of a cube that a hand holds."""
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [SIDE / 2, 0, 0]})
    return palpate.Scene([palpate.Object("cube", cube)], devices=[hand])


@pytest.fixture
def on_floor(cube):
    """Scene of a cube on a floor, under its weight."""
    floor = palpate.Plane(name="floor", point=[0, 0, -SIDE / 2], normal=[0, 0, 1])
    return palpate.Scene([palpate.Object("cube", cube)], planes=[floor], gravity=[0, 0, -9.81])


@pytest.fixture(scope="session")
def palpate_run():
    """Function that runs the command line's `palpate`."""

    def run(*arguments):
        program = os.environ.get("PALPATE", "palpate")
        done = subprocess.run([program, *map(str, arguments)], capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture
def press():
    """Positions of a hand that presses 4 mm down onto the cube and slides, and comes back: (steps, 1, 3)."""
    time = np.arange(1, 401) * 1e-3
    hand = np.zeros((len(time), 1, 3))
    hand[:, 0, 0] = 0.004 * np.sin(3 * np.pi * time)
    hand[:, 0, 2] = SIDE / 2 + 0.006 - 0.01 * np.sin(np.pi * time / 0.4) ** 2
    return hand
