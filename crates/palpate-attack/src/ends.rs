//! Attacks on what is left behind: kills, hang-ups, a full disk, two runs at once.

use crate::attack::{Attack, Verdict, require};
use crate::child::{Running, wait_until};
use crate::workplace::{Workplace, json};
use std::time::Duration;

/// The attacks.
pub const ATTACKS: &[Attack] = &[
    Attack { group: "ends", name: "kill -9 of a run with a log", run: killed_run },
    Attack { group: "ends", name: "kill -9 of a served scene with a log", run: killed_serve },
    Attack { group: "ends", name: "INT, TERM and HUP during a run with a log", run: signalled_run },
    Attack { group: "ends", name: "INT, TERM and HUP while recording", run: signalled_record },
    Attack { group: "ends", name: "a full disk under a log", run: full_disk },
    Attack { group: "ends", name: "two runs with one log", run: two_runs },
];

/// Steps that a killed log may lack: a second, and what the shortest of kills takes.
const LOST_STEPS: u64 = 1500;

/// Waits until a log has grown beyond some bytes under any name.
fn wait_for_log(workplace: &Workplace, run: &mut Running) -> Result<(), String> {
    let size = || {
        let names = workplace.files_with("run.mcap");
        names
            .iter()
            .filter_map(|name| std::fs::metadata(workplace.path(name)).ok())
            .map(|file| file.len())
            .max()
    };
    let grown = wait_until(Duration::from_secs(20), || size() > Some(100_000) || !run.is_alive());
    // A log begins with its scene, and steps follow.
    std::thread::sleep(Duration::from_secs(1));
    require(grown && run.is_alive(), || format!("no log has grown: {}", run.printed()))
}

/// Steps that can be replayed of what a killed process has left.
fn readable(workplace: &Workplace) -> Result<(u64, String), String> {
    let names = workplace.files_with("run");
    let left = names.iter().find(|name| name.contains(".mcap")).ok_or("nothing is left")?.clone();
    require(!left.starts_with('.'), || format!("what is left is hidden: {left}"))?;
    let ended = workplace.run(&format!("replay {left} --json"))?;
    let steps = json(&ended.output)?["replayed"]["steps"].as_u64().unwrap_or(0);
    workplace.succeed(&format!("recover {left} -o whole.mcap"))?;
    let whole = json(&workplace.succeed("replay whole.mcap --json")?)?["replayed"]["steps"].as_u64();
    require(whole == Some(steps), || {
        format!("{steps} steps were readable, the recovered log has {whole:?}")
    })?;
    let told = ended.printed.lines().find(|line| line.contains("recover")).unwrap_or("not told").to_string();
    Ok((steps, told))
}

fn killed_run(workplace: &Workplace) -> Verdict {
    let mut run = workplace.start("run fingers.toml --realtime --duration 60 --log run.mcap")?;
    wait_for_log(workplace, &mut run)?;
    std::thread::sleep(Duration::from_secs(3));
    run.signal("KILL");
    let _ = run.end();
    let (steps, told) = readable(workplace)?;
    require(steps + LOST_STEPS > 4000, || format!("{steps} steps are left of more than 4000"))?;
    Ok(format!("{steps} steps after more than 4 s: {told}"))
}

fn killed_serve(workplace: &Workplace) -> Verdict {
    let address = workplace.free_address()?;
    let mut run =
        workplace.start(&format!("serve fingers.toml --no-browser --listen {address} --log run.mcap"))?;
    wait_for_log(workplace, &mut run)?;
    std::thread::sleep(Duration::from_secs(3));
    run.signal("KILL");
    let _ = run.end();
    let (steps, told) = readable(workplace)?;
    require(steps + LOST_STEPS > 4000, || format!("{steps} steps are left of more than 4000"))?;
    Ok(format!("{steps} steps after more than 4 s: {told}"))
}

