"""Scenes: read from TOML, or built of dataclasses whose fields are the keys of a scene file.

Parts that are built in code become TOML, and the same parser reads it: it checks every value, and fills in the defaults.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any, Union

from palpate import _palpate
from palpate._errors import FileError, InputError, PalpateWarning, SceneError
from palpate._saved_scene import SavedScene
from palpate._toml import Texts, table

if TYPE_CHECKING:
    from numpy.typing import ArrayLike
    from typing_extensions import Self

    #: File with a path, `{"file": …, "repeat": True}`, or its rows: t [s], x, y, z [m], and qw, qx, qy, qz where orientations are allowed.
    PathLike = Union[str, os.PathLike[str], Mapping[str, Any], ArrayLike]


@dataclass
class Object:
    """Elastic body: `[[object]]` (docs/scene.md#hold-a-point).

    Fields that are None are left to the defaults of the scene file.

    Parameters
    ----------
    name : str
        Letters, digits, - and _.
    recording : Recording, str or path
        Recording, or its file.
    position : (3,) array_like, optional
        Centre of mass at the start [m, world].
    orientation : (4,) array_like, optional
        Quaternion w, x, y, z.
    velocity, angular_velocity : (3,) array_like, optional
        Motion at the start [m/s, rad/s, world].
    friction : float, optional
        Coulomb's coefficient against other objects [1], 0.5 without it.
    start : {"undeformed", "equilibrium"}, optional
        With fixed nodes: whether it sags at the start.
    path : file, dict or array_like, optional
        With fixed nodes: where its base goes, rows t [s], x, y, z [m].
    response, table : optional
        "fir" and a store, for direct convolution of a recorded table (docs/table.md).
    """

    name: str
    recording: _palpate.Recording | str | os.PathLike[str]
    position: ArrayLike | None = None
    orientation: ArrayLike | None = None
    velocity: ArrayLike | None = None
    angular_velocity: ArrayLike | None = None
    friction: float | None = None
    start: str | None = None
    path: PathLike | None = None
    response: str | None = None
    table: str | os.PathLike[str] | None = None


@dataclass
class Device:
    """Hand that holds a point, touches with a tip, or exerts a force: `[[device]]` (docs/scene.md#touch).

    Parameters
    ----------
    name : str
        Letters, digits, - and _.
    mode : {"touch", "held", "force"}
        Tip that touches, hand that has hold of a point, or prescribed force on a point.
    attach : dict, optional
        `{"object": name, "point": [x, y, z]}`: the point that is held, or that the force acts on [m, body frame].
    path : file, dict or array_like, optional
        Rows t [s], x, y, z [m], or t, fx, fy, fz [N]. Without it the caller of :meth:`Simulation.step` says where it is.
    tip_radius : float, optional
        Radius of the tip [m], 0 without it.
    patch_radius : float, optional
        Radius of the area that a force is spread over [m]; without it that of the tip.
    friction : float, optional
        Coulomb's coefficient of the tip [1], 0.5 without it.
    coupling : dict or "auto", optional
        `{"stiffness": k, "damping": d}` between hand and tip or point [N/m, N·s/m]. None: the hand is the tip.
    """

    name: str
    mode: str = "touch"
    attach: Mapping[str, Any] | None = None
    path: PathLike | None = None
    tip_radius: float | None = None
    patch_radius: float | None = None
    friction: float | None = None
    coupling: Mapping[str, float] | str | None = None


@dataclass
class Plane:
    """Floor, wall or table: `[[plane]]` (docs/scene.md#planes-and-obstacles).

    Parameters
    ----------
    normal : (3,) array_like
        Normal out of the solid side, of any length.
    point : (3,) array_like, optional
        Point on it [m, world]; or a `path`.
    name : str, optional
        "plane" without it.
    path : file, dict or array_like, optional
        Rows t [s], x, y, z [m], optionally qw, qx, qy, qz.
    friction : float, optional
        Coulomb's coefficient [1], 0.5 without it.
    """

    normal: ArrayLike
    point: ArrayLike | None = None
    name: str | None = None
    path: PathLike | None = None
    friction: float | None = None


@dataclass
class Obstacle:
    """Rigid body: `[[obstacle]]` (docs/scene.md#planes-and-obstacles), of one of the four shapes.

    Parameters
    ----------
    name : str, optional
        "obstacle" without it.
    sphere : dict, optional
        `{"radius": r}` [m].
    box : dict, optional
        `{"half_extents": [x, y, z]}` [m].
    capsule : dict, optional
        `{"radius": r, "half_length": l}` about a piece of its y axis [m].
    mesh : dict, optional
        `{"file": file, "scale": metres per unit}`, a closed surface.
    position : (3,) array_like, optional
        Origin of the shape [m, world].
    orientation : (4,) array_like, optional
        Quaternion w, x, y, z.
    path : file, dict or array_like, optional
        Rows t [s], x, y, z [m], optionally qw, qx, qy, qz, instead of the position.
    friction : float, optional
        Coulomb's coefficient [1], 0.5 without it.
    """

    name: str | None = None
    sphere: Mapping[str, float] | None = None
    box: Mapping[str, ArrayLike] | None = None
    capsule: Mapping[str, float] | None = None
    mesh: Mapping[str, Any] | None = None
    position: ArrayLike | None = None
    orientation: ArrayLike | None = None
    path: PathLike | None = None
    friction: float | None = None


@dataclass
class Clamp:
    """Face that a rigid frame holds: `[[clamp]]` (docs/scene.md#clamp-a-face).

    Parameters
    ----------
    name, object : str
        Names of the clamp and of its object.
    face : dict, optional
        `{"point": [x, y, z], "radius": r}`: the smooth face around a point, or the part of it within a radius [m, body frame].
    box : dict, optional
        `{"min": [x, y, z], "max": [x, y, z]}` instead: all triangles that lie in a box [m, body frame].
    max_cells : int, optional
        Upper limit of the cells whose mean displacement is held, 16 without it.
    path : file, dict or array_like, optional
        Rows t [s], x, y, z [m], optionally qw, qx, qy, qz; without it the face stays.
    """

    name: str
    object: str
    face: Mapping[str, Any] | None = None
    box: Mapping[str, Any] | None = None
    max_cells: int | None = None
    path: PathLike | None = None


@dataclass
class Probe:
    """Point whose displacement is recorded: `[[probe]]` (docs/scene.md#probe-a-displacement).

    Parameters
    ----------
    name, object : str
        Names of the probe and of its object.
    point : (3,) array_like
        Point near the surface [m, body frame].
    """

    name: str
    object: str
    point: ArrayLike


class Scene(_palpate.Scene):
    """Objects, devices and obstacles, ready to be simulated; immutable.

    Parameters
    ----------
    objects : iterable of Object
        Elastic bodies. Dicts with the same keys do as well, here and below.
    devices : iterable of Device
    planes : iterable of Plane
    obstacles : iterable of Obstacle
    clamps : iterable of Clamp
    probes : iterable of Probe
    gravity : array_like, optional
        Gravity [m/s²], or `{"file": rows}` with rows t, x, y, z of its course. None without it.
    step : float, optional
        Step [s], 0.001 without it.
    integrator, rigid_compliance, max_contact_points, max_contact_samples, solver_budget, sleep_after
        As in a scene file (docs/scene.md).
    folder : str or path
        Folder that files are looked for in.
    reference : bool
        Every surface node as a contact, and no object asleep: slow, to compare with.

    Raises
    ------
    SceneError
        If something cannot be used; `kind` and `key` say what.

    See Also
    --------
    Scene.load : scene of a file.
    Scene.from_toml : scene of a text.
    """

    def __new__(
        cls,
        objects: Iterable[Object | Mapping[str, Any]],
        *,
        devices: Iterable[Device | Mapping[str, Any]] = (),
        planes: Iterable[Plane | Mapping[str, Any]] = (),
        obstacles: Iterable[Obstacle | Mapping[str, Any]] = (),
        clamps: Iterable[Clamp | Mapping[str, Any]] = (),
        probes: Iterable[Probe | Mapping[str, Any]] = (),
        gravity: ArrayLike | Mapping[str, Any] | None = None,
        step: float | None = None,
        integrator: str | None = None,
        rigid_compliance: bool | None = None,
        max_contact_points: int | None = None,
        max_contact_samples: int | None = None,
        solver_budget: int | None = None,
        sleep_after: float | None = None,
        folder: str | os.PathLike[str] = ".",
        reference: bool = False,
    ) -> Self:
        texts = Texts()
        whole = {
            "step": step,
            "gravity": texts.path(gravity, "gravity") if isinstance(gravity, Mapping) else gravity,
            "integrator": integrator,
            "rigid_compliance": rigid_compliance,
            "max_contact_points": max_contact_points,
            "max_contact_samples": max_contact_samples,
            "solver_budget": solver_budget,
            "sleep_after": sleep_after,
        }
        lines = table(whole)
        groups: list[tuple[type, Iterable[Any]]] = [
            (Object, objects),
            (Device, devices),
            (Plane, planes),
            (Obstacle, obstacles),
            (Clamp, clamps),
            (Probe, probes),
        ]
        for kind, parts in groups:
            header = kind.__name__.lower()
            if isinstance(parts, (str, Mapping)) or not isinstance(parts, Iterable):
                raise InputError(f"{header}s is {parts!r}, expected a list of {kind.__name__}")
            for number, part in enumerate(parts):
                lines += [f"[[{header}]]", *table(_keys(part, kind, number, texts))]
        text = "\n".join(lines) + "\n"
        path = os.path.join(os.fspath(folder), _IN_CODE)
        try:
            return cls._read(text, path, texts.recordings, texts.paths, reference)
        except SceneError as error:
            raise _with_part(error, lines) from None

    @classmethod
    def load(cls, path: str | os.PathLike[str], *, reference: bool = False) -> Self:
        """Scene of a TOML file, whose files are looked for beside it.

        Parameters
        ----------
        path : str or path
        reference : bool
            Every surface node as a contact, and no object asleep: slow, to compare with.
        """
        # A number would be taken for an open file.
        path = os.fsdecode(path)
        try:
            with open(path, encoding="utf-8") as file:
                text = file.read()
        except OSError as error:
            message = f"cannot read the scene {path}: {error.strerror}"
            raise FileError(message, file=path, errno=error.errno) from None
        except UnicodeDecodeError:
            raise SceneError(f"{path}: it is not a text file; a scene is TOML", kind="syntax", file=path) from None
        except ValueError as error:
            raise InputError(f"the path {path!a} is not one of a file: {error}") from None
        return cls._read(text, path, {}, {}, reference)

    @classmethod
    def from_toml(cls, text: str, folder: str | os.PathLike[str] = ".", *, reference: bool = False) -> Self:
        """Scene of a TOML text (docs/scene.md).

        Parameters
        ----------
        text : str
        folder : str or path
            Folder that its files are looked for in.
        reference : bool
            Every surface node as a contact, and no object asleep: slow, to compare with.
        """
        return cls._read(text, os.path.join(os.fspath(folder), _IN_CODE), {}, {}, reference)

    _source: tuple[str, str, dict[str, _palpate.Recording], dict[str, str], bool]

    @classmethod
    def _read(
        cls,
        text: str,
        path: str | os.PathLike[str],
        recordings: dict[str, _palpate.Recording],
        paths: dict[str, str],
        reference: bool,
    ) -> Self:
        source = (text, os.fspath(path), recordings, paths, reference)
        scene = super().__new__(cls, *source)
        scene._source = source
        return scene

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write the scene to a TOML file, for :meth:`load` and the command line.

        What it has in memory goes to files beside it: recordings to `STEM-object-NAME.palp`, paths to `STEM-device-NAME.csv` and so on. Files that it
        names stay where they are, and are named from there.

        Parameters
        ----------
        path : str or path
            File, usually `*.toml`. It is whole or not there.

        Raises
        ------
        FileError
            If a file cannot be written.
        """
        text, source, recordings, paths, reference = self._source
        target = os.fspath(path)
        saved = SavedScene(text, os.path.dirname(source), recordings, paths, target)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", PalpateWarning)
            # It is what will be read, or nothing is written.
            super().__new__(type(self), saved.text, target, saved.recordings, saved.paths, reference)
        saved.write()

    def __reduce__(self) -> tuple[Any, ...]:
        return _again, (type(self), *self._source)


def _again(cls: type[Scene], *source: Any) -> Scene:
    """Scene of a pickle, whose remarks were made before."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PalpateWarning)
        return cls._read(*source)


#: Name of a text without a file in errors.
_IN_CODE = "<scene>"


def _keys(part: Any, kind: Any, number: int, texts: Texts) -> dict[str, Any]:
    """Keys of a part; its path and recording by the names that the text gives them."""
    header = kind.__name__.lower()
    if isinstance(part, Mapping):
        keys = dict(part)
    elif isinstance(part, kind):
        keys = {field.name: getattr(part, field.name) for field in fields(kind)}
    else:
        raise InputError(f"{header}s has {part!r}, expected palpate.{kind.__name__}")
    own = keys.get("name")
    name = f"{header} {own if isinstance(own, str) and own else number}"
    if keys.get("path") is not None:
        keys["path"] = texts.path(keys["path"], name)
    if isinstance(keys.get("recording"), _palpate.Recording):
        keys["recording"] = texts.recording(keys["recording"], name)
    return keys


def _with_part(error: SceneError, lines: list[str]) -> SceneError:
    """Error of a scene that is built in code: with the part in place of the line."""
    if error.line is None or error.kind == "syntax":
        return error
    above = lines[: error.line]
    header = next((at for at in reversed(range(len(above))) if above[at].startswith("[[")), None)
    if header is None:
        part = "scene"
    else:
        below = lines[header + 1 :]
        name = next((line.partition(" = ")[2] for line in below if line.startswith(("name = ", "[["))), "")
        part = f"{above[header].strip('[]')} {name}".strip()
    message = re.sub(r"^.*?: line \d+: ", "", str(error), count=1)
    # Files are named there; rows of an array count from 0.
    message = re.sub(r"\bpath: line (\d+): ", lambda line: f"path: row {int(line[1]) - 1}: ", message, count=1)
    return SceneError(f"{part}: {message}", kind=error.kind, key=error.key)
