"""palpate.RigidCoupling: soft bodies among the rigid ones of another engine, here a few lines of NumPy."""

import importlib
import pathlib

import numpy as np
import palpate
import pytest

SIDE = 0.1  # m
RADIUS = 0.03  # m


class Balls:
    """Rigid balls, semi-implicit Euler: an engine as small as it can be.

    Parameters
    ----------
    positions, velocities : (N, 3) array
    mass : float
    step : float
    """

    def __init__(self, positions, velocities, mass, step):
        self.mass, self.step = mass, step
        self.inertia = 0.4 * mass * RADIUS**2
        count = len(positions)
        self.poses = np.tile([0, 0, 0, 1.0, 0, 0, 0], (count, 1))
        self.poses[:, :3] = positions
        self.twists = np.zeros((count, 6))
        self.twists[:, :3] = velocities
        self.work = 0.0

    def trial(self, wrenches):
        """Poses and twists after a step under wrenches (N, 6)."""
        twists = self.twists + self.step * wrenches / ([self.mass] * 3 + [self.inertia] * 3)
        poses = self.poses.copy()
        poses[:, :3] += self.step * twists[:, :3]
        for pose, turn in zip(poses, self.step * twists[:, 3:]):
            angle = np.linalg.norm(turn)
            w, u = np.cos(angle / 2), np.sinc(angle / 2 / np.pi) * turn / 2
            w0, u0 = pose[3], pose[4:].copy()
            pose[3:] = [w * w0 - u @ u0, *(w * u0 + w0 * u + np.cross(u, u0))]
            pose[3:] /= np.linalg.norm(pose[3:])
        return poses, twists

    def step_with(self, coupling):
        last = None

        def move(wrenches):
            nonlocal last
            last = self.trial(wrenches)
            return last[0]

        coupling.advance(move)
        poses, twists = last
        self.work += self.step * float((coupling.applied * (self.twists + twists)).sum()) / 2
        self.poses, self.twists = poses, twists


def scene(cube, positions, velocities, mass, step=0.001, **options):
    """Free cube at the origin and balls on their way; no gravity."""
    balls = Balls(np.asarray(positions, float), np.asarray(velocities, float), mass, step)
    shapes = [[palpate.Obstacle(sphere={"radius": RADIUS}, friction=0.5)] for _ in positions]
    return balls, palpate.RigidCoupling([palpate.Object("cube", cube)], shapes, balls.poses, step=step, **options)


def thrown(cube, mass=0.2, **options):
    """A ball that hits the cube off its middle, and aslant."""
    return scene(cube, [[-0.09, 0.02, 0.01]], [[1.0, 0.2, 0]], mass, **options)


def momentum(cube, balls, coupling):
    """Linear momentum and moment of momentum about the origin, with what is owed, (6,)."""
    pose, twist = coupling.simulation.poses[0], coupling.simulation.velocities[0]
    w, u = pose[3], pose[4:]
    turn = np.eye(3) + 2 * w * np.cross(np.eye(3), -u) + 2 * (np.outer(u, u) - u @ u * np.eye(3))
    linear = cube.mass * twist[:3]
    angular = np.cross(pose[:3], linear) + turn @ cube.inertia @ turn.T @ twist[3:]
    own = balls.mass * balls.twists[:, :3]
    spins = np.cross(balls.poses[:, :3], own) + balls.inertia * balls.twists[:, 3:]
    return np.concatenate([linear + own.sum(0), angular + spins.sum(0)]) + coupling.owed.sum(0)


@pytest.mark.parametrize("iterations", [1, 20])
def test_momentum_is_exchanged_exactly(cube, iterations):
    balls, coupling = thrown(cube, iterations=iterations, substeps=2, step=0.002)
    before = momentum(cube, balls, coupling)
    hit = 0
    for _ in range(150):
        balls.step_with(coupling)
        hit = max(hit, np.abs(coupling.wrenches[0, :3]).max())
        assert np.abs(momentum(cube, balls, coupling) - before)[:3].max() < 1e-12
    assert hit > 5  # N
    assert coupling.simulation.velocities[0, 0] > 0.1 and np.abs(balls.twists[0, 3:]).max() > 0.1
    assert not coupling.wrenches.any() and np.abs(coupling.owed).max() < 1e-15