fn signalled_run(workplace: &Workplace) -> Verdict {
    let mut said = Vec::new();
    for signal in ["INT", "TERM", "HUP"] {
        let log = format!("{signal}-run.mcap");
        let mut run =
            workplace.start(&format!("run fingers.toml --realtime --duration 60 --json --log {log}"))?;
        wait_for_log(workplace, &mut run)?;
        run.signal(signal);
        let ended = run.end_within(Duration::from_secs(10))?;
        require(ended.code == Some(0), || format!("{signal}: {:?} {}", ended.code, ended.printed))?;
        let steps = json(&ended.output)?["log"]["steps"].as_u64().unwrap_or(0);
        let replayed =
            json(&workplace.succeed(&format!("replay {log} --json"))?)?["replayed"]["steps"].as_u64();
        require(Some(steps) == replayed, || {
            format!("{signal}: {steps} steps logged, {replayed:?} replayed")
        })?;
        std::fs::remove_file(workplace.path(&log)).map_err(|error| error.to_string())?;
        said.push(format!("{signal} {steps} steps"));
    }
    Ok(format!("logs whole: {}", said.join(", ")))
}

fn signalled_record(workplace: &Workplace) -> Verdict {
    for signal in ["INT", "TERM", "HUP"] {
        let material = "--young 2000 --poisson 0.3 --density 110 --order 2";
        let record =
            workplace.start(&format!("record box:0.1x0.1x0.1/14x14x14 {material} -o {signal}-body.palp"))?;
        std::thread::sleep(Duration::from_millis(1500));
        record.signal(signal);
        let ended = record.end_within(Duration::from_secs(10))?;
        require(ended.code != Some(0), || format!("{signal}: it was done before: {}", ended.printed))?;
        let left = workplace.files_with(&format!("{signal}-body"));
        require(left.is_empty(), || format!("{signal}: it left {left:?}"))?;
    }
    Ok("nothing left behind".into())
}

fn full_disk(workplace: &Workplace) -> Verdict {
    // A limit on the size of a file acts as a full disk does: writes fail from there on.
    let limit = "trap '' XFSZ; ulimit -f 4000";
    let arguments = "run fingers.toml --realtime --duration 6 --json --log run.mcap";
    let run = Running::start(&mut workplace.palpate_after(limit, arguments))?;
    let mut run = run;
    let told = wait_until(Duration::from_secs(20), || run.printed().contains("run.mcap") || !run.is_alive());
    let while_running = told && run.is_alive();
    let ended = run.end()?;
    require(while_running, || format!("it was told at the end only: {}", ended.printed))?;
    let report = json(&ended.output)?;
    require(report["steps"] == 6000, || format!("the run did not go on: {report}"))?;
    require(ended.code == Some(1), || format!("the status is {:?}", ended.code))?;
    let (steps, _) = readable(workplace)?;
    require(steps > 0, || "no step is left".into())?;
    Ok(format!("told while it ran; 6000 steps with their report; {steps} steps of the log are left"))
}

fn two_runs(workplace: &Workplace) -> Verdict {
    let mut first = workplace.start("run fingers.toml --realtime --duration 4 --log run.mcap")?;
    wait_for_log(workplace, &mut first)?;
    let second = workplace.run("run fingers.toml --realtime --duration 1 --log run.mcap")?;
    let ended = first.end()?;
    require(ended.code == Some(0), || format!("the first one was disturbed: {}", ended.printed))?;
    let steps = json(&workplace.succeed("replay run.mcap --json")?)?["replayed"]["steps"].as_u64();
    let last = second.printed.lines().rfind(|line| !line.is_empty()).unwrap_or_default().to_string();
    match second.code {
        Some(1) => require(steps == Some(4000), || format!("{steps:?} steps are left of 4000"))?,
        _ => require(steps == Some(1000) || steps == Some(4000), || format!("mixed: {steps:?} steps"))?,
    }
    Ok(format!("the second one ended with {:?} ({last}); run.mcap has {steps:?} steps", second.code))
}
