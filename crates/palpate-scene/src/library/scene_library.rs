//! Library of scenes for interactive use: built-in scenes, scene files, and uploaded meshes, with changes of their settings.
//!
//! A scene is represented by its text: a change edits the text, which is read as any scene file.

use super::built_in::{self, BUILT_IN_SCENES, BuiltInScene};
use super::falling::falling_scene;
use super::mesh_upload::{MeshUpload, UPLOAD_DAMPING};
use super::settings::{SettingsChange, set};
use super::touchable::{TouchableScene, read_touchable_scene};
use crate::error::{SceneError, SceneErrorKind};
use crate::file::{PartsInMemory, read_text};
use crate::recipe::{RecordingRecipe, cache_folder};
use crate::recording_file::read_recording;
use crate::scene::Scene;
use palpate::Material;
use palpate_export::{TemporaryFolder, write_atomically};
use palpate_fem::{ElementOrder, Progress};
use palpate_mesh::read_regular_file;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};
use toml::{Table, Value};

/// Library of scenes; changes apply to the scene that was opened last.
pub struct SceneLibrary {
    /// Cache folder of built-in recordings.
    cache: PathBuf,
    /// Temporary folder for paths and meshes, and the cache where there is no other.
    folder: TemporaryFolder,
    current: Mutex<Current>,
}

/// Scene that was opened, with what a program shows of it.
pub struct OpenedScene {
    /// Scene.
    pub scene: Scene,
    /// Its text, with added pointers.
    pub text: String,
    /// Identifier of a built-in scene.
    pub id: Option<String>,
    /// Title.
    pub title: String,
    /// Description, with what one can do.
    pub about: String,
    /// Whether an object can be recorded again with another material, by object.
    pub recordable: Vec<bool>,
}

/// Scene that was opened last.
#[derive(Clone, Default)]
struct Current {
    id: Option<String>,
    title: String,
    about: String,
    /// File that the text stands for.
    path: PathBuf,
    text: Table,
    /// Recipes, by the files of the recordings.
    recipes: HashMap<PathBuf, RecordingRecipe>,
    uploads: usize,
}

impl Current {
    /// Adds recipes of recordings that state them; returns whether there is one, by object.
    fn add_recipes(&mut self, scene: &Scene) -> Vec<bool> {
        let objects = self.text.get("object").and_then(Value::as_array).cloned().unwrap_or_default();
        let folder = self.path.parent().unwrap_or(Path::new("")).to_path_buf();
        let file =
            |object: &Value| folder.join(object.get("recording").and_then(Value::as_str).unwrap_or_default());
        let recordings = scene.model.recordings().zip(objects.iter().map(file));
        let has_recipe = recordings.map(|(recording, file)| {
            if let Some(recipe) = RecordingRecipe::of(recording) {
                self.recipes.entry(file.clone()).or_insert(recipe);
            }
            self.recipes.contains_key(&file)
        });
        has_recipe.collect()
    }
}

impl SceneLibrary {
    /// Library with a cache folder of recordings; without one, the user's.
    ///
    /// # Errors
    /// When there is no temporary folder.
    pub fn new(cache: Option<&Path>) -> Result<Self, SceneError> {
        let folder = TemporaryFolder::new().map_err(|error| {
            SceneError::new(SceneErrorKind::Io, format!("cannot make a folder for the viewer: {error}"))
        })?;
        let cache = cache_folder(cache).unwrap_or_else(|| folder.path().to_path_buf());
        Ok(Self { cache, folder, current: Mutex::default() })
    }

    /// Opens a scene file.
    ///
    /// # Errors
    /// As [`read_scene`](crate::read_scene).
    pub fn open_file(&self, path: &Path) -> Result<OpenedScene, SceneError> {
        let text = read_text(path, path)?;
        let title = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        let current = Current {
            title,
            about: "Press and drag what you see.".into(),
            path: path.to_path_buf(),
            ..Current::default()
        };
        self.open_text(current, text)
    }

