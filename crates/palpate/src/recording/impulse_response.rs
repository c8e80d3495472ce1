//! Recorded impulse response R[s], a table (section 3.1 of the paper).
//!
//! R[s] [m/N], s = 0 … T−1, is the displacement of every observed degree of freedom s steps after a unit
//! force was **held for one step** on a touchable one, elastic part only. A column holds the responses to one touchable degree
//! of freedom: in memory as a convolution reads them ([`Column`]), in a store sample after sample, as they are computed.

use super::column::{Column, arrange_column};
use super::{carry_movable_weight, has_weight};
use crate::error::{Error, ModelError};
use crate::surface::{Surface, SurfacePoint};
use alloc::boxed::Box;
use alloc::collections::BTreeMap;
use alloc::format;
use alloc::string::String;
use alloc::vec::Vec;
use core::fmt::Debug;

/// Definition of a table's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Sampling {
    /// Displacement at the end of the step: exact and passive.
    #[default]
    End,
    /// Mean of the displacements in the middle and at the end of the step, as in the paper: not passive.
    Mean,
}

/// Storage of a table's columns: in memory, or in a store that is read on first use.
pub trait ImpulseColumns: Debug + Send + Sync {
    /// Length of every column.
    fn column_length(&self) -> usize;

    /// Check a column and load it into memory, before it is used in a step.
    ///
    /// # Errors
    /// Reason why the column cannot be used.
    fn prepare(&self, touchable: usize) -> Result<(), String>;

    /// Memory that the columns which are not loaded yet will take [bytes].
    fn missing_bytes(&self) -> u64;

    /// Column of a touchable degree of freedom, by its index in [`ImpulseResponse::touchable_dofs`]; zeros if it cannot be
    /// read.
    ///
    /// # Real time
    /// Called within a step: must neither block nor allocate once the column has been prepared.
    fn column(&self, touchable: usize) -> Column<'_>;
}

/// Recorded table of one body, with its step, samples and degrees of freedom.
#[derive(Debug)]
pub struct ImpulseResponse {
    /// Step h [s]: hold of the unit force, and spacing of samples.
    pub step_s: f64,
    /// Number of samples T.
    pub samples: usize,
    /// Definition of a sample.
    pub sampling: Sampling,
    /// Degrees of freedom where force may enter: 3·node + axis, nodes numbered as in [`Surface::source_nodes`].
    pub touchable_dofs: Vec<u32>,
    /// Degrees of freedom whose displacement is recorded, numbered alike.
    pub observed_dofs: Vec<u32>,
    /// For a body with fixed nodes: displacement [s²] per unit acceleration held for one step along each axis,
    /// (axis·T + sample)·observed + dof.
    pub gravity: Option<Vec<f64>>,
    /// Samples [m/N], by touchable degree of freedom.
    pub columns: Box<dyn ImpulseColumns>,
}

/// Columns in memory, in double precision.
pub struct ColumnsInMemory {
    numbers: Vec<f64>,
    length: usize,
}

impl ColumnsInMemory {
    /// Columns from their numbers [m/N], column after column of `length`, each sample after sample.
    pub fn new(numbers: &[f64], length: usize, samples: usize) -> Self {
        let columns = numbers.chunks_exact(length);
        let numbers = columns.flat_map(|column| arrange_column(column, samples)).collect();
        Self { numbers, length }
    }
}

impl Debug for ColumnsInMemory {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "ColumnsInMemory({} numbers)", self.numbers.len())
    }
}

impl ImpulseColumns for ColumnsInMemory {
    fn column_length(&self) -> usize {
        self.length
    }

    fn prepare(&self, _touchable: usize) -> Result<(), String> {
        Ok(())
    }

    fn missing_bytes(&self) -> u64 {
        0
    }

    fn column(&self, touchable: usize) -> Column<'_> {
        Column::F64(&self.numbers[touchable * self.length..(touchable + 1) * self.length])
    }
}

