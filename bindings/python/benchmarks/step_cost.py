"""Cost of a step from Python beside that of the same step in Rust, import time, and cost of the looks at a state.

    target/python-tests/bin/python bindings/python/benchmarks/step_cost.py

Blocks of steps by `step` and by `run`, which steps in Rust and keeps all series, take turns over the same motions from the same state, so that
whatever else the machine does meets both alike. The step in Rust is that of `run`: it is dearer than the bare step by what the series cost.
"""

import statistics
import subprocess
import sys
import time

import numpy as np
import palpate

BLOCK = 2000
ROUNDS = 15


def scenes(cube):
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [0.05, 0, 0]})
    held = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)], devices=[hand]))
    move = 0.002 * np.sin(np.arange(BLOCK) * 0.02)[:, None, None]
    yield "one held point", held, held.held_points() + move * np.array([1.0, 0, 0])
    finger = palpate.Device("finger", tip_radius=0.005, patch_radius=0.03, coupling={"stiffness": 500, "damping": 1})
    fixed = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube, position=[0, 0, 0])], devices=[finger]))
    yield "a tip that touches nothing", fixed, np.array([0, 0, 0.2]) + move * np.array([1.0, 0, 0])


def microseconds(call):
    start = time.perf_counter()
    call()
    return (time.perf_counter() - start) / BLOCK * 1e6


def block_of_steps(simulation, motions):
    step = simulation.step
    for hand in motions:
        step(hand)


def main():
    cube = palpate.record("box:0.1x0.1x0.1/6x6x6", material="paper", modes=100)
    for name, simulation, motions in scenes(cube):
        start = simulation.snapshot()
        from_python, in_rust = [], []
        for _ in range(ROUNDS):
            simulation.restore(start)
            from_python.append(microseconds(lambda: block_of_steps(simulation, motions)))
            simulation.restore(start)
            in_rust.append(microseconds(lambda: simulation.run(motions)))
        more = statistics.median(a - b for a, b in zip(from_python, in_rust))
        python, rust = statistics.median(from_python), statistics.median(in_rust)
        print(f"{name}: step from Python {python:.2f} µs, in Rust {rust:.2f} µs, more {more:.2f} µs (medians of {ROUNDS} blocks of {BLOCK})")
    loops = {
        "contacts": lambda: simulation.contacts,
        "poses": lambda: simulation.poses,
        "energy": lambda: simulation.energy,
        "surface": lambda: simulation.surface("cube"),
        "snapshot": simulation.snapshot,
    }
    for name, look in loops.items():
        many = 200 if name in ("surface", "snapshot") else BLOCK
        took = microseconds(lambda look=look, many=many: [look() for _ in range(many)]) * BLOCK / many
        print(f"{name}: {took:.2f} µs")
    for modules in ["numpy", "numpy, palpate"]:
        code = f"import time; t = time.perf_counter(); import {modules}; print(time.perf_counter() - t)"
        times = [float(subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout) for _ in range(9)]
        print(f"import {modules}: {statistics.median(times) * 1e3:.1f} ms (median of {len(times)})")


if __name__ == "__main__":
    main()
