//! A folder to work in, the command `palpate` in it, and small files to feed it.

use palpate_haptics::log::LogReader;
use palpate_testkit::made_once_per_run;
use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;
use tempfile::TempDir;

/// A folder of its own that goes when the test ends.
pub struct Workplace {
    folder: TempDir,
    variables: Vec<(String, String)>,
}

/// Arguments that record a cube of 3×3×3 cells; the output comes last.
pub const CUBE: [&str; 15] = [
    "record",
    "box:0.1x0.1x0.1/3x3x3",
    "--order",
    "1",
    "--young",
    "2000",
    "--poisson",
    "0.3",
    "--density",
    "110",
    "--rayleigh",
    "2,2e-4",
    "--modes",
    "20",
    "-o",
];

/// Two hands that hold the cube's left and right and press it for 50 ms, the right one for 40 ms only: the scene of
/// `palpate demo`, with gravity.
pub static SCENE: LazyLock<String> = LazyLock::new(|| {
    let two_hands = include_str!("../../src/commands/demo/two_hands.toml");
    format!("step = 0.001\ngravity = [0.0, 0.0, -9.81]\n\n{two_hands}")
});

/// The command `palpate` with room for so many blocks of 512 bytes in every file: a limit on the size of files acts as a full disk does.
pub fn with_room(blocks: u64) -> Command {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$@\""), "sh"])
        .arg(env!("CARGO_BIN_EXE_palpate"));
    command
}

/// The command `palpate` with an address space of so many kilobytes: allocations beyond it fail.
pub fn with_memory(kilobytes: u64) -> Command {
    let mut command = Command::new("sh");
    // No core files.
    command
        .args(["-c", &format!("ulimit -c 0; ulimit -v {kilobytes}; exec \"$@\""), "sh"])
        .arg(env!("CARGO_BIN_EXE_palpate"));
    command
}

/// The recording of [`CUBE`], made once per run.
fn cube() -> PathBuf {
    let folder = made_once_per_run(Path::new(env!("CARGO_TARGET_TMPDIR")), "cube", |folder| {
        let workplace = Workplace::new();
        workplace.succeed(&[&CUBE[..], &["cube.palp"]].concat());
        std::fs::copy(workplace.path("cube.palp"), folder.join("cube.palp")).expect("a writable folder");
    });
    folder.join("cube.palp")
}

impl Workplace {
    /// An empty folder.
    pub fn new() -> Self {
        Self { folder: TempDir::new().expect("a temporary folder"), variables: Vec::new() }
    }

    /// Give `palpate` an environment variable.
    pub fn set(&mut self, name: &str, value: &str) {
        self.variables.push((name.to_string(), value.to_string()));
    }

    /// A folder with `cube.palp`, `scene.toml` and its paths `left.csv` and `right.csv`.
    pub fn with_scene() -> Self {
        let workplace = Self::new();
        std::fs::copy(cube(), workplace.path("cube.palp")).expect("a writable folder");
        workplace.write("scene.toml", &*SCENE);
        workplace.write("left.csv", "t,x,y,z\n0,-0.05,0,0\n0.03,-0.045,0.002,0\n0.05,-0.04,0.01,0.002\n");
        workplace.write("right.csv", "# a comment\n0,0.05,0,0\n0.04,0.046,0,0.001\n");
        workplace
    }

