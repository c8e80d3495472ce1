//! Stores: the first byte chooses the file that the others replace.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate::Sampling;
use palpate_store::{Compression, Location, Number, STORE_VERSION, TableAttributes, TableContent, TableStore};
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

const SAMPLES: usize = 3;

/// A small finished store, and its files.
static STORE: LazyLock<(PathBuf, Vec<(PathBuf, Vec<u8>)>)> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("palpate-fuzz-{}.zarr", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    write_store(&folder);
    let mut files = Vec::new();
    collect(&folder, &mut files);
    files.sort();
    (folder, files)
});

fn write_store(folder: &Path) {
    let recording = palpate_testkit::free_block();
    let surface = recording.surface.clone();
    let mut dofs: Vec<u32> = surface.source_nodes.iter().flat_map(|n| [3 * n, 3 * n + 1, 3 * n + 2]).collect();
    dofs.sort_unstable();
    let length = SAMPLES * dofs.len();
    let content = TableContent {
        attributes: TableAttributes {
            store_version: STORE_VERSION,
            step_s: 1e-3,
            sampling: TableAttributes::sampling_text(Sampling::End),
            method: "closed-form".into(),
            columns_per_shard: 8,
            compression: Compression::Zstd,
            recording: recording.metadata.clone(),
        },
        number: Number::F32,
        samples: SAMPLES,
        observed_positions: surface.positions.clone(),
        touchable_dofs: dofs.clone(),
        observed_dofs: dofs,
        surface,
        gravity: None,
    };
    let store = TableStore::create(&Location::Folder(folder.into()), content, || None).expect("a store");
    for shard in 0..store.shards() {
        let columns = store.columns_of(shard).map(|c| vec![1e-3 / (1.0 + c as f64); length]).collect();
        store.write_shard(shard, columns).expect("a shard");
    }
}

fn collect(folder: &Path, files: &mut Vec<(PathBuf, Vec<u8>)>) {
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        let path = entry.path();
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push((path.clone(), std::fs::read(path).expect("a file")));
        }
    }
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&choice, content)) = bytes.split_first() else { return };
    let (folder, files) = &*STORE;
    let (path, whole) = &files[usize::from(choice) % files.len()];
    std::fs::write(path, content).expect("a writable folder");
    if let Ok(store) = TableStore::open(&Location::Folder(folder.clone())) {
        let _ = (0..store.shards()).try_for_each(|shard| store.check_shard(shard));
        if let Ok((recording, table)) = store.load() {
            let point = palpate::SurfacePoint { triangle: 0, weights: [0.2, 0.3, 0.5] };
            let _ = table.prepare(&recording.surface, &point);
        }
    }
    std::fs::write(path, whole).expect("a writable folder");
});
