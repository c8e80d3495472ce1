//! Figures 4 and 5(b), live: two devices in processes of their own hold the cube's sides over links and shake it at 2 Hz, free of gravity; on R[s]
//! and in modal form.

use super::forms::{Form, held_nodes, paper_cycle, record_table};
use super::shake_figure;
use crate::chapter::Chapter;
use crate::error::ReproduceError;
use crate::findings::Finding;
use crate::image_series::ImageRenderer;
use crate::log_steps::{cycle_times_us, logged_steps, longest_again_us};
use crate::options::Options;
use crate::page::{Section, code, figure, paragraph, table};
use crate::processes::{number, report, start};
use crate::progress::StageProgress;
use crate::statements::Statement;
use crate::system_drawing::{System, drawing};
use crate::verdict::quantity;
use glam::DVec3;
use palpate_export::write_atomically;
use palpate_fem::RecordedBody;
use serde_json::Value;
use std::f64::consts::TAU;
use std::fmt::Write;
use std::net::{SocketAddr, UdpSocket};
use std::path::{Path, PathBuf};

/// Frequency of the shaking [Hz], and its way to each side [m].
pub const SHAKES_HZ: f64 = 2.0;
pub const SWAY_M: f64 = 0.05;
/// The devices come before they shake; the shaking grows, goes on, and stops on the right; the hands then stay, and leave [s].
const SETTLING_S: f64 = 0.5;
const GROWING_S: f64 = 1.5;
const STOP_S: f64 = SETTLING_S + 4.625;
const LEAVING_S: f64 = 8.0;
const SECONDS: f64 = 9.0;
pub const SIDES: [(&str, f64); 2] = [("left", -0.05), ("right", 0.05)];

/// The runs: form of the response and step [s]. The figure is of the first one, at the paper's rate.
const RUNS: [(Form, f64); 3] = [(Form::Modal, 2e-3), (Form::Table, 2e-3), (Form::Modal, 1e-3)];

/// Computers of the runs, where the paper has two, and the paper's time of a force [ms].
const COMPUTERS: f64 = 1.0;
const PAPER_FORCE_MS: f64 = 0.5;

/// Damping of the cube as `palpate record` takes it: that of `paper_cube::DAMPING`.
const DAMPING: &str = "2,2e-4";

/// The log of the run that the figure shows.
pub const LOG_NAME: &str = "figure5b.mcap";

/// A run: the report of the force process, those of the devices, times from deadlines to the ends of cycles [µs], sorted, and the longest step
/// when they are computed again [µs].
struct Ran {
    form: Form,
    step_s: f64,
    scene: Value,
    devices: Vec<Value>,
    log: PathBuf,
    cycles_us: Vec<f64>,
    longest_again_us: f64,
}

impl Ran {
    fn force(&self, key: &str) -> Result<f64, ReproduceError> {
        number(&self.scene, &format!("/force_process/{key}"))
    }

    fn deformation(&self, key: &str) -> Result<f64, ReproduceError> {
        number(&self.scene, &format!("/deformation_process/{key}"))
    }

    fn name(&self) -> String {
        format!("{}, {:.0} Hz", self.form.name(), 1.0 / self.step_s)
    }

    /// Largest of a number of the devices' reports.
    fn worst(&self, key: &str) -> Result<f64, ReproduceError> {
        self.devices.iter().map(|device| number(device, key)).try_fold(0.0, |most, own| Ok(own?.max(most)))
    }

    /// Time from the deadline to the end of a cycle [ms] that a share of the cycles stays within.
    fn cycle_ms(&self, share: f64) -> f64 {
        let at = (share * self.cycles_us.len() as f64).ceil() as usize;
        1e-3 * self.cycles_us.get(at.max(1) - 1).copied().unwrap_or(f64::NAN)
    }

    fn row(&self) -> Result<Vec<String>, ReproduceError> {
        let ms = |key: &str| Ok::<f64, ReproduceError>(1e-3 * self.force(&format!("compute_us/{key}"))?);
        Ok(vec![
            self.name(),
            format!("{:.3} / {:.3} / {:.3} ms", ms("p50")?, ms("p999")?, ms("max")?),
            format!("{:.2} ms", self.cycle_ms(0.999)),
            format!("{} of {}", self.force("overruns")?, self.force("cycles")?),
            format!("{:.3} ms", 1e-3 * self.longest_again_us),
            format!(
                "{:.1} ms, {:.0} a second",
                1e-3 * self.deformation("compute_us/p50")?,
                self.deformation("cycles")? / SECONDS
            ),
            format!(
                "{:.1} / {:.1} ms",
                1e-3 * self.worst("/answer_us/p50")?,
                1e-3 * self.worst("/answer_us/p99")?
            ),
        ])
    }
}

