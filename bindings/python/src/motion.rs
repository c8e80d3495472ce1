//! Motion of devices, obstacles and clamps that the caller gives, for one step or a series of steps.

use crate::arrays::{Numbers, check_finite, pose_of};
use crate::errors::input_error;
use glam::DVec3;
use palpate::{AppliedForce, DeviceInput, DeviceMode, Input, Pose};
use palpate_scene::{Scene, SceneDevice};
use pyo3::exceptions::PyMemoryError;
use pyo3::prelude::*;

/// Arguments `positions`, `obstacles` and `clamps` of a call.
#[derive(Clone, Copy)]
pub struct Arguments<'a, 'py> {
    pub positions: Option<&'a Bound<'py, PyAny>>,
    pub obstacles: Option<&'a Bound<'py, PyAny>>,
    pub clamps: Option<&'a Bound<'py, PyAny>>,
}

/// Argument and number of rows of each kind of parts.
pub fn parts<'a, 'py>(arguments: &Arguments<'a, 'py>, scene: &Scene) -> [Part<'a, 'py>; 3] {
    let Arguments { positions, obstacles, clamps } = *arguments;
    [
        Part { kind: Kind::Devices, given: positions, rows: scene.devices.len() },
        Part { kind: Kind::Obstacles, given: obstacles, rows: scene.obstacles.len() },
        Part { kind: Kind::Clamps, given: clamps, rows: scene.clamps.len() },
    ]
}

/// Kind of parts that move.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    Devices,
    Obstacles,
    Clamps,
}

impl Kind {
    /// Name of the argument.
    pub fn name(self) -> &'static str {
        match self {
            Self::Devices => "positions",
            Self::Obstacles => "obstacles",
            Self::Clamps => "clamps",
        }
    }

    /// Numbers of a row: of a position, or of a pose.
    pub fn columns(self) -> usize {
        if self == Self::Devices { 3 } else { 7 }
    }
}

pub struct Part<'a, 'py> {
    pub kind: Kind,
    pub given: Option<&'a Bound<'py, PyAny>>,
    pub rows: usize,
}

/// Check that no device needs what this process does not have.
pub fn check_devices(py: Python<'_>, scene: &Scene) -> PyResult<()> {
    let lives_elsewhere = |device: &&SceneDevice| device.real.is_some() || device.simulated.is_some();
    match scene.devices.iter().find(lives_elsewhere) {
        None => Ok(()),
        Some(device) => Err(input_error(
            py,
            format!(
                "device {:?} has a driver or a simulated hand, which palpate run --realtime moves: leave them out, and give its positions",
                device.name
            ),
        )),
    }
}

/// Check that every device has a path, since no positions are given.
pub fn check_paths(py: Python<'_>, scene: &Scene) -> PyResult<()> {
    match scene.devices.iter().find(|device| device.path.is_none()) {
        None => Ok(()),
        Some(device) => Err(input_error(
            py,
            format!(
                "device {:?} has no path in the scene: give positions, an array of shape ({}, 3) with a row per device",
                device.name,
                scene.devices.len()
            ),
        )),
    }
}

/// Write the arguments of one step over the input of the scene's paths, once `check` has seen their numbers.
pub fn write_step(
    py: Python<'_>,
    scene: &Scene,
    arguments: &Arguments<'_, '_>,
    input: &mut Input,
    mut check: impl FnMut(Kind, &[f64]) -> PyResult<()>,
) -> PyResult<()> {
    if arguments.positions.is_none() {
        check_paths(py, scene)?;
    }
    // All are checked before the first is written: what is refused leaves the input as it was.
    let read = |Part { kind, given, rows }| {
        let shape = [Some(rows), Some(kind.columns())];
        given.map(|given| Ok::<_, PyErr>((kind, read_numbers(py, kind, given, &shape)?))).transpose()
    };
    let [devices, obstacles, clamps] = parts(arguments, scene).map(read);
    for (kind, numbers) in [devices?, obstacles?, clamps?].into_iter().flatten() {
        let numbers = numbers.as_slice()?;
        check(kind, numbers)?;
        write(kind, numbers, input).map_err(|error| input_error(py, error))?;
    }
    Ok(())
}

