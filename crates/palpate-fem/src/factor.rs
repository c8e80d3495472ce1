//! Sparse factors of K + s·M: with `selected_inverse` and `substitution` the only module that uses faer's sparse factorisations.
//!
//! Constrained degrees of freedom keep their row with a diagonal entry alone, so that sizes never change;
//! a right-hand side is zero there. For s ≥ 0 the factor is Cholesky's; for s < 0 the inertia of
//! L·B·Lᵀ (pivots of size one and two) counts the eigenvalues of the pencil below −s (Sylvester).

use crate::assembly::Assembly;
use crate::elimination_order::elimination_order;
use crate::kernels::{SEQUENTIAL, avx_section, row_blocks};
use crate::selected_inverse::{self, SelectedInverse};
use crate::solve_error::SolveError;
use crate::substitution::{substitute_backwards, substitute_forwards};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::perm::Perm;
use faer::reborrow::Reborrow;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::cholesky::supernodal::{
    SupernodalIntranodeLbltRef, SupernodalLltRef, SymbolicSupernodalCholesky,
};
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky,
};
use faer::sparse::{SparseColMat, SymbolicSparseColMat};
use faer::{Conj, Mat, MatMut, Side};
use rayon::prelude::*;
use std::sync::Arc;

/// Elimination order and sparsity of the factor: made once per mesh.
#[derive(Debug, Clone)]
pub struct Pattern {
    symbolic: Arc<SymbolicCholesky<usize>>,
}

/// A Cholesky factor.
#[derive(Debug)]
pub struct Factor {
    symbolic: Arc<SymbolicCholesky<usize>>,
    constrained: Vec<usize>,
    values: Vec<f64>,
}

impl Pattern {
    /// Symbolic factorisation of a body.
    ///
    /// # Errors
    /// [`SolveError::SymbolicFactor`].
    pub fn new(assembly: &Assembly) -> Result<Self, SolveError> {
        let n = assembly.nodes();
        let setup = |e: &dyn std::fmt::Debug| SolveError::SymbolicFactor(format!("{e:?}"));
        let order = elimination_order(assembly)?;
        let forward: Vec<usize> =
            order.iter().flat_map(|&node| [3 * node, 3 * node + 1, 3 * node + 2]).collect();
        let mut inverse = vec![0; forward.len()];
        forward.iter().enumerate().for_each(|(new, &old)| inverse[old] = new);
        let order = Perm::new_checked(forward.into_boxed_slice(), inverse.into_boxed_slice(), 3 * n);
        let matrix = lower_triangle(assembly, &vec![false; 3 * n], 0.0);
        let parameters = CholeskySymbolicParams {
            supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
            ..CholeskySymbolicParams::default()
        };
        let ordering = SymmetricOrdering::Custom(order.as_ref());
        let symbolic = factorize_symbolic_cholesky(matrix.symbolic(), Side::Lower, ordering, parameters)
            .map_err(|e| setup(&e))?;
        Ok(Self { symbolic: Arc::new(symbolic) })
    }

    /// Size of one factor [bytes].
    pub fn factor_bytes(&self) -> u64 {
        8 * self.symbolic.len_val() as u64
    }

