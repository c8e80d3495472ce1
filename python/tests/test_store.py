"""A store that `palpate record --dense` wrote, read with plain zarr: identities, and a second integrator.

The binary is what PALPATE names: PALPATE=target/release/palpate pytest python/tests
"""

import contextlib
import hashlib
import importlib.metadata
import json
import os
import pathlib
import socket
import subprocess
import sys
import time
import urllib.request

import numpy as np
import pytest
import zarr

EXAMPLES = pathlib.Path(__file__).resolve().parents[2] / "examples"
CELLS = 4
# Nodes of the cube, and those of its surface.
NODES, SURFACE = (CELLS + 1) ** 3, (CELLS + 1) ** 3 - (CELLS - 1) ** 3
BODY = [
    f"box:0.1x0.1x0.1/{CELLS}x{CELLS}x{CELLS}",
    *("--order", "1", "--young", "2000", "--poisson", "0.49", "--density", "110", "--rayleigh", "2,2e-4"),
]


def palpate():
    """The binary under test."""
    if not os.environ.get("PALPATE"):
        pytest.skip("PALPATE is not set: set it to the palpate binary, as in PALPATE=target/release/palpate")
    return str(pathlib.Path(os.environ["PALPATE"]).resolve())


def run(*words, env=None):
    """What a command prints; its error text when it fails."""
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True, env={**os.environ, **(env or {})})
    assert done.returncode == 0, f"{words} ended with {done.returncode}:\n{done.stderr}"
    return done.stdout


def record(store, *options, env=None):
    run(palpate(), "record", *BODY, "--dense", store, *options, env=env)


def inspect(store, env=None):
    return json.loads(run(palpate(), "inspect", store, "--json", env=env))


