"""Sessions: scenes in real time. Their numbers are those of simulations and of logs, to the bit; no test asserts a time of the clock."""

import gc
import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import palpate
import pytest
from waiting import PATIENCE, until

#: Limits of a scene that are the same in real time and offline.
LIMITS = {"max_contact_samples": 48, "solver_budget": 10**9}


def steps_of(session, count):
    """Output of a session some steps later."""
    at = session.steps + count
    until(lambda: session.newest().step >= at)
    return session.newest()


@pytest.fixture
def touching(cube):
    """Scene of a cube on a floor under a finger."""
    floor = palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])
    finger = palpate.Device("finger", tip_radius=0.01, patch_radius=0.03, coupling={"stiffness": 500, "damping": 1})
    return palpate.Scene([palpate.Object("cube", cube)], planes=[floor], devices=[finger], gravity=[0, 0, -9.81], **LIMITS)


def on_path(cube, press, **more):
    """Scene of a cube on a floor that a finger on a path presses."""
    rows = np.column_stack([np.arange(len(press)) * 1e-3, press[:, 0]])
    floor = palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])
    finger = palpate.Device("finger", tip_radius=0.01, path=rows)
    return palpate.Scene([palpate.Object("cube", cube)], planes=[floor], devices=[finger], gravity=[0, 0, -9.81], **LIMITS, **more)


def test_a_session_on_paths_has_the_numbers_of_a_simulation(cube, press, tmp_path):
    scene = on_path(cube, press)
    series = palpate.Simulation(scene).run()
    count = len(series["time"])
    with palpate.Session(scene, steps=count, log=tmp_path / "run.mcap") as session:
        assert session.wait() and not session.is_running
        last = session.newest()
    log = palpate.Log(tmp_path / "run.mcap")
    assert session.stop()["log"] == {"steps": count, "missed": 0, "whole": True}
    assert np.array_equal(log.forces["finger"], series["forces"][:, 0]) and np.abs(log.forces["finger"]).max() > 0.1
    assert np.array_equal(log.poses["cube"], series["poses"][:, 0])
    assert np.array_equal(log.energy["elastic"], series["energy"]["elastic"])
    assert last.step == count and last.time == series["time"][-1]
    assert np.array_equal(last.poses, series["poses"][-1]) and np.array_equal(last.forces, series["forces"][-1])


def test_the_newest_output_is_that_of_a_simulation_of_as_many_steps(touching):
    hand = np.array([[0.01, 0, 0.055]])
    with palpate.Session(touching, positions=hand) as session:
        outputs = [steps_of(session, 20) for _ in range(3)]
    simulation = palpate.Simulation(touching)
    for output in outputs:
        simulation.run(np.repeat(hand[None], output.step - round(simulation.time / touching.step), axis=0))
        assert output.time == simulation.time and np.array_equal(output.positions, hand)
        names = ["forces", "proxies", "poses", "velocities", "obstacle_forces", "obstacle_torques", "object_forces", "object_torques"]
        for name in [*names, "clamp_loads", "contacts", "is_asleep"]:
            assert np.array_equal(getattr(output, name), getattr(simulation, name)), name
        assert output.energy == simulation.energy and output.status == simulation.status
        assert np.array_equal(output.surface("cube"), simulation.surface(0))
    assert len(outputs[-1].contacts) > 0 and outputs[-1].forces[0, 2] > 0.1
    assert repr(outputs[0]).startswith(f"<palpate.Output of step {outputs[0].step} at ")


