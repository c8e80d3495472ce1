//! `palpate mesh`, and meshes of other formats on their way into recordings.

use crate::workplace::{Workplace, gmsh_bar};
use palpate_mesh::{Mesh, box_mesh};

/// The bar of [`gmsh_bar`] as a Vega file, with its materials.
fn vega_bar() -> String {
    let mesh = box_mesh([0.2, 0.1, 0.1], [4, 2, 2]).expect("a good box");
    let stiff: Vec<_> = (0..mesh.tets.len())
        .filter(|&tet| mesh.tets[tet].iter().map(|&node| mesh.nodes[node as usize].x).sum::<f64>() >= 0.0)
        .map(|tet| (tet + 1).to_string())
        .collect();
    format!(
        "*VERTICES\n{} 3 0 0\n{}*ELEMENTS\nTET\n{} 4 0\n{}*MATERIAL foam\nENU, 1000, 2e4, 0.45\n*MATERIAL rubber\nENU, 3000, 2e5, 0.3\n\
         *SET stiff\n{}\n*REGION\nallElements, foam\n*REGION\nstiff, rubber\n",
        mesh.nodes.len(),
        nodes(&mesh),
        mesh.tets.len(),
        tets(&mesh),
        stiff.join(", ")
    )
}

fn nodes(mesh: &Mesh) -> String {
    let row = |(at, node): (usize, &glam::DVec3)| format!("{at} {} {} {}\n", node.x, node.y, node.z);
    (1..).zip(&mesh.nodes).map(row).collect()
}

fn tets(mesh: &Mesh) -> String {
    let row = |(at, tet): (usize, &[u32; 4])| {
        format!("{at} {}\n", tet.map(|node| (node + 1).to_string()).join(" "))
    };
    (1..).zip(&mesh.tets).map(row).collect()
}

/// Two boxes of 3×3×3 nodes and 2×2×2 nodes as a TetGen pair; they share no node and no point.
fn write_two_boxes(workplace: &Workplace) {
    let mut mesh = box_mesh([0.1; 3], [2; 3]).expect("a good box");
    let other = box_mesh([0.05; 3], [1; 3]).expect("a good box");
    let first = mesh.nodes.len() as u32;
    mesh.nodes.extend(other.nodes.iter().map(|&node| node + glam::DVec3::X));
    mesh.tets.extend(other.tets.iter().map(|tet| tet.map(|node| node + first)));
    workplace.write("two.node", format!("{} 3 0 0\n{}", mesh.nodes.len(), nodes(&mesh)));
    workplace.write("two.ele", format!("{} 4 0\n{}", mesh.tets.len(), tets(&mesh)));
}

/// A report that ends with a fault, on both streams.
fn report_and_error(workplace: &Workplace, arguments: &[&str]) -> (String, String) {
    let output = workplace.palpate(arguments);
    assert_eq!(output.status.code(), Some(1));
    let text = |bytes| String::from_utf8(bytes).expect("text");
    let error = text(output.stderr);
    let error = error.trim_end().strip_prefix("error: ").unwrap_or(&error).to_owned();
    (text(output.stdout), error)
}

const MATERIAL: [&str; 6] = ["--young", "1e4", "--poisson", "0.3", "--density", "1000"];

#[test]
fn a_report_shows_what_a_mesh_holds() {
    let workplace = Workplace::new();
    // Under a wrong name.
    workplace.write("bar.stl", gmsh_bar());
    let text = workplace.succeed(&["mesh", "bar.stl"]);
    let expected = "bar.stl: Gmsh 2.2, text
  file         45 nodes, 80 tetrahedra, 8 triangles
  size         0.2000 × 0.1000 × 0.1000 m, from (-0.1000, -0.0500, -0.0500) to (0.1000, 0.0500, 0.0500)
  body         80 tetrahedra, 2.0000e-3 m³, one piece
  region       1 'soft': 40 tetrahedra, 1.0000e-3 m³
  region       2 'stiff': 40 tetrahedra, 1.0000e-3 m³
  group        'foot': 9 nodes
  group        'soft': 27 nodes
  group        'stiff': 27 nodes
  angles       54.7° to 90.0° between faces
     50 to  60° ████████████████████████████████████████ 192
     70 to  80° ████████████████████ 96
     90 to 100° ████████████████████████████████████████ 192
  boundary     80 triangles, 42 vertices, watertight
";
    assert_eq!(text, expected);
    let json = workplace.json(&["mesh", "bar.stl", "--scale", "0.0001", "--json"]);
    assert_eq!(json["elements"]["tetrahedra"], 80);
    assert_eq!(json["volume"]["regions"][1]["name"], "stiff");
    assert_eq!(json["surface"]["open_edges"], 0);
    let question = json["unit_question"].as_str().expect("a question");
    assert!(
        question.starts_with("the body is only 0.00002")
            && question.ends_with(" with --scale 0.0001; if the file is in metres, use --scale 1"),
        "{question}"
    );
}

