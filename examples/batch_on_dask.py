#!/usr/bin/env python3
"""Press one body at many places, on many machines with Dask: forces over time of each press.

    python batch_on_dask.py body.palp -o forces.npz --presses 1000
    python batch_on_dask.py --scheduler tcp://10.0.0.5:8786 /shared/body.palp -o forces.npz --presses 100000

Each task is a batch of presses (palpate.Batch), and depends on nothing but the recording and the seed: that of a lost worker is repeated on another
one, with the same numbers to the bit, as on any number of machines. Every worker needs palpate, and the recording under the same path.
`forces.npz` holds the places, depths [m] and forces on the finger [N, world]: (presses, 3), (presses,), (presses, steps, 3).
How to start a cluster on Slurm or Kubernetes: see record_on_dask.py.
"""

import argparse
import contextlib
import logging
import os
import sys
import time

import dask
import numpy as np
from dask.distributed import Client, KilledWorker, LocalCluster, as_completed

# Number of workers that a task may lose before it is given up.
DEATHS = 5

# Radius of the fingertip, distance that it comes from, and deepest press, as shares of the body's size.
TIP, AWAY, DEEPEST = 0.05, 0.02, 0.05

# Steps of 1 ms of a press.
STEPS = 300


def press(path, seed, first, count, threads):
    """Places, depths and forces of some presses, of which each has a random generator of its own."""
    # Here, so that only workers need it.
    import palpate

    body = palpate.Recording.open(path)
    size = np.ptp(body.positions, axis=0).max()
    finger = palpate.Device("finger", tip_radius=TIP * size, patch_radius=2 * TIP * size, coupling={"stiffness": 1000, "damping": 2})
    scene = palpate.Scene([palpate.Object("body", body)], devices=[finger])
    corners = body.positions[body.triangles]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    places, directions, depths = np.zeros((count, 3)), np.zeros((count, 3)), np.zeros(count)
    for row in range(count):
        random = np.random.default_rng([seed, first + row])
        triangle = random.integers(len(corners))
        places[row], depths[row] = corners[triangle].mean(axis=0), size * DEEPEST * random.uniform(0.2, 1)
        directions[row] = normals[triangle] / np.linalg.norm(normals[triangle])
    batch, forces = palpate.Batch(scene, count, threads=threads), np.zeros((count, STEPS, 3))
    for step in range(STEPS):
        inwards = (AWAY * size + depths) * np.sin(np.pi * (step + 1) / STEPS) ** 2
        hands = places + directions * (TIP * size + AWAY * size - inwards)[:, None]
        forces[:, step] = batch.step(hands[:, None])[:, 0]
    return places, depths, forces


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("recording", metavar="BODY.palp", help="recording of a body with fixed nodes, or free")
    parser.add_argument("-o", "--output", metavar="FORCES.npz", required=True)
    parser.add_argument("--presses", type=int, default=100, help="number of presses (100)")
    parser.add_argument("--seed", type=int, default=0, help="of places and depths (0)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="of a running Dask cluster (one is started here)")
    parser.add_argument("--workers", type=int, default=2, help="worker processes of the cluster started here (2)")
    parser.add_argument("--threads", type=int, default=1, help="threads of a worker (1)")
    parser.add_argument("--parts", type=int, metavar="N", help="tasks to share the work in (4 a worker, at least 8)")
    arguments = parser.parse_args()
    path = os.path.abspath(arguments.recording)

    with contextlib.ExitStack() as stack:
        address = arguments.scheduler
        if address is None:
            dask.config.set({"distributed.scheduler.allowed-failures": DEATHS})
            # Worker processes without a web page.
            cluster = LocalCluster(
                arguments.workers,
                threads_per_worker=1,
                memory_limit=0,
                dashboard_address=None,
                silence_logs=logging.CRITICAL,
            )
            address = stack.enter_context(cluster)
        client = stack.enter_context(Client(address))
        parts = min(arguments.parts or max(8, 4 * len(client.nthreads())), arguments.presses)
        bounds = np.linspace(0, arguments.presses, parts + 1).astype(int).tolist()
        start = time.monotonic()
        futures = [
            client.submit(press, path, arguments.seed, first, end - first, arguments.threads, pure=False)
            for first, end in zip(bounds, bounds[1:])
        ]
        # Kept here as they come: what a lost worker had done is not done again.
        results = {}
        try:
            for future, result in as_completed(futures, with_results=True):
                results[future.key] = result
                future.release()
                print(f"{len(results)} of {parts} parts, {time.monotonic() - start:.1f} s", file=sys.stderr)
        except KilledWorker as error:
            client.cancel(futures)
            raise SystemExit(f"a part was given up because its workers died, perhaps for want of memory: {error}")
        # Of the recording or of a press, as a worker met it.
        except Exception as error:
            client.cancel(futures)
            raise SystemExit(f"{type(error).__name__} on a worker: {error}")
    ordered = [results[future.key] for future in futures]
    places, depths, forces = (np.concatenate(part) for part in zip(*ordered))
    # By another name until it is whole.
    partly = f"{arguments.output}.part"
    with open(partly, "wb") as file:
        np.savez(file, places=places, depths=depths, forces=forces)
    os.replace(partly, arguments.output)
    print(f"{arguments.output}: {arguments.presses} presses, up to {np.linalg.norm(forces, axis=2).max():.3f} N", file=sys.stderr)


if __name__ == "__main__":
    main()
