//! Scene files: TOML in, model, devices and obstacles out. Every error has the file and the line.

mod clamps;
mod coupling;
mod devices;
mod drivers;
mod edited_text;
mod entries;
mod keys;
mod objects;
mod obstacles;
mod places;
mod source;
mod tables;

use crate::error::{SceneError, SceneErrorKind};
use crate::files::read_regular_file;
use crate::initial_checks::check_start;
use crate::object_bounds::ObjectBounds;
use crate::scene::Scene;
pub(crate) use edited_text::EditedText;
use entries::{ReadError, read_file_text};
use glam::DVec3;
use keys::{Gravity, SceneFile};
use palpate::{Model, ModelObject, ModelParameters, ResponseForm, RigidCompliance, RigidIntegrator, Support};
use palpate_haptics::{Columns, MotionPath};
use source::{DeviceMover, Source};
pub use source::{PartsInMemory, Relocated, read_path};
use std::collections::HashSet;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// Upper bound of contact points of an object: their coupling takes 9·n² numbers, a gigabyte here.
const MAX_CONTACT_POINTS: i64 = 4096;

/// Ranges of the contact samples of an object on an obstacle, and of the budget of the contact solver.
const CONTACT_SAMPLES: RangeInclusive<i64> = 8..=1_000_000;
const SOLVER_BUDGET: RangeInclusive<i64> = 1000..=i64::MAX;

/// Purpose of a scene, which decides defaults.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RunMode {
    /// To compare with: every surface node is a contact, and no object sleeps.
    Reference,
    /// Steps without a deadline.
    Offline,
    /// Steps with a deadline: a budget of the solver.
    RealTime,
}

/// Reads a scene file with its recordings, meshes and paths.
///
/// # Errors
/// When a file cannot be read, or a value is refused; with the line in the scene file.
pub fn read_scene(path: &Path, mode: RunMode) -> Result<Scene, SceneError> {
    let (text, parts, relocated) = (read_text(path, path)?, PartsInMemory::default(), Relocated::new());
    let source =
        Source { path, text: &text, relocated: &relocated, parts: &parts, mover: DeviceMover::Nobody };
    read_source(&source, mode)
}

/// Reads a scene some of whose files have other paths than the scene says, as those unpacked from a log. Devices without a path are where the
/// caller says, as the log does.
///
/// # Errors
/// As [`read_scene`].
pub fn read_relocated_scene(path: &Path, relocated: &Relocated, mode: RunMode) -> Result<Scene, SceneError> {
    let text = read_text(path, relocated.get(path).map_or(path, PathBuf::as_path))?;
    let parts = PartsInMemory::default();
    let source = Source { path, text: &text, relocated, parts: &parts, mover: DeviceMover::Caller };
    read_source(&source, mode)
}

/// Reads a scene of bytes that are in no file, as a pipe has them: `name` stands for the file in errors, and files that the scene names are
/// looked for beside it.
///
/// # Errors
/// As [`read_scene`].
pub fn read_piped_scene(name: &Path, bytes: &[u8], mode: RunMode) -> Result<Scene, SceneError> {
    let text = text_of(name, bytes.to_vec())?;
    let (relocated, parts) = (Relocated::new(), PartsInMemory::default());
    let source =
        Source { path: name, text: &text, relocated: &relocated, parts: &parts, mover: DeviceMover::Nobody };
    read_source(&source, mode)
}

/// Reads a scene from a text, for a program that may move its devices: one without a path is where the program says in every step, or
/// exerts the force that it says. Files are looked for beside `path`, which errors name, unless they are in memory.
///
/// # Errors
/// As [`read_scene`].
pub fn read_scene_text(
    path: &Path,
    text: &str,
    parts: &PartsInMemory,
    mode: RunMode,
) -> Result<Scene, SceneError> {
    let relocated = Relocated::new();
    read_source(&Source { path, text, relocated: &relocated, parts, mover: DeviceMover::Caller }, mode)
}

