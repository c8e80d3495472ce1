//! Observer of a run of a built-in scene.

use crate::check::Check;
use glam::DVec3;
use palpate::{EnergyLedger, Model, Pose, State};

/// Energy that no term explains, as a share of the energy exchanged: contact samples are solved to 1e-5 of the size.
const UNEXPLAINED: f64 = 1e-9;

/// Energy below which nothing is counted [J].
const NEGLIGIBLE_J: f64 = 1e-12;

/// Share of the losses that contacts give back: the contact of a tip that drags its indentation about jumps from wall to wall (docs/measured.md).
/// A chaotic motion has a distribution: eight seeds of *bounce* give 0.138 ± 0.063; this is four standard deviations above their mean.
const GIVEN_BACK: f64 = 0.39;

/// Largest displacement of the surface, as a share of the radius: while four pointers press by up to a radius each, and in the end.
const SHAPE: [f64; 2] = [2.5, 0.2];

/// Depth of a node in an obstacle at rest, as a share of the diagonal.
const DEPTH: f64 = 0.01;

/// Speed at rest [m/s].
const STILL_M_S: f64 = 5e-3;

/// Steps between two looks at the surfaces.
const LOOK: u64 = 100;

/// Extremes over a run, and the latest energies.
pub struct Observer {
    stored_at_start: f64,
    last: EnergyLedger,
    exchanged: f64,
    gained: f64,
    unexplained: f64,
    given_back: f64,
    /// Largest displacement of a surface, in radii; and its latest.
    deformed: [f64; 2],
    /// Farthest centre of mass from the origin [m].
    farthest: f64,
}

impl Observer {
    /// Observer before the first step.
    pub fn new(state: &State) -> Self {
        let energy = state.output().energy;
        Self {
            stored_at_start: energy.stored(),
            last: energy,
            exchanged: energy.kinetic + energy.elastic + NEGLIGIBLE_J / UNEXPLAINED,
            gained: 0.0,
            unexplained: 0.0,
            given_back: 0.0,
            deformed: [0.0; 2],
            farthest: 0.0,
        }
    }

    /// Observe a step.
    pub fn observe(&mut self, model: &Model, state: &State, number: u64) {
        let output = state.output();
        let energy = &output.energy;
        self.exchanged += (energy.input - self.last.input).abs() + (energy.kinetic - self.last.kinetic).abs();
        self.gained = self.gained.max(energy.stored() - self.stored_at_start - energy.input);
        self.unexplained = self.unexplained.max(energy.defect.abs());
        self.given_back += (self.last.impact - energy.impact).max(0.0);
        self.last = *energy;
        for object in &output.objects {
            self.farthest = self.farthest.max(object.pose.position.length());
        }
        if number.is_multiple_of(LOOK) {
            let deformed = deformation(model, state);
            self.deformed = [self.deformed[0].max(deformed), deformed];
        }
    }

    /// Checks at the end of a run.
    pub fn checks(
        &self,
        of: &str,
        model: &Model,
        state: &State,
        (middle, reach): (DVec3, DVec3),
        (is_driven, lies_flat): (bool, bool),
    ) -> Vec<Check> {
        let output = state.output();
        let away = |pose: &Pose| ((pose.position - middle) / reach).abs().max_element();
        let away = output.objects.iter().map(|object| away(&object.pose)).fold(0.0, f64::max);
        let speed = output.objects.iter().map(|object| object.twist.linear.length()).fold(0.0, f64::max);
        let lost = output.energy.lost();
        let check =
            |what: &str, value: f64, allowed: f64| Check::new(format!("{of}: {what}"), value, 0.0, allowed);
        let mut checks = vec![
            check("distance from the middle at the end, share of the reach", away, 1.0),
            check("farthest from the origin [m]", self.farthest, 2.0),
            check("largest displacement of a surface, share of the radius", self.deformed[0], SHAPE[0]),
            check("displacement at the end, share of the radius", self.deformed[1], SHAPE[1]),
            check("energy beyond what was put in [J]", self.gained.max(0.0), UNEXPLAINED * self.exchanged),
            check("energy that no term explains [J]", self.unexplained, UNEXPLAINED * self.exchanged),
            check(
                "energy that contacts give back, share of the losses",
                self.given_back / lost.max(NEGLIGIBLE_J),
                GIVEN_BACK,
            ),
        ];
        if !is_driven {
            checks.push(check("speed at the end [m/s]", speed, STILL_M_S));
            checks.push(check(
                "depth of nodes in obstacles, share of the diagonal",
                depth(model, state),
                DEPTH,
            ));
        }
        if lies_flat {
            // A cube that lies on any of its faces.
            let up = |pose: &Pose| (pose.orientation.inverse() * DVec3::Y).abs().max_element();
            let tilt = output.objects.iter().map(|object| 1.0 - up(&object.pose)).fold(0.0, f64::max);
            checks.push(check("1 − cosine of the tilt", tilt, 0.3));
        }
        checks
    }
}

/// Deformed nodes of an object [m, world], and their largest displacement [m].
fn nodes(model: &Model, state: &State, object: usize) -> (Vec<DVec3>, f64) {
    let surface = &model.recordings().nth(object).expect("a recording of each object").surface;
    let mut nodes = vec![DVec3::ZERO; surface.positions.len()];
    state.surface_displacement(model, object, &mut nodes);
    let largest = nodes.iter().map(|u| u.length()).fold(0.0, f64::max);
    let pose = state.output().objects[object].pose;
    nodes
        .iter_mut()
        .zip(&surface.positions)
        .for_each(|(node, rest)| *node = pose.world_from_body(*rest + *node));
    (nodes, largest)
}

/// Largest displacement of a surface, as a share of its object's radius.
fn deformation(model: &Model, state: &State) -> f64 {
    let radii = model.recordings().map(|recording| recording.surface.radius());
    radii.enumerate().map(|(object, radius)| nodes(model, state, object).1 / radius).fold(0.0, f64::max)
}

/// Largest depth of a node in an obstacle, as a share of its object's diagonal.
fn depth(model: &Model, state: &State) -> f64 {
    let diagonals = model.recordings().map(|recording| recording.surface.diagonal());
    let depths = diagonals.enumerate().flat_map(|(object, diagonal)| {
        let (nodes, _) = nodes(model, state, object);
        let obstacles = model.parameters().obstacles.iter();
        obstacles.flat_map(move |obstacle| {
            let depth = |node: &DVec3| {
                let (distance, _) =
                    obstacle.shape.signed_distance(obstacle.pose.body_from_world(*node), 0.0)?;
                Some(-distance / diagonal)
            };
            nodes.iter().filter_map(depth).collect::<Vec<_>>()
        })
    });
    depths.fold(0.0, f64::max)
}
