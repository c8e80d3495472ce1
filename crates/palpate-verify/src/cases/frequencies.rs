//! Frequencies of free cubes.

use crate::check::Check;
use crate::error::VerifyError;
use crate::modal::{frequencies_hz, lowest, mean};
use palpate_fem::paper_cube::{
    CELLS, DENSITY_KG_M3 as DENSITY, POISSON, SIDE_M as SIDE, YOUNG_PA as YOUNG, mesh,
};
use palpate_fem::{ElementOrder, RecordedBody};
use palpate_testkit::undamped;
use std::f64::consts::{PI, SQRT_2};

fn cube(cells: u32, order: ElementOrder, poisson: f64, modes: usize) -> Result<RecordedBody, VerifyError> {
    lowest(mesh(cells)?, &undamped(YOUNG, poisson, DENSITY, order, modes))
}

/// Ω = ωL/c_s to Hz.
fn from_dimensionless(omega: f64, poisson: f64) -> f64 {
    let shear_speed = (YOUNG / (2.0 * (1.0 + poisson)) / DENSITY).sqrt();
    omega * shear_speed / SIDE / (2.0 * PI)
}

/// The paper's mesh against frequencies that were computed independently, to the digits given.
pub fn paper_cube() -> Result<Vec<Check>, VerifyError> {
    const TABLE: [(usize, f64); 6] =
        [(2, 11.650), (3, 15.536), (3, 15.593), (2, 17.597), (1, 18.051), (3, 20.191)];
    const HALF_DIGIT: f64 = 0.5e-3;
    let computed = frequencies_hz(&cube(CELLS, ElementOrder::Linear, POISSON, 14)?);
    let expected = TABLE.iter().flat_map(|&(times, f)| std::iter::repeat_n(f, times));
    let check = |(at, (&computed, expected)): (usize, (&f64, f64))| {
        Check::new(format!("mode {} [Hz]", at + 1), computed, expected, HALF_DIGIT / expected)
    };
    Ok(computed.iter().zip(expected).enumerate().map(check).collect())
}

/// Quadratic elements, 6 cells a side, against converged Rayleigh-Ritz values; the Lamé mode, which is exact.
pub fn continuum() -> Result<Vec<Check>, VerifyError> {
    /// Discretisation error of quadratic elements with 6 cells a side, up to the 14th mode.
    const SHARE: f64 = 0.003;
    /// Envelopes of the discretisation error of the fine meshes, (kh)²/4 and (kh)⁴/100 with kh = 0.28 and 0.56.
    const LAME_LINEAR: f64 = 0.02;
    const LAME_QUADRATIC: f64 = 0.001;
    let mut checks = Vec::new();
    let compare =
        |checks: &mut Vec<Check>, poisson: f64, table: &[(usize, f64)]| -> Result<(), VerifyError> {
            let count = table.iter().map(|(times, _)| times).sum();
            let computed = frequencies_hz(&cube(6, ElementOrder::Quadratic, poisson, count)?);
            let mut at = 0;
            for &(times, expected) in table {
                let group = mean(&computed[at..at + times]);
                let quantity = format!("ν = {poisson}, modes {}-{} [Hz], 6³ quadratic", at + 1, at + times);
                checks.push(Check::new(quantity, group, expected, SHARE));
                at += times;
            }
            Ok(())
        };
    compare(&mut checks, 0.49, &[(2, 11.231), (3, 15.281), (3, 15.422), (3, 17.4661), (3, 19.709)])?;
    let hz = |omega| from_dimensionless(omega, 0.3);
    let table =
        [(2, hz(2.85605)), (3, hz(3.84598)), (3, hz(3.91125)), (3, hz(PI * SQRT_2)), (3, hz(4.57279))];
    compare(&mut checks, 0.3, &table)?;

    let exact = hz(PI * SQRT_2);
    for (order, expected, [coarse, fine]) in
        [(ElementOrder::Linear, 2.0, [8, 16]), (ElementOrder::Quadratic, 4.0, [4, 8])]
    {
        let error =
            |cells| -> Result<f64, VerifyError> { Ok((lame_mode(cells, order)? / exact - 1.0).abs()) };
        let (first, second) = (error(coarse)?, error(fine)?);
        let quantity = format!("Lamé mode π√2 [Hz], ν = 0.3, {fine}³ {order:?}");
        let allowed = if order == ElementOrder::Linear { LAME_LINEAR } else { LAME_QUADRATIC };
        let check = Check::new(quantity, exact * (1.0 + second), exact, allowed);
        checks.push(check.with_order(first, second, f64::from(fine) / f64::from(coarse), expected));
    }
    Ok(checks)
}

/// Frequency [Hz] of the mode that is most like Lamé's, u = (sin πx·cos πy, −cos πx·sin πy, 0) with lengths in sides:
/// free of stress on all faces and without change of volume, so that it is exact for every ν.
fn lame_mode(cells: u32, order: ElementOrder) -> Result<f64, VerifyError> {
    let body = cube(cells, order, 0.3, 24)?;
    let (unreduced, nodes) = (body.unreduced(), body.nodes());
    let exact = |dof: usize| {
        let (x, y) = (PI * nodes[dof / 3].x / SIDE, PI * nodes[dof / 3].y / SIDE);
        [x.sin() * y.cos(), -x.cos() * y.sin(), 0.0][dof % 3]
    };
    let weighted = unreduced.mass_times(&[(0..body.dofs()).map(exact).collect()]);
    let modes = unreduced.kept_modes();
    let likeness = |mode: &usize| {
        let overlap: f64 = modes.shape(*mode).iter().zip(&weighted[0]).map(|(a, b)| a * b).sum();
        overlap.abs()
    };
    let best = (0..modes.count()).max_by(|a, b| likeness(a).total_cmp(&likeness(b))).unwrap_or(0);
    Ok(frequencies_hz(&body)[best])
}
