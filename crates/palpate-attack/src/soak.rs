//! A soak: two fingers, a log, two pages and a linked device on two cores, one of which is hogged for a third of the time.

use crate::attack::require;
use crate::child::Running;
use crate::page::Page;
use crate::workplace::{Workplace, json};
use serde_json::Value;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};

/// Growth of memory from the second tenth of the time on that is still flat [MiB].
const FLAT_MIB: f64 = 8.0;

/// Energy that no term of the ledger explains, as a share of all terms: round-off of millions of steps.
const DEFECT: f64 = 1e-9;

/// Parts of the time; in the second of three the hog runs.
const PARTS: u32 = 30;

/// Runs the soak and prints what came out.
pub fn run(palpate: &Path, minutes: f64) -> Result<(), String> {
    let workplace = Workplace::new(palpate)?;
    let seconds = minutes * 60.0;
    let address = workplace.free_address()?;
    let page_address = workplace.free_address()?;
    let run = workplace.start(&format!(
        "run linked.toml --realtime --duration {:.0} --json --listen {address} --log run.mcap",
        seconds + 5.0
    ))?;
    run.wait_for("waiting at")?;
    let device = workplace.start(&format!(
        "device left --path left.csv --simulated touch --connect {address} --duration {:.0} --json",
        seconds + 3.0
    ))?;
    device.wait_for("linked to")?;
    let serve = workplace.start(&format!(
        "serve fingers.toml --no-browser --listen {page_address} --core 0 --log served.mcap"
    ))?;
    serve.wait_for("open http")?;
    let mut pages = [Page::open(&page_address, "")?, Page::open(&page_address, "")?];
    let processes = [("run", &run), ("device", &device), ("serve", &serve)];
    let mut memory: Vec<[f64; 3]> = Vec::new();
    let mut open_files = [0; 3];
    let start = Instant::now();
    for part in 0..PARTS {
        let hog = (part % 3 == 1).then(|| hog(palpate)).transpose()?;
        let end = start + Duration::from_secs_f64(seconds * f64::from(part + 1) / f64::from(PARTS));
        while Instant::now() < end {
            for page in &mut pages {
                page.step()?;
            }
        }
        drop(hog);
        memory.push(processes.map(|(_, process)| process.memory_mib()));
        let open = processes.map(|(_, process)| process.open_files());
        require(part == 0 || open == open_files, || format!("open files: {open_files:?}, then {open:?}"))?;
        open_files = open;
        let now = memory.last().map(|mib| format!("{:.1} / {:.1} / {:.1}", mib[0], mib[1], mib[2]));
        println!("{:>3} of {PARTS}: run / device / serve {} MiB", part + 1, now.unwrap_or_default());
    }
    let settled = memory.get(PARTS as usize / 10).copied().unwrap_or_default();
    let last = memory.last().copied().unwrap_or_default();
    for (name, (before, after)) in ["run", "device", "serve"].iter().zip(settled.iter().zip(last)) {
        require(after - before < FLAT_MIB, || {
            format!("the memory of {name} grew from {before:.1} to {after:.1} MiB")
        })?;
    }
    drop(pages);
    serve.signal("INT");
    let served = serve.end()?;
    require(served.code == Some(0), || format!("serve ended with {:?}: {}", served.code, served.printed))?;
    let device = device.end()?;
    let run = run.end()?;
    require(device.code == Some(0) && run.code == Some(0), || {
        format!("device {:?}: {}\nrun {:?}: {}", device.code, device.printed, run.code, run.printed)
    })?;
    let (device, run) = (json(&device.output)?, json(&run.output)?);
    println!("device: {device:#}\nrun: {run:#}");
    for log in ["run.mcap", "served.mcap"] {
        let replayed = Running::start(&mut workplace.palpate(&format!("replay {log} --json")))?;
        let replayed = replayed.end_within(Duration::from_secs_f64(60.0 + seconds))?;
        require(replayed.code == Some(0), || format!("{log}: {}", replayed.printed))?;
        let replayed = json(&replayed.output)?;
        println!("{log}: {}, energies [J] {}", replayed["replayed"], replayed["energy_j"]);
        require(replayed["replayed"]["identical"] == true, || format!("{log} does not repeat"))?;
        let energies = replayed["energy_j"].as_object().ok_or("no energies")?;
        let size = energies.values().filter_map(Value::as_f64).fold(0.0, |sum, energy| sum + energy.abs());
        let defect = replayed["energy_j"]["defect"].as_f64().unwrap_or(f64::NAN);
        require(defect.abs() < DEFECT * size, || format!("{log}: {defect} J of {size} J come from nowhere"))?;
    }
    let steps = run["steps"].as_u64();
    require(run["log"]["steps"].as_u64() == steps, || "the log lacks steps".into())?;
    println!("soak of {minutes} minutes: memory flat, logs whole and repeated bit for bit");
    Ok(())
}

/// A process that keeps one core busy: the last one, where the force process runs.
fn hog(palpate: &Path) -> Result<Running, String> {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let mut command = Command::new("taskset");
    command.args(["-c", &(cores - 1).to_string(), "sh", "-c", "while :; do :; done"]);
    command.current_dir(palpate.parent().unwrap_or(palpate));
    Running::start(&mut command)
}
