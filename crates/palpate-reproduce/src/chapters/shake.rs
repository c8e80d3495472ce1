//! Figure 5(b), live: two devices in processes of their own hold the cube's sides over links and shake it at 2 Hz, free of gravity.

use super::shake_figure;
use crate::chapter::Chapter;
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::image_series::ImageRenderer;
use crate::options::Options;
use crate::page::{Section, code, paragraph, table};
use crate::processes::{number, report, start};
use crate::progress::StageProgress;
use palpate_export::write_atomically;
use serde_json::Value;
use std::fmt::Write;
use std::net::{SocketAddr, UdpSocket};
use std::path::Path;

/// Frequency of the shaking [Hz].
pub const SHAKES_HZ: f64 = 2.0;
const SWAY_M: f64 = 0.02;
/// The devices come before they shake, and shake until the end.
const SETTLING_S: f64 = 1.0;
const SECONDS: f64 = 10.0;
pub const SIDES: [(&str, f64); 2] = [("left", -0.05), ("right", 0.05)];

/// Steps of the runs [s]: the paper's and half of it.
const STEPS_S: [f64; 2] = [2e-3, 1e-3];

/// The log of the run at the faster rate.
pub const LOG_NAME: &str = "figure5b.mcap";

/// A run: the report of the force process, those of the devices.
struct Ran {
    scene: Value,
    devices: Vec<Value>,
}

/// Runs at both rates, and the figure from the log of the faster one.
pub fn chapter(
    options: &Options,
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    progress.begin("two devices, live", STEPS_S.len() as u64);
    let folder = options.scenes();
    for (name, side) in SIDES {
        write_atomically(&folder.join(format!("{name}.csv")), path(side).as_bytes())?;
    }
    let mut rows = vec![vec![
        "the paper, 500 Hz".into(),
        "0.5 ms at most".into(),
        "not told".into(),
        "every cycle within 2 ms".into(),
        "not told".into(),
    ]];
    let mut findings = Vec::new();
    for (at, step_s) in STEPS_S.into_iter().enumerate() {
        write_atomically(&folder.join(scene_name(step_s)), scene(step_s).as_bytes())?;
        let ran = run(&options.program, &folder, step_s)?;
        rows.push(row(step_s, &ran)?);
        findings.extend(found(step_s, &ran)?);
        progress.advance(at as u64 + 1);
    }
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
    let figure = shake_figure::figure(options, renderer, progress)?;
    html += &figure.html;
    html += &code(&format!(
        "palpate run scenes/{} --realtime --duration {SECONDS} --log {LOG_NAME}\npalpate device left --path scenes/left.csv\n\
         palpate device right --path scenes/right.csv\npalpate serve {LOG_NAME}",
        scene_name(STEPS_S[1])
    ));
    findings.push(finding(
        "two hands hold the cube and shake it at 2 Hz",
        "figure 5(b)",
        "pictures, no numbers",
        figure.found,
    ));
    let section =
        Section { id: "shake".into(), heading: "Figure 5(b): two devices, live".into(), body: html };
    Ok(Chapter { section, data: vec![figure.data], findings })
}

fn finding(what: &str, place: &'static str, paper: &str, ours: String) -> Finding {
    Finding { what: what.into(), place, paper: paper.into(), ours, section: "shake" }
}

/// Findings on the force process.
fn found(step_s: f64, ran: &Ran) -> Result<Vec<Finding>, ReproduceError> {
    let force = |key: &str| number(&ran.scene, &format!("/force_process/{key}"));
    let hertz = 1.0 / step_s;
    let is_papers = step_s == STEPS_S[0];
    let (cost, cycle) =
        if is_papers { ("at most approximately 0.5 ms", "within every cycle of 2 ms") } else { ("", "") };
    Ok(vec![
        finding(
            &format!("computing the forces on two hands, {hertz:.0} Hz"),
            "section 3.3",
            cost,
            format!(
                "{:.3} ms median, {:.3} ms in 99.9 %",
                1e-3 * force("compute_us/p50")?,
                1e-3 * force("compute_us/p999")?
            ),
        ),
        finding(
            &format!("the whole force process, {hertz:.0} Hz"),
            "section 3.3",
            cycle,
            format!(
                "{} of {} cycles late by their own work, {} by the machine",
                force("own_overruns")?,
                force("cycles")?,
                force("overruns")? - force("own_overruns")?
            ),
        ),
    ])
}

fn scene_name(step_s: f64) -> String {
    format!("shake-{:.0}-hz.toml", 1.0 / step_s)
}

/// Path of a device as CSV: t,x,y,z.
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
fn run(program: &Path, folder: &Path, step_s: f64) -> Result<Ran, ReproduceError> {
    let failed =
        |e: std::io::Error| ReproduceError::Process(format!("two devices, live: no port is free: {e}"));
    let address = free_port().map_err(failed)?.to_string();
    let (duration, log) = (SECONDS.to_string(), format!("../{LOG_NAME}"));
    let mut scene_arguments =
        vec!["run", "--realtime", "--pictures", "0", "--duration", &duration, "--listen", &address];
    if step_s == STEPS_S[1] {
        scene_arguments.extend(["--log", &log]);
    }
    let name = scene_name(step_s);
    scene_arguments.push(&name);
    let files = SIDES.map(|(name, _)| (name, format!("{name}.csv")));
    let mut children = vec![start(program, folder, &scene_arguments)?];
    // They leave a second before the scene does.
    let short = (SECONDS - 1.0).to_string();
    for (name, file) in &files {
        let arguments =
            ["device", name, "--path", file, "--connect", &address, "--duration", &short, "--wait", "10"];
        match start(program, folder, &arguments) {
            Ok(device) => children.push(device),
            Err(failure) => {
                children.iter_mut().for_each(|child| drop(child.kill()));
                return Err(failure);
            }
        }
    }
    let reports: Result<Vec<Value>, ReproduceError> = children.into_iter().map(report).collect();
    let mut reports =
        reports.map_err(|failure| ReproduceError::Process(format!("two devices, live: {failure}")))?;
    Ok(Ran { scene: reports.remove(0), devices: reports })
}

/// A port of this machine that nobody listens on.
fn free_port() -> std::io::Result<SocketAddr> {
    UdpSocket::bind("127.0.0.1:0")?.local_addr()
}

fn row(step_s: f64, ran: &Ran) -> Result<Vec<String>, ReproduceError> {
    let force = |key: &str| number(&ran.scene, &format!("/force_process/{key}"));
    let worst = |key: &str| -> Result<f64, ReproduceError> {
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
