//! Mesh files: the first byte chooses the reader.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_fem::mesh::{read_gmsh, read_obj, read_stl, read_vtk};
use std::cell::RefCell;
use std::path::PathBuf;

thread_local! {
    /// Folder in memory for the file that is read.
    static FOLDER: RefCell<Option<tempfile::TempDir>> = const { RefCell::new(None) };
}

fn place(name: &str, bytes: &[u8]) -> PathBuf {
    FOLDER.with_borrow_mut(|folder| {
        let folder = folder.get_or_insert_with(|| {
            let memory = PathBuf::from("/dev/shm");
            let base = if memory.is_dir() { memory } else { std::env::temp_dir() };
            tempfile::tempdir_in(base).expect("a temporary folder")
        });
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).expect("a file");
        path
    })
}

fuzz_target!(|bytes: &[u8]| {
    let Some((&reader, bytes)) = bytes.split_first() else { return };
    match reader % 4 {
        0 => drop(read_gmsh(&place("mesh.msh", bytes))),
        1 => drop(read_vtk(&place("mesh.vtk", bytes))),
        2 => drop(read_obj(&place("mesh.obj", bytes))),
        _ => drop(read_stl(&place("mesh.stl", bytes))),
    }
});
