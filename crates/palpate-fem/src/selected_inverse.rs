//! Selected entries of the inverse of a factored matrix.
//!
//! A⁻¹ = L⁻ᵀ·L⁻¹. Of a unit load, L⁻¹ fills the supernodes on the path from the load's own to the root of the elimination tree, and a row of L⁻ᵀ
//! needs those on the path from the row's own. So a block of loads and rows is solved on the union of their paths alone.
//! References: Gilbert 1994, SIAM J. Matrix Anal. Appl. 15, 62; Amestoy, Duff, L'Excellent, Robert, Rouet & Uçar 2012, SIAM J. Sci.
//! Comput. 34, A1975.
//!
//! Equations: docs/theory.md (C91).

use crate::substitution::{substitute_backwards, substitute_forwards};
use faer::Mat;
use faer::sparse::linalg::cholesky::supernodal::{SupernodalLltRef, SymbolicSupernodalCholesky};

/// Elimination tree of the supernodes of a factor.
struct EliminationTree {
    /// Supernode of each place in the elimination order.
    supernodes: Vec<u32>,
    /// Parent of each supernode: where the first row below its diagonal block lies.
    parents: Vec<Option<u32>>,
}

impl EliminationTree {
    fn new(symbolic: &SymbolicSupernodalCholesky<usize>) -> Self {
        let mut supernodes = Vec::with_capacity(symbolic.ncols());
        for (s, &end) in symbolic.supernode_end().iter().enumerate() {
            supernodes.resize(end, s as u32);
        }
        let first = |s: usize| symbolic.supernode(s).pattern().iter().min();
        let parents =
            (0..symbolic.n_supernodes()).map(|s| first(s).map(|&first| supernodes[first])).collect();
        Self { supernodes, parents }
    }
}

/// Entries of the factor on the paths of places in the elimination order to the root, summed over the places.
pub(crate) fn path_entries(
    symbolic: &SymbolicSupernodalCholesky<usize>,
    places: impl Iterator<Item = usize>,
) -> u64 {
    let EliminationTree { supernodes, parents } = EliminationTree::new(symbolic);
    let starts = symbolic.col_ptr_for_val();
    let mut paths: Vec<u64> = starts.windows(2).map(|ends| (ends[1] - ends[0]) as u64).collect();
    for s in (0..paths.len()).rev() {
        paths[s] += parents[s].map_or(0, |parent| paths[parent as usize]);
    }
    places.map(|place| paths[supernodes[place] as usize]).sum()
}

/// Inverse of a factored matrix, by its entries.
pub(crate) struct SelectedInverse<'a> {
    factor: SupernodalLltRef<'a, usize, f64>,
    tree: EliminationTree,
    /// Place of each degree of freedom in the elimination order, and whether it is constrained: a row and column of zeros.
    places: Vec<usize>,
    is_constrained: Vec<bool>,
}

/// Path of a supernode that a block of loads or rows needs.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
struct Need {
    loads: bool,
    rows: bool,
}

impl<'a> SelectedInverse<'a> {
    /// Inverse by a factor, the place of each degree of freedom in its elimination order, and the constrained degrees of freedom.
    pub(crate) fn new(
        symbolic: &'a SymbolicSupernodalCholesky<usize>,
        values: &'a [f64],
        places: Vec<usize>,
        constrained: &[usize],
    ) -> Self {
        let factor = SupernodalLltRef::new(symbolic, values);
        let mut is_constrained = vec![false; places.len()];
        constrained.iter().for_each(|&dof| is_constrained[dof] = true);
        Self { factor, tree: EliminationTree::new(symbolic), places, is_constrained }
    }

    /// Place of a degree of freedom in the elimination order: near ones share most of their path to the root.
    pub(crate) fn place(&self, dof: usize) -> usize {
        self.places[dof]
    }

    /// Entries of the inverse between loads and rows, which are degrees of freedom: a row per load, a column per row.
    pub(crate) fn block(&self, loads: &[usize], rows: &[usize]) -> Mat<f64> {
        let mut needs = vec![Need::default(); self.tree.parents.len()];
        self.mark(loads, &mut needs, |need| &mut need.loads);
        self.mark(rows, &mut needs, |need| &mut need.rows);
        // First column of each supernode on a path in the compressed solution, which has a row per load.
        let mut starts = vec![usize::MAX; needs.len()];
        let mut width = 0;
        let on_paths = || needs.iter().enumerate().filter(|(_, need)| **need != Need::default());
        for (s, _) in on_paths() {
            starts[s] = width;
            width += self.factor.supernode(s).val().ncols();
        }
        let column = |place: usize| {
            let s = self.tree.supernodes[place] as usize;
            starts[s] + place - self.factor.supernode(s).start()
        };
        let widest = on_paths().map(|(s, _)| self.factor.supernode(s).pattern().len()).max().unwrap_or(0);
        let mut below = Mat::<f64>::zeros(loads.len(), widest);
        let mut x = Mat::<f64>::zeros(loads.len(), width);
        for (load, &dof) in loads.iter().enumerate().filter(|(_, dof)| !self.is_constrained[**dof]) {
            x[(load, column(self.places[dof]))] = 1.0;
        }
        for (s, _) in on_paths().filter(|(_, need)| need.loads) {
            substitute_forwards(self.factor.supernode(s), starts[s], x.as_mut(), below.as_mut(), column);
        }
        for (s, _) in on_paths().rev().filter(|(_, need)| need.rows) {
            substitute_backwards(self.factor.supernode(s), starts[s], x.as_mut(), below.as_mut(), column);
        }
        let mut entries = Mat::zeros(loads.len(), rows.len());
        for (i, &dof) in rows.iter().enumerate().filter(|(_, dof)| !self.is_constrained[**dof]) {
            entries.col_mut(i).copy_from(x.col(column(self.places[dof])));
        }
        entries
    }

    /// Mark the paths of degrees of freedom to the root.
    fn mark(&self, dofs: &[usize], needs: &mut [Need], of: impl Fn(&mut Need) -> &mut bool) {
        for &dof in dofs {
            let mut next = Some(self.tree.supernodes[self.places[dof]]);
            while let Some(s) =
                next.map(|s| s as usize).filter(|&s| !std::mem::replace(of(&mut needs[s]), true))
            {
                next = self.tree.parents[s];
            }
        }
    }
}
