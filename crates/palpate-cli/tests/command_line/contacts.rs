//! Forces, contacts and energies of scenes with contacts.

use crate::workplace::{CUBE, Table, Workplace};
use glam::DVec3;
use palpate_testkit::GRAVITY_M_S2;

/// Sums of some ten thousand terms keep all but four digits of f64.
const SUMMED: f64 = 1e-11;

/// The cube's mass [kg], the step [s], gravity [m/s²].
const MASS: f64 = 0.11;
const STEP: f64 = 1e-3;
const GRAVITY: DVec3 = DVec3::new(0.0, -GRAVITY_M_S2, 0.0);

/// The contacts of a run: what touches what, and the numbers.
struct Contacts {
    names: Vec<[String; 2]>,
    table: Table,
}

impl Contacts {
    fn parse(text: &str) -> Self {
        let (mut names, mut numbers) = (Vec::new(), String::new());
        for line in text.lines() {
            let cells: Vec<&str> = line.split(',').collect();
            names.push([cells[1].to_string(), cells[2].to_string()]);
            numbers += &format!("{},{}\n", cells[0], cells[3..].join(","));
        }
        names.remove(0);
        Self { names, table: Table::parse(&numbers) }
    }

    fn vectors(&self, first: char) -> Vec<DVec3> {
        let [x, y, z] = ["x", "y", "z"].map(|axis| self.table.column(&format!("{first}{axis}")));
        (0..self.table.len()).map(|row| DVec3::new(x[row], y[row], z[row])).collect()
    }

    /// Sum of the forces [N] on an object in each of so many steps.
    fn force(&self, object: &str, steps: usize) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; steps];
        for ((names, t), force) in self.names.iter().zip(self.table.column("t")).zip(self.vectors('f')) {
            if names[0] == object {
                sums[(t / STEP).round() as usize - 1] += force;
            }
        }
        sums
    }
}

fn workplace() -> Workplace {
    let workplace = Workplace::new();
    workplace.succeed(&[&CUBE[..], &["cube.palp"]].concat());
    workplace
}

fn object(position: &str) -> String {
    format!("[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nposition = {position}\n")
}

const FLOOR: &str = "gravity = [0.0, -9.81, 0.0]\n[[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\n\
                     normal = [0.0, 3.0, 0.0]\n";

/// The ledger of a scene closes in every row, and what is lost stays lost but for what pushes out what penetrates.
fn check_energy(table: &Table, start: f64) {
    let energy = |name: &str| table.column(&format!("energy.{name}"));
    let stored = ["kinetic", "elastic", "residual", "potential", "coupling"].map(energy);
    let [input, dissipated, friction, impact, defect] =
        ["input", "dissipated", "friction", "impact", "defect"].map(energy);
    let scale = stored.iter().flatten().fold(start.abs(), |most, e| most.max(e.abs()));
    for row in 0..table.len() {
        let now: f64 = stored.iter().map(|energy| energy[row]).sum();
        let expected = input[row] - dissipated[row] - friction[row] - impact[row] + defect[row];
        assert!((now - start - expected).abs() < SUMMED * scale, "row {row}: {now} {expected}");
        assert!(defect[row].abs() < SUMMED * scale, "row {row}: {}", defect[row]);
        assert!(dissipated[row] + friction[row] + impact[row] > -SUMMED * scale, "row {row}");
    }
}

