//! Scenes of experiments: planes that move, against statics and the laws of motion.

use crate::workplace::{Table, Workplace};
use std::fmt::Write;

/// Arguments that record a stiff cube of 0.1 m and 1 kg, so damped that it settles within a tenth of a second.
const STIFF_CUBE: [&str; 15] = [
    "record",
    "box:0.1x0.1x0.1/2x2x2",
    "--order",
    "1",
    "--young",
    "2e6",
    "--poisson",
    "0.3",
    "--density",
    "1000",
    "--rayleigh",
    "0,3e-4",
    "--modes",
    "30",
    "-o",
];

const MASS: f64 = 1.0;
const GRAVITY: f64 = 9.81;
const STEP: f64 = 1e-3;

/// Round-off of an energy ledger of thousands of steps, relative to its largest term [1].
const LEDGER_ROUND_OFF: f64 = 1e-11;

fn workplace() -> Workplace {
    let workplace = Workplace::new();
    workplace.succeed(&[&STIFF_CUBE[..], &["cube.palp"]].concat());
    workplace
}

/// Rows of a path over so many steps from a function of time.
fn rows(steps: usize, of: impl Fn(f64) -> Vec<f64>) -> String {
    let mut text = String::new();
    for number in 0..=steps {
        let t = number as f64 * STEP;
        let cells: Vec<String> = of(t).iter().map(|cell| format!("{cell:?}")).collect();
        writeln!(text, "{t:?},{}", cells.join(",")).expect("a string");
    }
    text
}

/// The defect of every row is round-off.
fn check_energy(table: &Table) {
    let names = ["kinetic", "elastic", "potential", "input", "friction"];
    let columns = names.map(|name| table.column(&format!("energy.{name}")));
    let scale = columns.iter().flatten().fold(0.0_f64, |most, energy| most.max(energy.abs()));
    for (row, defect) in table.column("energy.defect").into_iter().enumerate() {
        assert!(defect.abs() < LEDGER_ROUND_OFF * scale, "row {row}: {defect} J of {scale} J");
    }
}

#[test]
fn a_cube_slides_down_a_plane_that_tilts_when_the_slope_reaches_the_coefficient_of_friction() {
    /// Coefficient of friction [1], and slip that is seen [m].
    const FRICTION: f64 = 0.3;
    const SLIP: f64 = 2e-5;
    let workplace = workplace();
    // From 10 % below the slope of sliding to 10 % above it in 4 s, after 0.5 s to settle.
    let angle = |t: f64| (FRICTION * (0.9 + 0.2 * ((t - 0.5) / 4.0).max(0.0))).atan();
    let (sin, cos) = (0.5 * angle(0.0)).sin_cos();
    let up = [angle(0.0).sin(), angle(0.0).cos()].map(|axis| 0.05 * axis);
    workplace.write(
        "tilt.csv",
        rows(4500, |t| {
            let (sin, cos) = (0.5 * angle(t)).sin_cos();
            vec![0.0, 0.0, 0.0, cos, 0.0, 0.0, -sin]
        }),
    );
    workplace.write(
        "scene.toml",
        format!(
            "gravity = [0.0, -{GRAVITY}, 0.0]\n[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nposition = [{}, {}, \
             0.0]\norientation = [{cos}, 0.0, 0.0, {}]\n[[plane]]\nname = \"ramp\"\nnormal = [0.0, 2.0, 0.0]\npath = {{ \
             file = \"tilt.csv\" }}\nfriction = {FRICTION}\n",
            up[0], up[1], -sin
        ),
    );
    let text = workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv"]);
    assert!(text.starts_with("4500 steps"), "to the end of the plane's path: {text}");
    assert!(text.contains("from hands and obstacles"), "{text}");
    let table = Table::parse(&workplace.text("steps.csv"));
    let places = table.vectors("cube", ["px", "py", "pz"]);
    let along: Vec<f64> = table
        .column("t")
        .iter()
        .zip(&places)
        .map(|(t, place)| angle(*t).cos() * place.x - angle(*t).sin() * place.y)
        .collect();
    let slides = along[500..].iter().position(|x| x - along[499] > SLIP).expect("it slides") + 500;
    let slope = angle(slides as f64 * STEP).tan();
    // It slips by SLIP some 0.1 s after the slope of sliding: 0.5 % more.
    assert!((slope / FRICTION - 1.0).abs() < 0.01, "slope {slope} for a coefficient of {FRICTION}");
    check_energy(&table);
}

