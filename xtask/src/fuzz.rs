//! Fuzzing of the readers by libFuzzer: `fuzz/` is a workspace of its own, since its targets need a nightly toolchain.
//!
//! Seeds come from `data/` and from the texts below; what a run finds grows in `fuzz/corpus`, which git ignores. An input that panics, takes
//! longer than [`SECONDS_PER_INPUT`] or more memory than [`MEGABYTES`] ends the run and lies in `fuzz/artifacts`.

use crate::machine::runs;
use crate::process::{root, run_in};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// Targets, as in `fuzz/Cargo.toml`.
pub const TARGETS: &[&str] = &["recording", "mesh", "path", "log", "scene", "store", "message"];

/// Times for a target [s].
pub const SECONDS: &[&str] = &["10", "60", "180", "600"];

/// Time limit of an input [s]: a hundred times what a model of the largest seed takes with the address sanitizer.
const SECONDS_PER_INPUT: u32 = 10;

/// Memory limit [MB].
const MEGABYTES: u32 = 2048;

/// Upper limit of the size of an input [bytes]: the largest seed.
const LARGEST_INPUT: u32 = 200_000;

/// Seeds of readers of texts. The first byte chooses a mesh reader, or the columns of a path.
const TEXTS: &[(&str, &str)] = &[
    (
        "mesh",
        "\0$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n",
    ),
    (
        "mesh",
        "\u{1}# vtk DataFile Version 3.0\nt\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n",
    ),
    ("mesh", "\u{2}v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n"),
    (
        "mesh",
        "\u{3}solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid s\n",
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

/// Run targets for some time each, or say why not.
pub fn run_targets(target: Option<&str>, seconds: Option<&str>) -> Result<(), String> {
    if !runs("cargo", &["+nightly", "--version"]) {
        println!("skipped: fuzzing needs a nightly toolchain: `rustup toolchain install nightly`");
        return Ok(());
    }
    if !runs("cargo", &["fuzz", "--version"]) {
        eprintln!("installing cargo-fuzz");
        if !runs("cargo", &["install", "--locked", "cargo-fuzz"]) {
            println!("skipped: cargo-fuzz is missing and could not be installed: `cargo install cargo-fuzz`");
            return Ok(());
        }
    }
    let seconds = seconds.unwrap_or("60");
    let folder = root().join("fuzz");
    let targets: Vec<_> =
        TARGETS.iter().filter(|name| target.is_none_or(|target| target == **name)).collect();
    eprintln!("building the targets (some minutes the first time)");
    run_in(&folder, Command::new("cargo").args(["+nightly", "fuzz", "build"]).args(target))?;
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    for together in targets.chunks(cores) {
        let started: Result<Vec<_>, String> =
            together.iter().map(|name| start(&folder, name, seconds)).collect();
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

/// Start a target; its output is kept for a failure.
fn start(folder: &Path, name: &str, seconds: &str) -> Result<Child, String> {
    let corpus = sow(name).map_err(|error| format!("the seeds of {name}: {error}"))?;
    let mut cargo = Command::new("cargo");
    cargo.args(["+nightly", "fuzz", "run", name]).arg(&corpus).arg("--");
    cargo.arg(format!("-max_total_time={seconds}")).arg(format!("-timeout={SECONDS_PER_INPUT}"));
    cargo.arg(format!("-rss_limit_mb={MEGABYTES}")).arg(format!("-max_len={LARGEST_INPUT}"));
    cargo.args(["-verbosity=0", "-print_final_stats=1"]).current_dir(folder);
    let started = cargo.stdout(Stdio::null()).stderr(Stdio::piped()).spawn();
    started.map_err(|error| format!("cargo fuzz can't be started: {error}"))
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
