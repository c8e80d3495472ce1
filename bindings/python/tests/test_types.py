"""Types: the stub file says what the extension module has, and the package passes mypy --strict."""

import importlib.util
import inspect
import pathlib
import subprocess
import sys

import palpate
import pytest

pytest.importorskip("mypy")
PACKAGE = pathlib.Path(palpate.__file__).parent
EXAMPLE = """
import numpy as np
import palpate
from numpy.typing import NDArray

recording: palpate.Recording = palpate.record("box:1x1x1/2x2x2", young=1e4, poisson=0.3, density=1e3, order=1)
scene = palpate.Scene([palpate.Object("cube", recording, position=[0, 0, 1])], gravity=(0, 0, -9.81))
simulation = palpate.Simulation(scene)
forces: NDArray[np.float64] = simulation.step()
mass: float = recording.mass
"""


def run(*arguments, folder):
    done = subprocess.run([sys.executable, "-m", *map(str, arguments)], capture_output=True, text=True, cwd=folder, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def test_the_stub_is_what_the_module_has(tmp_path):
    run("mypy.stubtest", "palpate._palpate", folder=tmp_path)


def test_the_package_and_its_use_are_strictly_typed(tmp_path):
    run("mypy", "--strict", "--package", "palpate", folder=tmp_path)
    (tmp_path / "good.py").write_text(EXAMPLE)
    run("mypy", "--strict", "good.py", folder=tmp_path)
    (tmp_path / "bad.py").write_text(EXAMPLE.replace("mass: float", "mass: str"))
    with pytest.raises(AssertionError, match="Incompatible types in assignment"):
        run("mypy", "--strict", "bad.py", folder=tmp_path)


def test_all_that_is_public_is_documented():
    assert importlib.util.find_spec("palpate") and (PACKAGE / "py.typed").exists()
    for name in palpate.__all__:
        thing = getattr(palpate, name)
        if name == "__version__":
            continue
        assert thing.__doc__, name
        for member, value in inspect.getmembers(thing):
            is_own = callable(value) or isinstance(value, property) or inspect.isgetsetdescriptor(value)
            if not member.startswith("_") and is_own and "palpate" in str(getattr(thing, "__module__", "")):
                inherited = isinstance(thing, type) and issubclass(thing, Exception)
                assert inherited or value.__doc__, f"{name}.{member}"
