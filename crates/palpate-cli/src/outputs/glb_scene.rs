//! A scene as an animation in a GLB file: rigid motion as translation and rotation of nodes, deformation as morph targets.
//!
//! An object's mesh is its surface at rest. Each frame is a morph target that holds the displacement of every vertex and what
//! it does to the normals; weights are 1 for the frame's own target at its time, 0 for all others, and linear between.

use super::frame::{Frame, obstacle_pose};
use super::glb::{Glb, check_size};
use super::glb_parts::{Animation, Deforming, Track, rigid, root};
use super::solid::{Extent, ball, solid};
use crate::Failure;
use crate::scene_file::Scene;
use glam::DQuat;
use palpate::{Input, Pose, Shape, State};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Colours of objects, one after the other, of obstacles and of tips, linear.
const OBJECTS: [[f32; 3]; 4] =
    [[0.75, 0.22, 0.13], [0.10, 0.35, 0.65], [0.20, 0.50, 0.18], [0.60, 0.42, 0.10]];
const OBSTACLE: [f32; 3] = [0.45, 0.45, 0.47];
const TIP: [f32; 3] = [0.9, 0.75, 0.5];

/// A point is drawn as a ball of this share of the scene's radius.
const POINT: f64 = 0.01;

/// A file larger than this [bytes] is more than most programs like to open.
const LARGE: u64 = 200_000_000;

/// Programs begin to be slow with more targets than this.
const MANY_FRAMES: usize = 1000;

/// Text of a frame of an object, and of its weights [bytes]: two accessors, a target, a name.
const TEXT_PER_FRAME: u64 = 560;

/// A scene that is being written.
pub struct GlbScene {
    glb: Glb,
    objects: Vec<Deforming>,
    /// Nodes of obstacles and of tips, and where they were.
    obstacles: Vec<Track>,
    tips: Vec<Track>,
    times: Vec<f64>,
}

impl GlbScene {
    /// Begin, for about so many frames.
    pub fn new(
        path: &Path,
        scene: &Scene,
        state: &State,
        input: &Input,
        frames: usize,
    ) -> Result<Self, Failure> {
        let mut glb = Glb::new(path, &scene.inputs)?;
        glb.content.nodes.push(root(scene.model.parameters().gravity));
        let mut objects = Vec::new();
        for (at, (recording, name)) in scene.model.recordings().zip(&scene.object_names).enumerate() {
            let surface = &recording.surface;
            let colour = OBJECTS[at % OBJECTS.len()];
            objects.push(Deforming::new(&mut glb, name, &surface.positions, &surface.triangles, colour)?);
        }
        warn_of_size(path, expected_bytes(objects.iter().map(Deforming::size), frames as u64), frames)?;

        let extent = Extent::of(scene, state);
        let mut obstacles = Vec::new();
        for (at, obstacle) in scene.model.parameters().obstacles.iter().enumerate() {
            let start = obstacle_pose(scene, input, at);
            let surface = solid(&obstacle.shape, start, extent);
            let two_sided = matches!(obstacle.shape, Shape::Plane { .. });
            obstacles.push(rigid(&mut glb, &scene.obstacles[at].name, &surface, (OBSTACLE, two_sided))?);
        }
        let mut tips = Vec::new();
        for device in &scene.devices {
            let radius = device.parameters.tip_radius;
            let radius = if radius > 0.0 { radius } else { POINT * extent.radius };
            tips.push(rigid(&mut glb, &device.name, &ball(radius), (TIP, false))?);
        }
        Ok(Self { glb, objects, obstacles, tips, times: Vec::new() })
    }

    /// Write a frame.
    pub fn write(&mut self, frame: &Frame) -> Result<(), Failure> {
        let time = frame.output.time_s;
        for (at, object) in self.objects.iter_mut().enumerate() {
            object.add_shape(&mut self.glb, &frame.displacements[at], format!("{time:.4} s"))?;
            object.track.poses.push(frame.output.objects[at].pose);
        }
        for (at, obstacle) in self.obstacles.iter_mut().enumerate() {
            obstacle.poses.push(frame.obstacle(at));
        }
        for (at, tip) in self.tips.iter_mut().enumerate() {
            tip.poses.push(Pose { position: frame.tip(at), orientation: DQuat::IDENTITY });
            tip.there.push(frame.shows(at));
        }
        self.times.push(time);
        Ok(())
    }

    /// Put the file together; gives it.
    pub fn finish(mut self) -> Result<PathBuf, Failure> {
        let start = self.times.first().copied().unwrap_or_default();
        let times: Vec<f64> = self.times.iter().map(|time| time - start).collect();
        let mut animation = Animation::new(self.glb.times(&times));
        let frames = times.len();
        for object in self.objects {
            animation.track(&mut self.glb, &object.track);
            // One-hot: row by row, a frame's own target.
            let weights = (0..frames * frames).map(|at| if at / frames == at % frames { 1.0 } else { 0.0 });
            animation.channel(&mut self.glb, object.node(), "weights", weights, ("SCALAR", 1));
            let first: Vec<f64> = (0..frames).map(|at| if at == 0 { 1.0 } else { 0.0 }).collect();
            object.finish(&mut self.glb.content, &first);
        }
        for track in self.obstacles.iter().chain(&self.tips) {
            animation.track(&mut self.glb, track);
        }
        self.glb.content.animations.push(animation.json("run"));
        self.glb.content.extras = json!({ "start_s": start });
        self.glb.finish()
    }
}

/// Bytes that so many frames of objects of some vertices and triangles will take.
fn expected_bytes(objects: impl Iterator<Item = (usize, usize)>, frames: u64) -> u64 {
    let each = |(vertices, triangles): (usize, usize)| {
        let (vertices, triangles) = (vertices as u64, triangles as u64);
        let weights = frames.saturating_mul(frames).saturating_mul(4);
        let shapes = (24 * vertices + TEXT_PER_FRAME).saturating_mul(frames);
        shapes.saturating_add(weights).saturating_add(24 * vertices + 12 * triangles)
    };
    objects.map(each).fold(0, u64::saturating_add)
}

fn warn_of_size(path: &Path, bytes: u64, frames: usize) -> Result<(), Failure> {
    check_size(bytes, path)?;
    let fewer = "--fps, --from and --to make it less";
    if bytes > LARGE {
        let size = 1e-6 * bytes as f64;
        crate::tell(&format!("warning: {} will have some {size:.0} MB; {fewer}", path.display()));
    } else if frames > MANY_FRAMES {
        crate::tell(&format!(
            "warning: {} will have {frames} frames, which many programs are slow with; {fewer}",
            path.display()
        ));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_foretold_and_absurd_ones_are_refused_before_anything_is_computed() {
        let path = Path::new("run.glb");
        // 10 s at 30 frames a second of 866 vertices: two vectors of 12 bytes each, 300 weights a frame, and text.
        let bytes = expected_bytes([(866, 1728)].into_iter(), 301);
        assert!((6_500_000..7_500_000).contains(&bytes), "{bytes}");
        assert_eq!(warn_of_size(path, bytes, 301), Ok(()));
        // Weights alone are the square of the frames.
        let bytes = expected_bytes([(866, 1728)].into_iter(), 36_000);
        assert!(bytes > 4 * 36_000 * 36_000 && warn_of_size(path, bytes, 36_000).is_err());
        let bytes = expected_bytes([(1 << 40, 1 << 41)].into_iter(), 1 << 60);
        assert_eq!((bytes, warn_of_size(path, bytes, 1 << 60).is_err()), (u64::MAX, true));
    }
}
