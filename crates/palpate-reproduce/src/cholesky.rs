//! Solution of A·x = b with a dense, symmetric, positive definite A, by Cholesky's decomposition A = L·Lᵀ.

/// x, or none where A is not positive definite. `matrix` has A row by row; its lower triangle is read.
pub fn solved(matrix: &[f64], right: &[f64]) -> Option<Vec<f64>> {
    let n = right.len();
    let mut l = matrix.to_vec();
    // L, column by column, over the lower triangle of A.
    for j in 0..n {
        let pivot = l[j * n + j] - (0..j).map(|k| l[j * n + k].powi(2)).sum::<f64>();
        if pivot.is_nan() || pivot <= 0.0 {
            return None;
        }
        l[j * n + j] = pivot.sqrt();
        for i in j + 1..n {
            let known: f64 = (0..j).map(|k| l[i * n + k] * l[j * n + k]).sum();
            l[i * n + j] = (l[i * n + j] - known) / l[j * n + j];
        }
    }
    // L·y = b, then Lᵀ·x = y.
    let mut x = right.to_vec();
    for i in 0..n {
        let known: f64 = (0..i).map(|k| l[i * n + k] * x[k]).sum();
        x[i] = (x[i] - known) / l[i * n + i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| l[k * n + i] * x[k]).sum();
        x[i] = (x[i] - known) / l[i * n + i];
    }
    Some(x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solution_of_a_hilbert_matrix_is_known_and_an_indefinite_one_has_none() {
        // Rows of a Hilbert matrix sum to its product with ones.
        let n = 5;
        let matrix: Vec<f64> = (0..n * n).map(|at| 1.0 / (at / n + at % n + 1) as f64).collect();
        let right: Vec<f64> = matrix.chunks(n).map(|row| row.iter().sum()).collect();
        // Its condition number is 5e5.
        let x = solved(&matrix, &right).expect("it is positive definite");
        assert!(x.iter().all(|x| (x - 1.0).abs() < 1e-10), "{x:?}");
        assert_eq!(solved(&[1.0, 2.0, 2.0, 1.0], &[1.0, 1.0]), None);
    }
}