def test_a_hand_that_is_moved_meanwhile_is_in_the_log_and_repeats(touching, press, tmp_path, palpate_run):
    with palpate.Session(touching, log=tmp_path / "run.mcap") as session:
        # From just above the cube; each position is in two steps or more.
        for position in press[::5] + [0, 0, 0.0045]:
            session.move(position)
            steps_of(session, 2)
        session.move([0, 0, 0.2], device="finger", over=0)
        assert steps_of(session, 2).positions[0, 2] == 0.2
    log = palpate.Log(tmp_path / "run.mcap")
    positions, forces = log.positions["finger"], log.forces["finger"]
    begun = int(np.argmax((positions != 0).any(axis=1)))
    assert np.abs(forces[:begun]).max(initial=0) == 0 and np.abs(forces).max() > 0.1
    assert "every number came out again, bit for bit" in palpate_run("replay", tmp_path / "run.mcap")
    simulation = palpate.Simulation(touching)
    simulation.deactivate("finger")
    simulation.run(positions[:begun, None])
    simulation.release("finger")
    assert np.array_equal(simulation.run(positions[begun:, None])["forces"][:, 0], forces[begun:])


def test_a_slow_caller_moves_a_hand_evenly(touching, tmp_path, palpate_run):
    with palpate.Session(touching, positions=[[0, 0, 0.2]], log=tmp_path / "run.mcap") as session:
        for height in np.arange(0.21, 0.3, 0.01):
            steps_of(session, 20)
            session.move([[0, 0, height]])
        until(lambda: session.newest().positions[0, 2] == height)
    heights = palpate.Log(tmp_path / "run.mcap").positions["finger"][:, 2]
    # All steps go up, by about a twentieth of a move, or a tenth where a move began before the last one had ended.
    assert heights[-1] == height and 0 <= np.diff(heights).min() and np.diff(heights).max() < 0.01 / 5
    assert "every number came out again, bit for bit" in palpate_run("replay", tmp_path / "run.mcap")


def test_a_move_takes_the_time_that_it_is_given(touching, tmp_path):
    with palpate.Session(touching, positions=[[0, 0, 0.2]], log=tmp_path / "run.mcap") as session:
        steps_of(session, 1)
        session.move([0.05, 0, 0.2], "finger", over=0.05)
        # A change of mode does not begin the way anew.
        session.deactivate("finger"), session.release("finger")
        until(lambda: session.newest().positions[0, 0] == 0.05)
        session.slowdown = 2
        session.move([[0, 0, 0.2]], over=0.05)
        until(lambda: session.newest().positions[0, 0] == 0)
        session.move([0, 0, 0.5], "finger", over=0)
        assert steps_of(session, 2).positions[0, 2] == 0.5
        for wrong, text in [({"over": -1}, "over is -1 s"), ({"over": np.nan}, "over is NaN s"), ({}, "positions is missing"), ({"device": 0}, "positions is missing")]:
            with pytest.raises(palpate.InputError, match=text):
                session.move(**({"positions": [[0, 0, 1]]} if "over" in wrong else {}), **wrong)
    moved = np.diff(palpate.Log(tmp_path / "run.mcap").positions["finger"][:, 0])
    there, back = moved[moved > 0], moved[moved < 0]
    assert len(back) == 25 and np.allclose(back, -0.05 / 25, rtol=1e-9)
    assert len(there) == 50 and np.allclose(there, 0.05 / 50, rtol=1e-9)


