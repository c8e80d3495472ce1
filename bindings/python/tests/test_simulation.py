"""Numbers of a simulation: those of `palpate run`, and those of mechanics."""

import copy

import numpy as np
import palpate
import pytest

GRAVITY = 9.81  # m/s²
TORQUE = 1e-12  # N·m: round-off of sums of some newtons at some centimetres
SCENE = """gravity = [0.0, 0.0, -9.81]
[[object]]
name = "cube"
recording = "cube.palp"
[[plane]]
name = "floor"
point = [0.0, 0.0, -0.05]
normal = [0.0, 0.0, 1.0]
[[probe]]
name = "top"
object = "cube"
point = [0.0, 0.0, 0.05]
[[device]]
name = "finger"
mode = "touch"
tip_radius = 0.005
patch_radius = 0.04
coupling = { stiffness = 2000.0, damping = 2.0 }
"""
FINGER = palpate.Device(
    "finger", tip_radius=0.005, patch_radius=0.04, coupling={"stiffness": 2000.0, "damping": 2.0}
)


def scene_with_finger(cube, **more):
    return palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])],
        probes=[palpate.Probe("top", "cube", [0, 0, 0.05])],
        devices=[FINGER],
        gravity=[0, 0, -GRAVITY],
        **more,
    )


@pytest.fixture
def command_line(folder, press, palpate_run):
    """Folder of a run by the command line: scene.toml, finger.csv, out.csv, contacts.csv."""
    # A row before the first step, then one at the end of each step: the path meets every row exactly.
    times = np.arange(0, len(press) + 1) * 1e-3
    rows = np.column_stack([times, np.concatenate([press[:1, 0], press[:, 0]])])
    (folder / "finger.csv").write_text("".join(",".join(map(repr, row)) + "\n" for row in rows.tolist()))
    (folder / "scene.toml").write_text(SCENE + 'path = { file = "finger.csv" }\n')
    palpate_run("run", folder / "scene.toml", "--csv", folder / "out.csv", "--contacts", folder / "contacts.csv")
    return folder


def columns(file, names):
    table = np.genfromtxt(file, delimiter=",", names=True, deletechars="", dtype=None, encoding="utf-8")
    return np.column_stack([table[name] for name in names])


def test_a_press_has_the_numbers_of_palpate_run_to_the_bit(command_line):
    series = palpate.Simulation(palpate.Scene.load(command_line / "scene.toml")).run(contacts=True)
    out = command_line / "out.csv"
    axes = ["x", "y", "z"]
    compared = {
        "positions": [f"finger.{axis}" for axis in axes],
        "forces": [f"finger.f{axis}" for axis in axes],
        "proxies": [f"finger.proxy_{axis}" for axis in axes],
        "poses": [f"cube.{name}" for name in ["px", "py", "pz", "qw", "qx", "qy", "qz"]],
        "velocities": [f"cube.{name}" for name in ["vx", "vy", "vz", "wx", "wy", "wz"]],
        "object_forces": [f"cube.f{axis}" for axis in axes],
        "object_torques": [f"cube.t{axis}" for axis in axes],
        "obstacle_forces": [f"floor.f{axis}" for axis in axes],
        "obstacle_torques": [f"floor.t{axis}" for axis in axes],
        "probe_positions": [f"top.{axis}" for axis in axes],
        "probe_displacements": [f"top.u{axis}" for axis in axes],
    }
    assert np.array_equal(series["time"], columns(out, ["t"])[:, 0])
    for name, headers in compared.items():
        assert np.array_equal(series[name][:, 0], columns(out, headers)), name
    for name, values in series["energy"].items():
        assert np.array_equal(values, columns(out, [f"energy.{name}"])[:, 0]), name
    # The press is felt, and ends.
    force = series["forces"][:, 0, 2]
    assert force.max() > 1 and force[-1] == 0

    contacts = series["contacts"]
    file = command_line / "contacts.csv"
    for name in ["point", "normal", "force"]:
        assert np.array_equal(contacts[name], columns(file, [name[0] + axis for axis in axes])), name
    for name, header in [("time", "t"), ("gap", "gap"), ("slip_speed", "slip_speed"), ("against", "against")]:
        assert np.array_equal(contacts[name], columns(file, [header])[:, 0]), name
    assert set(contacts["against"]) == {"floor", "finger"} and set(contacts["object"]) == {"cube"}
    assert np.array_equal(contacts["device"] == 0, contacts["against"] == "finger")