def test_the_work_is_that_of_both_ledgers(cube):
    balls, coupling = thrown(cube)
    before = kinetic(balls)
    for _ in range(150):
        balls.step_with(coupling)
    assert abs(kinetic(balls) - before - balls.work) < 1e-12
    given = coupling.simulation.energy["input"]
    assert given > 0.01 and abs(coupling.work.sum() - given) < 1e-3 * given


def kinetic(balls):
    return (balls.mass * (balls.twists[:, :3] ** 2).sum() + balls.inertia * (balls.twists[:, 3:] ** 2).sum()) / 2


def made(cube, mass, step, iterations):
    """Energy that the coupling makes in a collision [J]."""
    balls, coupling = thrown(cube, mass, step=step, iterations=iterations)
    for _ in range(round(0.15 / step)):
        balls.step_with(coupling)
    return balls.work + coupling.simulation.energy["input"]


def test_half_the_step_makes_half_the_error_of_energy(cube):
    # ∓h/2·∫F·dv: what staggered coupling makes and implicit coupling loses, the opposite of each other but for a part of the order h².
    staggered = [made(cube, 0.2, step, 1) for step in (0.001, 0.0005)]
    implicit = [made(cube, 0.2, step, 20) for step in (0.001, 0.0005)]
    assert 1.8 < staggered[0] / staggered[1] < 2.2 and staggered[1] > 0
    assert 1.8 < implicit[0] / implicit[1] < 2.2 and implicit[1] < 0
    assert abs(staggered[1] + implicit[1]) < 0.15 * staggered[1]


def test_a_light_body_is_stable_implicitly_only(cube):
    # A ball of 2 g against a cube of 1 kg, with 1 mJ.
    assert -1e-3 < made(cube, 0.002, 0.001, 20) <= 0
    assert made(cube, 0.002, 0.001, 1) > 2e-3


def test_following_is_staggered_coupling(cube):
    balls, coupling = thrown(cube, iterations=1)
    same, other = thrown(cube)
    wrenches = np.zeros((1, 6))
    for _ in range(100):
        balls.step_with(coupling)
        same.poses, same.twists = same.trial(wrenches)
        wrenches = other.follow(same.poses)
    assert np.abs(balls.twists[0, 0] - 1) > 0.5
    assert np.allclose(same.poses, balls.poses, rtol=0, atol=1e-9) and np.allclose(same.twists, balls.twists, rtol=0, atol=1e-7)


def test_two_balls_squeeze_the_cube_alike(cube):
    balls, coupling = scene(cube, [[-0.085, 0, 0], [0.085, 0, 0]], [[0.5, 0, 0], [-0.5, 0, 0]], 0.1)
    for _ in range(60):
        balls.step_with(coupling)
        assert np.allclose(coupling.wrenches[0, 0], -coupling.wrenches[1, 0], atol=1e-3 + 0.01 * abs(coupling.wrenches[0, 0]))
    assert coupling.unconverged == 0


def test_shapes_go_with_their_bodies(cube):
    # A plane given in a body's frame, turned about y by 90°: its normal is the world's x.
    half = np.sqrt(0.5)
    floor = palpate.Plane(point=[0, 0, 0.01], normal=[0, 0, 1], friction=0)
    start = [[-0.06, 0, 0, half, 0, half, 0]]
    coupling = palpate.RigidCoupling([palpate.Object("cube", cube)], [[floor]], start, step=0.001)
    far = coupling.follow([[-0.0605, 0, 0, half, 0, half, 0]])
    assert not far.any()
    near = coupling.follow([[-0.0598, 0, 0, half, 0, half, 0]])
    assert near[0, 0] < -1 and abs(near[0, 1:3]).max() < 1e-6 * -near[0, 0]
    assert (coupling.contacts["body"] == 0).all() and np.allclose(coupling.contacts["normal"], [-1, 0, 0])
    assert np.allclose(coupling.shape_forces[0], near[0, :3]) and np.isclose(coupling.pressing_forces[0], -near[0, 0])


