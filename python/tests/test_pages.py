"""Python of the pages in docs/, run as a reader would: docs/contact.md, docs/export.md, docs/formats.md, docs/measured-objects.md,
docs/scene.md, docs/table.md. That of docs/python.md is run in bindings/python/tests/test_docs.py.

PALPATE=target/release/palpate pytest python/tests/test_pages.py
"""

import json
import os
import pathlib
import re
import subprocess

import blake3
import numpy as np
import palpate
import pytest

ROOT = pathlib.Path(__file__).parents[2]

SCENE = """
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "cube"
recording = "cube.palp"
position = [0.0, 0.05, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
[[device]]
name = "finger"
mode = "touch"
tip_radius = 0.01
patch_radius = 0.05
coupling = { stiffness = 200.0, damping = 0.5 }
path = { file = "finger.csv" }
"""


def blocks(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(r"^```python\n(.*?)^```$", text, flags=re.MULTILINE | re.DOTALL)


def run(*arguments):
    done = subprocess.run([os.environ.get("PALPATE", "palpate"), *arguments], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


RECORD = ["record", "box:0.1x0.1x0.1/3x3x3", "--order", "1", "--young", "2e4", "--poisson", "0.45", "--density", "1000"]


@pytest.fixture
def reader(tmp_path, monkeypatch):
    """Folder of a reader who has recorded a cube and pressed it on a floor."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("MPLBACKEND", "Agg")
    run(*RECORD, "--damping-ratio", "0.2", "--modes", "20", "-o", "cube.palp")
    (tmp_path / "scene.toml").write_text(SCENE)
    (tmp_path / "finger.csv").write_text("0,0,0.112,0\n0.3,0,0.106,0\n0.8,0,0.106,0\n")
    return tmp_path


def execute(page, names=None):
    names = {} if names is None else names
    found = blocks(page)
    assert found, page
    for number, block in enumerate(found):
        exec(compile(block, f"block {number} of {page}", "exec"), names)
    return names


def test_pages_with_python_are_named_here_or_in_the_package_s_tests():
    named = pathlib.Path(__file__).read_text(encoding="utf-8")
    named += (ROOT / "bindings/python/tests/test_docs.py").read_text(encoding="utf-8")
    for page in sorted((ROOT / "docs").glob("*.md")):
        assert not blocks(f"docs/{page.name}") or f'"docs/{page.name}"' in named, page


def test_contacts_and_steps_are_read_with_pandas(reader):
    run("run", "scene.toml", "--csv", "steps.csv", "--contacts", "contacts.csv", "--vtu", "frames", "--fps", "60")
    pressure = execute("docs/contact.md")["pressure"]
    assert (pressure >= 0).all() and pressure.max() > 0.1
    names = execute("docs/scene.md", {"pandas": __import__("pandas")})
    weight = json.loads(run("inspect", "cube.palp", "--json"))["mass_kg"] * 9.81
    # At rest the floor carries the cube, and the finger's 200 N/m of at most 6 mm.
    assert weight < names["floor"].fy.iloc[-1] < weight + 1.3
    frame = execute("docs/export.md")["frame"]
    assert len(frame.points) == len(frame.point_data["displacement"]) == 56


def test_a_table_is_read_with_zarr(reader):
    run(*RECORD, "--damping-ratio", "0.2", "--modes", "20", "--dense", "cube.zarr", "--step", "0.002", "--duration", "0.1")
    names = execute("docs/table.md")
    assert names["R"].shape[1] == 50 and np.isfinite(names["u"]).all() and names["u"].any()


def test_the_modulus_comes_out_of_an_indentation(reader, capsys):
    names = execute("docs/measured-objects.md")
    assert capsys.readouterr().out.endswith(" Pa\n")
    # The fitted block gives the measured force, by its own record and run.
    assert np.isclose(names["force"](names["young"]), names["MEASURED"], rtol=0.02)


@pytest.mark.parametrize("precision", ["compact", "full", "near"])
def test_the_reader_of_the_formats_page_gives_the_forces_of_palpate(tmp_path, monkeypatch, precision):
    """The page's reader knows nothing of palpate; its compliance times a displacement must be what a hand feels at rest."""
    monkeypatch.chdir(tmp_path)
    form = {"compact": [], "full": ["--precision", "full"], "near": ["--precision", "full", "--residual", "0.2"]}[precision]
    run(*RECORD, "--fix", "y<-0.049", "--damping-ratio", "0.9", "--modes", "12", *form, "-o", "cube.palp")
    recording = palpate.Recording.open("cube.palp")
    corner = int(np.argmax(recording.positions @ [1, 1, 1]))
    place = recording.positions[corner]
    (tmp_path / "scene.toml").write_text(
        '[[object]]\nname = "cube"\nrecording = "cube.palp"\n[[device]]\nname = "hand"\nmode = "held"\n'
        f'attach = {{ object = "cube", point = {place.tolist()} }}\npath = {{ file = "hand.csv" }}\n'
    )
    rows = [(0, *place), (0.5, *(place + [1e-3, -2e-3, 0.5e-3])), (3, *(place + [1e-3, -2e-3, 0.5e-3]))]
    (tmp_path / "hand.csv").write_text("".join(",".join(map(repr, map(float, row))) + "\n" for row in rows))
    run("run", "scene.toml", "--realtime", "--log", "run.mcap")

    names = execute("docs/formats.md")
    tensors, metadata = names["tensors"], names["read_recording"]("cube.palp")[0]
    own = json.loads(run("inspect", "cube.palp", "--json"))
    assert np.allclose(names["frequencies"], recording.frequencies, rtol=1e-14)
    assert np.array_equal(tensors["surface.positions"], recording.positions)
    assert np.array_equal(tensors["surface.triangles"], recording.triangles)
    shapes = names["phi"].reshape(len(recording.positions), 3, -1)
    assert np.array_equal(shapes, recording.mode_shapes)
    assert metadata["mass"]["mass_kg"] == recording.mass == own["mass_kg"]
    kind = {"compact": "residual.quantised", "full": "residual.packed", "near": "residual.blocks"}[precision]
    assert kind in tensors

    # The compliance against the steady force on the hand. A near-field S is tapered, but not at the point itself.
    own_rows = slice(3 * corner, 3 * corner + 3)
    stiffness = np.linalg.inv(names["compliance"][own_rows, own_rows])
    expected = -stiffness @ [1e-3, -2e-3, 0.5e-3]  # on the hand
    log = palpate.Log("run.mcap")
    assert np.allclose(log.forces["hand"][-1], expected, rtol=1e-5, atol=1e-6 * abs(expected).max())
    assert np.array_equal(names["force"], log.forces["hand"][:, 1])
    assert names["files"]["cube.palp"] == (tmp_path / "cube.palp").read_bytes()
    assert names["metadata"]["palpate"]["step_s"] == "0.001" and "cube" in names["metadata"]["start"]


def test_the_hash_of_a_recording_is_as_the_page_says(tmp_path):
    names = {}
    exec(blocks("docs/formats.md")[0], names)
    for sample in sorted((ROOT / "data/recordings").glob("*/*.palp")):
        data = sample.read_bytes()
        (length,) = names["struct"].unpack_from("<Q", data)
        entry = json.loads(data[8 : 8 + length])["__metadata__"]["palpate"]
        text = re.match(r'\{"metadata":(.*),"content_hash":"(\w+)"\}$', entry, flags=re.DOTALL)
        _, tensors = names["read_recording"](sample)
        digest = blake3.blake3(text[1].encode())
        for name, tensor in sorted(tensors.items()):
            extents = b"".join(extent.to_bytes(8, "little") for extent in tensor.shape)
            digest.update(name.encode() + extents + tensor.tobytes())
        assert digest.hexdigest() == text[2], sample


@pytest.mark.parametrize("log", sorted((ROOT / "data/logs").glob("*/*.mcap")), ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_logs_of_all_forms_are_read_as_the_package_reads_them(log):
    names = {}
    exec(blocks("docs/formats.md")[0], names)
    messages, files, metadata = names["read_log"](log)
    known = palpate.Log(log)
    for name in known.device_names:
        ours = [[step["devices"][name]["force"][axis] for axis in "xyz"] for _, _, step in messages["/step"]]
        assert np.array_equal(ours, known.forces[name])
    assert metadata["palpate"]["scene"] in files and len(messages["/tf"]) > 1


def test_an_embedded_surface_is_read_as_the_page_says(tmp_path):
    names = {}
    exec(blocks("docs/formats.md")[0], names)
    # The corners of a cube of eight cells, and triangles between them.
    corners = [[x, y, z] for z in (-0.05, 0.05) for y in (-0.05, 0.05) for x in (-0.05, 0.05)]
    faces = [(1, 3, 4, 2), (1, 2, 6, 5), (3, 7, 8, 4), (1, 5, 7, 3), (2, 4, 8, 6), (5, 6, 8, 7)]
    text = "".join("v {} {} {}\n".format(*corner) for corner in corners)
    (tmp_path / "box.obj").write_text(text + "".join("f {} {} {} {}\n".format(*face) for face in faces))
    cube = dict(young=2e4, poisson=0.3, density=1000, modes=6)
    plain = palpate.record("box:0.1x0.1x0.1/2x2x2", **cube)
    recording = palpate.record("box:0.1x0.1x0.1/2x2x2", surface=tmp_path / "box.obj", **cube)
    assert recording.positions.shape == (8, 3)
    recording.save(tmp_path / "cube.palp")
    metadata, tensors = names["read_recording"](tmp_path / "cube.palp")
    assert metadata["format_version"] == 4
    shapes = names["mode_shapes"](tensors).reshape(8, 3, 6)
    assert np.allclose(shapes, recording.mode_shapes, atol=1e-6 * abs(shapes).max())
    carried = names["weights"](tensors)
    assert np.allclose(carried.sum(axis=1), 1)
    S = names["residual_compliance"](tensors).reshape(carried.shape[1], 3, carried.shape[1], 3)
    S = np.einsum("na,axby,mb->nxmy", carried, S, carried).reshape(24, 24)
    assert np.allclose(S, recording.residual_compliance(), atol=1e-6 * abs(S).max())
    # A corner of the surface is one of the mesh. Modes of one frequency may be turned: what counts is the compliance.
    nearest = [int(np.argmin(np.linalg.norm(plain.positions - p, axis=1))) for p in recording.positions]
    own = abs(np.trace(S.reshape(8, 3, 8, 3)[0, :, 0, :]) / np.trace(plain.residual_compliance([nearest[0]])) - 1)
    assert own < 1e-2
