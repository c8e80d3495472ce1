//! Context of a step's collision detection: the scene, and buffers that are made once.

use super::broad_phase::SweepAndPrune;
use super::candidate::CandidateList;
use super::contact::Contact;
use super::contact_cache::LevelChanges;
use super::level_of_detail::Levels;
use super::node_cache::NodePositionCache;
use super::proximity::ProximityQuery;
use super::triangle_cache::TriangleCaches;
use crate::bounded_vec::BoundedVec;
use crate::device::DeviceParameters;
use crate::object::{Object, ObjectState};
use crate::obstacle::Obstacle;
use crate::sleep::Sleepers;
use alloc::vec;
use alloc::vec::Vec;

/// The immutable scene as collision detection sees it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct CollisionScene<'a> {
    pub(crate) objects: &'a [Object],
    pub(crate) devices: &'a [DeviceParameters],
    pub(crate) obstacles: &'a [Obstacle],
    pub(crate) max_contact_samples: usize,
}

/// Caches of collision detection, from step to step; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct CollisionCaches {
    /// Triangles near each device.
    pub(crate) triangles: Vec<TriangleCaches>,
    pub(crate) sweep: SweepAndPrune,
}

impl CollisionCaches {
    /// Caches for a scene.
    pub(crate) fn new(scene: CollisionScene) -> Self {
        let CollisionScene { objects, devices, .. } = scene;
        Self {
            triangles: devices
                .iter()
                .map(|_| TriangleCaches::new(objects.len(), max_modes(objects)))
                .collect(),
            sweep: SweepAndPrune::new(objects),
        }
    }
}

/// Buffers of collision detection, whose content lasts for a step.
#[derive(Debug, Clone)]
pub(crate) struct CollisionWorkspace {
    pub(crate) query: ProximityQuery,
    /// Node positions, per object.
    pub(crate) positions: Vec<NodePositionCache>,
    /// Objects near a device.
    pub(crate) near_objects: BoundedVec<u32>,
    /// Whether something has come near each object that could move it.
    pub(crate) disturbed: Vec<bool>,
    /// Surface nodes that the broad phase leaves.
    pub(crate) near_nodes: BoundedVec<u32>,
    /// Modal coordinates at a time within the step.
    pub(crate) coordinates: Vec<f64>,
    pub(crate) candidates: CandidateList,
    pub(crate) level_changes: LevelChanges,
}

impl CollisionWorkspace {
    /// Buffers for a scene with room for so many contacts.
    pub(crate) fn new(scene: CollisionScene, contacts: usize) -> Self {
        let objects = scene.objects;
        let nodes = |object: &Object| object.body.recording.surface.positions.len();
        Self {
            query: ProximityQuery::new(),
            positions: objects.iter().map(|o| NodePositionCache::new(&o.body)).collect(),
            near_objects: BoundedVec::new(objects.len()),
            disturbed: vec![false; objects.len()],
            near_nodes: BoundedVec::new(objects.iter().map(nodes).max().unwrap_or(0)),
            coordinates: vec![0.0; max_modes(objects)],
            candidates: CandidateList::new(contacts),
            level_changes: LevelChanges::new(contacts),
        }
    }

    /// Forget the node positions of another state's step.
    pub(crate) fn forget_positions(&mut self) {
        self.positions.iter_mut().for_each(NodePositionCache::forget);
    }
}

/// Number of modes of the object that has most.
fn max_modes(objects: &[Object]) -> usize {
    objects.iter().map(|object| object.response.modes()).max().unwrap_or(0)
}

/// One step's collision detection.
pub(crate) struct CollisionContext<'a> {
    pub(crate) scene: CollisionScene<'a>,
    pub(crate) states: &'a [ObjectState],
    /// Contacts of the last step.
    pub(crate) contacts: &'a [Contact],
    pub(crate) sleepers: &'a Sleepers,
    pub(crate) levels: &'a mut Levels,
    pub(crate) caches: &'a mut CollisionCaches,
    pub(crate) workspace: &'a mut CollisionWorkspace,
    /// Number of the step.
    pub(crate) step: u64,
}
