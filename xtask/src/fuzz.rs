//! Fuzzing of the readers by libFuzzer: `fuzz/` is a workspace of its own, since its targets and all below them are built with its counters.
//!
//! Seeds come from `data/` and from the texts below; what a run finds grows in `fuzz/corpus`, which git ignores. An input that panics, takes
//! longer than [`SECONDS_PER_INPUT`] or more memory than [`MEGABYTES`] ends the run and lies in `fuzz/artifacts`.

use crate::machine;
use crate::process::{cargo_command, root, run_in};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Targets, as in `fuzz/Cargo.toml`.
pub const TARGETS: &[&str] = &["recording", "mesh", "path", "log", "scene", "store", "message"];

/// Times for a target [s].
pub const SECONDS: &[&str] = &["10", "60", "180", "600"];

/// Time limit of an input [s]: a hundred times what a model of the largest seed takes with its address checks, and more without.
const SECONDS_PER_INPUT: u32 = 10;

/// Memory limit [MB].
const MEGABYTES: u32 = 2048;

/// Counters and comparisons of libFuzzer, as cargo-fuzz has them built, by flags that the released compiler has. With checks of overflow, and without a
/// sanitizer: the readers have no unsafe code, and C libraries below them would not be instrumented. Panics, hangs and outsized memory are found all
/// the same, at half the time to build and several times the inputs.
const FLAGS: &[&str] = &[
    "--cfg",
    "fuzzing",
    "-Cdebug-assertions",
    "-Cpasses=sancov-module",
    "-Cllvm-args=-sanitizer-coverage-level=4",
    "-Cllvm-args=-sanitizer-coverage-inline-8bit-counters",
    "-Cllvm-args=-sanitizer-coverage-pc-table",
    "-Cllvm-args=-sanitizer-coverage-trace-compares",
];

/// Upper limit of the size of an input [bytes]: the largest seed.
const LARGEST_INPUT: u32 = 200_000;

