//! Mesh files of every format, through the front door: read, repaired, checked and reported on.
//!
//! The input is one or more files, parted by the bytes 0, 0, 1, so that pairs and includes are reached. The first byte of each chooses its name.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_mesh::{Files, MeshFile, MeshReport, MeshingParameters, Repair};
use std::ops::ControlFlow;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Names of the files; the first is read.
const NAMES: [&str; 10] =
    ["a.node", "a.ele", "a.veg", "a.inp", "a.vtu", "a.msh", "a.mesh", "a.stl", "a.meshb", "a.glb"];

/// Mark between files.
const MARK: &[u8] = b"\0\0\x01";

fuzz_target!(|bytes: &[u8]| {
    let mut files: BTreeMap<PathBuf, Vec<u8>> = BTreeMap::new();
    let mut first = None;
    let mut rest = bytes;
    while !rest.is_empty() {
        let end = rest.windows(MARK.len()).position(|window| window == MARK).unwrap_or(rest.len());
        let (part, after) = rest.split_at(end);
        rest = after.get(MARK.len()..).unwrap_or_default();
        let Some((&name, content)) = part.split_first() else { continue };
        let name = NAMES[name as usize % NAMES.len()];
        first.get_or_insert(name);
        files.insert(PathBuf::from(name), content.to_vec());
    }
    let Some(first) = first else { return };
    if let Ok(file) = MeshFile::read(Files::Memory(&files), Path::new(first)) {
        if let MeshFile::Volume(volume) = &file {
            let mut mesh = volume.mesh.clone();
            if mesh.repair(&Repair::default()).is_ok() {
                drop(mesh.checked());
            }
        }
        let mut asked = 0;
        // Small surfaces are filled, others stop early.
        let mut watch = |_| {
            asked += 1;
            if asked < 20 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
        };
        MeshReport::new(file, 0.001, &Repair::default(), &MeshingParameters::default(), &mut watch);
    }
});
