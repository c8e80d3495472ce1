//! Surfaces and sizes that are refused, and files that are written.

use crate::{filled, shapes};
use glam::DVec3;
use palpate_mesh::{Files, MeshFile, MeshingParameters, SurfaceMesh, read_body, tetrahedralise};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

fn refusal(surface: &SurfaceMesh, cell_size: Option<f64>) -> String {
    let watch = &mut |_| ControlFlow::Continue(());
    let result = tetrahedralise(surface, &MeshingParameters { cell_size, nodes: None, curved: false }, watch);
    result.expect_err("no inside").to_string()
}

#[test]
fn open_surfaces_are_refused_with_advice() {
    let mut sheet = SurfaceMesh {
        positions: vec![DVec3::ZERO, DVec3::X, DVec3::X + DVec3::Y, DVec3::Y],
        triangles: vec![[0, 1, 2], [0, 2, 3]],
    };
    let open = |edges: u32, share: u32| {
        format!(
            "the surface is open: {edges} edges belong to one triangle only, about holes of {share} % of its area, and at most 5 % can be \
             closed: close it, or give a sheet a thickness, in the program that made it"
        )
    };
    assert_eq!(refusal(&sheet, None), open(4, 100));
    let mut tray = shapes::slab([0.1; 3]);
    let is_lid = |triangle: &[u32; 3]| triangle.iter().all(|&node| tray.positions[node as usize].z > 0.0);
    let lidless: Vec<_> = tray.triangles.iter().copied().filter(|triangle| !is_lid(triangle)).collect();
    tray.triangles = lidless;
    assert_eq!(refusal(&tray, None), open(4, 20));
    // A tube without its ends: the vector areas of the two holes would cancel.
    tray.triangles.retain(|triangle| !triangle.iter().all(|&node| tray.positions[node as usize].z < 0.0));
    assert_eq!(refusal(&tray, None), open(8, 50));
    sheet.positions[2].x = f64::NAN;
    assert_eq!(refusal(&sheet, None), "1 vertices of the surface are not finite");
    assert_eq!(refusal(&SurfaceMesh::default(), None), "the surface has no triangle with an area");
}

#[test]
fn cell_sizes_that_cannot_be_are_refused() {
    let ball = shapes::ball();
    assert_eq!(refusal(&ball, Some(0.0)), "cell size is 0 m, expected a positive number");
    assert_eq!(refusal(&ball, Some(f64::NAN)), "cell size is NaN m, expected a positive number");
    let plate = shapes::slab([0.2, 0.2, 0.004]);
    assert_eq!(
        refusal(&plate, Some(0.02)),
        "no tetrahedron of cells of 2.000e-2 m fits into the surface, which is about 3.8e-3 m thick: give a --cell-size below that, in metres"
    );
    let text = refusal(&ball, Some(1e-5));
    assert_eq!(
        text,
        "cells of 1.000e-5 m about the surface, which is 1.000e-1 m large, need 2.0e12 lattice points, of 1.0e6 at most: give a --cell-size of 1.316e-3 m or more, or the --scale of the file's unit to metres"
    );
}

#[test]
fn the_mesher_stops_when_it_is_told_to() {
    let ball = shapes::ball();
    let mut shares = Vec::new();
    let mut watch = |share| {
        shares.push(share);
        ControlFlow::Continue(())
    };
    assert!(tetrahedralise(&ball, &MeshingParameters::default(), &mut watch).is_ok());
    assert!(shares.is_sorted() && shares[0] == 0.0 && shares.iter().all(|share| *share <= 1.0));
    for at in 0..shares.len() {
        let mut asked = 0;
        let mut watch = |_| {
            asked += 1;
            if asked > at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        };
        let error = tetrahedralise(&ball, &MeshingParameters::default(), &mut watch).expect_err("stopped");
        assert_eq!(error.to_string(), "interrupted");
    }
}

#[test]
fn written_files_are_read_to_the_bit() {
    let (mut mesh, _) = filled(&shapes::slab([0.1, 0.07, 0.05]), Some(0.03));
    mesh.regions[0].tag = 3;
    for (name, text) in [("a.vtk", mesh.to_vtk()), ("a.msh", mesh.to_gmsh())] {
        let files = BTreeMap::from([(PathBuf::from(name), text.into_bytes())]);
        let Ok(MeshFile::Volume(file)) = MeshFile::read(Files::Memory(&files), Path::new(name)) else {
            panic!("{name} is no volume mesh");
        };
        assert_eq!((&file.mesh.nodes, &file.mesh.tets), (&mesh.nodes, &mesh.tets), "{name}");
        assert_eq!(file.mesh.regions[0].tag, 3, "{name}");
    }
}

#[test]
fn a_body_is_read_from_a_file_of_either_kind() {
    let folder = tempfile::tempdir().expect("a folder");
    let read = |name: &str, text: String, cell_size: Option<f64>| {
        let path = folder.path().join(name);
        std::fs::write(&path, text).expect("a file");
        read_body(&path, 0.001, &MeshingParameters { cell_size, nodes: None, curved: false }, &mut |_| {
            ControlFlow::Continue(())
        })
    };
    let ball = shapes::ball();
    let vertices = ball.positions.iter().map(|p| format!("v {} {} {}\n", p.x * 1e3, p.y * 1e3, p.z * 1e3));
    let faces = ball.triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    let mesh = read("ball.obj", vertices.chain(faces).collect(), Some(0.01)).expect("a ball");
    assert!((crate::volume(&mesh) / ball.volume() - 1.0).abs() < 0.02);
    let again = read("ball.vtk", mesh.to_vtk(), None).expect("tetrahedra");
    assert_eq!(again.tets, mesh.tets);
    let error = read("ball.vtk", mesh.to_vtk(), Some(0.01)).expect_err("tetrahedra");
    assert_eq!(
        error.to_string(),
        "a cell size is for surfaces, and this has its tetrahedra already: leave --cell-size out"
    );
}
