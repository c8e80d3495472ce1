//! Scene of one object that falls on a floor: what a page makes of an own mesh or recording.

use palpate::Recording;

/// Text of a scene in which the object of a recording falls on a floor; `file` names the recording.
pub fn falling_scene(recording: &Recording, file: &str) -> String {
    let heights = recording.surface.positions.iter().map(|position| position.y);
    let height = recording.surface.diagonal() * 0.1 - heights.fold(f64::INFINITY, f64::min);
    format!(
        "gravity = [0.0, -9.81, 0.0]\n[[object]]\nname = \"object\"\nrecording = {file:?}\nposition = [0.0, {height:?}, 0.0]\n\
         [[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nfriction = 1.0\n"
    )
}
