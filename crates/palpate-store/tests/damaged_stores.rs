//! Damaged stores: every file of a store, changed, cut or replaced, is refused with an error that names it, or read as what it was; nothing
//! panics, and nothing is allocated beyond the size of the store.

use palpate::{ImpulseResponse, Recording, Sampling, SurfacePoint};
use palpate_store::{Compression, Location, Number, StoreError, TableAttributes, TableContent, TableStore};
use palpate_testkit::{CountingAllocator, Random, fixed_block, free_block, largest_allocation};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

#[global_allocator]
static COUNTING: CountingAllocator = CountingAllocator;

/// Upper limit of an allocation for a store of some ten kilobytes [bytes].
const LARGEST_ALLOCATION: usize = 64 << 20;

const SAMPLES: usize = 4;

/// A small finished store: all surface nodes touchable and observed, four columns a shard.
fn write_store(folder: &Path, recording: &Recording, compression: Compression, number: Number) {
    let surface = recording.surface.clone();
    let mut dofs: Vec<u32> =
        surface.source_nodes.iter().flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    dofs.sort_unstable();
    let length = SAMPLES * dofs.len();
    let content = TableContent {
        attributes: TableAttributes {
            store_version: palpate_store::STORE_VERSION,
            step_s: 1e-3,
            sampling: TableAttributes::sampling_text(Sampling::End),
            method: "closed-form".into(),
            columns_per_shard: 5,
            compression,
            recording: recording.metadata.clone(),
        },
        number,
        samples: SAMPLES,
        observed_positions: surface.positions.clone(),
        touchable_dofs: dofs.clone(),
        observed_dofs: dofs,
        surface,
        gravity: None,
    };
    let gravity = recording.gravity.is_some().then(|| vec![1e-6; 3 * length]);
    let location = Location::Folder(folder.to_path_buf());
    let store = TableStore::create(&location, content, || gravity).expect("a writable folder");
    for shard in 0..store.shards() {
        let columns = store.columns_of(shard);
        let column = |c: usize| (0..length).map(|at| 1e-3 / (1.0 + at as f64 + c as f64)).collect();
        store.write_shard(shard, columns.map(column).collect()).expect("a writable folder");
    }
}

/// Opens, checks and loads a store, and uses every column.
fn use_store(folder: &Path) -> Result<ImpulseResponse, String> {
    let location = Location::Folder(folder.to_path_buf());
    let open = || TableStore::open(&location).map_err(|e| e.to_string());
    let store = open()?;
    let checked: Result<Vec<()>, StoreError> =
        (0..store.shards()).map(|shard| store.check_shard(shard)).collect();
    let (recording, table) = open()?.load().map_err(|e| e.to_string())?;
    for triangle in 0..recording.surface.triangles.len() as u32 {
        let point = SurfacePoint { triangle, weights: [0.2, 0.3, 0.5] };
        table.prepare(&recording.surface, &point).map_err(|e| e.to_string())?;
    }
    checked.map_err(|e| e.to_string())?;
    Ok(table)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.is_dir() { found.extend(files(&path)) } else { found.push(path) }
    }
    found.sort();
    found
}

/// Outcome of a damaged store; a panic or an outsized allocation ends the test with the place.
fn outcome(folder: &Path, what: &str) -> Result<(), String> {
    largest_allocation();
    let used = std::panic::catch_unwind(|| use_store(folder).map(drop));
    let largest = largest_allocation();
    assert!(largest < LARGEST_ALLOCATION, "{what}: an allocation of {largest} bytes");
    used.unwrap_or_else(|_| panic!("{what}: a panic"))
}

/// Random index below a length.
fn below(random: &mut Random, length: usize) -> usize {
    ((random.unit() * length as f64) as usize).min(length - 1)
}

/// Every kind of store.
fn stores() -> Vec<(&'static str, tempfile::TempDir)> {
    let kinds: [(&str, &Recording, Compression, Number); 3] = [
        ("plain", &free_block(), Compression::None, Number::F32),
        ("compressed", &free_block(), Compression::Zstd, Number::F64),
        ("fixed", &fixed_block(), Compression::Zstd, Number::F32),
    ];
    let made = kinds.map(|(kind, recording, compression, number)| {
        let folder = tempfile::tempdir().expect("a folder");
        write_store(&folder.path().join("t.zarr"), recording, compression, number);
        (kind, folder)
    });
    made.into()
}