def test_obstacles_and_clamps_are_moved_and_repeat(cube, tmp_path, palpate_run):
    jaw = palpate.Clamp("jaw", object="cube", face={"point": [0.05, 0, 0]}, max_cells=4)
    ball = palpate.Obstacle("ball", sphere={"radius": 0.02}, position=[-0.2, 0, 0])
    rail = palpate.Obstacle("rail", sphere={"radius": 0.02}, path=np.array([[0, 0, 0, 1], [1, 0, 0, 2]]))
    scene = palpate.Scene([palpate.Object("cube", cube)], clamps=[jaw], obstacles=[ball, rail], **LIMITS)
    rest = [[0, 0, 0, 1, 0, 0, 0]]
    moved = np.array([[-0.065, 0, 0, 1, 0, 0, 0], [np.nan] * 7])  # the row of one on a path is not used
    with palpate.Session(scene, log=tmp_path / "run.mcap") as session:
        session.move(obstacles=moved, over=0.05)
        pressed = steps_of(session, 80)
        assert pressed.obstacle_forces[0, 0] < -0.1 and not pressed.obstacle_forces[1].any()
        turn = [np.cos(0.05), np.sin(0.05), 0, 0]
        session.move(clamps=[[0.002, 0, 0, *turn]])
        turned = steps_of(session, 150)
        assert np.abs(turned.clamp_loads - pressed.clamp_loads).max() > 0.01
        session.move(obstacles=[[-0.2, 0, 0, 1, 0, 0, 0]] * 2, clamps=rest)
        steps_of(session, 150)
        for wrong, text in [
            ({"obstacles": rest}, r"obstacles has the shape \(1, 7\), expected \(2, 7\)"),
            ({"clamps": [[np.inf] * 7]}, "row 0 of clamps"),
            ({"clamps": [[0, 0, 0, 2, 0, 0, 0]]}, "the quaternion .* has the length 2"),
        ]:
            with pytest.raises(palpate.InputError, match=text):
                session.move(**wrong)
        assert not session.newest().obstacle_forces.any()
    assert "every number came out again, bit for bit" in palpate_run("replay", tmp_path / "run.mcap")


def test_a_step_that_could_not_be_followed_is_told_once_and_the_session_goes_on(held):
    start = palpate.Simulation(held).held_points()
    with palpate.Session(held, positions=start) as session:
        steps_of(session, 2)
        session.move(start + [5, 0, 0], over=0)
        with pytest.raises(palpate.StepError, match="the held points can't be met.* the hand of \"hand\" is"):
            until(lambda: session.newest() is None)
        session.deactivate("hand")
        at = session.steps
        until(lambda: session.steps > at + 5)
        for told in range(2):
            try:
                session.newest()
            except palpate.StepError:
                assert told == 0  # of a step before the hand was gone
        assert session.newest().step > at and session.is_running
    with pytest.raises(palpate.StepError), palpate.Session(held, positions=start) as session:
        session.move(start + [5, 0, 0], over=0)
        at = session.steps
        until(lambda: session.steps > at + 2)
    assert not session.is_running and session.stop()["unsolved_steps"] > 0


def test_grasps_and_forces_are_in_the_log_and_repeat(cube, tmp_path, palpate_run):
    point = {"object": "cube", "point": [0.05, 0, 0]}
    devices = [palpate.Device("hand", mode="held", attach=point), palpate.Device("weight", mode="force", attach=point | {"point": [-0.05, 0, 0]})]
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=devices, **LIMITS)
    start = palpate.Simulation(scene).held_points()
    start[1] = [0, 0, -0.5]  # N
    with palpate.Session(scene, positions=start, log=tmp_path / "run.mcap") as session:
        pulled = steps_of(session, 100)
        session.move([0, 0.2, 0], "weight")
        steps_of(session, 20)
        session.release("hand")
        session.move([1, 1, 1], "hand")
        free = steps_of(session, 20)
        session.grasp("hand", 0, [0.05, 0, 0])
        assert session.modes == ["held", "force"]
        steps_of(session, 1)
        session.deactivate("hand")
        assert session.modes == ["inactive", "force"]
        steps_of(session, 5)
    assert np.abs(pulled.forces[0]).max() > 0.05 and np.array_equal(pulled.forces[1], [0, 0, 0.5])
    assert not free.forces[0].any() and np.array_equal(free.forces[1], [0, -0.2, 0])
    assert "every number came out again, bit for bit" in palpate_run("replay", tmp_path / "run.mcap")


def test_the_report_counts_what_the_session_did(touching):
    with palpate.Session(touching, positions=[[0, 0, 0.055]]) as session:
        steps_of(session, 100)
        timing = session.timing
        assert 0 < timing["cycles"] <= session.steps and "priority" in session.granted
        assert 0 < timing["compute_time"]["p50"] <= timing["compute_time"]["p99"] <= timing["compute_time"]["max"]
    report = session.stop()
    force = report["force_process"]
    assert report["steps"] == session.steps == session.newest().step == force["cycles"] == session.timing["cycles"]
    # A step for each period of the clock, without those that were skipped.
    assert report["steps"] + force["skipped"] <= report["wall_time"] / touching.step + 2
    assert force["own_overruns"] <= force["overruns"] and report["log"] is None
    assert 0 < report["touching_steps"]["finger"] <= report["steps"] and report["largest_penetration"]["cube"] >= 0
    assert report["granted"] == session.granted and "memory not locked" in session.granted