    /// Entries that L⁻¹ takes to unit loads on some nodes: those of the factor on their paths to the root of the elimination tree, summed over the
    /// loads.
    pub fn path_entries(&self, nodes: &[u32]) -> u64 {
        let places = places(&self.symbolic);
        let dofs = nodes.iter().flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis));
        selected_inverse::path_entries(supernodal(&self.symbolic), dofs.map(|dof| places[dof]))
    }

    /// Cholesky factor of K + `shift`·M; `constrained` has one entry per degree of freedom.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`].
    pub fn factor(
        &self,
        assembly: &Assembly,
        constrained: &[bool],
        shift: f64,
    ) -> Result<Factor, SolveError> {
        let matrix = lower_triangle(assembly, constrained, shift);
        let mut values = vec![0.0; self.symbolic.len_val()];
        let scratch = self.symbolic.factorize_numeric_llt_scratch::<f64>(SEQUENTIAL, Default::default());
        let mut memory = MemBuffer::new(scratch);
        let factored = avx_section(|| {
            self.symbolic.factorize_numeric_llt::<f64>(
                &mut values,
                matrix.as_ref(),
                Side::Lower,
                Default::default(),
                SEQUENTIAL,
                MemStack::new(&mut memory),
                Default::default(),
            )
        });
        factored.map_err(|_| SolveError::NotPositiveDefinite)?;
        let constrained = (0..constrained.len()).filter(|&row| constrained[row]).collect();
        Ok(Factor { symbolic: self.symbolic.clone(), constrained, values })
    }

    /// Number of eigenvalues of K·φ = ω²·M·φ with ω² < `below`, rigid motions included.
    pub fn eigenvalues_below(&self, assembly: &Assembly, constrained: &[bool], below: f64) -> usize {
        let matrix = lower_triangle(assembly, constrained, -below);
        let n = matrix.ncols();
        let mut values = vec![0.0; self.symbolic.len_val()];
        let (mut subdiagonal, mut forward, mut inverse) = (vec![0.0; n], vec![0_usize; n], vec![0_usize; n]);
        let scratch =
            self.symbolic.factorize_numeric_intranode_lblt_scratch::<f64>(SEQUENTIAL, Default::default());
        let mut memory = MemBuffer::new(scratch);
        avx_section(|| {
            self.symbolic.factorize_numeric_intranode_lblt::<f64>(
                &mut values,
                &mut subdiagonal,
                &mut forward,
                &mut inverse,
                matrix.as_ref(),
                Side::Lower,
                SEQUENTIAL,
                MemStack::new(&mut memory),
                Default::default(),
            );
        });
        let supernodal = supernodal(&self.symbolic);
        let permutation = Perm::new_checked(forward.into_boxed_slice(), inverse.into_boxed_slice(), n);
        let factor = SupernodalIntranodeLbltRef::new(supernodal, &values, &subdiagonal, permutation.as_ref());
        let mut negative = 0;
        for supernode in (0..supernodal.n_supernodes()).map(|s| factor.supernode(s)) {
            let block = supernode.val();
            let mut j = 0;
            while j < block.ncols() {
                let off = subdiagonal[supernode.start() + j];
                if off == 0.0 {
                    negative += usize::from(block[(j, j)] < 0.0);
                    j += 1;
                } else {
                    let (a, c) = (block[(j, j)], block[(j + 1, j + 1)]);
                    negative += if a * c < off * off { 1 } else { 2 * usize::from(a < 0.0) };
                    j += 2;
                }
            }
        }
        negative
    }
}

impl Factor {
    /// The inverse, by its entries.
    pub fn inverse(&self) -> SelectedInverse<'_> {
        SelectedInverse::new(
            supernodal(&self.symbolic),
            &self.values,
            places(&self.symbolic),
            &self.constrained,
        )
    }

    /// Solves in place for loads that are columns. Rows of constrained degrees of freedom are zeroed first, so that
    /// their solution is zero.
    pub fn solve(&self, mut columns: MatMut<'_, f64>) {
        for &row in &self.constrained {
            columns.as_mut().row_mut(row).fill(0.0);
        }
        row_blocks(columns.transpose_mut(), COLUMNS_PER_SOLVE).into_par_iter().for_each(|columns| {
            let scratch = self.symbolic.solve_in_place_scratch::<f64>(columns.nrows(), SEQUENTIAL);
            let mut memory = MemBuffer::new(scratch);
            avx_section(|| {
                LltRef::<usize, f64>::new(&self.symbolic, &self.values).solve_in_place_with_conj(
                    Conj::No,
                    columns.transpose_mut(),
                    SEQUENTIAL,
                    MemStack::new(&mut memory),
                );
            });
        });
    }
}