#[test]
fn every_file_with_damaged_bytes_is_refused_or_read_as_what_it_was() {
    let mut random = Random::new(7);
    let (mut refused, mut accepted) = (0, 0);
    for (kind, folder) in stores().into_iter().take(2) {
        let store = folder.path().join("t.zarr");
        assert_eq!(outcome(&store, kind), Ok(()));
        for file in files(&store) {
            let name = file.strip_prefix(&store).expect("below").display().to_string();
            let good = std::fs::read(&file).expect("a file");
            let mut damaged: Vec<Vec<u8>> = vec![Vec::new(), good[..good.len() / 2].to_vec(), good.repeat(2)];
            damaged.push(good[..good.len() - 1].to_vec());
            damaged.push(vec![0xff; good.len()]);
            damaged.push(vec![0; good.len()]);
            for _ in 0..10 {
                let mut bytes = good.clone();
                // The index of a shard and its checksum are at its end.
                let from_end = random.chance(0.5).then_some(good.len().min(100));
                let at = match from_end {
                    Some(end) => good.len() - 1 - below(&mut random, end),
                    None => below(&mut random, good.len()),
                };
                bytes[at] ^= 1 << below(&mut random, 8);
                damaged.push(bytes);
            }
            for bytes in damaged {
                std::fs::write(&file, bytes).expect("a writable folder");
                match outcome(&store, &format!("{kind}: {name}")) {
                    Ok(()) => accepted += 1,
                    Err(text) => {
                        assert!(text.contains("t.zarr"), "{kind}: {name}: {text}");
                        refused += 1;
                    }
                }
            }
            std::fs::remove_file(&file).expect("a writable folder");
            let missing = outcome(&store, &format!("{kind}: {name} missing"));
            assert!(missing.is_err(), "{kind}: {name} is missing");
            std::fs::write(&file, good).expect("a writable folder");
        }
    }
    println!("{refused} damaged stores refused, {accepted} read");
}

#[test]
fn every_value_of_the_metadata_replaced_is_refused_or_read() {
    fn paths(value: &Value, path: &str, into: &mut Vec<String>) {
        into.push(path.into());
        match value {
            Value::Object(entries) => {
                let escaped = |key: &str| key.replace('~', "~0").replace('/', "~1");
                entries
                    .iter()
                    .for_each(|(key, value)| paths(value, &format!("{path}/{}", escaped(key)), into));
            }
            Value::Array(entries) => {
                entries
                    .iter()
                    .enumerate()
                    .for_each(|(at, value)| paths(value, &format!("{path}/{at}"), into));
            }
            _ => {}
        }
    }
    // One kind: opening takes a millisecond, and there are some thousand values.
    for (kind, folder) in stores().into_iter().skip(2) {
        let store = folder.path().join("t.zarr");
        for file in files(&store).into_iter().filter(|file| file.ends_with("zarr.json")) {
            let name = file.strip_prefix(&store).expect("below").display().to_string();
            let good = std::fs::read(&file).expect("a file");
            let value: Value = serde_json::from_slice(&good).expect("JSON");
            let mut all = Vec::new();
            paths(&value, "", &mut all);
            for path in &all {
                let others = [
                    json!(0),
                    json!(2),
                    json!(-1),
                    json!(u64::MAX),
                    json!(null),
                    json!("uint8"),
                    json!([]),
                    json!([u64::MAX, 2, 2]),
                ];
                for other in others {
                    let mut damaged = value.clone();
                    *damaged.pointer_mut(path).expect("a place") = other.clone();
                    std::fs::write(&file, damaged.to_string()).expect("a writable folder");
                    let used = outcome(&store, &format!("{kind}: {name} {path} {other}"));
                    assert!(
                        used.as_ref().err().is_none_or(|text| text.contains("t.zarr")),
                        "{kind}: {name} {path} {other}: {used:?}"
                    );
                }
            }
            std::fs::write(&file, good).expect("a writable folder");
        }
    }
}

#[test]
fn a_store_that_is_cut_while_it_is_used_gives_an_error_that_names_the_shard() {
    for (kind, folder) in stores() {
        let store = folder.path().join("t.zarr");
        let (recording, table) = TableStore::open(&Location::Folder(store.clone()))
            .and_then(TableStore::load)
            .expect("a good store");
        let point = |triangle: u32| SurfacePoint { triangle, weights: [0.2, 0.3, 0.5] };
        table.prepare(&recording.surface, &point(0)).expect("a good column");
        let columns = 0..table.touchable_dofs.len();
        let kept: Vec<usize> = recording.surface.triangles[0]
            .iter()
            .map(|&node| 3 * recording.surface.source_nodes[node as usize])
            .map(|dof| table.touchable_dofs.iter().position(|&own| own == dof).expect("touchable"))
            .collect();
        let before: Vec<f64> =
            kept.iter().map(|&column| table.columns.column(column).series(0, table.samples).at(1)).collect();
        for file in files(&store.join("impulse_response/c")) {
            std::fs::File::options()
                .write(true)
                .open(file)
                .expect("a file")
                .set_len(1)
                .expect("a writable file");
        }
        // What was prepared stays; the rest is refused with the shard's name, and read as zeros in a step that can't wait.
        let after: Vec<f64> =
            kept.iter().map(|&column| table.columns.column(column).series(0, table.samples).at(1)).collect();
        assert_eq!(before, after, "{kind}");
        let fresh =
            columns.rev().find(|column| table.columns.prepare(*column).is_err()).expect("a cut column");
        let refusal = table.columns.prepare(fresh).expect_err("cut");
        let shard = fresh / 5;
        let key = format!("shard {shard} ({}/impulse_response/c/{shard}/0/0) is damaged: ", store.display());
        assert!(
            refusal.starts_with(&key) && refusal.contains("is cut short: it has 1 bytes"),
            "{kind}: {refusal}"
        );
        assert_eq!(table.columns.column(fresh).series(0, table.samples).at(1), 0.0, "{kind}");
    }
}
