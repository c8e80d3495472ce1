"""A ball that Newton moves falls on a soft cube of palpate, on the CPU: palpate.RigidCoupling with another engine's arrays (docs/mujoco.md#other-engines).

    pip install newton, and palpate's wheel (docs/python.md#install)
    python examples/newton_ball.py

Prints by how much momentum is off: single precision, which Newton computes in.
"""

import newton
import numpy as np
import palpate
import warp as wp

STEP, RADIUS, MASS = 0.001, 0.03, 0.5  # s, m, kg


def poses(state):
    """Poses as palpate has them: x, y, z, qw, qx, qy, qz; Newton's have qw last."""
    return state.body_q.numpy().astype(float)[:, [0, 1, 2, 6, 3, 4, 5]]


def main():
    wp.config.quiet = True
    builder = newton.ModelBuilder()
    body = builder.add_body(xform=wp.transform((0, 0, 0.081), wp.quat_identity()))
    density = MASS / (4 / 3 * np.pi * RADIUS**3)
    builder.add_shape_sphere(body, radius=RADIUS, cfg=newton.ModelBuilder.ShapeConfig(density=density))
    model = builder.finalize(device="cpu")
    solver = newton.solvers.SolverSemiImplicit(model)
    state, after = model.state(), model.state()

    cube = palpate.record("box:0.1x0.1x0.1/4x4x4", young=2e4, poisson=0.4, density=1000, damping_ratio=0.1, modes=50, order=1)
    shapes = [[palpate.Obstacle(sphere={"radius": RADIUS})]]
    coupling = palpate.RigidCoupling([palpate.Object("cube", cube)], shapes, poses(state), step=STEP)
    wrenches, worst = np.zeros((1, 6)), 0.0
    for number in range(1, 201):
        state.clear_forces()
        state.body_f.assign(wrenches.astype(np.float32))  # N, N·m about the centre of mass
        solver.step(state, after, None, None, STEP)
        state, after = after, state
        wrenches = coupling.follow(poses(state))
        ball, soft = MASS * state.body_qd.numpy()[0, 2], cube.mass * coupling.simulation.velocities[0, 2]
        worst = max(worst, abs(ball + soft + STEP * wrenches[0, 2] + MASS * 9.81 * STEP * number))
    print(f"the cube moves at {coupling.simulation.velocities[0, 2]:.3f} m/s; momentum is off by {worst:.1e} N·s")


if __name__ == "__main__":
    main()
