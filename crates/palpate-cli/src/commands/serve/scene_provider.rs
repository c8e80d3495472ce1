//! Scenes for the viewer's server, from a library of scenes, with their logs.

use super::log_series::LogSeries;
use crate::commands::guard::attach_guarded;
use crate::failure::Failure;
use crate::terminal::notify;
use palpate::{DeviceMode, Material};
use palpate_scene::{
    BUILT_IN_SCENES, MeshUpload, MeshingParameters, OpenedScene, Progress, ProgressFn, RealDevice,
    SceneDevice, SceneLibrary, SceneLog, SettingsChange, attach_path,
};
use palpate_viewer::{
    JobControl, JobReport, MaterialDescription, PhysicsSettings, SceneError, SceneProvider, SceneSummary,
    Upload, ViewerDevice, ViewerScene, describe_scene,
};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Update rate of devices on this machine [Hz].
const DEVICE_HZ: f64 = 1000.0;

/// Scene library behind the interface of the viewer's server.
pub struct LibraryProvider {
    library: SceneLibrary,
    logs: Option<Arc<LogSeries>>,
}

impl LibraryProvider {
    /// Provider with a cache folder of recordings, or the user's; and with a series of logs.
    pub fn new(cache: Option<&Path>, logs: Option<Arc<LogSeries>>) -> Result<Self, Failure> {
        Ok(Self { library: SceneLibrary::new(cache)?, logs })
    }

    /// Opens a scene file, and prints its warnings.
    pub fn open_file(&self, path: &Path) -> Result<ViewerScene, Failure> {
        let opened = self.library.open_file(path)?;
        let warnings = opened.scene.warnings.iter().map(|warning| format!("warning: {warning}"));
        let messages: Vec<String> = warnings.chain(opened.scene.choices.iter().cloned()).collect();
        let scene = self.viewer_scene(opened)?;
        messages.iter().for_each(|line| notify(line));
        Ok(scene)
    }

    fn viewer_scene(&self, opened: OpenedScene) -> Result<ViewerScene, Failure> {
        let OpenedScene { scene, text, id, title, about, recordable } = opened;
        let description = describe_scene(&scene, (id, title, about), &recordable);
        let content = SceneLog::new(&scene, Some(text));
        let log = self.logs.as_ref().map(|logs| logs.opener(content)).transpose()?;
        Ok(ViewerScene { log, ..ViewerScene::new(&scene, description, viewer_device) })
    }

    /// Scene of the viewer, with the provider's error.
    fn provided<E: Into<Failure>>(&self, opened: Result<OpenedScene, E>) -> Result<ViewerScene, SceneError> {
        opened
            .map_err(Into::into)
            .and_then(|opened| self.viewer_scene(opened))
            .map_err(|failure| failure.0.into())
    }
}

impl SceneProvider for LibraryProvider {
    fn scenes(&self) -> Vec<SceneSummary> {
        let summary = |scene: &palpate_scene::BuiltInScene| SceneSummary {
            id: scene.id.into(),
            title: scene.title.into(),
            about: scene.about.into(),
        };
        BUILT_IN_SCENES.iter().map(summary).collect()
    }

    fn open(&self, id: &str, job: JobControl) -> Result<ViewerScene, SceneError> {
        self.provided(self.library.open_built_in(id, &mut JobProgress::new(job)))
    }

    fn change_physics(&self, settings: &PhysicsSettings) -> Result<ViewerScene, SceneError> {
        let coupling = settings
            .coupling
            .map(|coupling| palpate::Coupling { stiffness: coupling.stiffness, damping: coupling.damping });
        let PhysicsSettings { gravity, step, friction, .. } = *settings;
        self.provided(self.library.change_settings(&SettingsChange {
            gravity,
            step_s: step,
            friction,
            coupling,
        }))
    }

    fn change_material(
        &self,
        object: usize,
        material: MaterialDescription,
        job: JobControl,
    ) -> Result<ViewerScene, SceneError> {
        let progress = &mut JobProgress::new(job);
        self.provided(self.library.change_material(object, uniform(material), progress))
    }

    fn record(&self, upload: Upload, job: JobControl) -> Result<ViewerScene, SceneError> {
        let Upload { name, bytes, scale, material, modes } = upload;
        let material = uniform(material);
        let upload =
            MeshUpload { name, bytes, scale, meshing: MeshingParameters::default(), material, modes };
        self.provided(self.library.record_upload(upload, &mut JobProgress::new(job)))
    }
}

/// Progress of a recording that a page can cancel.
struct JobProgress<'a> {
    report: ProgressFn<JobReport<'a>>,
    cancelled: &'a AtomicBool,
}

impl<'a> JobProgress<'a> {
    fn new(JobControl { report, cancelled }: JobControl<'a>) -> Self {
        Self { report: ProgressFn::new(report), cancelled }
    }
}

impl Progress for JobProgress<'_> {
    fn begin(&mut self, stage: &str, total: u64) {
        self.report.begin(stage, total);
    }
    fn advance(&mut self, units: u64) {
        self.report.advance(units);
    }
    fn warn(&mut self, text: &str) {
        self.report.warn(text);
    }
    fn is_interrupted(&self) -> bool {
        self.cancelled.load(Ordering::Acquire)
    }
}

/// Material of all regions.
fn uniform(material: MaterialDescription) -> Material {
    let MaterialDescription { young, poisson, density } = material;
    Material::isotropic(young, poisson, density)
}

fn viewer_device(device: &SceneDevice) -> ViewerDevice {
    match (&device.real, &device.path) {
        (Some(real), _) => {
            let (real, mode): (RealDevice, DeviceMode) = (real.clone(), device.mode);
            ViewerDevice::Local(Arc::new(move || {
                let (attached, line) =
                    attach_guarded(&real, mode, DEVICE_HZ, true).map_err(|error| error.to_string())?;
                notify(&line);
                Ok(attached)
            }))
        }
        (None, Some(path)) => match device.simulated {
            None => ViewerDevice::Path(path.clone(), device.mode),
            simulated => {
                let (path, mode) = (path.clone(), device.mode);
                ViewerDevice::Local(Arc::new(move || {
                    Ok(attach_path(path.clone(), simulated, mode, DEVICE_HZ, true))
                }))
            }
        },
        (None, None) => ViewerDevice::Pointer,
    }
}
