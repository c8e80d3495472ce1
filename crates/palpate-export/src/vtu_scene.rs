//! VTU files of a scene: objects, obstacles, contacts and devices, each with files of its own.

use crate::error::ExportError;
use crate::frame::Frame;
use crate::labels::{SceneLabels, obstacle_pose};
use crate::rigid_surface::{BoundingSphere, RigidSurface, obstacle_surface};
use crate::vtu::{Cells, Field, Grid, VtuSeries};
use glam::DVec3;
use palpate::{Collider, Input, Model, Pose, State};
use std::path::{Path, PathBuf};

/// File names of contacts and devices; names of parts have no dot.
const CONTACTS: &str = "scene.contacts";
const DEVICES: &str = "scene.devices";

/// Writer of a scene as a VTU series.
pub struct VtuScene {
    series: VtuSeries,
    obstacles: Vec<Obstacle>,
    frames: usize,
}

/// Obstacle with the pose and name of its last file.
struct Obstacle {
    surface: RigidSurface,
    drawn: Option<(Pose, String)>,
}

impl VtuScene {
    /// Creates the folder.
    pub fn new(
        folder: &Path,
        (model, labels): (&Model, &SceneLabels),
        state: &State,
        input: &Input,
    ) -> Result<Self, ExportError> {
        let bounds = BoundingSphere::of(model, state);
        let shapes = model.parameters().obstacles.iter().enumerate();
        let obstacles = shapes.map(|(at, obstacle)| Obstacle {
            surface: obstacle_surface(&obstacle.shape, obstacle_pose(model, input, at), bounds),
            drawn: None,
        });
        let obstacles = obstacles.collect();
        Ok(Self { series: VtuSeries::new(folder, "scene.pvd", &labels.inputs)?, obstacles, frames: 0 })
    }

    /// Writes a frame.
    pub fn write(&mut self, frame: &Frame) -> Result<(), ExportError> {
        let time = frame.output.time_s;
        for (object, recording) in frame.model.recordings().enumerate() {
            let pose = frame.output.objects[object].pose;
            let displacement = &frame.displacements[object];
            let surface = &recording.surface;
            let grid = deformed_surface(&surface.positions, &surface.triangles, displacement, pose);
            let name = self.series.write(&frame.labels.objects[object], self.frames, &grid)?;
            self.series.show(time, object, name);
        }
        let mut part = frame.displacements.len();
        for (at, obstacle) in self.obstacles.iter_mut().enumerate() {
            let pose = frame.obstacle(at);
            let name = match &obstacle.drawn {
                // An obstacle that has not moved keeps its file.
                Some((drawn, name)) if *drawn == pose => name.clone(),
                _ => {
                    let name = &frame.labels.obstacles[at];
                    self.series.write(name, self.frames, &placed(&obstacle.surface, pose))?
                }
            };
            obstacle.drawn = Some((pose, name.clone()));
            self.series.show(time, part, name);
            part += 1;
        }
        if frame.labels.can_touch {
            let name = self.series.write(CONTACTS, self.frames, &contacts(frame))?;
            self.series.show(time, part, name);
            part += 1;
        }
        if !frame.labels.devices.is_empty() {
            let name = self.series.write(DEVICES, self.frames, &devices(frame))?;
            self.series.show(time, part, name);
        }
        self.frames += 1;
        Ok(())
    }

    /// Renames all files; returns the path of the index.
    pub fn finish(self) -> Result<PathBuf, ExportError> {
        self.series.finish()
    }
}

/// Deformed surface of an object in the world, with displacements in world axes.
pub fn deformed_surface<'a>(
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

fn placed(surface: &RigidSurface, pose: Pose) -> Grid<'_> {
    Grid {
        points: surface.positions.iter().map(|p| pose.world_from_body(*p)).collect(),
        cells: Cells::Triangles(&surface.triangles),
        fields: Vec::new(),
        facts: Vec::new(),
    }
}

/// Contacts that carry force, with the force on the object and the parts between which they act.
fn contacts(frame: &Frame) -> Grid<'static> {
    let contacts = &frame.output.contacts;
    let objects = frame.displacements.len();
    // Part numbers as in the index: objects, obstacles, then devices.
    let part = |against: Collider| match against {
        Collider::Object(at) => at,
        Collider::Obstacle(at) => objects + at,
        Collider::Device(at) => objects + frame.labels.obstacles.len() + at,
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

/// Tips of the shown devices: force on the hand, hand relative to the tip, tip radius, device.
fn devices(frame: &Frame) -> Grid<'static> {
    let shown: Vec<usize> = (0..frame.labels.devices.len()).filter(|&at| frame.shows(at)).collect();
    let shown = shown.iter().copied();
    let hand = |at: usize| frame.input.devices[at].position - frame.tip(at);
    let radius = |at: usize| frame.model.parameters().devices[at].tip_radius;
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
