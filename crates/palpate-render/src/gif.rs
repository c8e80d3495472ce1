//! Animated GIF of PNG files.

use crate::error::RenderError;
use gif::{Encoder, Frame, Repeat};
use palpate_export::AtomicFile;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Quality of the colour quantisation: 1 is best and slowest, 30 worst and fastest.
const SPEED: i32 = 10;

/// Writes PNG files as a looping animated GIF, with an interval [s] that is rounded to 10 ms and at least 20 ms: browsers slow
/// down shorter ones.
///
/// # Errors
/// When a file cannot be read or written, or an image has more than 65535 pixels a side.
pub fn write_gif(images: &[PathBuf], interval_s: f64, path: &Path) -> Result<(), RenderError> {
    let inputs: Vec<&Path> = images.iter().map(PathBuf::as_path).collect();
    let mut file = AtomicFile::create(path, &inputs)?;
    let failed = |e: gif::EncodingError| RenderError::Image(format!("cannot write {}: {e}", path.display()));
    let Some(first) = images.first() else { return Err(RenderError::Image("there are no pictures".into())) };
    let (_, width, height) = read_png(first)?;
    let mut encoder = Encoder::new(&mut file, width, height, &[]).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let mut time = 0.0;
    for image in images {
        let (mut pixels, width, height) = read_png(image)?;
        let mut frame = Frame::from_rgba_speed(width, height, &mut pixels, SPEED);
        // Rounding errors do not add up.
        let (from, to) = (time * 100.0, (time + interval_s) * 100.0);
        frame.delay = ((to.round() - f64::round(from)) as u16).max(2);
        time += interval_s;
        encoder.write_frame(&frame).map_err(failed)?;
    }
    drop(encoder);
    file.finish()?;
    Ok(())
}

/// RGBA pixels, width and height.
fn read_png(path: &Path) -> Result<(Vec<u8>, u16, u16), RenderError> {
    let file =
        File::open(path).map_err(|e| RenderError::Image(format!("cannot read {}: {e}", path.display())))?;
    let failed = |e: png::DecodingError| RenderError::Image(format!("cannot read {}: {e}", path.display()));
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(failed)?;
    let size = reader.output_buffer_size().unwrap_or(0);
    let mut pixels = vec![0; size];
    let info = reader.next_frame(&mut pixels).map_err(failed)?;
    pixels.truncate(info.buffer_size());
    let small = |size: u32| {
        u16::try_from(size).map_err(|_| RenderError::Image(format!("{} is too large", path.display())))
    };
    Ok((pixels, small(info.width)?, small(info.height)?))
}