def test_positions_of_the_caller_and_steps_one_by_one_give_the_same_bits(command_line, cube, press):
    by_path = palpate.Simulation(palpate.Scene.load(command_line / "scene.toml")).run(contacts=True)
    scene = scene_with_finger(cube)
    whole = palpate.Simulation(scene).run(press, contacts=True)
    for name in ["time", "positions", "forces", "proxies", "poses", "velocities", "contacts"]:
        assert np.array_equal(whole[name], by_path[name]), name

    simulation = palpate.Simulation(scene)
    for number, hand in enumerate(press):
        forces = simulation.step(hand)
        assert np.array_equal(forces, whole["forces"][number])
    assert simulation.time == whole["time"][-1]
    assert np.array_equal(simulation.poses, whole["poses"][-1])
    now = whole["contacts"][whole["contacts"]["time"] == simulation.time]
    assert np.array_equal(simulation.contacts, now)
    assert simulation.energy == {name: values[-1] for name, values in whole["energy"].items()}


def test_rows_in_code_are_the_path_of_a_file(command_line, cube, press):
    times = np.arange(0, len(press) + 1) * 1e-3
    rows = np.column_stack([times, np.concatenate([press[:1, 0], press[:, 0]])])
    scene = scene_with_finger(cube)
    finger = palpate.Device(**{**vars(FINGER), "path": rows})
    scene = palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])],
        devices=[finger],
        gravity=[0, 0, -GRAVITY],
    )
    series = palpate.Simulation(scene).run()
    expected = columns(command_line / "out.csv", ["finger.fx", "finger.fy", "finger.fz"])
    assert np.array_equal(series["forces"][:, 0], expected)


def test_a_floor_carries_the_weight(on_floor, cube):
    simulation = palpate.Simulation(on_floor)
    series = simulation.run(duration=4.0, contacts=True)
    contacts = series["contacts"]
    floor = contacts[contacts["against"] == "floor"]["force"].sum(axis=0)
    # Impulses of floor and weight are the change of momentum: an identity of every step, so that only their sums round.
    impulse = floor * on_floor.step
    weight = cube.mass * on_floor.gravity * simulation.time
    momentum = cube.mass * simulation.velocities[0, :3]
    assert np.allclose(impulse + weight, momentum, atol=1e-9)
    # It rests: what swings still is some per cent of the weight.
    assert np.allclose(floor / len(series["time"]), -cube.mass * on_floor.gravity, atol=1e-3)


def test_net_forces_are_the_sums_over_contacts(cube, press):
    scene = scene_with_finger(cube)
    simulation = palpate.Simulation(scene)
    series = simulation.run(press[:200], contacts=True)
    at_end = series["contacts"][series["contacts"]["time"] == simulation.time]
    floor = at_end[at_end["against"] == "floor"]
    assert len(floor) > 1 and set(at_end["against"]) == {"floor", "finger"}
    # The torque on the floor is about its point, that on the cube about its centre of mass at rest.
    for forces, torques, rows, origin, sign in [
        ("obstacle_forces", "obstacle_torques", floor, [0, 0, -0.05], -1),
        ("object_forces", "object_torques", at_end, simulation.poses[0, :3], 1),
    ]:
        force, torque = getattr(simulation, forces), getattr(simulation, torques)
        assert force.shape == torque.shape == (1, 3) and np.abs(torque).max() > 1e-3
        assert np.allclose(force[0], sign * rows["force"].sum(axis=0), atol=1e-12)
        moments = np.cross(rows["point"] - origin, rows["force"])
        assert np.allclose(torque[0], sign * moments.sum(axis=0), atol=TORQUE)
        assert np.array_equal(force, series[forces][-1]) and np.array_equal(torque, series[torques][-1])
    # Force and weight are the change of momentum.
    impulse = (series["object_forces"][:, 0] + cube.mass * scene.gravity).sum(axis=0) * scene.step
    assert np.allclose(impulse, cube.mass * simulation.velocities[0, :3], atol=1e-9)


