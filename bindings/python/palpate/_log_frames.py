"""Logs in the forms of pandas and xarray, which are imported when they are asked for."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from palpate._palpate import Log

_AXES = ["x", "y", "z"]
#: Parts of a device's and an object's columns, as in the CSV of `palpate run`, with their units.
_DEVICE = [("positions", ["x", "y", "z"], "m"), ("forces", ["fx", "fy", "fz"], "N"), ("proxies", ["proxy_x", "proxy_y", "proxy_z"], "m")]
_POSE, _QUATERNION = ["px", "py", "pz"], ["qw", "qx", "qy", "qz"]
_LINEAR, _ANGULAR = ["vx", "vy", "vz"], ["wx", "wy", "wz"]


def to_pandas(log: Log) -> Any:
    """Data frame of a log."""
    pandas = _imported("pandas", "Log.to_pandas")
    columns: dict[str, NDArray[Any]] = {}
    units: dict[str, str] = {}

    def add(name: str, numbers: NDArray[Any], unit: str) -> None:
        columns[name], units[name] = numbers, unit

    def add_parts(part: str, names: list[str], rows: NDArray[Any], unit: str) -> None:
        for name, numbers in zip(names, rows.T):
            add(f"{part}.{name}", numbers, unit)

    for device in log.device_names:
        for attribute, names, unit in _DEVICE:
            add_parts(device, names, getattr(log, attribute)[device], unit)
    for part in log.object_names:
        pose, twist = log.poses[part], log.velocities[part]
        add_parts(part, _POSE, pose[:, :3], "m")
        add_parts(part, _QUATERNION, pose[:, 3:], "1")
        add_parts(part, _LINEAR, twist[:, :3], "m/s")
        add_parts(part, _ANGULAR, twist[:, 3:], "rad/s")
    for name, numbers in log.energy.items():
        add(f"energy.{name}", numbers, "J")
    add("lateness", log.lateness, "s")
    add("compute_time", log.compute_time, "s")
    frame = pandas.DataFrame(columns, index=pandas.Index(log.time, name="time"))
    frame.attrs["units"] = {"time": "s", **units}
    return frame


def to_xarray(log: Log) -> Any:
    """Data set of a log."""
    xarray = _imported("xarray", "Log.to_xarray")
    devices, objects, terms = log.device_names, log.object_names, list(log.energy)

    def stacked(rows: dict[str, NDArray[Any]], names: list[str], width: int) -> NDArray[Any]:
        """Rows of all parts, (time, part, …)."""
        return np.stack([rows[name] for name in names], axis=1) if names else np.empty((len(log), 0, width))

    poses, twists = stacked(log.poses, objects, 7), stacked(log.velocities, objects, 6)
    by_device, by_object = ("time", "device", "axis"), ("time", "object", "axis")
    variables = {
        "position": (by_device, stacked(log.positions, devices, 3), "m", "position of the hand, world"),
        "force": (by_device, stacked(log.forces, devices, 3), "N", "force on the hand, world"),
        "proxy": (by_device, stacked(log.proxies, devices, 3), "m", "position of the proxy, world"),
        "object_position": (by_object, poses[..., :3], "m", "centre of mass, world"),
        "orientation": (("time", "object", "quaternion"), poses[..., 3:], "1", "orientation, world from body"),
        "velocity": (by_object, twists[..., :3], "m/s", "velocity of the centre of mass, world"),
        "angular_velocity": (by_object, twists[..., 3:], "rad/s", "angular velocity, world"),
        "energy": (("time", "term"), np.stack([log.energy[term] for term in terms], axis=1), "J", "energy ledger"),
        "lateness": (("time",), log.lateness, "s", "delay of the cycle after its deadline"),
        "compute_time": (("time",), log.compute_time, "s", "compute time of the cycle"),
    }
    coordinates = {
        "time": ("time", log.time, {"units": "s", "long_name": "time at the end of the step"}),
        "device": devices,
        "object": objects,
        "axis": _AXES,
        "quaternion": ["w", *_AXES],
        "term": terms,
    }
    data = {name: (dims, numbers, {"units": unit, "long_name": text}) for name, (dims, numbers, unit, text) in variables.items()}
    return xarray.Dataset(data, coordinates, dict(log.metadata))


def _imported(module: str, function: str) -> Any:
    try:
        return importlib.import_module(module)
    except ModuleNotFoundError as error:
        raise ModuleNotFoundError(f"{function} needs {module}: pip install {module}", name=error.name) from error
