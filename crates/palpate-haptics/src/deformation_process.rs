//! Deformation process (paper, section 3.2): deformed surfaces with normals for display, beside the force process.

use crate::snapshot::Snapshot;
use glam::DVec3;
use palpate::{Model, Pose, ResidualFieldCache};
use std::sync::Arc;

/// Deformed surfaces of all objects at one time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Frame {
    /// Simulated time [s].
    pub time_s: f64,
    /// Surfaces of the objects, in the model's order.
    pub objects: Vec<FrameObject>,
}

/// Deformed surface of an object.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct FrameObject {
    /// Pose of the object; `None` before the first cycle.
    pub pose: Option<Pose>,
    /// Nodal positions, shape (nodes, 3) [m, body], in single precision.
    pub positions: Vec<[f32; 3]>,
    /// Unit normals of the deformed surface at the nodes, shape (nodes, 3) [body].
    pub normals: Vec<[f32; 3]>,
}

/// Deformation process without its thread.
pub struct DeformationProcess {
    model: Arc<Model>,
    frame: Frame,
    displacement: Vec<DVec3>,
    sums: Vec<DVec3>,
    caches: Vec<ResidualFieldCache>,
}

impl DeformationProcess {
    /// Deformation process of a scene.
    pub fn new(model: Arc<Model>) -> Self {
        let nodes: Vec<usize> = model.recordings().map(|r| r.surface.positions.len()).collect();
        let most_nodes = nodes.iter().copied().max().unwrap_or(0);
        let empty = |nodes| FrameObject {
            pose: None,
            positions: vec![[0.0; 3]; nodes],
            normals: vec![[0.0; 3]; nodes],
        };
        let frame = Frame { time_s: 0.0, objects: nodes.into_iter().map(empty).collect() };
        let caches = vec![ResidualFieldCache::default(); frame.objects.len()];
        Self {
            model,
            frame,
            displacement: vec![DVec3::ZERO; most_nodes],
            sums: vec![DVec3::ZERO; most_nodes],
            caches,
        }
    }

    /// Computes the deformed surfaces of a snapshot. Normals are area-weighted means over the triangles of each node.
    pub fn cycle(&mut self, snapshot: &Snapshot) -> &Frame {
        let Snapshot { objects, output, .. } = snapshot;
        self.frame.time_s = output.time_s;
        let surfaces = objects.iter().zip(&mut self.frame.objects).zip(&mut self.caches);
        for (((deformation, frame), cache), recording) in surfaces.zip(self.model.recordings()) {
            let surface = &recording.surface;
            let nodes = surface.positions.len();
            let (positions, sums) = (&mut self.displacement[..nodes], &mut self.sums[..nodes]);
            deformation.surface_displacement_cached(&self.model, cache, positions);
            positions.iter_mut().zip(&surface.positions).for_each(|(position, rest)| *position += *rest);
            sums.fill(DVec3::ZERO);
            for triangle in &surface.triangles {
                let [a, b, c] = triangle.map(|node| positions[node as usize]);
                let normal = (b - a).cross(c - a);
                triangle.iter().for_each(|&node| sums[node as usize] += normal);
            }
            frame.pose = Some(deformation.pose());
            for (out, position) in frame.positions.iter_mut().zip(&*positions) {
                *out = position.as_vec3().to_array();
            }
            for (out, sum) in frame.normals.iter_mut().zip(&*sums) {
                *out = sum.normalize_or_zero().as_vec3().to_array();
            }
        }
        &self.frame
    }
}