/// Reads a scene file for a program that may move its devices, as [`read_scene_text`] does a text.
///
/// # Errors
/// As [`read_scene`].
pub fn read_driven_scene(path: &Path, mode: RunMode) -> Result<Scene, SceneError> {
    read_scene_text(path, &read_text(path, path)?, &PartsInMemory::default(), mode)
}

fn read_source(source: &Source, mode: RunMode) -> Result<Scene, SceneError> {
    let file = parse(source)?;
    let objects = read_objects(source, &file)?;
    assemble(source, &file, objects, mode)
}

/// Reads the text of a scene file that is stored at `stored`.
pub(crate) fn read_text(path: &Path, stored: &Path) -> Result<String, SceneError> {
    let bytes = read_regular_file(stored).map_err(|error| SceneError::io("read the scene", path, &error))?;
    text_of(path, bytes)
}

/// Text of the bytes of a scene file.
pub(crate) fn text_of(path: &Path, bytes: Vec<u8>) -> Result<String, SceneError> {
    String::from_utf8(bytes).map_err(|_| {
        let message = "it is not a text file; a scene is TOML (docs/scene.md)";
        SceneError::of_file(SceneErrorKind::Syntax, path, message)
    })
}

/// Reads a scene from a text, which `change` may replace when the objects are known; returns the scene and its text. Errors have the lines of the
/// text before.
///
/// `change` must leave the objects as they are: recordings take long to read, and are read once.
pub(crate) fn read_edited_scene(
    path: &Path,
    text: String,
    parts: &PartsInMemory,
    mode: RunMode,
    change: impl FnOnce(&str, &[ModelObject]) -> Option<EditedText>,
) -> Result<(Scene, String), SceneError> {
    let relocated = Relocated::new();
    let source = Source { path, text: &text, relocated: &relocated, parts, mover: DeviceMover::Nobody };
    let file = parse(&source)?;
    let objects = read_objects(&source, &file)?;
    let Some(changed) = change(&text, &objects) else {
        return Ok((assemble(&source, &file, objects, mode)?, text));
    };
    let source = Source { text: &changed.text, ..source };
    // Whoever reads an error looks into the file.
    let in_file = |error: SceneError| {
        let line = error.line.map(|line| changed.line_before(line));
        SceneError { line, ..error }
    };
    let scene = parse(&source).and_then(|file| assemble(&source, &file, objects, mode)).map_err(in_file)?;
    Ok((scene, changed.text))
}

fn parse(source: &Source) -> Result<SceneFile, SceneError> {
    let file: SceneFile = read_file_text(source.text).map_err(|error| syntax_error(source, *error))?;
    if file.object.is_empty() {
        return source.fail(0..0, SceneErrorKind::Missing, "object", "the scene has no [[object]]");
    }
    check_names(source, &file)?;
    Ok(file)
}

/// Error of the parser, which shows the place.
fn syntax_error(source: &Source, ReadError { message, span, key }: ReadError) -> SceneError {
    let line = span.as_ref().map(|span| source.line_of(span));
    let text = match span {
        Some(span) => format!("{}{message}", source.marked_line(&span)),
        None => message,
    };
    SceneError { line, key, ..SceneError::of_file(SceneErrorKind::Syntax, source.path, text) }
}

fn read_objects(source: &Source, file: &SceneFile) -> Result<Vec<ModelObject>, SceneError> {
    file.object.iter().map(|entry| objects::read_object(source, entry)).collect()
}

