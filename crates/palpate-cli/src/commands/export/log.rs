//! Export of a log: its steps are computed again, and compared with the log.

use super::{Arguments, print_written};
use crate::failure::Failure;
use crate::progress::CountBar;
use crate::terminal::{notify, warn_of_cut};
use palpate_export::{ExportOptions, SceneExporter, TimeWindow};
use palpate_scene::{LogReplay, Progress};
use serde_json::json;

/// Default frame rate [Hz], that of films.
const FPS: f64 = 30.0;

pub(super) fn export(arguments: &Arguments) -> Result<(), Failure> {
    let window = TimeWindow {
        from_s: arguments.from.unwrap_or(0.0),
        to_s: arguments.to.unwrap_or(f64::INFINITY),
        fps: arguments.fps.unwrap_or(FPS),
    };
    let options = ExportOptions {
        csv: arguments.csv.as_deref(),
        contacts: arguments.contacts.as_deref(),
        vtu: arguments.vtu.as_deref(),
        gltf: arguments.gltf.as_deref(),
        window,
        ..ExportOptions::default()
    };
    options.check()?;
    let log = LogReplay::read(&arguments.source)?;
    warn_of_cut(&log);
    let scene = &log.scene;
    let step_s = scene.model.parameters().step_s;
    let end_s = log.steps as f64 * step_s;
    if window.from_s > end_s {
        let source = arguments.source.display();
        return Err(Failure(format!("--from is {} s, but {source} ends at {end_s:.3} s", window.from_s)));
    }
    if window.frames(log.steps as usize, step_s) == 0 {
        return Err(Failure(format!(
            "no step of {step_s} s ends between --from {} s and --to {} s",
            window.from_s, window.to_s
        )));
    }
    let mut state = log.initial_state()?;
    let start = log.initial_input()?;
    let (model, labels) = (&scene.model, scene.labels());
    let mut files = SceneExporter::new(&options, model, labels, &state, &start, log.steps as usize)?;
    if let Some(warning) = files.warning() {
        notify(&format!("warning: {warning}; --fps, --from and --to make it less"));
    }
    let needed = window.last_step(log.steps, step_s).max(1);
    let mut bar = CountBar::steps();
    bar.begin("steps", needed.min(log.steps));
    let done = log.replay::<Failure>(&mut state, needed, |input, state, _| {
        bar.advance(1);
        Ok(files.write(model, input, state)?)
    })?;
    drop(bar);
    let frames = files.frames();
    let written = files.finish()?;
    let facts = json!({
        "steps": log.steps,
        "repeated": { "steps": done.steps, "identical": done.first_difference.is_none() },
        "cut": log.is_cut(),
        "step_s": step_s,
        "frames": frames,
    });
    let drawn =
        if frames > 0 { format!(", {frames} frames at {} a second", window.fps) } else { String::new() };
    let compared = match &done.first_difference {
        None => "bit for bit".to_string(),
        Some(first) => {
            format!("with other digits from step {} on: the log is of palpate {}", first.step, log.version())
        }
    };
    let line = format!("{} of {} steps repeated, {compared}{drawn}", done.steps, log.steps);
    print_written(arguments, &written, facts, &line)
}
