//! `palpate.Recording`: the recording of one elastic body, as arrays.

use crate::arrays::{array, flat, read_only};
use crate::errors::{Class, catch_panic, exception, input_error, internal_error, scene_error};
use crate::scalars::{FilePath, Whole};
use numpy::{PyArray1, PyArrayMethods};
use palpate::{Damping, Support};
use palpate_export::write_atomically;
use palpate_scene::read_recording;
use pyo3::prelude::*;
use pyo3::sync::PyOnceLock;
use pyo3::types::PyBytes;
use std::f64::consts::TAU;
use std::sync::Arc;

/// Largest number of nodes whose residual compliance is given as one matrix: 1.2 GB.
const MAX_COMPLIANCE_NODES: usize = 4096;

/// Recording of one elastic body: its surface, mass, elastic modes, residual compliance and certificate.
///
/// Made by :func:`palpate.record`, or read from a file by :meth:`open`. Arrays are read-only; positions are in metres in the body frame, whose
/// origin is the centre of mass.
#[pyclass(frozen, module = "palpate")]
pub struct Recording {
    /// Recording, which scenes share.
    pub inner: Arc<palpate::Recording>,
    positions: PyOnceLock<Py<PyAny>>,
    triangles: PyOnceLock<Py<PyAny>>,
    mode_shapes: PyOnceLock<Py<PyAny>>,
}

impl Recording {
    /// Python's view of a recording.
    pub fn new(inner: palpate::Recording) -> Self {
        Self {
            inner: Arc::new(inner),
            positions: PyOnceLock::new(),
            triangles: PyOnceLock::new(),
            mode_shapes: PyOnceLock::new(),
        }
    }

    /// Part of the metadata as Python has JSON.
    fn json<'py>(py: Python<'py>, text: serde_json::Result<String>) -> PyResult<Bound<'py, PyAny>> {
        let text = text.map_err(|error| exception(py, Class::Recording, error))?;
        py.import("json")?.call_method1("loads", (text,))
    }

    fn bytes(&self, py: Python<'_>) -> PyResult<Vec<u8>> {
        let bytes = py.detach(|| catch_panic(|| self.inner.to_bytes()));
        let bytes = bytes.map_err(|text| internal_error(py, &text))?;
        bytes.map_err(|error| exception(py, Class::Recording, error))
    }
}

#[pymethods]
impl Recording {
    /// Recording of a file that `palpate record` or :meth:`save` wrote.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    ///     File, usually `*.palp`.
    ///
    /// Raises
    /// ------
    /// FileError
    ///     If the file cannot be read.
    /// RecordingError
    ///     If it is no recording, or damaged.
    #[staticmethod]
    fn open(py: Python<'_>, path: FilePath) -> PyResult<Self> {
        let FilePath(path) = path;
        let read = py.detach(|| catch_panic(|| read_recording(&path)));
        let read = read.map_err(|text| internal_error(py, &text))?;
        read.map(Self::new).map_err(|error| scene_error(py, &error))
    }

    /// Recording from the bytes of its file.
    #[staticmethod]
    fn from_bytes(py: Python<'_>, data: &[u8]) -> PyResult<Self> {
        let read = catch_panic(|| palpate::Recording::from_bytes(data));
        let read = read.map_err(|text| internal_error(py, &text))?;
        read.map(Self::new).map_err(|error| exception(py, Class::Recording, error))
    }

    /// Bytes of the recording's file.
    fn to_bytes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyBytes>> {
        Ok(PyBytes::new(py, &self.bytes(py)?))
    }

    /// Write the recording to a file, which is whole or not there.
    ///
    /// Parameters
    /// ----------
    /// path : str or path
    ///     File, usually `*.palp`.
    fn save(&self, py: Python<'_>, path: FilePath) -> PyResult<()> {
        let FilePath(path) = path;
        let bytes = self.bytes(py)?;
        py.detach(|| write_atomically(&path, &bytes)).map_err(|error| scene_error(py, &error.into()))
    }

    /// Pickle by the bytes of the file.
    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (Bound<'py, PyBytes>,))> {
        let class = py.get_type::<Self>();
        Ok((class.getattr("from_bytes")?, (self.to_bytes(py)?,)))
    }

