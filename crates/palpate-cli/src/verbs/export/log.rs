//! A log as files: its steps are computed again, and compared with what was logged.

use super::{Arguments, tell_of};
use crate::Failure;
use crate::logged_run::LoggedRun;
use crate::outputs::{OutputFiles, Wanted, Window};
use serde_json::json;

/// Frames a second, as films have.
const FPS: f64 = 30.0;

pub(super) fn export(arguments: &Arguments) -> Result<(), Failure> {
    let window = Window {
        from_s: arguments.from.unwrap_or(0.0),
        to_s: arguments.to.unwrap_or(f64::INFINITY),
        fps: arguments.fps.unwrap_or(FPS),
    };
    let wanted = Wanted {
        csv: arguments.csv.as_deref(),
        contacts: arguments.contacts.as_deref(),
        vtu: arguments.vtu.as_deref(),
        gltf: arguments.gltf.as_deref(),
        window,
    };
    wanted.check()?;
    let run = LoggedRun::read(&arguments.source)?;
    let scene = &run.scene;
    let step_s = scene.model.parameters().step_s;
    let end_s = run.steps as f64 * step_s;
    if window.from_s > end_s {
        let log = arguments.source.display();
        return Err(Failure(format!("--from is {} s, but {log} ends at {end_s:.3} s", window.from_s)));
    }
    if window.frames(run.steps as usize, step_s) == 0 {
        return Err(Failure(format!(
            "no step of {step_s} s ends between --from {} s and --to {} s",
            window.from_s, window.to_s
        )));
    }
    let mut state = run.state_at_start()?;
    let start = run.input_at_start()?;
    let mut files = OutputFiles::new(&wanted, scene, &state, &start, run.steps as usize)?;
    let needed = window.last_step(run.steps, step_s).max(1);
    let done = run.repeat(&mut state, needed, |input, state, _| files.take(scene, input, state))?;
    let frames = files.frames();
    let written = files.finish()?;
    let facts = json!({
        "steps": run.steps,
        "repeated": { "steps": done, "identical": true },
        "step_s": step_s,
        "frames": frames,
    });
    let drawn =
        if frames > 0 { format!(", {frames} frames at {} a second", window.fps) } else { String::new() };
    let line = format!("{done} of {} steps repeated, bit for bit{drawn}", run.steps);
    tell_of(arguments, &written, facts, &line)
}