/// Seeds of readers of texts. The first byte chooses the name of a mesh file, or the columns of a path; 0, 0, 1 parts mesh files.
const TEXTS: &[(&str, &str)] = &[
    (
        "mesh",
        "\u{5}$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n",
    ),
    (
        "mesh",
        "\u{5}$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 4 1 4\n3 1 0 4\n1\n2\n3\n4\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n$EndNodes\n$Elements\n1 1 1 1\n3 1 4 1\n1 1 2 3 4\n$EndElements\n",
    ),
    (
        "mesh",
        "\u{5}$NOD\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$ENDNOD\n$ELM\n1\n1 4 1 1 4 1 2 3 4\n$ENDELM\n",
    ),
    (
        "mesh",
        "\u{5}# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
    ),
    (
        "mesh",
        "\u{4}<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid><Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><Points>\
         <DataArray type=\"Float32\" Name=\"Points\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points><Cells><DataArray type=\"Int32\" \
         Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray><DataArray type=\"Int32\" Name=\"offsets\" format=\"binary\">BAAAAAQAAAA=</DataArray>\
         <DataArray type=\"UInt8\" Name=\"types\" format=\"appended\" offset=\"0\"/></Cells></Piece></UnstructuredGrid><AppendedData \
         encoding=\"base64\">_AQAAAAo=</AppendedData></VTKFile>",
    ),
    ("mesh", "\u{0}4 3 0 1\n1 0 0 0 1\n2 1 0 0 0\n3 0 1 0 0\n4 0 0 1 0\n\0\0\u{1}\u{1}1 4 1\n1 1 2 3 4 7\n"),
    (
        "mesh",
        "\u{6}MeshVersionFormatted 2\nDimension 3\nVertices 4\n0 0 0 1\n1 0 0 0\n0 1 0 0\n0 0 1 0\nTetrahedra 1\n1 2 3 4 2\nEnd\n",
    ),
    (
        "mesh",
        "\u{2}*VERTICES\n*INCLUDE a.node\n*ELEMENTS\nTET\n1 4 0\n1 1 2 3 4\n*MATERIAL m\nENU, 1000, 1e4, 0.3\n*SET s\n1\n*REGION\ns, m\n\0\0\u{1}\u{0}4 3 0 0\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n",
    ),
    (
        "mesh",
        "\u{3}*NODE, NSET=n\n1, 0, 0, 0\n2, 1, 0, 0\n3, 0, 1, 0\n4, 0, 0, 1\n5, 1, 1, 0\n*ELEMENT, TYPE=C3D4, ELSET=e\n1, 1, 2, 3, 4\n*ELEMENT, TYPE=C3D5\n2, 1, 2,\n5, 3, 4\n*ELSET, ELSET=f, GENERATE\n1, 2, 1\n*SOLID SECTION, ELSET=e, MATERIAL=m\n*MATERIAL, NAME=m\n*ELASTIC\n1e4, 0.3\n*DENSITY\n1000\n",
    ),
    ("mesh", "\u{7}v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"),
    ("mesh", "\u{7}OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n"),
    (
        "mesh",
        "\u{7}ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    ),
    (
        "mesh",
        "\u{7}solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n",
    ),
    ("path", "\0t,x,y,z\n0,0,0,0\n1,0,0.1,0\n"),
    ("path", "\u{1}t,x,y,z,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n1,0,0.1,0,0,1,0,0\n"),
    ("path", "\u{2}t,fx,fy,fz\n0,0,0,0\n1,0,0.1,0\n"),
    (
        "scene",
        "step = 0.001\ngravity = [0.0, -9.81, 0.0]\n[[object]]\nname = \"a\"\nrecording = \"a.palp\"\nposition = [0.0, 0.1, 0.0]\n\
         [[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\n[[device]]\nname = \"b\"\nmode = \"touch\"\n\
         tip_radius = 0.005\nfriction = 0.5\ncoupling = { stiffness = 200.0, damping = 0.5 }\npath = { file = \"a.csv\" }\n",
    ),
    ("store", "\0{\"zarr_format\":3,\"node_type\":\"group\",\"attributes\":{\"store_version\":1}}"),
    ("message", "{\"type\":\"press\",\"pointer\":7,\"mode\":\"touch\",\"position\":[0,0,0]}"),
    ("message", "{\"type\":\"set_physics\",\"gravity\":[0,-9.81,0],\"step\":0.001,\"friction\":0.5}"),
    ("message", "{\"device\":\"left\"}"),
];

/// Run targets for some time each.
pub fn run_targets(target: Option<&str>, seconds: Option<&str>, arguments: &[&str]) -> Result<(), String> {
    machine::need_c_compiler()?;
    let seconds = seconds.unwrap_or("60");
    let folder = root().join("fuzz");
    let targets: Vec<_> =
        TARGETS.iter().filter(|name| target.is_none_or(|target| target == **name)).collect();
    eprintln!("building the targets (some minutes the first time)");
    build(&folder, &targets)?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for together in targets.chunks(cores) {
        let started: Result<Vec<_>, String> =
            together.iter().map(|name| start(&folder, name, seconds, arguments)).collect();
        for (name, fuzzer) in together.iter().zip(started?) {
            let output = fuzzer.wait_with_output().map_err(|error| format!("{name}: {error}"))?;
            let said = String::from_utf8_lossy(&output.stderr);
            let runs = said.lines().find_map(|line| line.strip_prefix("stat::number_of_executed_units:"));
            if !output.status.success() {
                return Err(format!("fuzzing {name} has found something (fuzz/artifacts/{name}):\n{said}"));
            }
            println!("fuzzed {name} for {seconds} s: {} inputs", runs.unwrap_or("?").trim());
        }
    }
    Ok(())
}

/// Build targets. For a target by name, so that build scripts and macros have no counters, beside the workspace's own, whose versions
/// `fuzz/Cargo.lock` repeats: what it has built of them is used.
fn build(folder: &Path, targets: &[&&str]) -> Result<(), String> {
    let mut cargo = cargo_command();
    cargo.args(["build", "--release", "--locked", "--target", &host()?]);
    cargo.args(targets.iter().flat_map(|name| ["--bin", name]));
    cargo.env("CARGO_TARGET_DIR", root().join("target"));
    run_in(folder, cargo.env("CARGO_ENCODED_RUSTFLAGS", FLAGS.join("\u{1f}")))
}

/// Starts a built target; its output is kept for a failure.
fn start(folder: &Path, name: &str, seconds: &str, arguments: &[&str]) -> Result<Child, String> {
    let corpus = sow(name).map_err(|error| format!("the seeds of {name}: {error}"))?;
    let artifacts = folder.join("artifacts").join(name);
    std::fs::create_dir_all(&artifacts).map_err(|error| format!("{}: {error}", artifacts.display()))?;
    let mut fuzzer = Command::new(root().join("target").join(host()?).join("release").join(name));
    fuzzer.arg(&corpus).arg(format!("-artifact_prefix={}/", artifacts.display()));
    fuzzer.arg(format!("-max_total_time={seconds}")).arg(format!("-timeout={SECONDS_PER_INPUT}"));
    fuzzer.arg(format!("-rss_limit_mb={MEGABYTES}")).arg(format!("-max_len={LARGEST_INPUT}"));
    // The same inputs each time, as long as the code stays: a longer run by hand starts from what it has found.
    fuzzer.args(["-seed=1", "-verbosity=0", "-print_final_stats=1"]).args(arguments).current_dir(folder);
    let started = fuzzer.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    started.map_err(|error| format!("the fuzzer of {name} can't be started: {error}"))
}

/// Name of this machine's target, below which cargo puts what is built for it.
fn host() -> Result<String, String> {
    let output = Command::new("rustc").arg("-vV").output().map_err(|error| format!("rustc -vV: {error}"))?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    let host = said.lines().find_map(|line| line.strip_prefix("host: "));
    host.map(str::to_string).ok_or_else(|| "rustc -vV names no host".to_string())
}

/// Put the seeds of a target into its corpus. Gives the folder.
fn sow(target: &str) -> std::io::Result<PathBuf> {
    let corpus = root().join("fuzz/corpus").join(target);
    std::fs::create_dir_all(&corpus)?;
    let texts = TEXTS.iter().filter(|(of, _)| *of == target);
    for (at, (_, text)) in texts.enumerate() {
        std::fs::write(corpus.join(format!("seed_{at}")), text)?;
    }
    let files = match target {
        "recording" => files(&root().join("data/recordings"), "palp")?,
        "log" => files(&root().join("data/logs"), "mcap")?,
        _ => Vec::new(),
    };
    for (at, file) in files.iter().enumerate() {
        std::fs::copy(file, corpus.join(format!("file_{at}")))?;
    }
    Ok(corpus)
}

/// Files with an ending below a folder.
fn files(folder: &Path, ending: &str) -> std::io::Result<Vec<PathBuf>> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        if path.is_dir() {
            found.extend(files(&path, ending)?);
        } else if path.extension().is_some_and(|own| own == ending) {
            found.push(path);
        }
    }
    found.sort();
    Ok(found)
}
