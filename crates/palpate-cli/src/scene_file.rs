//! Scene files: TOML in, model and devices out. Every error names the file and the line.

use crate::Failure;
use crate::path::DevicePath;
use glam::{DQuat, DVec3};
use palpate::{
    Grasp, Model, ModelObject, ModelParameters, MotionRule, ObjectStart, Pose, Recording, ResponseForm,
    RigidCompliance, Twist,
};
use palpate_fem::certificate::DOUBTFUL;
use palpate_store::{Location, TableStore};
use serde::de::Error;
use serde::{Deserialize, Deserializer};
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// A scene that is ready to run.
pub struct Scene {
    /// Objects and rules.
    pub model: Model,
    /// Names of the objects, in the model's order.
    pub object_names: Vec<String>,
    /// What each device does, in the model's order.
    pub devices: Vec<SceneDevice>,
    /// Things the user should know.
    pub remarks: Vec<String>,
    /// The files that the scene was read from.
    pub inputs: Vec<PathBuf>,
}

/// A device that holds a point and follows a path.
pub struct SceneDevice {
    /// Its name.
    pub name: String,
    /// What it holds.
    pub grasp: Grasp,
    /// Where it is over time.
    pub path: DevicePath,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct SceneFile {
    #[serde(default = "default_step")]
    step: Spanned<f64>,
    #[serde(default)]
    gravity: Numbers<3>,
    motion: Option<Spanned<String>>,
    rigid_compliance: Option<bool>,
    #[serde(default)]
    object: Vec<Spanned<ObjectEntry>>,
    #[serde(default)]
    device: Vec<Spanned<DeviceEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ObjectEntry {
    name: Spanned<String>,
    recording: Spanned<PathBuf>,
    response: Option<Spanned<String>>,
    table: Option<Spanned<PathBuf>>,
    #[serde(default)]
    position: Numbers<3>,
    #[serde(default = "identity")]
    orientation: Numbers<4>,
    #[serde(default)]
    velocity: Numbers<3>,
    #[serde(default)]
    angular_velocity: Numbers<3>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DeviceEntry {
    name: Spanned<String>,
    mode: Spanned<String>,
    attach: AttachEntry,
    path: PathEntry,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct AttachEntry {
    object: Spanned<String>,
    point: Spanned<Numbers<3>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PathEntry {
    file: Spanned<PathBuf>,
}

/// So many finite numbers.
#[derive(Clone, Copy)]
struct Numbers<const N: usize>([f64; N]);

impl<const N: usize> Default for Numbers<N> {
    fn default() -> Self {
        Self([0.0; N])
    }
}

impl<'de, const N: usize> Deserialize<'de> for Numbers<N> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let numbers: Vec<f64> = Vec::deserialize(deserializer)?;
        let array: [f64; N] = numbers.try_into().map_err(|numbers: Vec<f64>| {
            D::Error::custom(format!("{} numbers, expected {N}", numbers.len()))
        })?;
        if !array.iter().all(|number| number.abs() < LARGEST) {
            return Err(D::Error::custom(format!("{array:?}, expected finite numbers below {LARGEST:e}")));
        }
        Ok(Self(array))
    }
}

/// Lengths [m], velocities and accelerations beyond this are no scene's.
pub const LARGEST: f64 = 1e6;

fn default_step() -> Spanned<f64> {
    Spanned::new(0..0, ModelParameters::default().step_s)
}

fn identity() -> Numbers<4> {
    Numbers([1.0, 0.0, 0.0, 0.0])
}

/// How far from the surface a point to hold may be, as a share of the object's diagonal.
const OFF_SURFACE: f64 = 0.05;

/// A hand that starts farther than this share of the diagonal from its point gets a remark.
const FAR_START: f64 = 0.01;

/// The scene's text with its place, for errors.
struct Source<'a> {
    path: &'a Path,
    text: &'a str,
}

impl Source<'_> {
    fn fail<T>(&self, span: Range<usize>, what: impl std::fmt::Display) -> Result<T, Failure> {
        let line = 1 + self.text[..span.start.min(self.text.len())].matches('\n').count();
        Err(Failure(format!("{}: line {line}: {what}", self.path.display())))
    }

    fn relative(&self, file: &Path) -> PathBuf {
        self.path.parent().unwrap_or(Path::new("")).join(file)
    }
}

/// Read a scene file, its recordings and its paths.
pub fn read(path: &Path) -> Result<Scene, Failure> {
    let bytes = std::fs::read(path).map_err(|e| Failure::file("read the scene", path, &e))?;
    let Ok(text) = String::from_utf8(bytes) else {
        return Err(Failure(format!(
            "{}: it is not a text file; a scene is TOML (docs/scene.md)",
            path.display()
        )));
    };
    let source = Source { path, text: &text };
    let file: SceneFile = toml::from_str(&text).map_err(|e| {
        // Types in the user's words.
        let what = e.to_string().replace("expected f64", "expected a number");
        Failure(format!("{}: {}", path.display(), what.trim_end()))
    })?;
    if file.object.is_empty() {
        return source.fail(0..0, "the scene has no [[object]]");
    }
    let names =
        file.object.iter().map(|o| &o.get_ref().name).chain(file.device.iter().map(|d| &d.get_ref().name));
    check_names(&source, names)?;

    let step_s = *file.step.get_ref();
    let gravity = DVec3::from_array(file.gravity.0);
    let mut objects = Vec::new();
    for entry in &file.object {
        objects.push(read_object(&source, entry, step_s, gravity)?);
    }
    let object_names: Vec<String> = file.object.iter().map(|o| o.get_ref().name.get_ref().clone()).collect();
    let mut remarks = Vec::new();
    let mut devices = Vec::new();
    for entry in &file.device {
        devices.push(read_device(&source, entry.get_ref(), &objects, &object_names, &mut remarks)?);
    }
    check_grasps(&source, &file, &devices)?;
    remarks.extend(doubtful_recordings(&objects, &object_names));

    let motion = match file.motion.as_ref().map(|m| (m.get_ref().as_str(), m.span())) {
        None | Some(("exact", _)) => MotionRule::ExactHeld,
        Some(("paper", _)) => MotionRule::Paper,
        Some((other, span)) => {
            return source.fail(span, format!("motion is {other:?}, expected \"exact\" or \"paper\""));
        }
    };
    let rigid_compliance = if file.rigid_compliance.unwrap_or(true) {
        RigidCompliance::Included
    } else {
        RigidCompliance::Dropped
    };
    let parameters = ModelParameters { step_s, gravity, motion, rigid_compliance, devices: devices.len() };
    // Objects and gravity have been checked where they stand: what is left to be wrong is the step.
    let model = Model::new(parameters, objects).or_else(|e| source.fail(file.step.span(), e))?;
    let recordings = file.object.iter().map(|object| object.get_ref().recording.get_ref());
    let paths = file.device.iter().map(|device| device.get_ref().path.file.get_ref());
    let mut inputs = vec![path.to_path_buf()];
    inputs.extend(recordings.chain(paths).map(|file| source.relative(file)));
    Ok(Scene { model, object_names, devices, remarks, inputs })
}

/// Names stand in CSV headers: each once, and without separators.
fn check_names<'a>(source: &Source, names: impl Iterator<Item = &'a Spanned<String>>) -> Result<(), Failure> {
    let mut seen = std::collections::HashSet::new();
    for name in names {
        let text = name.get_ref();
        let plain = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        if text.is_empty() || !text.chars().all(plain) {
            return source.fail(name.span(), format!("name is {text:?}, expected letters, digits, - and _"));
        }
        if !seen.insert(text) || text == "energy" || text == "t" {
            return source.fail(name.span(), format!("the name {text:?} is taken already"));
        }
    }
    Ok(())
}

