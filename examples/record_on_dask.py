#!/usr/bin/env python3
"""Record one store of impulse responses on many machines with Dask.

    python record_on_dask.py -- palpate record cube.msh ... --dense OUT.zarr
    python record_on_dask.py --scheduler tcp://10.0.0.5:8786 -- palpate record ... --dense s3://bucket/OUT.zarr

Each task is the given command with `--shard K/N`. A shard is written at once or not at all, and an existing shard is
kept. So a task of a lost worker is repeated on another one, and this script can be stopped and started again. Every
worker needs `palpate`, the mesh, and the store under the same address: the full path of a shared folder, or s3://.

A cluster that Slurm starts (pip install dask-jobqueue); give its `cluster.scheduler_address` as --scheduler:
    from dask_jobqueue import SLURMCluster
    cluster = SLURMCluster(queue="normal", cores=8, processes=1, memory="32GB", walltime="04:00:00")
    cluster.scale(jobs=16)
On Kubernetes (pip install dask-kubernetes, with the Dask operator; an image that holds palpate); the same again:
    from dask_kubernetes.operator import KubeCluster
    cluster = KubeCluster(name="palpate", image="registry/dask-palpate", n_workers=16, env={"AWS_REGION": "eu-west-1"})
    # s3:// needs AWS_ACCESS_KEY_ID and so on in the workers' environment; end with cluster.close()
"""

import argparse
import contextlib
import json
import logging
import os
import subprocess
import sys
import time

import dask
from dask.distributed import Client, KilledWorker, LocalCluster, as_completed

# Number of retries of a failed command.
RETRIES = 2

# Number of workers that a task may lose before it is given up.
DEATHS = 5


def run(command):
    """Output of the command on a worker; raises its error text."""
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True)
    except OSError as error:
        raise RuntimeError(f"cannot start {command[0]} on a worker: {error}") from None
    if done.returncode != 0:
        raise RuntimeError(f"{' '.join(command)}\nended with status {done.returncode}\n{done.stderr.strip()}")
    return done.stdout


def place_of_store(command):
    """Address after --dense."""
    if any(word.partition("=")[0] == "--shard" for word in command):
        raise SystemExit("the command has a --shard already; leave it out, this script adds its own")
    for word, following in zip(command, [*command[1:], ""]):
        if word.partition("=")[0] == "--dense":
            return word.partition("=")[2] or following
    raise SystemExit("the command has no --dense OUT.zarr, so that there is no table to share the work of")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a running Dask cluster (one is started here)")
    parser.add_argument("--workers", type=int, default=2, help="worker processes of the cluster started here (2)")
    parser.add_argument("--parts", type=int, metavar="N", help="tasks to share the work in (4 a worker, at least 8)")
    parser.add_argument("command", nargs="+", help="after --: palpate record ... --dense OUT.zarr")
    arguments = parser.parse_args()
    command, store = arguments.command, place_of_store(arguments.command)

    with contextlib.ExitStack() as stack:
        address = arguments.scheduler
        if address is None:
            os.environ.setdefault("RAYON_NUM_THREADS", str(max(1, (os.cpu_count() or 1) // arguments.workers)))
            dask.config.set({"distributed.scheduler.allowed-failures": DEATHS})
            # Worker processes without a web page; they only wait for palpate, so that their own memory needs no limit.
            cluster = LocalCluster(
                arguments.workers,
                threads_per_worker=1,
                memory_limit=0,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
            address = stack.enter_context(cluster)
        client = stack.enter_context(Client(address))
        parts = arguments.parts or max(8, 4 * len(client.nthreads()))
        start = time.monotonic()
        tasks = [[*command, "--shard", f"{k}/{parts}"] for k in range(1, parts + 1)]
        futures = client.map(run, tasks, pure=False, retries=RETRIES)
        try:
            for done, future in enumerate(as_completed(futures), 1):
                future.result()
                print(f"{done} of {parts} parts, {time.monotonic() - start:.1f} s", file=sys.stderr)
            found = json.loads(client.submit(run, [command[0], "inspect", store, "--json"], pure=False).result())
        except KilledWorker as error:
            client.cancel(futures)
            raise SystemExit(f"a part was given up because its workers died, perhaps for want of memory: {error}")
        except RuntimeError as error:
            client.cancel(futures)
            raise SystemExit(str(error))
    total, missing, damaged = found["shards_total"], found["shards_missing"], found["shards_damaged"]
    if missing or damaged:
        raise SystemExit(f"{store} is not whole: of {total} shards {missing} are missing and {damaged} damaged")
    print(f"{store}: all {total} shards are there", file=sys.stderr)


if __name__ == "__main__":
    main()
