//! Scenes for the viewer: built-in ones, scene files, and meshes that a page sends.
//!
//! A scene is its text, whoever made it: what a page changes is changed in the text, and the text is read as any other.

mod built_in;
mod pointers;
mod recipe;

use crate::Failure;
use crate::logs::{LogSeries, LoggedScene};
use crate::scene_file::{self, Pace, RealDevice, Scene};
use crate::verbs::inspect::certificate_lines;
use crate::verbs::read_recording;
use crate::verbs::run::{attach, attach_real};
pub use built_in::{BUILT_IN, paper_cube};
use palpate::{Damping, DeviceMode, Recording, Support};
use palpate_fem::element::Order;
use palpate_fem::progress::Progress;
use palpate_viewer::{
    MaterialDescription, ObjectDescription, PhysicsSettings, ProgressCallback, SceneDescription,
    SceneProvider, SceneSummary, Upload, ViewerDevice, ViewerScene,
};
pub use recipe::{Recipe, cache_folder};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tempfile::TempDir;
use toml::{Table, Value};

/// Updates of a device on this machine per second.
const DEVICE_HZ: f64 = 1000.0;

/// Makes scenes for the viewer.
pub struct Stages {
    /// Where built-in recordings are kept.
    cache: PathBuf,
    /// Paths and meshes while the viewer is served; and the cache where there is no other.
    folder: TempDir,
    /// Where what happens is logged, if it is.
    logs: Option<Arc<LogSeries>>,
    current: Mutex<Current>,
}

/// The scene that was made last.
#[derive(Clone, Default)]
struct Current {
    id: Option<String>,
    title: String,
    about: String,
    /// The file that the text stands for.
    path: PathBuf,
    text: Table,
    /// How recordings are made, by the files that they lie in.
    recipes: HashMap<PathBuf, Recipe>,
    uploads: usize,
}

impl Stages {
    /// With recordings kept in a folder, or the user's cache; and with logs, if there are to be some.
    pub fn new(cache: Option<&Path>, logs: Option<Arc<LogSeries>>) -> Result<Self, Failure> {
        let folder =
            TempDir::new().map_err(|e| Failure(format!("cannot make a folder for the viewer: {e}")))?;
        let cache = cache_folder(cache).unwrap_or_else(|| folder.path().to_path_buf());
        Ok(Self { cache, folder, logs, current: Mutex::default() })
    }

    /// A scene file.
    pub fn open_file(&self, path: &Path) -> Result<ViewerScene, Failure> {
        let text = scene_file::read_file(path, path)?;
        let title = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let current = Current {
            title,
            about: "Press and drag what you see.".into(),
            path: path.to_path_buf(),
            ..Current::default()
        };
        let (stage, told) = self.made(current, text)?;
        told.iter().for_each(|line| crate::tell(line));
        Ok(stage)
    }