/// Numbers of a shape for a kind of parts, checked.
fn read_numbers<'py>(
    py: Python<'py>,
    kind: Kind,
    given: &Bound<'py, PyAny>,
    shape: &[Option<usize>],
) -> PyResult<Numbers<'py>> {
    let numbers = Numbers::read(given, kind.name(), shape)?;
    let checked = numbers.as_slice()?;
    check_finite(py, kind.name(), checked, kind.columns())?;
    if kind != Kind::Devices {
        for (row, pose) in checked.chunks_exact(kind.columns()).enumerate() {
            pose_of_row(kind, row, pose).map_err(|error| input_error(py, error))?;
        }
    }
    Ok(numbers)
}

/// Motions of a series of steps, copied: other threads may write to Python's arrays meanwhile.
pub struct SeriesMotion {
    /// Numbers, and numbers per step, of each kind that is given.
    parts: Vec<(Kind, Vec<f64>, usize)>,
    /// Number of steps, if something is given.
    pub steps: Option<usize>,
}

impl SeriesMotion {
    /// Motions of the arguments, whose first extents are the same number of steps.
    pub fn read(py: Python<'_>, scene: &Scene, arguments: &Arguments<'_, '_>) -> PyResult<Self> {
        if arguments.positions.is_none() {
            check_paths(py, scene)?;
        }
        let mut series = Self { parts: Vec::new(), steps: None };
        for Part { kind, given, rows } in parts(arguments, scene) {
            let Some(given) = given else { continue };
            let shape = [series.steps, Some(rows), Some(kind.columns())];
            let numbers = read_numbers(py, kind, given, &shape)?;
            series.steps = numbers.shape().first().copied();
            let mut copied = Vec::new();
            copy(kind.name(), numbers.as_slice()?, &mut copied)?;
            series.parts.push((kind, copied, rows * kind.columns()));
        }
        Ok(series)
    }

    /// Numbers, and numbers per step, of each kind that is given.
    pub fn given(&self) -> impl Iterator<Item = (Kind, &[f64], usize)> {
        self.parts.iter().map(|(kind, numbers, width)| (*kind, &**numbers, *width))
    }

    /// Write the motion of a step, from 0, over the input of the scene's paths.
    ///
    /// # Errors
    /// As [`write_step`]; poses were checked.
    pub fn write(&self, step: usize, input: &mut Input) -> Result<(), String> {
        for (kind, numbers, width) in &self.parts {
            write(*kind, &numbers[step * width..][..*width], input)?;
        }
        Ok(())
    }
}

/// Copy the numbers of an argument into a list, in place of what is in it.
pub fn copy(name: &str, numbers: &[f64], into: &mut Vec<f64>) -> PyResult<()> {
    into.clear();
    into.try_reserve_exact(numbers.len())
        .map_err(|error| PyMemoryError::new_err(format!("{name}: {error}")))?;
    into.extend_from_slice(numbers);
    Ok(())
}

/// Pose of a row of a kind of parts; the error names the row.
pub fn pose_of_row(kind: Kind, row: usize, numbers: &[f64]) -> Result<Pose, String> {
    pose_of(numbers).map_err(|error| format!("row {row} of {}: {error}", kind.name()))
}

/// Write rows of numbers of a kind of parts into an input.
pub fn write(kind: Kind, numbers: &[f64], input: &mut Input) -> Result<(), String> {
    let poses = |into: &mut Vec<Pose>| {
        for (row, (pose, numbers)) in into.iter_mut().zip(numbers.chunks_exact(7)).enumerate() {
            *pose = pose_of_row(kind, row, numbers)?;
        }
        Ok(())
    };
    match kind {
        Kind::Obstacles => return poses(&mut input.obstacles),
        Kind::Clamps => return poses(&mut input.clamps),
        Kind::Devices => {}
    }
    for (device, numbers) in input.devices.iter_mut().zip(numbers.chunks_exact(3)) {
        *device = moved(device, DVec3::from_slice(numbers));
    }
    Ok(())
}

/// Device with a given position [m], or with a given force [N] where it prescribes one.
fn moved(device: &DeviceInput, given: DVec3) -> DeviceInput {
    match device.mode {
        DeviceMode::Force(applied) => DeviceInput::exerting(AppliedForce { force: given, ..applied }),
        mode => DeviceInput { position: given, mode },
    }
}
