//! Logs of a page without a server: the same frames, whether their files are unpacked or stay in memory.

use palpate_scene::LogReplay;
use palpate_viewer::{FrameSteps, LocalLogs, LogPlayer, PageMessage};
use std::cell::Cell;
use std::error::Error;
use std::path::{Path, PathBuf};

fn sample(log: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../data/logs/v3").join(log)
}

fn texts(run: impl FnOnce(&mut dyn FnMut(PageMessage))) -> Vec<String> {
    let mut texts = Vec::new();
    run(&mut |message| match message {
        PageMessage::Text(text) => texts.push(text),
        other => panic!("{other:?}"),
    });
    texts
}

/// Logs that are computed to their end, each call 5 ms after the one before.
fn played(logs: &[&str]) -> Result<(LocalLogs, Vec<String>), Box<dyn Error>> {
    let mut playing = LocalLogs::default();
    for log in logs {
        let bytes = std::fs::read(sample(log))?;
        assert_eq!(playing.add(log, bytes)?, None);
    }
    let clock = Cell::new(0.0);
    let now = || {
        clock.set(clock.get() + 0.005);
        clock.get()
    };
    let told = texts(|send| {
        playing.greet(send);
        while playing.advance(&now, send) {}
    });
    Ok((playing, told))
}

#[test]
fn a_log_in_memory_has_the_frames_of_its_unpacked_files() -> Result<(), Box<dyn Error>> {
    for log in ["finger_on_floor.mcap", "held_and_simulated.mcap", "two_objects.mcap"] {
        let (playing, told) = played(&[log])?;
        let unpacked = LogReplay::read(&sample(log))?;
        let steps = FrameSteps::at_rate(&unpacked, 60.0);
        let mut player = LogPlayer::new(unpacked, log.into(), 0, steps)?;
        let spacing = player.spacing();
        while player.advance()? {}
        let frames = player.frames.clone();
        player.finish(None)?;
        let mut expected = LocalLogs::default();
        expected.show(frames);
        let path = format!("log/0/frames?from=0&count={}", spacing.count);
        let bytes = playing.data(&path).ok_or("no frames")?;
        assert!(bytes.len() > 1000, "{log}: {} bytes", bytes.len());
        assert_eq!(bytes, expected.data(&path).ok_or("no frames")?, "{log}");
        assert_eq!(playing.data("log/0/series"), expected.data("log/0/series"), "{log}");
        assert!(told[0].contains(r#""kind":"logs""#) && told[0].contains(log), "{}", told[0]);
        let last = told.last().ok_or("nothing was told")?;
        assert!(last.contains(r#""done":true"#), "{last}");
    }
    Ok(())
}

#[test]
fn two_logs_have_numbers_and_unknown_paths_no_data() -> Result<(), Box<dyn Error>> {
    let (playing, told) = played(&["finger_on_floor.mcap", "fixed_object.mcap"])?;
    assert_eq!(told.iter().filter(|text| text.contains(r#""type":"scene""#)).count(), 2);
    for path in ["scene/1/object/0/surface", "scene/0/object/0/mode_shapes", "log/1/series"] {
        assert!(playing.data(path).is_some(), "{path}");
    }
    for path in [
        "scene/2/object/0/surface",
        "log/2/series",
        "log/0/frames",
        "log/0/frames?from=a&count=1",
        "log/x/series",
    ] {
        assert_eq!(playing.data(path), None, "{path}");
    }
    Ok(())
}

#[test]
fn what_is_no_log_is_told() -> Result<(), Box<dyn Error>> {
    let whole = std::fs::read(sample("finger_on_floor.mcap"))?;
    let told = |bytes: &[u8]| {
        LocalLogs::default()
            .add("run.mcap", bytes.to_vec())
            .err()
            .map(|error| error.to_string())
            .unwrap_or_default()
    };
    assert_eq!(told(&[]), "run.mcap: the log can't be read: Bad magic number");
    assert_eq!(
        told(&whole[..300]),
        "run.mcap: the log ends before its first whole step: nothing of it can be read"
    );
    Ok(())
}
