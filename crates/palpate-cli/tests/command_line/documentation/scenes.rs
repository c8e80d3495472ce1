//! TOML of the pages: scenes, parts of scenes, and materials.

use super::{Block, blocks};
use crate::workplace::Workplace;
use palpate::{State, step};
use palpate_scene::{RunMode, read_scene};
use std::collections::BTreeSet;
use toml::{Table, Value};

/// Keys of a device that a page shows alone.
const OF_A_DEVICE: &[&str] = &["simulated", "driver", "mount", "limits"];

/// Tables of a scene.
const OF_A_SCENE: &[&str] = &["object", "device", "clamp", "probe", "plane", "obstacle"];

/// Values of a key, anywhere in a table.
fn values<'a>(value: &'a Value, key: &str, found: &mut Vec<&'a Value>) {
    match value {
        Value::Table(table) => {
            found.extend(table.get(key));
            table.values().for_each(|inner| values(inner, key, found));
        }
        Value::Array(list) => list.iter().for_each(|inner| values(inner, key, found)),
        _ => {}
    }
}

fn texts(document: &Value, key: &str) -> BTreeSet<String> {
    let mut found = Vec::new();
    values(document, key, &mut found);
    found.into_iter().filter_map(Value::as_str).map(str::to_string).collect()
}

/// A scene of a block: parts are completed by the objects that they name.
fn whole_scene(block: &Block, document: &Table) -> String {
    let mut text = block.text.clone();
    if OF_A_DEVICE.iter().any(|key| document.contains_key(*key)) {
        // A driver, a path and a simulated device exclude each other: the keys that need one bring it.
        let mover = if document.contains_key("driver") { "" } else { "path = { file = \"hand.csv\" }\n" };
        text = format!("[[device]]\nname = \"device\"\nmode = \"touch\"\n{mover}{text}");
    }
    if !document.contains_key("object") {
        let mut names = texts(&Value::Table(document.clone()), "object");
        names.insert("cube".into());
        for name in names {
            let body = if name == "bar" { "bar" } else { "cube" };
            text += &format!("\n[[object]]\nname = \"{name}\"\nrecording = \"{body}.palp\"\n");
        }
    }
    text
}

/// Row of a path for a file: where a device begins, or gravity.
fn row_of(document: &Value, file: &str) -> String {
    let mut devices = Vec::new();
    values(document, "device", &mut devices);
    let path_of =
        |device: &&Value| device.get("path").and_then(|path| path.get("file")?.as_str()) == Some(file);
    let device = devices.iter().filter_map(|list| list.as_array()).flatten().find(path_of);
    let point = device.filter(|device| device.get("mode").and_then(Value::as_str) == Some("held"));
    let point = point.and_then(|device| device.get("attach")?.get("point")?.as_array());
    let number =
        |value: &Value| value.as_float().or(value.as_integer().map(|whole| whole as f64)).unwrap_or(0.0);
    point.map_or("0,0.2,0".into(), |point| {
        point.iter().map(|value| number(value).to_string()).collect::<Vec<_>>().join(",")
    })
}