impl ImpulseResponse {
    /// Indices of the three axes of each surface node in `dofs`; none for nodes that lack an axis.
    pub(crate) fn dof_indices(surface: &Surface, dofs: &[u32]) -> Vec<Option<[u32; 3]>> {
        let indices: BTreeMap<u32, u32> = (0..).zip(dofs).map(|(index, &dof)| (dof, index)).collect();
        let index = |node: u32, axis: u32| indices.get(&node.checked_mul(3)?.checked_add(axis)?).copied();
        let of_node = |&node: &u32| Some([index(node, 0)?, index(node, 1)?, index(node, 2)?]);
        surface.source_nodes.iter().map(of_node).collect()
    }

    /// Whether the displacement of a surface point is held.
    pub fn observes(&self, surface: &Surface, point: &SurfacePoint) -> bool {
        let observed = Self::dof_indices(surface, &self.observed_dofs);
        surface.corners(point).into_iter().filter(has_weight).all(|(node, _)| observed[node].is_some())
    }

    /// Check the columns of a surface point and load them into memory, before the point is held in a scene.
    ///
    /// # Errors
    /// [`ModelError::NotTouchable`] or [`ModelError::FixedPoint`] for a point that cannot be held,
    /// [`ModelError::ImpulseResponse`] for a column that cannot be read.
    pub fn prepare(&self, surface: &Surface, point: &SurfacePoint) -> Result<(), Error> {
        let touchable = Self::dof_indices(surface, &self.touchable_dofs);
        let observed = Self::dof_indices(surface, &self.observed_dofs);
        for (node, _) in surface.corners(point).into_iter().filter(has_weight) {
            let Some(columns) = touchable[node].filter(|_| observed[node].is_some()) else {
                return Err(ModelError::NotTouchable { node: surface.source_nodes[node] }.into());
            };
            for column in columns {
                let prepared = self.columns.prepare(column as usize);
                prepared.map_err(|what| ModelError::ImpulseResponse { what })?;
            }
        }
        let is_movable = self.moves(surface.corners(point), &touchable, &observed);
        if is_movable { Ok(()) } else { Err(ModelError::FixedPoint.into()) }
    }

    /// Check all columns and load them into memory, before a scene in which contacts may come anywhere.
    ///
    /// # Errors
    /// [`ModelError::ImpulseResponse`] for a column that cannot be read.
    pub fn prepare_all(&self) -> Result<(), Error> {
        for touchable in 0..self.touchable_dofs.len() {
            self.columns.prepare(touchable).map_err(|what| ModelError::ImpulseResponse { what })?;
        }
        Ok(())
    }

    /// Surface nodes that forces may enter at, and all of them.
    pub fn touchable_share(&self, surface: &Surface) -> (usize, usize) {
        let touchable = Self::dof_indices(surface, &self.touchable_dofs);
        (touchable.iter().flatten().count(), touchable.len())
    }

    /// Whether corners with barycentric weights can move along every axis, by R[0] of their nodes, with the indices of all nodes.
    ///
    /// # Real time
    pub(crate) fn moves(
        &self,
        corners: [(usize, f64); 3],
        touchable: &[Option<[u32; 3]>],
        observed: &[Option<[u32; 3]>],
    ) -> bool {
        let used = corners.map(|(node, weight)| (node, if touchable[node].is_some() { weight } else { 0.0 }));
        carry_movable_weight(used, |node| {
            let (Some(columns), Some(rows)) = (touchable[node], observed[node]) else { return false };
            let mut pairs = columns.into_iter().zip(rows);
            pairs.all(|(column, row)| {
                let column = self.columns.column(column as usize);
                column.series(row as usize, self.samples).at(0) > 0.0
            })
        })
    }

    /// Check lengths and degrees of freedom, so that a step cannot fail.
    pub(crate) fn validate(&self, surface: &Surface) -> Result<(), ModelError> {
        let fail = |what| Err(ModelError::ImpulseResponse { what });
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
        let touchable = Self::dof_indices(surface, &self.touchable_dofs);
        let observed = Self::dof_indices(surface, &self.observed_dofs);
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
