//! Scene files: TOML in, model, devices and obstacles out. Every error names the file and the line.

mod coupling;
mod devices;
mod drivers;
mod entries;
mod objects;
mod obstacles;
mod place;

use crate::Failure;
pub use devices::{known_device, known_grip};
pub use drivers::{RealDevice, STRONGEST_N, known_driver};
use entries::SceneFile;
use glam::DVec3;
use palpate::{
    DeviceInput, DeviceMode, DeviceParameters, Input, Model, ModelObject, ModelParameters, Pose,
    RigidCompliance, RigidIntegrator,
};
use palpate_haptics::MotionPath;
use palpate_haptics::device::{Hand, Traits};
use palpate_haptics::log::Names;
use place::Source;
pub use place::{Carried, read_path};
use std::collections::HashSet;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// A scene that is ready to run.
pub struct Scene {
    /// Objects and rules.
    pub model: Arc<Model>,
    /// Names of the objects, in the model's order.
    pub object_names: Vec<String>,
    /// What each device does, in the model's order.
    pub devices: Vec<SceneDevice>,
    /// Where each plane and obstacle is, in the model's order.
    pub obstacles: Vec<SceneObstacle>,
    /// Things the user should know.
    pub remarks: Vec<String>,
    /// What was chosen for the user.
    pub choices: Vec<String>,
    /// The files that the scene was read from.
    pub inputs: Vec<PathBuf>,
}

/// A device: it follows a path, or is a real one, or in another process.
pub struct SceneDevice {
    /// Its name.
    pub name: String,
    /// What it holds, or that it touches.
    pub mode: DeviceMode,
    /// What it is.
    pub parameters: DeviceParameters,
    /// Where it is over time; with a simulated hand, where that wants to be. None for a real device, and for one in another
    /// process.
    pub path: Option<MotionPath>,
    /// The device and the hand that follow the path as far as forces let them.
    pub simulated: Option<(Traits, Hand)>,
    /// The real device that it is.
    pub real: Option<RealDevice>,
    /// Whether it is a pointer of the viewer's page.
    pub pointer: bool,
}

/// A plane or an obstacle.
#[derive(Clone)]
pub struct SceneObstacle {
    /// Its name.
    pub name: String,
    /// Where it is over time, if it moves.
    pub path: Option<MotionPath>,
    /// Where it is without a path, and how it is turned when the path does not say.
    pub start: Pose,
}

/// Lengths [m], velocities and accelerations beyond this are no scene's.
pub const LARGEST: f64 = 1e6;

/// An object's contact points answer one another: 9·n² numbers, here a gigabyte.
const MOST_CONTACT_POINTS: i64 = 4096;

/// Places at which an object may meet an obstacle, at most; and so many where steps must be done in time.
const PLACES: RangeInclusive<i64> = 8..=1_000_000;
const REALTIME_PLACES: usize = 48;

impl SceneDevice {
    /// Where its path is at a time [s]; at the origin without one.
    pub fn at(&self, t: f64) -> DVec3 {
        self.path.as_ref().map_or(DVec3::ZERO, |path| path.at(t).position)
    }
}

impl SceneObstacle {
    /// Where it is at a time [s].
    pub fn at(&self, t: f64) -> Pose {
        match &self.path {
            None => self.start,
            Some(path) if path.turns() => path.at(t),
            Some(path) => Pose { position: path.at(t).position, ..self.start },
        }
    }
}

impl Scene {
    /// The names of all parts, as a log keeps them.
    pub fn names(&self) -> Names {
        Names {
            objects: self.object_names.clone(),
            devices: self.devices.iter().map(|device| device.name.clone()).collect(),
            obstacles: self.obstacles.iter().map(|obstacle| obstacle.name.clone()).collect(),
        }
    }

    /// Where all paths are at a time [s].
    pub fn input_at(&self, time: f64) -> Input {
        let devices = self.devices.iter();
        let devices = devices.map(|device| DeviceInput { position: device.at(time), mode: device.mode });
        Input {
            devices: devices.collect(),
            obstacles: self.obstacles.iter().map(|obstacle| obstacle.at(time)).collect(),
        }
    }

    /// Whether anything but held points can act on its objects.
    pub fn has_touch(&self) -> bool {
        let touching = self.devices.iter().any(|device| device.mode == DeviceMode::Touch);
        touching || !self.obstacles.is_empty() || self.object_names.len() > 1
    }
}

/// What a scene is read for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Pace {
    /// As exact as it can be, however long that takes.
    Offline,
    /// Steps that are done in time.
    RealTime,
}

/// Read a scene file, its recordings, meshes and paths.
pub fn read(path: &Path, pace: Pace) -> Result<Scene, Failure> {
    read_carried(path, &Carried::new(), pace)
}