#[test]
fn a_cube_that_falls_on_a_plane_gets_the_force_that_stops_it() {
    let workplace = workplace();
    let scene = format!("{FLOOR}{}velocity = [0.3, 0.0, 0.0]\n", object("[0.0, 0.052, 0.0]"));
    workplace.write("fall.toml", scene);
    let arguments =
        ["run", "fall.toml", "--duration", "0.3", "--csv", "steps.csv", "--contacts", "contacts.csv"];
    let summary = workplace.json(&[&arguments[..], &["--json"]].concat());
    let text = workplace.text("contacts.csv");
    assert!(text.starts_with("t,object,against,px,py,pz,nx,ny,nz,fx,fy,fz,gap,slip_speed\n"), "{text:.80}");
    let (contacts, table) = (Contacts::parse(&text), Table::parse(&workplace.text("steps.csv")));

    // m·Δv = Σ f·h + m·g·t.
    let velocities = table.vectors("cube", ["vx", "vy", "vz"]);
    let forces = contacts.force("cube", table.len());
    let mut momentum = DVec3::X * 0.3 * MASS;
    for (row, (velocity, force)) in velocities.iter().zip(&forces).enumerate() {
        momentum += (*force + GRAVITY * MASS) * STEP;
        assert!((*velocity * MASS - momentum).length() < SUMMED, "row {row}: {velocity} {momentum}");
    }
    // 2 mm take 20 ms.
    let first = forces.iter().position(|force| *force != DVec3::ZERO);
    assert_eq!(first, Some(20));

    // Every contact: between the two, on the floor, its normal out of the cube, within the cone, with slip against
    // friction only.
    assert!(contacts.names.iter().all(|names| *names == ["cube", "floor"]));
    let rows = contacts.vectors('p').into_iter().zip(contacts.vectors('n')).zip(contacts.vectors('f'));
    let (gaps, slips) = (contacts.table.column("gap"), contacts.table.column("slip_speed"));
    let mut slipping = 0;
    for (row, ((point, normal), force)) in rows.enumerate() {
        assert!((normal + DVec3::Y).length() < SUMMED, "{normal}");
        assert!((point.y - gaps[row]).abs() < SUMMED, "{point} {}", gaps[row]);
        let (pressing, across) = (force.y, DVec3::new(force.x, 0.0, force.z).length());
        assert!(pressing > 0.0 && across <= 0.5 * pressing * (1.0 + 1e-6), "{force}");
        assert!(slips[row] >= 0.0);
        slipping += usize::from(slips[row] > 1e-3);
    }
    assert!(slipping > 20, "{slipping}");
    check_energy(&table, 0.5 * MASS * 0.09 + MASS * 9.81 * 0.052);
    assert!(table.column("energy.friction").last().is_some_and(|lost| *lost > 0.0));

    // The summary says the same, and so does the text.
    let mut counts = vec![0; table.len()];
    contacts.table.column("t").iter().for_each(|t| counts[(t / STEP).round() as usize - 1] += 1);
    let most_force = contacts.vectors('f').iter().map(|force| force.length()).fold(0.0, f64::max);
    let most = counts.into_iter().max().unwrap_or(0);
    assert_eq!(summary["contacts"], serde_json::json!({ "count_max": most, "force_max_n": most_force }));
    for name in ["coupling", "friction", "impact"] {
        let last = table.column(&format!("energy.{name}")).last().copied();
        assert_eq!(summary["energy_j"][name].as_f64(), last, "{name}");
    }
    let text = workplace.succeed(&arguments);
    assert!(
        text.contains(&format!("contacts     {most} at once at most, {most_force:.5} N in one at most, ")),
        "{text}"
    );
    assert!(text.contains(" J in friction "), "{text}");
    assert!(!text.contains("warning"), "{text}");
}