/// Scene of a file whose objects are read.
fn assemble(
    source: &Source,
    file: &SceneFile,
    objects: Vec<ModelObject>,
    mode: RunMode,
) -> Result<Scene, SceneError> {
    let (mut warnings, mut choices) = (Vec::new(), Vec::new());
    let object_names: Vec<String> = file.object.iter().map(|o| o.name.get_ref().clone()).collect();
    let mut parameters = read_parameters(source, file, mode)?;
    let gravity = read_gravity(source, file, &objects, &object_names, &mut parameters)?;
    for entry in &file.device {
        let mut device = devices::read_parameters(source, entry)?;
        let step_s = parameters.step_s;
        if let Some((coupling, line)) =
            coupling::choose_default(source, entry, &device, step_s, &objects, &object_names)?
        {
            device.coupling = Some(coupling);
            choices.push(line);
        }
        parameters.devices.push(device);
    }
    let mut obstacles = Vec::new();
    for (number, entry) in file.plane.iter().enumerate() {
        let (obstacle, placed) = obstacles::read_plane(source, entry, number)?;
        parameters.obstacles.push(obstacle);
        obstacles.push(placed);
    }
    for (number, entry) in file.obstacle.iter().enumerate() {
        let (obstacle, placed) = obstacles::read_obstacle(source, entry, number, &mut warnings)?;
        parameters.obstacles.push(obstacle);
        obstacles.push(placed);
    }
    let base = |(entry, object): (_, &ModelObject)| {
        objects::read_base_path(source, entry, (&object.recording, &object.response))
    };
    let bases = file.object.iter().zip(&objects).map(base).collect::<Result<_, _>>()?;
    let mut placed_clamps = Vec::new();
    for entry in &file.clamp {
        let (clamp, placed) = clamps::read_clamp(source, entry, &objects, &object_names)?;
        parameters.clamps.push(clamp);
        placed_clamps.push(placed);
    }
    let model = build(source, file, parameters, objects.clone())?;
    let mut devices = Vec::new();
    for (entry, parameters) in file.device.iter().zip(&model.parameters().devices) {
        let read = devices::read_device(source, entry, *parameters, &objects, &object_names, &mut warnings);
        devices.push(read?);
    }
    devices::check_grasps(source, &file.device, &devices)?;
    #[cfg(feature = "native")]
    let probes = {
        let probe = |entry| places::read_probe(source, entry, &objects, &object_names);
        file.probe.iter().map(probe).collect::<Result<_, _>>()?
    };
    warnings.extend(objects::doubtful_recordings(&objects, &object_names));
    warnings.extend(tables::short_tables(&objects, &object_names));
    let inputs = inputs(source, file);
    let nodes = objects.iter().flat_map(|ModelObject { recording, start, .. }| {
        recording.surface.positions.iter().map(|x| start.pose.world_from_body(*x))
    });
    let object_bounds = ObjectBounds::of(nodes);
    let mut scene = Scene {
        model: Arc::new(model),
        object_names,
        devices,
        obstacles,
        clamps: placed_clamps,
        bases,
        #[cfg(feature = "native")]
        probes,
        gravity,
        object_bounds,
        warnings,
        choices,
        inputs,
    };
    #[cfg(feature = "native")]
    if scene.can_touch() || !scene.clamps.is_empty() {
        scene.warnings.extend(tables::prepare_tables(source, &file.object, &objects)?);
    }
    devices::prepare(source, &file.device, &scene)?;
    scene.warnings.extend(check_start(&scene, &objects));
    Ok(scene)
}