#[test]
fn a_body_in_pieces_is_reported_and_recorded_by_a_piece() {
    let workplace = Workplace::new();
    write_two_boxes(&workplace);
    let (text, error) = report_and_error(&workplace, &["mesh", "two.ele"]);
    let reason = "the mesh is disconnected: 2 pieces that share no face (40 tetrahedra near (-3.7500e-2, -3.7500e-2, -3.7500e-2) m, \
                  5 tetrahedra near (9.8750e-1, -1.2500e-2, -1.2500e-2) m); --piece largest keeps the largest, --piece N another \
                  (palpate mesh lists them)";
    assert_eq!(error, format!("two.ele: {reason}"));
    assert!(
        text.contains("\n  piece 1      40 tetrahedra, 1.0000e-3 m³, near (-0.0375, -0.0375, -0.0375)\n"),
        "{text}"
    );
    assert!(
        text.contains("\n  piece 2      5 tetrahedra, 1.2500e-4 m³, near (0.9875, -0.0125, -0.0125)\n"),
        "{text}"
    );

    let record = |piece: &str| {
        let common = [
            "record", "two.node", "--order", "1", "--modes", "5", "-o", "a.palp", "--json", "--piece", piece,
        ];
        workplace.json(&[&common[..], &MATERIAL].concat())["mass_kg"].as_f64().expect("a mass")
    };
    assert!((record("largest") - 1.0).abs() < 1e-9);
    assert!((record("2") - 0.125).abs() < 1e-9);
    let common = ["record", "two.node", "-o", "b.palp"];
    assert_eq!(
        workplace.fail(&[&common[..], &["--piece", "3"], &MATERIAL[..]].concat()),
        "two.node: piece 3 is to be kept, and the body has 2, counted from 1"
    );
    assert_eq!(workplace.fail(&[&common[..], &MATERIAL[..]].concat()), format!("two.node: {reason}"));
}

#[test]
fn materials_of_a_mesh_file_are_those_of_its_recording() {
    let workplace = Workplace::new();
    workplace.write("bar.veg", vega_bar());
    workplace.write("bar.msh", gmsh_bar());
    workplace.write(
        "bar.toml",
        "[[material]]\nregion = \"soft\"\nyoung = 2e4\npoisson = 0.45\ndensity = 1000.0\n\n\
         [[material]]\nregion = 2\nyoung = 2e5\npoisson = 0.3\ndensity = 3000.0\n",
    );
    let common = ["--order", "1", "--modes", "10", "--json", "-o", "out.palp"];
    let vega = workplace.json(&[&["record", "bar.veg"], &common[..]].concat());
    let gmsh = workplace.json(&[&["record", "bar.msh", "--materials", "bar.toml"], &common[..]].concat());
    assert_eq!(vega["frequencies_hz"], gmsh["frequencies_hz"]);
    assert_eq!(vega["mass_kg"], gmsh["mass_kg"]);
    assert_eq!(vega["materials"][1]["region"], "stiff");
    assert_eq!(vega["materials"][1]["young_pa"], 2e5);
    assert_eq!(
        workplace.fail(&[&["record", "bar.msh"], &common[..]].concat()),
        "region 'soft' has no material in the mesh file: give --young, --poisson and --density, --material, or --materials"
    );
}

/// A box of the given sides [mm] as an OBJ file, without its lid or with it.
fn obj_box([x, y, z]: [f64; 3], has_lid: bool) -> String {
    let corners = (0..8).map(|at| {
        let side = |bit: u32, length: f64| if at >> bit & 1 == 1 { length } else { 0.0 };
        format!("v {} {} {}\n", side(0, x), side(1, y), side(2, z))
    });
    let lid = if has_lid { "f 5 6 8 7\n" } else { "" };
    let faces = "f 1 3 4 2\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n";
    corners.collect::<String>() + faces + lid
}

