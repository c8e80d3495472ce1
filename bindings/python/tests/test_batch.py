"""Batches: the numbers of single simulations to the bit, whatever the number of threads; rows that fail, go back or differ."""

import multiprocessing
import os
import signal
import threading

import numpy as np
import palpate
import pytest

SIDE = 0.1  # m
ROWS = 5
STEPS = 120


@pytest.fixture(scope="module")
def pressed(cube):
    """Scene of a cube on a floor that a finger touches, with a tool that the caller moves."""
    return palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -SIDE / 2], normal=[0, 0, 1])],
        obstacles=[palpate.Obstacle(name="tool", sphere={"radius": 0.02}, position=[0.2, 0, 0])],
        devices=[palpate.Device("finger", tip_radius=0.005, patch_radius=0.04, coupling={"stiffness": 2000.0, "damping": 2.0})],
        gravity=[0, 0, -9.81],
        max_contact_points=60,
    )


@pytest.fixture(scope="module")
def presses():
    """Positions of fingers that press each at its own place and depth, (steps, rows, 1, 3), and poses of the tools, (steps, rows, 2, 7)."""
    time = np.arange(1, STEPS + 1)[:, None] * 1e-3
    row = np.arange(ROWS)
    hands = np.zeros((STEPS, ROWS, 1, 3))
    hands[:, :, 0, 0] = 0.004 * (row - 2)
    hands[:, :, 0, 2] = SIDE / 2 + 0.006 - (0.006 + 0.001 * row) * np.sin(np.pi * time / 0.12) ** 2
    tools = np.zeros((STEPS, ROWS, 2, 7))
    tools[..., 3] = 1
    tools[:, :, 0, 2] = -SIDE / 2
    tools[:, :, 1, 0] = 0.2 - (0.1 + 0.01 * row) * np.minimum(time / 0.1, 1)
    return hands, tools


OUTPUTS = ["forces", "proxies", "poses", "velocities", "clamp_loads", "time", "is_asleep"]


def looks(thing):
    return {name: np.copy(getattr(thing, name)) for name in OUTPUTS}


@pytest.fixture(scope="module")
def alone(pressed, presses):
    """Outputs of each row after each step, as a simulation of its own gives them, and its contacts at the end."""
    hands, tools = presses
    simulations = [palpate.Simulation(pressed) for _ in range(ROWS)]
    outputs = []
    for hand, tool in zip(hands, tools):
        for row, simulation in enumerate(simulations):
            simulation.step(hand[row], obstacles=tool[row])
        each = [looks(simulation) for simulation in simulations]
        outputs.append({name: np.stack([own[name] for own in each]) for name in OUTPUTS})
    return outputs, [simulation.contacts for simulation in simulations]


@pytest.mark.parametrize("threads", [1, 2, 3, None])
def test_rows_have_the_bits_of_simulations_whatever_the_number_of_threads(pressed, presses, alone, threads):
    batch = palpate.Batch(pressed, ROWS, threads=threads)
    assert len(batch) == ROWS and batch.scene is pressed and (threads is None or batch.threads == threads)
    expected, contacts = alone
    for step, (hand, tool) in enumerate(zip(*presses)):
        forces = batch.step(hand, obstacles=tool)
        assert forces is batch.forces
        for name, numbers in looks(batch).items():
            assert np.array_equal(numbers, expected[step][name]), (step, name)
    # All felt the finger, and were pushed by the tool, each by its own.
    peaks = np.max([own["forces"][:, 0, 2] for own in expected], axis=0)
    assert (peaks > 0.1).all() and len(set(peaks)) == ROWS and len(set(batch.poses[:, 0, 0])) == ROWS
    for row in range(ROWS):
        own = batch.contacts[batch.contacts["row"] == row]
        assert len(own) == len(contacts[row])
        assert all(np.array_equal(own[name], contacts[row][name]) for name in contacts[row].dtype.names)


