//! Base class of `palpate.Scene`: a scene that is read from TOML, with its files beside it or in memory.

use crate::arrays::{array, flat};
use crate::errors::{catch_panic, input_error, internal_error, scene_error};
use crate::progress::warn;
use crate::recording::Recording;
use crate::scalars::{FilePath, Text};
use crate::warnings::warnings_by_name;
use numpy::{PyArray1, PyArrayMethods};
use palpate_scene::{PartsInMemory, RunMode, read_scene_text};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;

/// Scene that is ready to be simulated; immutable.
#[pyclass(frozen, subclass, module = "palpate._palpate")]
pub struct Scene {
    /// Scene, which simulations share.
    pub inner: Arc<palpate_scene::Scene>,
    path: PathBuf,
    text: String,
    parts: PartsInMemory,
    reference: bool,
}

impl Scene {
    /// Number of an object by its name or number.
    pub fn object(scene: &palpate_scene::Scene, given: &Bound<'_, PyAny>) -> PyResult<usize> {
        number_of("object", &scene.object_names, given)
    }

    /// Number of a device by its name or number.
    pub fn device(scene: &palpate_scene::Scene, given: &Bound<'_, PyAny>) -> PyResult<usize> {
        number_of("device", &scene.names().devices, given)
    }
}

impl Scene {
    /// Scene with the limits of a run in real time, where it states none of its own.
    pub fn for_real_time(&self, py: Python<'_>) -> PyResult<palpate_scene::Scene> {
        let Self { path, text, parts, reference, .. } = self;
        if *reference {
            return Err(input_error(
                py,
                "the scene was read with reference=True, which takes longer than real time",
            ));
        }
        let read = py.detach(|| catch_panic(|| read_scene_text(path, text, parts, RunMode::RealTime)));
        read.map_err(|text| internal_error(py, &text))?.map_err(|error| scene_error(py, &error))
    }

    /// Whether parts of it are in no file.
    pub fn has_parts_in_memory(&self) -> bool {
        !self.parts.recordings.is_empty() || !self.parts.paths.is_empty()
    }
}

/// Number of a part by its name or number.
fn number_of(kind: &str, names: &[String], given: &Bound<'_, PyAny>) -> PyResult<usize> {
    let found = match (given.extract::<String>(), given.extract::<usize>()) {
        (Ok(name), _) => names.iter().position(|own| *own == name),
        (_, Ok(at)) => Some(at).filter(|at| *at < names.len()),
        _ => None,
    };
    found.ok_or_else(|| {
        let message = format!("there is no {kind} {}; the scene has {}", given, names.join(", "));
        input_error(given.py(), message)
    })
}

#[pymethods]
impl Scene {
    /// Scene of a TOML text. `path` names the text in errors, and its files are looked for beside it, unless they are among `recordings`, or
    /// `paths` as CSV text.
    #[new]
    #[pyo3(signature = (text, path, recordings, paths, reference=false))]
    fn new(
        py: Python<'_>,
        text: Text,
        path: FilePath,
        recordings: HashMap<FilePath, Py<Recording>>,
        paths: HashMap<FilePath, Text>,
        reference: bool,
    ) -> PyResult<Self> {
        let (Text(text), FilePath(path)) = (text, path);
        let recordings = recordings.into_iter();
        let recordings =
            recordings.map(|(FilePath(name), own)| (name, Arc::clone(&own.get().inner))).collect();
        let paths = paths.into_iter().map(|(FilePath(name), Text(rows))| (name, rows)).collect();
        let parts = PartsInMemory { recordings, paths };
        let mode = if reference { RunMode::Reference } else { RunMode::Offline };
        let read = py.detach(|| catch_panic(|| read_scene_text(&path, &text, &parts, mode)));
        let read = read.map_err(|text| internal_error(py, &text))?;
        let inner = read.map_err(|error| scene_error(py, &error))?;
        for warning in &inner.warnings {
            warn(py, &warning.to_string())?;
        }
        Ok(Self { inner: Arc::new(inner), path, text, parts, reference })
    }

    /// Text of the scene in TOML.
    #[getter]
    pub fn toml(&self) -> &str {
        &self.text
    }

    /// Step [s].
    #[getter]
    fn step(&self) -> f64 {
        self.inner.model.parameters().step_s
    }

    /// Gravity at the start [m/s², world]: float64 of shape (3,).
    #[getter]
    fn gravity<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, self.inner.model.parameters().gravity.to_array().to_vec(), &[3])
    }

    /// Time of the last row of all paths [s]; 0 without paths.
    #[getter]
    fn duration(&self) -> f64 {
        self.inner.end_s()
    }

    /// Names of the objects, in the order of the rows of `poses`.
    #[getter]
    fn object_names(&self) -> Vec<String> {
        self.inner.object_names.clone()
    }

    /// Names of the devices, in the order of the rows of `positions` and `forces`.
    #[getter]
    fn device_names(&self) -> Vec<String> {
        self.inner.names().devices
    }

    /// Names of planes and obstacles, planes first.
    #[getter]
    fn obstacle_names(&self) -> Vec<String> {
        self.inner.names().obstacles
    }

    /// Names of the clamps.
    #[getter]
    fn clamp_names(&self) -> Vec<String> {
        self.inner.names().clamps
    }

    /// Names of the probes.
    #[getter]
    fn probe_names(&self) -> Vec<String> {
        self.inner.probes.iter().map(|probe| probe.name.clone()).collect()
    }

    /// Warnings for the author of the scene: dicts with `kind`, `part` and `message` (docs/scene.md).
    #[getter]
    fn warnings<'py>(&self, py: Python<'py>) -> PyResult<Vec<Bound<'py, PyDict>>> {
        warnings_by_name(py, &self.inner.warnings)
    }

    /// Values that were chosen automatically, a line each.
    #[getter]
    fn choices(&self) -> Vec<String> {
        self.inner.choices.clone()
    }

    /// Surface triangles of an object, by its name or number: uint32 of shape (triangles, 3).
    fn triangles<'py>(&self, py: Python<'py>, object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let at = Self::object(&self.inner, object)?;
        let triangles = self.inner.model.recordings().nth(at).map_or(&[][..], |own| &own.surface.triangles);
        let numbers = triangles.iter().flatten().copied().collect();
        Ok(PyArray1::<u32>::from_vec(py, numbers).reshape([triangles.len(), 3])?.into_any())
    }

    /// Rest positions of an object's surface nodes [m, body frame]: float64 of shape (nodes, 3).
    fn rest_positions<'py>(
        &self,
        py: Python<'py>,
        object: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let at = Self::object(&self.inner, object)?;
        let positions = self.inner.model.recordings().nth(at).map_or(&[][..], |own| &own.surface.positions);
        array(py, flat(positions.iter().copied()), &[positions.len(), 3])
    }

    fn __repr__(&self) -> String {
        let names = self.inner.names();
        let listed = |what: &str, names: &[String]| match names.len() {
            0 => String::new(),
            _ => format!(", {what} {}", names.join(", ")),
        };
        format!(
            "<palpate.Scene with objects {}{}{}>",
            names.objects.join(", "),
            listed("devices", &names.devices),
            listed("obstacles", &names.obstacles)
        )
    }
}
