"""The page of a scene from Python."""

import os
import sys
import types
import urllib.error
import urllib.request

import palpate
import pytest

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


def test_a_notebook_shows_the_page_in_a_frame(on_floor, monkeypatch):
    opened = []
    monkeypatch.setattr("webbrowser.open_new_tab", lambda url: opened.append(url) or True)
    shell = types.SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", types.SimpleNamespace(get_ipython=lambda: shell))
    with palpate.view(on_floor, program=PROGRAM, height=300) as viewer:
        assert f'<iframe src="{viewer.url}" ' in viewer._repr_html_() and "height: 300px" in viewer._repr_html_()
        policy = urllib.request.urlopen(viewer.url).headers["content-security-policy"]
        assert "frame-ancestors http://localhost:* http://127.0.0.1:* " in policy
    assert opened == [] and "closed" in viewer._repr_html_()
    # A terminal with IPython is no notebook.
    shell.kernel = None
    with palpate.view(on_floor, program=PROGRAM) as viewer:
        assert opened == [viewer.url] and "<iframe" not in viewer._repr_html_()
        assert "frame-ancestors 'none'" in urllib.request.urlopen(viewer.url).headers["content-security-policy"]
