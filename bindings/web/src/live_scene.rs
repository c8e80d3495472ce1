//! Live scene of the viewer's page, run in a worker of the page.

use palpate::Recording;
use palpate_haptics::InputRecord;
use palpate_haptics::device::Reading;
use palpate_scene::{PartsInMemory, SettingsChange, TouchableScene, read_touchable_scene};
use palpate_viewer::{
    DevicePlace, LocalRequest, LocalScene, MaterialDescription, PageMessage, PhysicsSettings, SceneSummary,
    ViewerDevice, ViewerScene, describe_scene,
};
use std::path::Path;
use std::sync::Arc;
use toml::{Table, Value};

/// Receiver of messages to the page.
pub type Send<'a> = &'a mut dyn FnMut(PageMessage);

/// Identity of a scene on the page.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Titles {
    /// Identifier, by which the page opens it.
    pub id: Option<String>,
    /// Title.
    pub title: String,
    /// One line of description.
    pub about: String,
}

/// Text of a scene with its parts: changes edit the text.
#[derive(Clone)]
struct SceneText {
    titles: Titles,
    text: String,
    parts: PartsInMemory,
    /// Changes of materials, in their order.
    rescaled: Vec<Rescaled>,
    /// Names of added pointers, about whose size nobody is warned.
    added: Vec<String>,
}

impl SceneText {
    fn new(titles: Titles, text: String, parts: PartsInMemory) -> Self {
        Self { titles, text, parts, rescaled: Vec::new(), added: Vec::new() }
    }
}

/// Recording of another material, made of the recording of a name [Pa, kg/m³].
#[derive(Debug, Clone, PartialEq)]
pub struct Rescaled {
    /// Name of the new recording.
    pub name: String,
    /// Name of the recording that it was made of, maybe the same.
    pub of: String,
    /// Young's modulus [Pa].
    pub young: f64,
    /// Density [kg/m³].
    pub density: f64,
}

/// Live scene, with the text that it was made of.
pub struct LiveScene {
    local: LocalScene,
    current: SceneText,
    /// Scene of the record.
    recorded: Option<SceneText>,
    /// Last force on the haptic device [N, device frame].
    force: [f64; 3],
}

/// Record of a run: the scene, and the inputs of its steps.
pub struct RecordedRun {
    /// Text of the scene, with added pointers.
    pub text: String,
    /// Changes of materials since the scene was opened, in their order.
    pub rescaled: Vec<Rescaled>,
    /// Initial states and inputs.
    pub inputs: InputRecord,
}

impl LiveScene {
    /// Starts a scene.
    ///
    /// # Errors
    /// Text, when the scene cannot be read, or needs a device of a machine.
    pub fn open(titles: Titles, text: String, parts: PartsInMemory) -> Result<Self, String> {
        let (scene, current) = read(SceneText::new(titles, text, parts))?;
        Ok(Self {
            local: LocalScene::new(scene).map_err(|error| error.to_string())?,
            current,
            recorded: None,
            force: [0.0; 3],
        })
    }

