//! Held points: W·f = ρ (equation (9) of the paper), by Cholesky factors.
//!
//! W [m/N] is the Delassus operator of the held rows: displacement at the end of the step per held
//! force, from modes, residual and rigid motion. ρ [m] is the position of the hand minus the free
//! position of the point. A row that depends linearly on those before it (two hands on one point)
//! is left out: its force is zero.
//!
//! Equations: docs/theory.md (C35).

use super::problem::larger;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Ratio of pivot to diagonal below which a row is dependent [1]. Residual entries in single
/// precision have a relative error of 6e-8; a point at a thousandth of a triangle keeps about 1e-6.
const DEPENDENT_BELOW: f64 = 1e-9;

/// Dense symmetric system of the held points; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct BilateralSystem {
    /// Lower factor, row by row, of extent 3·points.
    factor: Vec<f64>,
    /// Reciprocal pivots; 0 for a dependent row.
    reciprocal: Vec<f64>,
    solution: Vec<f64>,
    extent: usize,
}

impl BilateralSystem {
    /// System for at most `capacity` points.
    pub(crate) fn new(capacity: usize) -> Self {
        let n = 3 * capacity;
        Self { factor: vec![0.0; n * n], reciprocal: vec![0.0; n], solution: vec![0.0; n], extent: 0 }
    }

    /// Factor W, given by its 3×3 blocks on and below the diagonal. Gives the number of dependent rows.
    ///
    /// # Real time
    #[allow(non_snake_case)]
    pub(crate) fn factorise(&mut self, points: usize, W: impl Fn(usize, usize) -> DMat3) -> usize {
        let n = 3 * points;
        self.extent = n;
        for (a, b) in (0..points).flat_map(|a| (0..=a).map(move |b| (a, b))) {
            let block = W(a, b);
            for (i, j) in (0..3).flat_map(|i| (0..3).map(move |j| (i, j))) {
                self.factor[(3 * a + i) * n + 3 * b + j] = block.col(j)[i];
            }
        }
        let mut dependent = 0;
        for j in 0..n {
            let (above, rest) = self.factor.split_at_mut(j * n);
            let row = &mut rest[..=j];
            let diagonal = row[j];
            for k in 0..j {
                let other = &above[k * n..k * n + k];
                let dot: f64 = row[..k].iter().zip(other).map(|(x, y)| x * y).sum();
                row[k] = (row[k] - dot) * self.reciprocal[k];
            }
            let pivot = diagonal - row[..j].iter().map(|x| x * x).sum::<f64>();
            if pivot > DEPENDENT_BELOW * diagonal {
                self.reciprocal[j] = 1.0 / libm::sqrt(pivot);
            } else {
                self.reciprocal[j] = 0.0;
                dependent += 1;
            }
        }
        dependent
    }

    /// Solve W·f = ρ, with `residual` the ρ of a point [m]. Gives the largest |ρ| [m]; forces by [`Self::force`].
    ///
    /// # Real time
    pub(crate) fn solve(&mut self, residual: impl Fn(usize) -> DVec3) -> f64 {
        let n = self.extent;
        let mut largest = 0.0;
        for point in 0..n / 3 {
            let rho = residual(point);
            largest = larger(largest, rho.length());
            rho.write_to_slice(&mut self.solution[3 * point..]);
        }
        for j in 0..n {
            let dot: f64 = self.factor[j * n..j * n + j].iter().zip(&self.solution).map(|(x, y)| x * y).sum();
            self.solution[j] = (self.solution[j] - dot) * self.reciprocal[j];
        }
        for j in (0..n).rev() {
            self.solution[j] *= self.reciprocal[j];
            let x = self.solution[j];
            for k in 0..j {
                self.solution[k] -= self.factor[j * n + k] * x;
            }
        }
        largest
    }

    /// Force of a point in the last solution [N].
    pub(crate) fn force(&self, point: usize) -> DVec3 {
        DVec3::from_slice(&self.solution[3 * point..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Positive definite matrix of two points; `dependent` puts the second on the first.
    fn blocks(dependent: bool) -> impl Fn(usize, usize) -> DMat3 {
        let a = DMat3::from_cols_array_2d(&[[4.0, 1.0, 0.5], [1.0, 3.0, 0.2], [0.5, 0.2, 5.0]]);
        move |i, j| if i == j || dependent { a } else { a * 0.5 }
    }

    #[test]
    fn solution_satisfies_the_equations() {
        let mut system = BilateralSystem::new(2);
        assert_eq!(system.factorise(2, blocks(false)), 0);
        let rho = [DVec3::new(1.0, -2.0, 0.3), DVec3::new(0.1, 0.7, -0.9)];
        assert_eq!(system.solve(|i| rho[i]), rho[0].length());
        let f = [system.force(0), system.force(1)];
        for (i, wanted) in rho.into_iter().enumerate() {
            let back: DVec3 = (0..2).map(|j| blocks(false)(i.max(j), i.min(j)) * f[j]).sum();
            assert!((back - wanted).length() < 1e-14, "{back} {wanted}");
        }
    }

    #[test]
    fn dependent_rows_get_no_force() {
        let mut system = BilateralSystem::new(2);
        assert_eq!(system.factorise(2, blocks(true)), 3);
        let rho = DVec3::new(1.0, -2.0, 0.3);
        system.solve(|_| rho);
        let f = [system.force(0), system.force(1)];
        assert_eq!(f[1], DVec3::ZERO);
        assert!((blocks(true)(0, 0) * f[0] - rho).length() < 1e-14);
    }
}
