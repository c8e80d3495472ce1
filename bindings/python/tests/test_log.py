"""Logs as arrays, against the columns that `palpate export` writes of the same log."""

import sys

import numpy as np
import palpate
import pytest

SCENE = """gravity = [0.0, 0.0, -9.81]
[[object]]
name = "cube"
recording = "cube.palp"
[[plane]]
name = "floor"
point = [0.0, 0.0, -0.05]
normal = [0.0, 0.0, 1.0]
[[device]]
name = "finger"
mode = "touch"
tip_radius = 0.005
patch_radius = 0.04
coupling = { stiffness = 500.0, damping = 1.0 }
path = { file = "finger.csv" }
"""


@pytest.fixture
def log(folder, palpate_run):
    """Folder with the log of a run in real time, and its columns."""
    (folder / "scene.toml").write_text(SCENE)
    (folder / "finger.csv").write_text("0,0,0,0.06\n0.2,0,0,0.052\n0.4,0,0,0.06\n")
    palpate_run("run", folder / "scene.toml", "--realtime", "--log", folder / "run.mcap")
    palpate_run("replay", folder / "run.mcap", "--csv", folder / "out.csv")
    return folder


def test_a_log_has_the_columns_of_its_replay(log):
    table = np.genfromtxt(log / "out.csv", delimiter=",", names=True, deletechars="")
    read = palpate.Log(log / "run.mcap")
    assert len(read) == len(table) == 400 and not read.is_cut
    assert read.device_names == ["finger"] and read.object_names == ["cube"]
    assert np.allclose(read.time, table["t"], atol=1e-12) and list(read.steps[:2]) == [1, 2]

    def columns(name, parts):
        return np.column_stack([table[f"{name}.{part}"] for part in parts])

    assert np.array_equal(read.positions["finger"], columns("finger", ["x", "y", "z"]))
    assert np.array_equal(read.forces["finger"], columns("finger", ["fx", "fy", "fz"]))
    assert np.array_equal(read.proxies["finger"], columns("finger", ["proxy_x", "proxy_y", "proxy_z"]))
    assert np.array_equal(read.poses["cube"], columns("cube", ["px", "py", "pz", "qw", "qx", "qy", "qz"]))
    assert np.array_equal(read.velocities["cube"], columns("cube", ["vx", "vy", "vz", "wx", "wy", "wz"]))
    for name in ["kinetic", "elastic", "dissipated"]:
        assert np.array_equal(read.energy[name], table[f"energy.{name}"])
    assert read.forces["finger"][:, 2].max() > 0.1
    assert read.lateness.shape == read.compute_time.shape == (400,) and (read.compute_time > 0).all()
    assert read.metadata["step_s"] == "0.001"


def test_a_log_without_its_end_is_read(log):
    whole = (log / "run.mcap").read_bytes()
    read = palpate.Log(log / "run.mcap")
    (log / "cut.mcap").write_bytes(whole[:-1])
    cut = palpate.Log(log / "cut.mcap")
    assert cut.is_cut and len(cut) == len(read)
    assert np.array_equal(cut.forces["finger"], read.forces["finger"])


def test_a_log_is_a_data_frame_with_units(log):
    pytest.importorskip("pandas")
    table = np.genfromtxt(log / "out.csv", delimiter=",", names=True, deletechars="")
    read = palpate.Log(log / "run.mcap")
    frame = read.to_pandas()
    assert frame.index.name == "time" and np.array_equal(frame.index, read.time)
    own = {"lateness", "compute_time"}
    # The columns of the CSV of the run that a log has, with its numbers.
    shared = [name for name in frame.columns if name not in own]
    assert len(shared) > 25 and set(shared) < set(table.dtype.names) and own < set(frame.columns)
    for name in shared:
        assert np.array_equal(frame[name], table[name]), name
    assert np.array_equal(frame["compute_time"], read.compute_time)
    units = frame.attrs["units"]
    assert set(units) == {"time", *frame.columns}
    expected = {"time": "s", "finger.x": "m", "finger.fz": "N", "cube.qw": "1", "cube.vx": "m/s", "cube.wz": "rad/s", "energy.elastic": "J", "lateness": "s"}
    assert {name: units[name] for name in expected} == expected
    assert frame["finger.fz"].idxmax() == read.time[read.forces["finger"][:, 2].argmax()]


def test_a_log_is_a_data_set_with_units(log):
    pytest.importorskip("xarray")
    read = palpate.Log(log / "run.mcap")
    data = read.to_xarray()
    assert dict(data.sizes) == {"time": 400, "device": 1, "object": 1, "axis": 3, "quaternion": 4, "term": len(read.energy)}
    assert np.array_equal(data.time, read.time) and data.time.attrs["units"] == "s" and data.attrs["step_s"] == "0.001"
    assert np.array_equal(data.force.sel(device="finger"), read.forces["finger"])
    assert np.array_equal(data.position.sel(device="finger", axis="z"), read.positions["finger"][:, 2])
    assert np.array_equal(data.proxy.sel(device="finger"), read.proxies["finger"])
    assert np.array_equal(data.object_position.sel(object="cube"), read.poses["cube"][:, :3])
    assert np.array_equal(data.orientation.sel(object="cube", quaternion="w"), read.poses["cube"][:, 3])
    assert np.array_equal(data.angular_velocity.sel(object="cube"), read.velocities["cube"][:, 3:])
    assert np.array_equal(data.energy.sel(term="elastic"), read.energy["elastic"])
    units = {name: data[name].attrs["units"] for name in data.data_vars}
    assert units == {
        "position": "m",
        "force": "N",
        "proxy": "m",
        "object_position": "m",
        "orientation": "1",
        "velocity": "m/s",
        "angular_velocity": "rad/s",
        "energy": "J",
        "lateness": "s",
        "compute_time": "s",
    }
    # The force of a time, by its coordinate.
    assert float(data.force.sel(time=0.2, method="nearest").sel(axis="z").item()) == read.forces["finger"][199, 2]


@pytest.mark.parametrize("module", ["pandas", "xarray"])
def test_a_missing_package_is_named(log, module, monkeypatch):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(ModuleNotFoundError, match=f"Log.to_{module} needs {module}: pip install {module}"):
        getattr(palpate.Log(log / "run.mcap"), f"to_{module}")()
