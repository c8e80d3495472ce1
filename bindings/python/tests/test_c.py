"""The same press in C and in Python, number by number; `bindings/c/tests` compares C and Rust likewise."""

import os
import pathlib
import shutil
import subprocess

import numpy as np
import palpate
import pytest

ROOT = pathlib.Path(__file__).parents[3]
STEPS = 400
#: Limits that are the same in real time, which the program in C asks for, and offline.
LIMITS = "max_contact_samples = 48\nsolver_budget = 1_000_000_000\n"


def test_the_same_press_in_c_and_python_has_the_same_numbers(tmp_path):
    # Beside the binaries of the tests: `cargo test --release --workspace --no-run`.
    library = pathlib.Path(os.environ.get("PALPATE", "palpate")).resolve().parent / "deps/libpalpate_c.so"
    if not library.exists() or shutil.which("cc") is None:
        pytest.skip(f"there is no {library}, or no C compiler")
    example = ROOT / "bindings/c/examples"
    (tmp_path / "press.toml").write_text(LIMITS + (example / "press.toml").read_text())
    shutil.copy(ROOT / "data/recordings/v1/free.palp", tmp_path / "cube.palp")
    linked = [str(library), f"-Wl,-rpath,{library.parent}"]
    subprocess.run(["cc", example / "press.c", "-I", ROOT / "bindings/c/include", *linked, "-o", tmp_path / "press"], check=True)
    printed = subprocess.run([tmp_path / "press", "press.toml", str(STEPS), "1"], cwd=tmp_path, capture_output=True, text=True, check=True)
    in_c = np.array([line.split() for line in printed.stdout.splitlines()], float)

    scene = palpate.Scene.load(tmp_path / "press.toml")
    simulation = palpate.Simulation(scene)
    in_python = []
    for i in range(1, STEPS + 1):
        t = i % 200 * scene.step
        depth = 0.14 * (t if t < 0.1 else 0.2 - t)
        force = simulation.step([[0, 0, 0.115 - depth]])[0]
        in_python.append([i, *force, len(simulation.contacts)])
    assert np.array_equal(in_c, in_python) and in_c[:, 3].max() > 0.05
