//! A temporary folder with a recording and scenes, and `palpate` in it.

use crate::child::{Ended, Running};
use serde_json::Value;
use std::net::{Ipv4Addr, TcpListener, UdpSocket};
use std::path::{Path, PathBuf};
use std::process::Command;
use tempfile::TempDir;

/// Arguments that record a cube of 3×3×3 cells.
const CUBE: &str = "record box:0.1x0.1x0.1/3x3x3 --order 1 --young 2000 --poisson 0.3 --density 110 --rayleigh 2,2e-4 --modes 20";

/// Folder that goes when it is dropped.
pub struct Workplace {
    folder: TempDir,
    palpate: PathBuf,
}

impl Workplace {
    /// A workplace with `cube.palp`, `fingers.toml` (two fingers that press it for an hour) and `linked.toml` (one that another
    /// process leads along `left.csv`).
    pub fn new(palpate: &Path) -> Result<Self, String> {
        let folder = TempDir::new().map_err(|error| format!("no temporary folder: {error}"))?;
        let workplace = Self { folder, palpate: palpate.to_path_buf() };
        workplace.succeed(&format!("{CUBE} -o cube.palp"))?;
        for (name, side) in [("left", -1.0), ("right", 1.0)] {
            let mut path = String::from("t,x,y,z\n");
            for half_second in 0..7200 {
                let x = side * if half_second % 2 == 0 { 0.058 } else { 0.052 };
                path += &format!("{},{x},0,0.05\n", f64::from(half_second) * 0.5);
            }
            workplace.write(&format!("{name}.csv"), path)?;
        }
        let path = |name: &str| finger(name, &format!("path = {{ file = \"{name}.csv\" }}\n"));
        workplace.write("fingers.toml", [BODY, &path("left"), &path("right")].concat())?;
        workplace
            .write("linked.toml", [BODY, &finger("left", "linked = true\n"), &path("right")].concat())?;
        Ok(workplace)
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) -> Result<(), String> {
        std::fs::write(self.path(name), content).map_err(|error| format!("{name}: {error}"))
    }

    pub fn read(&self, name: &str) -> Result<Vec<u8>, String> {
        std::fs::read(self.path(name)).map_err(|error| format!("{name}: {error}"))
    }

    /// Names of all files here that contain a text.
    pub fn files_with(&self, text: &str) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).into_iter().flatten().flatten();
        let mut names: Vec<_> =
            entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
        names.retain(|name| name.contains(text));
        names.sort();
        names
    }

    /// `palpate` in this folder, with arguments that hold no blanks.
    pub fn palpate(&self, arguments: &str) -> Command {
        let mut command = Command::new(&self.palpate);
        command.args(arguments.split_whitespace());
        self.settle(&mut command);
        command
    }

    /// `palpate` from a shell that first runs a command, for limits and ignored signals.
    pub fn palpate_after(&self, first: &str, arguments: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", &format!("{first}; exec {} {arguments}", self.palpate.display())]);
        self.settle(&mut command);
        command
    }

    /// `palpate` as the arguments of a script of a shell.
    pub fn palpate_in(&self, script: &str, arguments: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script, "sh"]).arg(&self.palpate).args(arguments.split_whitespace());
        self.settle(&mut command);
        command
    }

    fn settle(&self, command: &mut Command) {
        let folder = self.folder.path();
        command.current_dir(folder).env("HOME", folder).env("XDG_CACHE_HOME", folder.join("cache"));
        command.env("TMPDIR", folder);
    }

    pub fn start(&self, arguments: &str) -> Result<Running, String> {
        Running::start(&mut self.palpate(arguments))
    }

    /// Runs a command line to its end.
    pub fn run(&self, arguments: &str) -> Result<Ended, String> {
        self.start(arguments)?.end().map_err(|what| format!("palpate {arguments}: {what}"))
    }

    /// Runs a command line that must succeed; gives its standard output.
    pub fn succeed(&self, arguments: &str) -> Result<String, String> {
        match self.run(arguments)? {
            Ended { code: Some(0), output, .. } => Ok(output),
            Ended { code, printed, .. } => Err(format!("palpate {arguments} ended with {code:?}: {printed}")),
        }
    }

    /// Runs a command line that must fail with status 1 and an error on one line; gives that line.
    pub fn fail(&self, arguments: &str) -> Result<String, String> {
        let Ended { code, printed, .. } = self.run(arguments)?;
        let error = printed.lines().find(|line| line.starts_with("error: "));
        match (code, error) {
            (Some(1), Some(error)) => Ok(error.to_string()),
            _ => Err(format!("palpate {arguments} ended with {code:?}: {printed:?}")),
        }
    }

    /// Address on loopback with a port that is free for TCP and UDP now, and most likely a moment later.
    pub fn free_address(&self) -> Result<String, String> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0)).map_err(|error| error.to_string())?;
        let address = listener.local_addr().map_err(|error| error.to_string())?;
        UdpSocket::bind(address).map_err(|error| error.to_string())?;
        Ok(address.to_string())
    }
}

/// JSON object that a command has printed on standard output.
pub fn json(output: &str) -> Result<Value, String> {
    serde_json::from_str(output).map_err(|error| format!("no JSON ({error}): {output:?}"))
}

const BODY: &str = r#"step = 0.001
gravity = [0.0, 0.0, -9.81]
[[object]]
name = "cube"
recording = "cube.palp"
position = [0.0, 0.0, 0.0501]
[[plane]]
name = "floor"
point = [0.0, 0.0, 0.0]
normal = [0.0, 0.0, 1.0]
"#;

/// A finger of a scene with further lines.
fn finger(name: &str, more: &str) -> String {
    format!(
        "[[device]]\nname = \"{name}\"\nmode = \"touch\"\ntip_radius = 0.005\nfriction = 0.6\n\
         coupling = {{ stiffness = 200.0, damping = 0.5 }}\n{more}"
    )
}
