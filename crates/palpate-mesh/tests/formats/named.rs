//! Formats that are told from their content, and what is said of others.

use crate::body::{body, read, refusal, volume};
use crate::decks::{abaqus, medit, tetgen, vega};
use crate::surfaces::{off, ply};
use palpate_mesh::{Format, MeshFile, Recognised, recognise};

#[test]
fn formats_are_told_by_their_content() {
    let (nodes, tets) = tetgen(&body(), 1);
    for (bytes, format) in [
        (b"$MeshFormat\n".to_vec(), Format::Gmsh),
        (b"\r\n$NOD\r\n".to_vec(), Format::Gmsh),
        (b"# vtk DataFile".to_vec(), Format::Vtk),
        (b"\xef\xbb\xbf#vtk DataFile".to_vec(), Format::Vtk),
        (b"<?xml version=\"1.0\"?><!-- x --><VTKFile>".to_vec(), Format::VtkXml),
        (nodes, Format::TetGen),
        (tets, Format::TetGen),
        (medit(&body()).into_bytes(), Format::Medit),
        (vega(&body())[0].1.clone(), Format::Vega),
        (b"*MATERIAL a\nENU, 1, 1, 0\n*VERTICES\n".to_vec(), Format::Vega),
        (abaqus(&body()).into_bytes(), Format::Abaqus),
        (b"** mesh\n*Include, input=a.inp\n".to_vec(), Format::Abaqus),
        (ply(Some(true)), Format::Ply),
        (off(), Format::Off),
        (b"solid x\n".to_vec(), Format::Stl),
        ([&b"$MeshFormat"[..], &[0; 69], &[1, 0, 0, 0], &[0; 50]].concat(), Format::Stl),
        (b"# Blender\nmtllib a.mtl\nv 0 0 0\n".to_vec(), Format::Obj),
    ] {
        assert_eq!(recognise(&bytes), Recognised::Known(format), "{}", String::from_utf8_lossy(&bytes));
    }
    for bytes in [&b""[..], b"\n\n", b"# nothing\n", b"hello", b"1 2 3\n", b"\0\0\0", b"*FROBNICATE\n"] {
        assert_eq!(recognise(bytes), Recognised::Unknown);
    }
}

#[test]
fn other_formats_are_named_with_the_way_to_one_that_is_read() {
    let convert = "convert it to VTU, for instance with meshio convert OLD NEW.vtu";
    for (bytes, expected) in [
        (&b"\x89HDF\r\n"[..], format!("this is an HDF5 file (XDMF, MED, CGNS or Exodus), which palpate does not read: {convert}")),
        (b"\x1f\x8b\x08", "this is a gzip archive, which palpate does not read: unpack it with gunzip".into()),
        (
            b"ISO-10303-21;\n",
            "this is a STEP file of CAD geometry, which palpate does not read: mesh it first, for instance with gmsh FILE -3 -format \
             msh41 -o NEW.msh"
                .into(),
        ),
        (b"<Xdmf>", format!("this is an XDMF file, which palpate does not read: {convert}")),
        (b"<a>", "this is an XML file without <VTKFile>, which palpate does not read: save it as VTU, Gmsh or VTK legacy".into()),
        (b"*KEYWORD\n*NODE\n", format!("this is an LS-DYNA file, which palpate does not read: {convert}")),
    ] {
        assert_eq!(refusal([("x.msh", bytes.to_vec())]), format!("x.msh: {expected}"));
    }
}

#[test]
fn what_is_not_known_is_quoted_or_judged_by_its_name() {
    let known = "and is of no mesh format that palpate knows: expected Gmsh (.msh), VTK (.vtk, .vtu), TetGen (.node with .ele), MEDIT \
                 (.mesh, .meshb), Vega (.veg) or Abaqus (.inp), or a surface as STL, OBJ, PLY, OFF or glTF";
    assert_eq!(
        refusal([("x", b"Dear diary".to_vec())]),
        format!("x: the file begins with 'Dear diary', {known}")
    );
    assert_eq!(
        refusal([("x", Vec::new())]),
        format!("x: the file begins with nothing (it is empty), {known}")
    );
    assert_eq!(
        refusal([("x.msh", b"Dear diary".to_vec())]),
        "x.msh: line 1: expected $MeshFormat, which a gmsh mesh begins with, found 'Dear'"
    );
}

#[test]
fn a_surface_under_another_name_is_a_surface() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("liver.vtk");
    std::fs::write(&path, ply(None)).expect("a file");
    assert_eq!(palpate_mesh::read_surface(&path).expect("a surface").triangles.len(), 4);
}

#[test]
fn an_empty_mesh_is_read_and_its_check_says_that_it_is_empty() {
    let text = "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n0\n$EndNodes\n$Elements\n0\n$EndElements\n";
    let file = volume([("x.msh", text.into())]);
    assert_eq!(
        file.mesh.checked().expect_err("no body").to_string(),
        "the mesh has no tetrahedra; palpate needs a volume mesh, not a surface"
    );
    assert!(matches!(read([("x.msh", text.into())]), Ok(MeshFile::Volume(_))));
}
