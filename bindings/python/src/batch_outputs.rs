//! Outputs of a batch: arrays that every step writes over.

use crate::arrays::array;
use crate::errors::{Class, exception};
use numpy::{PyArrayDyn, PyArrayMethods, PyUntypedArrayMethods};
use palpate::Output;
use palpate_scene::{Scene, pose_row, twist_row};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice, PyTuple};

/// Arrays of shape (rows, …), whose numbers the threads write row by row into one buffer.
pub struct BatchOutputs {
    /// Arrays, and the place of their numbers in a row of the buffer.
    arrays: Vec<(Py<PyArrayDyn<f64>>, std::ops::Range<usize>)>,
}

/// Names of the arrays, in their order.
const NAMES: [&str; 6] = ["time", "forces", "proxies", "poses", "velocities", "clamp_loads"];

/// Arrays in their order.
#[derive(Clone, Copy)]
pub enum Part {
    Time,
    Forces,
    Proxies,
    Poses,
    Velocities,
    ClampLoads,
}

impl BatchOutputs {
    /// Arrays of a number of rows of a scene.
    pub fn new(py: Python<'_>, scene: &Scene, rows: usize) -> Self {
        let (devices, objects) = (scene.devices.len(), scene.object_names.len());
        let shapes: [&[usize]; 6] = [
            &[rows],
            &[rows, devices, 3],
            &[rows, devices, 3],
            &[rows, objects, 7],
            &[rows, objects, 6],
            &[rows, scene.clamps.len(), 6],
        ];
        let mut end = 0;
        let make = |shape: &[usize]| {
            let start = end;
            end += shape[1..].iter().product::<usize>();
            (PyArrayDyn::zeros(py, shape, false).unbind(), start..end)
        };
        Self { arrays: shapes.map(make).into() }
    }

    /// Arrays of a series by name, of shape (steps, rows, …): views of one array, made of the numbers of the buffer in every step, row by row. `steps` are
    /// those that there is room for, and those that were made.
    pub fn series<'py>(
        &self,
        py: Python<'py>,
        numbers: Vec<f64>,
        (rows, [steps, done]): (usize, [usize; 2]),
    ) -> PyResult<Bound<'py, PyDict>> {
        let all = array(py, numbers, &[rows, steps, self.row_length()])?;
        let all = all.call_method1("transpose", ((1, 0, 2),))?;
        let dict = PyDict::new(py);
        for (name, (own, place)) in NAMES.into_iter().zip(&self.arrays) {
            let (start, end) = (place.start as isize, place.end as isize);
            let place =
                (PySlice::new(py, 0, done as isize, 1), PySlice::full(py), PySlice::new(py, start, end, 1));
            let extents: Vec<usize> = [&[done], own.bind(py).shape()].concat();
            dict.set_item(
                name,
                all.get_item(place)?.call_method1("reshape", (PyTuple::new(py, extents)?,))?,
            )?;
        }
        Ok(dict)
    }

    /// Numbers of a row of the buffer.
    pub fn row_length(&self) -> usize {
        self.arrays.iter().map(|(_, place)| place.end).max().unwrap_or(0)
    }

    /// One of the arrays.
    pub fn array(&self, py: Python<'_>, part: Part) -> Py<PyArrayDyn<f64>> {
        self.arrays[part as usize].0.clone_ref(py)
    }

    /// Copy the buffer into the arrays.
    pub fn write(&self, py: Python<'_>, buffer: &[f64]) -> PyResult<()> {
        let refused = |error: String| {
            let message = format!(
                "an array of the batch cannot be written to ({error}): it is the batch's own; use a copy"
            );
            exception(py, Class::Palpate, message)
        };
        for (array, place) in self.arrays.iter().filter(|(_, place)| !place.is_empty()) {
            let mut numbers = array.bind(py).try_readwrite().map_err(|error| refused(error.to_string()))?;
            let numbers = numbers.as_slice_mut().map_err(|error| refused(error.to_string()))?;
            for (own, row) in
                numbers.chunks_exact_mut(place.len()).zip(buffer.chunks_exact(self.row_length()))
            {
                own.copy_from_slice(&row[place.clone()]);
            }
        }
        Ok(())
    }
}

/// Write the numbers of an output into a row of the buffer, in the order of the arrays.
pub fn fill_row(row: &mut [f64], output: &Output) {
    let mut rest = row;
    let mut put = |numbers: &[f64]| {
        let (own, next) = std::mem::take(&mut rest).split_at_mut(numbers.len());
        own.copy_from_slice(numbers);
        rest = next;
    };
    put(&[output.time_s]);
    output.devices.iter().for_each(|device| put(&device.force_on_hand.to_array()));
    output.devices.iter().for_each(|device| put(&device.proxy.to_array()));
    output.objects.iter().for_each(|object| put(&pose_row(&object.pose)));
    output.objects.iter().for_each(|object| put(&twist_row(&object.twist)));
    for clamp in &output.clamps {
        put(&clamp.force.to_array());
        put(&clamp.torque.to_array());
    }
}