/// Checks names: unique, and without the separators of CSV files.
fn check_names(source: &Source, file: &SceneFile) -> Result<(), SceneError> {
    let own = |name: &Spanned<String>| (name.get_ref().clone(), name.span());
    // Without a name: the line of its table.
    let or = |name: &Option<Spanned<String>>, kind: &str, number: usize, entry: Range<usize>| {
        let span = name.as_ref().map_or(entry, Spanned::span);
        (obstacles::name_or(name.as_ref(), kind, number), span)
    };
    let objects = file.object.iter().map(|entry| own(&entry.name));
    let devices = file.device.iter().map(|entry| own(&entry.name));
    let probes = file.probe.iter().map(|entry| own(&entry.name));
    let clamps = file.clamp.iter().map(|entry| own(&entry.name));
    let planes = file.plane.iter().enumerate();
    let planes = planes.map(|(number, entry)| or(&entry.get_ref().name, "plane", number, entry.span()));
    let others = file.obstacle.iter().enumerate();
    let others = others.map(|(number, entry)| or(&entry.get_ref().name, "obstacle", number, entry.span()));
    let mut seen = HashSet::new();
    for (name, span) in objects.chain(devices).chain(probes).chain(clamps).chain(planes).chain(others) {
        let plain = |c: char| c.is_alphanumeric() || c == '_' || c == '-';
        if name.is_empty() || !name.chars().all(plain) {
            return source.fail(
                span,
                SceneErrorKind::Name,
                "name",
                format!("name is {name:?}, expected letters, digits, - and _"),
            );
        }
        if name == "energy" || name == "t" || !seen.insert(name.clone()) {
            return source.fail(
                span,
                SceneErrorKind::Name,
                "name",
                format!("the name {name:?} is taken already"),
            );
        }
    }
    Ok(())
}

/// Parameters of the whole scene, without devices and obstacles.
fn read_parameters(source: &Source, file: &SceneFile, mode: RunMode) -> Result<ModelParameters, SceneError> {
    let usual = match mode {
        RunMode::Reference => ModelParameters::for_reference(),
        RunMode::Offline => ModelParameters::default(),
        RunMode::RealTime => ModelParameters::for_real_time(),
    };
    let integrators = [("exact", RigidIntegrator::ExactHold), ("paper", RigidIntegrator::Paper)];
    let motion = source.word("integrator", file.integrator.as_ref(), integrators)?;
    let rigid_compliance = if file.rigid_compliance.unwrap_or(true) {
        RigidCompliance::Included
    } else {
        RigidCompliance::Dropped
    };
    let count = |key: &str, given: &Option<Spanned<i64>>, allowed: RangeInclusive<i64>| {
        let Some(given) = given else { return Ok(None) };
        let (count, span) = (*given.get_ref(), given.span());
        if allowed.contains(&count) {
            return Ok(Some(count as u64));
        }
        let (least, most) = (allowed.start(), allowed.end());
        source.fail(
            span,
            SceneErrorKind::OutOfRange,
            key,
            format!("{key} is {count}, expected {least} to {most}"),
        )
    };
    let allowed = 1..=MAX_CONTACT_POINTS;
    let max_contact_points = count("max_contact_points", &file.max_contact_points, allowed)?;
    let max_contact_samples = count("max_contact_samples", &file.max_contact_samples, CONTACT_SAMPLES)?;
    let solver_budget = count("solver_budget", &file.solver_budget, SOLVER_BUDGET)?;
    let step_s = file.step.as_ref().map_or(usual.step_s, |step| *step.get_ref());
    let sleep_after_s = match &file.sleep_after {
        Some(given) if given.get_ref().is_nan() || *given.get_ref() <= 0.0 => {
            return source.fail(
                given.span(),
                SceneErrorKind::OutOfRange,
                "sleep_after",
                format!("sleep_after is {} s, expected a positive number; inf for never", given.get_ref()),
            );
        }
        given => given.as_ref().map_or(usual.sleep_after_s, |given| *given.get_ref()),
    };
    Ok(ModelParameters {
        step_s,
        motion,
        rigid_compliance,
        max_contact_points: max_contact_points.map_or(usual.max_contact_points, |count| count as usize),
        max_contact_samples: max_contact_samples.map_or(usual.max_contact_samples, |count| count as usize),
        solver_budget: solver_budget.unwrap_or(usual.solver_budget),
        sleep_after_s,
        ..usual
    })
}

