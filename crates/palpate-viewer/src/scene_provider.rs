//! Scenes that the server runs, and the interface that makes them.

use crate::error::SceneError;
use crate::protocol::{MaterialDescription, OwnSettings, PhysicsSettings, SceneDescription, SceneSummary};
#[cfg(feature = "server")]
use palpate::State;
use palpate::{DeviceMode, Model};
#[cfg(feature = "server")]
use palpate_haptics::AttachedDevice;
use palpate_haptics::MotionPath;
#[cfg(feature = "server")]
use palpate_haptics::log::{LogSender, LogSummary, LogWriter};
use palpate_scene::{MotionSource, Scene, SceneDevice};
#[cfg(feature = "server")]
use std::io::{Seek, Write};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Opens a device; called at each start of the scene.
#[cfg(feature = "server")]
pub type DeviceOpener = Arc<dyn Fn() -> Result<AttachedDevice, SceneError> + Send + Sync>;

/// Target of a log. What was flushed stays, however the process ends.
#[cfg(feature = "server")]
pub trait LogFile: Write + Seek + Send {
    /// Keeps the log: under its name if it is whole, or as far as it could be written.
    fn finish(self: Box<Self>, summary: LogSummary);
}

/// Sends an error text to all pages.
#[cfg(feature = "server")]
pub type PageNotifier = Arc<dyn Fn(&str) + Send + Sync>;

/// Sender and writer of an open log.
#[cfg(feature = "server")]
pub type OpenLog = (LogSender, LogWriter<Box<dyn LogFile>>);

/// Opens a log that begins with a state; called at each start of the scene. The notifier reports later errors.
#[cfg(feature = "server")]
pub type LogOpener = Arc<dyn Fn(&State, PageNotifier) -> Result<OpenLog, SceneError> + Send + Sync>;

/// Scene that can be started repeatedly.
#[derive(Clone)]
pub struct ViewerScene {
    /// Description for the page.
    pub description: SceneDescription,
    /// Model.
    pub model: Arc<Model>,
    /// Input source per device of the model.
    pub devices: Vec<ViewerDevice>,
    /// Motion of planes, obstacles, clamps, bases and gravity.
    pub motion: MotionSource,
    /// Whether it may go on from the state of another scene.
    pub can_resume: bool,
    /// Log opener, if the scene is logged.
    #[cfg(feature = "server")]
    pub log: Option<LogOpener>,
}

impl ViewerScene {
    /// Scene without a log, with settings of its own, whose devices `device` finds.
    pub fn new(
        scene: &Scene,
        mut description: SceneDescription,
        device: impl FnMut(&SceneDevice) -> ViewerDevice,
    ) -> Self {
        description.own = Some(OwnSettings::of(&description));
        Self {
            description,
            model: scene.model.clone(),
            devices: scene.devices.iter().map(device).collect(),
            motion: scene.motion(),
            can_resume: scene.can_resume(),
            #[cfg(feature = "server")]
            log: None,
        }
    }

    /// Scene that came of changes to another one, whose own settings it has.
    #[must_use]
    pub fn changed_from(mut self, opened: &Self) -> Self {
        self.description.own.clone_from(&opened.description.own);
        self
    }
}

/// Input source of a device.
#[derive(Clone)]
pub enum ViewerDevice {
    /// Pointer of a page, inactive until one claims it.
    Pointer,
    /// Path in simulation time.
    Path(MotionPath, DeviceMode),
    /// Device on this machine.
    #[cfg(feature = "server")]
    Local(DeviceOpener),
}

/// Mesh file uploaded by a page.
#[derive(Debug, Clone)]
pub struct Upload {
    /// File name.
    pub name: String,
    /// File content.
    pub bytes: Vec<u8>,
    /// Length unit of the file [m].
    pub scale: f64,
    /// Material of the whole mesh.
    pub material: MaterialDescription,
    /// Number of modes to record.
    pub modes: usize,
}

/// Function of the phase of a job, and of the completed fraction of the phase, if known.
pub type JobReport<'a> = &'a mut (dyn FnMut(&str, Option<f64>) + Send);

/// Listener of a job.
pub struct JobControl<'a> {
    /// Receives the progress.
    pub report: JobReport<'a>,
    /// Set when the job is to end with an error at the next opportunity.
    pub cancelled: &'a AtomicBool,
}

/// Makes the scenes of the server. Pages show the errors as text.
pub trait SceneProvider: Send + Sync + 'static {
    /// Scenes that [`SceneProvider::open`] accepts.
    fn scenes(&self) -> Vec<SceneSummary>;

    /// Scene of an id.
    ///
    /// # Errors
    /// If there is none, or it cannot be made.
    fn open(&self, id: &str, job: JobControl) -> Result<ViewerScene, SceneError>;

    /// Most recent scene with changed physics settings.
    ///
    /// # Errors
    /// If a value is out of range.
    fn change_physics(&self, settings: &PhysicsSettings) -> Result<ViewerScene, SceneError>;

    /// Most recent scene with another material of one object.
    ///
    /// # Errors
    /// If the object cannot be recorded.
    fn change_material(
        &self,
        object: usize,
        material: MaterialDescription,
        job: JobControl,
    ) -> Result<ViewerScene, SceneError>;

    /// Scene of an uploaded mesh.
    ///
    /// # Errors
    /// If the file is not a mesh, or cannot be recorded.
    fn record(&self, upload: Upload, job: JobControl) -> Result<ViewerScene, SceneError>;
}
