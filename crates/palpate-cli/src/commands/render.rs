//! `palpate render`: images of a log, drawn by the viewer's page.

use crate::failure::Failure;
use crate::interrupt::stop_on_interrupt;
use crate::progress::CountBar;
use crate::standard_streams::{FOLDER, LOG_INPUT, SEEKS, refuse};
use crate::terminal::{print, print_json, warn_of_cut};
use clap::{Args, ValueEnum};
use palpate_export::{OutputFolder, write_atomically};
use palpate_render::{FrameSpacing, LogFramePlayer, find_browser, program_runs, render_log, write_gif};
use palpate_viewer::{CameraView, RenderRequest};
use serde_json::json;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Render images of a log: PNG files, and an animation
///
/// The log is replayed (as by `palpate replay`), and the page of `palpate serve` draws it in a headless browser: the same images
/// as in the viewer, and the same files every time. It needs Chromium or Chrome.
#[derive(Args, Debug, Clone)]
#[command(after_help = "For example:
  palpate render run.mcap -o frames                         # frames/frame_00000.png, …
  palpate render run.mcap -o frames --gif run.gif --fps 20 --from 1 --to 3
  palpate render run.mcap -o frames --mp4 run.mp4 --width 1920 --height 1080   # with ffmpeg
  palpate render run.mcap -o frames --camera 0.3,0.2,0.4,0,0.05,0 --colour strain --dark")]
pub struct Arguments {
    /// Log
    log: PathBuf,
    /// Folder for the images
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Frame rate [Hz]
    #[arg(long, value_name = "HZ", default_value_t = 30.0, allow_negative_numbers = true)]
    fps: f64,
    /// Start [s]
    #[arg(long, value_name = "S", default_value_t = 0.0, allow_negative_numbers = true)]
    from: f64,
    /// End [s]; by default that of the log
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    to: Option<f64>,
    /// Width [pixels]
    #[arg(long, value_name = "PIXELS", default_value_t = 1280, value_parser = clap::value_parser!(u32).range(64..=4096))]
    width: u32,
    /// Height [pixels]
    #[arg(long, value_name = "PIXELS", default_value_t = 720, value_parser = clap::value_parser!(u32).range(64..=4096))]
    height: u32,
    /// Camera position and target [m, world]: six numbers x,y,z,x,y,z
    #[arg(long, value_name = "FROM,TO", value_delimiter = ',', num_args = 1, allow_negative_numbers = true)]
    camera: Option<Vec<f64>>,
    /// Quantity that colours show
    #[arg(long, value_enum, default_value_t = Colour::Displacement)]
    colour: Colour,
    /// Dark background
    #[arg(long)]
    dark: bool,
    /// Also write an animated GIF
    #[arg(long, value_name = "OUT.gif")]
    gif: Option<PathBuf>,
    /// Also write a film; needs ffmpeg
    #[arg(long, value_name = "OUT.mp4")]
    mp4: Option<PathBuf>,
    /// Browser; by default the first of chromium, chromium-browser, google-chrome, chrome that is found
    #[arg(long, value_name = "PROGRAM")]
    browser: Option<PathBuf>,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

/// Quantity that the colours of the surface show.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Colour {
    Displacement,
    Strain,
    Plain,
}

/// Upper bound of images.
const MAX_IMAGES: u64 = 20_000;