def test_arrays_are_the_batchs_own_and_each_step_writes_over_them(pressed, presses):
    batch = palpate.Batch(pressed, ROWS)
    hand = presses[0][0]
    arrays = [getattr(batch, name) for name in OUTPUTS[:-1]]
    first = [array.copy() for array in arrays]
    batch.step(hand)
    assert all(getattr(batch, name) is array for name, array in zip(OUTPUTS, arrays))
    assert not np.array_equal(batch.time, first[5]) and not np.array_equal(batch.poses, first[2])
    batch.forces.setflags(write=False)
    with pytest.raises(palpate.PalpateError, match="it is the batch's own; use a copy"):
        batch.step(hand)


def test_chosen_rows_go_back_to_the_start_or_to_snapshots(pressed, presses):
    hands, tools = presses
    batch = palpate.Batch(pressed, ROWS, threads=2)
    for hand, tool in zip(hands[:60], tools[:60]):
        batch.step(hand, obstacles=tool)
    middle = looks(batch)
    kept = batch.snapshot([3, 1])
    assert [own.time for own in kept] == [0.06, 0.06]
    for hand, tool in zip(hands[60:], tools[60:]):
        batch.step(hand, obstacles=tool)
    end = looks(batch)
    # By numbers, in their order; by a mask; the others stay.
    batch.restore(kept, [3, 1])
    batch.reset(np.array([True, False, False, False, False]))
    assert list(batch.time) == [0, 0.06, end["time"][2], 0.06, end["time"][4]]
    for row in [1, 3]:
        assert all(np.array_equal(getattr(batch, name)[row], middle[name][row]) for name in OUTPUTS)
    for row in [2, 4]:
        assert all(np.array_equal(getattr(batch, name)[row], end[name][row]) for name in OUTPUTS)
    # What comes again is the same to the bit, also in a simulation of the row, and in another batch.
    simulation = batch.simulation(3)
    other = palpate.Batch(pressed, 2)
    other.restore(kept[0])
    for step in range(60, STEPS):
        batch.step(hands[step], obstacles=tools[step])
        forces = simulation.step(hands[step, 3], obstacles=tools[step, 3])
        others = other.step(hands[step, [3, 3]], obstacles=tools[step, [3, 3]])
        assert np.array_equal(batch.forces[3], forces) and np.array_equal(others, [forces, forces])
    assert np.array_equal(batch.poses[[1, 3]], end["poses"][[1, 3]])
    batch.reset()
    assert not batch.time.any() and not batch.forces.any()


def test_rows_start_where_they_are_told(cube):
    scene = palpate.Scene([palpate.Object("cube", cube)])
    batch = palpate.Batch(scene, 3)
    half = np.sqrt(0.5)
    poses = np.array([[[1.0, 2, 3, 1, 0, 0, 0]], [[0, 0, 0, half, 0, 0, half]]])
    velocities = np.array([[[0.1, 0, 0, 0, 0, 0]], [[0, 0, 0, 0, 0, 2.0]]])
    batch.reset([2, 0], poses=poses, velocities=velocities)
    assert np.allclose(batch.poses[[2, 0, 1], 0], [*poses[:, 0], [0, 0, 0, 1, 0, 0, 0]])
    for _ in range(100):
        batch.step()
    # Free bodies go straight on, and turn by 0.2 rad about z, a principal axis.
    assert np.allclose(batch.poses[2, 0, :3], [1.01, 2, 3], atol=1e-12)
    angle = np.pi / 2 + 0.2
    assert np.allclose(batch.poses[0, 0], [0, 0, 0, np.cos(angle / 2), 0, 0, np.sin(angle / 2)], atol=1e-6)
    assert np.array_equal(batch.poses[1, 0], [0, 0, 0, 1, 0, 0, 0])
    simulation = palpate.Simulation(scene)
    simulation.reset(poses=poses[1], velocities=velocities[1])
    for _ in range(100):
        simulation.step()
    assert np.array_equal(simulation.poses, batch.poses[0])
    with pytest.raises(palpate.InputError, match="row 0 of poses: the quaternion"):
        batch.reset([0], poses=np.zeros((1, 1, 7)))