    fn lock(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Read a scene's text, with pointers if it names none, and keep it as the current one.
    fn make(&self, current: Current, text: String) -> Result<ViewerScene, Failure> {
        self.made(current, text).map(|(stage, _)| stage)
    }

    /// The same, with what its author should know.
    fn made(&self, mut current: Current, text: String) -> Result<(ViewerScene, Vec<String>), Failure> {
        let given = text.clone();
        let (scene, text) =
            scene_file::read_changed(&current.path, text, Pace::RealTime, pointers::with_pointers)?;
        current.text = text.parse().map_err(|e| Failure(format!("{}: {e}", current.path.display())))?;
        // Nobody has chosen the size of fingers that were added.
        let added = |device: &&scene_file::SceneDevice| device.pointer && text != given;
        let of_added: Vec<String> =
            scene.devices.iter().filter(added).map(|device| format!("device {:?} ", device.name)).collect();
        let remarks =
            scene.remarks.iter().filter(|remark| !of_added.iter().any(|own| remark.starts_with(own)));
        let mut told: Vec<String> = remarks.map(|remark| format!("warning: {remark}")).collect();
        told.extend_from_slice(&scene.choices);
        let stage = self.stage(&mut current, scene, text)?;
        *self.lock() = current;
        Ok((stage, told))
    }

    fn stage(&self, current: &mut Current, scene: Scene, text: String) -> Result<ViewerScene, Failure> {
        let objects = current.text.get("object").and_then(Value::as_array).cloned().unwrap_or_default();
        let files = objects.iter().map(|object| {
            let file = object.get("recording").and_then(Value::as_str).unwrap_or_default();
            current.path.parent().unwrap_or(Path::new("")).join(file)
        });
        let files: Vec<PathBuf> = files.collect();
        let titles = (current.id.clone(), current.title.clone(), current.about.clone());
        let description = describe(&scene, titles, |at, recording| {
            let Some(file) = files.get(at) else { return false };
            if let Some(recipe) = recipe_of(recording) {
                current.recipes.entry(file.clone()).or_insert(recipe);
            }
            current.recipes.contains_key(file)
        });
        let logged = LoggedScene::new(&scene, Some(text));
        let log = self.logs.as_ref().map(|logs| logs.opener(logged)).transpose()?;
        Ok(ViewerScene {
            description,
            model: scene.model.clone(),
            devices: scene.devices.iter().map(stage_device).collect(),
            movers: scene
                .obstacles
                .iter()
                .map(|obstacle| {
                    let obstacle = obstacle.clone();
                    Arc::new(move |t: f64| obstacle.at(t)) as palpate_viewer::SharedTrajectory
                })
                .collect(),
            log,
        })
    }

    fn open_built_in(&self, id: &str, tell: ProgressCallback) -> Result<ViewerScene, Failure> {
        let Some(scene) = BUILT_IN.iter().find(|scene| scene.id == id) else {
            let known = BUILT_IN.map(|scene| scene.id).join(", ");
            return Err(Failure(format!("there is no scene {id:?}; there are {known}")));
        };
        let folder = self.folder.path().join(scene.id);
        std::fs::create_dir_all(&folder).map_err(|e| Failure::file("make the folder", &folder, &e))?;
        for (name, at) in scene.paths {
            let path = folder.join(name);
            let text = built_in::path_text(*at, scene.beat_s);
            std::fs::write(&path, text).map_err(|e| Failure::file("write the path", &path, &e))?;
        }
        let mut text: Table =
            scene.text.parse().map_err(|e| Failure(format!("the built-in scene {id}: {e}")))?;
        let mut recipes = HashMap::new();
        for object in text.get_mut("object").and_then(Value::as_array_mut).into_iter().flatten() {
            let name =
                object.get("recording").and_then(Value::as_str).and_then(|name| name.strip_prefix('@'));
            let Some(recipe) = name.and_then(built_in::recipe) else { continue };
            let path = recipe.recorded_in(&self.cache, &mut Telling::new(tell))?;
            set(object, "recording", path.display().to_string());
            recipes.insert(path, recipe);
        }
        let current = Current {
            id: Some(scene.id.into()),
            title: scene.title.into(),
            about: scene.about.into(),
            path: folder.join("scene.toml"),
            recipes,
            ..Current::default()
        };
        self.make(current, text.to_string())
    }

    fn change_rules(&self, rules: &PhysicsSettings) -> Result<ViewerScene, Failure> {
        let mut current = self.lock().clone();
        let text = &mut current.text;
        if let Some(gravity) = rules.gravity {
            text.insert("gravity".into(), Value::Array(gravity.map(Value::Float).to_vec()));
        }
        if let Some(step) = rules.step {
            if !(200e-6..=10e-3).contains(&step) {
                return Err(Failure(format!("the step is {step} s, expected 0.0002 s to 0.01 s")));
            }
            text.insert("step".into(), Value::Float(step));
        }
        if let Some(friction) = rules.friction {
            for kind in ["object", "plane", "obstacle", "device"] {
                let entries = text.get_mut(kind).and_then(Value::as_array_mut).into_iter().flatten();
                let touches = |entry: &Value| entry.get("mode").and_then(Value::as_str) != Some("held");
                entries.filter(|entry| touches(entry)).for_each(|entry| set(entry, "friction", friction));
            }
        }
        if let Some(coupling) = rules.coupling {
            let gains = Table::from_iter([
                ("stiffness".to_string(), Value::Float(coupling.stiffness)),
                ("damping".to_string(), Value::Float(coupling.damping)),
            ]);
            let devices = text.get_mut("device").and_then(Value::as_array_mut).into_iter().flatten();
            let pointer = |device: &Value| device.get("pointer").and_then(Value::as_bool) == Some(true);
            devices
                .filter(|device| pointer(device))
                .for_each(|device| set(device, "coupling", gains.clone()));
        }
        let text = current.text.to_string();
        self.make(current, text)
    }

    fn record_again(
        &self,
        object: usize,
        material: MaterialDescription,
        tell: ProgressCallback,
    ) -> Result<ViewerScene, Failure> {
        let mut current = self.lock().clone();
        let entry = current.text.get_mut("object").and_then(|objects| objects.get_mut(object));
        let Some(entry) = entry else { return Err(Failure(format!("there is no object {object}"))) };
        let file = entry.get("recording").and_then(Value::as_str).unwrap_or_default();
        let file = current.path.parent().unwrap_or(Path::new("")).join(file);
        let Some(recipe) = current.recipes.get(&file) else {
            return Err(Failure(
                "this object was recorded from a file, of which only the recording is here: record it again with palpate record"
                    .into(),
            ));
        };
        let recipe = Recipe { material, ..recipe.clone() };
        let folder = self.folder.path().join("materials");
        std::fs::create_dir_all(&folder).map_err(|e| Failure::file("make the folder", &folder, &e))?;
        let path = recipe.recorded_in(&folder, &mut Telling::new(tell))?;
        set(entry, "recording", path.display().to_string());
        current.recipes.insert(path, recipe);
        let text = current.text.to_string();
        self.make(current, text)
    }

    fn record_upload(&self, upload: Upload, tell: ProgressCallback) -> Result<ViewerScene, Failure> {
        let Upload { name, bytes, scale, material, modes } = upload;
        let file = Path::new(&name).file_name().filter(|name| !name.is_empty());
        let Some(file) = file else { return Err(Failure("the mesh file has no name".into())) };
        let kind = Path::new(file).extension().map(|kind| kind.to_string_lossy().to_lowercase());
        if matches!(kind.as_deref(), Some("obj" | "stl")) {
            return Err(Failure(format!(
                "{name} is a surface, and has no inside that could deform: give tetrahedra (.msh of Gmsh, .vtk), as Gmsh, \
                 TetGen or fTetWild make them of it"
            )));
        }
        let number = {
            let mut current = self.lock();
            current.uploads += 1;
            current.uploads
        };
        let folder = self.folder.path().join(format!("upload-{number}"));
        std::fs::create_dir_all(&folder).map_err(|e| Failure::file("make the folder", &folder, &e))?;
        let source = folder.join(file);
        std::fs::write(&source, &bytes).map_err(|e| Failure::file("keep the mesh", &source, &e))?;
        let recipe = Recipe {
            source: source.display().to_string(),
            scale,
            material,
            order: Order::Quadratic,
            modes,
            damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        };
        // Whoever sent it knows its name, and not the folder that it lies in.
        let named = |failure: Failure| Failure(failure.0.replace(&format!("{}/", folder.display()), ""));
        let path = recipe.recorded_in(&folder, &mut Telling::new(tell)).map_err(named)?;
        let recording = read_recording(&path)?;
        let lowest = recording.surface.positions.iter().map(|place| place.y).fold(f64::INFINITY, f64::min);
        let height = recording.surface.diagonal() * 0.1 - lowest;
        let text = format!(
            "gravity = [0.0, -9.81, 0.0]\n[[object]]\nname = \"object\"\nrecording = {:?}\nposition = [0.0, {height:?}, 0.0]\n\
             [[plane]]\nname = \"floor\"\npoint = [0.0, 0.0, 0.0]\nnormal = [0.0, 1.0, 0.0]\nfriction = 1.0\n",
            path.display().to_string(),
        );
        let uploads = self.lock().uploads;
        let current = Current {
            id: None,
            title: file.to_string_lossy().into_owned(),
            about: "Your own mesh. Press and drag it.".into(),
            path: folder.join("scene.toml"),
            text: Table::new(),
            recipes: HashMap::from([(path, recipe)]),
            uploads,
        };
        self.make(current, text)
    }
}

impl SceneProvider for Stages {
    fn titles(&self) -> Vec<SceneSummary> {
        let title = |scene: &built_in::BuiltIn| SceneSummary {
            id: scene.id.into(),
            title: scene.title.into(),
            about: scene.about.into(),
        };
        BUILT_IN.iter().map(title).collect()
    }

