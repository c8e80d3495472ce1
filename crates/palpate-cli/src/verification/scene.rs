//! What the cases with contacts share: scenes of bodies, planes and fingers.

use super::{Check, recorded, undamped};
use crate::Failure;
use glam::DVec3;
use palpate::{
    Damping, DeviceParameters, Model, ModelObject, ModelParameters, ObjectStart, Obstacle, Output, Pose,
    Recording, Shape, Twist,
};
use palpate_fem::element::Order;
use palpate_fem::mesh::Mesh;
use palpate_fem::record::{Extent, RecordParameters};
use std::sync::Arc;

/// Free fall [m/s²].
pub const G: f64 = 9.81;

/// Sums over some thousand steps and some hundred contacts, whose terms cancel to a hundredth of themselves: 1e5 ulps.
pub const ROUND_OFF: f64 = 1e-11;

/// What a body is made of.
#[derive(Clone, Copy)]
pub struct Stuff {
    /// E [Pa].
    pub young: f64,
    /// ν.
    pub poisson: f64,
    /// ρ [kg/m³].
    pub density: f64,
    /// Of the damping matrix βK [s].
    pub beta: f64,
}

/// The paper's cube (section 3.1) with the damping of the reference of its fall.
pub const PAPER: Stuff = Stuff { young: 2000.0, poisson: 0.49, density: 110.0, beta: 1e-4 };

impl Stuff {
    /// Parameters of a recording without certificate.
    pub fn parameters(&self, order: Order, modes: usize) -> RecordParameters {
        RecordParameters {
            damping: Damping::Rayleigh { alpha: 0.0, beta: self.beta },
            extent: Extent::Uncertified,
            ..undamped(self.young, self.poisson, self.density, order, modes)
        }
    }

    /// A free body.
    pub fn body(&self, mesh: Mesh, order: Order, modes: usize) -> Result<Arc<Recording>, Failure> {
        Ok(Arc::new(recorded(mesh, &self.parameters(order, modes))?.recording))
    }

    /// A body that stands on nodes that do not move.
    pub fn standing(
        &self,
        mesh: Mesh,
        order: Order,
        modes: usize,
        fixed: impl Fn(DVec3) -> bool,
    ) -> Result<Arc<Recording>, Failure> {
        let fixed_nodes = (0..mesh.nodes.len()).filter(|&node| fixed(mesh.nodes[node]));
        let fixed_nodes = fixed_nodes.map(|node| node as u32).collect();
        let parameters = RecordParameters { fixed_nodes, ..self.parameters(order, modes) };
        Ok(Arc::new(recorded(mesh, &parameters)?.recording))
    }
}

/// The plane y = 0.
pub fn floor(friction: f64) -> Obstacle {
    Obstacle { shape: Shape::Plane { normal: DVec3::Y }, pose: Pose::IDENTITY, friction }
}

/// A body that starts without turning.
pub fn at(recording: &Arc<Recording>, position: DVec3, velocity: DVec3) -> ModelObject {
    let pose = Pose { position, ..Pose::IDENTITY };
    let twist = Twist { linear: velocity, angular: DVec3::ZERO };
    ModelObject::new(recording.clone(), ObjectStart { pose, twist })
}

/// A scene under gravity.
pub fn scene(
    step_s: f64,
    gravity: DVec3,
    obstacles: Vec<Obstacle>,
    devices: Vec<DeviceParameters>,
    objects: Vec<ModelObject>,
) -> Result<Model, Failure> {
    let parameters = ModelParameters { step_s, gravity, obstacles, devices, ..ModelParameters::default() };
    Ok(Model::new(parameters, objects)?)
}

/// What a run must never do: gain energy, leave contacts unsolved or out.
#[derive(Default)]
pub struct Watch {
    start: Option<f64>,
    moved: f64,
    gained: f64,
    defect: f64,
    missed: u32,
}

impl Watch {
    /// Look at the output of a step, the first time at that of the start.
    pub fn look(&mut self, output: &Output) {
        let energy = &output.energy;
        let start = *self.start.get_or_insert(energy.stored());
        self.moved = self.moved.max(start.abs()).max(energy.kinetic + energy.elastic + energy.input.abs());
        self.gained = self.gained.max(energy.stored() - start - energy.input);
        self.defect = self.defect.max(energy.defect.abs());
        self.missed += output.status.unsolved_islands + output.status.dropped_contacts;
    }

    /// What was seen.
    pub fn checks(&self, of: &str) -> [Check; 3] {
        let share = |joules: f64| joules.max(0.0) / self.moved;
        [
            Check::new(
                format!("{of}: energy beyond what was put in, share"),
                share(self.gained),
                0.0,
                ROUND_OFF,
            ),
            Check::new(
                format!("{of}: energy that no term explains, share"),
                share(self.defect),
                0.0,
                ROUND_OFF,
            ),
            Check::new(format!("{of}: contacts unsolved or left out"), f64::from(self.missed), 0.0, 0.0),
        ]
    }
}
