#!/usr/bin/env python3
"""Gymnasium environment: a finger presses a soft block to a wanted force.

    pip install gymnasium
    python gymnasium_press.py

The action is the finger's velocity, downwards negative, as a share of 5 cm/s; the observation is force [N], height above the block [mm] and wanted
force [N]. An episode ends well when the force stays within 3 % of the wanted for 0.2 s, and is cut off after 3 s.

`PressEnv` is one block; `PressVectorEnv` is many, stepped together on all cores by palpate.Batch, with the numbers of `SyncVectorEnv` of `PressEnv`.
"""

import warnings

import gymnasium
import numpy as np
import palpate
from gymnasium.utils import seeding
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

# Steps of 1 ms in one of the environment.
STEPS = 10
# Largest speed [m/s].
SPEED = 0.05
# Height of the finger's centre at the start, and when its tip touches [m].
START, TOUCH = 0.030, 0.028
# Range of the height [m].
LOW, HIGH = 0.014, 0.035
# Range of wanted forces [N].
WANTED = (0.3, 1.5)
# Success: a share of the wanted force, for a number of steps.
CLOSE, STAY = 0.03, 20
LONGEST = 300

OBSERVATION = gymnasium.spaces.Box(
    np.array([-20, -1e3 * (TOUCH - LOW), 0], np.float32), np.array([20, 1e3 * (HIGH - TOUCH), 2], np.float32)
)
ACTION = gymnasium.spaces.Box(-1, 1, (1,), np.float32)


def make_scene():
    """Block of 6 x 6 x 4 cm, as soft as liver, whose lower side is glued, and a finger of 8 mm."""
    block = palpate.record(
        "box:0.06x0.06x0.04/6x6x4", young=5e3, poisson=0.4, density=1060, damping_ratio=0.2, modes=40, order=1, fix="z<-0.0199"
    )
    finger = palpate.Device("finger", tip_radius=0.008, patch_radius=0.02, coupling={"stiffness": 1000, "damping": 2})
    with warnings.catch_warnings():
        # The mesh is coarse, so that it is recorded within a second: some per cent too stiff.
        warnings.simplefilter("ignore", palpate.PalpateWarning)
        return palpate.Scene([palpate.Object("block", block)], devices=[finger])


def observe(force, height, wanted):
    """Observations of one block, or of many."""
    observation = np.stack([force, 1e3 * (np.asarray(height) - TOUCH), wanted], axis=-1)
    return np.clip(observation.astype(np.float32), OBSERVATION.low, OBSERVATION.high)


class PressEnv(gymnasium.Env):
    """One block."""

    metadata = {"render_modes": []}

    def __init__(self, scene=None):
        self.observation_space, self.action_space = OBSERVATION, ACTION
        self.simulation = palpate.Simulation(scene or make_scene())
        self.hand = np.array([[0, 0, START]])

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.simulation.reset()
        self.hand[0, 2] = START
        self.wanted, self.close, self.steps = self.np_random.uniform(*WANTED), 0, 0
        return observe(0.0, START, self.wanted), {}

    def step(self, action):
        target = np.clip(self.hand[0, 2] + SPEED * 0.001 * STEPS * np.clip(action[0], -1, 1), LOW, HIGH)
        move = (target - self.hand[0, 2]) / STEPS
        for _ in range(STEPS):
            self.hand[0, 2] += move
            force = self.simulation.step(self.hand)[0, 2]
        error = abs(force / self.wanted - 1)
        self.close = self.close + 1 if error < CLOSE else 0
        self.steps += 1
        observation = observe(force, self.hand[0, 2], self.wanted)
        return observation, -float(min(error, 1)), self.close >= STAY, self.steps >= LONGEST, {}


class PressVectorEnv(VectorEnv):
    """Many blocks. One whose episode has ended starts again in the next step."""

    metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(self, num_envs, scene=None, threads=None):
        self.num_envs = num_envs
        self.single_observation_space, self.single_action_space = OBSERVATION, ACTION
        self.observation_space, self.action_space = batch_space(OBSERVATION, num_envs), batch_space(ACTION, num_envs)
        self.batch = palpate.Batch(scene or make_scene(), num_envs, threads=threads)
        self.hands = np.zeros((num_envs, 1, 3))
        self.wanted = np.zeros(num_envs)
        self.close, self.steps = np.zeros(num_envs, int), np.zeros(num_envs, int)
        self.done = np.zeros(num_envs, bool)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        # A generator for each block, seeded as SyncVectorEnv does.
        seeds = [None if seed is None else seed + row for row in range(self.num_envs)]
        self.generators = [seeding.np_random(own)[0] for own in seeds]
        self._start(np.ones(self.num_envs, bool))
        self.done[:] = False
        return observe(np.zeros(self.num_envs), self.hands[:, 0, 2], self.wanted), {}

    def _start(self, rows):
        self.batch.reset(rows)
        self.hands[rows, 0, 2] = START
        self.wanted[rows] = [self.generators[row].uniform(*WANTED) for row in np.flatnonzero(rows)]
        self.close[rows], self.steps[rows] = 0, 0

    def step(self, actions):
        height = self.hands[:, 0, 2]
        target = np.clip(height + SPEED * 0.001 * STEPS * np.clip(actions[:, 0], -1, 1), LOW, HIGH)
        move = (target - height) / STEPS
        for _ in range(STEPS):
            height += move
            forces = self.batch.step(self.hands)[:, 0, 2]
        again = self.done
        if again.any():
            self._start(again)
        error = np.abs(forces / self.wanted - 1)
        self.close = np.where((error < CLOSE) & ~again, self.close + 1, 0)
        self.steps += ~again
        rewards = np.where(again, 0.0, -np.minimum(error, 1))
        terminations, truncations = self.close >= STAY, self.steps >= LONGEST
        self.done = terminations | truncations
        return observe(forces, height, self.wanted), rewards, terminations, truncations, {}


def controller(observation):
    """Action by hand: down to the block, then a speed in proportion to what the force lacks [0.1 m/s for each N]."""
    force, height, wanted = np.moveaxis(np.asarray(observation, dtype=float), -1, 0)
    speed = np.where(height > 0.2, -0.04, -0.1 * (wanted - force))
    return np.clip(speed / SPEED, -1, 1)[..., None].astype(np.float32)


def main():
    scene = make_scene()
    environment = PressEnv(scene)
    observation, _ = environment.reset(seed=1)
    ended = False
    while not ended:
        observation, _, well, cut, _ = environment.step(controller(observation))
        ended = well or cut
    force, height, wanted = observation
    print(f"one block: {force:.3f} N of {wanted:.3f} N at {height:.2f} mm, {environment.simulation.time:.2f} s")

    many = PressVectorEnv(64, scene)
    observations, _ = many.reset(seed=1)
    well = np.zeros(64, bool)
    for _ in range(LONGEST):
        observations, _, terminations, _, _ = many.step(controller(observations))
        well |= terminations
    print(f"64 blocks: {well.sum()} reached their wanted force")


if __name__ == "__main__":
    main()