def test_two_sessions_run_beside_each_other(touching, held):
    with palpate.Session(touching, positions=[[0, 0, 0.055]]) as one, palpate.Session(held) as other:
        first = [steps_of(session, 80) for session in [one, other, one]]
    assert first[2].step > first[0].step >= 80 <= first[1].step
    assert first[0].forces.any() and not first[1].forces.any()


def test_steps_go_on_while_python_holds_its_lock(held):
    with palpate.Session(held) as session:
        before = steps_of(session, 1).step
        sum(range(10_000_000))  # one call of the interpreter's own
        assert session.newest().step > before + 1


def test_a_session_pauses_steps_singly_and_goes_slowly(held):
    with palpate.Session(held) as session:
        steps_of(session, 5)
        session.is_paused = True
        assert session.is_paused

        def stands_still():
            at = session.steps
            time.sleep(0.05)
            return session.steps == at

        # A step may be in the making.
        until(stands_still)
        at = session.steps
        session.request_step()
        until(lambda: session.steps == at + 1)
        session.slowdown = 3
        session.is_paused = False
        steps_of(session, 20)
        assert session.slowdown == 3
        for wrong in [0, -1, 2**40]:
            with pytest.raises(palpate.InputError, match="slowdown is"):
                session.slowdown = wrong
        session.is_paused = True
    assert not session.is_running, "a paused session ends"


def test_another_scene_goes_on_where_a_session_ended(cube, held):
    falling = palpate.Scene([palpate.Object("cube", cube)], gravity=[0, 0, -9.81])
    with palpate.Session(falling) as session:
        steps_of(session, 40)
        with pytest.raises(palpate.PalpateError, match=r"the session runs: stop\(\) it before its snapshot"):
            session.snapshot()
    end = session.newest()
    floating = palpate.Scene([palpate.Object("cube", cube)])
    with palpate.Session(floating, start=session.snapshot(), steps=30) as other:
        other.wait()
    drift = end.velocities[0, 2] * 30 * floating.step
    assert drift < -0.005 and np.isclose(other.newest().poses[0, 2] - end.poses[0, 2], drift, rtol=1e-9)
    assert np.isclose(other.newest().velocities[0, 2], end.velocities[0, 2], rtol=1e-12)
    # A simulation goes on likewise, and its snapshots begin sessions.
    simulation = palpate.Simulation(falling)
    simulation.restore(session.snapshot())
    assert np.array_equal(simulation.poses, end.poses) and simulation.time == 0
    with palpate.Session(falling, start=simulation.snapshot(), steps=10) as third:
        third.wait()
    assert np.array_equal(third.newest().poses[0], simulation.run(steps=10)["poses"][-1, 0])


def test_a_silent_hand_lets_go_after_its_timeout(touching):
    hand = [[0, 0, 0.055]]
    with palpate.Session(touching, positions=hand, timeout=0.2) as session:
        until(lambda: not session.newest().forces.any() and session.steps > 100)
        until(lambda: session.move(hand) or session.newest().forces.any())
    with palpate.Session(touching, positions=hand, steps=400) as session:
        session.wait()
    assert session.newest().forces.any(), "without one it stays"