/// The runs, and the figure from the log of the first.
pub fn chapter(
    options: &Options,
    body: &RecordedBody,
    renderer: &ImageRenderer,
    progress: &mut dyn StageProgress,
) -> Result<Chapter, ReproduceError> {
    progress.begin("two devices, live", RUNS.len() as u64 + 1);
    let folder = options.scenes();
    for (name, side) in SIDES {
        write_atomically(&folder.join(format!("{name}.csv")), path(side).as_bytes())?;
    }
    let nodes = held_nodes(body, &SIDES.map(|(_, side)| DVec3::X * side));
    let record = record_table(options, (options.effort.cells, "cube"), DAMPING, &nodes)?;
    let mut runs = Vec::new();
    for (at, (form, step_s)) in RUNS.into_iter().enumerate() {
        progress.advance(at as u64 + 1);
        write_atomically(&folder.join(scene_name(form, step_s)), scene(form, step_s).as_bytes())?;
        runs.push(run(options, form, step_s)?);
    }
    progress.finish();
    let log = options.output.join(LOG_NAME);
    let steps = logged_steps(&log)?;
    let computed = shake_figure::on_table(&log, body, &nodes)?;
    // A table is not in its log, so its steps are computed again from the motions of the first run.
    for ran in &mut runs {
        ran.longest_again_us = match ran.form {
            Form::Table => computed.longest_us,
            Form::Modal => longest_again_us(&logged_steps(&ran.log)?),
        };
    }
    let ([modal, on_table], _) = runs.split_at(2) else {
        return Err(ReproduceError::Measurement("two devices, live: a run is missing".into()));
    };
    let figure5b = shake_figure::figure(options, body, (&steps, &computed), renderer, progress)?;
    let link = format!("{:.1} ms", 1e-3 * modal.worst("/answer_us/p50")?);
    let system = System {
        link,
        force: format!("a force: {:.0} µs", on_table.force("compute_us/p50")?),
        deformation: format!("{:.0} ms each", 1e-3 * on_table.deformation("compute_us/p50")?),
    };
    let mut html = figure(
        &drawing(&system),
        "The paper's figure 4, the experimental system, as it is here: three processes on one machine (dashed: one process) joined by QUIC datagrams where the paper has two computers, two PHANToM devices and \
         TCP/IP. The times are medians of the run on R[s]; that of the links is from telling a motion to receiving a force that answers it.",
    );
    html += &paragraph(&format!(
        "The left and the right side of the cube are held by two devices, each in a process of its own, which shake it from side to side at {SHAKES_HZ} Hz \
         by ±{:.0} mm without gravity. Hands don't jump: the shaking grows over {GROWING_S} s, goes on, and stops on the right, where the hands stay until they \
         leave. The deformation process runs beside the force process in every run. R[s] has the paper's 500 samples of 2 ms.",
        1e3 * SWAY_M,
    ));
    let mut rows = vec![paper_cycle(7)];
    rows.extend(runs.iter().map(Ran::row).collect::<Result<Vec<_>, _>>()?);
    let head = [
        "",
        "force: median / 99.9 % / most",
        "cycle, 99.9 %",
        "late cycles",
        "longest step again",
        "deformation",
        "motion to force: median / 99 %",
    ];
    html += &table(
        "The force process with two devices over links. Force: from the begin of a cycle to its forces. Cycle: from its deadline to its end, waiting for the core included. \
         Late: ended after the next deadline. Longest step again: the longest of all steps of the run, each by the least of four times when it is computed again from the log; what takes longer in a run is the machine's doing",
        &head,
        &rows,
    );
    html += &figure5b.html;
    html += &code(&format!(
        "palpate {}\npalpate run scenes/{} --realtime --duration {SECONDS} --log {LOG_NAME}\npalpate device left --path scenes/left.csv\n\
         palpate device right --path scenes/right.csv\npalpate serve {LOG_NAME}",
        record.join(" "),
        scene_name(RUNS[0].0, RUNS[0].1)
    ));
    let forces = |ran: &Ran| -> Result<String, ReproduceError> {
        let ms = |key: &str| Ok::<f64, ReproduceError>(1e-3 * ran.force(&format!("compute_us/{key}"))?);
        Ok(format!(
            "{}: {:.3} ms median, {:.3} ms in 99.9 %, {:.3} ms at most",
            ran.name(),
            ms("p50")?,
            ms("p999")?,
            ms("max")?
        ))
    };
    let cycles = |ran: &Ran| -> Result<String, ReproduceError> {
        Ok(format!(
            "{}: 99.9 % within {:.2} ms, {} of {} late, where the longest step, computed again, takes {:.3} ms",
            ran.name(),
            ran.cycle_ms(0.999),
            ran.force("overruns")?,
            ran.force("cycles")?,
            1e-3 * ran.longest_again_us
        ))
    };
    let deformations = |ran: &Ran| -> Result<String, ReproduceError> {
        Ok(format!(
            "{}: {:.1} ms each, {:.0} a second",
            ran.name(),
            1e-3 * ran.deformation("compute_us/p50")?,
            ran.deformation("cycles")? / SECONDS
        ))
    };
    let both = |of: &dyn Fn(&Ran) -> Result<String, ReproduceError>| -> Result<String, ReproduceError> {
        Ok(format!("{}; {}", of(on_table)?, of(modal)?))
    };
    let findings = vec![
        Finding::measured(Statement::FreeToMove, figure5b.momentum.0, figure5b.momentum.1),
        Finding::measured(
            Statement::Figure4,
            quantity("computers", COMPUTERS, "").at_least(2.0),
            format!(
                "drawn; one machine, three processes; motion to force {:.1} ms (median)",
                1e-3 * modal.worst("/answer_us/p50")?
            ),
        ),
        Finding::measured(
            Statement::SeparateDeformation,
            quantity("deformations on R[s]", on_table.deformation("cycles")?, "").at_least(1.0),
            both(&deformations)?,
        ),
        Finding::measured(Statement::Figure5b, figure5b.found.0, figure5b.found.1),
        Finding::measured(
            Statement::ForceTime,
            quantity("longest step again, R[s]", 1e-3 * on_table.longest_again_us, "ms")
                .at_most(PAPER_FORCE_MS),
            format!("{}; on one thread", both(&forces)?),
        ),
        Finding::measured(
            Statement::CycleTime,
            quantity("late cycles, R[s]", on_table.force("overruns")?, "").at_most(0.0),
            both(&cycles)?,
        ),
    ];
    let section = Section {
        id: "shake".into(),
        heading: "Two devices, live (the paper's figures 4 and 5(b), section 3.3)".into(),
        body: html,
    };
    Ok(Chapter { section, data: figure5b.data, findings })
}