fn check_scene(block: &Block, document: &Table) -> Result<(), String> {
    let text = whole_scene(block, document);
    let whole: Value =
        Value::Table(text.parse().unwrap_or_else(|error| panic!("{}: {error}", block.place())));
    let workplace = Workplace::with_scene();
    let record = |source: &str, more: &[&str]| {
        let own =
            ["record", source, "--order", "1", "--young", "2000", "--poisson", "0.3", "--density", "110"];
        workplace.succeed(&[&own[..], &["--modes", "8", "--damping-ratio", "0.5"], more].concat());
    };
    for name in texts(&whole, "recording") {
        match name.as_str() {
            // A bar whose right face the page clamps, and a beam with fixed nodes.
            "bar.palp" => record("box:0.3x0.03x0.03/10x1x1", &["-o", "bar.palp"]),
            "beam.palp" => record("box:0.1x0.02x0.02/6x2x2", &["--fix", "x<-0.049", "-o", "beam.palp"]),
            "cube.palp" => {}
            other => return Err(format!("the recording {other} is not made here")),
        }
    }
    if texts(&whole, "response").contains("fir") || block.text.contains("cube.zarr") {
        let step = whole.get("step").map_or("0.001".into(), Value::to_string);
        record(
            "box:0.1x0.1x0.1/2x2x2",
            &["-o", "cube.palp", "--dense", "cube.zarr", "--step", &step, "--duration", "0.2"],
        );
    }
    let mut files = texts(&whole, "file");
    files.insert("hand.csv".into());
    for file in files {
        let row = row_of(&whole, &file);
        workplace.write(&file, format!("0,{row}\n1,{row}\n"));
    }
    workplace.write("scene.toml", &text);
    let scene = read_scene(&workplace.path("scene.toml"), RunMode::RealTime);
    let scene = scene.map_err(|error| {
        format!(
            "{error}
{text}"
        )
    })?;
    let mut state = State::new(&scene.model);
    let output = step(&scene.model, &mut state, &scene.input_at(0.0));
    match output.objects.iter().all(|object| object.pose.position.is_finite()) {
        true => Ok(()),
        false => Err("an object is nowhere".into()),
    }
}

/// A material file is read with a mesh that has its regions: one tetrahedron each.
fn check_materials(block: &Block, document: &Table) -> Result<(), String> {
    let workplace = Workplace::new();
    let regions = texts(&Value::Table(document.clone()), "region");
    let mut names = String::new();
    let (mut nodes, mut elements) = ("1 0 0 0\n2 0.1 0 0\n3 0 0.1 0\n".to_string(), String::new());
    for (at, region) in regions.iter().enumerate() {
        names += &format!("3 {} \"{region}\"\n", at + 1);
        let apex = at + 4;
        // A fan about the edge from node 1 to the next apexes.
        let (x, y, z) = [(0.0, 0.0, 0.1), (0.0, -0.1, 0.05), (0.0, 0.0, -0.1), (0.05, -0.1, -0.05)][at];
        nodes += &format!("{apex} {x} {y} {z}\n");
        let third = if at == 0 { 3 } else { apex - 1 };
        elements += &format!("{0} 4 2 {0} {0} 1 2 {third} {apex}\n", at + 1);
    }
    let (count, all) = (regions.len(), regions.len() + 3);
    workplace.write(
        "regions.msh",
        format!(
            "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n{count}\n{names}$EndPhysicalNames\n\
             $Nodes\n{all}\n{nodes}$EndNodes\n$Elements\n{count}\n{elements}$EndElements\n"
        ),
    );
    workplace.write("materials.toml", &block.text);
    let arguments = ["record", "regions.msh", "--materials", "materials.toml", "--modes", "3", "--dry-run"];
    let done = workplace.palpate(&arguments);
    if done.status.success() { Ok(()) } else { Err(String::from_utf8_lossy(&done.stderr).into_owned()) }
}

#[test]
fn scenes_and_materials_of_the_pages_are_read() {
    let (mut count, mut failures) = (0, Vec::new());
    for block in blocks("toml") {
        let has = |document: &Table, keys: &[&str]| keys.iter().any(|key| document.contains_key(*key));
        let checked = match block.text.parse::<Table>() {
            Err(error) => Err(error.to_string()),
            Ok(document) if document.contains_key("material") => check_materials(&block, &document),
            Ok(document) if has(&document, OF_A_SCENE) || has(&document, OF_A_DEVICE) => {
                check_scene(&block, &document)
            }
            Ok(_) => Err("no scene, no device, no material".into()),
        };
        failures.extend(checked.err().map(|what| format!("{}: {what}", block.place())));
        count += 1;
    }
    assert!(
        failures.is_empty(),
        "{}",
        failures.join(
            "

"
        )
    );
    assert!(count >= 15, "{count} blocks");
}
