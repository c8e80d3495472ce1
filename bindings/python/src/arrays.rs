//! Arrays of arguments, checked: numbers of a shape, and conversions of vectors to rows of numbers, and of rows to poses.

use crate::errors::input_error;
use glam::DVec3;
use numpy::{PyArray1, PyArrayDyn, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use palpate::Pose;
use palpate_scene::pose_of_row;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Numbers of an array argument, C-contiguous: the array itself, or a converted copy.
pub struct Numbers<'py>(PyReadonlyArrayDyn<'py, f64>);

impl<'py> Numbers<'py> {
    /// Array of float64, or what NumPy makes such an array of without loss: lists, other real numbers. `name` is that of the argument;
    /// None is an extent of any length.
    pub fn read(given: &Bound<'py, PyAny>, name: &str, expected: &[Option<usize>]) -> PyResult<Self> {
        let is_plain = |array: &&Bound<'py, PyArrayDyn<f64>>| {
            array.is_c_contiguous() && array.data().addr().is_multiple_of(align_of::<f64>())
        };
        let own = given.cast::<PyArrayDyn<f64>>().ok().filter(is_plain);
        let array = match own {
            Some(array) => array.clone(),
            None => convert(given, name, expected)?,
        };
        let shape = array.shape();
        let fits =
            |(own, expected): (&usize, &Option<usize>)| expected.is_none_or(|expected| *own == expected);
        if shape.len() != expected.len() || !shape.iter().zip(expected).all(fits) {
            let message =
                format!("{name} has the shape {}, expected {}", shown(shape), expected_shape(expected));
            return Err(input_error(given.py(), message));
        }
        let read = array.try_readonly().map_err(|error| {
            input_error(
                given.py(),
                format!("{name} is being written to by another extension ({error}): give a copy"),
            )
        })?;
        Ok(Self(read))
    }

    /// Numbers row by row.
    pub fn as_slice(&self) -> PyResult<&[f64]> {
        Ok(self.0.as_slice()?)
    }

    /// Extents.
    pub fn shape(&self) -> &[usize] {
        self.0.shape()
    }
}

/// Array of float64 of other numbers.
fn convert<'py>(
    given: &Bound<'py, PyAny>,
    name: &str,
    expected: &[Option<usize>],
) -> PyResult<Bound<'py, PyArrayDyn<f64>>> {
    let py = given.py();
    let refused = |what: String| {
        input_error(
            py,
            format!("{name} {what}, expected an array of float64 of shape {}", expected_shape(expected)),
        )
    };
    let numpy = py.import("numpy")?;
    let array = numpy
        .call_method1("asarray", (given,))
        .map_err(|error| refused(format!("is no array ({})", error.value(py))))?;
    let dtype = array.getattr("dtype")?;
    if !["f", "i", "u"].contains(&dtype.getattr("kind")?.extract::<String>()?.as_str()) {
        return Err(refused(format!("holds {}", dtype.str()?)));
    }
    // C-contiguous and aligned.
    let array = numpy.call_method1("require", (array, "float64", ["C", "A"]))?;
    Ok(array.cast_into::<PyArrayDyn<f64>>()?)
}

/// Integers of an array argument of shape (any, columns), row by row.
pub fn read_integers(given: &Bound<'_, PyAny>, name: &str, columns: usize) -> PyResult<Vec<i64>> {
    let py = given.py();
    let array = py.import("numpy")?.call_method1("asarray", (given,))?;
    let kind: String = array.getattr("dtype")?.getattr("kind")?.extract()?;
    let shape: Vec<usize> = array.getattr("shape")?.extract()?;
    if !["i", "u"].contains(&kind.as_str()) || shape.len() != 2 || shape[1] != columns {
        let dtype = array.getattr("dtype")?.str()?;
        let message = format!(
            "{name} holds {dtype} in the shape {}, expected integers of shape {}",
            shown(&shape),
            expected_shape(&[None, Some(columns)])
        );
        return Err(input_error(py, message));
    }
    let flat = array.call_method1("astype", ("int64",))?.call_method0("ravel")?;
    let flat = flat.cast_into::<PyArray1<i64>>()?;
    Ok(flat.try_readonly().map_err(|error| input_error(py, error))?.as_slice()?.to_vec())
}

/// Check that numbers are finite; in rows of `width`, whose first is named.
pub fn check_finite(py: Python<'_>, name: &str, numbers: &[f64], width: usize) -> PyResult<()> {
    match numbers.iter().position(|number| !number.is_finite()) {
        None => Ok(()),
        Some(at) => check_finite_row(py, name, at / width, &numbers[at / width * width..][..width]),
    }
}

/// Check that the numbers of a row are finite.
pub fn check_finite_row(py: Python<'_>, name: &str, row: usize, numbers: &[f64]) -> PyResult<()> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(());
    }
    Err(input_error(py, format!("row {row} of {name} is {numbers:?}, expected finite numbers")))
}

/// Shape as Python shows it.
pub fn shown(shape: &[usize]) -> String {
    expected_shape(&shape.iter().copied().map(Some).collect::<Vec<_>>())
}

fn expected_shape(shape: &[Option<usize>]) -> String {
    let extents: Vec<String> =
        shape.iter().map(|own| own.map_or("any".into(), |own| own.to_string())).collect();
    let comma = if extents.len() == 1 { "," } else { "" };
    format!("({}{comma})", extents.join(", "))
}

/// Array of float64 of a shape from its numbers, which become its memory.
pub fn array<'py>(py: Python<'py>, numbers: Vec<f64>, shape: &[usize]) -> PyResult<Bound<'py, PyAny>> {
    Ok(PyArray1::from_vec(py, numbers).reshape(shape.to_vec())?.into_any())
}

/// Array whose numbers cannot be written to.
pub fn read_only(array: Bound<'_, PyAny>) -> PyResult<Bound<'_, PyAny>> {
    let options = PyDict::new(array.py());
    options.set_item("write", false)?;
    array.call_method("setflags", (), Some(&options))?;
    Ok(array)
}

/// Numbers of vectors, one after another.
pub fn flat(vectors: impl IntoIterator<Item = DVec3>) -> Vec<f64> {
    vectors.into_iter().flat_map(|vector| vector.to_array()).collect()
}

/// Pose of a row x, y, z, qw, qx, qy, qz; the quaternion has length 1 to a thousandth.
pub fn pose_of(row: &[f64]) -> Result<Pose, String> {
    let row = row.try_into().map_err(|_| "a pose has seven numbers")?;
    let (pose, length) = pose_of_row(row);
    if (length - 1.0).abs() > UNIT {
        return Err(format!("the quaternion (qw, qx, qy, qz) has the length {length}, expected 1"));
    }
    Ok(pose)
}

/// Deviation of a quaternion's length from 1 that is taken for round-off of a printed one.
const UNIT: f64 = 1e-3;