#[test]
fn a_plane_that_accelerates_upwards_carries_weight_and_inertia() {
    /// Acceleration of the plane [m/s²].
    const ACCELERATION: f64 = 2.0;
    let workplace = workplace();
    workplace.write("lift.csv", rows(1000, |t| vec![0.0, 0.5 * ACCELERATION * t * t, 0.0]));
    workplace.write(
        "scene.toml",
        format!(
            "gravity = [0.0, -{GRAVITY}, 0.0]\n[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nposition = [0.0, \
             0.05, 0.0]\n[[plane]]\nnormal = [0.0, 1.0, 0.0]\npath = {{ file = \"lift.csv\" }}\n"
        ),
    );
    workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv", "--contacts", "contacts.csv"]);
    let table = Table::parse(&workplace.text("steps.csv"));
    let forces = workplace.text("contacts.csv");
    let late = forces.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    let impulse: f64 = late
        .filter(|cells| cells[0].parse::<f64>().expect("a time") > 0.5 + 0.5 * STEP)
        .map(|cells| cells[10].parse::<f64>().expect("a force") * STEP)
        .sum();
    // Over the second half: the impulse is that of weight and inertia, and the cube moves as the plane does.
    let expected = MASS * (GRAVITY + ACCELERATION) * 0.5;
    assert!((impulse / expected - 1.0).abs() < 1e-3, "{impulse} N·s, expected {expected}");
    let speed = table.column("cube.vy").last().copied().expect("a row");
    assert!((speed - ACCELERATION).abs() < 2e-3, "{speed} m/s");
    check_energy(&table);
}

#[test]
fn gravity_less_acceleration_stands_for_a_plane_that_accelerates() {
    /// Largest acceleration of the table along its plane and up [m/s²], and its angular frequency [rad/s].
    const ACCELERATION: [f64; 2] = [6.0, 4.0];
    const OMEGA: f64 = 20.0;
    /// Difference of the cube's position on the table between both frames [m]: quadrature of the paths over a step.
    const SAME_M: f64 = 2e-5;
    let workplace = workplace();
    // From rest: x = a·(t − sin(ω·t)/ω)/ω has the acceleration a·sin(ω·t).
    let place = |a: f64, t: f64| a * (t - (OMEGA * t).sin() / OMEGA) / OMEGA;
    let [along, up] = ACCELERATION;
    workplace.write("table.csv", rows(1000, |t| vec![place(along, t), place(up, t), 0.0]));
    workplace.write(
        "gravity.csv",
        rows(1000, |t| vec![-along * (OMEGA * t).sin(), -GRAVITY - up * (OMEGA * t).sin(), 0.0]),
    );
    let object = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\nposition = [0.0, 0.05, 0.0]\n";
    let plane = "[[plane]]\nnormal = [0.0, 1.0, 0.0]\nfriction = 0.4\n";
    let scenes = [
        format!("gravity = [0.0, -{GRAVITY}, 0.0]\n{object}{plane}path = {{ file = \"table.csv\" }}\n"),
        format!("gravity = {{ file = \"gravity.csv\" }}\n{object}{plane}point = [0.0, 0.0, 0.0]\n"),
    ];
    let [moving, still] = scenes.map(|scene| {
        workplace.write("scene.toml", scene);
        workplace.succeed(&["run", "scene.toml", "--duration", "1", "--csv", "steps.csv"]);
        let table = Table::parse(&workplace.text("steps.csv"));
        check_energy(&table);
        table
    });
    let slid = still.column("cube.px").iter().fold(0.0_f64, |most, x| most.max(x.abs()));
    assert!(slid > 0.01, "the cube slides by {slid} m");
    for (axis, a) in [("cube.px", along), ("cube.py", up)] {
        for (row, (moving, still)) in moving.column(axis).into_iter().zip(still.column(axis)).enumerate() {
            let on_table = moving - place(a, (row + 1) as f64 * STEP);
            assert!((on_table - still).abs() < SAME_M, "{axis}, row {row}: {on_table} {still}");
        }
    }
}