def test_wrong_arguments_are_refused_and_nothing_starts(cube, touching, held, press, tmp_path):
    before = threads()
    for wrong, text in [
        ({"positions": [[0, 0]]}, r"positions has the shape \(1, 2\), expected \(1, 3\)"),
        ({"positions": [[0, 0, np.nan]]}, "row 0 of positions"),
        ({"steps": -1}, "the run has -1 steps"),
        ({"steps": 1, "duration": 1.0}, "give steps or duration, not both"),
        ({"duration": np.inf}, "the run has inf steps"),
        ({"timeout": 0.0}, "timeout is 0 s"),
        ({"timeout": np.nan}, "timeout is NaN s"),
        ({"priority": 100}, "priority is 100, expected 1 to 99"),
        ({"core": -1}, "core is -1"),
        ({"log": ""}, 'log is "", expected the name of a file'),
        ({"start": palpate.Simulation(palpate.Scene([palpate.Object("a", cube), palpate.Object("b", cube, position=[1, 0, 0])])).snapshot()}, "modes"),
    ]:
        with pytest.raises(palpate.InputError, match=text):
            palpate.Session(touching, **wrong)
    with pytest.raises(palpate.SceneError, match="the step is 0.05 s: in real time it is"):
        palpate.Session(palpate.Scene([palpate.Object("cube", cube)], step=0.05))
    with pytest.raises(palpate.InputError, match="reference=True"):
        palpate.Session(palpate.Scene([palpate.Object("cube", cube)], reference=True))
    with pytest.raises(palpate.InputError, match="a scene with paths or clamps begins as it says"):
        palpate.Session(on_path(cube, press), start=palpate.Simulation(held).snapshot())
    with pytest.raises(palpate.FileError, match="there is no folder|No such file|not there"):
        palpate.Session(touching, log=tmp_path / "missing" / "run.mcap")
    with pytest.raises(TypeError):
        palpate.Session(1)
    assert threads() == before and not list(tmp_path.iterdir())


def test_calls_that_do_not_fit_are_exceptions_and_the_session_goes_on(cube, touching, press):
    with palpate.Session(touching) as session:
        for wrong in [[0, 0, 0], [[0, 0, np.inf]], "here", np.zeros((2, 3))]:
            with pytest.raises(palpate.InputError, match="positions"):
                session.move(wrong)
        with pytest.raises(palpate.InputError, match="there is no device nose; the scene has finger"):
            session.move([0, 0, 1], "nose")
        with pytest.raises(palpate.InputError, match="from the surface"):
            session.grasp("finger", "cube", [1, 1, 1])
        with pytest.raises(palpate.InputError, match="timeout is not a number"):
            session.wait(np.nan)
        assert not session.wait(0.01)
        steps_of(session, 5)
    with pytest.raises(palpate.PalpateError, match="the session has ended"):
        session.move([[0, 0, 1]])
    with pytest.raises(palpate.PalpateError, match="the session has ended"):
        session.is_paused = True
    assert session.wait() and session.stop() == session.stop() and "ended" in repr(session)
    with palpate.Session(on_path(cube, press)) as session:
        with pytest.raises(palpate.InputError, match="follows a path of the scene"):
            session.move([0, 0, 1], "finger")
        with pytest.raises(palpate.InputError, match="follows a path of the scene"):
            session.deactivate("finger")
        session.move([[np.nan] * 3])  # its row is not used


def test_an_exception_of_the_block_ends_the_session(held):
    with pytest.raises(LookupError), palpate.Session(held) as session:
        raise LookupError
    assert not session.is_running


