//! Stores of impulse responses: written, interrupted, shared, damaged, and used in scenes.

use crate::workplace::{CUBE, SCENE, Table, Workplace, with_memory};
use palpate::{Column, Recording};
use palpate_store::{Location, TableStore};
use palpate_testkit::{Random, made_once_per_run, wait_until};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// The table of a cube of 4³ cells by time integration, in 49 shards: some seconds of work.
const TABLE: [&str; 20] = [
    "record",
    "box:0.1x0.1x0.1/4x4x4",
    "--order",
    "1",
    "--young",
    "2000",
    "--poisson",
    "0.3",
    "--density",
    "110",
    "--rayleigh",
    "2,2e-4",
    "--method",
    "transient",
    "--duration",
    "0.08",
    "--columns-per-shard",
    "6",
    "--dense",
    "t.zarr",
];

/// Every file below a folder; none where there is no folder.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut waiting = vec![folder.to_path_buf()];
    while let Some(place) = waiting.pop() {
        for entry in std::fs::read_dir(&place).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() { waiting.push(path) } else { found.push(path) }
        }
    }
    found
}

/// Every file below a folder with its bytes.
fn contents(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let named = |path: &PathBuf| path.strip_prefix(folder).expect("below").to_path_buf();
    files(folder).iter().map(|path| (named(path), std::fs::read(path).expect("a file"))).collect()
}

/// Copy of a folder.
fn copy(from: &Path, to: &Path) {
    for (name, bytes) in contents(from) {
        let file = to.join(name);
        std::fs::create_dir_all(file.parent().expect("a folder")).expect("a writable folder");
        std::fs::write(file, bytes).expect("a writable folder");
    }
}

/// The store of [`TABLE`] as an undisturbed run leaves it, and what that run printed; made once per run of the tests.
fn whole_store() -> (PathBuf, String) {
    let folder = made_once_per_run(Path::new(env!("CARGO_TARGET_TMPDIR")), "store", |folder| {
        let workplace = Workplace::new();
        std::fs::write(folder.join("printed"), workplace.succeed(&TABLE)).expect("a writable folder");
        copy(&workplace.path("t.zarr"), &folder.join("t.zarr"));
    });
    (folder.join("t.zarr"), std::fs::read_to_string(folder.join("printed")).expect("text"))
}

/// A workplace with a copy of the whole store.
fn with_whole_store() -> Workplace {
    let workplace = Workplace::new();
    copy(&whole_store().0, &workplace.path("t.zarr"));
    workplace
}

/// Number of files of a store that are whole: a writer's own files have a `#` in their names.
fn whole_files(store: &Path) -> usize {
    files(store).iter().filter(|path| !path.to_string_lossy().contains('#')).count()
}

/// Body and table of a store, column by column, every number by its bits.
fn numbers(store: &Path) -> (Recording, Vec<Vec<u32>>) {
    let location = Location::Folder(store.to_path_buf());
    let (recording, table) =
        TableStore::open(&location).and_then(TableStore::load).expect("a store without gaps");
    let bits = |touchable: usize| {
        table.columns.prepare(touchable).expect("a readable column");
        match table.columns.column(touchable) {
            Column::F32(numbers) => numbers.iter().map(|number| number.to_bits()).collect(),
            Column::F64(_) => panic!("a table in double precision"),
        }
    };
    let columns = (0..table.touchable_dofs.len()).map(bits).collect();
    (recording, columns)
}

fn same(a: &Path, b: &Path) {
    let (a, b) = (contents(a), contents(b));
    assert_eq!(a.keys().collect::<Vec<_>>(), b.keys().collect::<Vec<_>>());
    for (name, bytes) in &a {
        assert!(bytes == &b[name], "{} differs", name.display());
    }
}

#[test]
fn a_recording_that_is_killed_ten_times_ends_with_the_same_bytes() {
    let workplace = Workplace::new();
    let mut random = Random::new(88_172_645_463_325_252);
    let mut interrupted = 0;
    for _ in 0..10 {
        let mut child = Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(TABLE)
            .current_dir(workplace.path(""))
            .stderr(Stdio::null())
            .stdout(Stdio::null())
            .spawn()
            .expect("the command starts");
        // It has written one to four more files, of which there are more than 49.
        let enough = whole_files(&workplace.path("t.zarr")) + random.one_of([1, 2, 3, 4]);
        let mut has_ended = false;
        wait_until("more files", || {
            has_ended = child.try_wait().expect("a child").is_some();
            has_ended || whole_files(&workplace.path("t.zarr")) >= enough
        });
        interrupted += usize::from(!has_ended);
        child.kill().expect("a child");
        child.wait().expect("a child");
    }
    assert!(interrupted >= 5, "most runs are killed while they work: {interrupted}");
    workplace.succeed(&TABLE);
    same(&whole_store().0, &workplace.path("t.zarr"));
}

