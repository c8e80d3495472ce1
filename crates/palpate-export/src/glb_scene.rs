//! Animation of a scene in a GLB file: rigid motion as node transforms, deformation as morph targets.
//!
//! An object's mesh is its surface at rest. Each frame is a morph target: displacements of the vertices, and changes of their
//! normals. The weight of a frame's target is 1 at its time, 0 at all others, and linear between.

use crate::error::ExportError;
use crate::frame::Frame;
use crate::glb::{Glb, check_glb_size};
use crate::glb_parts::{DeformingSurface, GlbAnimation, NodeTrack, rigid, root_node};
use crate::labels::{SceneLabels, obstacle_pose};
use crate::rigid_surface::{BoundingSphere, ball, obstacle_surface};
use glam::DQuat;
use palpate::{Input, Model, Pose, Shape, State};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Linear colours: of objects, in turn; of obstacles; of tips.
const OBJECTS: [[f32; 3]; 4] =
    [[0.75, 0.22, 0.13], [0.10, 0.35, 0.65], [0.20, 0.50, 0.18], [0.60, 0.42, 0.10]];
const OBSTACLE: [f32; 3] = [0.45, 0.45, 0.47];
const TIP: [f32; 3] = [0.9, 0.75, 0.5];

/// Radius of the sphere that shows a tip of radius 0, in radii of the bounding sphere.
const POINT: f64 = 0.01;

/// Length [bytes] above which most programs are slow to open a file.
const LARGE_BYTES: u64 = 200_000_000;

/// Number of morph targets above which programs become slow.
const MANY_FRAMES: usize = 1000;

/// JSON per frame and object [bytes]: two accessors, a target, a name.
const TEXT_PER_FRAME: u64 = 560;

/// Size of a GLB file that programs may not open well.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GlbWarning {
    /// Many bytes.
    #[error("{} will have some {:.0} MB", path.display(), 1e-6 * *bytes as f64)]
    Large {
        /// Output file.
        path: PathBuf,
        /// Expected length [bytes].
        bytes: u64,
    },
    /// Many frames.
    #[error("{} will have {frames} frames, which many programs are slow with", path.display())]
    ManyFrames {
        /// Output file.
        path: PathBuf,
        /// Expected number of frames.
        frames: usize,
    },
}

/// Writer of an animated scene.
pub struct GlbScene {
    glb: Glb,
    objects: Vec<DeformingSurface>,
    /// Tracks of obstacles and of tips.
    obstacles: Vec<NodeTrack>,
    tips: Vec<NodeTrack>,
    times: Vec<f64>,
}

impl GlbScene {
    /// Adds objects, obstacles and tips, for an expected number of frames; warns of large files.
    pub fn new(
        path: &Path,
        (model, labels): (&Model, &SceneLabels),
        state: &State,
        input: &Input,
        frames: usize,
    ) -> Result<(Self, Option<GlbWarning>), ExportError> {
        let mut glb = Glb::new(path, &labels.inputs)?;
        glb.content.nodes.push(root_node(model.parameters().gravity));
        let mut objects = Vec::new();
        for (at, (recording, name)) in model.recordings().zip(&labels.objects).enumerate() {
            let surface = &recording.surface;
            let colour = OBJECTS[at % OBJECTS.len()];
            objects.push(DeformingSurface::new(
                &mut glb,
                name,
                &surface.positions,
                &surface.triangles,
                colour,
            )?);
        }
        let warning = check_expected(
            path,
            expected_bytes(objects.iter().map(DeformingSurface::size), frames as u64),
            frames,
        )?;

        let bounds = BoundingSphere::of(model, state);
        let mut obstacles = Vec::new();
        for (at, obstacle) in model.parameters().obstacles.iter().enumerate() {
            let start = obstacle_pose(model, input, at);
            let surface = obstacle_surface(&obstacle.shape, start, bounds);
            let two_sided = matches!(obstacle.shape, Shape::Plane { .. });
            obstacles.push(rigid(&mut glb, &labels.obstacles[at], &surface, (OBSTACLE, two_sided))?);
        }
        let mut tips = Vec::new();
        for (device, parameters) in labels.devices.iter().zip(&model.parameters().devices) {
            let radius = parameters.tip_radius;
            let radius = if radius > 0.0 { radius } else { POINT * bounds.radius };
            tips.push(rigid(&mut glb, &device.name, &ball(radius), (TIP, false))?);
        }
        Ok((Self { glb, objects, obstacles, tips, times: Vec::new() }, warning))
    }

    /// Adds a frame.
    pub fn write(&mut self, frame: &Frame) -> Result<(), ExportError> {
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
            tip.visible.push(frame.shows(at));
        }
        self.times.push(time);
        Ok(())
    }

    /// Completes the file; returns its path.
    pub fn finish(mut self) -> Result<PathBuf, ExportError> {
        let start = self.times.first().copied().unwrap_or_default();
        let times: Vec<f64> = self.times.iter().map(|time| time - start).collect();
        let mut animation = GlbAnimation::new(self.glb.times(&times));
        let frames = times.len();
        for object in self.objects {
            animation.track(&mut self.glb, &object.track);
            // The identity matrix, by rows: a frame's own target.
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

/// Expected length [bytes] for objects given by their numbers of vertices and triangles.
fn expected_bytes(objects: impl Iterator<Item = (usize, usize)>, frames: u64) -> u64 {
    let each = |(vertices, triangles): (usize, usize)| {
        let (vertices, triangles) = (vertices as u64, triangles as u64);
        let weights = frames.saturating_mul(frames).saturating_mul(4);
        let shapes = (24 * vertices + TEXT_PER_FRAME).saturating_mul(frames);
        shapes.saturating_add(weights).saturating_add(24 * vertices + 12 * triangles)
    };
    objects.map(each).fold(0, u64::saturating_add)
}

/// Checks the expected length of a file against the format, and against what programs open well.
fn check_expected(path: &Path, bytes: u64, frames: usize) -> Result<Option<GlbWarning>, ExportError> {
    check_glb_size(bytes, path)?;
    Ok(match (bytes > LARGE_BYTES, frames > MANY_FRAMES) {
        (true, _) => Some(GlbWarning::Large { path: path.to_path_buf(), bytes }),
        (false, true) => Some(GlbWarning::ManyFrames { path: path.to_path_buf(), frames }),
        (false, false) => None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_estimated_and_impossible_ones_are_refused_before_anything_is_computed() {
        let path = Path::new("run.glb");
        // 10 s at 30 frames a second of 866 vertices: two vectors of 12 bytes each, 300 weights a frame, and text.
        let bytes = expected_bytes([(866, 1728)].into_iter(), 301);
        assert!((6_500_000..7_500_000).contains(&bytes), "{bytes}");
        assert!(matches!(check_expected(path, bytes, 301), Ok(None)));
        // Weights alone are the square of the frames.
        let bytes = expected_bytes([(866, 1728)].into_iter(), 36_000);
        assert!(bytes > 4 * 36_000 * 36_000 && check_expected(path, bytes, 36_000).is_err());
        let bytes = expected_bytes([(1 << 40, 1 << 41)].into_iter(), 1 << 60);
        assert_eq!((bytes, check_expected(path, bytes, 1 << 60).is_err()), (u64::MAX, true));
    }
}
