//! TetGen, MEDIT, Vega and Abaqus.

use crate::body::{body, node_rows, refusal, rows, tag, tet_rows, volume};
use palpate_mesh::{Mesh, NodeGroup, Region, RegionMaterial};

/// The body with its group under another name.
fn with_group(name: &str) -> Mesh {
    let mut mesh = body();
    mesh.groups[0].name = name.into();
    mesh
}

pub fn tetgen(mesh: &Mesh, first: usize) -> (Vec<u8>, Vec<u8>) {
    let marker = |node: usize| i64::from(mesh.groups[0].nodes.contains(&(node as u32))) * 8;
    let node_lines: String = node_rows(mesh, first, "  ")
        .lines()
        .enumerate()
        .map(|(at, row)| format!("  {row} 0.5 {}\n", marker(at)))
        .collect();
    let tet_lines: String = tet_rows(mesh, first, " ")
        .lines()
        .enumerate()
        .map(|(at, row)| format!("{row} {}\n", tag(mesh, at)))
        .collect();
    let nodes = format!("# nodes\n{} 3 1 1\n{node_lines}# by tetgen\n", mesh.nodes.len());
    (nodes.into_bytes(), format!("{} 4 1\n{tet_lines}", mesh.tets.len()).into_bytes())
}

#[test]
fn tetgen_pairs_are_read_from_either_file_and_from_either_first_number() {
    for first in [0, 1] {
        let (nodes, tets) = tetgen(&body(), first);
        let file = volume([("a.1.node", nodes.clone()), ("a.1.ele", tets.clone())]);
        assert_eq!(file.mesh, with_group("8"));
        assert_eq!(file.format, "TetGen .node and .ele");
        assert_eq!(volume([("a.1.ele", tets), ("a.1.node", nodes)]), file);
    }
}

#[test]
fn tetgen_errors_name_the_file_and_the_line() {
    let (nodes, tets) = tetgen(&body(), 1);
    assert_eq!(
        refusal([("a.ele", tets.clone())]),
        "a.ele needs a.node beside it, which cannot be read: entity not found"
    );
    let changed = |bytes: &[u8], from: &str, to: &str| {
        String::from_utf8_lossy(bytes).replacen(from, to, 1).into_bytes()
    };
    assert_eq!(
        refusal([("a.node", nodes.clone()), ("a.ele", changed(&tets, "40 4", "41 4"))]),
        "a.ele: line 41: expected a tetrahedron, found the end of the file"
    );
    assert_eq!(
        refusal([("a.node", changed(&nodes, "27 3", "1152921504606846976 3")), ("a.ele", tets.clone())]),
        format!(
            "a.node: line 2: the file states 1152921504606846976 nodes, more than its remaining {} bytes can hold",
            nodes.len() - 17
        )
    );
    assert_eq!(
        refusal([("a.node", changed(&nodes, "\n  2 ", "\n  1 ")), ("a.ele", tets.clone())]),
        "a.node: line 4: node 1 is in the file twice"
    );
    let far = String::from_utf8_lossy(&tets).replacen("\n1 ", "\n1 99 ", 1).into_bytes();
    assert_eq!(
        refusal([("a.node", nodes.clone()), ("a.ele", far)]),
        "a.ele: line 2: a tetrahedron has node 99, which is not in the .node file"
    );
    assert_eq!(refusal([("a.ele", nodes)]), "a.ele: line 1: the file has the content of a .node");
}

pub fn medit(mesh: &Mesh) -> String {
    let vertices = rows(
        (0_u32..).zip(&mesh.nodes).map(|(at, node)| {
            let reference = i64::from(mesh.groups[0].nodes.contains(&at)) * 4;
            vec![node.x.to_string(), node.y.to_string(), node.z.to_string(), reference.to_string()]
        }),
        " ",
    );
    let tets = rows(
        mesh.tets
            .iter()
            .enumerate()
            .map(|(at, tet)| [&tet.map(|node| i64::from(node) + 1)[..], &[tag(mesh, at)]].concat()),
        " ",
    );
    format!(
        "MeshVersionFormatted 2\n# a body\nDimension\n3\n\nVertices\n{}\n{vertices}\nRequiredVertices\n2\n1\n2\nTriangles 1\n1 2 4 9\n\
         Tetrahedra\n{}\n{tets}\nNormals 1\n0 0 1\nEnd\n",
        mesh.nodes.len(),
        mesh.tets.len()
    )
}

#[test]
fn medit_references_are_regions_and_groups() {
    let file = volume([("m.mesh", medit(&body()).into_bytes())]);
    let mut expected = with_group("vertices:4");
    expected.groups.insert(0, NodeGroup { name: "faces:9".into(), nodes: vec![0, 1, 3] });
    assert_eq!((file.format.as_str(), file.mesh), ("MEDIT, text", expected));
}

