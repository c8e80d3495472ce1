//! The paper's recorded impulse response R[s], a table (section 3.1 of the paper).
//!
//! R[s] [m/N], s = 0 … T−1, is the displacement of every observed degree of freedom s steps after a unit
//! force was **held for one step** on a touchable one, elastic part only. A column holds all samples of one
//! touchable degree of freedom, sample after sample, each with all observed ones, little-endian.

use crate::error::Error;
use crate::surface::{Surface, SurfacePoint};
use alloc::boxed::Box;
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use core::fmt::Debug;

/// What a sample of a table is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// The displacement at the end of the step: exact, and passive.
    #[default]
    End,
    /// The mean of the displacements in the middle and at the end of the step, as in the paper: not passive.
    Mean,
}

/// One column of a table, little-endian bytes.
#[derive(Debug, Clone, Copy)]
pub enum Column<'a> {
    /// Single precision.
    F32(&'a [u8]),
    /// Double precision.
    F64(&'a [u8]),
}

/// Where the columns of a table lie: in memory, or in a file that is mapped.
pub trait ImpulseColumns: Debug + Send + Sync {
    /// How many numbers every column holds.
    fn column_length(&self) -> usize;

    /// Check a column and bring it into memory, before it is used in a step.
    ///
    /// # Errors
    /// Says why it can't be used.
    fn prepare(&self, touchable: usize) -> Result<(), String>;

    /// The column of a touchable degree of freedom, by its position in [`ImpulseResponse::touchable_dofs`]; zeros if it
    /// can't be read.
    ///
    /// # Real time
    /// Called within a step: must neither block nor allocate once the column has been prepared.
    fn column(&self, touchable: usize) -> Column<'_>;
}

/// A recorded table with what it needs to be used.
#[derive(Debug)]
pub struct ImpulseResponse {
    /// Step h [s] that the unit force is held for, and between samples.
    pub step_s: f64,
    /// Number of samples T.
    pub samples: usize,
    /// What a sample is.
    pub sampling: Sampling,
    /// Degrees of freedom where force may enter: 3·node + axis, nodes numbered as in [`Surface::source_nodes`].
    pub touchable_dofs: Vec<u32>,
    /// Degrees of freedom whose displacement is recorded, numbered alike.
    pub observed_dofs: Vec<u32>,
    /// For a body with fixed nodes: displacement [s²] per unit acceleration held for one step along each axis,
    /// (axis·T + sample)·observed + dof.
    pub gravity: Option<Vec<f64>>,
    /// The numbers.
    pub columns: Box<dyn ImpulseColumns>,
}

/// Columns in memory, in double precision.
pub struct ColumnsInMemory {
    bytes: Vec<u8>,
    column_bytes: usize,
}

/// Marks a surface degree of freedom that a table does not hold.
const NONE: u32 = u32::MAX;

impl Column<'_> {
    /// One number [m/N], by its place sample·observed + dof.
    ///
    /// # Real time
    #[inline]
    pub fn at(&self, place: usize) -> f64 {
        match self {
            Self::F32(bytes) => f64::from(f32::from_le_bytes(array(&bytes[4 * place..4 * place + 4]))),
            Self::F64(bytes) => f64::from_le_bytes(array(&bytes[8 * place..8 * place + 8])),
        }
    }

    /// Add `scale` times the numbers from `place` on to `sum`.
    ///
    /// # Real time
    pub fn add_to(&self, place: usize, scale: f64, sum: &mut [f64]) {
        match self {
            Self::F32(bytes) => {
                let (numbers, _) = bytes[4 * place..4 * (place + sum.len())].as_chunks::<4>();
                for (s, number) in sum.iter_mut().zip(numbers) {
                    *s += scale * f64::from(f32::from_le_bytes(*number));
                }
            }
            Self::F64(bytes) => {
                let (numbers, _) = bytes[8 * place..8 * (place + sum.len())].as_chunks::<8>();
                for (s, number) in sum.iter_mut().zip(numbers) {
                    *s += scale * f64::from_le_bytes(*number);
                }
            }
        }
    }
}