#[test]
fn gravity_is_a_vector_or_a_file() {
    let workplace = workplace();
    let object = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n";
    let fail = |gravity: &str| {
        workplace.write("scene.toml", format!("gravity = {gravity}\n{object}"));
        workplace.fail(&["run", "scene.toml"])
    };
    let expected = "expected [x, y, z] in m/s², or { file = \"…\" } with the columns t, x, y, z";
    for wrong in ["\"down\"", "9.81"] {
        let text = fail(wrong);
        assert!(text.starts_with("scene.toml: TOML parse error at line 1, column "), "{text}");
        assert!(text.contains(expected), "{text}");
    }
    assert!(fail("[0, -9.81]").contains("2 numbers, expected 3"), "{}", fail("[0, -9.81]"));
    assert!(fail("{ file = \"none.csv\" }").contains("cannot read the path none.csv"));
    workplace.write("gravity.csv", "0,0,nan,0\n");
    let text = fail("{ file = \"gravity.csv\" }");
    assert!(text.starts_with("scene.toml: line 1: path gravity.csv: line 1"), "{text}");
    // The run lasts as long as gravity changes.
    workplace.write("gravity.csv", "0,0,-9.81,0\n0.25,0,0,0\n");
    workplace.write("scene.toml", format!("gravity = {{ file = \"gravity.csv\" }}\n{object}"));
    workplace.succeed(&["run", "scene.toml", "--csv", "steps.csv"]);
    let table = Table::parse(&workplace.text("steps.csv"));
    assert_eq!(table.len(), 250);
    let speed = table.column("cube.vy").last().copied().expect("a row");
    assert!((speed + 0.5 * GRAVITY * 0.25).abs() < 1e-12, "{speed}");
}

#[test]
fn an_object_with_fixed_nodes_starts_at_its_sag() {
    let workplace = Workplace::new();
    workplace.succeed(&[&STIFF_CUBE[..], &["beam.palp", "--fix", "x<-0.049"]].concat());
    let run = |start: &str| {
        let object = format!("[[object]]\nname = \"beam\"\nrecording = \"beam.palp\"\n{start}");
        workplace.write("scene.toml", format!("gravity = [0.0, -{GRAVITY}, 0.0]\n{object}"));
        workplace.succeed(&["run", "scene.toml", "--duration", "0.5", "--csv", "steps.csv"]);
        Table::parse(&workplace.text("steps.csv"))
    };
    let elastic = |table: &Table| table.column("energy.elastic");
    let (still, swinging) = (elastic(&run("start = \"equilibrium\"\n")), elastic(&run("")));
    let most = still.iter().fold(0.0_f64, |most, e| most.max(*e));
    assert!(most > 0.0 && still.iter().all(|e| (e / most - 1.0).abs() < 1e-9), "{most}");
    // Undeformed, it overshoots to nearly twice the sag and comes to rest at it.
    assert!(swinging.iter().any(|e| *e > 2.0 * most), "{most}");
    assert!((swinging[swinging.len() - 1] / most - 1.0).abs() < 1e-3, "{most} {:?}", swinging.last());
    workplace
        .write("scene.toml", "[[object]]\nname = \"beam\"\nrecording = \"beam.palp\"\nstart = \"still\"\n");
    assert_eq!(
        workplace.fail(&["run", "scene.toml"]),
        "scene.toml: line 4: start is \"still\", expected \"undeformed\" or \"equilibrium\""
    );
}

#[test]
fn a_plane_has_a_point_or_a_path() {
    let workplace = workplace();
    workplace.write("lift.csv", "0,0,0,0\n");
    let fail = |plane: &str| {
        let object = "[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n";
        workplace.write("scene.toml", format!("{object}[[plane]]\nnormal = [0, 1, 0]\n{plane}"));
        workplace.fail(&["run", "scene.toml"])
    };
    assert_eq!(
        fail("point = [0, 0, 0]\npath = { file = \"lift.csv\" }\n"),
        "scene.toml: line 6: the point is in the path: leave one of the two out"
    );
    assert_eq!(
        fail(""),
        "scene.toml: line 4: the plane \"plane\" needs a point on it, point = [x, y, z], or path = { file = \"…\" } if it moves"
    );
    workplace.write("lift.csv", "0,0,0\n");
    assert_eq!(
        fail("path = { file = \"lift.csv\" }\n"),
        "scene.toml: line 6: path lift.csv: line 1: 3 numbers, expected the four t,x,y,z or the eight t,x,y,z,qw,qx,qy,qz"
    );
}
