//! Assembly of the stiffness and mass matrices, in 3×3 blocks by node pairs.
//!
//! K [N/m] has a block for each pair of nodes that share an element; the consistent mass M [kg] is a
//! number times the unit matrix for each, so both share one sparsity.
//!
//! Equations: docs/theory.md (C1), (C2).

use crate::discretisation::Discretisation;
use crate::element::{Elasticity, ElementMatrices};
use faer::{Mat, MatRef};
use glam::DMat3;
use palpate::Material;
use rayon::prelude::*;

/// Stiffness K and mass M on a common sparsity, both triangles, rows sorted.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// Start of each node's row; length nodes + 1.
    pub offsets: Vec<usize>,
    /// Column nodes, ascending within a row.
    pub columns: Vec<u32>,
    /// Stiffness blocks [N/m].
    pub stiffness: Vec<DMat3>,
    /// Mass entries [kg].
    pub mass: Vec<f64>,
}

/// Selection of a matrix of the system.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SystemMatrix {
    /// Stiffness K [N/m].
    Stiffness,
    /// Mass M [kg].
    Mass,
}

impl Assembly {
    /// Sums the element matrices; `materials` has one entry per region.
    pub fn new(discretisation: &Discretisation, materials: &[Material]) -> Self {
        let n = discretisation.nodes.len();
        let per = discretisation.order.nodes();

        // Pattern: elements of each node, then their nodes.
        let mut starts = vec![0_usize; n + 1];
        discretisation.elements.iter().for_each(|&node| starts[node as usize + 1] += 1);
        (0..n).for_each(|i| starts[i + 1] += starts[i]);
        let mut owners = vec![0_u32; discretisation.elements.len()];
        let mut fill = starts.clone();
        for (at, &node) in discretisation.elements.iter().enumerate() {
            owners[fill[node as usize]] = (at / per) as u32;
            fill[node as usize] += 1;
        }
        let element = |e: u32| &discretisation.elements[e as usize * per..][..per];
        let rows: Vec<Vec<u32>> = (0..n)
            .into_par_iter()
            .map(|node| {
                let of_node = &owners[starts[node]..starts[node + 1]];
                let mut row: Vec<u32> = of_node.iter().flat_map(|&e| element(e)).copied().collect();
                row.sort_unstable();
                row.dedup();
                row
            })
            .collect();
        let mut offsets = vec![0; n + 1];
        rows.iter().enumerate().for_each(|(i, row)| offsets[i + 1] = offsets[i] + row.len());
        let columns = rows.concat();

        // Values.
        let elasticities: Vec<Elasticity> = materials.iter().map(Elasticity::new).collect();
        let mut stiffness = vec![DMat3::ZERO; columns.len()];
        let mut mass = vec![0.0; columns.len()];
        let mut positions = Vec::with_capacity(per);
        for (nodes, &region) in discretisation.element_nodes().zip(&discretisation.regions) {
            positions.clear();
            positions.extend(nodes.iter().map(|&node| discretisation.nodes[node as usize]));
            let ElementMatrices { stiffness: k, mass: m } =
                discretisation.order.matrices(&positions, &elasticities[region as usize]);
            for (i, &node) in nodes.iter().enumerate() {
                let row = offsets[node as usize]..offsets[node as usize + 1];
                for (j, other) in nodes.iter().enumerate() {
                    if let Ok(at) = columns[row.clone()].binary_search(other) {
                        stiffness[row.start + at] += k[i * per + j];
                        mass[row.start + at] += m[i * per + j];
                    }
                }
            }
        }
        Self { offsets, columns, stiffness, mass }
    }

    /// Adds a stiffness [N/m] between two nodes that share an element.
    pub fn add_stiffness(&mut self, node: u32, other: u32, block: DMat3) {
        let row = self.offsets[node as usize]..self.offsets[node as usize + 1];
        if let Ok(at) = self.columns[row.clone()].binary_search(&other) {
            self.stiffness[row.start + at] += block;
        }
    }

    /// Number of nodes.
    pub fn nodes(&self) -> usize {
        self.offsets.len() - 1
    }

    /// Product K·X or M·X with a block of columns of 3·nodes rows.
    pub fn multiply(&self, which: SystemMatrix, x: MatRef<'_, f64>) -> Mat<f64> {
        let mut y = Mat::zeros(x.nrows(), x.ncols());
        let columns: Vec<_> = y.col_iter_mut().zip(x.col_iter()).collect();
        columns.into_par_iter().for_each(|(mut out, column)| {
            let column: Vec<f64> = column.iter().copied().collect();
            let at = |node: u32| glam::DVec3::from_slice(&column[3 * node as usize..]);
            for node in 0..self.nodes() {
                let row = self.offsets[node]..self.offsets[node + 1];
                let nodes = self.columns[row.clone()].iter();
                let sum: glam::DVec3 = match which {
                    SystemMatrix::Stiffness => {
                        nodes.zip(&self.stiffness[row]).map(|(&c, k)| *k * at(c)).sum()
                    }
                    SystemMatrix::Mass => nodes.zip(&self.mass[row]).map(|(&c, &m)| at(c) * m).sum(),
                };
                for (axis, value) in sum.to_array().into_iter().enumerate() {
                    out[3 * node + axis] = value;
                }
            }
        });
        y
    }

    /// Product X·M with vectors that are rows, of 3·nodes columns.
    pub fn mass_times_rows(&self, x: &Mat<f64>, y: &mut Mat<f64>) {
        for node in 0..self.nodes() {
            for axis in 0..3 {
                let sum = y.col_as_slice_mut(3 * node + axis);
                sum.fill(0.0);
                for at in self.offsets[node]..self.offsets[node + 1] {
                    let other = x.col_as_slice(3 * self.columns[at] as usize + axis);
                    let mass = self.mass[at];
                    sum.iter_mut().zip(other).for_each(|(sum, x)| *sum += mass * x);
                }
            }
        }
    }
}