def test_reset_begins_again_to_the_bit(cube):
    ends = []
    balls, coupling = thrown(cube)
    start = balls.poses.copy(), balls.twists.copy()
    for _ in range(2):
        balls.poses, balls.twists = start[0].copy(), start[1].copy()
        coupling.reset(balls.poses)
        for _ in range(60):
            balls.step_with(coupling)
        ends.append(np.concatenate([balls.twists.ravel(), coupling.simulation.poses.ravel()]))
    assert np.array_equal(ends[0], ends[1])


def test_shapes_keep_the_names_that_they_have(cube):
    jaw = palpate.Obstacle(name="jaw", sphere={"radius": RADIUS}, position=[0, 0.04, 0])
    plain = palpate.Obstacle(sphere={"radius": RADIUS}, position=[0, -0.04, 0])
    table = palpate.Plane(name="table", normal=[0, 0, 1])
    shapes, poses = [[jaw, plain], [table], [plain]], [[0.081, 0, 0, 1, 0, 0, 0], [0, 0, -0.3, 1, 0, 0, 0], [-0.081, 0, 0, 1, 0, 0, 0]]
    coupling = palpate.RigidCoupling([palpate.Object("shape3", cube)], shapes, poses, step=0.001)
    # Planes come first; a name that an object has is not taken.
    assert coupling.simulation.scene.obstacle_names == ["table", "jaw", "shape1", "shape3_"]
    for _ in range(20):
        poses[0][0], poses[2][0] = poses[0][0] - 1e-4, poses[2][0] + 1e-4
        coupling.follow(poses)
    found = {(str(own["against"]), int(own["body"]), int(own["shape"])) for own in coupling.contacts}
    assert found == {("jaw", 0, 0), ("shape1", 0, 1), ("shape3_", 2, 3)}
    with pytest.raises(palpate.SceneError, match='the name "jaw" is taken already'):
        palpate.RigidCoupling([palpate.Object("cube", cube)], [[jaw, jaw]], poses[:1], step=0.001)


def test_warnings_of_the_scene_point_to_the_line_of_the_coupling(cube):
    deep = [[0.03, 0, 0, 1, 0, 0, 0]]
    with pytest.warns(palpate.PalpateWarning, match="begins") as caught:
        palpate.RigidCoupling([palpate.Object("cube", cube)], [[palpate.Obstacle(sphere={"radius": RADIUS})]], deep, step=0.001)
    assert {warning.filename for warning in caught} == {__file__}


def test_wrong_arguments_say_what_is_expected(cube):
    shapes, poses = [[palpate.Obstacle(sphere={"radius": RADIUS})]], [[0.1, 0, 0, 1, 0, 0, 0]]
    objects = [palpate.Object("cube", cube)]
    with pytest.raises(palpate.InputError, match=r"poses has the shape \(1, 3\), expected \(1, 7\)"):
        palpate.RigidCoupling(objects, shapes, [[0, 0, 0]], step=0.001)
    with pytest.raises(palpate.InputError, match="substeps is 0"):
        palpate.RigidCoupling(objects, shapes, poses, step=0.001, substeps=0)
    coupling = palpate.RigidCoupling(objects, shapes, poses, step=0.001)
    with pytest.raises(palpate.InputError, match="not finite"):
        coupling.follow([[np.nan, 0, 0, 1, 0, 0, 0]])


def test_newton_moves_the_ball_of_the_example(monkeypatch, capsys):
    pytest.importorskip("newton", reason="Newton is not installed: pip install newton")
    monkeypatch.syspath_prepend(str(pathlib.Path(__file__).parents[3] / "examples"))
    importlib.import_module("newton_ball").main()
    assert float(capsys.readouterr().out.split("off by ")[1].split()[0]) < 1e-6