#[test]
fn a_surface_is_reported_with_its_tetrahedra() {
    let workplace = Workplace::new();
    workplace.write("box.obj", obj_box([100.0, 50.0, 50.0], true));
    let common = ["mesh", "box.obj", "--scale", "0.001", "--cell-size", "0.02"];
    let text = workplace.succeed(&[&common[..], &["-o", "box.msh"]].concat());
    let begins = "box.obj: OBJ
  file         8 nodes, 12 triangles
  size         0.1000 × 0.0500 × 0.0500 m, from (0.0000, 0.0000, 0.0000) to (0.1000, 0.0500, 0.0500)
  surface      12 triangles, 8 vertices, watertight
  inside       2.5000e-4 m³
  use          a body or an obstacle
  as a body    ";
    assert!(text.starts_with(begins), "{text}");
    assert!(text.contains(" nodes, cells of 2.000e-2 m\n  likeness     95 % within 0."), "{text}");
    assert!(text.contains("\n  warning      the surface was filled with "), "{text}");
    // What is written is what a recording takes.
    let json = workplace.json(&[&common[..], &["--json"]].concat());
    let written = workplace.json(&["mesh", "box.msh", "--json"]);
    assert_eq!(written["volume"], json["volume"]);
    assert_eq!(json["meshing"]["tetrahedra"], json["volume"]["tetrahedra"]);
    assert_eq!(json["elements"]["triangles"], 12);
    assert!(json["meshing"]["volume_error"].as_f64().is_some_and(|error| error.abs() < 0.01), "{json}");
    workplace.succeed(&[&common[..], &["-o", "box.vtk"]].concat());
    assert_eq!(workplace.json(&["mesh", "box.vtk", "--json"])["volume"], json["volume"]);
    let usage = workplace.palpate(&[&common[..], &["-o", "box.txt"]].concat());
    let error = String::from_utf8_lossy(&usage.stderr);
    assert_eq!(
        error.lines().next(),
        Some(
            "error: invalid value 'box.txt' for '--output <OUT.vtk|OUT.msh>': expected a name that ends in .vtk or .msh, or - for VTK on standard output"
        )
    );

    workplace.write("tray.obj", obj_box([100.0; 3], false));
    let (json, error) = report_and_error(&workplace, &["mesh", "tray.obj", "--scale", "0.001", "--json"]);
    let reason = "the surface is open: 4 edges belong to one triangle only, about holes of 20 % of its area, and at most 5 % can be \
                  closed: close it, or give a sheet a thickness, in the program that made it";
    assert_eq!(error, format!("tray.obj: {reason}"));
    let json: serde_json::Value = serde_json::from_str(&json).expect("JSON");
    assert_eq!((&json["surface"]["open_edges"], &json["volume"]), (&4.into(), &serde_json::Value::Null));
}

#[test]
fn a_surface_is_recorded_in_one_command() {
    let workplace = Workplace::new();
    workplace.write("box.obj", obj_box([100.0, 50.0, 50.0], true));
    let common = ["record", "box.obj", "--scale", "0.001", "--cell-size", "0.02", "--modes", "5"];
    let out = ["-o", "a.palp", "--json"];
    let json = workplace.json(&[&common[..], &out, &MATERIAL].concat());
    let mass = json["mass_kg"].as_f64().expect("a mass");
    // Of 0.25 kg, less chamfers.
    assert!((mass / 0.25 - 1.0).abs() < 0.01, "{mass}");
    assert_eq!(
        workplace.fail(&[&common[..4], &["--cell-size", "-1", "-o", "b.palp"], &MATERIAL].concat()),
        "box.obj: cell size is -1 m, expected a positive number"
    );
}

#[test]
fn a_surface_is_embedded_in_coarse_tetrahedra() {
    let workplace = Workplace::new();
    workplace.write("box.obj", obj_box([100.0, 50.0, 50.0], true));
    let all = |options: &[&str]| -> Vec<String> {
        let common = ["record", "box.obj", "--scale", "0.001", "--cell-size", "0.03", "--modes", "5"];
        [&common[..], &MATERIAL, options].concat().into_iter().map(str::to_string).collect()
    };
    let run = |options: &[&str]| {
        let all = all(options);
        workplace.json(&all.iter().map(String::as_str).collect::<Vec<_>>())
    };
    let json = run(&["--surface", "box.obj", "-o", "a.palp", "--json"]);
    assert_eq!((&json["surface_nodes"], &json["format_version"]), (&8.into(), &4.into()));
    let nodes = json["embedded_in_nodes"].as_u64().expect("a number");
    assert!((8..=80).contains(&nodes), "{nodes}");
    let line = format!("8 nodes, 12 triangles, embedded: moved by {nodes} nodes of the mesh");
    assert!(workplace.succeed(&["inspect", "a.palp"]).contains(&line));
    let estimate = run(&["--surface", "box.obj", "--dry-run", "--json"]);
    assert_eq!(estimate["surface_nodes"], 8);
    let fail = |options: &[&str]| {
        let all = all(options);
        workplace.fail(&all.iter().map(String::as_str).collect::<Vec<_>>())
    };
    workplace.write("far.obj", obj_box([100.0, 50.0, 500.0], true));
    let error = fail(&["--surface", "far.obj", "-o", "b.palp"]);
    let place = "of the embedded surface, at (0.1000, 0.0000, 0.5000) m, is 0.4";
    assert!(error.contains(place) && error.contains("m outside of the tetrahedra"), "{error}");
    workplace.write("tray.obj", obj_box([100.0, 50.0, 50.0], false));
    let error = fail(&["--surface", "tray.obj", "-o", "b.palp"]);
    assert!(error.contains("tray.obj: the surface is open: 4 edges"), "{error}");
    let error = fail(&["--surface", "none.obj", "-o", "b.palp"]);
    assert!(error.contains("none.obj"), "{error}");
}
