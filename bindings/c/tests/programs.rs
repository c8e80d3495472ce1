//! C and C++ programs that are compiled, linked and run as a user's would be, and give what Rust gives.

use glam::DVec3;
use palpate::{DeviceInput, State, step};
use palpate_scene::{RunMode, read_driven_scene};
use palpate_testkit::free_block;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use tempfile::TempDir;

/// A cube on a floor, a finger that the program leads, and nothing else.
const SCENE: &str = include_str!("../examples/press.toml");

/// Steps of a press, and of the longest run.
const STEPS: usize = 400;
const LONG: usize = 1_000_000;

/// Difference of the resident memory of two runs that is noise [kB].
const MEMORY_NOISE_KB: u64 = 1024;

/// Kind of library that a program is linked with.
#[derive(Clone, Copy, PartialEq)]
enum Linking {
    Shared,
    Static,
}

/// Libraries that the static library needs of Linux (docs/c.md, xtask/src/c_library.rs).
const SYSTEM_LIBRARIES: [&str; 4] = ["-lstdc++", "-lpthread", "-ldl", "-lm"];

struct Workplace(TempDir);

impl Workplace {
    fn new() -> Self {
        let folder = TempDir::new().expect("a folder");
        let path = folder.path();
        std::fs::write(path.join("cube.palp"), free_block().to_bytes().expect("bytes"))
            .expect("a writable folder");
        std::fs::write(path.join("scene.toml"), SCENE).expect("a writable folder");
        Self(folder)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Compiles a program of this crate, with all warnings as errors.
    fn compile(&self, source: &str, linking: Linking, flags: &[&str]) -> PathBuf {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        let (compiler, standard) =
            if source.ends_with(".cpp") { ("c++", "-std=c++17") } else { ("cc", "-std=c11") };
        let program =
            self.path(Path::new(source).file_stem().and_then(|name| name.to_str()).expect("a name"));
        let mut command = Command::new(compiler);
        command.args([standard, "-O1", "-g", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]).args(flags);
        command.arg("-I").arg(folder.join("include")).arg(folder.join(source));
        match linking {
            Linking::Shared => command.arg(library("libpalpate_c.so")),
            Linking::Static => command.arg(library("libpalpate_c.a")).args(SYSTEM_LIBRARIES),
        };
        let output = command.arg("-o").arg(&program).output().expect("a compiler");
        assert!(output.status.success(), "{source}: {}", String::from_utf8_lossy(&output.stderr));
        program
    }

    /// Standard output of a program that succeeds.
    fn run(&self, command: &mut Command, arguments: &[&str]) -> String {
        let Output { status, stdout, stderr } =
            command.args(arguments).current_dir(self.0.path()).output().expect("a program");
        assert!(status.success(), "{command:?}: {status}: {}", String::from_utf8_lossy(&stderr));
        String::from_utf8(stdout).expect("text")
    }
}

/// Library of this crate beside this test.
fn library(name: &str) -> PathBuf {
    let test = std::env::current_exe().expect("a path");
    let file = test.parent().expect("a folder").join(name);
    assert!(file.is_file(), "{} is missing", file.display());
    file
}

/// Output of `press.c`, by the Rust interface.
fn pressed(workplace: &Workplace, steps: usize, every: usize) -> String {
    let scene = read_driven_scene(&workplace.path("scene.toml"), RunMode::RealTime).expect("a scene");
    let mut state = State::new(&scene.model);
    let mut input = scene.input_at(0.0);
    let step_s = scene.model.parameters().step_s;
    let mut lines = String::new();
    for i in 1..=steps {
        let t = (i % 200) as f64 * step_s;
        let depth = 0.14 * if t < 0.1 { t } else { 0.2 - t };
        input.devices[0] = DeviceInput::touching(DVec3::new(0.0, 0.0, 0.115 - depth));
        let output = step(&scene.model, &mut state, &input);
        if i % every == 0 {
            let force = output.devices[0].force_on_hand;
            // The nearest number of 17 digits is this number again.
            lines += &format!("{i} {} {} {} {}\n", force.x, force.y, force.z, output.contacts.len());
        }
    }
    lines
}

fn numbers(text: &str) -> Vec<f64> {
    text.split_whitespace().map(|word| word.parse().unwrap_or_else(|_| panic!("{word:?}"))).collect()
}

#[test]
fn a_press_in_c_gives_the_same_bits_as_in_rust_with_either_library() {
    let workplace = Workplace::new();
    let expected = numbers(&pressed(&workplace, STEPS, 1));
    let strongest = expected.chunks(5).map(|row| row[3]).fold(0.0, f64::max);
    assert!(strongest > 0.05, "the finger presses: {strongest} N");
    for linking in [Linking::Shared, Linking::Static] {
        let press = workplace.compile("examples/press.c", linking, &[]);
        let printed = workplace.run(&mut Command::new(press), &["scene.toml", &STEPS.to_string(), "1"]);
        assert!(numbers(&printed) == expected);
    }
}

#[test]
fn the_first_program_of_the_docs_runs() {
    let workplace = Workplace::new();
    let docs = include_str!("../../../docs/c.md");
    let program = docs.split("```c\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a program");
    std::fs::write(workplace.path("first.c"), program).expect("a writable folder");
    std::fs::write(workplace.path("press.toml"), SCENE).expect("a writable folder");
    let source = workplace.path("first.c");
    let first = workplace.compile(source.to_str().expect("text"), Linking::Shared, &[]);
    let printed = workplace.run(&mut Command::new(first), &[]);
    let forces: Vec<f64> =
        printed.lines().filter_map(|line| line.split_whitespace().nth(2)?.parse().ok()).collect();
    assert!(forces.len() == 5 && forces[0] == 0.0 && forces[4] > 0.05, "{printed}");
}

#[test]
fn a_surface_in_cpp_is_that_of_rust() {
    let workplace = Workplace::new();
    let surface = workplace.compile("examples/surface.cpp", Linking::Shared, &[]);
    let printed = workplace.run(&mut Command::new(surface), &["scene.toml", "300"]);
    let scene = read_driven_scene(&workplace.path("scene.toml"), RunMode::Offline).expect("a scene");
    let mut state = State::new(&scene.model);
    let mut input = scene.input_at(0.0);
    input.devices[0] = DeviceInput::inactive();
    for _ in 0..300 {
        step(&scene.model, &mut state, &input);
    }
    let surface = &scene.model.recordings().next().expect("a recording").surface;
    let mut displacements = vec![DVec3::ZERO; surface.positions.len()];
    state.surface_displacement(&scene.model, 0, &mut displacements);
    let pose = state.output().objects[0].pose;
    let mut expected = String::new();
    for (rest, displacement) in surface.positions.iter().zip(&displacements) {
        let DVec3 { x, y, z } = pose.position + pose.orientation * (*rest + *displacement);
        expected += &format!("v {x} {y} {z}\n");
    }
    for triangle in &surface.triangles {
        let [a, b, c] = triangle.map(|node| node + 1);
        expected += &format!("f {a} {b} {c}\n");
    }
    let without_names = |text: &str| numbers(&text.replace(['v', 'f'], " "));
    assert!(without_names(&printed) == without_names(&expected));
}

#[test]
fn misuse_is_answered_and_never_ends_the_process() {
    let workplace = Workplace::new();
    let misuse = workplace.compile(
        "tests/misuse.c",
        Linking::Shared,
        &["-fsanitize=undefined", "-fno-sanitize-recover"],
    );
    let printed = workplace.run(&mut Command::new(misuse), &["scene.toml"]);
    let missing = "cannot read the scene missing.toml: No such file or directory (os error 2)";
    let expected = format!(
        "no path: 1 path is null
no file: 2 {missing}
a folder: 2 cannot read the scene .: it is a folder, not a file
bytes: 1 path is not UTF-8
no result: 1 the place for the result is null
purpose 9: 1 there is no purpose of number 9
no error: 2 \nno scene: 1 scene is null
nulls: 0 0 1 1 0
load: 0 \nnew: 0 \nnames: cube finger floor 1 -1
parts of kind 7: 0
input: 0 \nbegins in mode 2\nforce: 1 \ndevice 5: 1 \nmode 77: 1 there is no mode of a device of number 77
object 3: 13 object 3: there is no point in triangle 0 with such weights where a force may enter
triangle 1000000: 13 object \"cube\": there is no point in triangle 1000000 with such weights where a force may enter
obstacle 9: 1 \nnan: 0 \nstep: 0 \nrejected: 1
copy: 0 
warning: the motion of \"finger\" goes 199.9 m away from the objects, which span 0.245 m: positions are in metres; if these are in millimetres, divide them by 1000
warnings before: 0, of no state: 0
no state: 1 \nsurface: 1 \nsurface of 4: 1 \nnowhere: 1 \nnearest: 0 \nposition: 0 \nheld: 0 \ncopy: 0 \npulled: 1, alike: 1, time: 0.022
obstacles: 1, pressed: 1, by its contacts: 1
"
    );
    assert_eq!(printed, expected);
}

#[test]
fn a_million_steps_take_no_memory() {
    let workplace = Workplace::new();
    let press = workplace.compile("examples/press.c", Linking::Shared, &[]);
    let memory = |steps: usize| -> u64 {
        let arguments = ["scene.toml", &steps.to_string(), "200000"];
        let output = Command::new(&press).args(arguments).current_dir(workplace.0.path()).output();
        let Output { status, stdout, stderr } = output.expect("a program");
        let text = String::from_utf8(stderr).expect("text");
        assert!(
            status.success() && String::from_utf8_lossy(&stdout).lines().count() == steps / 200_000,
            "{text}"
        );
        let number = text.lines().last().and_then(|line| line.strip_prefix("memory: ")?.strip_suffix(" kB"));
        number.and_then(|number| number.parse().ok()).unwrap_or_else(|| panic!("{text:?}"))
    };
    let (few, many) = (memory(1000), memory(LONG));
    assert!(many < few + MEMORY_NOISE_KB, "{few} kB after 1000 steps, {many} kB after {LONG}");
}

#[test]
fn memory_checkers_find_nothing() {
    let workplace = Workplace::new();
    let address = workplace.compile("examples/press.c", Linking::Static, &["-fsanitize=address,undefined"]);
    let with_checks = workplace.run(&mut Command::new(address), &["scene.toml", "400", "1"]);
    let press = workplace.compile("examples/press.c", Linking::Static, &[]);
    let misuse = workplace.compile("tests/misuse.c", Linking::Static, &[]);
    assert_eq!(workplace.run(&mut Command::new(&press), &["scene.toml", "400", "1"]), with_checks);
    if Command::new("valgrind").arg("--version").output().is_err() {
        eprintln!("valgrind is missing: the address sanitizer alone has looked");
        return;
    }
    for (program, arguments) in [(press, &["scene.toml", "60", "60"][..]), (misuse, &["scene.toml"])] {
        let mut valgrind = Command::new("valgrind");
        valgrind.args(["--quiet", "--leak-check=full", "--error-exitcode=9"]).arg(program);
        workplace.run(&mut valgrind, arguments);
    }
}
