//! A scene that can be run, and whoever makes such scenes.

use crate::wire::{MaterialDescription, PhysicsSettings, SceneDescription, SceneSummary};
use palpate::{DeviceMode, Model, Pose, State};
use palpate_haptics::log::{LogSender, LogSummary, LogWriter};
use palpate_haptics::{AttachedDevice, MotionPath};
use std::io::{Seek, Write};
use std::sync::Arc;

/// Where an obstacle is at a time of the simulation [s]. It must not allocate.
pub type SharedTrajectory = Arc<dyn Fn(f64) -> Pose + Send + Sync>;

/// Opens a device; it is asked again when the scene begins anew.
pub type DeviceOpener = Arc<dyn Fn() -> Result<AttachedDevice, String> + Send + Sync>;

/// Where a log goes. If it is dropped before it is finished, there is none.
pub trait LogFile: Write + Seek + Send {
    /// All is written: keep it.
    fn finish(self: Box<Self>, summary: LogSummary);
}

/// Tells all pages of an error.
pub type PageNotifier = Arc<dyn Fn(&str) + Send + Sync>;

/// Both ends of a log that has begun.
pub type OpenLog = (LogSender, LogWriter<Box<dyn LogFile>>);

/// Begins a log of a scene from a state; it is asked again when the scene begins anew. Pages can be told what goes wrong later.
pub type LogOpener = Arc<dyn Fn(&State, PageNotifier) -> Result<OpenLog, String> + Send + Sync>;

/// A scene that can be run as often as one likes.
#[derive(Clone)]
pub struct ViewerScene {
    /// What the page is told.
    pub description: SceneDescription,
    /// The scene.
    pub model: Arc<Model>,
    /// One for each device of the model.
    pub devices: Vec<ViewerDevice>,
    /// One for each obstacle.
    pub movers: Vec<SharedTrajectory>,
    /// Where what happens is logged, if it is.
    pub log: Option<LogOpener>,
}

/// Who moves a device.
#[derive(Clone)]
pub enum ViewerDevice {
    /// A pointer of a page, when one comes.
    Pointer,
    /// A path in simulated time.
    Following(MotionPath, DeviceMode),
    /// A device on this machine.
    Here(DeviceOpener),
}

/// A mesh file that a page sends.
#[derive(Debug, Clone)]
pub struct Upload {
    /// Its file name.
    pub name: String,
    /// Its bytes.
    pub bytes: Vec<u8>,
    /// To metres.
    pub scale: f64,
    /// Of all of it.
    pub material: MaterialDescription,
    /// How many modes.
    pub modes: usize,
}

/// How far a long job is: what it does, and its share, if known.
pub type ProgressCallback<'a> = &'a mut (dyn FnMut(&str, Option<f64>) + Send);

/// Makes scenes. Every error is a text for people.
pub trait SceneProvider: Send + Sync + 'static {
    /// The scenes that can be opened.
    fn titles(&self) -> Vec<SceneSummary>;

    /// One of them, by its id.
    ///
    /// # Errors
    /// When there is none, or it can't be made.
    fn open(&self, id: &str, tell: ProgressCallback) -> Result<ViewerScene, String>;

    /// The scene that was made last, under other rules.
    ///
    /// # Errors
    /// When a number is out of its range.
    fn change(&self, rules: &PhysicsSettings) -> Result<ViewerScene, String>;

    /// The scene that was made last, with an object of another material.
    ///
    /// # Errors
    /// When it can't be recorded.
    fn change_material(
        &self,
        object: usize,
        material: MaterialDescription,
        tell: ProgressCallback,
    ) -> Result<ViewerScene, String>;

    /// A scene of a mesh.
    ///
    /// # Errors
    /// When it is none, or can't be recorded.
    fn record(&self, upload: Upload, tell: ProgressCallback) -> Result<ViewerScene, String>;
}
