"""TOML of parts that are built in code, and the recordings and paths that it names."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from typing import Any

from palpate import _palpate
from palpate._errors import InputError


class Texts:
    """Recordings and paths in memory, by the names that the text gives them."""

    def __init__(self) -> None:
        self.recordings: dict[str, _palpate.Recording] = {}
        self.paths: dict[str, str] = {}

    def recording(self, recording: _palpate.Recording, part: str) -> str:
        """Name of a recording."""
        name = _unused(self.recordings, f"recording of {part}")
        self.recordings[name] = recording
        return name

    def path(self, path: Any, part: str) -> Mapping[str, Any]:
        """Entry of a path: a file, `{"file": …, "repeat": …}`, or rows of numbers."""
        entry = dict(path) if isinstance(path, Mapping) else {"file": path}
        rows = entry.get("file")
        if rows is not None and not isinstance(rows, (str, os.PathLike)):
            entry["file"] = _unused(self.paths, f"path of {part}")
            self.paths[entry["file"]] = _csv(rows, part)
        return entry


def _unused(taken: Mapping[str, Any], text: str) -> str:
    """Name in angle brackets that no other part has: an unnamed part 1 and one that is named "1" are two."""
    name, count = f"<{text}>", 1
    while name in taken:
        count += 1
        name = f"<{text} ({count})>"
    return name


def _csv(rows: Any, part: str) -> str:
    """Rows of numbers as CSV, to the bit."""
    import numpy as np

    try:
        given = np.asarray(rows)
        if given.dtype.kind == "c":
            raise TypeError("its numbers are complex")
        numbers = given.astype(float)
    except (TypeError, ValueError) as error:
        raise InputError(f"the path of {part} is no file and no array of numbers: {error}") from None
    if numbers.ndim != 2 or 0 in numbers.shape or numbers.shape[1] not in (4, 8):
        poses = "" if part.partition(" ")[0] in ("object", "device", "gravity") else ", or (rows, 8) with qw, qx, qy, qz"
        raise InputError(f"the path of {part} has the shape {numbers.shape}, expected (rows, 4): t, x, y, z{poses}")
    return "".join(",".join(map(repr, row)) + "\n" for row in numbers.tolist())


def table(keys: Mapping[str, Any]) -> list[str]:
    """Lines of a table; keys without a value are left out."""
    return [f"{_key(key)} = {_value(value, key)}" for key, value in keys.items() if value is not None]


def material_tables(tables: Any) -> str:
    """Text of a material file of its tables."""
    if isinstance(tables, Mapping) or not hasattr(tables, "__iter__"):
        raise InputError(f"materials is {tables!r}, expected a file, or a list of dicts with region, name or young, poisson and density")
    lines = []
    for own in tables:
        if not isinstance(own, Mapping):
            raise InputError(f"materials has {own!r}, expected a dict with region, name or young, poisson and density")
        lines += ["[[material]]", *table(own)]
    return "\n".join(lines) + "\n"


def _key(key: str) -> str:
    return key if key.replace("_", "").replace("-", "").isalnum() and key.isascii() else _text(key)


def _text(text: str) -> str:
    if not text.isascii():
        try:
            text.encode()
        except UnicodeEncodeError:
            raise InputError(f"{text!a} has characters that no text has (half of a surrogate pair)") from None
    # Strings of JSON are strings of TOML, but for one character.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _value(value: Any, key: str) -> str:
    if isinstance(value, (str, os.PathLike)):
        return _text(os.fspath(value))
    if isinstance(value, Mapping):
        inner = ", ".join(f"{_key(name)} = {_value(own, name)}" for name, own in value.items() if own is not None)
        return "{ " + inner + " }"
    if hasattr(value, "tolist"):  # arrays and scalars of NumPy
        value = value.tolist()
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, int):
        return str(value)
    if isinstance(value, float):
        return repr(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_value(own, key) for own in value) + "]"
    raise InputError(f"{key} is {value!r}, which a scene cannot hold: give a number, a text, a list, an array or a dict")
