//! Motion of a scene's parts over simulated time.

use crate::scene::Scene;
use palpate_haptics::{MotionPath, PoseTrajectory, SceneMotion};
use std::sync::Arc;

/// Source of the motion of a scene's parts, for each of its starts.
pub type MotionSource = Arc<dyn Fn() -> SceneMotion + Send + Sync>;

impl Scene {
    /// Motion of planes, obstacles, clamps, bases and gravity on their paths.
    pub fn motion(&self) -> MotionSource {
        let (obstacles, bases, gravity) = (self.obstacles.clone(), self.bases.clone(), self.gravity.clone());
        let clamps: Vec<Option<MotionPath>> = self.clamps.iter().map(|clamp| clamp.path.clone()).collect();
        Arc::new(move || {
            let obstacles = obstacles.iter().cloned();
            let obstacles =
                obstacles.map(|obstacle| Box::new(move |time_s| obstacle.pose_at(time_s)) as PoseTrajectory);
            SceneMotion {
                obstacles: obstacles.collect(),
                clamps: clamps.iter().map(|path| path.clone().map(MotionPath::into_trajectory)).collect(),
                bases: bases.clone(),
                gravity: gravity.clone(),
            }
        })
    }
}