def test_bodies_with_fixed_nodes_stay_at_their_place():
    bar = palpate.record("box:0.2x0.05x0.05/4x1x1", material="rubber", modes=10, fix="x<-0.099")
    batch = palpate.Batch(palpate.Scene([palpate.Object("bar", bar)]), 2)
    poses = batch.poses.copy()
    batch.reset(poses=poses)
    poses[1, 0, 2] += 0.01
    with pytest.raises(palpate.InputError, match='object "bar" has fixed nodes: it starts where the scene says'):
        batch.reset(poses=poses)


def test_a_row_that_fails_is_named_and_leaves_the_others_whole(held):
    batch = palpate.Batch(held, 4, threads=2)
    hands = batch.held_points()
    twin = palpate.Simulation(held)
    for number in range(20):
        hands[:, 0, 0] += 1e-5
        if number == 10:
            hands[1, 0, 1] += 1e4  # m, within one step
            with pytest.raises(palpate.StepError, match=r"row 1: at 0.011000 s the held points can't be met") as caught:
                batch.step(hands)
            assert caught.value.rows == [1]
            hands[1] = 0
        else:
            batch.step(hands)
        twin.step(hands[0])
        for row in [0, 2, 3]:
            assert np.array_equal(batch.forces[row], twin.forces) and np.array_equal(batch.poses[row], twin.poses)
    # It stays where it failed, and says so, until it is reset.
    assert list(batch.has_failed) == [False, True, False, False] and batch.time[1] == 0.011
    assert np.isnan(batch.forces[1]).all() and np.isnan(batch.poses[1]).all()
    for call in [lambda: batch.simulation(1), batch.snapshot]:
        with pytest.raises(palpate.StepError, match="row 1 has failed, reset or restore it: at 0.011000 s"):
            call()
    batch.reset([1])
    hands[1] = batch.held_points()[1]
    batch.step(hands)
    assert not batch.has_failed.any() and np.isfinite(batch.forces).all() and batch.time[1] == 0.001


def test_several_rows_that_fail_are_counted(held):
    batch = palpate.Batch(held, 4)
    hands = batch.held_points()
    hands[2:] += 1e4
    with pytest.raises(palpate.StepError, match="row 2, and 1 more: ") as caught:
        batch.step(hands)
    assert caught.value.rows == [2, 3] and np.isfinite(batch.forces[:2]).all()


def test_devices_grasp_let_go_and_leave_by_row(cube):
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[palpate.Device("hand", tip_radius=0.005)])
    batch = palpate.Batch(scene, 3)
    batch.grasp("hand", "cube", [SIDE / 2, 0, 0], rows=[0, 2])
    assert np.allclose(batch.held_points()[[0, 2], 0], [SIDE / 2, 0, 0]) and np.isnan(batch.held_points()[1]).all()
    hands = np.tile([SIDE / 2 + 0.005, 0, 0], (3, 1, 1))
    hands[[0, 2]] = [SIDE / 2, 0, 0]
    for _ in range(50):
        hands[:, 0, 0] += 1e-5
        batch.step(hands)
    batch.release("hand", rows=[2])
    batch.deactivate("hand", rows=[1])
    for _ in range(100):
        hands[:, 0, 0] += 1e-4
        batch.step(hands)
    # The hand pulls the first along; it let go of the third, which flies on; it went away from the second.
    assert batch.poses[0, 0, 0] > 0.006 and batch.poses[1, 0, 0] == 0 and 1e-4 < batch.poses[2, 0, 0] < 0.003
    assert batch.forces[0].any() and not batch.forces[1:].any()
    assert [batch.simulation(row).modes for row in range(3)] == [["held"], ["inactive"], ["touch"]]