    /// A file of this folder.
    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Write a file.
    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        let path = self.path(name);
        path.parent().map(std::fs::create_dir_all).transpose().expect("a writable folder");
        std::fs::write(path, content).expect("a writable folder");
    }

    /// Read a file.
    pub fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Read a file of text.
    pub fn text(&self, name: &str) -> String {
        String::from_utf8(self.read(name)).expect("text")
    }

    /// Number of steps of a log that can be read now.
    pub fn logged_steps(&self, log: &str) -> u64 {
        let bytes = std::fs::read(self.path(log)).unwrap_or_default();
        LogReader::new(bytes).map_or(0, |log| log.step_count())
    }

    /// Names of all files here, sorted.
    pub fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("a folder");
        let mut names: Vec<_> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    }

    /// Run `palpate` in this folder, away from the home of whoever runs the tests.
    pub fn palpate(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("the command starts")
    }

    /// The command that [`Self::palpate`] runs.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_palpate"));
        command.args(arguments).current_dir(self.folder.path()).env("HOME", self.folder.path());
        command.env("XDG_CACHE_HOME", self.path("cache"));
        command.envs(self.variables.iter().map(|(name, value)| (name, value)));
        command
    }

    /// Run `palpate` here with room for so many blocks of 512 bytes in every file.
    pub fn palpate_with_room(&self, blocks: u64, arguments: &[&str]) -> Output {
        with_room(blocks)
            .args(arguments)
            .current_dir(self.folder.path())
            .env("XDG_CACHE_HOME", self.path("cache"))
            .output()
            .expect("a shell")
    }

    /// Run a command line that must succeed; gives standard output.
    pub fn succeed(&self, arguments: &[&str]) -> String {
        let Output { status, stdout, stderr } = self.palpate(arguments);
        let stderr = String::from_utf8_lossy(&stderr);
        assert_eq!(status.code(), Some(0), "{arguments:?}: {stderr}");
        assert!(!stderr.contains("error"), "{arguments:?}: {stderr}");
        String::from_utf8(stdout).expect("text on standard output")
    }

    /// JSON on standard output of a command that succeeds.
    pub fn json(&self, arguments: &[&str]) -> Value {
        serde_json::from_str(&self.succeed(arguments)).expect("one JSON object")
    }

    /// Run a command line that must fail with status 1, nothing on standard output and one error; gives its text.
    pub fn fail(&self, arguments: &[&str]) -> String {
        let Output { status, stdout, stderr } = self.palpate(arguments);
        let stderr = String::from_utf8(stderr).expect("text on standard error");
        assert_eq!(status.code(), Some(1), "{arguments:?}: {stderr}");
        assert!(stdout.is_empty(), "{arguments:?} printed {}", String::from_utf8_lossy(&stdout));
        assert_eq!(stderr.matches("error: ").count(), 1, "{arguments:?}: {stderr}");
        let (_, text) = stderr.split_once("error: ").expect("counted above");
        text.trim_end().to_string()
    }
}

/// A table of numbers with named columns.
pub struct Table {
    /// The header line.
    pub header: String,
    rows: Vec<Vec<f64>>,
}

impl Table {
    /// Read CSV.
    pub fn parse(text: &str) -> Self {
        let mut lines = text.lines();
        let header = lines.next().expect("a header").to_string();
        let number = |cell: &str| cell.parse().unwrap_or_else(|_| panic!("{cell:?} is no number"));
        let rows: Vec<Vec<f64>> = lines.map(|line| line.split(',').map(number).collect()).collect();
        let columns = header.split(',').count();
        assert!(rows.iter().all(|row| row.len() == columns), "a row of other length than the header");
        Self { header, rows }
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.rows.len()
    }

    /// All numbers.
    pub fn numbers(&self) -> impl Iterator<Item = f64> {
        self.rows.iter().flatten().copied()
    }

    /// One column.
    pub fn column(&self, name: &str) -> Vec<f64> {
        let at = self.header.split(',').position(|column| column == name);
        let at = at.unwrap_or_else(|| panic!("no column {name} in {}", self.header));
        self.rows.iter().map(|row| row[at]).collect()
    }

    /// Three columns that make a vector: NAME with each of the endings.
    pub fn vectors(&self, name: &str, endings: [&str; 3]) -> Vec<glam::DVec3> {
        let [x, y, z] = endings.map(|ending| self.column(&format!("{name}.{ending}")));
        (0..self.len()).map(|row| glam::DVec3::new(x[row], y[row], z[row])).collect()
    }
}

/// A bar of 0.2 × 0.1 × 0.1 m as a Gmsh 2.2 file: its halves are the volumes `soft` (1) and `stiff` (2), its left end
/// the surface `foot`.
pub fn gmsh_bar() -> String {
    let mesh = palpate_mesh::box_mesh([0.2, 0.1, 0.1], [4, 2, 2]).expect("a good box");
    let x = |node: &u32| mesh.nodes[*node as usize].x;
    let mut elements = Vec::new();
    for triangle in mesh.boundary() {
        if triangle.iter().all(|node| x(node) < -0.0999) {
            elements.push(format!("2 2 7 1 {}", triangle.map(|node| (node + 1).to_string()).join(" ")));
        }
    }
    for tet in &mesh.tets {
        let volume = if tet.iter().map(x).sum::<f64>() < 0.0 { 1 } else { 2 };
        elements.push(format!("4 2 {volume} {volume} {}", tet.map(|node| (node + 1).to_string()).join(" ")));
    }
    let numbered = |(at, line): (usize, String)| format!("{} {line}", at + 1);
    let nodes: Vec<_> =
        mesh.nodes.iter().map(|p| format!("{} {} {}", p.x, p.y, p.z)).enumerate().map(numbered).collect();
    let elements: Vec<_> = elements.into_iter().enumerate().map(numbered).collect();
    format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n3\n2 7 \"foot\"\n3 1 \"soft\"\n3 2 \"stiff\"\n\
         $EndPhysicalNames\n$Nodes\n{}\n{}\n$EndNodes\n$Elements\n{}\n{}\n$EndElements\n",
        nodes.len(),
        nodes.join("\n"),
        elements.len(),
        elements.join("\n")
    )
}