    fn open(&self, id: &str, tell: ProgressCallback) -> Result<ViewerScene, String> {
        self.open_built_in(id, tell).map_err(|failure| failure.0)
    }

    fn change(&self, rules: &PhysicsSettings) -> Result<ViewerScene, String> {
        self.change_rules(rules).map_err(|failure| failure.0)
    }

    fn change_material(
        &self,
        object: usize,
        material: MaterialDescription,
        tell: ProgressCallback,
    ) -> Result<ViewerScene, String> {
        self.record_again(object, material, tell).map_err(|failure| failure.0)
    }

    fn record(&self, upload: Upload, tell: ProgressCallback) -> Result<ViewerScene, String> {
        self.record_upload(upload, tell).map_err(|failure| failure.0)
    }
}

/// A scene as pages are told of it: its id, title and what there is to do; and whether an object, by its number, can be
/// recorded again.
pub fn describe(
    scene: &Scene,
    titles: (Option<String>, String, String),
    mut recordable: impl FnMut(usize, &Recording) -> bool,
) -> SceneDescription {
    let recordings = scene.model.recordings().enumerate().zip(&scene.object_names);
    let objects = recordings.map(|((at, recording), name)| {
        ObjectDescription::new(name, recording, certificate_lines(recording), recordable(at, recording))
    });
    let objects = objects.collect();
    let device = |device: &scene_file::SceneDevice| (device.name.clone(), device.pointer);
    let devices: Vec<(String, bool)> = scene.devices.iter().map(device).collect();
    SceneDescription::new(titles, &scene.model, objects, &scene.names().obstacles, &devices)
}

/// Set a key of a table.
fn set(entry: &mut Value, key: &str, value: impl Into<Value>) {
    if let Some(table) = entry.as_table_mut() {
        table.insert(key.into(), value.into());
    }
}

/// How a primitive of one material was recorded.
fn recipe_of(recording: &Recording) -> Option<Recipe> {
    let metadata = &recording.metadata;
    let source = &metadata.provenance.source;
    let primitive = source.starts_with("box:") || source.starts_with("sphere:");
    let [material] = metadata.materials.as_slice() else { return None };
    (primitive && metadata.support == Support::Free).then(|| Recipe {
        source: source.clone(),
        scale: 1.0,
        material: MaterialDescription {
            young: material.young_pa,
            poisson: material.poisson,
            density: material.density_kg_m3,
        },
        order: if metadata.mesh.order == 1 { Order::Linear } else { Order::Quadratic },
        modes: recording.modes.len(),
        damping: metadata.damping,
    })
}

fn stage_device(device: &scene_file::SceneDevice) -> ViewerDevice {
    match (&device.real, &device.path) {
        (Some(real), _) => {
            let (real, mode): (RealDevice, DeviceMode) = (real.clone(), device.mode);
            ViewerDevice::Here(Arc::new(move || {
                attach_real(&real, mode, DEVICE_HZ, false).map_err(|failure| failure.0)
            }))
        }
        (None, Some(path)) => match device.simulated {
            None => ViewerDevice::Following(path.clone(), device.mode),
            simulated => {
                let (path, mode) = (path.clone(), device.mode);
                ViewerDevice::Here(Arc::new(move || {
                    Ok(attach(path.clone(), simulated, mode, DEVICE_HZ, false))
                }))
            }
        },
        (None, None) => ViewerDevice::Pointer,
    }
}

/// Progress of a recording as a page is told.
struct Telling<'a, 'b> {
    tell: &'a mut (dyn FnMut(&str, Option<f64>) + Send + 'b),
    stage: String,
    total: u64,
    done: u64,
    /// Hundredths that were told.
    told: u64,
}

impl<'a, 'b> Telling<'a, 'b> {
    fn new(tell: &'a mut (dyn FnMut(&str, Option<f64>) + Send + 'b)) -> Self {
        Self { tell, stage: String::new(), total: 0, done: 0, told: 0 }
    }
}

impl Progress for Telling<'_, '_> {
    fn begin(&mut self, stage: &str, total: u64) {
        (self.stage, self.total, self.done, self.told) = (stage.into(), total, 0, 0);
        (self.tell)(stage, (total > 0).then_some(0.0));
    }

    fn advance(&mut self, units: u64) {
        self.done += units;
        let share = self.done as f64 / self.total.max(1) as f64;
        let hundredths = (100.0 * share) as u64;
        if hundredths > self.told {
            self.told = hundredths;
            (self.tell)(&self.stage, Some(share.min(1.0)));
        }
    }

    fn remark(&mut self, _text: &str) {}
}
