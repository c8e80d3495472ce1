"""Stores that several processes wrote together, as `examples/record_on_*` do: the bytes are those of one process."""

import os
import signal
import subprocess
import sys
import time

import psutil
import pytest
from test_store import BODY, EXAMPLES, hashes, inspect, palpate, record, run

# Some seconds of work in 49 shards of few bytes.
OPTIONS = ["--method", "transient", "--duration", "0.05", "--columns-per-shard", "6"]


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory):
    """Hashes of the store that one process wrote."""
    place = tmp_path_factory.mktemp("undisturbed") / "cube.zarr"
    record(place, *OPTIONS)
    return hashes(place)


# A palpate that halts at the start of parts 4 and 7, the first time that each is begun.
HALTING = """#!/bin/sh
case "$*" in
*"--shard 4/12"*) part=4 ;;
*"--shard 7/12"*) part=7 ;;
*) part= ;;
esac
if [ -n "$part" ] && mkdir "{place}/begun-$part" 2>/dev/null; then
    echo $$ >"{place}/writing-$part" && mv "{place}/writing-$part" "{place}/halted-$part"
    kill -STOP $$
fi
exec "{palpate}" "$@"
"""


def on_dask(*command, parts=12):
    """The example with a cluster of two workers, its text as it comes."""
    words = [sys.executable, EXAMPLES / "record_on_dask.py", "--workers", 2, "--parts", parts, "--", *command]
    return subprocess.Popen([str(w) for w in words], stderr=subprocess.PIPE, text=True)


def halted(place, part):
    """The process of a part, once it has halted."""
    file = place / f"halted-{part}"
    for _ in range(6000):
        if file.exists() and (process := psutil.Process(int(file.read_text()))).status() == psutil.STATUS_STOPPED:
            return process
        time.sleep(0.01)
    raise AssertionError(f"part {part} did not begin within a minute")


def test_two_workers_of_which_some_are_killed_write_the_bytes_of_one_process(tmp_path, undisturbed):
    place, halting = tmp_path / "cube.zarr", tmp_path / "palpate"
    halting.write_text(HALTING.format(place=tmp_path, palpate=palpate()))
    halting.chmod(0o755)
    killed = []
    with on_dask(halting, "record", *BODY, *OPTIONS, "--dense", place) as script:
        # First a worker whose palpate runs on, then a machine that is lost with all that ran on it.
        for part, end in (4, signal.SIGCONT), (7, signal.SIGKILL):
            at_work = halted(tmp_path, part)
            worker = at_work.parent()
            worker.send_signal(signal.SIGKILL)
            at_work.send_signal(end)
            psutil.wait_procs([worker, at_work], timeout=20)
            killed.append(worker)
        text = script.stderr.read()
    assert script.returncode == 0, text
    assert len(set(killed)) == 2 and not any(worker.is_running() for worker in killed)
    assert f"{place}: all 49 shards are there" in text
    assert hashes(place) == undisturbed


def test_the_text_of_a_command_that_fails_reaches_the_user(tmp_path):
    command = [palpate(), "record", *BODY, *OPTIONS, "--dense", tmp_path / "cube.zarr", "--touchable", "x>1"]
    with on_dask(*command, parts=2) as script:
        text = script.stderr.read()
    alone = subprocess.run([str(w) for w in command], capture_output=True, text=True)
    assert alone.returncode == 1 and alone.stderr.startswith("error: ")
    assert script.returncode == 1
    assert "ended with status 1" in text and alone.stderr.strip() in text


def test_the_slurm_script_run_by_hand_completes_a_store(tmp_path, undisturbed):
    place = tmp_path / "cube.zarr"
    env = dict(PALPATE=palpate(), STORE=str(place), BODY=" ".join([*BODY, *OPTIONS[2:]]), SLURM_ARRAY_TASK_COUNT="3")
    done = []
    for task in (1, 2, 3):
        run(EXAMPLES / "record_on_slurm.sh", env={**env, "SLURM_ARRAY_TASK_ID": str(task)})
        done.append(inspect(place)["shards_done"])
    # Shards 1, 4, … 46; 2, 5, … 47; and 0, 3, … 48.
    assert done == [16, 32, 49]
    assert hashes(place) == undisturbed


def test_the_slurm_script_says_which_variable_is_missing():
    env = {name: value for name, value in os.environ.items() if name != "STORE"}
    done = subprocess.run([EXAMPLES / "record_on_slurm.sh"], capture_output=True, text=True, env=env)
    assert done.returncode != 0
    assert "STORE: set STORE to the store to write" in done.stderr