/// Columns that one thread solves together: fewer read the factor too often, with more the cores wait for one another.
const COLUMNS_PER_SOLVE: usize = 8;

/// Place of each degree of freedom in the elimination order.
fn places(symbolic: &SymbolicCholesky<usize>) -> Vec<usize> {
    match symbolic.perm() {
        Some(order) => order.arrays().1.to_vec(),
        None => (0..symbolic.ncols()).collect(),
    }
}

/// Supernodes of a factor.
fn supernodal(symbolic: &SymbolicCholesky<usize>) -> &SymbolicSupernodalCholesky<usize> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(supernodal) => supernodal,
        SymbolicCholeskyRaw::Simplicial(_) => unreachable!("patterns are made with supernodes"),
    }
}

/// Number of loads from which they are solved row-wise.
const ROW_SOLVE_FROM: usize = 8;

/// Workspace of [`Factor::solve_rows`].
#[derive(Debug)]
pub struct RowWorkspace {
    permuted: Mat<f64>,
    below: Mat<f64>,
}

impl Default for RowWorkspace {
    fn default() -> Self {
        Self { permuted: Mat::zeros(0, 0), below: Mat::zeros(0, 0) }
    }
}

impl Factor {
    /// Solves in place for loads that are rows: a row per load, a column per degree of freedom. Faster than
    /// [`Self::solve`] for many solves with a few dozen loads, since whole columns are gathered and scattered. The last
    /// bits depend on the number of loads.
    pub fn solve_rows(&self, mut loads: MatMut<'_, f64>, workspace: &mut RowWorkspace) {
        let (k, n) = (loads.nrows(), loads.ncols());
        if k < ROW_SOLVE_FROM {
            let mut columns = loads.rb().transpose().to_owned();
            self.solve(columns.as_mut());
            loads.copy_from(columns.transpose());
            return;
        }
        for &column in &self.constrained {
            loads.as_mut().col_mut(column).fill(0.0);
        }
        let symbolic = supernodal(&self.symbolic);
        let factor = SupernodalLltRef::new(symbolic, &self.values);
        let supernodes = || (0..symbolic.n_supernodes()).map(|s| factor.supernode(s));
        if workspace.permuted.nrows() != k || workspace.permuted.ncols() != n {
            let widest = supernodes().map(|supernode| supernode.pattern().len()).max().unwrap_or(0);
            *workspace = RowWorkspace { permuted: Mat::zeros(k, n), below: Mat::zeros(k, widest) };
        }
        let RowWorkspace { permuted: x, below } = workspace;
        let order = self.symbolic.perm();
        let forward = order.as_ref().map(|order| order.arrays().0);
        let at = |new: usize| forward.map_or(new, |forward| forward[new]);
        for new in 0..n {
            x.col_mut(new).copy_from(loads.as_ref().col(at(new)));
        }
        for supernode in supernodes() {
            substitute_forwards(supernode, supernode.start(), x.as_mut(), below.as_mut(), |place| place);
        }
        for supernode in supernodes().rev() {
            substitute_backwards(supernode, supernode.start(), x.as_mut(), below.as_mut(), |place| place);
        }
        for new in 0..n {
            loads.as_mut().col_mut(at(new)).copy_from(x.col(new));
        }
    }
}

