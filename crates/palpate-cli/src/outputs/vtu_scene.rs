//! Frames of a scene for ParaView: objects, obstacles, contacts and devices, each with files of its own.

use super::frame::{Frame, obstacle_pose};
use super::solid::{Extent, Solid, solid};
use super::vtu::{Cells, Field, Grid, VtuSeries};
use crate::Failure;
use crate::scene_file::Scene;
use glam::DVec3;
use palpate::{Collider, Input, Pose, State};
use std::path::{Path, PathBuf};

/// Names of parts can't have a dot: nothing in a scene is called this.
const CONTACTS: &str = "scene.contacts";
const DEVICES: &str = "scene.devices";

/// The series of a scene.
pub struct VtuScene {
    series: VtuSeries,
    obstacles: Vec<Obstacle>,
    frames: usize,
}

/// An obstacle, where it was drawn last, and in which file.
struct Obstacle {
    surface: Solid,
    drawn: Option<(Pose, String)>,
}

impl VtuScene {
    /// Make the folder.
    pub fn new(folder: &Path, scene: &Scene, state: &State, input: &Input) -> Result<Self, Failure> {
        let extent = Extent::of(scene, state);
        let shapes = scene.model.parameters().obstacles.iter().enumerate();
        let obstacles = shapes.map(|(at, obstacle)| Obstacle {
            surface: solid(&obstacle.shape, obstacle_pose(scene, input, at), extent),
            drawn: None,
        });
        let obstacles = obstacles.collect();
        Ok(Self { series: VtuSeries::new(folder, "scene.pvd", &scene.inputs)?, obstacles, frames: 0 })
    }

    /// Write a frame.
    pub fn write(&mut self, frame: &Frame) -> Result<(), Failure> {
        let time = frame.output.time_s;
        for (object, recording) in frame.scene.model.recordings().enumerate() {
            let pose = frame.output.objects[object].pose;
            let displacement = &frame.displacements[object];
            let surface = &recording.surface;
            let grid = deformed(&surface.positions, &surface.triangles, displacement, pose);
            let name = self.series.write(&frame.scene.object_names[object], self.frames, &grid)?;
            self.series.show(time, object, name);
        }
        let mut part = frame.displacements.len();
        for (at, obstacle) in self.obstacles.iter_mut().enumerate() {
            let pose = frame.obstacle(at);
            let name = match &obstacle.drawn {
                // What does not move needs no other file.
                Some((drawn, name)) if *drawn == pose => name.clone(),
                _ => {
                    let name = &frame.scene.obstacles[at].name;
                    self.series.write(name, self.frames, &placed(&obstacle.surface, pose))?
                }
            };
            obstacle.drawn = Some((pose, name.clone()));
            self.series.show(time, part, name);
            part += 1;
        }
        if frame.scene.has_touch() {
            let name = self.series.write(CONTACTS, self.frames, &contacts(frame))?;
            self.series.show(time, part, name);
            part += 1;
        }
        if !frame.scene.devices.is_empty() {
            let name = self.series.write(DEVICES, self.frames, &devices(frame))?;
            self.series.show(time, part, name);
        }
        self.frames += 1;
        Ok(())
    }

    /// Let all files take their names; gives the index.
    pub fn finish(self) -> Result<PathBuf, Failure> {
        self.series.finish()
    }
}

/// An object's surface in the world, with its elastic displacement in world axes.
pub fn deformed<'a>(
    rest: &[DVec3],
    triangles: &'a [[u32; 3]],
    displacement: &[DVec3],
    pose: Pose,
) -> Grid<'a> {
    let points = rest.iter().zip(displacement).map(|(rest, u)| pose.world_from_body(*rest + *u)).collect();
    let turned = displacement.iter().map(|u| pose.orientation * *u);
    Grid {
        points,
        cells: Cells::Triangles(triangles),
        fields: vec![Field::vectors("displacement", turned)],
        facts: Vec::new(),
    }
}

fn placed(surface: &Solid, pose: Pose) -> Grid<'_> {
    Grid {
        points: surface.positions.iter().map(|p| pose.world_from_body(*p)).collect(),
        cells: Cells::Triangles(&surface.triangles),
        fields: Vec::new(),
        facts: Vec::new(),
    }
}

/// The contacts that carry force: where, with which force on the object, between whom.
fn contacts(frame: &Frame) -> Grid<'static> {
    let contacts = &frame.output.contacts;
    let objects = frame.displacements.len();
    // Parts as the index counts them: objects, obstacles; devices from there on.
    let part = |against: Collider| match against {
        Collider::Object(at) => at,
        Collider::Obstacle(at) => objects + at,
        Collider::Device(at) => objects + frame.scene.obstacles.len() + at,
    };
    Grid {
        points: contacts.iter().map(|contact| contact.point).collect(),
        cells: Cells::Points,
        fields: vec![
            Field::vectors("force", contacts.iter().map(|contact| contact.force)),
            Field::vectors("normal", contacts.iter().map(|contact| contact.normal)),
            Field::numbers("gap", contacts.iter().map(|contact| contact.gap)),
            Field::numbers("slip_speed", contacts.iter().map(|contact| contact.slip_speed)),
            Field::numbers("object", contacts.iter().map(|contact| contact.object as f64)),
            Field::numbers("against", contacts.iter().map(|contact| part(contact.against) as f64)),
        ],
        facts: Vec::new(),
    }
}

/// The tips of the devices that are there, the force on each hand, where the hand is from there, and which device it is.
fn devices(frame: &Frame) -> Grid<'static> {
    let shown: Vec<usize> = (0..frame.scene.devices.len()).filter(|&at| frame.shows(at)).collect();
    let shown = shown.iter().copied();
    let hand = |at: usize| frame.input.devices[at].position - frame.tip(at);
    let radius = |at: usize| frame.scene.devices[at].parameters.tip_radius;
    Grid {
        fields: vec![
            Field::vectors("force_on_hand", shown.clone().map(|at| frame.output.devices[at].force_on_hand)),
            Field::vectors("hand", shown.clone().map(hand)),
            Field::numbers("tip_radius", shown.clone().map(radius)),
            Field::numbers("device", shown.clone().map(|at| at as f64)),
        ],
        points: shown.map(|at| frame.tip(at)).collect(),
        cells: Cells::Points,
        facts: Vec::new(),
    }
}
