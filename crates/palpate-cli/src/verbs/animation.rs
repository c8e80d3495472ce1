//! Pictures one after the other, in a file that moves.

use crate::Failure;
use crate::whole_file::WholeFile;
use gif::{Encoder, Frame, Repeat};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// How well colours are chosen: 1 is best and slowest, 30 the other way.
const SPEED: i32 = 10;

/// PNG files as an animated GIF that goes round, so far apart [s]: to hundredths, as the format has it, and not below two of
/// them, which browsers would slow down.
pub fn write_gif(pictures: &[PathBuf], apart_s: f64, path: &Path) -> Result<(), Failure> {
    let inputs: Vec<&Path> = pictures.iter().map(PathBuf::as_path).collect();
    let mut file = WholeFile::create(path, &inputs)?;
    let failed = |e: gif::EncodingError| Failure(format!("cannot write {}: {e}", path.display()));
    let Some(first) = pictures.first() else { return Err(Failure("there are no pictures".into())) };
    let (_, width, height) = read_png(first)?;
    let mut encoder = Encoder::new(&mut file, width, height, &[]).map_err(failed)?;
    encoder.set_repeat(Repeat::Infinite).map_err(failed)?;
    let mut time = 0.0;
    for picture in pictures {
        let (mut pixels, width, height) = read_png(picture)?;
        let mut frame = Frame::from_rgba_speed(width, height, &mut pixels, SPEED);
        // What is rounded off now is made up for later.
        let (from, to) = (time * 100.0, (time + apart_s) * 100.0);
        frame.delay = ((to.round() - f64::round(from)) as u16).max(2);
        time += apart_s;
        encoder.write_frame(&frame).map_err(failed)?;
    }
    drop(encoder);
    file.finish().map(|_| ())
}

/// Pixels as RGBA, width and height.
fn read_png(path: &Path) -> Result<(Vec<u8>, u16, u16), Failure> {
    let file = File::open(path).map_err(|e| Failure::file("read", path, &e))?;
    let failed = |e: png::DecodingError| Failure(format!("cannot read {}: {e}", path.display()));
    let mut decoder = png::Decoder::new(BufReader::new(file));
    decoder.set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(failed)?;
    let size = reader.output_buffer_size().unwrap_or(0);
    let mut pixels = vec![0; size];
    let info = reader.next_frame(&mut pixels).map_err(failed)?;
    pixels.truncate(info.buffer_size());
    let small =
        |size: u32| u16::try_from(size).map_err(|_| Failure(format!("{} is too large", path.display())));
    Ok((pixels, small(info.width)?, small(info.height)?))
}