    /// Starts another scene in place of this one; on an error this one goes on.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn replace(
        &mut self,
        titles: Titles,
        text: String,
        parts: PartsInMemory,
        send: Send,
    ) -> Result<(), String> {
        self.start(read(SceneText::new(titles, text, parts))?, false, send)
    }

    /// Sends the first messages to the page. `scenes` can be opened.
    pub fn greet(&mut self, scenes: Vec<SceneSummary>, send: Send) {
        self.local.greet(scenes, send);
    }

    /// Receives a message of the page; returns the id of a scene to open, whose files the caller fetches.
    ///
    /// # Errors
    /// Text for the page, when a change is refused; the scene goes on.
    pub fn receive(&mut self, text: &str, send: Send) -> Result<Option<String>, String> {
        match self.local.receive(text, send) {
            None => Ok(None),
            Some(LocalRequest::Open(id)) => Ok(Some(id)),
            Some(LocalRequest::ChangePhysics(settings)) => {
                let mut changed = self.current.clone();
                changed.text = edited(&changed.text, |table| {
                    settings_change(settings).apply(table).map_err(|error| error.to_string())
                })?;
                self.change(changed, true, send).map(|()| None)
            }
            Some(LocalRequest::ChangeMaterial(object, material)) => {
                let changed = self.with_material(object, material)?;
                self.change(changed, false, send).map(|()| None)
            }
        }
    }

    /// Begins a record for a log, at a start of the scene.
    ///
    /// # Errors
    /// Text, when the scene cannot be started.
    pub fn begin_record(&mut self, send: Send) -> Result<(), String> {
        self.local.begin_record(send).map_err(|error| error.to_string())?;
        self.recorded = Some(self.current.clone());
        Ok(())
    }

    /// Ends the record, if one was begun.
    pub fn end_record(&mut self) -> Option<RecordedRun> {
        let SceneText { text, rescaled, .. } = self.recorded.take()?;
        Some(RecordedRun { text, rescaled, inputs: self.local.end_record()? })
    }

    /// Attaches a haptic device in place of a pointer, until a scene starts; returns its index, or none where the scene has no free one.
    pub fn attach_device(&mut self, place: DevicePlace) -> Option<usize> {
        self.local.attach_device(place)
    }

    /// Detaches the haptic device.
    pub fn detach_device(&mut self) {
        self.local.detach_device();
    }

    /// Update of the haptic device with its newest reading, or none if it gives none: returns the force to command [N, device frame],
    /// zero where no device is attached.
    pub fn exchange(&mut self, reading: Option<Reading>, now_s: f64) -> &[f64; 3] {
        self.force = self.local.exchange(reading, now_s).unwrap_or_default().to_array();
        &self.force
    }

    /// Makes the steps that are due; `now_s` reads the clock [s].
    pub fn advance(&mut self, now_s: &dyn Fn() -> f64, send: Send) {
        self.local.advance(now_s, send);
    }

    /// Time of the next deadline [s].
    pub fn deadline_s(&self) -> f64 {
        self.local.deadline_s()
    }

    /// Encoded data of a path, as `scene/1/object/0/surface`.
    pub fn static_data(&self, path: &str) -> Option<Vec<u8>> {
        self.local.static_data(path)
    }

    /// Starts the scene again with a changed text.
    fn change(&mut self, text: SceneText, resumes: bool, send: Send) -> Result<(), String> {
        let (scene, current) = read(text)?;
        self.start((scene.changed_from(self.local.scene()), current), resumes, send)
    }

    fn start(
        &mut self,
        (scene, current): (ViewerScene, SceneText),
        resumes: bool,
        send: Send,
    ) -> Result<(), String> {
        self.local.start(scene, resumes, send).map_err(|error| error.to_string())?;
        self.current = current;
        Ok(())
    }

    /// Scene with another material of an object: its recording, rescaled.
    fn with_material(&self, object: usize, material: MaterialDescription) -> Result<SceneText, String> {
        let recording = self.local.scene().model.recordings().nth(object);
        let recording = recording.ok_or_else(|| format!("there is no object {object}"))?;
        let MaterialDescription { young, poisson, density } = material;
        let recorded = recording.metadata.materials.first().map_or(poisson, |material| material.poisson);
        if (poisson - recorded).abs() > 1e-9 {
            return Err(format!(
                "here Young's modulus and density can be changed; Poisson's ratio stays {recorded}: another one needs a recording \
                 (palpate serve, or palpate record)"
            ));
        }
        let rescaled = recording.rescaled(young, density).map_err(|error| error.to_string())?;
        let mut changed = self.current.clone();
        // One name, so that the recording of the former material goes.
        let name = format!("object-{object}.palp");
        let mut of = String::new();
        changed.text = edited(&changed.text, |table| {
            let entry = table.get_mut("object").and_then(|objects| objects.get_mut(object));
            let entry = entry.and_then(Value::as_table_mut).ok_or("the scene has no such object")?;
            let before = entry.insert("recording".into(), Value::String(name.clone()));
            of = before.and_then(|before| before.as_str().map(str::to_string)).unwrap_or_default();
            Ok(())
        })?;
        changed.rescaled.push(Rescaled { name: name.clone(), of, young, density });
        changed.parts.recordings.insert(name.into(), Arc::new(rescaled));
        Ok(changed)
    }
}

/// Text of a scene after a change.
fn edited(text: &str, change: impl FnOnce(&mut Table) -> Result<(), String>) -> Result<String, String> {
    let mut table: Table = text.parse().map_err(|error| format!("{error}"))?;
    change(&mut table)?;
    Ok(table.to_string())
}

/// Scene of a text, and the text with the pointers that were added.
fn read(of: SceneText) -> Result<(ViewerScene, SceneText), String> {
    let SceneText { titles, text, parts, rescaled, mut added } = of;
    let read = read_touchable_scene(Path::new("scene.toml"), text, &parts);
    let TouchableScene { mut scene, text, added: new } = read.map_err(|error| error.to_string())?;
    added.extend(new);
    scene.warnings.retain(|warning| !added.contains(&warning.part));
    let Titles { id, title, about } = titles.clone();
    let recordable: Vec<bool> = scene.model.recordings().map(Recording::is_rescalable).collect();
    let description = describe_scene(&scene, (id, title, about), &recordable);
    let needs_machine =
        scene.devices.iter().find(|device| device.real.is_some() || device.simulated.is_some());
    if let Some(device) = needs_machine {
        return Err(format!(
            "the device {:?} needs a machine: open the scene with palpate serve",
            device.name
        ));
    }
    let scene = ViewerScene::new(&scene, description, |device| match &device.path {
        Some(path) => ViewerDevice::Path(path.clone(), device.mode),
        None => ViewerDevice::Pointer,
    });
    Ok((scene, SceneText { titles, text, parts, rescaled, added }))
}

fn settings_change(settings: PhysicsSettings) -> SettingsChange {
    let PhysicsSettings { gravity, step, friction, coupling } = settings;
    let coupling = coupling
        .map(|coupling| palpate::Coupling { stiffness: coupling.stiffness, damping: coupling.damping });
    SettingsChange { gravity, step_s: step, friction, coupling }
}
