//! Figure 5(b), live: two devices in processes of their own hold the cube's sides over links and shake it at 2 Hz, free of gravity.

use super::{Chapter, DataFile};
use crate::Failure;
use crate::progress::Bars;
use crate::report::chart::{Axis, Chart, Series, Style};
use crate::report::{Scale, Section, code, figure, paragraph, table};
use palpate_fem::progress::Progress;
use palpate_fem::record::Recorded;
use serde_json::Value;
use std::fmt::Write;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;
use std::process::{Child, Command, Output, Stdio};

/// How the cube is shaken.
const SHAKES_HZ: f64 = 2.0;
const SWAY_M: f64 = 0.02;
/// The devices come before they shake, and shake until the end.
const SETTLING_S: f64 = 1.0;
const SECONDS: f64 = 10.0;
const SIDES: [(&str, f64); 2] = [("left", -0.05), ("right", 0.05)];

/// What the paper says of its force process, and ours at its rate and at twice that.
const STEPS_S: [f64; 2] = [2e-3, 1e-3];

/// The last shakes are drawn.
const DRAWN_S: f64 = 1.5;

/// A run: the report of the force process, those of the devices.
struct Ran {
    scene: Value,
    devices: Vec<Value>,
}

/// Runs at both rates, in a folder where all that they need stays.
pub fn chapter(body: &Recorded, folder: &Path, progress: &mut Bars) -> Result<Chapter, Failure> {
    progress.begin("two devices, live", STEPS_S.len() as u64);
    std::fs::create_dir_all(folder).map_err(|e| Failure::file("make the folder", folder, &e))?;
    write(&folder.join("cube.palp"), &body.recording.to_bytes()?)?;
    for (name, side) in SIDES {
        write(&folder.join(format!("{name}.csv")), path(side).as_bytes())?;
    }
    let mut rows = vec![vec![
        "the paper, 500 Hz".into(),
        "0.5 ms at most".into(),
        "not told".into(),
        "every cycle within 2 ms".into(),
        "not told".into(),
    ]];
    for (at, step_s) in STEPS_S.into_iter().enumerate() {
        write(&folder.join(scene_name(step_s)), scene(step_s).as_bytes())?;
        rows.push(row(step_s, &run(folder, step_s)?)?);
        progress.advance(at as u64 + 1);
    }
    let steps = replayed(folder)?;
    progress.finish();
    let mut html = paragraph(&format!(
        "The left and the right side of the cube are held by two devices, each in a process of its own, that reach the force \
         process over links (QUIC datagrams on this machine) and shake it from side to side at {SHAKES_HZ} Hz by ±{:.0} mm for \
         {:.0} s. The step is the time from the begin of a cycle to its forces; motion to force is what a device sees from telling \
         where it is to a force that answers it.",
        1e3 * SWAY_M,
        SECONDS - SETTLING_S
    ));
    let head = ["", "step: median / 99.9 %", "motion to force: median / 99 %", "overruns", "force at most"];
    html += &table("The force process with two devices over links", &head, &rows);
    html += &figure(
        &chart(&steps).svg(),
        "Forces on the hands along the way of the shaking, and the way itself, from the log of the run at 1 kHz. The hands share the \
         cube's inertia: where their curves are one, they push alike.",
    );
    html += &code(&format!(
        "palpate run {} --realtime --duration {SECONDS} --log run.mcap\npalpate device left --path left.csv\npalpate device right --path \
         right.csv",
        scene_name(STEPS_S[1])
    ));
    let section = Section { id: "live".into(), heading: "Figure 5(b): two devices, live".into(), body: html };
    Ok(Chapter { section, data: vec![DataFile { name: "figure-5b.csv".into(), text: steps }] })
}

fn write(path: &Path, bytes: &[u8]) -> Result<(), Failure> {
    crate::verbs::write_whole(path, bytes)
}

fn scene_name(step_s: f64) -> String {
    format!("shake-{:.0}-hz.toml", 1.0 / step_s)
}

/// Where a hand goes: t,x,y,z.
fn path(side: f64) -> String {
    let mut text = "t,x,y,z\n".to_string();
    for tick in 0..=((SECONDS * 1e3) as u32) {
        let t = 1e-3 * f64::from(tick);
        let shaken = (t - SETTLING_S).max(0.0);
        // It begins without a jump of the speed.
        let size = SWAY_M * (4.0 * shaken).min(1.0);
        let x = side + size * (std::f64::consts::TAU * SHAKES_HZ * shaken).sin();
        let _ = writeln!(text, "{t:.3},{x:.7},0,0");
    }
    text
}

fn scene(step_s: f64) -> String {
    let mut text = format!("step = {step_s}\n\n[[object]]\nname = \"cube\"\nrecording = \"cube.palp\"\n");
    for (name, side) in SIDES {
        let _ = write!(
            text,
            "\n[[device]]\nname = \"{name}\"\nmode = \"held\"\nattach = {{ object = \"cube\", point = [{side:?}, 0.0, 0.0] }}\n\
             linked = true\n"
        );
    }
    text
}