/// Reads gravity into the parameters; gives its course in time, if it has one.
fn read_gravity(
    source: &Source,
    file: &SceneFile,
    objects: &[ModelObject],
    names: &[String],
    parameters: &mut ModelParameters,
) -> Result<Option<MotionPath>, SceneError> {
    let entry = match &file.gravity {
        None => return Ok(None),
        Some(Gravity::Constant(gravity)) => {
            parameters.gravity = DVec3::from_array(gravity.0);
            return Ok(None);
        }
        Some(Gravity::Changing(entry)) => entry,
    };
    let gravity = source.motion_path(entry, Columns::Position)?;
    parameters.gravity = gravity.at(0.0).position;
    let sags_by_table = |object: &ModelObject| {
        let is_fixed = object.recording.metadata.support == Support::Fixed;
        is_fixed && !matches!(object.response, ResponseForm::Modal)
    };
    if let Some(at) = objects.iter().position(sags_by_table) {
        let message = format!(
            "gravity changes, but the table of {:?}, which has fixed nodes, tells how it sags under a constant one: use \
             response = \"modal\" there",
            names[at]
        );
        return source.fail(entry.file.span(), SceneErrorKind::Conflict, "gravity", message);
    }
    Ok(Some(gravity))
}

/// Builds the model; an error gets the line of the object that it names.
fn build(
    source: &Source,
    file: &SceneFile,
    parameters: ModelParameters,
    objects: Vec<ModelObject>,
) -> Result<Model, SceneError> {
    Model::new(parameters, objects).or_else(|error| {
        let text = error.to_string();
        for (at, object) in file.object.iter().enumerate() {
            // The runtime numbers objects, the scene names them.
            if let Some(what) = text.strip_prefix(&format!("object {at}: ")) {
                let message = format!("object {:?}: {what}", object.name.get_ref());
                return source.fail(object.name.span(), SceneErrorKind::Model, "object", message);
            }
        }
        // Devices, obstacles and gravity are checked with their lines: what is left is the step.
        source.fail(file.step.as_ref().map_or(0..0, Spanned::span), SceneErrorKind::Model, "step", text)
    })
}

/// Files that a scene names, as it names them.
///
/// # Errors
/// When the text is no scene.
pub fn named_files(text: &str) -> Result<Vec<PathBuf>, SceneError> {
    let (relocated, parts) = (Relocated::new(), PartsInMemory::default());
    let source = Source {
        path: Path::new(""),
        text,
        relocated: &relocated,
        parts: &parts,
        mover: DeviceMover::Caller,
    };
    let file = parse(&source)?;
    Ok(inputs(&source, &file).split_off(1))
}

/// Files that a scene is read from, the scene file first.
fn inputs(source: &Source, file: &SceneFile) -> Vec<PathBuf> {
    let recordings = file.object.iter().map(|object| &object.recording);
    let paths = file.device.iter().filter_map(|device| Some(&device.path.as_ref()?.file));
    let obstacles = file.obstacle.iter().map(Spanned::get_ref);
    let meshes = obstacles.clone().filter_map(|obstacle| Some(&obstacle.mesh.as_ref()?.file));
    let moves = obstacles.filter_map(|obstacle| Some(&obstacle.path.as_ref()?.file));
    let planes = file.plane.iter().filter_map(|plane| Some(&plane.get_ref().path.as_ref()?.file));
    let clamps = file.clamp.iter().filter_map(|clamp| Some(&clamp.path.as_ref()?.file));
    let bases = file.object.iter().filter_map(|object| Some(&object.path.as_ref()?.file));
    let gravity = match &file.gravity {
        Some(Gravity::Changing(entry)) => Some(&entry.file),
        Some(Gravity::Constant(_)) | None => None,
    };
    let files = recordings
        .chain(paths)
        .chain(planes)
        .chain(clamps)
        .chain(bases)
        .chain(meshes)
        .chain(moves)
        .chain(gravity);
    let mut inputs = vec![source.path.to_path_buf()];
    inputs.extend(files.map(|file| source.named_path(file.get_ref())));
    inputs
}
