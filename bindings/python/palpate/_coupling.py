"""Soft bodies among rigid bodies that another engine moves: poses in, wrenches of contact out.

In a step of h the engine moves its bodies under wrenches x, from p to p'(x); palpate moves its obstacles from p to p' and answers with the mean contact
wrenches F(p'). Exact exchange of momentum is kept by an account of what is owed: d' = d + F − x, and x contains d. Staggered coupling takes x = d, the
forces of the last step; implicit coupling solves x = F(p'(x)) + d.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from palpate._arguments import flags, numbers, positive, whole
from palpate._errors import InputError
from palpate._interface import Interface
from palpate._palpate import Simulation, Snapshot
from palpate._poses import IDENTITY, between, cross, points_in_world, pose_product, quaternion_product, rotated
from palpate._scene import Object, Obstacle, Plane, Scene

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from palpate._poses import Array


class RigidCoupling:
    """Soft bodies among N rigid bodies of another engine, in both directions.

    Parameters
    ----------
    objects : iterable of Object
        Elastic bodies.
    shapes : sequence of sequences of Obstacle and Plane
        Shapes of each rigid body; their positions, orientations, points and normals are in the body's frame. Names are kept; those without one
        are "shape0", "shape1" and so on.
    poses : (N, 7) array_like
        Poses of the bodies at the start: x, y, z [m], qw, qx, qy, qz.
    step : float
        Step of the engine [s].
    substeps : int, optional
        Number of palpate's steps in one of the engine; without it so many that they take 1 ms at most.
    centers : (N, 3) array_like, optional
        Centres of mass in the bodies' frames [m], about which torques are; the origins without it.
    moving : (N,) array_like of bool, optional
        Bodies that forces move; all without it.
    iterations : int
        Most trials of a step of :meth:`advance`; 1 is staggered coupling.
    tolerance : float
        Residual at which the trials end, as a share of the wrenches.
    **options
        Of :class:`Scene`, as `gravity`.

    Attributes
    ----------
    simulation : Simulation
        Soft bodies.
    wrenches : (N, 6) array
        Mean force [N] and torque [N·m, about the centres of mass] of contacts on the bodies in the last step, world axes.
    applied : (N, 6) array
        Mean wrenches that moved the bodies in the last step.
    work : (N,) array
        Work that each body has done on the soft ones so far [J], by the forces and the travel of the bodies at the contacts' points. Their sum is the
        `input` of :attr:`Simulation.energy` but for a part of the order of the step.
    contacts : structured array
        Contacts of the last substep: those of :attr:`Simulation.contacts`, with `body` and the shape's number `shape`, or -1.
    trials : int
        Trials of the last step.
    unconverged : int
        Steps so far whose trials ended above the tolerance; with one iteration it is 0.

    See Also
    --------
    palpate.mujoco.SoftBody : this, for MuJoCo.
    """

    def __init__(
        self,
        objects: Iterable[Object | Mapping[str, Any]],
        shapes: Sequence[Sequence[Obstacle | Plane]],
        poses: ArrayLike,
        *,
        step: float,
        substeps: int | None = None,
        centers: ArrayLike | None = None,
        moving: ArrayLike | None = None,
        iterations: int = 10,
        tolerance: float = 1e-3,
        **options: Any,
    ) -> None:
        count = _check_shapes(shapes)
        self.step = positive(step, "step", " of seconds")
        if substeps is None:
            substeps = max(1, int(np.ceil(self.step / 1e-3 - 1e-6)))
        self.substeps = whole(substeps, "substeps")
        self._centers = np.zeros((count, 3)) if centers is None else numbers(centers, "centers", (count, 3))
        self._moving = np.ones(count, bool) if moving is None else flags(moving, "moving", count)
        self._poses = numbers(poses, "poses", (count, 7))
        scene = self._scene(objects, shapes, options)
        self.simulation = Simulation(scene)
        self._start = self.simulation.snapshot()
        self._contact_type = np.dtype([*self.simulation.contacts.dtype.descr, ("body", "i8"), ("shape", "i8")])
        size = max((float(np.ptp(scene.rest_positions(name), axis=0).max()) for name in scene.object_names), default=1.0)
        #: Unknowns of the interface: forces [N], and torques as forces at the size of the objects.
        self._scale = np.array([1, 1, 1, 1 / size, 1 / size, 1 / size])
        self._interface = Interface(whole(iterations, "iterations"), positive(tolerance, "tolerance"))
        self.reset(poses)

    def _scene(self, objects: Iterable[Object | Mapping[str, Any]], shapes: Sequence[Sequence[Obstacle | Plane]], options: dict[str, Any]) -> Scene:
        """Scene whose obstacles are the shapes at their start; planes come first, as in its rows of obstacles."""
        rows: tuple[list[tuple[int, int, Any]], list[tuple[int, int, Any]]] = ([], [])
        number = itertools.count()
        for body, own in enumerate(shapes):
            for shape in own:
                rows[0 if isinstance(shape, Plane) else 1].append((next(number), body, shape))
        ordered = rows[0] + rows[1]
        self._shape_body = np.array([body for _, body, _ in ordered], dtype=int)
        self._shape_number = np.array([number for number, _, _ in ordered], dtype=int)
        self._body_of_shape = self._shape_body[np.argsort(self._shape_number)]
        self._local = np.array([_local_pose(shape) for _, _, shape in ordered]).reshape(len(ordered), 7)
        start = self._shape_poses(self._poses)
        if isinstance(objects, Iterable) and not isinstance(objects, (str, Mapping)):
            objects = list(objects)
        names_of_shapes = _names([shape for own in shapes for shape in own], objects)
        placed = [
            replace(shape, name=names_of_shapes[number], path=np.concatenate([[0], pose])[None], **_UNPLACED[type(shape)])
            for (number, _, shape), pose in zip(ordered, start)
        ]
        names = np.array([shape.name for shape in placed])
        self._by_name = np.argsort(names)
        self._names = names[self._by_name]
        planes, obstacles = placed[: len(rows[0])], placed[len(rows[0]) :]
        return Scene(objects, planes=planes, obstacles=obstacles, step=self.step / self.substeps, **options)

    def _shape_poses(self, poses: Array) -> Array:
        return pose_product(poses[self._shape_body], self._local)

    def reset(self, poses: ArrayLike) -> None:
        """Go back to the start, with the bodies at other poses."""
        count = len(self._centers)
        self.simulation.restore(self._start)
        self._poses = numbers(poses, "poses", (count, 7))
        self._interface.forget()
        self._owed = np.zeros((count, 6))  # N and N·m about the world's origin, over a step
        self._spatial = np.zeros((count, 6))
        self.wrenches, self.applied = np.zeros((count, 6)), np.zeros((count, 6))
        self.contacts = self._with_bodies(self.simulation.contacts)
        self.work = np.zeros(count)
        self._loads, self._step_work = np.zeros((len(self._local), 7)), np.zeros(count)
        self.trials = self.unconverged = 0

    @property
    def moving(self) -> NDArray[np.bool_]:
        """Bodies that forces move, (N,)."""
        return self._moving

    @property
    def shape_forces(self) -> Array:
        """Mean forces of contact on the shapes in the last step [N, world], (shapes, 3)."""
        return self._loads[:, :3].copy()

    @property
    def pressing_forces(self) -> Array:
        """Mean sums of the normal forces on the shapes in the last step [N], (shapes,)."""
        return self._loads[:, 6].copy()

    @property
    def owed(self) -> Array:
        """Impulse that contacts gave and the bodies have not got yet [N·s, N·m·s about the world's origin], (N, 6)."""
        return self._owed * self.step

    def follow(self, poses: ArrayLike) -> Array:
        """Step with bodies that go to given poses, whatever the forces.

        Parameters
        ----------
        poses : (N, 7) array_like
            Poses at the end of the step.

        Returns
        -------
        numpy.ndarray
            Mean wrenches on the bodies, (N, 6): force [N] and torque [N·m] about the centres of mass at the end of the step. An engine that applies them
            in its next step is coupled staggered.
        """
        end = numbers(poses, "poses", (len(self._centers), 7))
        self._spatial = self._press(end)
        self._poses = end
        self.work += self._step_work
        self.wrenches = about(self._spatial, points_in_world(end, self._centers))
        return self.wrenches

    def advance(self, move: Callable[[Array], ArrayLike]) -> Array:
        """Step with bodies that wrenches move, and palpate's with them.

        Parameters
        ----------
        move : callable
            Trial step of the engine from its present state under wrenches (N, 6): force [N] and torque [N·m] about the centres of mass at the start of the
            step, world axes. Returns the poses at its end, (N, 7). It is called up to `iterations` + 1 times, and the last call holds.

        Returns
        -------
        numpy.ndarray
            Mean wrenches of contact on the bodies in this step, (N, 6), about the same centres.
        """
        centers = points_in_world(self._poses, self._centers)
        owed = about(self._owed, centers)
        is_staggered = self._interface.iterations == 1
        guess = owed if is_staggered else owed + about(self._spatial, centers)
        before: Snapshot | None = None if is_staggered else self.simulation.snapshot()
        is_first, end, applied = True, self._poses, owed

        def residual(x: Array) -> tuple[Array, float]:
            nonlocal is_first, end, applied
            if before is not None and not is_first:
                self.simulation.restore(before)
            is_first = False
            applied = np.zeros_like(owed)
            applied[self._moving] = x.reshape(-1, 6) / self._scale
            end = numbers(move(applied), "what move returns", (len(owed), 7))
            self._spatial = self._press(end)
            answer = ((about(self._spatial, centers) + owed)[self._moving] * self._scale).ravel()
            return answer - x, max(float(np.abs(answer).max(initial=0)), _NOTHING)

        start = (guess[self._moving] * self._scale).ravel()
        self.trials, is_converged = self._interface.solve(residual, start)
        if not is_staggered and not is_converged:
            self.unconverged += 1
        if not self._spatial[self._moving].any():
            self._interface.forget()
        self.applied, self._poses = applied, end
        self.work += self._step_work
        self.wrenches = about(self._spatial, centers)
        self._owed += self._spatial - about(applied, -centers)
        self._owed[~self._moving] = 0
        return self.wrenches

    def _press(self, end: Array) -> Array:
        """Move palpate's obstacles to poses; mean wrenches of contact on the bodies, about the world's origin."""
        self._loads, self._step_work = np.zeros((len(self._local), 7)), np.zeros(len(end))
        start = self._poses
        for part in range(1, self.substeps + 1):
            poses = between(self._poses, end, part / self.substeps)
            self.simulation.step(obstacles=self._shape_poses(poses))
            self.contacts = self._with_bodies(self.simulation.contacts)
            on = self.contacts[self.contacts["body"] >= 0]
            if len(on):
                force, point, body = -on["force"], on["point"], on["body"]
                pressing = (force * on["normal"]).sum(axis=1, keepdims=True)
                np.add.at(self._loads, on["shape"], np.concatenate([force, cross(point, force), pressing], axis=1))
                # Travel of the bodies' points at the contacts.
                turn = quaternion_product(start[:, 3:], poses[:, 3:] * [1, -1, -1, -1])
                travel = point - start[body, :3] - rotated(turn[body], point - poses[body, :3])
                np.add.at(self._step_work, body, -(force * travel).sum(axis=1))
            start = poses
        self._loads /= self.substeps
        wrenches = np.zeros((len(end), 6))
        np.add.at(wrenches, self._body_of_shape, self._loads[:, :6])
        return wrenches

    def _with_bodies(self, contacts: NDArray[np.void]) -> NDArray[np.void]:
        """Contacts with the columns `body` and `shape`."""
        at = np.minimum(np.searchsorted(self._names, contacts["against"]), max(len(self._names) - 1, 0))
        wide = np.empty(len(contacts), dtype=self._contact_type)
        for name in contacts.dtype.names or ():
            wide[name] = contacts[name]
        wide["body"] = wide["shape"] = -1
        if len(self._names):
            is_shape = self._names[at] == contacts["against"]
            row = self._by_name[at]
            wide["body"] = np.where(is_shape, self._shape_body[row], -1)
            wide["shape"] = np.where(is_shape, self._shape_number[row], -1)
        return wide


#: Force [N] below which residuals do not count.
_NOTHING = 1e-6

#: Deviation of a quaternion's length from 1 that is round-off.
_UNIT = 1e-3

#: Keys of a shape that its pose replaces.
_UNPLACED: dict[type, dict[str, Any]] = {
    Plane: {"point": None, "normal": [0, 0, 1]},
    Obstacle: {"position": None, "orientation": None},
}


def _names(shapes: Sequence[Obstacle | Plane], objects: Any) -> list[str]:
    """Names of the shapes: their own, and "shape0" and so on for those without one."""
    parts = [*shapes, *(objects if isinstance(objects, list) else [])]
    own = [part.get("name") if isinstance(part, Mapping) else getattr(part, "name", None) for part in parts]
    taken = {name for name in own if isinstance(name, str)}
    names = []
    for number, shape in enumerate(shapes):
        name = f"shape{number}" if shape.name is None else shape.name
        while shape.name is None and name in taken:
            name += "_"
        names.append(name)
    return names


def _check_shapes(shapes: Sequence[Sequence[Obstacle | Plane]]) -> int:
    """Check the lists of shapes; returns the number of bodies."""
    what = "expected a list for each body, of palpate.Obstacle and palpate.Plane"
    if isinstance(shapes, str) or not isinstance(shapes, Sequence):
        raise InputError(f"shapes is {shapes!r}, {what}")
    for body, own in enumerate(shapes):
        if isinstance(own, str) or not isinstance(own, Sequence):
            raise InputError(f"the shapes of body {body} are {own!r}, {what}")
        for shape in own:
            if not isinstance(shape, (Obstacle, Plane)):
                raise InputError(f"body {body} has the shape {shape!r}, {what}")
            if shape.name is not None and not isinstance(shape.name, str):
                raise InputError(f"a shape of body {body} has the name {shape.name!r}, expected text")
    return len(shapes)


def about(wrenches: Array, points: Array) -> Array:
    """Wrenches with their torques about points, of ones about the origin that the points are from."""
    force = wrenches[:, :3]
    return np.concatenate([force, wrenches[:, 3:] - cross(points, force)], axis=1)


def _local_pose(shape: Obstacle | Plane) -> Array:
    """Pose of a shape in its body's frame; planes are turned from their normal to z."""
    if isinstance(shape, Obstacle):
        position = np.zeros(3) if shape.position is None else numbers(shape.position, "position", (3,))
        orientation = IDENTITY[3:] if shape.orientation is None else numbers(shape.orientation, "orientation", (4,))
        length = float(np.linalg.norm(orientation))
        if abs(length - 1) > _UNIT:
            raise InputError(f"the orientation {orientation.tolist()} has the length {length:.6g}, expected a quaternion w, x, y, z of length 1")
        return np.concatenate([position, orientation / length])
    normal = numbers(shape.normal, "normal", (3,))
    length = float(np.linalg.norm(normal))
    if not 0 < length < np.inf:
        raise InputError(f"the normal {normal.tolist()} has the length {length}, expected a direction")
    normal = normal / length
    # The half-way turn from z to the normal; any axis across, if they are opposite.
    half = np.array([1 + normal[2], -normal[1], normal[0], 0]) if normal[2] > -1 + 1e-12 else np.array([0, 1.0, 0, 0])
    half = half / np.linalg.norm(half)
    assert np.allclose(rotated(half, np.array([0, 0, 1.0])), normal)
    point = np.zeros(3) if shape.point is None else numbers(shape.point, "point", (3,))
    return np.concatenate([point, half])
