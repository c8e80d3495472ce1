"""Contact forces from elastic objects that move freely, at 1 kHz or more.

>>> import palpate
>>> cube = palpate.record("box:0.1x0.1x0.1/4x4x4", material="paper", modes=30)
>>> scene = palpate.Scene([palpate.Object("cube", cube)], gravity=[0, -9.81, 0])
>>> simulation = palpate.Simulation(scene)
>>> series = simulation.run(steps=100)

Lengths are metres, times seconds, forces newtons; vectors are in world axes. A recording is made once of a mesh (:func:`record`) or read from
a file (:meth:`Recording.open`); a :class:`Scene` puts recordings among planes, obstacles and devices; a :class:`Simulation` steps it, a :class:`Batch` many of it; a
:class:`Session` runs it in real time.
"""

from palpate._coupling import RigidCoupling
from palpate._errors import (
    FileError,
    InputError,
    LogError,
    MeshError,
    PalpateError,
    PalpateWarning,
    RecordingError,
    SceneError,
    StepError,
)
from palpate._palpate import Batch, Log, Output, Recording, Session, Simulation, Snapshot, __version__, record
from palpate._scene import Clamp, Device, Object, Obstacle, Plane, Probe, Scene
from palpate._viewer import Viewer, view

__all__ = [
    "Batch",
    "Clamp",
    "Device",
    "FileError",
    "InputError",
    "Log",
    "LogError",
    "MeshError",
    "Object",
    "Obstacle",
    "Output",
    "PalpateError",
    "PalpateWarning",
    "Plane",
    "Probe",
    "Recording",
    "RecordingError",
    "RigidCoupling",
    "Scene",
    "SceneError",
    "Session",
    "Simulation",
    "Snapshot",
    "StepError",
    "Viewer",
    "__version__",
    "record",
    "view",
]