#[test]
fn a_finger_with_a_coupling_presses_a_cube_against_the_floor() {
    const STIFFNESS: f64 = 200.0;
    const DAMPING: f64 = 0.5;
    let workplace = workplace();
    let device = format!(
        "[[device]]\nname = \"finger\"\nmode = \"touch\"\npath = {{ file = \"finger.csv\" }}\ntip_radius = 0.01\n\
         patch_radius = 0.06\nfriction = 0.6\ncoupling = {{ stiffness = {STIFFNESS}, damping = {DAMPING} }}\n"
    );
    workplace.write("press.toml", format!("{FLOOR}{}{device}", object("[0.0, 0.05, 0.0]")));
    workplace.write("finger.csv", "t,x,y,z\n0,0.005,0.12,0.003\n0.3,0.005,0.1,0.003\n");
    let arguments =
        ["run", "press.toml", "--duration", "4", "--csv", "steps.csv", "--contacts", "contacts.csv"];
    workplace.succeed(&arguments);
    let (contacts, table) =
        (Contacts::parse(&workplace.text("contacts.csv")), Table::parse(&workplace.text("steps.csv")));
    let device = table.vectors("finger", ["x", "y", "z"]);
    let proxy = table.vectors("finger", ["proxy_x", "proxy_y", "proxy_z"]);
    let on_hand = table.vectors("finger", ["fx", "fy", "fz"]);

    // f = k·e + d·de/dt on the object, in every step; also where there is none, and the spring pulls back what the damper lets go.
    let mut before = DVec3::ZERO;
    let mut pressed = 0;
    for row in 0..table.len() {
        let stretch = device[row] - proxy[row];
        let force = stretch * STIFFNESS + (stretch - before) * (DAMPING / STEP);
        // A rounding of a coordinate, times k + d/h.
        assert!((force + on_hand[row]).length() < 1e-12, "row {row}: {force} {}", on_hand[row]);
        pressed += u32::from(on_hand[row] != DVec3::ZERO);
        before = stretch;
    }
    assert!(pressed > 3000, "{pressed}");
    // The tip stays outside of a cube that gives way a little.
    assert!(proxy.iter().all(|proxy| proxy.y > 0.1), "the tip is in the cube");
    // At rest the damper is idle.
    let last = table.len() - 1;
    let (force, stretch) = (on_hand[last].length(), (device[last] - proxy[last]).length());
    assert!((force / (STIFFNESS * stretch) - 1.0).abs() < 1e-6, "{force} {stretch}");
    assert!(force > 0.5, "{force}");
    // And what the floor gives is the weight and the press, but for 10⁻⁵ of their sum by which contacts at rest are solved.
    let given: DVec3 = contacts
        .names
        .iter()
        .zip(contacts.table.column("t"))
        .zip(contacts.vectors('f'))
        .filter(|((names, t), _)| names[1] == "floor" && *t > 3.9995)
        .map(|(_, force)| force)
        .sum();
    let rest = GRAVITY * MASS - on_hand[last] + given;
    assert!(rest.length() < 2e-5, "{rest}");
    // The finger's row says what the hand feels.
    let row = contacts.names.iter().rposition(|names| names[1] == "finger").expect("a finger");
    assert_eq!(contacts.names[row][0], "cube");
    assert!((contacts.vectors('f')[row] + on_hand[last]).length() < 1e-12);
    check_energy(&table, MASS * 9.81 * 0.05);
}

#[test]
fn a_held_point_may_have_a_coupling_too() {
    let workplace = workplace();
    workplace.write(
        "hang.toml",
        format!(
            "gravity = [0.0, -9.81, 0.0]\n{}[[device]]\nname = \"hand\"\nmode = \"held\"\nattach = {{ object = \"cube\", \
             point = [0.0, 0.05, 0.0] }}\npath = {{ file = \"hand.csv\" }}\ncoupling = {{ stiffness = 100.0 }}\n",
            object("[0.0, 0.0, 0.0]")
        ),
    );
    workplace.write("hand.csv", "0,0,0.05,0\n");
    workplace.succeed(&["run", "hang.toml", "--duration", "0.5", "--csv", "steps.csv"]);
    let table = Table::parse(&workplace.text("steps.csv"));
    let hand = table.vectors("hand", ["x", "y", "z"]);
    let held = table.vectors("hand", ["proxy_x", "proxy_y", "proxy_z"]);
    for (row, force) in table.vectors("hand", ["fx", "fy", "fz"]).into_iter().enumerate() {
        assert!((force + (hand[row] - held[row]) * 100.0).length() < 1e-12, "row {row}: {force}");
    }
    check_energy(&table, 0.0);
    assert!(table.column("energy.coupling").into_iter().fold(0.0, f64::max) > 1e-3);
}

