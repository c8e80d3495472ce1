//! Contacts as a structured array: names as in the CSV file of contacts.

use numpy::PyArray1;
use palpate::{Collider, ContactOutput};
use palpate_scene::Scene;
use pyo3::prelude::*;
use pyo3::types::{PyList, PyTuple};

/// Layout of the rows of a scene's contacts.
pub struct ContactLayout {
    /// Length of the names, in characters; even, so that numbers lie at multiples of eight bytes.
    width: usize,
    objects: Vec<Vec<u8>>,
    obstacles: Vec<Vec<u8>>,
    devices: Vec<Vec<u8>>,
}

impl ContactLayout {
    /// Layout for the names of a scene.
    pub fn new(scene: &Scene) -> Self {
        let devices = scene.devices.iter().map(|device| device.name.as_str());
        let obstacles = scene.obstacles.iter().map(|obstacle| obstacle.name.as_str());
        let objects = scene.object_names.iter().map(String::as_str);
        let all = objects.clone().chain(devices.clone()).chain(obstacles.clone());
        let width = all.map(|name| name.chars().count()).max().unwrap_or(0).next_multiple_of(2).max(2);
        let encoded = |name: &str| {
            let mut bytes: Vec<u8> = name.chars().flat_map(|letter| (letter as u32).to_ne_bytes()).collect();
            bytes.resize(4 * width, 0);
            bytes
        };
        Self {
            width,
            objects: objects.map(encoded).collect(),
            obstacles: obstacles.map(encoded).collect(),
            devices: devices.map(encoded).collect(),
        }
    }

    /// Memory of a contact's row [bytes], without the number of its row in a batch.
    pub fn row_bytes(&self) -> usize {
        // Time, three vectors, gap, slip speed and device; two names.
        8 * 13 + 2 * 4 * self.width
    }

    /// Append the row of a contact of the step that ends at a time [s].
    pub fn append(&self, time_s: f64, contact: &ContactOutput, rows: &mut Vec<u8>) {
        let mut number = |number: f64| rows.extend((number + 0.0).to_ne_bytes());
        number(time_s);
        for vector in [contact.point, contact.normal, contact.force] {
            vector.to_array().into_iter().for_each(&mut number);
        }
        number(contact.gap);
        number(contact.slip_speed);
        rows.extend(&self.objects[contact.object]);
        let (name, device) = match contact.against {
            Collider::Device(at) => (&self.devices[at], at as i64),
            Collider::Obstacle(at) => (&self.obstacles[at], -1),
            Collider::Object(at) => (&self.objects[at], -1),
        };
        rows.extend(name);
        rows.extend(device.to_ne_bytes());
    }

    /// Structured array of rows, whose memory it takes.
    ///
    /// `has_rows` says whether an integer, the number of its row in a batch, stands before each contact.
    pub fn array<'py>(&self, py: Python<'py>, rows: Vec<u8>, has_rows: bool) -> PyResult<Bound<'py, PyAny>> {
        let text = format!("U{}", self.width);
        let mut fields: Vec<Bound<'py, PyAny>> = Vec::new();
        let mut field = |name: &str, kind: &str, extent: usize| {
            let one = if extent == 1 {
                (name, kind).into_pyobject(py)?
            } else {
                (name, kind, PyTuple::new(py, [extent])?).into_pyobject(py)?
            };
            fields.push(one.into_any());
            PyResult::Ok(())
        };
        if has_rows {
            field("row", "i8", 1)?;
        }
        field("time", "f8", 1)?;
        for name in ["point", "normal", "force"] {
            field(name, "f8", 3)?;
        }
        field("gap", "f8", 1)?;
        field("slip_speed", "f8", 1)?;
        field("object", &text, 1)?;
        field("against", &text, 1)?;
        field("device", "i8", 1)?;
        let dtype = py.import("numpy")?.call_method1("dtype", (PyList::new(py, fields)?,))?;
        PyArray1::from_vec(py, rows).call_method1("view", (dtype,))
    }
}