#[test]
fn a_recording_without_room_or_memory_goes_on_where_it_stood() {
    let workplace = Workplace::new();
    for blocks in [0, 1, 2, 4, 8, 16, 32, 64] {
        let output = workplace.palpate_with_room(blocks, &TABLE);
        let text = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "with {blocks} blocks: {text}");
        assert!(text.contains("File too large (os error 27)"), "with {blocks} blocks: {text}");
    }
    let mut failed = 0;
    let mut kilobytes = 8192;
    loop {
        let output = with_memory(kilobytes).args(TABLE).current_dir(workplace.path("")).output();
        if output.expect("a shell").status.success() {
            break;
        }
        failed += 1;
        kilobytes += kilobytes / 8;
    }
    assert!(failed >= 5, "{failed} attempts failed before {kilobytes} kB were enough");
    workplace.succeed(&TABLE);
    // Not the same bytes: a chunk is stored without compression where its compressor gets no memory.
    assert!(numbers(&workplace.path("t.zarr")) == numbers(&whole_store().0));
}

#[test]
fn what_a_killed_writer_left_unfinished_is_removed_wherever_it_lies() {
    let workplace = with_whole_store();
    let whole = contents(&workplace.path("t.zarr"));
    // A writer's files have such names until they are whole; a run can be killed while it writes any of them.
    for name in [
        "zarr.json#1",
        "observed_positions/zarr.json#2",
        "touchable_dofs/c/0#1",
        "impulse_response/c/3/0/0#1",
    ] {
        workplace.write(&format!("t.zarr/{name}"), "half a fi");
    }
    workplace.succeed(&TABLE);
    assert!(contents(&workplace.path("t.zarr")) == whole);
}

#[test]
fn parts_by_several_machines_make_one_store() {
    let (whole, printed) = whole_store();
    assert!(printed.contains("49 of 49 done"), "{printed}");
    let workplace = Workplace::new();
    workplace.succeed(&[&TABLE[..], &["--shard", "1/3"]].concat());
    let inspected = workplace.json(&["inspect", "t.zarr", "--json"]);
    assert_eq!(inspected["shards_total"], 49);
    assert_eq!(inspected["shards_done"], 16);
    assert_eq!(inspected["shards_missing"][0], 0);
    let printed = workplace.succeed(&["inspect", "t.zarr"]);
    assert!(printed.contains("missing      0, 2-3, 5-6,"), "{printed}");
    // The other two at the same time, counted from 0 as well as from 1.
    let others: Vec<_> = ["2/3", "0/3"]
        .map(|part| {
            Command::new(env!("CARGO_BIN_EXE_palpate"))
                .args([&TABLE[..], &["--shard", part]].concat())
                .current_dir(workplace.path(""))
                .output()
        })
        .into_iter()
        .collect();
    assert!(others.iter().all(|output| output.as_ref().is_ok_and(|o| o.status.success())));
    same(&whole, &workplace.path("t.zarr"));
    let inspected = workplace.json(&["inspect", "t.zarr", "--json"]);
    for (key, value) in
        [("shards_done", 49), ("samples", 80), ("touchable_dofs", 294), ("observed_dofs", 294)]
    {
        assert_eq!(inspected[key], value, "{key}");
    }
    assert_eq!(inspected["step_s"], 1e-3);
    assert_eq!(inspected["dtype"], "f32");
    assert!(inspected["bytes"].as_u64().is_some_and(|bytes| bytes > 1_000_000));
}

#[test]
fn two_runs_at_once_on_one_store_do_no_harm() {
    let workplace = Workplace::new();
    let start = || {
        Command::new(env!("CARGO_BIN_EXE_palpate"))
            .args(TABLE)
            .current_dir(workplace.path(""))
            .stderr(Stdio::piped())
            .stdout(Stdio::null())
            .spawn()
            .expect("the command starts")
    };
    let children = [start(), start()];
    for child in children {
        let output = child.wait_with_output().expect("a child");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    same(&whole_store().0, &workplace.path("t.zarr"));
}

#[test]
fn a_store_of_another_table_is_refused_and_left_as_it_is() {
    let workplace = Workplace::new();
    let part = [&TABLE[..], &["--shard", "1/40"]].concat();
    workplace.succeed(&part);
    let before = contents(&workplace.path("t.zarr"));
    let changed = |from: &str, to: &'static str| -> Vec<&str> {
        part.iter().map(|word| if *word == from { to } else { word }).collect()
    };
    for (from, to, what) in [
        ("box:0.1x0.1x0.1/4x4x4", "box:0.1x0.1x0.2/4x4x4", "the mesh is box:0.1x0.1x0.1/4x4x4"),
        ("2000", "3000", "the material is "),
        ("0.08", "0.09", "the number of samples is 80 there, and 90 is asked for"),
        ("transient", "closed-form", "the method is transient"),
    ] {
        let text = workplace.fail(&changed(from, to));
        assert!(text.starts_with("the store t.zarr holds another table: ") && text.contains(what), "{text}");
    }
    let text = workplace.fail(&[&part[..], &["--touchable", "x<0"]].concat());
    assert!(text.contains("the choice of touchable degrees of freedom"), "{text}");
    assert!(contents(&workplace.path("t.zarr")) == before);
}