fn scene_name(form: Form, step_s: f64) -> String {
    format!("shake-{}-{:.0}-hz.toml", form.word(), 1.0 / step_s)
}

/// Displacement of the hands to the right [m] at a time of their path [s].
fn sway(t: f64) -> f64 {
    let shaken = (t.min(STOP_S) - SETTLING_S).max(0.0);
    // Half a cosine, which begins and ends without a jump of the speed.
    let size = 0.5 - 0.5 * (TAU / 2.0 * (shaken / GROWING_S).min(1.0)).cos();
    SWAY_M * size * (TAU * SHAKES_HZ * shaken).sin()
}

/// Path of a device as CSV: t,x,y,z.
fn path(side: f64) -> String {
    let mut text = "t,x,y,z\n".to_string();
    for tick in 0..=((SECONDS * 1e3) as u32) {
        let t = 1e-3 * f64::from(tick);
        let _ = writeln!(text, "{t:.3},{:.7},0,0", side + sway(t));
    }
    text
}

fn scene(form: Form, step_s: f64) -> String {
    let mut text = format!("step = {step_s}\n{}", form.object("cube"));
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
fn run(options: &Options, form: Form, step_s: f64) -> Result<Ran, ReproduceError> {
    let (program, folder): (&Path, _) = (&options.program, options.scenes());
    let failed =
        |e: std::io::Error| ReproduceError::Process(format!("two devices, live: no port is free: {e}"));
    let address = free_port().map_err(failed)?.to_string();
    let name = scene_name(form, step_s);
    let log_name =
        if (form, step_s) == RUNS[0] { LOG_NAME.to_owned() } else { name.replace(".toml", ".mcap") };
    let (duration, log_from_there) = (SECONDS.to_string(), format!("../{log_name}"));
    let scene_arguments =
        ["run", &name, "--realtime", "--duration", &duration, "--listen", &address, "--log", &log_from_there];
    let files = SIDES.map(|(name, _)| (name, format!("{name}.csv")));
    let mut children = vec![start(program, &folder, &scene_arguments)?];
    // They leave a second before the scene does.
    let short = LEAVING_S.to_string();
    for (name, file) in &files {
        let arguments =
            ["device", name, "--path", file, "--connect", &address, "--duration", &short, "--wait", "10"];
        match start(program, &folder, &arguments) {
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
    let log = options.output.join(&log_name);
    let mut cycles_us = cycle_times_us(&log)?;
    cycles_us.sort_by(f64::total_cmp);
    Ok(Ran {
        form,
        step_s,
        scene: reports.remove(0),
        devices: reports,
        log,
        cycles_us,
        longest_again_us: f64::NAN,
    })
}

/// A port of this machine that nobody listens on.
fn free_port() -> std::io::Result<SocketAddr> {
    UdpSocket::bind("127.0.0.1:0")?.local_addr()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_shaking_grows_smoothly_stops_on_the_right_and_the_hands_stay() {
        assert_eq!((sway(0.0), sway(SETTLING_S)), (0.0, 0.0));
        assert!((sway(STOP_S) - SWAY_M).abs() < 1e-12, "{}", sway(STOP_S));
        assert_eq!(sway(STOP_S), sway(LEAVING_S));
        let fastest = (0..9000)
            .map(|k| (sway(1e-3 * f64::from(k + 1)) - sway(1e-3 * f64::from(k))).abs())
            .fold(0.0, f64::max);
        assert!(fastest < 1.1e-3 * SWAY_M * TAU * SHAKES_HZ, "{fastest} m in a millisecond");
    }
}