@pytest.mark.parametrize(
    ("call", "text"),
    [
        (lambda batch: batch.step(np.zeros((2, 1, 3))), r"positions has the shape \(2, 1, 3\), expected \(3, 1, 3\)"),
        (lambda batch: batch.step(), 'device "hand" has no path in the scene'),
        (lambda batch: batch.step([[[0, 0, 0]], [[0, np.nan, 0]], [[0, 0, 0]]]), r"positions\[1, 0\] is \[0.0, NaN, 0.0\], expected finite"),
        (lambda batch: batch.run(), 'device "hand" has no path in the scene'),
        (lambda batch: batch.run(np.zeros((3, 1, 3))), r"positions has the shape \(3, 1, 3\), expected \(any, 3, 1, 3\)"),
        (lambda batch: batch.run(np.full((4, 3, 1, 3), np.inf)), r"positions\[0, 0, 0\] is \[inf"),
        (lambda batch: batch.run(np.zeros((4, 3, 1, 3)), steps=4), "the motions have a row per step: leave steps out"),
        (lambda batch: batch.reset([3]), "rows has 3, expected 0 to 2"),
        (lambda batch: batch.reset([-1]), "rows has -1, expected 0 to 2"),
        (lambda batch: batch.reset([1, 1]), "rows has 1 twice"),
        (lambda batch: batch.reset([True, False]), r"rows has bool of shape \(2,\), expected a mask of shape \(3,\)"),
        (lambda batch: batch.reset([0.5]), r"rows has float64 of shape \(1,\)"),
        (lambda batch: batch.reset([0], poses=np.zeros((2, 1, 7))), r"poses has the shape \(2, 1, 7\), expected \(1, 1, 7\)"),
        (lambda batch: batch.restore(batch.snapshot([0, 1])), "there are 2 snapshots for 3 rows"),
        (lambda batch: batch.restore("x"), "snapshots is no Snapshot, and no list of them"),
        (lambda batch: batch.simulation(3), "row is 3, expected 0 to 2"),
        (lambda batch: palpate.Batch(batch.scene, 0), "n is 0, expected 1 to 1000000"),
        (lambda batch: palpate.Batch(batch.scene, 2, threads=0), "threads is 0, expected 1 to 1024"),
    ],
)
def test_arguments_that_cannot_be_used_change_nothing(held, call, text):
    batch = palpate.Batch(held, 3)
    with pytest.raises(palpate.InputError, match=text):
        call(batch)
    assert not batch.time.any() and not batch.forces.any()
    batch.reset([])


def test_snapshots_of_other_scenes_are_refused(held, on_floor):
    with pytest.raises(palpate.InputError, match="the snapshot is of another scene"):
        palpate.Batch(on_floor, 2).restore(palpate.Simulation(held).snapshot())