/// Lower triangle of K + `shift`·M in compressed columns.
fn lower_triangle(assembly: &Assembly, constrained: &[bool], shift: f64) -> SparseColMat<usize, f64> {
    let n = assembly.nodes();
    // Constrained entries stay as zeros, so that one pattern serves every set of constraints; on the diagonal
    // they keep their own stiffness, so that the scaling stays even.
    let (mut offsets, mut rows, mut values) = (vec![0], Vec::new(), Vec::new());
    for node in 0..n {
        let row = assembly.offsets[node]..assembly.offsets[node + 1];
        for axis in 0..3 {
            let column = 3 * node + axis;
            for at in row.clone() {
                let other = assembly.columns[at] as usize;
                for part in 0..3 {
                    let line = 3 * other + part;
                    if line < column {
                        continue;
                    }
                    let is_constrained = constrained[line] || constrained[column];
                    // K is symmetric: entry (line, column) is block(node, other)[axis][part].
                    let mut value = assembly.stiffness[at].col(part)[axis];
                    if part == axis && !is_constrained {
                        value += shift * assembly.mass[at];
                    }
                    if is_constrained && line != column {
                        value = 0.0;
                    }
                    rows.push(line);
                    values.push(value);
                }
            }
            offsets.push(rows.len());
        }
    }
    let symbolic = SymbolicSparseColMat::new_checked(3 * n, 3 * n, offsets, None, rows);
    SparseColMat::new(symbolic, values)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::discretisation::Discretisation;
    use crate::element::ElementOrder;
    use palpate::Material;
    use palpate_mesh::box_mesh;

    fn assembly(cells: [u32; 3], order: ElementOrder) -> (Assembly, Discretisation) {
        let mesh = box_mesh([0.3, 0.2, 0.1], cells).expect("a good box");
        let discretisation = Discretisation::new(&mesh, order);
        let material = Material::isotropic(1e4, 0.3, 1000.0);
        (Assembly::new(&discretisation, &[material]), discretisation)
    }

    #[test]
    fn row_solutions_are_those_of_the_columns() {
        let (assembly, discretisation) = assembly([5, 4, 3], ElementOrder::Linear);
        let pattern = Pattern::new(&assembly).expect("a pattern");
        let mut constrained = vec![false; discretisation.dofs()];
        constrained[..9].fill(true);
        for constrained in [constrained.clone(), vec![false; constrained.len()]] {
            let factor = pattern.factor(&assembly, &constrained, 1e3).expect("a factor");
            for loads in [1, 7, 8, 48] {
                let mut columns =
                    Mat::from_fn(discretisation.dofs(), loads, |i, j| ((7 * i + 13 * j) % 101) as f64 - 50.0);
                let mut rows = columns.transpose().to_owned();
                factor.solve(columns.as_mut());
                factor.solve_rows(rows.as_mut(), &mut RowWorkspace::default());
                let difference = (columns.transpose() - &rows).norm_max();
                // Round-off of a system of condition up to 1e4.
                assert!(difference < 1e-11 * columns.norm_max(), "{loads}: {difference:e}");
            }
        }
    }

    #[test]
    fn selected_entries_of_the_inverse_are_those_of_solutions() {
        let (assembly, discretisation) = assembly([5, 4, 3], ElementOrder::Quadratic);
        let pattern = Pattern::new(&assembly).expect("a pattern");
        let mut constrained = vec![false; discretisation.dofs()];
        constrained[..9].fill(true);
        let factor = pattern.factor(&assembly, &constrained, 0.0).expect("a factor");
        let inverse = factor.inverse();
        let last = discretisation.dofs() - 1;
        // Among them loads and rows that are constrained, the same, and far from each other in the elimination tree.
        let every = |stride: usize| (0..=last).step_by(stride).collect::<Vec<_>>();
        for (loads, rows) in [
            (vec![last], vec![last]),
            (vec![4], every(7)),
            (vec![last, 4, 100, 101, 400], vec![3, 50, last]),
            (every(31), every(1)),
            (every(1), every(41)),
        ] {
            let mut solved = Mat::zeros(discretisation.dofs(), loads.len());
            loads.iter().enumerate().for_each(|(j, &load)| solved[(load, j)] = 1.0);
            factor.solve(solved.as_mut());
            let entries = inverse.block(&loads, &rows);
            let difference = |(i, j): (usize, usize)| (entries[(j, i)] - solved[(rows[i], j)]).abs();
            let pairs = (0..rows.len()).flat_map(|i| (0..loads.len()).map(move |j| (i, j)));
            let largest = pairs.map(difference).fold(0.0, f64::max);
            assert!(largest <= 1e-11 * solved.norm_max(), "{loads:?}: {largest:e}");
        }
    }
}