#[test]
fn medit_errors_name_the_line() {
    let text = medit(&body());
    for (from, to, expected) in [
        ("Dimension\n3", "Dimension\n2", "line 4: the dimension is 2, expected 3"),
        ("Vertices\n27", "Vertices\n28", "line 36: expected a coordinate, found 'RequiredVertices'"),
        ("Triangles 1\n1 2 4", "Triangles 1\n0 2 4", "line 41: an element has vertex 0, expected 1 to 27"),
        ("1 2 4 9\n", "1 2 28 9\n", "line 41: an element has vertex 28, expected 1 to 27"),
        ("\nVertices\n", "\nPoints\n", "line 40: the section 'Triangles' comes before Vertices"),
        ("Normals", "%", "line 85: expected a section such as Vertices, found '%'"),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        assert_eq!(refusal([("m.mesh", changed.into_bytes())]), format!("m.mesh: {expected}"));
    }
    let cut = text.split("Tetrahedra\n").next().unwrap_or_default().to_owned() + "Tetrahedra\n40\n1 2 3";
    assert_eq!(
        refusal([("m.mesh", cut.into_bytes())]),
        "m.mesh: line 43: the file states 40 tetrahedra, more than its remaining 5 bytes can hold"
    );
}

pub fn vega(mesh: &Mesh) -> [(&'static str, Vec<u8>); 2] {
    let nodes = format!("{} 3 0 0\n{}", mesh.nodes.len(), node_rows(mesh, 1, " "));
    let members = |tag_of: i64| {
        let tets = (0..mesh.tets.len()).filter(|&tet| tag(mesh, tet) == tag_of);
        tets.map(|tet| (tet + 1).to_string()).collect::<Vec<_>>().join(", ")
    };
    let text = format!(
        "# Vega\n*VERTICES\n*INCLUDE body.node\n*ELEMENTS\nTET\n{} 4 0\n{}*MATERIAL soft\nENU, 1000, 2e4, 0.45 # kg/m^3, Pa\n\
         *MATERIAL hard\nENU, 1100, 1e6, 0.3\n*SET core\n{}\n*REGION\nallElements, soft\n*REGION\ncore, hard\n",
        mesh.tets.len(),
        tet_rows(mesh, 1, ", "),
        members(5)
    );
    [("m.veg", text.into_bytes()), ("body.node", nodes.into_bytes())]
}

#[test]
fn vega_files_give_sets_regions_and_materials_also_from_included_files() {
    let file = volume(vega(&body()));
    let material = |name: &str, density_kg_m3, young_pa, poisson| {
        Some(RegionMaterial { name: name.into(), young_pa, poisson, density_kg_m3 })
    };
    assert_eq!(
        (file.format.as_str(), &file.mesh.tets, &file.mesh.nodes),
        ("Vega", &body().tets, &body().nodes)
    );
    assert_eq!(file.mesh.tet_regions, body().tet_regions);
    assert_eq!(
        file.mesh.regions,
        [
            Region {
                tag: 1,
                name: Some("allElements".into()),
                material: material("soft", 1000.0, 2e4, 0.45)
            },
            Region { tag: 2, name: Some("core".into()), material: material("hard", 1100.0, 1e6, 0.3) },
        ]
    );
    assert_eq!(file.mesh.groups[0].name, "core");
    assert_eq!(file.mesh.warnings, Vec::<String>::new());
}

#[test]
fn vega_errors_name_the_file_and_includes_stay_beside_it() {
    let with = |from: &str, to: &str| {
        let [(name, text), other] = vega(&body());
        let text = String::from_utf8(text).expect("text");
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        refusal([(name, changed.into_bytes()), other])
    };
    for name in ["/etc/passwd", "../body.node", "a/../../body.node"] {
        assert_eq!(
            with("body.node", name),
            format!("m.veg: line 3: the file includes '{name}', expected a file beside it or below")
        );
    }
    assert_eq!(
        with("body.node", "no.node"),
        "m.veg needs no.node beside it, which cannot be read: entity not found"
    );
    assert_eq!(with("body.node", "m.veg"), "m.veg: line 3: more than 32 files are included");
    assert_eq!(with("TET", "WEDGE"), "m.veg: line 5: elements are of type 'WEDGE', expected TET or CUBIC");
    assert_eq!(with("40 4", "41 4"), "m.veg: line 56: 40 elements follow, and 41 are stated");
    assert_eq!(
        with("core, hard", "core, iron"),
        "m.veg: line 56: region 'core' has material 'iron', which is not in the file"
    );
    assert_eq!(
        with("core, hard", "shell, hard"),
        "m.veg: line 56: region 'shell' is of a set that is not in the file"
    );
    let [(name, text), (included, nodes)] = vega(&body());
    let nodes = String::from_utf8(nodes).expect("text").replacen("0.15", "high", 1);
    assert_eq!(
        refusal([(name, text), (included, nodes.into_bytes())]),
        "body.node: line 2: expected a coordinate, found '-high'"
    );
}

pub fn abaqus(mesh: &Mesh) -> String {
    let low: Vec<_> = mesh.groups[0].nodes.iter().map(|node| (node + 1).to_string()).collect();
    let of_region = |tag_of: i64| {
        let all = tet_rows(mesh, 1, ", ");
        all.lines()
            .enumerate()
            .filter(|(at, _)| tag(mesh, *at) == tag_of)
            .map(|(_, row)| format!("{row}\n"))
            .collect::<String>()
    };
    format!(
        "*Heading\n** a body\n*Node\n{}*Element, type=C3D4, elset=CORE\n{}*ELEMENT, TYPE=C3D4H,\nELSET=Shell\n{}*Element, type=S3\n900, 1, 2,\n4\n\
         *Nset, nset=low, internal\n{},\n*Nset, nset=more\nLOW\n*Elset, elset=first, generate\n1, 3, 2\n*Solid Section, elset=core, material=\"Soft\"\n,\n\
         *Solid Section, elset=shell, material=hard\n*Material, name=soft\n*Elastic\n2e4, 0.45\n*Density\n1000.,\n*Material, name=hard\n\
         *Elastic, type=ORTHOTROPIC\n1, 2, 3\n*Step\n*Static\n1., 1.\n*End Step\n",
        node_rows(mesh, 1, ", "),
        of_region(3),
        of_region(5),
        low.join(", ")
    )
}

#[test]
fn abaqus_sections_are_regions_and_sets_are_groups() {
    let file = volume([("m.inp", abaqus(&body()).into_bytes())]);
    let mesh = &file.mesh;
    assert_eq!(file.format, "Abaqus");
    assert_eq!(mesh.nodes, body().nodes);
    let tets = |mesh: &Mesh, region: u32| {
        let all = mesh.tets.iter().zip(&mesh.tet_regions);
        all.filter(|(_, at)| **at == region).map(|(tet, _)| *tet).collect::<Vec<_>>()
    };
    assert_eq!([0, 1].map(|region| tets(mesh, region)), [0, 1].map(|region| tets(&body(), region)));
    let soft = RegionMaterial { name: "Soft".into(), young_pa: 2e4, poisson: 0.45, density_kg_m3: 1000.0 };
    assert_eq!(
        mesh.regions,
        [
            Region { tag: 1, name: Some("CORE".into()), material: Some(soft) },
            Region { tag: 2, name: Some("Shell".into()), material: None },
        ]
    );
    let names: Vec<_> = mesh.groups.iter().map(|group| group.name.as_str()).collect();
    assert_eq!(names, ["low", "more", "CORE", "Shell", "first"]);
    assert_eq!(mesh.groups[0].nodes, body().groups[0].nodes);
    assert_eq!(mesh.groups[1].nodes, body().groups[0].nodes);
    assert_eq!(
        mesh.warnings,
        ["material 'hard' has no isotropic *ELASTIC with *DENSITY: give one for its regions"]
    );
}

#[test]
fn quadratic_elements_go_over_lines_and_keep_the_nodes_of_their_edges() {
    let text = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,.5,0,0\n6,.5,.5,0\n7,0,.5,0\n8,0,0,.5\n9,.5,0,.5\n10,0,.5,.5\n\
                *ELEMENT, TYPE=C3D10\n1, 1,2,3,4,5,6,\n7,8,9,10\n";
    let file = volume([("m.inp", text.as_bytes().to_vec())]);
    assert_eq!((file.mesh.tets.as_slice(), file.mesh.mid_side_nodes.len()), (&[[0, 1, 2, 3]][..], 0));
    assert!(!file.mesh.is_curved() && file.mesh.mid_edge_nodes.len() == 6);
    // The check has nothing to add.
    assert!(file.mesh.checked().expect("a sound mesh").warnings.is_empty());
}

#[test]
fn abaqus_errors_name_the_line() {
    let text = "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT, TYPE=C3D4\n1,1,2,3,4\n*NSET,NSET=a,GENERATE\n1,4\n";
    for (from, to, expected) in [
        ("3,4\n", "3,5\n", "line 7: an element has node 5, which is not in the file before it"),
        ("3,4\n", "3,4,4\n", "line 7: tetrahedra of this type have 4 nodes, found 5"),
        ("3,4\n", "3\n", "line 8: element 1 has 3 nodes, expected 4"),
        ("2,1,0,0", "1,1,0,0", "line 3: node 1 is in the file twice"),
        ("2,1,0,0", "2,1,x,0", "line 3: expected a coordinate, found 'x'"),
        (
            "*NODE\n",
            "*NODE, SYSTEM=C\n",
            "line 1: nodes are in a cylindrical or spherical system, expected SYSTEM=R: export them as x, y, z",
        ),
        (
            "*NODE\n",
            "*SYSTEM\n0, 0, 1\n*NODE\n",
            "line 1: *SYSTEM turns or moves nodes, which cannot be read: export them as x, y, z",
        ),
        ("NSET=a,", "", "line 8: *NSET needs a name, NSET=…"),
        ("1,4\n", "1,1152921504606846976\n", "line 9: the sets have more than 20000000 members together"),
        (
            "*NODE\n",
            "*INCLUDE, INPUT=/etc/passwd\n*NODE\n",
            "line 1: the file includes '/etc/passwd', expected a file beside it or below",
        ),
        (
            "*NSET",
            "*PART\n*PART\n*NSET",
            "line 9: the file has several parts, expected one: export each, or merge them into one",
        ),
    ] {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text);
        assert_eq!(refusal([("m.inp", changed.into_bytes())]), format!("m.inp: {expected}"));
    }
}