#[inline]
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    core::array::from_fn(|i| bytes[i])
}

impl ColumnsInMemory {
    /// Columns one after the other, each `column_length` numbers [m/N].
    pub fn new(values: &[f64], column_length: usize) -> Self {
        Self { bytes: values.iter().flat_map(|v| v.to_le_bytes()).collect(), column_bytes: 8 * column_length }
    }
}

impl Debug for ColumnsInMemory {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "ColumnsInMemory({} bytes)", self.bytes.len())
    }
}

impl ImpulseColumns for ColumnsInMemory {
    fn column_length(&self) -> usize {
        self.column_bytes / 8
    }

    fn prepare(&self, _touchable: usize) -> Result<(), String> {
        Ok(())
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        Column::F64(&self.bytes[touchable * self.column_bytes..(touchable + 1) * self.column_bytes])
    }
}

impl ImpulseResponse {
    /// Where the three axes of each surface node stand among `dofs`, or `None` for those that are not all there.
    pub(crate) fn places(surface: &Surface, dofs: &[u32]) -> Vec<Option<[u32; 3]>> {
        let largest = surface.source_nodes.iter().copied().max().unwrap_or(0) as usize;
        let mut place = vec![NONE; 3 * (largest + 1)];
        for (at, &dof) in dofs.iter().enumerate() {
            if let Some(slot) = place.get_mut(dof as usize) {
                *slot = at as u32;
            }
        }
        let of_node = |&node: &u32| {
            let axes = [0, 1, 2].map(|axis| place[3 * node as usize + axis]);
            (!axes.contains(&NONE)).then_some(axes)
        };
        surface.source_nodes.iter().map(of_node).collect()
    }

    /// Check the columns of a surface point and bring them into memory, before it is held in a scene.
    ///
    /// # Errors
    /// When the point is not touchable, nothing can move there, or a column can't be read.
    pub fn prepare(&self, surface: &Surface, point: &SurfacePoint) -> Result<(), Error> {
        let fail = |what| Err(Error::Model(what));
        let touchable = Self::places(surface, &self.touchable_dofs);
        let observed = Self::places(surface, &self.observed_dofs);
        let mut moves = false;
        for (node, _) in surface.corners(point).into_iter().filter(|(_, weight)| *weight != 0.0) {
            let (Some(columns), Some(rows)) = (touchable[node], observed[node]) else {
                return fail(format!(
                    "the point is not touchable in the impulse response: node {} was left out when it was recorded",
                    surface.source_nodes[node]
                ));
            };
            for (column, row) in columns.into_iter().zip(rows) {
                self.columns.prepare(column as usize).map_err(Error::Model)?;
                moves |= self.columns.column(column as usize).at(row as usize) > 0.0;
            }
        }
        if moves { Ok(()) } else { fail("the point lies on fixed nodes: no hand can move it".into()) }
    }

    /// Refuse what a step could trip over.
    pub(crate) fn validate(&self, surface: &Surface) -> Result<(), Error> {
        let fail = |what| Err(Error::Model(what));
        if self.samples == 0 || self.touchable_dofs.is_empty() || self.observed_dofs.is_empty() {
            return fail("the impulse response holds nothing".into());
        }
        let length = self.samples * self.observed_dofs.len();
        if self.columns.column_length() != length {
            return fail(format!(
                "columns of the impulse response hold {} numbers, expected {length}",
                self.columns.column_length()
            ));
        }
        if self.gravity.as_ref().is_some_and(|g| g.len() != 3 * length) {
            return fail("the gravity response does not fit the impulse response".into());
        }
        let touchable = Self::places(surface, &self.touchable_dofs);
        let observed = Self::places(surface, &self.observed_dofs);
        let mut unseen = touchable.iter().zip(&observed).filter(|(t, o)| t.is_some() && o.is_none());
        if unseen.next().is_some() {
            return fail("the impulse response has touchable nodes that are not observed".into());
        }
        if touchable.iter().all(Option::is_none) {
            return fail("no touchable degree of freedom of the impulse response is on the surface".into());
        }
        Ok(())
    }
}
