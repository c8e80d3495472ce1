//! Image series: instants of a log, drawn by the viewer's page in a browser, as files and in the report.

use crate::error::ReproduceError;
use crate::page::{gallery, image, paragraph};
use crate::progress::StageProgress;
use palpate_export::write_atomically;
use palpate_render::{LogFramePlayer, find_browser, render_log};
use palpate_viewer::{CameraView, RenderRequest};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Pixels of a picture: on the page it takes half of that.
const WIDTH: u32 = 480;
const HEIGHT: u32 = 360;

/// Draws images with a browser, if there is one.
pub struct ImageRenderer {
    /// The browser, or the reason why there is none.
    browser: Result<PathBuf, String>,
}

/// Instants of a log.
pub struct ImageSeries<'a> {
    /// The log.
    pub log: &'a Path,
    /// Folder of the images.
    pub folder: &'a Path,
    /// Camera of all images.
    pub camera: CameraView,
    /// Steps since the start, in rising order, and the caption of each.
    pub instants: &'a [(u64, String)],
    /// Caption of the series.
    pub caption: &'a str,
}

impl ImageRenderer {
    /// Draws with the browser that is named, or the first known one; without one nothing is drawn.
    ///
    /// # Errors
    /// If the named browser can't be started.
    pub fn new(named: Option<&Path>) -> Result<Self, ReproduceError> {
        match find_browser(named) {
            Err(error) if named.is_some() => Err(error.into()),
            browser => Ok(Self { browser: browser.map_err(|error| error.to_string()) }),
        }
    }

    /// The images as html, or the reason why there are none.
    pub fn images(&self, series: &ImageSeries, progress: &mut dyn StageProgress) -> String {
        let browser = self.browser.clone();
        let drawn = browser.and_then(|browser| draw(series, &browser).map_err(|error| error.to_string()));
        match drawn {
            Ok(pictures) => {
                let drawn = pictures.iter().zip(series.instants);
                let drawn: Vec<String> = drawn.map(|(png, (_, caption))| image(png, caption)).collect();
                gallery(&drawn, "", series.caption)
            }
            Err(why) => {
                let log = series.log.file_name().unwrap_or_default().to_string_lossy();
                progress.warn(&format!("no pictures of {log}: {why}"));
                paragraph(&format!(
                    "Here a series of {} pictures is missing: {why}. The log is there, and shows the same: palpate serve {log}",
                    series.instants.len()
                ))
            }
        }
    }
}

/// Draws and writes the images of a series; gives them as PNG.
fn draw(series: &ImageSeries, browser: &Path) -> Result<Vec<Vec<u8>>, ReproduceError> {
    let folder = series.folder;
    std::fs::create_dir_all(folder).map_err(|e| ReproduceError::folder(folder, e))?;
    let mut steps: Vec<u64> = series.instants.iter().map(|(step, _)| *step).collect();
    steps.dedup();
    let frame = |(step, _): &(u64, String)| steps.iter().position(|known| known == step).map(|at| at as u64);
    let wish = RenderRequest {
        frames: series.instants.iter().filter_map(frame).collect(),
        width: WIDTH,
        height: HEIGHT,
        camera: Some(series.camera),
        colour: "displacement".into(),
        dark: false,
    };
    let log = LogFramePlayer::read_at(series.log, steps)?;
    let mut pictures = Vec::new();
    // An interrupt ends the process.
    let progress = &mut palpate_scene::SilentProgress;
    render_log(log, wish, browser, &AtomicBool::new(false), progress, &mut |number, png| {
        write_atomically(&folder.join(format!("picture_{}.png", number + 1)), &png)?;
        pictures.push(png);
        Ok(())
    })?;
    Ok(pictures)
}
