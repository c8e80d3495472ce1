//! Image series: instants of a log, drawn by the viewer's page, as files and in the report.

use crate::Failure;
use crate::report::{gallery, image, paragraph};
use palpate_export::write_atomically as write_whole;
use palpate_render::{LogFramePlayer, find_browser, render_log};
use palpate_viewer::{CameraView, RenderRequest};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// Pixels of a picture: on the page it takes half of that.
const WIDTH: u32 = 480;
const HEIGHT: u32 = 360;

/// What draws.
pub struct Artist {
    browser: Result<PathBuf, Failure>,
}

/// Instants of a log.
pub struct Series<'a> {
    /// The log.
    pub log: &'a Path,
    /// Where the pictures go.
    pub folder: &'a Path,
    /// What they are seen from.
    pub camera: CameraView,
    /// Steps since the start, from first to last, and what is to be seen.
    pub instants: &'a [(u64, String)],
    /// Below them all.
    pub caption: &'a str,
}

impl Artist {
    /// The browser that was named, or the first known one; without one nothing is drawn. One that was named must be there.
    pub fn new(named: Option<&Path>) -> Result<Self, Failure> {
        let browser = find_browser(named).map_err(Failure::from);
        if named.is_some() {
            browser.clone()?;
        }
        Ok(Self { browser })
    }

    /// The pictures as html, or why there are none.
    pub fn series(&self, series: &Series) -> String {
        let drawn = self.browser.clone().and_then(|browser| pictures(series, &browser));
        match drawn {
            Ok(pictures) => {
                let drawn = pictures.iter().zip(series.instants);
                let drawn: Vec<String> = drawn.map(|(png, (_, caption))| image(png, caption)).collect();
                gallery(&drawn, "", series.caption)
            }
            Err(why) => {
                let log = series.log.file_name().unwrap_or_default().to_string_lossy();
                crate::terminal::notify(&format!("warning: no pictures of {log}: {why}"));
                paragraph(&format!(
                    "Here a series of {} pictures is missing: {why}. The log is there, and shows the same: palpate serve {log}",
                    series.instants.len()
                ))
            }
        }
    }
}

fn pictures(series: &Series, browser: &Path) -> Result<Vec<Vec<u8>>, Failure> {
    let folder = series.folder;
    std::fs::create_dir_all(folder).map_err(|e| Failure::file("make the folder", folder, &e))?;
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
    // An interrupt ends the whole, as it does beside this.
    let progress = &mut palpate_scene::Silent;
    render_log(log, wish, browser, &AtomicBool::new(false), progress, &mut |number, png| {
        write_whole(&folder.join(format!("picture_{}.png", number + 1)), &png)?;
        pictures.push(png);
        Ok(())
    })?;
    Ok(pictures)
}
