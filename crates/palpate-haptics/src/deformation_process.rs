//! The deformation process (paper, section 3.2): whole surfaces for the eye, beside the force.

use crate::snapshot::Snapshot;
use glam::DVec3;
use palpate::{Model, Pose, ResidualFieldCache};
use std::sync::Arc;

/// The surfaces of all objects at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Simulated time [s].
    pub time_s: f64,
    /// The objects, in the model's order.
    pub objects: Vec<FrameObject>,
}

/// The surface of an object at one moment.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameObject {
    /// Where the object is.
    pub pose: Option<Pose>,
    /// Nodes [m, body], in single precision: for pictures.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the deformed surface at the nodes [body].
    pub normals: Vec<[f32; 3]>,
}

/// The deformation process without its thread: what happens in a cycle.
pub struct DeformationProcess {
    model: Arc<Model>,
    frame: Frame,
    displacement: Vec<DVec3>,
    sums: Vec<DVec3>,
    memories: Vec<ResidualFieldCache>,
}

impl DeformationProcess {
    /// For a scene.
    pub fn new(model: Arc<Model>) -> Self {
        let nodes: Vec<usize> = model.recordings().map(|r| r.surface.positions.len()).collect();
        let most = nodes.iter().copied().max().unwrap_or(0);
        let empty = |nodes| FrameObject {
            pose: None,
            positions: vec![[0.0; 3]; nodes],
            normals: vec![[0.0; 3]; nodes],
        };
        let frame = Frame { time_s: 0.0, objects: nodes.into_iter().map(empty).collect() };
        let memories = vec![ResidualFieldCache::default(); frame.objects.len()];
        Self { model, frame, displacement: vec![DVec3::ZERO; most], sums: vec![DVec3::ZERO; most], memories }
    }

    /// Make the surfaces of a moment.
    pub fn cycle(&mut self, moment: &Snapshot) -> &Frame {
        let Snapshot { time_s, objects, .. } = moment;
        self.frame.time_s = *time_s;
        let drawn = objects.iter().zip(&mut self.frame.objects).zip(&mut self.memories);
        for (((deformation, frame), memory), recording) in drawn.zip(self.model.recordings()) {
            let surface = &recording.surface;
            let nodes = surface.positions.len();
            let (places, sums) = (&mut self.displacement[..nodes], &mut self.sums[..nodes]);
            deformation.surface_displacement_cached(&self.model, memory, places);
            places.iter_mut().zip(&surface.positions).for_each(|(place, rest)| *place += *rest);
            sums.fill(DVec3::ZERO);
            for triangle in &surface.triangles {
                let [a, b, c] = triangle.map(|node| places[node as usize]);
                let normal = (b - a).cross(c - a);
                triangle.iter().for_each(|&node| sums[node as usize] += normal);
            }
            frame.pose = Some(deformation.pose());
            for (out, place) in frame.positions.iter_mut().zip(&*places) {
                *out = place.as_vec3().to_array();
            }
            for (out, sum) in frame.normals.iter_mut().zip(&*sums) {
                *out = sum.normalize_or_zero().as_vec3().to_array();
            }
        }
        &self.frame
    }
}
