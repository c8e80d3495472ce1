"""Exceptions and warnings."""

from __future__ import annotations

import os
import sys
import warnings
from typing import Any

__all__ = [
    "FileError",
    "InputError",
    "LogError",
    "MeshError",
    "PalpateError",
    "PalpateWarning",
    "RecordingError",
    "SceneError",
    "StepError",
]


class PalpateError(Exception):
    """Anything that palpate refuses, with a text that says what to do.

    Attributes
    ----------
    kind : str or None
        Kind, for programs: as `out_of_range`, `unknown_value`, `grasp`.
    file : str or None
        File that is at fault.
    line : int or None
        Line in the scene, from 1.
    key : str or None
        Key of the scene.
    """

    def __init__(
        self,
        message: str = "",
        *,
        kind: str | None = None,
        file: object = None,
        line: int | None = None,
        key: str | None = None,
    ) -> None:
        super().__init__(message)
        self.kind = kind
        self.file = None if file is None else str(file)
        self.line = line
        self.key = key

    def __str__(self) -> str:
        return str(self.args[0]) if self.args else ""


class SceneError(PalpateError):
    """Scene that cannot be used; `file`, `line` and `key` say where."""


class RecordingError(PalpateError):
    """Recording that is damaged, or body that cannot be recorded."""


class MeshError(PalpateError):
    """Mesh that cannot be read or used."""


class LogError(PalpateError):
    """Log that cannot be read."""


class InputError(PalpateError, ValueError):
    """Argument with a wrong shape, type or value."""


class StepError(PalpateError):
    """Step that could not be followed: hands or bodies move too far in it.

    Attributes
    ----------
    rows : list of int or None
        Rows of a Batch whose step it was.
    series : dict or None
        Series of the steps before, and of this one, of :meth:`Simulation.run`.
    """

    rows: list[int] | None = None
    series: dict[str, Any] | None = None


class FileError(PalpateError, OSError):
    """File that cannot be read or written.

    Attributes
    ----------
    errno, strerror, filename
        As of every OSError; None where it was not the operating system that refused.
    """

    def __init__(self, message: str = "", *, errno: int | None = None, file: object = None, kind: str | None = None, **more: Any) -> None:
        super().__init__(message, kind=kind, file=file, **more)
        self.errno = errno
        self.strerror = None if errno is None else os.strerror(errno)
        self.filename = self.file


class PalpateWarning(UserWarning):
    """What a scene or a recording can do, but its author hardly means."""


def warn(message: str) -> None:
    """Warn at the line that called the package, however deep in it the reason is."""
    try:
        frame, level = sys._getframe(1), 2
    except ValueError:
        # A thread of the extension module has no line of Python.
        warnings.warn(message, PalpateWarning, stacklevel=1)
        return
    while frame.f_back is not None and str(frame.f_globals.get("__name__")).partition(".")[0] == "palpate":
        frame, level = frame.f_back, level + 1
    warnings.warn(message, PalpateWarning, stacklevel=level)