def test_ctrl_c_ends_the_wait_and_the_block_ends_the_session(held):
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt), palpate.Session(held) as session:
            steps_of(session, 1)
            threading.Timer(0.1, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
            session.wait()
    finally:
        signal.signal(signal.SIGINT, before)
    assert not session.is_running and session.steps > 0


def threads():
    return len(os.listdir("/proc/self/task"))


def resident_bytes():
    with open("/proc/self/statm") as file:
        return int(file.read().split()[1]) * os.sysconf("SC_PAGE_SIZE")


@pytest.mark.skipif(sys.platform != "linux", reason="threads are counted in Linux' /proc")
def test_a_session_that_nobody_has_ends_with_its_log(touching, tmp_path):
    before = threads()
    session = palpate.Session(touching, log=tmp_path / "run.mcap")
    assert threads() > before
    steps_of(session, 10)
    del session
    gc.collect()
    until(lambda: threads() == before)
    assert [file.name for file in tmp_path.iterdir()] == ["run.mcap"] and len(palpate.Log(tmp_path / "run.mcap")) >= 10


@pytest.mark.skipif(sys.platform != "linux", reason="threads and memory are read from Linux' /proc")
def test_many_sessions_leave_no_thread_and_no_memory(touching):
    before = threads()

    def sessions(count):
        for _ in range(count):
            with palpate.Session(touching, positions=[[0, 0, 0.055]], steps=3) as session:
                session.wait()
                session.newest().contacts, session.timing

    sessions(20)
    kept = resident_bytes()
    sessions(60)
    until(lambda: threads() == before)
    # The states of one session alone are above 200 kB.
    assert resident_bytes() - kept < 4_000_000


#: Program that is ended in several ways while a session runs.
PROGRAM = """
import os, sys, resource, time, warnings
import palpate
scene = palpate.Scene.load("scene.toml")
session = palpate.Session(scene, positions=[[0, 0, 0.2]], log="run.mcap")
while session.steps < 20:
    time.sleep(0.001)
"""


def run_program(folder, more):
    floor = '[[plane]]\nname = "floor"\npoint = [0, 0, -0.05]\nnormal = [0, 0, 1]\n'
    finger = '[[device]]\nname = "finger"\nmode = "touch"\n'
    (folder / "scene.toml").write_text('[[object]]\nname = "cube"\nrecording = "cube.palp"\n' + floor + finger)
    done = subprocess.run([sys.executable, "-c", PROGRAM + more], capture_output=True, text=True, cwd=folder, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


def test_the_end_of_the_program_ends_its_sessions_and_logs(folder):
    run_program(folder, "other = palpate.Session(scene)\n")
    assert len(palpate.Log(folder / "run.mcap")) >= 20 and not (folder / "run.mcap.part").exists()


@pytest.mark.skipif(not hasattr(os, "fork"), reason="there is no fork")
def test_a_forked_process_cannot_use_a_session_and_does_not_end_it(folder):
    more = """
child = os.fork()
if child == 0:
    assert not session.is_running
    for call in [session.newest, session.stop, session.wait, session.snapshot, lambda: session.move([[0, 0, 1]]), lambda: session.timing]:
        try:
            call()
        except palpate.PalpateError as error:
            assert "not in one that was forked from it" in str(error), error
        else:
            os._exit(1)
    with palpate.Session(scene, steps=5) as own:
        own.wait()
    assert own.stop()["steps"] == 5
    del session
    sys.exit(0)
assert os.waitpid(child, 0)[1] == 0
at = session.steps
while session.steps < at + 20:
    time.sleep(0.001)
session.stop()
"""
    run_program(folder, more)
    assert not palpate.Log(folder / "run.mcap").is_cut


@pytest.mark.skipif(os.name != "posix", reason="the size of files is limited by setrlimit")
def test_a_disk_that_is_full_is_told_and_the_session_goes_on(folder):
    more = """
begun = os.path.getsize("run.mcap.part")
while os.path.getsize("run.mcap.part") < begun + 100_000:
    time.sleep(0.01)
resource.setrlimit(resource.RLIMIT_FSIZE, (os.path.getsize("run.mcap.part") + 20_000,) * 2)
with warnings.catch_warnings(record=True) as caught:
    warnings.simplefilter("always")
    while not caught:
        session.newest()
        time.sleep(0.01)
text = str(caught[0].message)
assert "cannot write the log run.mcap" in text and "The session goes on without it" in text, text
at = session.steps
while session.steps < at + 20:
    session.move([[0, 0, 0.2]])
try:
    session.stop()
except palpate.LogError as error:
    assert "the log run.mcap is incomplete" in str(error) and error.file == "run.mcap", error
else:
    raise AssertionError
"""
    run_program(folder, more)
    assert palpate.Log(folder / "run.mcap.part").is_cut