def test_a_batch_that_another_thread_steps_is_an_exception(held):
    batch = palpate.Batch(held, 200)
    hands = batch.held_points()
    seen, done = [], threading.Event()

    def step():
        while not done.is_set():
            try:
                batch.step(hands)
            except palpate.PalpateError as error:
                seen.append(str(error))
                done.set()

    threads = [threading.Thread(target=step) for _ in range(2)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert "the batch is in use by another thread" in seen[0]
    batch.step(hands)


def _step_after_fork(batch, hands, queue):
    queue.put(batch.step(hands).copy())


@pytest.mark.filterwarnings("ignore::DeprecationWarning")
def test_a_batch_goes_on_in_a_forked_process(held):
    batch = palpate.Batch(held, 8, threads=2)
    hands = batch.held_points()
    batch.step(hands)
    context = multiprocessing.get_context("fork")
    queue = context.Queue()
    child = context.Process(target=_step_after_fork, args=(batch, hands + 1e-5, queue), daemon=True)
    child.start()
    forces = queue.get(timeout=60)
    child.join(timeout=60)
    assert np.array_equal(forces, batch.step(hands + 1e-5))


@pytest.mark.parametrize("threads", [1, 3])
def test_a_run_has_the_bits_of_its_steps(pressed, presses, alone, threads):
    hands, tools = presses
    batch = palpate.Batch(pressed, ROWS, threads=threads)
    series = batch.run(hands, obstacles=tools)
    expected, _ = alone
    assert set(series) == set(OUTPUTS[:-1])
    for name, numbers in series.items():
        assert np.array_equal(numbers, [own[name] for own in expected]), name
        assert np.array_equal(numbers[-1], getattr(batch, name)), name
    # It goes on from there, and takes a row from any step.
    batch.reset()
    parts = [batch.run(hands[:50], obstacles=tools[:50]), batch.run(hands[50:], obstacles=tools[50:])]
    assert np.array_equal(np.concatenate([own["poses"] for own in parts]), series["poses"])


def test_a_run_follows_paths_and_needs_no_motion(cube):
    finger = palpate.Device("finger", tip_radius=0.005, path=[[0, 0, 0, 0.06], [0.05, 0, 0, 0.053]])
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[finger])
    expected = palpate.Simulation(scene).run()
    series = palpate.Batch(scene, 2).run(steps=50)
    assert np.array_equal(series["forces"][:, 1], expected["forces"]) and expected["forces"].any()
    assert np.array_equal(series["time"][:, 0], expected["time"])
    assert len(palpate.Batch(scene, 2).run(steps=0)["poses"]) == 0


def test_rows_that_fail_in_a_run_leave_the_others_their_steps(held):
    batch = palpate.Batch(held, 3)
    hands = np.repeat(batch.held_points()[None], 40, axis=0)
    hands[:, :, 0, 0] += 1e-5 * np.arange(40)[:, None]
    expected = palpate.Simulation(held).run(hands[:, 0])
    hands[20:, 1] += 1e4
    with pytest.raises(palpate.StepError, match=r"row 1: at 0.021000 s") as caught:
        batch.run(hands)
    series = caught.value.series
    assert caught.value.rows == [1] and series["forces"].shape == (40, 3, 1, 3)
    for row in [0, 2]:
        assert np.array_equal(series["forces"][:, row], expected["forces"]) and np.array_equal(batch.forces[row], expected["forces"][-1])
    assert np.array_equal(series["forces"][:20, 1], expected["forces"][:20]) and np.isnan(series["forces"][20:, 1]).all()


def test_ctrl_c_ends_a_run_with_all_rows_at_one_step(held):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        batch = palpate.Batch(held, 50)
        hands = np.repeat(batch.held_points()[None], 5000, axis=0)
        hands[:, :, 0, 0] += 1e-3 * np.sin(1e-3 * np.arange(5000))[:, None]
        signal.signal(signal.SIGALRM, lambda *_: os.kill(os.getpid(), signal.SIGINT))
        signal.setitimer(signal.ITIMER_REAL, 0.2)
        with pytest.raises(KeyboardInterrupt) as caught:
            for _ in range(1000):
                batch.run(hands)
                batch.reset()
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(set(batch.time)) == 1
    if hasattr(caught.value, "series"):
        series = caught.value.series
        assert 0 < len(series["time"]) < 5000 and np.array_equal(series["time"][-1], batch.time)
        assert np.array_equal(series["poses"][-1], batch.poses)


@pytest.mark.skipif(not os.path.exists("/proc/self/statm"), reason="the resident memory is read from /proc")
def test_memory_does_not_grow_with_the_steps(held):
    batch = palpate.Batch(held, 4, threads=2)
    hands = batch.held_points()
    rest = hands.copy()

    def resident_bytes():
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    def steps(count):
        for number in range(count):
            hands[:, 0, 0] = rest[:, 0, 0] + 1e-3 * np.sin(0.01 * number)
            batch.step(hands)

    steps(2000)
    before = resident_bytes()
    steps(30_000)
    # A number of eight bytes that each row kept in each step would be 0.96 MB.
    assert resident_bytes() - before < 600_000