fn read_object(
    source: &Source,
    entry: &Spanned<ObjectEntry>,
    step_s: f64,
    gravity: DVec3,
) -> Result<ModelObject, Failure> {
    let object = entry.get_ref();
    let (recording, response) = read_responses(source, object)?;
    let [w, x, y, z] = object.orientation.0;
    let start = ObjectStart {
        pose: Pose {
            position: DVec3::from_array(object.position.0),
            orientation: DQuat::from_xyzw(x, y, z, w),
        },
        twist: Twist {
            linear: DVec3::from_array(object.velocity.0),
            angular: DVec3::from_array(object.angular_velocity.0),
        },
    };
    // Tried on its own, so that the line is that of this object; a bad step is told of elsewhere.
    let model_object = ModelObject { recording, response, start };
    let usual = ModelParameters::default();
    let step_s = if step_s > 0.0 && step_s <= 1.0 { step_s } else { usual.step_s };
    let parameters = ModelParameters { step_s, gravity, ..usual };
    if let Err(error) = Model::new(parameters, vec![model_object.clone()]) {
        let what = error.to_string().replacen("object 0: ", "", 1);
        return source.fail(object.name.span(), format!("object {:?}: {what}", object.name.get_ref()));
    }
    Ok(model_object)
}

/// The body and the form of its response: a recording file, a store of impulse responses, or both.
fn read_responses(source: &Source, object: &ObjectEntry) -> Result<(Arc<Recording>, ResponseForm), Failure> {
    let path = source.relative(object.recording.get_ref());
    let place = object.recording.span();
    let form = object.response.as_ref().map(|form| (form.get_ref().as_str(), form.span()));
    let fir = match form {
        None => path.is_dir(),
        Some(("modal", _)) if path.is_dir() => {
            return source.fail(
                place,
                "response = \"modal\" needs a recording file (.palp); this is a store of impulse responses",
            );
        }
        Some(("modal", _)) => false,
        Some(("fir", _)) => true,
        Some((other, span)) => {
            return source.fail(span, format!("response is {other:?}, expected \"modal\" or \"fir\""));
        }
    };
    if let (Some(table), false) = (&object.table, fir) {
        return source.fail(table.span(), "a table is used with response = \"fir\" only");
    }
    if !fir {
        let recording = crate::verbs::read_recording(&path).or_else(|e| source.fail(place, e))?;
        return Ok((Arc::new(recording), ResponseForm::Modal));
    }
    let (table, table_place) = match &object.table {
        Some(table) => (source.relative(table.get_ref()), table.span()),
        None if path.is_dir() => (path.clone(), place.clone()),
        None => (path.with_extension("zarr"), place.clone()),
    };
    if !table.exists() {
        return source.fail(
            table_place,
            format!(
                "response = \"fir\" needs a store of impulse responses, and there is no {}: make one with `palpate record … \
                 --dense`, and name it with table = \"…\"",
                table.display()
            ),
        );
    }
    let loaded = TableStore::open(&Location::Folder(table)).and_then(TableStore::load);
    let (body, table) = loaded.or_else(|e| source.fail(table_place.clone(), e))?;
    let recording = if path.is_dir() {
        body
    } else {
        let recording = crate::verbs::read_recording(&path).or_else(|e| source.fail(place, e))?;
        if recording.metadata.provenance.mesh_hash != body.metadata.provenance.mesh_hash {
            return source.fail(
                table_place,
                format!(
                    "the store is of another mesh ({}) than the recording ({})",
                    body.metadata.provenance.source, recording.metadata.provenance.source
                ),
            );
        }
        recording
    };
    Ok((Arc::new(recording), ResponseForm::Fir(Arc::new(table))))
}

