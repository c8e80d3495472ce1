//! Quadrature on tetrahedra and triangles: conical products of Gauss–Jacobi rules of [`POINTS`] points, exact to degree 7.
//!
//! ```text
//! λ1 = u,  λ2 = (1 − u)·v,  λ3 = (1 − u)(1 − v)·w      dV = (1 − u)²(1 − v) du dv dw
//! ```
//!
//! Reference: Stroud, *Approximate Calculation of Multiple Integrals* (1971), 2.4.

use std::sync::LazyLock;

/// Points along each coordinate.
const POINTS: usize = 4;

/// Point of a rule: barycentric coordinates and weight.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Point<const N: usize> {
    pub at: [f64; N],
    pub weight: f64,
}

/// Jacobi polynomial P_n^(α,0)(x) and its derivative, by its explicit sum.
fn jacobi(n: usize, alpha: usize, x: f64) -> (f64, f64) {
    let binomial = |n: usize, k: usize| (1..=k).map(|i| (n + 1 - i) as f64 / i as f64).product::<f64>();
    // Σ_s C(n + α, n − s)·C(n, s)·((x − 1)/2)^s·((x + 1)/2)^(n − s).
    let (low, high) = (0.5 * (x - 1.0), 0.5 * (x + 1.0));
    (0..=n).fold((0.0, 0.0), |(value, slope), s| {
        let c = binomial(n + alpha, n - s) * binomial(n, s);
        let power = |base: f64, exponent: usize| base.powi(exponent as i32);
        let of_low = if s == 0 { 0.0 } else { 0.5 * s as f64 * power(low, s - 1) * power(high, n - s) };
        let of_high =
            if s == n { 0.0 } else { 0.5 * (n - s) as f64 * power(low, s) * power(high, n - s - 1) };
        (value + c * power(low, s) * power(high, n - s), slope + c * (of_low + of_high))
    })
}

/// Points u in 0 to 1 and weights of ∫ (1 − u)^α f(u) du.
fn gauss_jacobi(alpha: usize) -> [(f64, f64); POINTS] {
    let mut roots: Vec<f64> = Vec::with_capacity(POINTS);
    std::array::from_fn(|k| {
        // Newton's method on the polynomial without the roots that are known, from Chebyshev's points.
        let mut x = ((2 * k + 1) as f64 / (2 * POINTS) as f64 * std::f64::consts::PI).cos();
        for _ in 0..50 {
            let (value, slope) = jacobi(POINTS, alpha, x);
            let known: f64 = roots.iter().map(|root| 1.0 / (x - root)).sum();
            x -= value / (slope - value * known);
        }
        roots.push(x);
        let (_, slope) = jacobi(POINTS, alpha, x);
        // 2^(α+1)/((1 − x²)·P'²) on −1 to 1; half of that range for each power.
        (0.5 * (x + 1.0), 1.0 / ((1.0 - x * x) * slope * slope))
    })
}

/// Rule of the unit tetrahedron; the weights sum to 1/6.
pub(crate) fn tetrahedron() -> &'static [Point<4>] {
    static RULE: LazyLock<Vec<Point<4>>> = LazyLock::new(|| {
        let (by_w, by_v, by_u) = (gauss_jacobi(0), gauss_jacobi(1), gauss_jacobi(2));
        let mut points = Vec::with_capacity(POINTS.pow(3));
        for (u, weight_u) in by_u {
            for (v, weight_v) in by_v {
                for (w, weight_w) in by_w {
                    let [b, c, d] = [u, (1.0 - u) * v, (1.0 - u) * (1.0 - v) * w];
                    points.push(Point {
                        at: [1.0 - b - c - d, b, c, d],
                        weight: weight_u * weight_v * weight_w,
                    });
                }
            }
        }
        points
    });
    &RULE
}

/// Rule of the unit triangle; the weights sum to 1/2.
pub(crate) fn triangle() -> &'static [Point<3>] {
    static RULE: LazyLock<Vec<Point<3>>> = LazyLock::new(|| {
        let (by_v, by_u) = (gauss_jacobi(0), gauss_jacobi(1));
        let of_u = |(u, weight_u): (f64, f64)| {
            by_v.map(|(v, weight_v)| {
                let [b, c] = [u, (1.0 - u) * v];
                Point { at: [1.0 - b - c, b, c], weight: weight_u * weight_v }
            })
        };
        by_u.into_iter().flat_map(of_u).collect()
    });
    &RULE
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rules_are_exact_to_degree_seven() {
        let factorial = |n: i32| (1..=n).map(f64::from).product::<f64>();
        let mut worst = [[0.0_f64; 2]; 2];
        for a in 0..=8 {
            for b in 0..=8 - a {
                for c in 0..=8 - a - b {
                    let exact = factorial(a) * factorial(b) * factorial(c) / factorial(a + b + c + 3);
                    let of = |p: &Point<4>| p.weight * p.at[1].powi(a) * p.at[2].powi(b) * p.at[3].powi(c);
                    let error = (tetrahedron().iter().map(of).sum::<f64>() / exact - 1.0).abs();
                    let worst = &mut worst[0][usize::from(a + b + c == 8)];
                    *worst = worst.max(error);
                }
                let exact = factorial(a) * factorial(b) / factorial(a + b + 2);
                let of = |p: &Point<3>| p.weight * p.at[1].powi(a) * p.at[2].powi(b);
                let error = (triangle().iter().map(of).sum::<f64>() / exact - 1.0).abs();
                let worst = &mut worst[1][usize::from(a + b == 8)];
                *worst = worst.max(error);
            }
        }
        for [within, beyond] in worst {
            assert!(within < 1e-13 && beyond > 1e-6, "{within} {beyond}");
        }
    }
}
