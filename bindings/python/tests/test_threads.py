"""Interrupts, threads and memory."""

import os
import signal
import threading
import tracemalloc

import numpy as np
import palpate
import pytest


@pytest.fixture
def ctrl_c():
    """Ctrl-C as at a terminal: a process in the background of a shell starts with it ignored."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    signal.signal(signal.SIGINT, before)


def interrupt_when(event):
    """Thread that presses Ctrl-C when an event has come."""

    def press():
        event.wait()
        os.kill(os.getpid(), signal.SIGINT)

    thread = threading.Thread(target=press, daemon=True)
    thread.start()
    return thread


def test_ctrl_c_ends_a_recording(ctrl_c):
    begun = threading.Event()
    # Some seconds of work, of which the progress tells as soon as it begins.
    interrupt_when(begun)
    with pytest.raises(KeyboardInterrupt):
        palpate.record(
            "box:0.1x0.1x0.1/12x12x12", young=2e4, poisson=0.45, density=1000, modes=300, order=1, progress=lambda *_: begun.set()
        )


def test_ctrl_c_ends_a_run_where_it_is(held, ctrl_c):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()
    time = np.arange(0, 20, held.step)
    moved = hand + 0.01 * np.sin(time)[:, None, None] * np.array([1, 0, 0])
    begun = threading.Event()
    interrupt_when(begun)
    with pytest.raises(KeyboardInterrupt) as caught:
        for _ in range(1000):
            begun.set()
            simulation.run(moved)
            simulation.reset()
    stopped = simulation.time
    # The series of the steps that were made is in the exception; none if it came between two runs.
    if hasattr(caught.value, "series"):
        series = caught.value.series
        assert 0 < len(series["time"]) < len(moved) and series["time"][-1] == stopped
        assert np.array_equal(series["forces"][-1], simulation.forces)
        again = simulation.copy()
        again.reset()
        assert np.array_equal(again.run(moved[: len(series["time"])])["poses"], series["poses"])
    simulation.step(hand)
    assert simulation.time == pytest.approx(stopped + held.step)


def test_an_exception_of_the_progress_ends_the_recording():
    def progress(stage, share):
        raise LookupError(stage)

    with pytest.raises(LookupError):
        palpate.record("box:0.1x0.1x0.1/4x4x4", material="paper", modes=10, progress=progress)


def test_a_simulation_that_another_thread_runs_is_an_exception(held):
    simulation = palpate.Simulation(held)
    motions = np.tile(simulation.held_points(), (20_000, 1, 1))
    seen = []
    done = threading.Event()

    def run():
        try:
            simulation.run(motions)
        finally:
            done.set()

    # Repeated until both have met: the threads are not in step.
    for _ in range(100):
        done.clear()
        thread = threading.Thread(target=run)
        thread.start()
        while not done.is_set() and not seen:
            try:
                simulation.step(motions[0])
            except palpate.PalpateError as error:
                seen.append(str(error))
        thread.join()
        if seen:
            break
    assert "in use by another thread: wait for its run to end, or give each thread a copy()" in seen[0]
    # It goes on afterwards.
    simulation.step(motions[0])


def test_two_threads_that_step_one_simulation_never_crash(held):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()
    counts = [0, 0]

    def step(at):
        for _ in range(5000):
            try:
                simulation.step(hand)
                counts[at] += 1
            except palpate.PalpateError:
                pass

    threads = [threading.Thread(target=step, args=(at,)) for at in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert round(simulation.time / held.step) == sum(counts) > 0


def test_threads_with_copies_get_the_same_numbers(held):
    simulation = palpate.Simulation(held)
    time = np.arange(2000)[:, None, None] * held.step
    motions = simulation.held_points() + 0.005 * np.sin(30 * time) * np.array([0.0, 1, 0])
    expected = simulation.copy().run(motions)["forces"]
    results = [None] * 4

    def run(at):
        results[at] = simulation.copy().run(motions)["forces"]

    threads = [threading.Thread(target=run, args=(at,)) for at in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert all(np.array_equal(forces, expected) for forces in results)


def test_an_argument_that_steps_the_simulation_itself_is_an_exception(held):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()

    class Sly:
        def __array__(self, dtype=None, copy=None):
            return simulation.step(hand)

    with pytest.raises(palpate.PalpateError, match="in use by another thread"):
        simulation.step(Sly())
    simulation.step(hand)


def resident_bytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="the resident memory is read from /proc")
def test_memory_does_not_grow_over_a_hundred_thousand_steps(on_floor, held):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()
    rest = hand.copy()

    def steps(count):
        for number in range(count):
            hand[0, 0] = rest[0, 0] + 1e-3 * np.sin(0.01 * number)
            simulation.step(hand)

    steps(10_000)
    tracemalloc.start()
    steps(10)
    python, before = tracemalloc.get_traced_memory()[0], resident_bytes()
    steps(100_000)
    python_grown, grown = tracemalloc.get_traced_memory()[0] - python, resident_bytes() - before
    tracemalloc.stop()
    # A number of eight bytes that each step kept would be 0.8 MB; an array is a hundred bytes and more.
    assert python_grown < 10_000 and grown < 600_000

    # Contacts, poses and energies are made when they are asked for, and freed.
    falling = palpate.Simulation(on_floor)
    falling.run(duration=0.5)

    def looks(count):
        for _ in range(count):
            falling.contacts, falling.poses, falling.energy, falling.surface("cube"), falling.snapshot()

    looks(200)
    before = resident_bytes()
    looks(2000)
    # A surface alone is 2.4 kB: 4.7 MB, if it were kept.
    assert resident_bytes() - before < 2_000_000
