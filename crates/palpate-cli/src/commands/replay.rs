//! `palpate replay`: a log of a run in real time, computed again and compared.

use crate::commands::run::{OutputArguments, Outputs};
use crate::failure::Failure;
use crate::progress::CountBar;
use crate::standard_streams::{FOLDER, LOG_INPUT, SEEKS, refuse, report, takes_output};
use crate::terminal::{print_json, warn_of_cut};
use clap::Args;
use palpate_scene::{LogReplay, Progress};
use serde_json::json;
use std::path::PathBuf;
use std::time::Duration;

/// Replay a log step by step, and check that all numbers are the same, bit for bit
///
/// The log carries the scene and its recordings. Forces, proxies, poses, velocities and energies of every step are compared
/// with those that were logged; the first that differs ends the replay. The same build on the same kind of machine gives
/// the same bits. Steps can be written as in `palpate run`.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate run scene.toml --realtime --log run.mcap
  palpate replay run.mcap --csv steps.csv --contacts contacts.csv --vtu frames
  palpate replay run.mcap --runs 5        # compute times without interruptions")]
pub struct Arguments {
    /// Log
    pub log: PathBuf,
    /// Number of replays: the minimum over them is reported for each step, its compute time without interruptions
    #[arg(long, default_value_t = 1, value_name = "N")]
    pub runs: usize,
    /// Outputs
    #[command(flatten)]
    pub outputs: OutputArguments,
}

/// Runs the command.
pub fn replay(arguments: &Arguments) -> Result<(), Failure> {
    if arguments.runs == 0 {
        return Err(Failure("--runs is 0, expected 1 or more".into()));
    }
    let outputs = &arguments.outputs;
    refuse(&[
        ("the log", Some(&arguments.log), LOG_INPUT),
        ("--vtu", outputs.vtu.as_deref(), FOLDER),
        ("--sound", outputs.sound.as_deref(), SEEKS),
    ])?;
    let output_is_taken = takes_output(
        &[("--csv", outputs.csv.as_deref()), ("--contacts", outputs.contacts.as_deref())],
        outputs.json,
    )?;
    let log = LogReplay::read(&arguments.log)?;
    warn_of_cut(&log);
    let scene = &log.scene;
    let mut least: Vec<Duration> = Vec::new();
    for _ in 1..arguments.runs {
        let mut at = 0;
        let mut bar = step_bar(&log);
        log.replay::<Failure>(&mut log.initial_state()?, log.steps, |_, _, took| {
            bar.advance(1);
            match least.get_mut(at) {
                Some(least) => *least = took.min(*least),
                None => least.push(took),
            }
            at += 1;
            Ok(())
        })?;
    }
    let mut state = log.initial_state()?;
    let start = log.initial_input()?;
    let mut outputs = Outputs::new(&arguments.outputs, scene, &state, &start, log.steps as usize)?;
    let mut least = least.into_iter();
    let mut bar = step_bar(&log);
    let done = log.replay::<Failure>(&mut state, log.steps, |input, state, took| {
        bar.advance(1);
        let took = least.next().map_or(took, |least| took.min(least));
        outputs.take(scene, input, state, took)
    })?;
    drop(bar);
    let summary = outputs.finish(scene, &state)?;
    if arguments.outputs.json {
        let mut json = summary.json(scene);
        let difference = done.first_difference.as_ref().map(|first| {
            json!({ "step": first.step, "quantity": first.quantity, "logged": first.logged, "computed": first.computed })
        });
        json["replayed"] = json!({ "steps": done.steps, "identical": difference.is_none(), "first_difference": difference, "cut": log.is_cut() });
        return print_json(&json);
    }
    let compared = match &done.first_difference {
        None => "every number came out again, bit for bit".to_string(),
        Some(first) => format!(
            "computed with the inputs of the log, which is of palpate {}; the first number that differs is {} in step {}: {:?}, now {:?}",
            log.version(),
            first.quantity,
            first.step,
            first.logged,
            first.computed
        ),
    };
    let text = format!("{} steps replayed: {compared}\n\n{}", done.steps, summary.text(scene));
    report(&text, output_is_taken)
}

fn step_bar(log: &LogReplay) -> CountBar {
    let mut bar = CountBar::steps();
    bar.begin("steps", log.steps);
    bar
}
