"""Code blocks of docs/python.md, docs/mujoco.md and of the package's README, run as a reader would."""

import pathlib
import re
import struct

import numpy as np
import palpate
import pytest

ROOT = pathlib.Path(__file__).parents[3]


def blocks(file):
    text = (ROOT / file).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def write_stl(path, recording, scale):
    """Surface of a recording as binary STL."""
    corners = (recording.positions * scale)[recording.triangles].astype("<f4")
    with open(path, "wb") as file:
        file.write(bytes(80) + struct.pack("<I", len(corners)))
        for triangle in corners:
            file.write(struct.pack("<3f", 0, 0, 0) + triangle.tobytes() + b"\0\0")


@pytest.fixture
def reader(tmp_path, monkeypatch, palpate_run):
    """Folder of a reader who has an STL file, a scene and a log."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    monkeypatch.setattr("webbrowser.open_new_tab", lambda url: True)
    ball = palpate.record("sphere:0.04/3", material="liver", modes=5, order=1)
    write_stl("liver.stl", ball, 1000)
    return tmp_path


def test_the_code_of_the_page_runs(reader, palpate_run, capsys):
    pytest.importorskip("matplotlib")
    pytest.importorskip("trimesh")
    names = {}
    found = blocks("docs/python.md")
    assert len(found) >= 10
    for number, block in enumerate(found):
        if number == 3:
            # By now there is cube.palp.
            (reader / "hand.csv").write_text("0,0,0,0.2\n0.05,0,0,0.2\n")
            hand = '[[device]]\nname = "hand"\nmode = "touch"\npath = { file = "hand.csv" }\n'
            (reader / "scene.toml").write_text('[[object]]\nname = "cube"\nrecording = "cube.palp"\n' + hand)
            palpate_run("run", "scene.toml", "--realtime", "--log", "run.mcap")
        exec(compile(block, f"block {number} of docs/python.md", "exec"), names)
        if number == 0:
            force = names["series"]["forces"][:, 0, 2]
            # A press of 1 cm on a ball of liver, which is felt and ends.
            assert 0.1 < force.max() < 10 and force[0] == 0 and abs(force[-1]) < 0.3 * force.max()
            assert (reader / "force.png").read_bytes()[:4] == b"\x89PNG"
    printed = capsys.readouterr().out
    weight = names["cube"].mass * 9.81
    floor = next(line for line in printed.splitlines() if line.endswith(str(weight)))
    assert np.isclose(float(floor.split("]")[0].split()[-1]), weight, rtol=1e-3)
    assert 'object "cube": friction is -1, expected at least 0 and below 1e6' in printed


def test_the_code_of_the_readme_runs(reader, capsys):
    (block,) = blocks("bindings/python/README.md")
    exec(block, {})
    assert len(capsys.readouterr().out.split()) >= 7


def test_the_code_of_the_mujoco_page_runs(reader, capsys):
    pytest.importorskip("mujoco", reason="MuJoCo is not installed: pip install mujoco")
    names = {}
    found = blocks("docs/mujoco.md")
    assert len(found) >= 5
    for number, block in enumerate(found):
        before = names["mass"] * names["velocity"][2] if number == len(found) - 1 else 0
        exec(compile(block, f"block {number} of docs/mujoco.md", "exec"), names)
        if number == 0:
            # The finger rests on the cube.
            assert np.isclose(names["data"].sensor("touch").data[2], 0.1 * 9.81, rtol=0.01)
    coupling, velocity = names["coupling"], names["velocity"]
    falling = names["mass"] * 9.81 * 0.1  # N·s
    cube = names["cube"].mass * coupling.simulation.velocities[0, 2]
    assert np.isclose(names["mass"] * velocity[2] + cube + coupling.owed[0, 2], before - falling, rtol=1e-9)
    assert len(capsys.readouterr().out.splitlines()) >= 2


@pytest.mark.parametrize("page", ["python.md", "mujoco.md"])
def test_links_of_the_page_lead_somewhere(page):
    text = (ROOT / "docs" / page).read_text(encoding="utf-8")
    headings = {re.sub(r"[^\w -]", "", line.lstrip("# ").lower()).replace(" ", "-") for line in text.splitlines() if line.startswith("#")}
    for target in re.findall(r"\]\(([^)]+)\)", text):
        file, _, anchor = target.partition("#")
        assert (ROOT / "docs" / file).exists() if file else anchor in headings, target
