"""examples/batch_on_dask.py on a local cluster of which a worker is killed: the numbers are those of one process, to the bit."""

import importlib.util
import os
import pathlib
import signal
import subprocess
import sys

import numpy as np
import palpate
import psutil
import pytest

pytest.importorskip("dask.distributed")
FILE = pathlib.Path(__file__).parents[3] / "examples" / "batch_on_dask.py"
PRESSES = 800
PARTS = 40


@pytest.fixture(scope="module")
def body(tmp_path_factory):
    """File of a ball that is held at its lower end."""
    place = tmp_path_factory.mktemp("dask") / "ball.palp"
    ball = palpate.record("sphere:0.05/4", material="liver", damping_ratio=0.2, modes=30, order=1, fix="z<-0.035")
    ball.save(place)
    return place


@pytest.fixture(scope="module")
def alone(body):
    """Places, depths and forces of all presses, in this process."""
    spec = importlib.util.spec_from_file_location("batch_on_dask", FILE)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.press(str(body), 7, 0, PRESSES, None)


def on_dask(body, output, *options):
    words = [sys.executable, FILE, body, "-o", output, "--presses", PRESSES, "--parts", PARTS, "--seed", 7, *options]
    # Remarks on the coarse ball are meant.
    env = {**os.environ, "PYTHONWARNINGS": "ignore::UserWarning"}
    return subprocess.Popen([str(word) for word in words], stderr=subprocess.PIPE, text=True, env=env)


def test_presses_of_a_cluster_of_which_a_worker_is_killed_are_those_of_one_process(body, alone, tmp_path):
    output = tmp_path / "forces.npz"
    with on_dask(body, output) as script:
        lines = [script.stderr.readline() for _ in range(PARTS // 5)]
        assert lines[-1].startswith(f"{PARTS // 5} of {PARTS} parts, "), "".join(lines)
        children = psutil.Process(script.pid).children()
        worker = next(child for child in children if "spawn_main" in " ".join(child.cmdline()))
        worker.send_signal(signal.SIGKILL)
        psutil.wait_procs([worker], timeout=20)
        assert not worker.is_running() and script.poll() is None and not output.exists()
        text = script.stderr.read()
    assert script.returncode == 0, text
    assert f"{PARTS} of {PARTS} parts" in text
    found = np.load(output)
    for name, expected in zip(["places", "depths", "forces"], alone):
        assert np.array_equal(found[name], expected), name
    # All presses are felt, at the end of none.
    strength = np.linalg.norm(found["forces"], axis=2)
    assert found["forces"].shape[0] == PRESSES and (strength.max(axis=1) > 1e-3).mean() > 0.95 and not strength[:, -1].any()


def test_an_error_of_a_worker_reaches_the_user(tmp_path):
    (tmp_path / "bad.palp").write_bytes(b"no recording")
    with on_dask(tmp_path / "bad.palp", tmp_path / "forces.npz", "--workers", 1) as script:
        text = script.stderr.read()
    assert script.returncode == 1 and "RecordingError on a worker: " in text and "bad.palp" in text
