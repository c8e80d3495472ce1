//! Compliances of points, and identities that every recording satisfies.

use crate::check::Check;
use crate::error::{VerifyError, numerics};
use faer::Mat;
use glam::DVec3;
use palpate::SampledOscillator;
use palpate_fem::paper_cube::{self, CELLS, DENSITY_KG_M3, POISSON, YOUNG_PA};
use palpate_fem::{ElementOrder, SilentProgress};
use palpate_testkit::{recorded, undamped};

/// Vertical compliance of three points of the paper's cube, elastic part: static, and at the end of a step of 1 ms.
pub fn points() -> Result<Vec<Check>, VerifyError> {
    // Independent values with four digits.
    const TABLE: [(&str, [f64; 3], f64, f64); 3] = [
        ("top centre", [0.0, 0.05, 0.0], 2.707e-2, 1.721e-2),
        ("middle of a top edge", [0.05, 0.05, 0.0], 1.429e-1, 1.044e-1),
        ("top corner", [0.05, 0.05, 0.05], 3.571e-1, 2.628e-1),
    ];
    /// Half a unit in the fourth digit of the smallest number.
    const HALF_DIGIT: f64 = 4e-4;
    const STEP_S: f64 = 1e-3;
    /// Undamped, the fastest modes turn by a radian or more in a step: that needs a larger space than a certificate's.
    const BLOCKS: usize = 40;
    let parameters = undamped(YOUNG_PA, POISSON, DENSITY_KG_M3, ElementOrder::Linear, 100);
    let body = recorded(paper_cube::mesh(CELLS)?, &parameters)?;
    let unreduced = body.unreduced();
    let nodes = TABLE.map(|(_, position, ..)| body.nearest_node(DVec3::from_array(position)));
    let mut loads = vec![vec![0.0; body.dofs()]; 9];
    for (place, axis) in (0..3).flat_map(|place| (0..3).map(move |axis| (place, axis))) {
        loads[3 * place + axis][3 * nodes[place] + axis] = 1.0;
    }
    let displacements = unreduced.static_displacements(&loads);
    let truncated =
        unreduced.truncated_response(&nodes, STEP_S, BLOCKS, &mut SilentProgress).map_err(numerics)?;
    let mut checks = Vec::new();
    for (place, (name, _, static_m_n, instantaneous_m_n)) in TABLE.into_iter().enumerate() {
        let row = 3 * nodes[place] + 1;
        let compliance = displacements[3 * place + 1][row];
        checks.push(Check::new(format!("static, {name} [m/N]"), compliance, static_m_n, HALF_DIGIT));
        let truncated = truncated.modes(place, BLOCKS).map_err(numerics)?;
        let modes = unreduced.kept_modes();
        let kept = (0..modes.count()).map(|i| (modes.squared_frequencies()[i], modes.shape(i)[row]));
        let all = kept.chain(truncated.iter().map(|mode| (mode.square, mode.gain.y)));
        let response = all.map(|(square, gain)| {
            gain * gain * SampledOscillator::new(square.sqrt(), 0.0, STEP_S).instantaneous_compliance()
        });
        let quantity = format!("R[0] at 1 ms, {name} [m/N]");
        checks.push(Check::new(quantity, response.sum(), instantaneous_m_n, HALF_DIGIT));
    }
    Ok(checks)
}

/// Identities on a small cube, whose matrices can be formed whole.
pub fn identities() -> Result<Vec<Check>, VerifyError> {
    /// Solves with a factor of condition 1e6 keep ten digits.
    const SOLVED: f64 = 1e-10;
    /// Sums of a thousand products, rounded to f64.
    const ORTHONORMAL: f64 = 1e-11;
    /// Rounding of an eigenvalue of a matrix of 654 rows: 1e-15 of the largest each.
    const NEGATIVE: f64 = 1e-12;
    let body = recorded(paper_cube::mesh(6)?, &paper_cube::parameters(6, 60))?;
    let unreduced = body.unreduced();
    let mut checks = vec![Check::new(
        "largest entry of |ΦᵀMΦ − I|",
        unreduced.orthonormality_error(unreduced.kept_modes()),
        0.0,
        ORTHONORMAL,
    )];

    let all = unreduced.dense_modes(60, &mut SilentProgress).map_err(numerics)?;
    let kept = unreduced.kept_modes().squared_frequencies();
    let apart = kept.iter().zip(all.squared_frequencies()).map(|(a, b)| (a / b - 1.0).abs());
    checks.push(Check::new(
        "ω², block Krylov against dense, largest share",
        apart.fold(0.0, f64::max),
        0.0,
        SOLVED,
    ));

    let dofs = body.dofs();
    let picked: Vec<usize> = (0..dofs).step_by(37).collect();
    let mut loads = vec![vec![0.0; dofs]; picked.len()];
    picked.iter().enumerate().for_each(|(column, &row)| loads[column][row] = 1.0);
    let response = unreduced.static_displacements(&loads);
    let entry = |i: usize, j: usize| response[j][picked[i]];
    let pairs = || (0..picked.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
    let largest = (0..picked.len()).map(|i| entry(i, i)).fold(0.0, f64::max);
    let apart = pairs().map(|(i, j)| (entry(i, j) - entry(j, i)).abs() / largest).fold(0.0, f64::max);
    checks.push(Check::new("reciprocity |G_ij − G_ji|, share of the largest", apart, 0.0, SOLVED));

    // A relieved body keeps no rigid part: Φrᵀ·M·u = 0 shows as no net momentum.
    let momentum = unreduced.mass_times(&response);
    let net = (0..picked.len()).flat_map(|j| (0..3).map(move |axis| (j, axis))).map(|(j, axis)| {
        (0..dofs / 3).map(|node| momentum[j][3 * node + axis]).sum::<f64>().abs() / body.recording.mass()
    });
    checks.push(Check::new(
        "rigid part of G, share of the largest",
        net.fold(0.0, f64::max) / largest,
        0.0,
        SOLVED,
    ));

    // Eigenvalues of the stored S.
    let surface = body.recording.surface.positions.len();
    let block = |i: usize, j: usize| body.recording.residual.block(i, j);
    let dense = Mat::from_fn(3 * surface, 3 * surface, |i, j| block(i / 3, j / 3).col(j % 3)[i % 3]);
    let scale = dense.norm_max();
    let dense = dense * faer::Scale(1.0 / scale);
    let eigen = dense.self_adjoint_eigen(faer::Side::Lower).map_err(|e| numerics(format!("{e:?}")))?;
    let lowest = eigen.S()[0];
    checks.push(Check::new(
        "negative eigenvalue of S, share of the largest entry",
        lowest.min(0.0),
        0.0,
        NEGATIVE,
    ));
    Ok(checks)
}