def hashes(folder):
    """SHA-256 of each file, by its place in the folder."""
    files = (path for path in pathlib.Path(folder).rglob("*") if path.is_file())
    return {str(path.relative_to(folder)): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


@pytest.fixture(scope="module")
def store(tmp_path_factory):
    """50 samples in f32."""
    place = tmp_path_factory.mktemp("store") / "cube.zarr"
    record(place, "--method", "transient", "--duration", "0.05", "--columns-per-shard", "12")
    return place


def test_a_store_opens_with_plain_zarr_as_a_table_of_columns_by_samples_by_places(store):
    table = zarr.open_group(store, mode="r")["impulse_response"]
    assert table.shape == (3 * SURFACE, 50, 3 * SURFACE)
    assert table.dtype == np.float32
    assert table.metadata.dimension_names == ("touchable_dof", "sample", "observed_dof")
    # A column is a chunk: read alone, it does not read its shard.
    assert table.shards == (12, 50, 3 * SURFACE)
    assert table.chunks == (1, 50, 3 * SURFACE)
    assert np.isfinite(table[:]).all()


def test_a_table_says_its_units_and_what_a_sample_is(store):
    group = zarr.open_group(store, mode="r")
    attributes = dict(group["impulse_response"].attrs)
    assert attributes["units"] == "m/N"
    assert attributes["hold"] == "held force, displacement at end of step"
    assert attributes["step_s"] == 0.001
    assert attributes["sampling"] == "end"
    assert attributes["mesh_hash"] == group.attrs["provenance"]["mesh_hash"]
    assert len(bytes.fromhex(attributes["mesh_hash"])) == 32


def test_a_store_says_what_body_it_is_of(store):
    attributes = zarr.open_group(store, mode="r").attrs
    assert attributes["materials"] == [{"region": "", "young_pa": 2000.0, "poisson": 0.49, "density_kg_m3": 110.0}]
    assert attributes["damping"] == {"rayleigh": {"alpha": 2.0, "beta": 0.0002}}
    assert attributes["mesh"] == {"nodes": NODES, "elements": 5 * CELLS**3, "order": 1, "fixed_nodes": 0}
    assert attributes["mass"]["mass_kg"] == pytest.approx(110 * 0.1**3, rel=1e-12)
    assert attributes["provenance"]["source"] == BODY[0]


def test_rows_and_columns_are_the_degrees_of_freedom_of_the_surface(store):
    group = zarr.open_group(store, mode="r")
    grid = np.stack(np.meshgrid(*[np.arange(CELLS + 1)] * 3, indexing="ij"), -1).reshape(-1, 3)
    surface = np.flatnonzero((grid % CELLS == 0).any(1))
    degrees_of_freedom = (3 * surface[:, None] + np.arange(3)).ravel()
    np.testing.assert_array_equal(group["touchable_dofs"][:], degrees_of_freedom)
    np.testing.assert_array_equal(group["observed_dofs"][:], degrees_of_freedom)
    assert group["touchable_dofs"].attrs["meaning"] == "3·node + axis"
    # Positions are those of the surface's nodes, about the centre of mass.
    np.testing.assert_array_equal(group["surface_source_nodes"][:], surface)
    np.testing.assert_allclose(group["surface_positions"][:], (grid[surface] / CELLS - 0.5) * 0.1, atol=1e-15)


# Two entries of f32 that come from one number may be a rounding apart; the numbers themselves agree to 1e-10.
@pytest.mark.parametrize("method", ["transient", "closed-form"])
@pytest.mark.parametrize("dtype, rounding", [("f32", np.finfo(np.float32).eps), ("f64", 0.0)])
def test_a_push_here_moves_there_as_a_push_there_moves_here(tmp_path, method, dtype, rounding):
    place = tmp_path / "cube.zarr"
    record(place, "--method", method, "--duration", "0.02", "--dtype", dtype)
    table = zarr.open_array(place / "impulse_response", mode="r")[:].astype(np.float64)
    apart = abs(table - table.transpose(2, 1, 0))
    assert (apart <= rounding * abs(table) + 1e-10 * abs(table).max()).all(), apart.max()


# Error of Newmark at h = 1/16 ms, as a share of the peak: 5.6e-4 was measured, and the order below says that it goes to 0
# from there. (A mode's phase is off by ωT·(ωh)²/12: 6e-4 for 400 rad/s after T = 30 ms.)
NEWMARK_SHARE = 1e-3
# Observed orders for h between 1/4 and 1/16 ms: 2 but for terms in h⁴.
ORDER_SLACK = 0.1


def test_columns_of_newmark_with_scipy_come_to_these_with_the_square_of_the_step(tmp_path):
    samples, columns = 30, 16
    place = tmp_path / "cube.zarr"
    exact = ("--method", "transient", "--substeps", "32", "--dtype", "f64")
    record(place, *exact, "--duration", samples * 1e-3, "--touchable", f"nodes:0-{(columns - 1) // 3}")
    table = zarr.open_array(place / "impulse_response", mode="r")[:columns]

    def error(substeps):
        words = ("--cells", CELLS, "--samples", samples, "--columns", columns, "--substeps", substeps)
        output = tmp_path / f"{substeps}.npy"
        run(sys.executable, EXAMPLES / "newmark_scipy.py", *words, "--dtype", "float64", "--output", output)
        return abs(np.load(output) - table).max() / abs(table).max()

    errors = np.array([error(substeps) for substeps in (4, 8, 16)])
    assert errors[-1] < NEWMARK_SHARE
    assert abs(np.log2(errors[:-1] / errors[1:]) - 2).max() < ORDER_SLACK, errors


@contextlib.contextmanager
def object_storage():
    """An S3 server with an empty bucket of the name `bucket`: environment for palpate, and a client."""
    boto3 = pytest.importorskip("boto3", reason="moto[server] is not installed")
    pytest.importorskip("moto.server", reason="moto[server] is not installed")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    address = f"http://127.0.0.1:{port}"
    env = dict(AWS_ENDPOINT_URL=address, AWS_ALLOW_HTTP="true", AWS_REGION="us-east-1")
    env.update(AWS_ACCESS_KEY_ID="test", AWS_SECRET_ACCESS_KEY="test")
    words = [sys.executable, "-m", "moto.server", "-H", "127.0.0.1", "-p", str(port)]
    server = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        for _ in range(300):
            with contextlib.suppress(OSError), urllib.request.urlopen(f"{address}/moto-api/"):
                break
            assert server.poll() is None, "moto's server ended"
            time.sleep(0.1)
        keys = dict(aws_access_key_id="test", aws_secret_access_key="test", region_name="us-east-1")
        client = boto3.client("s3", endpoint_url=address, **keys)
        client.create_bucket(Bucket="bucket")
        yield env, client
    finally:
        server.kill()
        server.wait()


def s3fs_is_new_enough():
    """Whether zarr can read s3:// here; pip may have chosen an old s3fs to suit boto3."""
    try:
        return int(importlib.metadata.version("s3fs").split(".")[0]) >= 2024
    except importlib.metadata.PackageNotFoundError:
        return False


def run_with_table(folder, place, env):
    """Drop the cube onto a floor by a table at an address, and by one in a folder: equal forces."""
    heights = []
    for table in (place, str(folder / "local.zarr")):
        scene = folder / "scene.toml"
        scene.write_text(
            f"""step = 0.001
gravity = [0.0, -9.81, 0.0]
[[object]]
name = "cube"
recording = "cube.palp"
table = "{table}"
response = "fir"
position = [0.0, 0.0505, 0.0]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 1.0, 0.0]
"""
        )
        csv = folder / "steps.csv"
        run(palpate(), "run", scene, "--duration", "0.02", "--csv", csv, env=env)
        heights.append(np.genfromtxt(csv, delimiter=",", names=True)["cubepy"])
    assert np.array_equal(*heights)
    # It fell, and the floor stopped it.
    assert 0.049 < heights[0][-1] < 0.0505


@pytest.mark.parametrize("prefix", ["", "tables/cube.zarr/"], ids=["whole bucket", "prefix"])
def test_a_store_on_s3_goes_on_after_a_stop_and_is_that_of_a_folder(tmp_path, prefix):
    options = ("--method", "transient", "--duration", "0.02", "--columns-per-shard", "48")
    with object_storage() as (env, client):
        place = f"s3://bucket/{prefix}".rstrip("/")
        record(place, *options, env=env)
        assert inspect(place, env=env)["shards_missing"] == []

        for shard in (0, 2, 5):
            client.delete_object(Bucket="bucket", Key=f"{prefix}impulse_response/c/{shard}/0/0")
        found = inspect(place, env=env)
        assert (found["shards_total"], found["shards_missing"], found["shards_damaged"]) == (7, [0, 2, 5], [])
        record(place, *options, "--shard", "1/2", env=env)
        assert inspect(place, env=env)["shards_missing"] == [0, 2]
        record(place, *options, env=env)
        assert inspect(place, env=env)["shards_missing"] == []

        if s3fs_is_new_enough():
            options_of_s3fs = dict(key="test", secret="test", endpoint_url=env["AWS_ENDPOINT_URL"])
            group = zarr.open_group(place, mode="r", storage_options=options_of_s3fs)
            assert np.isfinite(group["impulse_response"][:]).all()
        record(tmp_path / "local.zarr", *options, "--output", tmp_path / "cube.palp")
        run_with_table(tmp_path, place, env)
        fetched = tmp_path / "fetched.zarr"
        for item in client.list_objects_v2(Bucket="bucket")["Contents"]:
            to = fetched / item["Key"].removeprefix(prefix)
            to.parent.mkdir(parents=True, exist_ok=True)
            client.download_file("bucket", item["Key"], str(to))
    record(tmp_path / "folder.zarr", *options)
    assert hashes(fetched) == hashes(tmp_path / "folder.zarr")
    assert np.isfinite(zarr.open_array(fetched / "impulse_response", mode="r")[:]).all()