/// Three processes: the scene, and a device each.
fn run(folder: &Path, step_s: f64) -> Result<Ran, Failure> {
    let failed = |e: std::io::Error| Failure(format!("two devices, live: a process can't be run: {e}"));
    let program = std::env::current_exe().map_err(failed)?;
    let address = free_port().map_err(failed)?.to_string();
    let duration = SECONDS.to_string();
    let start = |arguments: &[&str]| -> Result<Child, Failure> {
        let mut command = Command::new(&program);
        command.args(arguments).arg("--json").current_dir(folder);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().map_err(failed)
    };
    let mut scene_arguments =
        vec!["run", "--realtime", "--pictures", "0", "--duration", &duration, "--listen", &address];
    if step_s == STEPS_S[1] {
        scene_arguments.extend(["--log", "run.mcap"]);
    }
    let name = scene_name(step_s);
    scene_arguments.push(&name);
    let files = SIDES.map(|(name, _)| (name, format!("{name}.csv")));
    let mut children = vec![start(&scene_arguments)?];
    // They leave a second before the scene does.
    let short = (SECONDS - 1.0).to_string();
    for (name, file) in &files {
        let device = start(&[
            "device",
            name,
            "--path",
            file,
            "--connect",
            &address,
            "--duration",
            &short,
            "--wait",
            "10",
        ]);
        match device {
            Ok(device) => children.push(device),
            Err(failure) => {
                children.iter_mut().for_each(|child| drop(child.kill()));
                return Err(failure);
            }
        }
    }
    let outputs: Result<Vec<Output>, _> = children.into_iter().map(Child::wait_with_output).collect();
    let mut told = outputs.map_err(failed)?.into_iter().map(|output| -> Result<Value, Failure> {
        let said = String::from_utf8_lossy(&output.stderr);
        let read = serde_json::from_slice(&output.stdout);
        read.map_err(|_| {
            Failure(format!("two devices, live: a process ended without a report: {}", said.trim()))
        })
    });
    let scene = told.next().unwrap_or(Ok(Value::Null))?;
    Ok(Ran { scene, devices: told.collect::<Result<_, _>>()? })
}

/// A port of this machine that nobody listens on.
fn free_port() -> std::io::Result<SocketAddr> {
    UdpSocket::bind("127.0.0.1:0")?.local_addr()
}

/// A number of a report.
fn number(report: &Value, pointer: &str) -> Result<f64, Failure> {
    let found = report.pointer(pointer).and_then(Value::as_f64);
    found.ok_or_else(|| Failure(format!("two devices, live: a report has no {pointer}")))
}

fn row(step_s: f64, ran: &Ran) -> Result<Vec<String>, Failure> {
    let force = |key: &str| number(&ran.scene, &format!("/force_process/{key}"));
    let worst = |key: &str| -> Result<f64, Failure> {
        ran.devices.iter().map(|device| number(device, key)).try_fold(0.0, |most, own| Ok(own?.max(most)))
    };
    Ok(vec![
        format!("palpate, {:.0} Hz", 1.0 / step_s),
        format!("{:.3} / {:.3} ms", 1e-3 * force("compute_us/p50")?, 1e-3 * force("compute_us/p999")?),
        format!("{:.1} / {:.1} ms", 1e-3 * worst("/answer_us/p50")?, 1e-3 * worst("/answer_us/p99")?),
        format!("{} of {}, {} by themselves", force("overruns")?, force("cycles")?, force("own_overruns")?),
        format!("{:.2} N", worst("/force_max_n")?),
    ])
}

/// The steps of the log: t, and of each device its way and its force along the shaking.
fn replayed(folder: &Path) -> Result<String, Failure> {
    let failed = |e: std::io::Error| Failure(format!("two devices, live: the log can't be replayed: {e}"));
    let program = std::env::current_exe().map_err(failed)?;
    let mut replay = Command::new(program);
    replay.args(["replay", "run.mcap", "--csv", "steps.csv"]).current_dir(folder);
    let output = replay.stdin(Stdio::null()).output().map_err(failed)?;
    if !output.status.success() {
        let said = String::from_utf8_lossy(&output.stderr);
        return Err(Failure(format!("two devices, live: the log can't be replayed: {}", said.trim())));
    }
    let file = folder.join("steps.csv");
    let text = std::fs::read_to_string(&file).map_err(|e| Failure::file("read the steps", &file, &e))?;
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let wanted = ["t", "left.x", "left.fx", "right.x", "right.fx"];
    let columns: Option<Vec<usize>> =
        wanted.iter().map(|wanted| names.iter().position(|name| name == wanted)).collect();
    let columns =
        columns.ok_or_else(|| Failure(format!("two devices, live: {} has no {wanted:?}", file.display())))?;
    let mut own = wanted.join(",") + "\n";
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let row: Vec<&str> = columns.iter().map(|&at| cells.get(at).copied().unwrap_or_default()).collect();
        own += &(row.join(",") + "\n");
    }
    Ok(own)
}

fn chart(steps: &str) -> Chart {
    let rows: Vec<Vec<f64>> = steps
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(|x| x.parse().unwrap_or(f64::NAN)).collect())
        .collect();
    // The devices leave a little before the end.
    let end = rows.last().map_or(0.0, |row| row[0]) - 2.0;
    let drawn = |column: usize, scale: f64, from: f64| -> Vec<(f64, f64)> {
        let shown = rows.iter().filter(|row| row[0] > end - DRAWN_S && row[0] <= end);
        shown.map(|row| (row[0], scale * (row[column] - from))).filter(|point| point.1.is_finite()).collect()
    };
    let line = |label: &str, points| Series { label: label.into(), points, style: Style::Line };
    Chart {
        title: "Two hands shake the cube at 2 Hz".into(),
        x: Axis { label: "time [s]".into(), scale: Scale::Linear },
        y: Axis { label: "force on the hand along x [N]".into(), scale: Scale::Linear },
        series: vec![
            line("left hand", drawn(2, 1.0, 0.0)),
            line("right hand", drawn(4, 1.0, 0.0)),
            Series {
                label: "way of the left hand [4 cm]".into(),
                points: drawn(1, 25.0, SIDES[0].1),
                style: Style::Dashed,
            },
        ],
        notes: Vec::new(),
    }
}
