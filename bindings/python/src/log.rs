//! `palpate.Log`: a log of a run as arrays.

use crate::arrays::{array, read_only};
use crate::errors::{Class, catch_panic, exception, file_error, internal_error};
use crate::scalars::FilePath;
use numpy::PyArray1;
use palpate::EnergyLedger;
use palpate_haptics::log::{LogReader, LoggedStep};
use palpate_mesh::read_regular_file;
use palpate_scene::{pose_row, twist_row};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Log of a run, as `palpate run --log` writes it, read as a whole. Arrays are read-only.
///
/// Parameters
/// ----------
/// path : str or path
///     Log, `*.mcap`; also one that was cut.
#[pyclass(frozen, module = "palpate")]
pub struct Log {
    path: PathBuf,
    /// Facts about the run, as texts.
    #[pyo3(get)]
    metadata: BTreeMap<String, String>,
    /// Whether the log was cut by a kill or a full disk.
    #[pyo3(get)]
    is_cut: bool,
    /// Numbers of the steps, from 1: uint64 of shape (steps,).
    #[pyo3(get)]
    steps: Py<PyAny>,
    /// Times at the ends of the steps [s]: float64 of shape (steps,).
    #[pyo3(get)]
    time: Py<PyAny>,
    /// Positions of the hands [m, world] by the name of the device: float64 of shape (steps, 3).
    #[pyo3(get)]
    positions: Py<PyDict>,
    /// Forces on the hands [N, world] by the name of the device: float64 of shape (steps, 3).
    #[pyo3(get)]
    forces: Py<PyDict>,
    /// Proxies [m, world] by the name of the device: float64 of shape (steps, 3).
    #[pyo3(get)]
    proxies: Py<PyDict>,
    /// Poses x, y, z [m], qw, qx, qy, qz by the name of the object: float64 of shape (steps, 7).
    #[pyo3(get)]
    poses: Py<PyDict>,
    /// Velocities [m/s] and angular velocities [rad/s] by the name of the object: float64 of shape (steps, 6).
    #[pyo3(get)]
    velocities: Py<PyDict>,
    /// Energy ledger [J] by name: float64 of shape (steps,).
    #[pyo3(get)]
    energy: Py<PyDict>,
    /// Delays of the cycles after their deadlines [s]: float64 of shape (steps,).
    #[pyo3(get)]
    lateness: Py<PyAny>,
    /// Compute times of the cycles [s]: float64 of shape (steps,).
    #[pyo3(get)]
    compute_time: Py<PyAny>,
}

/// Rows of a part by its name; steps without it are NaN.
#[derive(Default)]
struct Rows(BTreeMap<String, Vec<f64>>);

impl Rows {
    fn set<const N: usize>(&mut self, name: &str, step: usize, row: [f64; N]) {
        if !self.0.contains_key(name) {
            self.0.insert(name.to_string(), Vec::new());
        }
        let Some(rows) = self.0.get_mut(name) else { return };
        rows.resize(N * step, f64::NAN);
        rows.extend(row);
    }

    fn into_dict(self, py: Python<'_>, steps: usize, width: usize) -> PyResult<Py<PyDict>> {
        let dict = PyDict::new(py);
        for (name, mut rows) in self.0 {
            rows.resize(width * steps, f64::NAN);
            dict.set_item(name, read_only(array(py, rows, &[steps, width])?)?)?;
        }
        Ok(dict.unbind())
    }
}

/// Numbers of a log.
#[derive(Default)]
struct Content {
    metadata: BTreeMap<String, String>,
    step_s: f64,
    is_cut: bool,
    steps: Vec<u64>,
    positions: Rows,
    forces: Rows,
    proxies: Rows,
    poses: Rows,
    velocities: Rows,
    energy: Vec<EnergyLedger>,
    lateness: Vec<f64>,
    compute_time: Vec<f64>,
}

impl Content {
    fn append(&mut self, logged: &LoggedStep) {
        let at = self.steps.len();
        self.steps.push(logged.step);
        for (name, device) in logged.devices() {
            self.positions.set(name, at, device.position.to_array());
            self.forces.set(name, at, device.force_on_hand.to_array());
            self.proxies.set(name, at, device.proxy.to_array());
        }
        for (name, pose, twist) in logged.objects() {
            self.poses.set(name, at, pose_row(&pose));
            self.velocities.set(name, at, twist_row(&twist));
        }
        self.energy.push(logged.energy());
        self.lateness.push(1e-6 * logged.lateness_us());
        self.compute_time.push(1e-6 * logged.compute_us());
    }
}

/// Reason that a log cannot be read, with the message.
enum ReadError {
    /// The operating system refused, with the number of its error.
    Io(String, Option<i32>),
    /// It is no log.
    Content(String),
}

