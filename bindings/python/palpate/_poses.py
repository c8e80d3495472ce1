"""Poses of rigid bodies as rows x, y, z, qw, qx, qy, qz, many at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

#: Pose of a frame on another one.
IDENTITY = np.array([0, 0, 0, 1.0, 0, 0, 0])


#: Axes after and before each axis.
_NEXT, _PREVIOUS = np.array([1, 2, 0]), np.array([2, 0, 1])


def cross(a: Array, b: Array) -> Array:
    """Cross products, (…, 3): a fifth of the time that numpy.cross takes for a few vectors."""
    product: Array = a[..., _NEXT] * b[..., _PREVIOUS] - a[..., _PREVIOUS] * b[..., _NEXT]
    return product


def quaternion_product(a: Array, b: Array) -> Array:
    """Products a∘b of unit quaternions w, x, y, z, (…, 4)."""
    aw, av, bw, bv = a[..., :1], a[..., 1:], b[..., :1], b[..., 1:]
    w = aw * bw - (av * bv).sum(-1, keepdims=True)
    return np.concatenate([w, aw * bv + bw * av + cross(av, bv)], axis=-1)


def rotated(q: Array, v: Array) -> Array:
    """Vectors v turned by unit quaternions, (…, 3): v + 2·w·(u × v) + 2·u × (u × v)."""
    u = q[..., 1:]
    t = 2 * cross(u, v)
    return v + q[..., :1] * t + cross(u, t)


def pose_product(outer: Array, inner: Array) -> Array:
    """Poses world_from_inner = world_from_outer ∘ outer_from_inner, (…, 7)."""
    position = outer[..., :3] + rotated(outer[..., 3:], inner[..., :3])
    return np.concatenate([position, quaternion_product(outer[..., 3:], inner[..., 3:])], axis=-1)


def points_in_world(poses: Array, points: Array) -> Array:
    """Points of bodies, in the world."""
    return poses[..., :3] + rotated(poses[..., 3:], points)


def between(start: Array, end: Array, share: float) -> Array:
    """Poses on the way, at constant velocity and angular velocity; share 0 is the start, 1 the end."""
    if share == 1:
        return end
    position = start[:, :3] + share * (end[:, :3] - start[:, :3])
    turn = quaternion_product(end[:, 3:], start[:, 3:] * [1, -1, -1, -1])
    turn = np.where(turn[:, :1] < 0, -turn, turn)  # the short way round
    sine = np.linalg.norm(turn[:, 1:], axis=1, keepdims=True)
    half = np.arctan2(sine, turn[:, :1])
    axis = turn[:, 1:] / np.where(sine == 0, 1, sine)
    part = np.concatenate([np.cos(share * half), np.sin(share * half) * axis], axis=1)
    return np.concatenate([position, quaternion_product(part, start[:, 3:])], axis=1)
