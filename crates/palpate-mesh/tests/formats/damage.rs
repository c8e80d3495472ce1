//! Damaged files of every format: an error or a mesh, never a panic.

use crate::body::{body, files, read};
use crate::decks::{abaqus, medit, tetgen, vega};
use crate::gltf::tetrahedron;
use crate::meshb::meshb;
use crate::surfaces::{off, ply};
use crate::vtu::{encodings, vtu};
use palpate_mesh::{Files, MeshError, MeshFile, MeshReport, MeshingParameters, Repair};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

/// Whole files of every format, the first of each list being the one that is read.
fn corpus() -> Vec<Vec<(&'static str, Vec<u8>)>> {
    let (nodes, tets) = tetgen(&body(), 1);
    let mut all: Vec<Vec<(&'static str, Vec<u8>)>> = vec![
        vec![("a.node", nodes.clone()), ("a.ele", tets.clone())],
        vec![("a.ele", tets), ("a.node", nodes)],
        vec![("a.mesh", medit(&body()).into_bytes())],
        vega(&body()).to_vec(),
        vec![("a.inp", abaqus(&body()).into_bytes())],
        vec![("a.ply", ply(None))],
        vec![("a.ply", ply(Some(true)))],
        vec![("a.off", off())],
        vec![("a.meshb", meshb(&body(), 1, true))],
        vec![("a.meshb", meshb(&body(), 4, false))],
        vec![("a.glb", tetrahedron())],
    ];
    all.extend(encodings().into_iter().map(|encoding| vec![("a.vtu", vtu(&body(), encoding))]));
    all
}

/// Everything that is done with a mesh before it is recorded.
fn use_files(list: &[(&'static str, Vec<u8>)]) -> Result<(), MeshError> {
    let memory = list.iter().map(|(name, bytes)| (PathBuf::from(name), bytes.clone())).collect();
    let file = MeshFile::read(Files::Memory(&memory), Path::new(list[0].0))?;
    let mut asked = 0;
    // Small surfaces are filled, others stop early.
    let mut watch = |_| {
        asked += 1;
        if asked < 20 { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    };
    MeshReport::new(file, 1.0, &Repair::default(), &MeshingParameters::default(), &mut watch);
    Ok(())
}

#[test]
fn cut_files_do_not_panic() {
    for list in corpus() {
        use_files(&list).expect("a whole file");
        let length = list[0].1.len();
        for end in (0..length).step_by(length / 50 + 1) {
            let mut cut = list.clone();
            cut[0].1.truncate(end);
            let _ = use_files(&cut);
        }
    }
}

#[test]
fn changed_files_do_not_panic() {
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    let mut below = |limit: usize| {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as usize % limit
    };
    for list in corpus() {
        for _ in 0..150 {
            let mut changed = list.clone();
            let file = below(changed.len());
            let bytes = &mut changed[file].1;
            for _ in 0..=below(4) {
                let at = below(bytes.len());
                match below(5) {
                    0 => bytes[at] ^= 1 << below(8),
                    1 => bytes[at] = b"0123456789-. \n*,<=\"\0\xff"[below(21)],
                    2 => bytes.insert(at, b"0123456789-. \n*,<=\"\0\xff"[below(21)]),
                    3 => drop(bytes.remove(at)),
                    _ => bytes[at] = below(256) as u8,
                }
            }
            let _ = use_files(&changed);
        }
    }
}

#[test]
fn numbers_that_are_none_are_read_and_refused_by_the_check() {
    let text = medit(&body()).replacen("-0.05", "nan", 1);
    let Ok(MeshFile::Volume(file)) = read([("a.mesh", text.into_bytes())]) else { panic!("no mesh") };
    let error = file.mesh.checked().expect_err("no place").to_string();
    assert!(error.starts_with("node 0 is at [NaN, -0.1, -0.15], which is not finite"), "{error}");
}

#[cfg(unix)]
#[test]
fn a_pipe_or_a_folder_is_refused_and_nothing_is_waited_for() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.node");
    let read = |path: &Path| MeshFile::read(Files::Disk, path);
    assert!(std::process::Command::new("mkfifo").arg(&path).status().is_ok_and(|status| status.success()));
    let error = read(&path).expect_err("a pipe").to_string();
    assert_eq!(error, format!("cannot read mesh {}: it is a pipe, not a file", path.display()));
    // Also as the other half of a pair.
    let (_, tets) = tetgen(&body(), 1);
    let half = folder.path().join("a.ele");
    std::fs::write(&half, tets).expect("a file");
    let error = read(&half).expect_err("a pipe").to_string();
    assert_eq!(
        error,
        format!(
            "{} needs {} beside it, which cannot be read: it is a pipe, not a file",
            half.display(),
            path.display()
        )
    );
    let error = read(folder.path()).expect_err("a folder").to_string();
    assert_eq!(error, format!("cannot read mesh {}: it is a folder, not a file", folder.path().display()));
}

#[test]
fn files_in_memory_know_no_disk() {
    let memory = files([("a", Vec::new())]);
    let error = MeshFile::read(Files::Memory(&memory), Path::new("/etc/passwd")).expect_err("no such file");
    assert_eq!(error.to_string(), "cannot read mesh /etc/passwd: entity not found");
}