#[test]
fn a_damaged_shard_is_told_of_and_can_be_recorded_again() {
    let workplace = with_whole_store();
    let whole = contents(&workplace.path("t.zarr"));
    let shard = workplace.path("t.zarr/impulse_response/c/7/0/0");
    let good = std::fs::read(&shard).expect("a shard");
    let mut flipped = good.clone();
    flipped[good.len() / 3] ^= 4;
    for bad in [flipped, good[..good.len() / 2].to_vec(), Vec::new()] {
        std::fs::write(&shard, bad).expect("a writable shard");
        let output = workplace.palpate(&["inspect", "t.zarr"]);
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{text}");
        assert!(text.contains("error: shard 7 (t.zarr/impulse_response/c/7/0/0) is damaged"), "{text}");
        assert!(workplace.fail(&TABLE).starts_with("shard 7 (t.zarr/impulse_response/c/7/0/0) is damaged"));
        // As the error says: remove it and record again.
        std::fs::remove_file(&shard).expect("a file");
        workplace.succeed(&TABLE);
        assert!(contents(&workplace.path("t.zarr")) == whole);
    }
}

#[test]
fn a_disk_without_room_loses_nothing() {
    let workplace = Workplace::new();
    // Room for ever larger files: first not even for the metadata, at last for all but the shards.
    for blocks in [0, 1, 4, 16, 64, 200] {
        let limited = workplace.palpate_with_room(blocks, &TABLE);
        let text = String::from_utf8_lossy(&limited.stderr).into_owned();
        assert_eq!(limited.status.code(), Some(1), "{text}");
        assert!(
            text.contains("error: cannot write ") && text.contains("File too large (os error 27)"),
            "{blocks}: {text}"
        );
        assert!(blocks < 200 || text.contains("What is finished is kept"), "{text}");
    }
    workplace.succeed(&TABLE);
    same(&whole_store().0, &workplace.path("t.zarr"));
}

#[test]
fn places_that_are_no_store_are_refused() {
    let workplace = Workplace::new();
    workplace.write("file", "text");
    workplace.write("other/notes.txt", "text");
    let into = |place: &'static str| -> Vec<&str> {
        TABLE.iter().map(|word| if *word == "t.zarr" { place } else { word }).collect()
    };
    assert_eq!(workplace.fail(&into("file")), "cannot write file: it is a file, and a store is a folder");
    assert_eq!(
        workplace.fail(&into("other")),
        "other is not empty and no store of impulse responses (it holds notes.txt): give another name"
    );
    assert_eq!(workplace.fail(&["inspect", "other"]), "other: there is no store of impulse responses");
    let text = workplace.fail(&into("ftp://host/t.zarr"));
    assert!(text.starts_with("cannot open the store ftp://host/t.zarr"), "{text}");
    workplace.write("other/zarr.json", "{\"zarr_format\": 3, \"node_type\": \"group\"}");
    let text = workplace.fail(&["inspect", "other"]);
    assert!(text.ends_with("a Zarr group, but not one that palpate wrote"), "{text}");
}

