"""Memory of long runs: a million steps take no more than a hundred thousand."""

import subprocess
import sys

import pytest

#: Growth of the resident memory that is noise [kB].
NOISE = 1024

#: A small cube under a finger, alone in a process; prints its resident memory [kB] after 10⁵ and 10⁶ steps.
LONG_RUN = """
import numpy as np
import palpate

def resident():
    with open("/proc/self/status") as status:
        return next(int(line.split()[1]) for line in status if line.startswith("VmRSS:"))

cube = palpate.record("box:0.1x0.1x0.1/1x1x1", young=2e4, poisson=0.3, density=1000, rayleigh=(2, 2e-4), modes=6, order=1)
floor = palpate.Plane(point=[0, 0, -0.05], normal=[0, 0, 1])
finger = palpate.Device("finger", tip_radius=0.01, friction=0.5)
scene = palpate.Scene([palpate.Object("cube", cube)], planes=[floor], devices=[finger], gravity=[0, 0, -9.81])
simulation = palpate.Simulation(scene)
hand = np.array([[0, 0, 0.065]])
touched, done = 0, 0
for steps in [100_000, 1_000_000]:
    while done < steps:
        # It presses some millimetres deep and leaves, once in 0.1 s.
        hand[0, 2] = 0.060 - 0.008 * np.sin(np.pi * (done % 100) / 100)
        touched += simulation.step(hand)[0, 2] > 0.01
        done += 1
        if done % 1000 == 0:
            simulation.contacts, simulation.poses, simulation.energy, simulation.snapshot()
    print(resident(), touched)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="the resident memory is read from Linux' /proc")
def test_a_million_steps_take_no_memory():
    done = subprocess.run([sys.executable, "-c", LONG_RUN], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (few, _), (many, touched) = [tuple(map(int, line.split())) for line in done.stdout.splitlines()]
    assert touched > 100_000, "the finger touches"
    assert many < few + NOISE, f"{few} kB after 10⁵ steps, {many} kB after 10⁶"
