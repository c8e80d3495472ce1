//! Attacks by files: damaged, cut, huge, or no files at all.

use crate::attack::{Attack, Verdict, require};
use crate::child::Ended;
use crate::random::Random;
use crate::workplace::Workplace;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Duration;

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "files", name: "damaged recordings", run: recordings },
    Attack { group: "files", name: "damaged stores", run: stores },
    Attack { group: "files", name: "a store that is cut while it is used", run: cut_store },
    Attack { group: "files", name: "damaged and cut logs", run: logs },
    Attack { group: "files", name: "hostile meshes", run: meshes },
    Attack { group: "files", name: "pipes, folders and devices in place of files", run: pipes },
];

/// Time that looking at one hostile file may take.
const BRIEF: Duration = Duration::from_secs(20);

/// Status of a command that has panicked.
const PANICKED: i32 = 101;

/// Runs a command on a hostile file: it must end by itself, and not by a panic. Gives whether it was refused.
fn survives(workplace: &Workplace, arguments: &str) -> Result<(bool, String), String> {
    let ended = workplace.start(arguments)?.end_within(BRIEF);
    let Ended { code, printed, .. } = ended.map_err(|what| format!("palpate {arguments}: {what}"))?;
    match code {
        Some(code) if code != PANICKED => Ok((code != 0, printed)),
        _ => Err(format!("palpate {arguments} ended with {code:?}: {printed}")),
    }
}

/// Copies of a file, each with one fault: cut, or with some bytes changed.
fn damaged(bytes: &[u8], count: usize, random: &mut Random) -> Vec<Vec<u8>> {
    let damage = |number: usize| {
        let mut copy = bytes.to_vec();
        match number % 4 {
            0 => copy.truncate(random.below(bytes.len())),
            // The head, where lengths and offsets stand.
            1 => copy[random.below(bytes.len().min(256))] ^= 1 << random.below(8),
            2 => copy[random.below(bytes.len())] = random.next() as u8,
            _ => {
                let at = random.below(bytes.len());
                let end = (at + 16).min(bytes.len());
                copy[at..end].fill(0xff);
            }
        }
        copy
    };
    (0..count).map(damage).collect()
}

fn recordings(workplace: &Workplace) -> Verdict {
    let bytes = workplace.read("cube.palp")?;
    let mut refused = 0;
    let copies = damaged(&bytes, 120, &mut Random(5));
    for (number, copy) in copies.iter().enumerate() {
        workplace.write("bad.palp", copy)?;
        let (is_refused, printed) = survives(workplace, "inspect bad.palp")?;
        require(is_refused || copy == &bytes, || format!("copy {number} was accepted: {printed}"))?;
        refused += usize::from(is_refused);
    }
    Ok(format!("{refused} of {} copies refused (the others are unchanged)", copies.len()))
}

/// All files of a folder.
fn files_of(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut paths: Vec<_> =
        entries.flat_map(|path| if path.is_dir() { files_of(&path) } else { vec![path] }).collect();
    paths.sort();
    paths
}

/// A store of a cube, and a scene that uses it.
fn record_store(workplace: &Workplace) -> Result<(), String> {
    workplace.succeed(
        "record box:0.1x0.1x0.1/2x2x2 --order 1 --young 2000 --poisson 0.3 --density 110 --rayleigh 2,2e-4 --modes 10 \
         -o small.palp --dense small.zarr --duration 0.2",
    )?;
    let scene = "step = 0.001\n[[object]]\nname = \"cube\"\nrecording = \"small.palp\"\nresponse = \"fir\"\n\
                 table = \"small.zarr\"\n[[device]]\nname = \"left\"\nmode = \"held\"\n\
                 attach = { object = \"cube\", point = [-0.05, 0.0, 0.0] }\npath = { file = \"still.csv\" }\n";
    workplace.write("still.csv", "0,-0.05,0,0\n0.05,-0.049,0,0\n5,-0.049,0,0\n")?;
    workplace.write("store.toml", scene)
}

fn stores(workplace: &Workplace) -> Verdict {
    record_store(workplace)?;
    workplace.succeed("run store.toml --duration 0.01")?;
    let mut random = Random(9);
    let mut kinds: BTreeMap<&str, (usize, usize)> = BTreeMap::new();
    for path in files_of(&workplace.path("small.zarr")).iter().step_by(3).take(25) {
        let bytes = std::fs::read(path).map_err(|error| error.to_string())?;
        if bytes.is_empty() {
            continue;
        }
        let kind = if path.extension().is_some_and(|kind| kind == "json") { "metadata" } else { "data" };
        for copy in damaged(&bytes, 8, &mut random) {
            std::fs::write(path, copy).map_err(|error| error.to_string())?;
            for command in ["inspect small.zarr", "run store.toml --duration 0.01"] {
                let (is_refused, _) = survives(workplace, command)?;
                let counts = kinds.entry(kind).or_default();
                counts.0 += usize::from(is_refused);
                counts.1 += 1;
            }
        }
        std::fs::write(path, bytes).map_err(|error| error.to_string())?;
    }
    workplace.succeed("run store.toml --duration 0.01")?;
    Ok(format!("refused of tried, by what was damaged: {kinds:?}; no panic"))
}