/// Reads a log.
fn read(path: &Path) -> Result<Content, ReadError> {
    let unread = |error: std::io::Error| {
        ReadError::Io(format!("cannot read the log {}: {error}", path.display()), error.raw_os_error())
    };
    let refused = |error| ReadError::Content(format!("{}: {error}", path.display()));
    let bytes = read_regular_file(path).map_err(unread)?;
    let reader = LogReader::new(bytes).map_err(|error| refused(error.to_string()))?;
    let metadata = reader.metadata().map_err(|error| refused(error.to_string()))?;
    let step_s = metadata.get("step_s").and_then(|text| text.parse().ok());
    let step_s = step_s.ok_or_else(|| refused("the log does not say its step".to_string()))?;
    let mut content = Content { metadata, step_s, is_cut: reader.is_cut(), ..Content::default() };
    for logged in reader.logged_steps() {
        content.append(&logged.map_err(|error| refused(error.to_string()))?);
    }
    Ok(content)
}

/// Log in the form of another package, by a function of `palpate._log_frames`.
fn frame_of(log: &Bound<'_, Log>, function: &str) -> PyResult<Py<PyAny>> {
    Ok(log.py().import("palpate._log_frames")?.call_method1(function, (log,))?.unbind())
}

#[pymethods]
impl Log {
    #[new]
    fn new(py: Python<'_>, path: FilePath) -> PyResult<Self> {
        let FilePath(path) = path;
        let content = py.detach(|| catch_panic(|| read(&path)));
        let content = content.map_err(|text| internal_error(py, &text))?;
        let content = content.map_err(|error| match error {
            ReadError::Io(message, number) => file_error(py, &path, number, &message),
            ReadError::Content(message) => exception(py, Class::Log, message),
        })?;
        let count = content.steps.len();
        let numbers = |numbers: Vec<f64>| Ok::<_, PyErr>(read_only(array(py, numbers, &[count])?)?.unbind());
        let energy = PyDict::new(py);
        for (at, (name, _)) in EnergyLedger::default().named().into_iter().enumerate() {
            // The defect is not logged.
            if name != "defect" {
                energy
                    .set_item(name, numbers(content.energy.iter().map(|own| own.named()[at].1).collect())?)?;
            }
        }
        let time = content.steps.iter().map(|step| *step as f64 * content.step_s).collect();
        Ok(Self {
            metadata: content.metadata,
            is_cut: content.is_cut,
            time: numbers(time)?,
            steps: read_only(PyArray1::from_vec(py, content.steps).into_any())?.unbind(),
            positions: content.positions.into_dict(py, count, 3)?,
            forces: content.forces.into_dict(py, count, 3)?,
            proxies: content.proxies.into_dict(py, count, 3)?,
            poses: content.poses.into_dict(py, count, 7)?,
            velocities: content.velocities.into_dict(py, count, 6)?,
            energy: energy.unbind(),
            lateness: numbers(content.lateness)?,
            compute_time: numbers(content.compute_time)?,
            path,
        })
    }

    /// Steps as a table of pandas, a row for each, by their times.
    ///
    /// Returns
    /// -------
    /// pandas.DataFrame
    ///     The columns of `palpate run --csv` that a log has, `finger.fx` or `cube.px`, then `energy.NAME`, `lateness` and `compute_time`; the index is
    ///     `time` [s]. `attrs["units"]` has the unit of each column. Devices and objects that a step lacks are NaN.
    ///
    /// Raises
    /// ------
    /// ModuleNotFoundError
    ///     Without pandas: `pip install pandas`.
    fn to_pandas(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        frame_of(slf, "to_pandas")
    }

    /// Steps as a data set of xarray, with units, by time, name and axis.
    ///
    /// Returns
    /// -------
    /// xarray.Dataset
    ///     `position`, `force` and `proxy` (time, device, axis); `object_position`, `velocity`, `angular_velocity` (time, object, axis) and
    ///     `orientation` (time, object, quaternion) with components w, x, y, z; `energy` (time, term); `lateness`, `compute_time` (time). Each has its
    ///     unit in `attrs["units"]`; those of the set are the log's metadata. Devices and objects that a step lacks are NaN.
    ///
    /// Raises
    /// ------
    /// ModuleNotFoundError
    ///     Without xarray: `pip install xarray`.
    fn to_xarray(slf: &Bound<'_, Self>) -> PyResult<Py<PyAny>> {
        frame_of(slf, "to_xarray")
    }

    /// Names of the devices, in alphabetical order.
    #[getter]
    fn device_names(&self, py: Python<'_>) -> Vec<String> {
        self.forces.bind(py).keys().iter().map(|name| name.to_string()).collect()
    }

    /// Names of the objects, in alphabetical order.
    #[getter]
    fn object_names(&self, py: Python<'_>) -> Vec<String> {
        self.poses.bind(py).keys().iter().map(|name| name.to_string()).collect()
    }

    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.steps.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<palpate.Log {:?} of {} steps>", self.path, self.steps.bind(py).len()?))
    }
}
