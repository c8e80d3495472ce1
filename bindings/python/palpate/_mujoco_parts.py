"""Geoms and sensors of a model by name, and pictures of soft bodies. Imported by palpate.mujoco only."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, Union

import mujoco  # type: ignore[import-untyped, import-not-found, unused-ignore]
import numpy as np

from palpate._errors import InputError, warn
from palpate._mujoco_shapes import CAN_PRESS, name_of
from palpate._palpate import Recording, Simulation
from palpate._scene import Object

if TYPE_CHECKING:
    from numpy.typing import NDArray


def as_objects(objects: Union[Recording, Object, Sequence[Object]]) -> Sequence[Object]:
    """List of objects of what was given."""
    if isinstance(objects, Recording):
        return [Object("soft", objects)]
    return [objects] if isinstance(objects, Object) else list(objects)


def chosen_geoms(model: Any, geoms: Iterable[Union[str, int]] | None) -> list[int]:
    """Numbers of geoms by names or numbers; without them all that collide, with a warning about those that can't press."""
    if isinstance(geoms, str):
        raise InputError(f"geoms is {geoms!r}, expected a list of names")
    if geoms is not None:
        if not isinstance(geoms, Iterable):
            raise InputError(f"geoms is {geoms!r}, expected a list of names or numbers")
        return sorted({number_of(model.geom, "geoms", geom) for geom in geoms})
    all_geoms = [geom for geom in range(model.ngeom) if model.geom_contype[geom] or model.geom_conaffinity[geom]]
    chosen = [geom for geom in all_geoms if mujoco.mjtGeom(int(model.geom_type[geom])) in CAN_PRESS]
    if len(chosen) < len(all_geoms):
        names = ", ".join(name_of(model, geom) for geom in all_geoms if geom not in chosen)
        warn(f"height fields and signed distance fields do not meet soft bodies: {names}")
    return chosen


def number_of(find: Callable[[Any], Any], kind: str, given: Any) -> int:
    """Number of a part of the model by its name or number; `find` is the model's own function."""
    try:
        return int(find(given).id)
    except (KeyError, IndexError) as error:
        raise InputError(f"{kind}: {error.args[0]}") from None
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{kind}: there is no {given!r}, expected a name or a number") from None


def user_sensor(model: Any, name: str) -> tuple[int, int, Any, int]:
    """Address, extent, type of object and number of object of a user sensor."""
    sensor = number_of(model.sensor, "sensors", name)
    kind, extent = mujoco.mjtObj(int(model.sensor_objtype[sensor])), int(model.sensor_dim[sensor])
    objects = (mujoco.mjtObj.mjOBJ_BODY, mujoco.mjtObj.mjOBJ_XBODY, mujoco.mjtObj.mjOBJ_GEOM, mujoco.mjtObj.mjOBJ_SITE)
    extents = (1, 3) if kind == mujoco.mjtObj.mjOBJ_GEOM else (1, 3, 6)
    if mujoco.mjtSensor(int(model.sensor_type[sensor])) != mujoco.mjtSensor.mjSENS_USER or kind not in objects or extent not in extents:
        raise InputError(
            f'sensor {name!r} is not one that can be written: expected <user name="{name}" objtype="body", "geom" or "site" objname="…" dim="1", "3" or '
            '(not for a geom) "6"/>'
        )
    return int(model.sensor_adr[sensor]), extent, kind, int(model.sensor_objid[sensor])


def draw(scene: Any, simulation: Simulation, rgba: NDArray[np.float32]) -> None:
    """Add the deformed surfaces of all objects to a scene, as triangles."""
    for name in simulation.scene.object_names:
        corners = simulation.surface(name)[simulation.scene.triangles(name)]
        if scene.ngeom + len(corners) > scene.maxgeom:
            raise InputError(
                f"the scene holds {scene.maxgeom} geoms, and needs {scene.ngeom + len(corners)} with the {len(corners)} triangles of {name}: make it with a larger maxgeom"
            )
        for a, b, c in corners:
            along, across = b - a, c - a
            normal = np.cross(along, across)
            frame = np.stack([along, across, normal / max(float(np.linalg.norm(normal)), 1e-300)], axis=1)
            geom = scene.geoms[scene.ngeom]
            mujoco.mjv_initGeom(geom, mujoco.mjtGeom.mjGEOM_TRIANGLE, np.ones(3), a, frame.ravel(), rgba)
            scene.ngeom += 1