fn read_device(
    source: &Source,
    device: &DeviceEntry,
    objects: &[ModelObject],
    object_names: &[String],
    remarks: &mut Vec<String>,
) -> Result<SceneDevice, Failure> {
    let name = device.name.get_ref().clone();
    if device.mode.get_ref() != "held" {
        let mode = device.mode.get_ref();
        return source.fail(device.mode.span(), format!("mode is {mode:?}, expected \"held\""));
    }
    let wanted = device.attach.object.get_ref();
    let Some(object) = object_names.iter().position(|name| name == wanted) else {
        let known = object_names.join(", ");
        return source.fail(
            device.attach.object.span(),
            format!("there is no object {wanted:?}; the scene has {known}"),
        );
    };
    let ModelObject { recording, response, start } = &objects[object];
    let point_span = device.attach.point.span();
    let point = DVec3::from_array(device.attach.point.get_ref().0);
    let nearest = recording.surface.nearest(point);
    let diagonal = recording.surface.diagonal();
    let allowed = OFF_SURFACE * diagonal;
    let grasp = match nearest {
        Some((point, distance)) if distance <= allowed => Grasp { object, point },
        Some((_, distance)) => {
            return source.fail(
                point_span,
                format!(
                    "the point {point} is {distance:.4} m from the surface of {wanted:?}, at most {allowed:.4} m are \
                     allowed; it is given in the body frame, whose origin is the centre of mass"
                ),
            );
        }
        None => return source.fail(point_span, format!("the object {wanted:?} has no surface")),
    };
    match response {
        ResponseForm::Modal if !recording.is_movable(&grasp.point) => {
            return source.fail(
                point_span,
                format!("the point of {name:?} lies on fixed nodes of {wanted:?}: no hand can move it"),
            );
        }
        ResponseForm::Modal => {}
        ResponseForm::Fir(table) => {
            if let Err(error) = table.prepare(&recording.surface, &grasp.point) {
                return source.fail(point_span, format!("device {name:?} on {wanted:?}: {error}"));
            }
        }
    }
    let file = &device.path.file;
    let path = match DevicePath::read(&source.relative(file.get_ref())) {
        Ok(path) => path,
        Err(failure) => return source.fail(file.span(), failure),
    };
    let first = path.at(0.0);
    let held = start.pose.world_from_body(recording.surface.rest_position(&grasp.point));
    let distance = (first - held).length();
    if distance > FAR_START * diagonal {
        remarks.push(format!(
            "device {name:?} starts {distance:.4} m from the point that it holds: the point is pulled there in the \
             first step"
        ));
    }
    Ok(SceneDevice { name, grasp, path })
}

/// No two devices may hold the same point: where they differ no force could satisfy both.
fn check_grasps(source: &Source, file: &SceneFile, devices: &[SceneDevice]) -> Result<(), Failure> {
    for (at, device) in devices.iter().enumerate() {
        if let Some(other) = devices[..at].iter().find(|other| other.grasp == device.grasp) {
            let point = &file.device[at].get_ref().attach.point;
            return source.fail(
                point.span(),
                format!("device {:?} holds the same point as {:?}", device.name, other.name),
            );
        }
    }
    Ok(())
}

/// Recordings whose own certificate says that their forces can't be trusted.
fn doubtful_recordings<'a>(
    objects: &'a [ModelObject],
    names: &'a [String],
) -> impl Iterator<Item = String> + 'a {
    objects.iter().zip(names).filter_map(move |(object, name)| {
        let certificate = object.recording.metadata.certificate.as_ref()?;
        let error = certificate.force_error_max;
        (error > DOUBTFUL).then(|| {
            format!(
                "even in a smooth press at one place the force of {name:?} is off by up to {:.0} % (certificate of its \
                 recording): record it with more modes",
                100.0 * error
            )
        })
    })
}