    fn lock(&self) -> MutexGuard<'_, Current> {
        self.current.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Reads the text of a scene, adds pointers if it has none, and makes it the current scene.
    fn open_text(&self, mut current: Current, text: String) -> Result<OpenedScene, SceneError> {
        let TouchableScene { scene, text, .. } =
            read_touchable_scene(&current.path, text, &PartsInMemory::default())?;
        current.text = text.parse().map_err(|error| {
            SceneError::of_file(SceneErrorKind::Syntax, &current.path, format!("{error}"))
        })?;
        let recordable = current.add_recipes(&scene);
        let opened = OpenedScene {
            id: current.id.clone(),
            title: current.title.clone(),
            about: current.about.clone(),
            scene,
            text,
            recordable,
        };
        *self.lock() = current;
        Ok(opened)
    }

    /// Opens a built-in scene; records its objects when they are not in the cache.
    ///
    /// # Errors
    /// When there is no such scene, or an object cannot be recorded.
    pub fn open_built_in(&self, id: &str, progress: &mut dyn Progress) -> Result<OpenedScene, SceneError> {
        let scene = built_in_scene(id)?;
        let folder = self.folder.path().join(scene.id);
        make_folder(&folder)?;
        write_paths(&scene, &folder)?;
        let mut text: Table = scene.text.parse().map_err(|error| {
            SceneError::new(SceneErrorKind::Syntax, format!("the built-in scene {id}: {error}"))
        })?;
        let mut recipes = HashMap::new();
        for object in text.get_mut("object").and_then(Value::as_array_mut).into_iter().flatten() {
            let name =
                object.get("recording").and_then(Value::as_str).and_then(|name| name.strip_prefix('@'));
            let Some(recipe) = name.and_then(built_in::recipe) else { continue };
            let path = recipe.record_cached(&self.cache, progress)?;
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
        self.open_text(current, text.to_string())
    }

    /// Writes a built-in scene to a folder: `scene.toml` with its recordings, which are compact and have at most `modes` modes, and its paths.
    ///
    /// # Errors
    /// When there is no such scene, an object cannot be recorded, or a file cannot be written.
    pub fn write_built_in(
        &self,
        id: &str,
        modes: usize,
        folder: &Path,
        progress: &mut dyn Progress,
    ) -> Result<(), SceneError> {
        let scene = built_in_scene(id)?;
        make_folder(folder)?;
        write_paths(&scene, folder)?;
        let mut text = scene.text.trim_start().to_string();
        for name in built_in::recipe_names(scene.text) {
            let Some(small) = built_in::small_recipe(name, modes) else { continue };
            let recorded = small.record_cached(&self.cache, progress)?;
            let bytes =
                read_regular_file(&recorded).map_err(|error| SceneError::io("read", &recorded, &error))?;
            write_atomically(&folder.join(format!("{name}.palp")), &bytes)?;
            text = text.replace(&format!("\"@{name}\""), &format!("\"{name}.palp\""));
        }
        write_atomically(&folder.join("scene.toml"), format!("# {}\n{text}", scene.title).as_bytes())?;
        Ok(())
    }

    /// Changes settings of the scene that was opened last.
    ///
    /// # Errors
    /// When a value is out of its range.
    pub fn change_settings(&self, change: &SettingsChange) -> Result<OpenedScene, SceneError> {
        let mut current = self.lock().clone();
        change.apply(&mut current.text)?;
        let text = current.text.to_string();
        self.open_text(current, text)
    }

    /// Records an object of the scene that was opened last with another material.
    ///
    /// # Errors
    /// When its mesh is not known, or it cannot be recorded.
    pub fn change_material(
        &self,
        object: usize,
        material: Material,
        progress: &mut dyn Progress,
    ) -> Result<OpenedScene, SceneError> {
        let mut current = self.lock().clone();
        let entry = current.text.get_mut("object").and_then(|objects| objects.get_mut(object));
        let Some(entry) = entry else {
            let message = format!("there is no object {object}");
            return Err(SceneError::new(SceneErrorKind::UnknownValue, message));
        };
        let file = entry.get("recording").and_then(Value::as_str).unwrap_or_default();
        let file = current.path.parent().unwrap_or(Path::new("")).join(file);
        let Some(recipe) = current.recipes.get(&file) else {
            return Err(SceneError::new(
                SceneErrorKind::Missing,
                "this object was recorded from a file, of which only the recording is here: record it again with palpate record",
            ));
        };
        let recipe = RecordingRecipe { material, ..recipe.clone() };
        let folder = self.folder.path().join("materials");
        make_folder(&folder)?;
        let path = recipe.record_cached(&folder, progress)?;
        set(entry, "recording", path.display().to_string());
        current.recipes.insert(path, recipe);
        let text = current.text.to_string();
        self.open_text(current, text)
    }

    /// Records an uploaded mesh, and opens a scene in which it falls on a floor.
    ///
    /// # Errors
    /// When it is no mesh of solid elements nor a closed surface, or cannot be recorded.
    pub fn record_upload(
        &self,
        upload: MeshUpload,
        progress: &mut dyn Progress,
    ) -> Result<OpenedScene, SceneError> {
        let refused = |message: String| SceneError::new(SceneErrorKind::Mesh, message);
        let MeshUpload { name, bytes, scale, meshing, material, modes } = upload;
        let file = Path::new(&name).file_name().filter(|name| !name.is_empty());
        let Some(file) = file else { return Err(refused("the mesh file has no name".into())) };
        let number = {
            let mut current = self.lock();
            current.uploads += 1;
            current.uploads
        };
        let folder = self.folder.path().join(format!("upload-{number}"));
        make_folder(&folder)?;
        let source = folder.join(file);
        std::fs::write(&source, &bytes).map_err(|error| SceneError::io("keep the mesh", &source, &error))?;
        let path = source.display().to_string();
        let recipe = RecordingRecipe {
            scale,
            meshing,
            ..RecordingRecipe::new(path, material, ElementOrder::Quadratic, modes, UPLOAD_DAMPING)
        };
        // The sender knows the name of the file, not its folder.
        let without_folder = |error: SceneError| {
            let message = error.message.replace(&format!("{}/", folder.display()), "");
            SceneError { message, ..error }
        };
        // Repairs are told where the scene is described.
        let mesh = recipe.mesh(progress);
        let checked = mesh.and_then(|mesh| mesh.checked().map_err(|error| recipe.refused(error)));
        let mesh = checked.map_err(&without_folder)?;
        let repairs = mesh.warnings.clone();
        let recorded = recipe.record_mesh(mesh, progress).map_err(without_folder)?;
        let path = recipe.store(&recorded, &folder)?;
        let recording = read_recording(&path)?;
        let text = falling_scene(&recording, &path.display().to_string());
        let uploads = self.lock().uploads;
        let current = Current {
            id: None,
            title: file.to_string_lossy().into_owned(),
            about: [&["Your own mesh. Press and drag it.".to_owned()], repairs.as_slice()]
                .concat()
                .join(" Note: "),
            path: folder.join("scene.toml"),
            text: Table::new(),
            recipes: HashMap::from([(path, recipe)]),
            uploads,
        };
        self.open_text(current, text)
    }
}

fn built_in_scene(id: &str) -> Result<BuiltInScene, SceneError> {
    BUILT_IN_SCENES.into_iter().find(|scene| scene.id == id).ok_or_else(|| {
        let known = BUILT_IN_SCENES.map(|scene| scene.id).join(", ");
        let message = format!("there is no scene {id:?}; there are {known}");
        SceneError::new(SceneErrorKind::UnknownValue, message)
    })
}

/// Writes the paths of a built-in scene as files.
fn write_paths(scene: &BuiltInScene, folder: &Path) -> Result<(), SceneError> {
    for (name, at) in scene.paths {
        let text = built_in::path_text(*at, scene.period_s);
        write_atomically(&folder.join(name), text.as_bytes())?;
    }
    Ok(())
}

fn make_folder(folder: &Path) -> Result<(), SceneError> {
    std::fs::create_dir_all(folder).map_err(|error| SceneError::io("make the folder", folder, &error))
}