fn cut_store(workplace: &Workplace) -> Verdict {
    record_store(workplace)?;
    let run = workplace.start("run store.toml --realtime --duration 3")?;
    std::thread::sleep(Duration::from_millis(1000));
    for path in files_of(&workplace.path("small.zarr")) {
        let file = std::fs::OpenOptions::new().write(true).open(&path).map_err(|error| error.to_string())?;
        file.set_len(0).map_err(|error| error.to_string())?;
    }
    let ended = run.end()?;
    match ended.code {
        Some(0) => Ok("the run went on to its end".into()),
        Some(code) if code != PANICKED && ended.printed.contains("small.zarr") => {
            Ok(format!("status {code}: {}", ended.printed.lines().last().unwrap_or_default()))
        }
        code => Err(format!("it ended with {code:?}: {}", ended.printed)),
    }
}

fn logs(workplace: &Workplace) -> Verdict {
    workplace.succeed("run fingers.toml --realtime --duration 1 --log run.mcap")?;
    let bytes = workplace.read("run.mcap")?;
    let (mut read, mut refused) = (0, 0);
    for copy in damaged(&bytes, 80, &mut Random(13)) {
        workplace.write("bad.mcap", copy)?;
        let (is_refused, printed) = survives(workplace, "replay bad.mcap")?;
        require(!is_refused || printed.contains("bad.mcap"), || format!("the file is not named: {printed}"))?;
        *if is_refused { &mut refused } else { &mut read } += 1;
    }
    Ok(format!("80 copies: {read} read as far as they go, {refused} refused"))
}

fn meshes(workplace: &Workplace) -> Verdict {
    let head = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n";
    let nodes = "$Nodes\n4\n1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1\n$EndNodes\n";
    let element = "$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n";
    let huge = "$Nodes\n18446744073709551615\n1 0 0 0\n$EndNodes\n";
    let cases: [(&str, String); 12] = [
        ("empty.msh", String::new()),
        ("head.msh", head.into()),
        ("huge.msh", format!("{head}{huge}{element}")),
        ("many.msh", format!("{head}$Nodes\n4000000000\n1 0 0 0\n$EndNodes\n{element}")),
        ("nan.msh", format!("{head}{}{element}", nodes.replace("2 1 0 0", "2 nan 0 0"))),
        ("infinite.msh", format!("{head}{}{element}", nodes.replace("2 1 0 0", "2 1e999 0 0"))),
        ("flat.msh", format!("{head}{}{element}", nodes.replace("4 0 0 1", "4 1 1 0"))),
        ("index.msh", format!("{head}{nodes}{}", element.replace("2 3 4\n", "2 3 99\n"))),
        ("twice.msh", format!("{head}{nodes}{}", element.replace("1 2 3 4\n", "1 1 3 4\n"))),
        (
            "binary.msh",
            "$MeshFormat\n4.1 1 8\n\u{1}\u{0}\u{0}\u{0}\n$EndMeshFormat\n$Nodes\n\u{ff}\u{ff}".into(),
        ),
        (
            "points.vtk",
            "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 99999999999 float\n"
                .into(),
        ),
        ("long.stl", "solid ".repeat(2_000_000)),
    ];
    let material = "--young 2000 --poisson 0.3 --density 110 -o bad.palp";
    for (name, text) in &cases {
        workplace.write(name, text)?;
        let (is_refused, printed) = survives(workplace, &format!("record {name} {material}"))?;
        require(is_refused && printed.contains(name), || format!("{name}: {printed}"))?;
    }
    Ok(format!("{} meshes refused by name", cases.len()))
}

fn pipes(workplace: &Workplace) -> Verdict {
    let made = Command::new("mkfifo").arg(workplace.path("pipe")).status();
    require(made.is_ok_and(|status| status.success()), || "mkfifo failed".into())?;
    std::fs::create_dir(workplace.path("folder")).map_err(|error| error.to_string())?;
    for name in ["mesh.msh", "body.palp", "scene.toml", "run.mcap", "path.csv"] {
        let made = Command::new("ln").arg("-s").args([workplace.path("pipe"), workplace.path(name)]).status();
        require(made.is_ok_and(|status| status.success()), || "ln failed".into())?;
    }
    let text = String::from_utf8_lossy(&workplace.read("fingers.toml")?).into_owned();
    workplace.write("of_path.toml", text.replace("left.csv", "path.csv"))?;
    workplace.write("of_body.toml", text.replace("cube.palp", "body.palp"))?;
    workplace.write("of_zero.toml", text.replace("left.csv", "/dev/zero"))?;
    let material = "--young 2000 --poisson 0.3 --density 110 -o bad.palp";
    let commands = [
        format!("record mesh.msh {material}"),
        format!("record folder {material}"),
        "inspect body.palp".into(),
        "inspect folder".into(),
        "run scene.toml".into(),
        "run folder".into(),
        "run /dev/zero".into(),
        "run of_path.toml".into(),
        "run of_body.toml".into(),
        "run of_zero.toml".into(),
        "replay run.mcap".into(),
        "replay folder".into(),
        "serve run.mcap --no-browser".into(),
    ];
    for command in &commands {
        let (is_refused, printed) = survives(workplace, command)?;
        require(is_refused, || format!("palpate {command}: {printed}"))?;
    }
    Ok(format!("{} commands refused them at once", commands.len()))
}