    /// Rest positions of the surface nodes [m, body frame]: float64 of shape (nodes, 3).
    #[getter]
    fn positions(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let positions = &self.inner.surface.positions;
        let make = || {
            let numbers = flat(positions.iter().copied());
            Ok::<_, PyErr>(read_only(array(py, numbers, &[positions.len(), 3])?)?.unbind())
        };
        Ok(self.positions.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// Surface triangles, counter-clockwise seen from outside: uint32 of shape (triangles, 3).
    #[getter]
    fn triangles(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let triangles = &self.inner.surface.triangles;
        let make = || {
            let numbers: Vec<u32> = triangles.iter().flatten().copied().collect();
            let shaped = PyArray1::from_vec(py, numbers).reshape([triangles.len(), 3])?;
            Ok::<_, PyErr>(read_only(shaped.into_any())?.unbind())
        };
        Ok(self.triangles.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// Numbers of the surface nodes in the mesh that was recorded: uint32 of shape (nodes,).
    #[getter]
    fn source_nodes<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        PyArray1::from_slice(py, &self.inner.surface.source_nodes).into_any()
    }

    /// Mode shapes at the surface, orthonormal in the mass matrix [1/√kg]: float64 of shape (nodes, 3, modes).
    #[getter]
    fn mode_shapes(&self, py: Python<'_>) -> PyResult<Py<PyAny>> {
        let (nodes, modes) = (self.inner.surface.positions.len(), self.inner.modes.len());
        let make = || {
            let shapes = self.inner.modes.mode_shapes.clone();
            Ok::<_, PyErr>(read_only(array(py, shapes, &[nodes, 3, modes])?)?.unbind())
        };
        Ok(self.mode_shapes.get_or_try_init(py, make)?.clone_ref(py))
    }

    /// Natural frequencies [Hz], ascending: float64 of shape (modes,).
    #[getter]
    fn frequencies<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        let omega = self.inner.modes.angular_frequencies.iter();
        PyArray1::from_vec(py, omega.map(|omega| omega / TAU).collect()).into_any()
    }

    /// Damping ratios [1]: float64 of shape (modes,).
    #[getter]
    fn damping_ratios<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        PyArray1::from_slice(py, &self.inner.modes.damping_ratios).into_any()
    }

    /// Rayleigh's α [1/s] and β [s]; None if all modes have one damping ratio.
    #[getter]
    fn rayleigh(&self) -> Option<(f64, f64)> {
        match self.inner.metadata.damping {
            Damping::Rayleigh { alpha, beta } => Some((alpha, beta)),
            Damping::Ratio(_) => None,
        }
    }

    /// Mass [kg].
    #[getter]
    fn mass(&self) -> f64 {
        self.inner.mass()
    }

    /// Inertia about the centre of mass [kg·m², body frame]: float64 of shape (3, 3).
    #[getter]
    fn inertia<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        array(py, self.inner.inertia().transpose().to_cols_array().to_vec(), &[3, 3])
    }

    /// Centre of mass in the frame of the mesh [m]: float64 of shape (3,).
    #[getter]
    fn center_of_mass<'py>(&self, py: Python<'py>) -> Bound<'py, PyAny> {
        PyArray1::from_slice(py, &self.inner.metadata.mass.center_of_mass_m).into_any()
    }

    /// Whether nodes are fixed, held or on springs.
    #[getter]
    fn is_fixed(&self) -> bool {
        self.inner.metadata.support == Support::Fixed
    }

    /// Errors against the unreduced finite element model, by name (docs/recording.md), lengths in metres and errors as shares; None without a certificate.
    #[getter]
    fn certificate<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::json(py, serde_json::to_string(&self.inner.metadata.certificate))
    }

    /// All metadata of the file: material, damping, mass, mesh, certificate, origin.
    #[getter]
    fn metadata<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Self::json(py, serde_json::to_string(&self.inner.metadata))
    }

    /// Static compliance S of the modes that are not kept [m/N].
    ///
    /// Parameters
    /// ----------
    /// nodes : sequence of int, optional
    ///     Surface nodes; all without it.
    ///
    /// Returns
    /// -------
    /// numpy.ndarray
    ///     float64 of shape (3·k, 3·k) for k nodes, symmetric; row 3·i + axis belongs to `nodes[i]`.
    #[pyo3(signature = (nodes=None))]
    fn residual_compliance<'py>(
        &self,
        py: Python<'py>,
        nodes: Option<Vec<Whole>>,
    ) -> PyResult<Bound<'py, PyAny>> {
        let all = self.inner.surface.positions.len();
        let nodes: Vec<usize> = match nodes {
            None => (0..all).collect(),
            Some(nodes) => {
                let nodes: Vec<i64> = nodes.into_iter().map(|Whole(node)| node).collect();
                let known = |node: &i64| usize::try_from(*node).ok().filter(|node| *node < all);
                let unknown = nodes.iter().find(|node| known(node).is_none());
                if let Some(node) = unknown {
                    return Err(input_error(
                        py,
                        format!("nodes has {node}, expected 0 to {}", all.saturating_sub(1)),
                    ));
                }
                nodes.iter().filter_map(known).collect()
            }
        };
        if nodes.len() > MAX_COMPLIANCE_NODES {
            let message = format!(
                "the residual compliance of {} nodes is a matrix of {:.1} GB; give at most {MAX_COMPLIANCE_NODES} nodes at a time",
                nodes.len(),
                9.0 * 8e-9 * (nodes.len() as f64).powi(2)
            );
            return Err(input_error(py, message));
        }
        let size = 3 * nodes.len();
        let matrix = py.detach(|| {
            let mut matrix = vec![0.0; size * size];
            for (row, &i) in nodes.iter().enumerate() {
                for (column, &j) in nodes.iter().enumerate() {
                    let block = self.inner.residual_between(i, j);
                    for axis in 0..3 {
                        let start = (3 * row + axis) * size + 3 * column;
                        matrix[start..start + 3].copy_from_slice(&block.row(axis).to_array());
                    }
                }
            }
            matrix
        });
        array(py, matrix, &[size, size])
    }

    fn __repr__(&self) -> String {
        let metadata = &self.inner.metadata;
        format!(
            "<palpate.Recording of {:?}: {} surface nodes, {} modes, {:.6} kg, {}>",
            metadata.provenance.source,
            self.inner.surface.positions.len(),
            self.inner.modes.len(),
            self.inner.mass(),
            if self.is_fixed() { "fixed" } else { "free" }
        )
    }
}
