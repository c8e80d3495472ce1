"""Scenes as files: the text with other names of its files, and the files that were in memory."""

from __future__ import annotations

import contextlib
import errno
import json
import os
import re
from collections.abc import Mapping

from palpate import _palpate
from palpate._errors import FileError

#: File that a scene names: a key, and a string of TOML.
_FILE = re.compile(r"""\b(recording|table|file)(\s*=\s*)("(?:[^"\\\n]|\\.)*"|'[^'\n]*')""")


class SavedScene:
    """Text of a scene for another place, and the files that go beside it."""

    def __init__(
        self,
        text: str,
        folder: str,
        recordings: Mapping[str, _palpate.Recording],
        paths: Mapping[str, str],
        target: str,
    ) -> None:
        self.target = target
        beside = os.path.dirname(target)
        if not os.path.isdir(beside or "."):
            message = f"cannot write {target}: there is no folder {beside}"
            raise FileError(message, file=target, errno=errno.ENOENT)
        self.recordings: dict[str, _palpate.Recording] = {}
        self.paths: dict[str, str] = {}
        stem = os.path.splitext(os.path.basename(target))[0]
        names: dict[str, str] = {}
        # Objects that share a recording share its file.
        shared: dict[int, str] = {}
        for name, recording in recordings.items():
            names[name] = shared.setdefault(id(recording), f"{stem}-{_part(name)}.palp")
            self.recordings[names[name]] = recording
        for name, rows in paths.items():
            names[name] = f"{stem}-{_part(name)}.csv"
            self.paths[names[name]] = rows

        def renamed(match: re.Match[str]) -> str:
            key, equals, string = match.groups()
            name = json.loads(string) if string[0] == '"' else string[1:-1]
            if name in names:
                name = names[name]
            elif os.path.isabs(name) or "://" in name:
                return match.group()
            else:
                name = os.path.relpath(os.path.join(folder, name), beside or ".")
            return f"{key}{equals}{json.dumps(name, ensure_ascii=False)}"

        self.text = text if not names and _same(folder, beside) else _FILE.sub(renamed, text)

    def write(self) -> None:
        """Write all files, the scene last."""
        beside = os.path.dirname(self.target)
        for name, recording in self.recordings.items():
            recording.save(os.path.join(beside, name))
        for name, rows in self.paths.items():
            _write(os.path.join(beside, name), rows)
        _write(self.target, self.text)


def _part(name: str) -> str:
    """Part of a name as `<path of device finger>`, as it may stand in a file's name."""
    return name.strip("<>").partition(" of ")[2].replace(" ", "-")


def _same(first: str, second: str) -> bool:
    return os.path.realpath(first or ".") == os.path.realpath(second or ".")


def _write(path: str, text: str) -> None:
    partly = f"{path}.part"
    try:
        with open(partly, "w", encoding="utf-8") as file:
            file.write(text)
        os.replace(partly, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            os.remove(partly)
        raise FileError(f"cannot write {path}: {error.strerror}", file=path, errno=error.errno) from None
