//! Paths of devices and obstacles: the first byte chooses the columns.
#![no_main]

use libfuzzer_sys::fuzz_target;
use palpate_haptics::{Columns, MotionPath};

fuzz_target!(|bytes: &[u8]| {
    let Some((&columns, bytes)) = bytes.split_first() else { return };
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let columns = [Columns::Position, Columns::Pose, Columns::Force][usize::from(columns % 3)];
    let Ok(path) = MotionPath::parse(text, columns) else { return };
    for path in [path.clone(), path.repeating()] {
        for t in [-1.0, 0.0, 0.5 * path.end(), path.end(), 2.0 * path.end() + 1.0] {
            let pose = path.at(t);
            assert!(pose.position.is_finite() && pose.orientation.is_finite(), "{pose:?} at {t}");
        }
    }
});
