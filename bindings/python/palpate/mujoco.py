"""Contact forces between MuJoCo's rigid geoms and soft bodies, in both directions (docs/mujoco.md).

>>> import mujoco
>>> import palpate
>>> from palpate.mujoco import SoftBody
>>> model = mujoco.MjModel.from_xml_string('''<mujoco><worldbody>
...   <geom name="table" type="plane" size="1 1 1"/>
...   <body name="ball" pos="0 0 .2"><freejoint/><geom type="sphere" size=".03"/></body>
... </worldbody></mujoco>''')
>>> data = mujoco.MjData(model)
>>> cube = palpate.record("box:0.1x0.1x0.1/4x4x4", material="paper", modes=30)
>>> soft = SoftBody(model, data, palpate.Object("cube", cube, position=[0, 0, 0.05]))
>>> soft.step()
>>> force = soft.force("ball")
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING, Any, Union

import numpy as np

try:
    import mujoco  # type: ignore[import-untyped, import-not-found, unused-ignore]
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("palpate.mujoco needs MuJoCo: pip install mujoco", name=error.name) from error

from palpate import _mujoco_parts, _mujoco_shapes
from palpate._coupling import RigidCoupling
from palpate._errors import InputError, warn
from palpate._palpate import Recording, Simulation
from palpate._scene import Object

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from palpate._poses import Array

__all__ = ["SoftBody"]

_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)
#: Share of its exchange over some steps that the coupling may make of energy before it warns.
_SUSPECT = 0.3
#: Steps that this is judged over, and energy [J] below which it is not.
_MEMORY, _NOTHING = 50, 1e-6


class SoftBody:
    """Soft bodies in a MuJoCo scene: its geoms press them, and feel the contact forces.

    Parameters
    ----------
    model : mujoco.MjModel
    data : mujoco.MjData
    objects : Recording, Object or sequence of Object
        Soft bodies; a Recording alone starts with its centre of mass at the origin.
    geoms : sequence of str or int, optional
        Geoms that meet them, by names or numbers; without it all that MuJoCo collides with something.
    friction : float, optional
        Coulomb's coefficient of all geoms; without it each one's own coefficient of sliding.
    sensors : sequence of str
        User sensors of the model that are written in each step (docs/mujoco.md#sensors).
    substeps : int, optional
        Number of palpate's steps in one of MuJoCo; without it so many that they take 1 ms at most.
    iterations : int
        Most trials of a step; 1 couples staggered: cheap, and unstable where bodies are light (docs/mujoco.md#light-fingers).
    tolerance : float
        Residual of the wrenches at which trials end, as a share of them.
    **options
        Of :class:`palpate.Scene`, as `max_contact_samples`.

    Attributes
    ----------
    simulation : Simulation
        Soft bodies.
    coupling : RigidCoupling
        What couples them.
    work_on_soft, work_on_rigid : float
        Work so far of MuJoCo's bodies on the soft ones, and of the contact forces on MuJoCo's bodies [J].

    Notes
    -----
    Gravity and the step are the model's at the start. Quaternions and units are MuJoCo's.
    """

    def __init__(
        self,
        model: Any,
        data: Any,
        objects: Union[Recording, Object, Sequence[Object]],
        *,
        geoms: Iterable[Union[str, int]] | None = None,
        friction: float | None = None,
        sensors: Iterable[str] = (),
        substeps: int | None = None,
        iterations: int = 10,
        tolerance: float = 1e-3,
        **options: Any,
    ) -> None:
        if model.opt.integrator == int(mujoco.mjtIntegrator.mjINT_RK4):
            raise InputError("the model's integrator is RK4, which takes forces at several times of a step: expected Euler, implicit or implicitfast")
        self.model, self.data = model, data
        self._geoms = _mujoco_parts.chosen_geoms(model, geoms)
        self._bodies = np.unique(model.geom_bodyid[self._geoms])
        ordered = [geom for body in self._bodies for geom in self._geoms if model.geom_bodyid[geom] == body]
        self._geoms = ordered
        self._end = mujoco.MjData(model)
        self._state = np.zeros(mujoco.mj_stateSize(model, _STATE))
        self._generalized = np.zeros(model.nv)
        has_gravity = not model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_GRAVITY)
        with tempfile.TemporaryDirectory() as folder:
            shapes = [
                [_mujoco_shapes.shape_of(model, geom, friction, folder) for geom in ordered if model.geom_bodyid[geom] == body]
                for body in self._bodies
            ]
            self.coupling = RigidCoupling(
                _mujoco_parts.as_objects(objects),
                shapes,
                self._poses(),
                step=model.opt.timestep,
                substeps=substeps,
                centers=model.body_ipos[self._bodies],
                moving=model.body_dofnum[model.body_weldid[self._bodies]] > 0,
                iterations=iterations,
                tolerance=tolerance,
                gravity=model.opt.gravity.copy() if has_gravity else None,
                **options,
            )
        self._moving = np.flatnonzero(self.coupling.moving)
        self._sensors = [_mujoco_parts.user_sensor(model, name) for name in sensors]
        for _, extent, kind, number in self._sensors:
            self._reading(extent, kind, number)
        self.reset()

    @property
    def simulation(self) -> Simulation:
        """Soft bodies."""
        return self.coupling.simulation

    def reset(self) -> None:
        """Put the soft bodies back to their start, after `mujoco.mj_resetData`."""
        self.coupling.reset(self._poses())
        self._time = self.data.time
        self.work_on_soft = self.work_on_rigid = 0.0
        self._made = self._exchanged = 0.0
        self._warned = False

    def step(self, count: int = 1) -> None:
        """Advance MuJoCo and the soft bodies by steps of the model, in the place of `mujoco.mj_step`.

        Parameters
        ----------
        count : int
            Number of steps.

        Raises
        ------
        InputError
            If MuJoCo was stepped or reset meanwhile, or its state is not finite.
        """
        for _ in range(count):
            self._step()
        self._write_sensors()

    def _step(self) -> None:
        model, data = self.model, self.data
        if abs(data.time - self._time) > 0.5 * model.opt.timestep:
            raise InputError(f"MjData is at {data.time} s and the soft bodies at {self._time} s: call step() instead of mj_step, and reset() after mj_resetData")
        if abs(model.opt.timestep - self.coupling.step) > 1e-12:
            raise InputError(f"the model's timestep is {model.opt.timestep} s, and was {self.coupling.step} s at the start: make a new SoftBody")
        mujoco.mj_step1(model, data)
        if data.time < self._time:
            raise InputError(f"MuJoCo reset itself at {self._time} s, since its state was not finite or too fast (its warnings say more): call reset()")
        mujoco.mj_getState(model, data, self._state, _STATE)
        velocity, others = data.qvel.copy(), data.xfrc_applied.copy()
        bodies, is_first = self._bodies, True

        def move(wrenches: Array) -> Array:
            nonlocal is_first
            if not is_first:
                mujoco.mj_setState(model, data, self._state, _STATE)
            is_first = False
            data.xfrc_applied[bodies] = others[bodies] + wrenches
            mujoco.mj_step2(model, data)
            return self._poses()

        self.coupling.advance(move)
        data.xfrc_applied[:] = others
        self._time = data.time
        self._account(velocity)

    def _poses(self) -> Array:
        """Poses of the bodies, by the positions at the end of the step."""
        end, data = self._end, self.data
        end.qpos[:], end.mocap_pos[:], end.mocap_quat[:] = data.qpos, data.mocap_pos, data.mocap_quat
        mujoco.mj_kinematics(self.model, end)
        return np.concatenate([end.xpos[self._bodies], end.xquat[self._bodies]], axis=1)

    def _account(self, velocity: Array) -> None:
        """Book the work of the wrenches: h·Q·(q̇ + q̇')/2, the change of kinetic energy that they made."""
        model, data, force = self.model, self.data, self._generalized
        force[:] = 0
        for row in self._moving:
            wrench = self.coupling.applied[row]
            if wrench.any():
                body = self._bodies[row]
                mujoco.mj_applyFT(model, data, wrench[:3], wrench[3:], data.xipos[body], body, force)
        on_rigid = self.coupling.step * float(force @ (velocity + data.qvel)) / 2
        driven = self.coupling.work.sum() - self.coupling.work[self._moving].sum()  # by bodies that forces do not move
        on_soft = float(self.simulation.energy["input"] - driven) - self.work_on_soft
        self.work_on_soft += on_soft
        self.work_on_rigid += on_rigid
        keep = 1 - 1 / _MEMORY
        self._made = keep * self._made + on_soft + on_rigid
        self._exchanged = keep * self._exchanged + (abs(on_soft) + abs(on_rigid)) / 2
        if not self._warned and self._made > _NOTHING + _SUSPECT * self._exchanged:
            self._warned = True
            warn(
                f"the coupling with MuJoCo makes energy, {self._made:.2g} J of {self._exchanged:.2g} J exchanged in some steps before {data.time:.3f} s: a body is light "
                "for the contact and the step; take a shorter timestep, more iterations, or armature at its joints"
            )

    @property
    def energy_error(self) -> float:
        """Energy that the coupling made so far [J]: what the soft bodies got and MuJoCo's did not give; negative when it was lost."""
        return self.work_on_soft + self.work_on_rigid

    @property
    def owed(self) -> Array:
        """Momentum [N·s] that MuJoCo's bodies get in the next step, (3,)."""
        owed: Array = self.coupling.owed[self._moving, :3].sum(axis=0)
        return owed

    @property
    def contacts(self) -> NDArray[np.void]:
        """Contacts at the end of the step: those of :attr:`Simulation.contacts`, with MuJoCo's numbers `body` and `geom`, -1 between soft bodies."""
        contacts = self.coupling.contacts
        renamed = [("geom" if field[0] == "shape" else field[0], *field[1:]) for field in contacts.dtype.descr]
        contacts = contacts.copy().view(np.dtype(renamed))
        is_rigid = contacts["body"] >= 0
        contacts["body"][is_rigid] = self._bodies[contacts["body"][is_rigid]]
        contacts["geom"][is_rigid] = np.array(self._geoms)[contacts["geom"][is_rigid]]
        return contacts

    def force(self, body: str | int | None = None, *, geom: str | int | None = None) -> Array:
        """Mean force of the soft bodies in the last step on a body, or on a geom [N, world], (3,).

        Parameters
        ----------
        body, geom : str or int
            Name or number of one of the two.
        """
        if (body is None) == (geom is None):
            raise InputError("give a body or a geom")
        every = self.coupling.wrenches[:, :3] if geom is None else self.coupling.shape_forces
        force: Array = every[self._body_row(body) if geom is None else self._geom_row(geom)].copy()
        return force

    def torque(self, body: str | int) -> Array:
        """Mean torque on a body about its centre of mass at the start of the step [N·m, world], (3,)."""
        return self.coupling.wrenches[self._body_row(body), 3:].copy()

    def pressing_force(self, geom: str | int) -> float:
        """Mean sum of the normal forces on a geom in the last step [N], as a touch sensor has it."""
        return float(self.coupling.pressing_forces[self._geom_row(geom)])

    def _geom_row(self, geom: str | int) -> int:
        number = _mujoco_parts.number_of(self.model.geom, "geom", geom)
        if number not in self._geoms:
            raise InputError(f"geom {geom!r} is not coupled: name it in geoms")
        return self._geoms.index(number)

    def _body_row(self, body: str | int | None) -> int:
        number = _mujoco_parts.number_of(self.model.body, "body", body)
        if number not in self._bodies:
            raise InputError(f"body {body!r} has no coupled geom: name one in geoms")
        return int(np.searchsorted(self._bodies, number))

    def _write_sensors(self) -> None:
        for address, extent, kind, number in self._sensors:
            self.data.sensordata[address : address + extent] = self._reading(extent, kind, number)

    def _reading(self, extent: int, kind: Any, number: int) -> Array:
        """Reading of a user sensor: pressing force (1), force (3), force and torque (6)."""
        model, data, coupling = self.model, self.data, self.coupling
        if kind == mujoco.mjtObj.mjOBJ_GEOM:
            row = self._geom_row(number)
            own: Array = coupling.pressing_forces[[row]] if extent == 1 else coupling.shape_forces[row]
            return own
        body = int(model.site_bodyid[number]) if kind == mujoco.mjtObj.mjOBJ_SITE else number
        row = self._body_row(body)
        if extent == 1:
            rows = [at for at, geom in enumerate(self._geoms) if model.geom_bodyid[geom] == body]
            return np.array([coupling.pressing_forces[rows].sum()])
        force, torque = coupling.wrenches[row, :3], coupling.wrenches[row, 3:]
        if kind == mujoco.mjtObj.mjOBJ_SITE:
            frame = data.site_xmat[number].reshape(3, 3)
            torque = torque + np.cross(data.xipos[body] - data.site_xpos[number], force)
            force, torque = force @ frame, torque @ frame
        return np.concatenate([force, torque])[:extent]

    def draw(self, scene: Any, rgba: ArrayLike = (0.8, 0.25, 0.2, 1)) -> None:
        """Add the deformed surfaces to a scene of MuJoCo's viewer or renderer, as triangles.

        Parameters
        ----------
        scene : mujoco.MjvScene
            `renderer.scene` after `update_scene`, or `viewer.user_scn` with `ngeom = 0`.
        rgba : (4,) array_like
            Colour.
        """
        _mujoco_parts.draw(scene, self.simulation, np.asarray(rgba, np.float32))