def test_a_resting_cube_loads_the_floor_with_its_weight(cube):
    simulation = palpate.Simulation(scene_with_finger(cube))
    away = np.tile([0, 0, 0.2], (4000, 1, 1))
    series = simulation.run(away)
    loads = {name: series[name][-2000:, 0].mean(axis=0) for name in ["obstacle_forces", "obstacle_torques", "object_forces"]}
    # A sleeping cube would keep the forces of its last step. What swings still has hardly a mean: its momentum is small beside that of two seconds' weight.
    assert not simulation.is_asleep[0]
    weight = cube.mass * GRAVITY
    assert np.allclose(loads["obstacle_forces"], [0, 0, -weight], atol=1e-3 * weight)
    assert np.allclose(loads["object_forces"], -loads["obstacle_forces"], atol=1e-12)
    # The cube stands over the floor's point, to a thousandth of its side.
    assert np.abs(loads["obstacle_torques"]).max() < 1e-3 * weight * 0.1


def test_forces_on_a_free_cube_are_its_change_of_momentum(held, cube):
    simulation = palpate.Simulation(held)
    start = simulation.held_points()
    time = np.arange(1, 301)[:, None, None] * 1e-3
    series = simulation.run(start + 0.01 * np.sin(20 * time) * np.array([0.6, 0.8, 0]))
    # On the hand acts the opposite of what acts on the cube.
    impulse = -series["forces"][:, 0].cumsum(axis=0) * held.step
    momentum = cube.mass * series["velocities"][:, 0, :3]
    assert np.abs(momentum).max() > 0.1
    assert np.allclose(impulse, momentum, atol=1e-12)


def test_a_prescribed_force_accelerates_a_cube(cube):
    load = palpate.Device("load", mode="force", attach={"object": "cube", "point": [0.05, 0, 0]})
    simulation = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)], devices=[load]))
    for _ in range(100):
        forces = simulation.step([[0.5, 0, 0]])
    assert np.array_equal(forces, [[-0.5, 0, 0]])
    assert np.isclose(simulation.velocities[0, 0], 0.5 / cube.mass * 0.1, rtol=1e-9)


def test_obstacles_that_the_caller_moves_push(cube):
    scene = palpate.Scene(
        [palpate.Object("cube", cube)],
        obstacles=[palpate.Obstacle(name="tool", box={"half_extents": [0.01, 0.2, 0.2]}, position=[-0.065, 0, 0])],
    )
    simulation = palpate.Simulation(scene)
    time = np.arange(1, 301) * 1e-3
    poses = np.tile([0.0, 0, 0, 1, 0, 0, 0], (300, 1, 1))
    poses[:, 0, 0] = -0.065 + 0.1 * time
    series = simulation.run(obstacles=poses, contacts=True)
    assert set(series["contacts"]["against"]) == {"tool"} and simulation.velocities[0, 0] > 0.05
    before = simulation.poses
    simulation.step(obstacles=poses[-1])
    assert simulation.poses[0, 0] > before[0, 0]


def test_what_has_no_path_stays_where_it_was_put(cube):
    scene = palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])],
        gravity=[0, 0, -9.81],
    )
    simulation = palpate.Simulation(scene)
    poses = np.tile([0.0, 0, -0.05, 1, 0, 0, 0], (500, 1, 1))
    poses[:, 0, 2] += 0.01 * np.arange(1, 501) / 500
    lifted = simulation.run(obstacles=poses)["poses"][-1, 0, 2]
    assert 0.008 < lifted < 0.0101
    # A floor that went back would let it fall by 1 cm in 45 ms.
    simulation.run(duration=0.2)
    assert abs(simulation.poses[0, 2] - lifted) < 0.001