/// The same where files are carried along, and lie elsewhere than the scene says.
pub fn read_carried(path: &Path, carried: &Carried, pace: Pace) -> Result<Scene, Failure> {
    let place = carried.get(path).map_or(path, PathBuf::as_path);
    let text = read_file(path, place)?;
    let source = Source { path, text: &text, carried };
    let file = parse(&source)?;
    let objects = read_objects(&source, &file)?;
    put_together(&source, &file, objects, pace)
}

/// The text of a scene file that lies at a place.
pub fn read_file(path: &Path, place: &Path) -> Result<String, Failure> {
    let bytes = std::fs::read(place).map_err(|e| Failure::file("read the scene", path, &e))?;
    String::from_utf8(bytes).map_err(|_| {
        Failure(format!("{}: it is not a text file; a scene is TOML (docs/scene.md)", path.display()))
    })
}

/// Read a text that stands for a scene file, and may be changed when its objects are known, but for these; gives the text that
/// the scene is of. Recordings take long to read, and are read once.
pub fn read_changed(
    path: &Path,
    text: String,
    pace: Pace,
    change: impl FnOnce(&str, &[ModelObject]) -> Option<String>,
) -> Result<(Scene, String), Failure> {
    let carried = Carried::new();
    let source = Source { path, text: &text, carried: &carried };
    let file = parse(&source)?;
    let objects = read_objects(&source, &file)?;
    let Some(changed) = change(&text, &objects) else {
        return Ok((put_together(&source, &file, objects, pace)?, text));
    };
    let source = Source { text: &changed, ..source };
    Ok((put_together(&source, &parse(&source)?, objects, pace)?, changed))
}

fn parse(source: &Source) -> Result<SceneFile, Failure> {
    let file: SceneFile = toml::from_str(source.text).map_err(|e| {
        // Types in the user's words.
        let what = e
            .to_string()
            .replace("expected f64", "expected a number")
            .replace("expected i64", "expected a whole number");
        Failure(format!("{}: {}", source.path.display(), what.trim_end()))
    })?;
    if file.object.is_empty() {
        return source.fail(0..0, "the scene has no [[object]]");
    }
    check_names(source, &file)?;
    Ok(file)
}

fn read_objects(source: &Source, file: &SceneFile) -> Result<Vec<ModelObject>, Failure> {
    file.object.iter().map(|entry| objects::read_object(source, entry)).collect()
}

/// The scene of a file whose objects are read.
fn put_together(
    source: &Source,
    file: &SceneFile,
    objects: Vec<ModelObject>,
    pace: Pace,
) -> Result<Scene, Failure> {
    let (mut remarks, mut choices) = (Vec::new(), Vec::new());
    let object_names: Vec<String> = file.object.iter().map(|o| o.name.get_ref().clone()).collect();
    let mut parameters = read_rules(source, file, pace)?;
    for entry in &file.device {
        let mut device = devices::read_parameters(source, entry)?;
        let step_s = parameters.step_s;
        if let Some((coupling, line)) =
            coupling::choose(source, entry, &device, step_s, &objects, &object_names)?
        {
            device.coupling = Some(coupling);
            choices.push(line);
        }
        parameters.devices.push(device);
    }
    let mut obstacles = Vec::new();
    for (number, entry) in file.plane.iter().enumerate() {
        let (obstacle, placed) = obstacles::read_plane(source, entry.get_ref(), number)?;
        parameters.obstacles.push(obstacle);
        obstacles.push(placed);
    }
    for (number, entry) in file.obstacle.iter().enumerate() {
        let (obstacle, placed) = obstacles::read_obstacle(source, entry, number, &mut remarks)?;
        parameters.obstacles.push(obstacle);
        obstacles.push(placed);
    }
    let model = build(source, file, parameters, objects.clone())?;
    let mut devices = Vec::new();
    for (entry, parameters) in file.device.iter().zip(&model.parameters().devices) {
        let read = devices::read_device(source, entry, *parameters, &objects, &object_names, &mut remarks);
        devices.push(read?);
    }
    devices::check_grasps(source, &file.device, &devices)?;
    remarks.extend(objects::doubtful_recordings(&objects, &object_names));
    let nothing_meets: Vec<String> = objects::tables_that_meet_nothing(&objects, &object_names).collect();
    let inputs = inputs(source, file);
    let mut scene =
        Scene { model: Arc::new(model), object_names, devices, obstacles, remarks, choices, inputs };
    if scene.has_touch() {
        scene.remarks.extend(nothing_meets);
    }
    Ok(scene)
}

