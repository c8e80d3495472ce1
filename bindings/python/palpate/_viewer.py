"""The page of `palpate serve` from Python."""

from __future__ import annotations

import atexit
import collections
import html
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import webbrowser
from typing import TYPE_CHECKING, Any, Union

from palpate._errors import FileError, PalpateError
from palpate._scene import Scene

if TYPE_CHECKING:
    from types import TracebackType

    PathLike = Union[str, "os.PathLike[str]"]

#: Lines of the server that an error repeats.
_LINES = 20
#: Origins of notebooks on this machine, which may show the page in a frame.
_NOTEBOOKS = ("http://localhost:*", "http://127.0.0.1:*", "https://localhost:*", "vscode-webview:")
#: Time that a server may take to end in good order, before it is killed [s].
_PATIENCE = 5
#: Viewers by the notebook's cell that has opened them, each with the number of that run of the cell.
_of_cells: dict[str, list[tuple[str, Viewer]]] = {}


class Viewer:
    """A page that shows a scene or a log, served by a process of `palpate serve` until :meth:`close`, or until Python ends; only where Python is killed it goes on.

    As the result of a notebook's cell it shows the page in a frame. It is a context manager, which closes it at the end.

    Attributes
    ----------
    url : str
        Address of the page, on this machine only.
    """

    def __init__(self, shown: Union[Scene, PathLike], program: str, log: PathLike | None, listen: str, height: int) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="palpate-view-")
        self._said: collections.deque[str] = collections.deque(maxlen=_LINES)
        self._found = threading.Event()
        self.url = ""
        self._height = height
        self._is_framed = _is_notebook()
        path = os.fspath(shown) if not isinstance(shown, Scene) else os.path.join(self._folder.name, "scene.toml")
        try:
            if isinstance(shown, Scene):
                shown.save(path)
            logged = [] if log is None else ["--log", os.fspath(log)]
            framed = [argument for origin in _NOTEBOOKS for argument in ("--frame-ancestor", origin)] if self._is_framed else []
            arguments = [program, "serve", path, "--no-browser", "--listen", listen, *logged, *framed]
            self._process = subprocess.Popen(
                arguments,
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
                errors="replace",
                # An interrupt of Python's work, as Ctrl-C, is none of the page.
                start_new_session=os.name == "posix",
            )
        except BaseException:
            self._folder.cleanup()
            raise
        atexit.register(self.close)
        self._reader = threading.Thread(target=self._read, name="palpate viewer", daemon=True)
        self._reader.start()
        try:
            # Ends with the server, too: a large scene may take its time.
            self._found.wait()
        except BaseException:
            self.close()
            raise
        if not self.url:
            self.close()
            raise PalpateError("palpate serve ended at once:\n" + "\n".join(self._said))

    def _read(self) -> None:
        """Read what the server says, so that it never waits for a reader, and find its address."""
        stream = self._process.stdout
        for line in stream or ():
            self._said.append(line.rstrip())
            address = re.match(r"open (https?://\S+)", line)
            if address is not None and not self.url:
                self.url = address.group(1)
                self._found.set()
        self._found.set()

    @property
    def is_open(self) -> bool:
        """Whether the page is still served."""
        return self._process.poll() is None

    def close(self) -> None:
        """End the server, and its log in good order. Closing again does nothing."""
        atexit.unregister(self.close)
        if self.is_open:
            # As Ctrl-C in a terminal does; Windows has no such signal for another process.
            self._process.send_signal(signal.SIGINT if os.name == "posix" else signal.SIGTERM)
            try:
                self._process.wait(_PATIENCE)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._process.wait()
        self._reader.join()
        if self._process.stdout is not None:
            self._process.stdout.close()
        self._folder.cleanup()

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        self.close()

    def __repr__(self) -> str:
        return f"<palpate.Viewer at {self.url}>" if self.is_open else "<palpate.Viewer, closed>"

    def _repr_html_(self) -> str:
        if not self.is_open:
            return "palpate's viewer is closed"
        address = html.escape(self.url)
        link = f'palpate shows the scene at <a href="{address}" target="_blank" rel="noopener">{address}</a>'
        if not self._is_framed:
            return link
        frame = f'<iframe src="{address}" title="palpate" style="width: 100%; height: {self._height}px; border: 0" allow="fullscreen"></iframe>'
        return f"{frame}<br>{link}"


def _is_notebook() -> bool:
    """Whether this runs in the kernel of a notebook."""
    return getattr(_shell(), "kernel", None) is not None


def _shell() -> Any:
    """Shell of IPython, if this runs in one."""
    ipython = sys.modules.get("IPython")
    return ipython.get_ipython() if ipython is not None else None


def _cell_and_run() -> tuple[str, str] | None:
    """Notebook's cell that runs, and the request that runs it; None where the notebook does not tell."""
    parent: dict[str, Any] = getattr(_shell(), "get_parent", dict)()
    cell, run = parent.get("metadata", {}).get("cellId"), parent.get("header", {}).get("msg_id")
    return (cell, run) if cell and run else None


def _close_of_earlier_runs(cell: str, run: str) -> None:
    """Close what earlier runs of a cell have shown, since its new output takes their place."""
    viewers = _of_cells.get(cell, [])
    _of_cells[cell] = [(own, viewer) for own, viewer in viewers if own == run]
    for own, viewer in viewers:
        if own != run:
            viewer.close()


def view(
    scene: Union[Scene, PathLike],
    *,
    open_browser: bool | None = None,
    log: PathLike | None = None,
    program: PathLike | None = None,
    listen: str = "127.0.0.1:0",
    height: int = 480,
) -> Viewer:
    """Show a scene in the browser or a notebook, in real time, to touch it with mouse, pen or fingers; or a log with a time line.

    The scene runs in a process of its own, which `palpate serve` is: what is touched there does not change a :class:`Simulation` here.

    Parameters
    ----------
    scene : Scene or path
        Scene, or a file: a scene (TOML) or a log (MCAP).
    open_browser : bool, optional
        Open the page in a new tab; False: only :attr:`Viewer.url` tells where it is. Without it a tab is opened, but not from a notebook, where
        the result of the cell is the page itself.
    log : path, optional
        File for a log of what is touched, for :class:`Log`.
    program : path, optional
        The command line's program; without it the environment variable PALPATE, or `palpate` on the path.
    listen : str
        Address and port of the page; port 0 is one that is free.
    height : int
        Height of the page in a notebook [pixels].

    Returns
    -------
    Viewer
        Keep it: the page ends with :meth:`Viewer.close`, or with Python. In a notebook it also ends when its cell runs again.

    Raises
    ------
    FileError
        If the program is not found, or the scene cannot be written.
    PalpateError
        If the server ends at once, with what it said.

    Examples
    --------
    >>> viewer = palpate.view(scene)  # doctest: +SKIP
    >>> viewer.close()  # doctest: +SKIP
    """
    named = os.environ.get("PALPATE", "palpate") if program is None else os.fspath(program)
    found = shutil.which(named)
    if found is None:
        raise FileError(f"the program {named!r} is not found, and palpate.view needs it: `cargo install --path crates/palpate-cli`, or give program=")
    cell = _cell_and_run()
    if cell is not None:
        _close_of_earlier_runs(*cell)
    viewer = Viewer(scene, found, log, listen, height)
    if cell is not None:
        _of_cells[cell[0]].append((cell[1], viewer))
    if open_browser or open_browser is None and not viewer._is_framed:
        webbrowser.open_new_tab(viewer.url)
    return viewer