/// Runs the command.
pub fn render(arguments: &Arguments) -> Result<(), Failure> {
    refuse(&[
        ("the log", Some(&arguments.log), LOG_INPUT),
        ("-o", Some(&arguments.output), FOLDER),
        ("--gif", arguments.gif.as_deref(), SEEKS),
        ("--mp4", arguments.mp4.as_deref(), SEEKS),
    ])?;
    let camera = arguments.camera.as_deref().map(read_camera).transpose()?;
    if !(arguments.fps > 0.0 && arguments.fps <= 1000.0) {
        return Err(Failure(format!("--fps is {}, expected above 0 and at most 1000", arguments.fps)));
    }
    let browser = find_browser(arguments.browser.as_deref())?;
    if arguments.mp4.is_some() && !program_runs("ffmpeg") {
        return Err(Failure("--mp4 needs ffmpeg, which is not found: install it, or take --gif".into()));
    }
    let output = &arguments.output;
    let _folder = OutputFolder::create(output)?;
    let log = LogFramePlayer::read(&arguments.log, 0, arguments.fps)?;
    warn_of_cut(log.log());
    let numbers = chosen(log.spacing(), arguments.from, arguments.to)?;
    let frames = log.spacing();
    let request = RenderRequest {
        frames: numbers,
        width: arguments.width,
        height: arguments.height,
        camera,
        colour: format!("{:?}", arguments.colour).to_lowercase(),
        dark: arguments.dark,
    };
    let mut drawn = Vec::with_capacity(request.frames.len());
    let mut bar = CountBar::new("{wide_bar} {pos}/{len} {msg}, {eta} left");
    render_log(log, request, &browser, stop_on_interrupt(), &mut bar, &mut |number, png| {
        let path = output.join(format!("frame_{number:05}.png"));
        write_atomically(&path, &png)?;
        drawn.push(path);
        Ok(())
    })?;
    if let Some(gif) = &arguments.gif {
        write_gif(&drawn, frames.interval_s, gif)?;
    }
    if let Some(mp4) = &arguments.mp4 {
        write_mp4(output, 1.0 / frames.interval_s, mp4)?;
    }
    let first = drawn.first().map(|path| path.display().to_string()).unwrap_or_default();
    if arguments.json {
        return print_json(&json!({
            "pictures": drawn.len(), "folder": output, "apart_s": frames.interval_s, "gif": arguments.gif, "mp4": arguments.mp4,
        }));
    }
    print(&format!("{} pictures, {:.4} s apart: {first} …\n", drawn.len(), frames.interval_s))
}

fn read_camera(numbers: &[f64]) -> Result<CameraView, Failure> {
    match numbers {
        &[a, b, c, x, y, z] if numbers.iter().all(|n| n.is_finite()) && [a, b, c] != [x, y, z] => {
            Ok(CameraView { from: [a, b, c], to: [x, y, z] })
        }
        _ => Err(Failure(format!(
            "--camera is {numbers:?}, expected six numbers: where it is x,y,z and what it looks at x,y,z"
        ))),
    }
}

/// Frames between two times.
fn chosen(frames: FrameSpacing, from: f64, to: Option<f64>) -> Result<Vec<u64>, Failure> {
    let end = (frames.count - 1) as f64 * frames.interval_s;
    let to = to.unwrap_or(end);
    if !(from >= 0.0 && from <= to && from <= end) {
        return Err(Failure(format!("--from {from} --to {to}: the log goes from 0 to {end:.3} s")));
    }
    let number = |t: f64| (t / frames.interval_s).round() as u64;
    let numbers: Vec<u64> = (number(from)..=number(to).min(frames.count - 1)).collect();
    if numbers.len() as u64 > MAX_IMAGES {
        return Err(Failure(format!(
            "these are {} pictures, at most {MAX_IMAGES} are drawn at once: take a lower --fps, or --from and --to",
            numbers.len()
        )));
    }
    Ok(numbers)
}

fn write_mp4(folder: &Path, fps: f64, path: &Path) -> Result<(), Failure> {
    let output = Command::new("ffmpeg")
        .args(["-y", "-loglevel", "error", "-framerate", &fps.to_string(), "-i"])
        .arg(folder.join("frame_%05d.png"))
        // Even sizes are all that the usual pixel format takes.
        .args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart"])
        .arg(path)
        .output()
        .map_err(|e| Failure(format!("ffmpeg can't be started: {e}")))?;
    if output.status.success() {
        return Ok(());
    }
    let said = String::from_utf8_lossy(&output.stderr);
    Err(Failure(format!("ffmpeg could not write {}: {}", path.display(), said.lines().last().unwrap_or("?"))))
}