#[test]
fn options_that_make_no_sense_are_explained() {
    let workplace = Workplace::new();
    let with = |more: &[&'static str]| [&TABLE[..], more].concat();
    for (more, what) in [
        (["--step", "0"], "--step is 0 s, expected above 0 and at most 1"),
        (["--step", "nan"], "--step is NaN s, expected above 0 and at most 1"),
        (
            ["--step", "1"],
            "--duration is 0.08 s, expected at least one --step of 1 s, and at most 1e8 of them",
        ),
        (["--touchable", "tail"], "--touchable \"tail\" is neither a group of the mesh nor a condition"),
        (["--observed", "x>7"], "--observed \"x>7\" selects no node; the mesh spans x -0.050000"),
        (["--limit-memory", "1MB"], "--limit-memory is 0.00 GB; shards of 6 columns need"),
    ] {
        let text = workplace.fail(&with(&more));
        assert!(text.starts_with(what), "{more:?}: {text}");
    }
    for more in
        [["--shard", "4/3"], ["--limit-memory", "much"], ["--columns-per-shard", "0"], ["--dtype", "f16"]]
    {
        assert_eq!(workplace.palpate(&with(&more)).status.code(), Some(2), "{more:?}");
    }
    let without_table = ["record", "box:1x1x1/1x1x1", "--young", "1", "--poisson", "0", "--density", "1"];
    assert_eq!(workplace.palpate(&without_table).status.code(), Some(2), "neither -o nor --dense");
}

/// A workplace with the recording, its table, and a scene that uses it.
fn with_table(more: &[&str]) -> Workplace {
    let workplace = Workplace::with_scene();
    workplace
        .succeed(&[&CUBE[..], &["cube.palp", "--dense", "cube.zarr", "--duration", "0.05"], more].concat());
    workplace
}

fn forces(workplace: &Workplace, scene: &str) -> Vec<glam::DVec3> {
    workplace.write("other.toml", scene);
    workplace.succeed(&["run", "other.toml", "--csv", "out.csv"]);
    let table = Table::parse(&workplace.text("out.csv"));
    ["left", "right"].iter().flat_map(|name| table.vectors(name, ["fx", "fy", "fz"])).collect()
}

fn difference(a: &[glam::DVec3], b: &[glam::DVec3]) -> f64 {
    let largest = a.iter().fold(0.0_f64, |m, f| m.max(f.length()));
    a.iter().zip(b).fold(0.0_f64, |worst, (a, b)| worst.max((*a - *b).length())) / largest
}

#[test]
fn both_forms_of_the_response_give_the_same_forces() {
    // Round-off of a table in double precision; rounding to single, enlarged by the solution for the forces.
    for (dtype, compression, allowed) in
        [("f64", "zstd", 1e-9), ("f64", "none", 1e-9), ("f32", "zstd", 1e-4), ("f32", "none", 1e-4)]
    {
        let workplace = with_table(&["--dtype", dtype, "--compression", compression]);
        let modal = forces(&workplace, &SCENE);
        let beside =
            SCENE.replace("recording = \"cube.palp\"", "recording = \"cube.palp\"\nresponse = \"fir\"");
        let named = beside.replace("\"fir\"", "\"fir\"\ntable = \"cube.zarr\"");
        let alone = SCENE.replace("cube.palp", "cube.zarr");
        for scene in [beside, named, alone] {
            let apart = difference(&modal, &forces(&workplace, &scene));
            assert!(apart < allowed, "{dtype} {compression}: {apart:e}");
        }
    }
}

#[test]
fn scenes_that_can_not_use_a_table_say_why() {
    let workplace = with_table(&["--touchable", "surface & x<0"]);
    let refused = |more: &str, recording: &str| {
        let scene =
            SCENE.replace("recording = \"cube.palp\"", &format!("recording = \"{recording}\"\n{more}"));
        workplace.write("other.toml", scene);
        workplace.fail(&["run", "other.toml"])
    };
    let ends = |text: String, end: &str| assert!(text.ends_with(end), "{text}");
    ends(
        refused("response = \"iir\"", "cube.palp"),
        "line 7: response is \"iir\", expected \"modal\" or \"fir\"",
    );
    ends(
        refused("response = \"modal\"", "cube.zarr"),
        "response = \"modal\" needs a recording file (.palp); this is a store of impulse responses",
    );
    ends(refused("table = \"cube.zarr\"", "cube.palp"), "a table is used with response = \"fir\" only");
    ends(
        refused("response = \"fir\"\ntable = \"no.zarr\"", "cube.palp"),
        "no.zarr: make one with `palpate record … --dense`, and name it with table = \"…\"",
    );
    // The right hand's point was left out.
    let text = refused("response = \"fir\"", "cube.palp");
    assert!(
        text.contains("device \"right\" on \"cube\": the point is not touchable in the impulse response"),
        "{text}"
    );
    workplace
        .write("step.toml", SCENE.replace("step = 0.001", "step = 0.002").replace("cube.palp", "cube.zarr"));
    ends(
        workplace.fail(&["run", "step.toml"]),
        "the impulse response was recorded with a step of 0.001 s, the scene's step is 0.002 s",
    );
    // An unfinished store, and one of another mesh.
    let mut other: Vec<&str> = CUBE.to_vec();
    other[1] = "box:0.1x0.1x0.12/3x3x3";
    let other = [&other[..14], &["--dense", "other.zarr", "--duration", "0.01"]].concat();
    workplace.succeed(&[&other[..], &["--columns-per-shard", "50", "--shard", "1/2"]].concat());
    let text = refused("response = \"fir\"\ntable = \"other.zarr\"", "cube.palp");
    assert!(
        text.contains("the store ") && text.contains("is not finished: 2 of 4 shards are missing"),
        "{text}"
    );
    workplace.succeed(&[&other[..], &["--columns-per-shard", "50"]].concat());
    ends(
        refused("response = \"fir\"\ntable = \"other.zarr\"", "cube.palp"),
        "the store is of another mesh (box:0.1x0.1x0.12/3x3x3) than the recording (box:0.1x0.1x0.1/3x3x3)",
    );
}
