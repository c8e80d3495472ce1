//! Substitution with a supernode of a Cholesky factor, for loads that are rows: whole columns are gathered and scattered.

use crate::kernels::{multiply, solve_lower, solve_upper};
use faer::reborrow::{Reborrow, ReborrowMut};
use faer::sparse::linalg::cholesky::supernodal::SupernodeRef;
use faer::{Accum, MatMut, unzip, zip};

/// Part of a supernode in Xᵀ ← L⁻¹·Xᵀ; the matrix holds X, whose columns of the supernode begin at `start`. `column` gives that of a place in the
/// elimination order below it.
pub(crate) fn substitute_forwards(
    supernode: SupernodeRef<'_, usize, f64>,
    start: usize,
    mut x: MatMut<'_, f64>,
    below: MatMut<'_, f64>,
    column: impl Fn(usize) -> usize,
) {
    let (block, pattern) = (supernode.val(), supernode.pattern());
    let (diagonal, off) = block.split_at_row(block.ncols());
    let mut own = x.rb_mut().subcols_mut(start, block.ncols());
    solve_lower(diagonal, own.rb_mut().transpose_mut());
    let mut change = below.subcols_mut(0, pattern.len());
    multiply(change.rb_mut(), Accum::Replace, own.rb(), off.transpose(), 1.0);
    for (i, &place) in pattern.iter().enumerate() {
        zip!(x.rb_mut().col_mut(column(place)), change.rb().col(i))
            .for_each(|unzip!(x, change)| *x -= *change);
    }
}

/// Part of a supernode in Xᵀ ← L⁻ᵀ·Xᵀ, as [`substitute_forwards`].
pub(crate) fn substitute_backwards(
    supernode: SupernodeRef<'_, usize, f64>,
    start: usize,
    x: MatMut<'_, f64>,
    below: MatMut<'_, f64>,
    column: impl Fn(usize) -> usize,
) {
    let (block, pattern) = (supernode.val(), supernode.pattern());
    let (diagonal, off) = block.split_at_row(block.ncols());
    let mut known = below.subcols_mut(0, pattern.len());
    for (i, &place) in pattern.iter().enumerate() {
        known.rb_mut().col_mut(i).copy_from(x.rb().col(column(place)));
    }
    let mut own = x.subcols_mut(start, block.ncols());
    multiply(own.rb_mut(), Accum::Add, known.rb(), off, -1.0);
    solve_upper(diagonal.transpose(), own.rb_mut().transpose_mut());
}
