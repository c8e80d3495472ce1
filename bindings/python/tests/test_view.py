"""The page of a scene from Python."""

import os
import re
import sys
import types
import urllib.error
import urllib.request

import jupyter_client
import palpate
import pytest
from waiting import until

PROGRAM = os.environ.get("PALPATE", "palpate")


def floor():
    return palpate.Plane(name="floor", point=[0, 0, -0.05], normal=[0, 0, 1])


def test_a_scene_in_memory_is_served_until_it_is_closed(cube, tmp_path):
    finger = palpate.Device("finger", tip_radius=0.01)
    scene = palpate.Scene([palpate.Object("cube", cube)], planes=[floor()], devices=[finger], gravity=[0, 0, -9.81])
    log = tmp_path / "touched.mcap"
    with palpate.view(scene, open_browser=False, log=log, program=PROGRAM) as viewer:
        assert viewer.is_open and viewer.url in viewer._repr_html_() and viewer.url in repr(viewer)
        with urllib.request.urlopen(viewer.url) as page:
            assert page.status == 200
        folder = viewer._folder.name
        assert os.path.exists(folder)
        # A log without steps is not kept: wait until it has grown by some.
        sizes = {0}
        until(lambda: sizes.add((tmp_path / "touched.mcap.part").stat().st_size) or len(sizes) > 2)
    assert not viewer.is_open and not os.path.exists(folder)
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(viewer.url, timeout=5)
    viewer.close()
    # Its log is whole: the scene was this one, and the finger a pointer of the page.
    logged = palpate.Log(log)
    assert [list(names) for names in (logged.object_names, logged.device_names)] == [["cube"], ["finger"]]


def test_files_are_served_too(folder):
    scene = folder / "scene.toml"
    scene.write_text('[[object]]\nname = "cube"\nrecording = "cube.palp"\n')
    with palpate.view(scene, open_browser=False, program=PROGRAM) as viewer:
        assert urllib.request.urlopen(viewer.url).status == 200


def test_what_cannot_be_shown_is_said(cube, tmp_path):
    with pytest.raises(palpate.FileError, match="cargo install"):
        palpate.view(tmp_path / "scene.toml", program=tmp_path / "no-such-program")
    with pytest.raises(palpate.PalpateError, match="ended at once[^$]*scene.toml"):
        palpate.view(tmp_path / "scene.toml", open_browser=False, program=PROGRAM)
    hand = palpate.Device("hand", mode="held", attach={"object": "cube", "point": [0.05, 0, 0]})
    with pytest.raises(palpate.PalpateError, match="the device needs path"):
        palpate.view(palpate.Scene([palpate.Object("cube", cube)], devices=[hand]), open_browser=False, program=PROGRAM)


def test_the_browser_is_asked_to_open_the_page(on_floor, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open_new_tab", lambda url: opened.append(url) or True)
    with palpate.view(on_floor, program=PROGRAM) as viewer:
        assert opened == [viewer.url]


@pytest.fixture
def run_cell(folder):
    """Function that runs a cell in the kernel of a notebook, and gives its result as HTML. Scenes are of `folder`."""
    manager, client = jupyter_client.manager.start_new_kernel(cwd=str(folder), env={**os.environ, "PALPATE": os.path.abspath(PROGRAM)})

    def run(cell, code):
        content = {"code": code, "silent": False, "store_history": True, "user_expressions": {}, "allow_stdin": False}
        # As JupyterLab and VS Code send it.
        request = client.session.msg("execute_request", content, metadata={"cellId": cell})
        client.shell_channel.send(request)
        shown = ""
        while True:
            message = client.get_iopub_msg(timeout=60)
            kind, content = message["msg_type"], message["content"]
            if message["parent_header"].get("msg_id") != request["header"]["msg_id"]:
                continue
            assert kind != "error", "\n".join(content["traceback"])
            if kind == "execute_result":
                shown += content["data"].get("text/html", "")
            if kind == "status" and content["execution_state"] == "idle":
                return shown

    yield run
    client.stop_channels()
    manager.shutdown_kernel()


def test_a_notebook_shows_the_page_in_a_frame_until_its_cell_runs_again(run_cell, folder):
    (folder / "scene.toml").write_text('[[object]]\nname = "cube"\nrecording = "cube.palp"\n')
    run_cell("first", "import palpate")
    shown = run_cell("shown", "palpate.view('scene.toml', height=300, log='run.mcap')")
    (frame,) = re.findall('<iframe src="(http://[^"]*)" ', shown)
    assert "height: 300px" in shown
    policy = urllib.request.urlopen(frame).headers["content-security-policy"]
    assert "frame-ancestors http://localhost:* http://127.0.0.1:* " in policy
    # The log is free again, and the first page has ended; those of other cells and of the same run go on.
    pages = "[palpate.view('scene.toml'), palpate.view('scene.toml')][1]"
    others = re.findall('<iframe src="(http://[^"]*)" ', run_cell("other", pages) + run_cell("shown", "palpate.view('scene.toml', log='run.mcap')"))
    with pytest.raises(urllib.error.URLError):
        urllib.request.urlopen(frame, timeout=5)
    assert len(others) == 2
    assert [urllib.request.urlopen(other).status for other in others] == [200, 200]
    are_open = run_cell("asked", "type('H', (), {'_repr_html_': lambda _: str([v.is_open for c in palpate._viewer._of_cells.values() for _, v in c])})()")
    assert are_open == "[True, True, True]"


def test_a_terminal_with_ipython_is_no_notebook(on_floor, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open_new_tab", lambda url: opened.append(url) or True)
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: types.SimpleNamespace(kernel=None)))
    with palpate.view(on_floor, program=PROGRAM) as viewer:
        assert opened == [viewer.url] and "<iframe" not in viewer._repr_html_()
        assert "frame-ancestors 'none'" in urllib.request.urlopen(viewer.url).headers["content-security-policy"]