#[test]
fn a_cube_meets_obstacles_of_every_shape() {
    let workplace = workplace();
    // A box of 8 cm, its faces in every format, centred at the origin.
    let mesh = palpate_mesh::box_mesh([0.08; 3], [1; 3]).expect("a good box");
    let triangles = mesh.boundary();
    let mut obj: String = mesh.nodes.iter().map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
    let mut stl = String::from("solid box\n");
    let mut millimetres = vec![0; 80];
    millimetres.extend((triangles.len() as u32).to_le_bytes());
    for corners in &triangles {
        let [a, b, c] = corners.map(|node| node + 1);
        // Inside out.
        obj += &format!("f {a} {c} {b}\n");
        stl += "facet normal 0 0 0\nouter loop\n";
        millimetres.extend([0; 12]);
        for p in corners.map(|node| mesh.nodes[node as usize]) {
            stl += &format!("vertex {} {} {}\n", p.x, p.y, p.z);
            millimetres.extend(p.to_array().into_iter().flat_map(|x| (1e3 * x as f32).to_le_bytes()));
        }
        stl += "endloop\nendfacet\n";
        millimetres.extend([0; 2]);
    }
    workplace.write("box.obj", obj);
    workplace.write("box.stl", stl + "endsolid box\n");
    workplace.write("millimetres.stl", millimetres);
    let nodes: String = mesh.nodes.iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)).collect();
    let cells: String =
        mesh.tets.iter().map(|tet| format!("4 {}\n", tet.map(|node| node.to_string()).join(" "))).collect();
    workplace.write(
        "box.vtk",
        format!(
            "# vtk DataFile Version 3.0\nbox\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {} double\n{nodes}CELLS {} \
             {}\n{cells}CELL_TYPES {}\n{}",
            mesh.nodes.len(),
            mesh.tets.len(),
            5 * mesh.tets.len(),
            mesh.tets.len(),
            "10\n".repeat(mesh.tets.len())
        ),
    );
    // What each gives the cube that falls on it [N·s].
    let mut impulses = Vec::new();
    for shape in [
        "sphere = { radius = 0.04 }",
        "capsule = { radius = 0.04, half_length = 0.05 }\norientation = [0.7071067811865476, 0.7071067811865476, 0.0, 0.0]",
        "box = { half_extents = [0.04, 0.04, 0.04] }",
        "mesh = { file = \"box.obj\" }",
        "mesh = { file = \"box.stl\" }",
        "mesh = { file = \"millimetres.stl\", scale = 0.001 }",
        "mesh = { file = \"box.vtk\" }",
    ] {
        workplace.write(
            "scene.toml",
            format!("gravity = [0.0, -9.81, 0.0]\n{}[[obstacle]]\n{shape}\n", object("[0.0, 0.0925, 0.0]")),
        );
        let output =
            workplace.palpate(&["run", "scene.toml", "--duration", "0.1", "--contacts", "contacts.csv"]);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(0), "{shape}: {told}");
        let inside_out = shape.contains("box.obj");
        let turned =
            "warning: the triangles of obstacle \"obstacle\" face inwards (box.obj): they are turned over\n";
        assert_eq!(told, if inside_out { turned } else { "" }, "{shape}");
        let contacts = Contacts::parse(&workplace.text("contacts.csv"));
        assert!(contacts.names.iter().all(|names| *names == ["cube", "obstacle"]), "{shape}");
        let impulse: DVec3 = contacts.vectors('f').into_iter().map(|force| force * STEP).sum();
        impulses.push(impulse.y);
        // It is stopped, at the least.
        assert!(impulse.y > 0.5 * MASS * 9.81 * 0.1, "{shape}: {impulse}");
    }
    // The same mesh in four spellings, one of them in f32.
    let [_, _, _, meshes @ ..] = &impulses[..] else { panic!("seven shapes") };
    assert!(meshes.iter().all(|impulse| (impulse / meshes[0] - 1.0).abs() < 1e-4), "{meshes:?}");
}

