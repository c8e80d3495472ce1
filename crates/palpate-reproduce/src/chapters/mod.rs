//! The chapters, one per part of the paper.

mod agreement;
mod arrival;
mod cost;
mod explicit_cube;
mod fall;
mod fall_story;
mod forms;
mod impulses;
mod motion;
mod passivity;
mod resonance;
mod rigid_plane;
mod shake;
mod shake_figure;
mod table1;
mod wave;

use crate::bodies::cube;
use crate::chapter::Chapter;
use crate::error::ReproduceError;
use crate::image_series::ImageRenderer;
use crate::machine::Machine;
use crate::options::{Options, Part};
use crate::progress::StageProgress;
use palpate_export::write_atomically;
use palpate_fem::RecordedBody;
use palpate_scene::WithoutRemarks;

/// Modes of the recorded cube.
const MODES: usize = 200;

/// The chapters that are asked for, in the order of the paper.
pub fn chapters(
    options: &Options,
    machine: &Machine,
    progress: &mut dyn StageProgress,
) -> Result<Vec<Chapter>, ReproduceError> {
    let (effort, parts) = (options.effort, &options.parts);
    let body = cube(effort.cells, MODES, &mut WithoutRemarks(progress))?;
    let renderer = if parts.contains(&Part::Fall) || parts.contains(&Part::Shake) {
        write_recording(options, &body)?;
        Some(ImageRenderer::new(options.browser.as_deref())?)
    } else {
        None
    };
    let chapter = |part: &Part| match (part, &renderer) {
        (Part::Recording, _) => Some(table1::chapter(&body, effort, machine, progress)),
        (Part::Impulses, _) => Some(impulses::chapter(effort.cells, &body, progress)),
        (Part::Passivity, _) => Some(passivity::chapter(&body, progress)),
        (Part::Agreement, _) => Some(agreement::chapter(progress)),
        (Part::Motion, _) => Some(motion::chapter(&body, progress)),
        (Part::Cost, _) => Some(cost::chapter(effort, progress)),
        (Part::Fall, Some(renderer)) => Some(fall::chapter(options, renderer, progress)),
        (Part::Shake, Some(renderer)) => Some(shake::chapter(options, &body, renderer, progress)),
        (Part::Fall | Part::Shake, None) => None,
    };
    Part::ALL.iter().filter(|part| parts.contains(part)).filter_map(chapter).collect()
}

/// Writes the recording into the folder of the scenes.
fn write_recording(options: &Options, body: &RecordedBody) -> Result<(), ReproduceError> {
    let folder = options.scenes();
    std::fs::create_dir_all(&folder).map_err(|e| ReproduceError::folder(&folder, e))?;
    Ok(write_atomically(&folder.join("cube.palp"), &body.recording.to_bytes()?)?)
}