/// Names stand in CSV files: each once, and without separators.
fn check_names(source: &Source, file: &SceneFile) -> Result<(), Failure> {
    let own = |name: &Spanned<String>| (name.get_ref().clone(), name.span());
    // One without a name is told of at its first line.
    let or = |name: &Option<Spanned<String>>, kind: &str, number: usize, entry: Range<usize>| {
        let place = name.as_ref().map_or(entry, Spanned::span);
        (obstacles::name_or(name.as_ref(), kind, number), place)
    };
    let objects = file.object.iter().map(|entry| own(&entry.name));
    let devices = file.device.iter().map(|entry| own(&entry.name));
    let planes = file.plane.iter().enumerate();
    let planes = planes.map(|(number, entry)| or(&entry.get_ref().name, "plane", number, entry.span()));
    let others = file.obstacle.iter().enumerate();
    let others = others.map(|(number, entry)| or(&entry.get_ref().name, "obstacle", number, entry.span()));
    let mut seen = HashSet::new();
    for (name, place) in objects.chain(devices).chain(planes).chain(others) {
        let plain = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            return source.fail(place, format!("name is {name:?}, expected letters, digits, - and _"));
        }
        if name == "energy" || name == "t" || !seen.insert(name.clone()) {
            return source.fail(place, format!("the name {name:?} is taken already"));
        }
    }
    Ok(())
}

/// What holds for the whole scene, without its devices and obstacles.
fn read_rules(source: &Source, file: &SceneFile, pace: Pace) -> Result<ModelParameters, Failure> {
    let usual = ModelParameters::default();
    let motion = match file.motion.as_ref().map(|m| (m.get_ref().as_str(), m.span())) {
        None | Some(("exact", _)) => RigidIntegrator::ExactHold,
        Some(("paper", _)) => RigidIntegrator::Paper,
        Some((other, span)) => {
            return source.fail(span, format!("motion is {other:?}, expected \"exact\" or \"paper\""));
        }
    };
    let rigid_compliance = if file.rigid_compliance.unwrap_or(true) {
        RigidCompliance::Included
    } else {
        RigidCompliance::Dropped
    };
    let count = |name: &str, given: &Option<Spanned<i64>>, usual: usize, allowed: RangeInclusive<i64>| {
        let Some(given) = given else { return Ok(usual) };
        let (count, span) = (*given.get_ref(), given.span());
        if allowed.contains(&count) {
            return Ok(count as usize);
        }
        let (least, most) = (allowed.start(), allowed.end());
        source.fail(span, format!("{name} is {count}, expected {least} to {most}"))
    };
    let usual_places = match pace {
        Pace::Offline => usual.max_contact_samples,
        Pace::RealTime => REALTIME_PLACES,
    };
    let allowed = 1..=MOST_CONTACT_POINTS;
    let max_contact_points =
        count("max_contact_points", &file.max_contact_points, usual.max_contact_points, allowed)?;
    let max_contact_samples = count("max_contact_samples", &file.max_contact_samples, usual_places, PLACES)?;
    let step_s = file.step.as_ref().map_or(usual.step_s, |step| *step.get_ref());
    let gravity = DVec3::from_array(file.gravity.0);
    Ok(ModelParameters {
        step_s,
        gravity,
        motion,
        rigid_compliance,
        max_contact_points,
        max_contact_samples,
        ..usual
    })
}

/// Build the model; what it refuses is told of where it stands.
fn build(
    source: &Source,
    file: &SceneFile,
    parameters: ModelParameters,
    objects: Vec<ModelObject>,
) -> Result<Model, Failure> {
    Model::new(parameters, objects).or_else(|error| {
        let text = error.to_string();
        for (at, object) in file.object.iter().enumerate() {
            // The runtime counts objects, the scene names them.
            if let Some(what) = text.strip_prefix(&format!("object {at}: ")) {
                return source
                    .fail(object.name.span(), format!("object {:?}: {what}", object.name.get_ref()));
            }
        }
        // Devices, obstacles and gravity have been checked where they stand: what is left to be wrong is the step.
        source.fail(file.step.as_ref().map_or(0..0, Spanned::span), text)
    })
}

/// The files that a scene is read from.
fn inputs(source: &Source, file: &SceneFile) -> Vec<PathBuf> {
    let recordings = file.object.iter().map(|object| &object.recording);
    let paths = file.device.iter().filter_map(|device| Some(&device.path.as_ref()?.file));
    let obstacles = file.obstacle.iter().map(Spanned::get_ref);
    let meshes = obstacles.clone().filter_map(|obstacle| Some(&obstacle.mesh.as_ref()?.file));
    let moves = obstacles.filter_map(|obstacle| Some(&obstacle.path.as_ref()?.file));
    let files = recordings.chain(paths).chain(meshes).chain(moves);
    let mut inputs = vec![source.path.to_path_buf()];
    inputs.extend(files.map(|file| source.beside(file.get_ref())));
    inputs
}
