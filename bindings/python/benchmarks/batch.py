"""Steps per second of a batch of 1,000 scenes, by the number of threads; with `step`, and with `run` of 16 steps at a time.

    target/python-tests/bin/python bindings/python/benchmarks/batch.py [ROWS [SECONDS [SCENES]]]

In each scene a finger touches a block whose lower side is glued, each at another place and depth: it presses up and down, or slides as well. Short
blocks of steps on each number of threads take turns for some seconds, so that whatever else the machine does meets all alike. The quietest block says
what the machine can; the time of the processors, which waits for nobody, what a scene and step costs.
"""

import os
import sys
import time
import warnings

import numpy as np
import palpate

SECONDS = 20
BLOCK = 16

BODY = {"young": 2e4, "poisson": 0.45, "density": 1000, "rayleigh": (2, 2e-4), "modes": 100}
FINGER = palpate.Device("finger", tip_radius=0.005, patch_radius=0.03, coupling={"stiffness": 2000, "damping": 2})


def scenes():
    block = palpate.record("box:0.1x0.1x0.1/6x6x6", fix="z<-0.0499", **BODY)
    glued = palpate.Scene([palpate.Object("block", block)], devices=[FINGER])
    yield "glued block, pressed", glued, 0.0
    yield "glued block, pressed and slid over at 0.1 m/s", glued, 0.01


def hands_at(step, rows, slide):
    """Fingers that press 2 to 4 mm deep, each differently, and slide to and fro."""
    phase = np.linspace(0, 2 * np.pi, rows, endpoint=False)
    hands = np.zeros((rows, 1, 3))
    hands[:, 0, 0] = 0.02 * np.sin(phase) + slide * np.sin(0.01 * step + phase)
    hands[:, 0, 2] = 0.055 - min(step / 40, 1) * (0.003 + 0.001 * np.sin(0.02 * step + phase))
    return hands


def block_of_steps(batch, motions):
    for hands in motions:
        batch.step(hands)


def main():
    rows = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    seconds = float(sys.argv[2]) if len(sys.argv) > 2 else SECONDS
    most = int(sys.argv[3]) if len(sys.argv) > 3 else 2
    warnings.simplefilter("ignore", palpate.PalpateWarning)
    ways = {"step": block_of_steps, "run": lambda batch, motions: batch.run(motions)}
    counts = sorted({1, len(os.sched_getaffinity(0))})
    for name, scene, slide in list(scenes())[:most]:
        batches = {(way, count): palpate.Batch(scene, rows, threads=count) for way in ways for count in counts}
        wall, processors = {key: [] for key in batches}, {key: [] for key in batches}
        end, done = time.monotonic() + seconds, 0
        # The first blocks bring the fingers down.
        while time.monotonic() < end or done < 5 * BLOCK:
            motions = np.array([hands_at(done + at, rows, slide) for at in range(BLOCK)])
            for (way, count), batch in batches.items():
                start, used = time.perf_counter(), time.process_time()
                ways[way](batch, motions)
                if done >= 3 * BLOCK:
                    wall[way, count].append((time.perf_counter() - start) / BLOCK)
                    processors[way, count].append((time.process_time() - used) / BLOCK)
            done += BLOCK
        first = next(iter(batches.values()))
        assert all(np.array_equal(first.forces, batch.forces) for batch in batches.values())
        touching = np.count_nonzero(first.forces[:, 0, 2] > 0)
        nodes = len(scene.rest_positions(0))
        print(f"{name}: {rows} scenes, {touching} fingers touch, {nodes} nodes, {BODY['modes']} modes")
        for (way, count), times in wall.items():
            times.sort()
            least = min(processors[way, count])
            print(
                f"  {way} on {count} thread{'s' if count > 1 else ''}: {1 / times[0]:.0f} steps/s in the quietest of {len(times)} blocks,"
                f" {1 / times[len(times) // 2]:.0f} in the median; {1e6 * least / rows:.1f} µs of a processor for a scene and step",
                flush=True,
            )


if __name__ == "__main__":
    main()