def test_a_clamped_face_goes_with_its_frame(cube):
    jaw = palpate.Clamp("jaw", object="cube", face={"point": [0.05, 0, 0]}, max_cells=4)
    scene = palpate.Scene([palpate.Object("cube", cube)], clamps=[jaw], gravity=[0, 0, -GRAVITY])
    simulation = palpate.Simulation(scene)
    series = simulation.run(duration=4.0)
    assert scene.clamp_names == ["jaw"] and series["clamp_frames"].shape == (4000, 1, 7)
    # A jaw that stays carries the weight, but for the change of momentum.
    impulse = -series["clamp_forces"][:, 0].sum(axis=0) * scene.step
    weight = cube.mass * scene.gravity * simulation.time
    assert np.allclose(impulse + weight, cube.mass * simulation.velocities[0, :3], atol=1e-9)
    assert np.array_equal(simulation.clamp_loads[0, :3], series["clamp_forces"][-1, 0])
    frame = series["clamp_frames"][-1].copy()
    frame[0, 2] += 1e-3
    still = simulation.copy()
    still.step()
    simulation.step(clamps=frame)
    # A jump of 1 mm upwards within a step is a blow on the cube, and its opposite on the jaw.
    assert simulation.clamp_loads[0, 2] < still.clamp_loads[0, 2] - cube.mass * GRAVITY


def test_the_surface_at_the_start_is_the_recordings(cube):
    at = np.array([0.3, -0.2, 0.1])
    half = np.sqrt(0.5)
    turned = palpate.Object("cube", cube, position=at, orientation=[half, 0, 0, half])  # 90° about z
    scene = palpate.Scene([turned])
    simulation = palpate.Simulation(scene)
    rest = scene.rest_positions("cube")
    assert np.array_equal(rest, cube.positions) and np.array_equal(scene.triangles(0), cube.triangles)
    expected = at + np.column_stack([-rest[:, 1], rest[:, 0], rest[:, 2]])
    assert np.allclose(simulation.surface("cube"), expected, atol=1e-15)


def test_snapshots_copies_and_resets_come_again_to_the_bit(cube, press):
    simulation = palpate.Simulation(scene_with_finger(cube))
    first = simulation.run(press[:150])
    before = simulation.snapshot()
    assert before.time == simulation.time == first["time"][-1]
    twin = simulation.copy()
    after = simulation.run(press[150:])["forces"]
    assert np.array_equal(twin.forces, first["forces"][-1])
    assert np.array_equal(twin.run(press[150:])["forces"], after)
    simulation.restore(before)
    assert np.array_equal(simulation.forces, first["forces"][-1])
    assert np.array_equal(copy.deepcopy(simulation).run(press[150:])["forces"], after)
    simulation.reset()
    assert simulation.time == 0 and not simulation.forces.any()
    assert np.array_equal(simulation.run(press[:150])["forces"], first["forces"])


def test_what_rests_falls_asleep(cube):
    scene = palpate.Scene(
        [palpate.Object("cube", cube)],
        planes=[palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])],
        gravity=[0, 0, -GRAVITY],
        sleep_after=0.1,
    )
    simulation = palpate.Simulation(scene)
    assert simulation.is_asleep.dtype == bool and not simulation.is_asleep[0]
    for _ in range(30):
        simulation.run(duration=1.0)
        if simulation.is_asleep[0]:
            break
    assert simulation.is_asleep[0]


def test_step_returns_one_array_that_it_writes_over(held):
    simulation = palpate.Simulation(held)
    hand = simulation.held_points()
    first = simulation.step(hand)
    kept = first.copy()
    second = simulation.step(hand + [1e-4, 0, 0])
    assert second is first and simulation.forces is first and not np.array_equal(first, kept)
    # Other numbers are converted: lists, single precision, every second row.
    simulation.step((hand + [1e-4, 0, 0]).tolist())
    simulation.step(hand.astype(np.float32))
    simulation.step(np.repeat(hand, 2, axis=0)[::2])


def test_a_hand_grasps_moves_lets_go_and_leaves(cube):
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[palpate.Device("hand", tip_radius=0.01, patch_radius=0.03)])
    simulation = palpate.Simulation(scene)
    assert simulation.modes == ["touch"]
    simulation.grasp("hand", "cube", [0.0501, 0, 0])
    assert np.allclose(simulation.held_points(), [[0.05, 0, 0]]) and simulation.modes == ["held"]
    hand = simulation.held_points()
    impulse = np.zeros(3)
    for _ in range(100):
        hand[0, 0] += 1e-4
        impulse -= simulation.step(hand)[0] * scene.step
    # Held: the point goes with the hand, and the cube has the momentum that it gave.
    assert np.allclose(simulation.held_points(), hand, atol=1e-9)
    assert impulse[0] > 0.05 and np.allclose(cube.mass * simulation.velocities[0, :3], impulse, atol=1e-12)
    before = simulation.snapshot()
    simulation.release(0)
    away = hand + [0.1, 0, 0]
    assert not simulation.step(away).any() and simulation.modes == ["touch"]
    # It touches: a tip that comes back presses.
    simulation.step(simulation.poses[:, :3] + [0.065, 0, 0])
    assert simulation.step(simulation.poses[:, :3] + [0.059, 0, 0])[0, 0] > 0
    simulation.deactivate("hand")
    # It passes through, and neither gets nor gives.
    speed = simulation.velocities[0, 0]
    assert not simulation.step(simulation.poses[:, :3] + [0.055, 0, 0]).any()
    assert simulation.velocities[0, 0] == speed and simulation.modes == ["inactive"]
    # Modes go with snapshots, and back to the scene's.
    simulation.restore(before)
    assert simulation.modes == ["held"]
    simulation.reset()
    assert simulation.modes == ["touch"]