#[test]
fn an_obstacle_on_a_path_pushes_a_cube() {
    let workplace = workplace();
    let scene = format!(
        "{}[[obstacle]]\nname = \"ram\"\ncapsule = {{ radius = 0.02, half_length = 0.03 }}\npath = {{ file = \
         \"ram.csv\" }}\nfriction = 0.2\n",
        object("[0.0, 0.0, 0.0]")
    );
    workplace.write("scene.toml", scene);
    // It comes from the left, touches after 20 ms, goes on for 3 cm and turns as it goes.
    workplace.write(
        "ram.csv",
        "t,x,y,z,qw,qx,qy,qz\n0,-0.075,0,0,1,0,0,0\n0.14,-0.04,0,0,0.9848077530122081,0.17364817766693033,0,0\n",
    );
    let text = workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv", "--contacts", "contacts.csv"]);
    assert!(text.starts_with("140 steps"), "to the end of the obstacle's path: {text}");
    assert!(text.contains(" J from hands and obstacles - "), "{text}");
    let (contacts, table) =
        (Contacts::parse(&workplace.text("contacts.csv")), Table::parse(&workplace.text("steps.csv")));
    let velocities = table.vectors("cube", ["vx", "vy", "vz"]);
    let mut momentum = DVec3::ZERO;
    for (velocity, force) in velocities.iter().zip(contacts.force("cube", table.len())) {
        momentum += force * STEP;
        assert!((*velocity * MASS - momentum).length() < SUMMED, "{velocity} {momentum}");
    }
    assert!(contacts.names.iter().all(|names| *names == ["cube", "ram"]));
    assert!((0.018..0.03).contains(&contacts.table.column("t")[0]));
    // It is pushed to the right, by a ram at 0.25 m/s.
    assert!(velocities.last().is_some_and(|v| v.x > 0.1), "{:?}", velocities.last());
    assert!(table.column("energy.input").last().is_some_and(|work| *work > 0.0));
    check_energy(&table, 0.0);
}

#[test]
fn contacts_without_room_are_told_of_and_the_run_goes_on() {
    let workplace = workplace();
    let scene =
        |points: u32| format!("max_contact_points = {points}\n{FLOOR}{}", object("[0.0, 0.052, 0.0]"));
    let arguments = ["run", "scene.toml", "--duration", "0.05"];
    let as_json = [&arguments[..], &["--json"]].concat();
    // The coarsest contact samples of its face are its four corners.
    for (points, dropped) in [(4, 0), (3, 1)] {
        workplace.write("scene.toml", scene(points));
        let summary = workplace.json(&as_json);
        assert_eq!(summary["contacts"]["count_max"], points);
        assert_eq!(summary["solver"]["dropped_contacts"], dropped);
    }
    let text = workplace.succeed(&arguments);
    assert!(text.contains(" at once: raise max_contact_points above 3\n"), "{text}");
}

#[test]
fn contacts_that_can_not_be_solved_are_told_of_and_the_run_goes_on() {
    let workplace = workplace();
    let finger = "[[device]]\nname = \"finger\"\nmode = \"touch\"\npath = { file = \"jump.csv\" }\ntip_radius = 0.005\n\
                  patch_radius = 0.16\n";
    workplace.write("scene.toml", format!("{}{finger}", object("[0.0, 0.0, 0.0]")));
    // A path in millimetres, or nearly: in its sixth step a finger without coupling goes 10 m down through the cube.
    workplace.write(
        "jump.csv",
        "t,x,y,z\n0,0.02,0.07,0.01\n0.005,0.02,0.07,0.01\n0.006,0.02,-10,0.01\n0.02,0.02,-10,0.01\n",
    );
    let arguments = ["run", "scene.toml", "--csv", "steps.csv"];
    let summary = workplace.json(&[&arguments[..], &["--json"]].concat());
    assert_eq!(
        (&summary["solver"]["unsolved_steps"], &summary["steps"]),
        (&1.into(), &20.into()),
        "{summary}"
    );
    // The contact gives a part of its force in that step, and nothing after it.
    let table = Table::parse(&workplace.text("steps.csv"));
    assert!(table.numbers().all(f64::is_finite));
    let forces = table.vectors("finger", ["fx", "fy", "fz"]);
    let felt: Vec<DVec3> = forces.into_iter().filter(|force| *force != DVec3::ZERO).collect();
    assert!(felt.len() == 1 && felt[0].y > 0.0, "the hand feels the cube once: {felt:?}");
    let last = *table.vectors("cube", ["px", "py", "pz"]).last().expect("steps");
    assert!(last.y < 0.0, "the cube goes on: {last}");
    let text = workplace.succeed(&arguments);
    let warning = "\n  warning      in 1 steps contacts could not be solved, and gave a part of their force or none: use a shorter step\n";
    assert!(text.contains(warning), "{text}");
}