def test_a_device_with_a_path_keeps_the_mode_that_it_is_given(cube):
    rows = [[0, 0.05, 0, 0], [0.1, 0.06, 0, 0]]
    scene = palpate.Scene([palpate.Object("cube", cube)], devices=[palpate.Device("hand", path=rows)])
    simulation = palpate.Simulation(scene)
    simulation.grasp("hand", "cube", [0.05, 0, 0])
    simulation.run()
    assert simulation.modes == ["held"] and simulation.held_points()[0, 0] == pytest.approx(0.06)


def test_grasps_that_cannot_be_are_refused(cube):
    hands = [palpate.Device("left"), palpate.Device("right")]
    load = palpate.Device("load", mode="force", attach={"object": "cube", "point": [0, 0, 0.05]}, path=[[0, 0, 0, 0], [1, 0, 0, 1]])
    simulation = palpate.Simulation(palpate.Scene([palpate.Object("cube", cube)], devices=[*hands, load]))
    simulation.grasp("left", "cube", [0.05, 0, 0])
    for call, text in [
        (lambda: simulation.grasp("right", "cube", [0.05, 0, 0]), 'device "left" holds the same point'),
        (lambda: simulation.grasp("right", "cube", [0.5, 0, 0]), "is 0.4500 m from the surface of \"cube\", at most 0.0087 m"),
        (lambda: simulation.grasp("right", "cube", [np.nan, 0, 0]), "expected finite numbers"),
        (lambda: simulation.grasp("right", "ball", [0, 0, 0.05]), "there is no object ball; the scene has cube"),
        (lambda: simulation.release("middle"), "there is no device middle; the scene has left, right, load"),
        (lambda: simulation.release(3), "there is no device 3"),
        (lambda: simulation.release("load"), 'device "load" has a path of forces'),
    ]:
        with pytest.raises(palpate.InputError) as caught:
            call()
        assert text in str(caught.value)
    assert simulation.modes == ["held", "touch", "force"]
    simulation.deactivate("load")
    assert simulation.modes[2] == "inactive"
    bar = palpate.record("box:0.2x0.05x0.05/4x1x1", material="rubber", modes=10, fix="x<-0.099")
    fixed = palpate.Simulation(palpate.Scene([palpate.Object("bar", bar)], devices=[palpate.Device("hand")]))
    with pytest.raises(palpate.InputError, match='of "bar" cannot be held'):
        fixed.grasp("hand", "bar", [-0.1, 0, 0])


def test_a_refused_step_leaves_all_inputs_as_they_were(cube):
    ball = palpate.Obstacle(sphere={"radius": 0.02}, position=[0, 0, 0.08])
    jaw = palpate.Clamp("jaw", "cube", face={"point": [0, 0, -0.05]})
    scene = palpate.Scene([palpate.Object("cube", cube)], obstacles=[ball], clamps=[jaw])
    simulation, untouched = palpate.Simulation(scene), palpate.Simulation(scene)
    inside = [[0, 0, 0.069, 1, 0, 0, 0]]
    no_rotation = [[0, 0, -0.05, 0, 0, 0, 0]]
    with pytest.raises(palpate.InputError, match="clamps"):
        simulation.step(obstacles=inside, clamps=no_rotation)
    for _ in range(3):
        simulation.step()
        untouched.step()
    assert len(simulation.contacts) == 0
    assert np.array_equal(simulation.poses, untouched.poses)
