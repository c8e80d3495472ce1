//! The lowest elastic modes: K·φ = ω²·M·φ.
//!
//! Block Krylov on the operator G·M (see `system`), whose eigenvalues on the elastic motions are 1/ω²:
//! a random block, M-orthonormal, is multiplied repeatedly, every new block is orthogonalised against all
//! previous ones (twice), and the operator is projected on the basis (Rayleigh-Ritz). A mode has converged when
//! |G·M·φ − φ/ω²| in the norm of M is below `TOLERANCE`/ω². A block finds as many copies of
//! a repeated eigenvalue as it has columns. The inertia of K − s·M for an s in a gap just above the last mode counts
//! all modes below s; if one is missing, the basis is extended by a new random block.
//! References: Golub & Underwood 1977 (block Lanczos); Grimes, Lewis & Simon 1994, SIAM J. Matrix Anal. 15, 228.

use crate::kernels::{avx_section, product, solve_lower, solve_upper};
use crate::progress::Progress;
use crate::solve_error::SolveError;
use crate::system::System;
use faer::{Mat, MatRef, Side};

/// Elastic modes of a body, orthonormal in the mass matrix.
#[derive(Debug, Clone)]
pub struct ElasticModes {
    /// ω² [rad²/s²], ascending.
    pub(crate) squares: Vec<f64>,
    /// Φ [1/√kg], a column per mode, orthonormal in M.
    pub(crate) shapes: Mat<f64>,
}

impl ElasticModes {
    /// No modes.
    pub(crate) fn none(system: &System) -> Self {
        Self { squares: Vec::new(), shapes: Mat::zeros(system.discretisation.dofs(), 0) }
    }

    /// Rounds the shapes at the surface to 16 bits.
    pub(crate) fn round_at(&mut self, surface_nodes: &[u32]) {
        for mut mode in self.shapes.col_iter_mut() {
            let mut own: Vec<f64> = surface_nodes
                .iter()
                .flat_map(|&node| (0..3).map(move |axis| 3 * node as usize + axis))
                .map(|row| mode[row])
                .collect();
            palpate::round_mode_shape(&mut own);
            for (&node, values) in surface_nodes.iter().zip(own.chunks_exact(3)) {
                (0..3).for_each(|axis| mode[3 * node as usize + axis] = values[axis]);
            }
        }
    }

    /// Number of modes.
    pub fn count(&self) -> usize {
        self.squares.len()
    }

    /// Squared angular frequencies ω² [rad²/s²], ascending.
    pub fn squared_frequencies(&self) -> &[f64] {
        &self.squares
    }

    /// Frequencies [Hz], ascending.
    pub fn frequencies_hz(&self) -> Vec<f64> {
        self.squares.iter().map(|square| square.sqrt() / std::f64::consts::TAU).collect()
    }

    /// Shape of a mode [1/√kg] at all degrees of freedom, 3·node + axis.
    pub fn shape(&self, mode: usize) -> &[f64] {
        self.shapes.col_as_slice(mode)
    }
}

/// Relative residual of a converged mode. The error of the frequency is of its square, the error of the shape is the
/// residual over the gap to the next eigenvalue.
const TOLERANCE: f64 = 1e-9;

/// Block size: more than any multiplicity that symmetry forces (3 for a cube, 7 for
/// the low modes of a ball), and enough for the solves to run at full speed.
const BLOCK: usize = 16;

/// Degrees of freedom up to which all modes are computed densely, in about a second.
const DENSE_UP_TO: usize = 900;

/// Degrees of freedom beyond which the dense route is announced by a warning.
const DENSE_SLOW: usize = 3_000;

/// Degrees of freedom beyond which the dense route is refused: it would take 30 minutes and 5 GB. The sparse route finds
/// up to a third of the modes of any mesh.
const DENSE_AT_MOST: usize = 14_000;

/// Relative difference of neighbouring ω² that makes a gap in the spectrum.
const GAP: f64 = 1e-5;

/// The `requested` lowest elastic modes.
///
/// # Errors
/// [`SolveError::TooManyModes`], [`SolveError::NoConvergence`], [`SolveError::ModeCount`],
/// [`SolveError::DenseEigenproblem`] or [`SolveError::Interrupted`].
pub fn lowest_modes(
    system: &System,
    requested: usize,
    progress: &mut dyn Progress,
) -> Result<ElasticModes, SolveError> {
    let available = system.elastic_modes();
    if requested > available {
        return Err(SolveError::TooManyModes { requested, available });
    }
    // The Krylov basis needs room: several columns per mode.
    let dofs = system.discretisation.dofs();
    let dense = dofs <= DENSE_UP_TO || 3 * requested + 8 * BLOCK > available;
    if dense && dofs > DENSE_AT_MOST {
        return Err(SolveError::TooManyModes { requested, available: (available - 8 * BLOCK) / 3 });
    }
    if dense && dofs > DENSE_SLOW {
        progress.warn(&format!("so many of the {available} modes are found densely, which takes minutes"));
    }
    if dense { all_modes(system, requested, progress) } else { krylov(system, requested, progress) }
}

fn krylov(
    system: &System,
    requested: usize,
    progress: &mut dyn Progress,
) -> Result<ElasticModes, SolveError> {
    let n = system.discretisation.dofs();
    let available = system.elastic_modes();
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut basis = Basis { columns: Mat::zeros(n, 0), projected: Vec::new() };
    let mut block = random_block(system, &mut random);
    progress.begin("modes", requested as u64);
    let (mut reported, mut extensions) = (0, 0);
    loop {
        if progress.is_interrupted() {
            return Err(SolveError::Interrupted);
        }
        let Some(accepted) = basis.append(system, block) else {
            return Err(no_convergence(0, requested, basis.len(), f64::NAN));
        };
        let image = system.elastic_compliance(system.mass_times(accepted.as_ref()));
        let (next, coefficients) = basis.orthogonalise(system, image);
        basis.projected.push(coefficients);
        block = next;

        // Rayleigh-Ritz every few blocks: it costs the cube of the basis.
        let full = basis.len() + BLOCK > available;
        if basis.len() < requested + 2 * BLOCK || !(basis.len() / BLOCK).is_multiple_of(6) && !full {
            continue;
        }
        let ritz = basis.ritz(system, &block)?;
        let found = ritz.residuals.iter().take_while(|r| **r < TOLERANCE).count();
        progress.advance((found.min(requested) - reported) as u64);
        reported = found.min(requested);
        // A gap at or above the last requested mode, among those found.
        let gap = (requested..found).find(|&at| ritz.squares[at] > ritz.squares[at - 1] * (1.0 + GAP));
        let Some(gap) = gap else {
            if full || basis.len() > 12 * requested + 40 * BLOCK {
                let residual = ritz.residuals.get(requested - 1).copied().unwrap_or(f64::NAN);
                return Err(no_convergence(found, requested, basis.len(), residual));
            }
            continue;
        };
        let bound = (ritz.squares[gap - 1] * ritz.squares[gap]).sqrt();
        let counted = system.elastic_modes_below(bound);
        if counted == gap {
            return Ok(ElasticModes {
                squares: ritz.squares[..requested].to_vec(),
                shapes: product(basis.columns.as_ref(), ritz.vectors.subcols(0, requested)),
            });
        }
        extensions += 1;
        if extensions > 4 || counted < gap {
            let frequency_hz = bound.sqrt() / std::f64::consts::TAU;
            return Err(SolveError::ModeCount { counted, found: gap, frequency_hz });
        }
        // A mode is missing in this Krylov space: new random directions beside the next block find it.
        let (fresh, _) = basis.orthogonalise(system, random_block(system, &mut random));
        let width = block.ncols();
        block.resize_with(fresh.nrows(), width + fresh.ncols(), |i, j| fresh[(i, j - width)]);
    }
}

fn no_convergence(found: usize, requested: usize, basis: usize, residual: f64) -> SolveError {
    SolveError::NoConvergence { found, requested, basis, residual }
}

/// M-orthonormal columns and the operator projected on them.
struct Basis {
    columns: Mat<f64>,
    /// Per block: Vᵀ·M·G·M·V_block for the columns of the basis when the block was multiplied.
    projected: Vec<Mat<f64>>,
}

struct Ritz {
    squares: Vec<f64>,
    /// Relative residuals of the Ritz pairs.
    residuals: Vec<f64>,
    vectors: Mat<f64>,
}

impl Basis {
    fn len(&self) -> usize {
        self.columns.ncols()
    }

    /// Part of a block that is orthogonal to the basis, and the coefficients of the rest.
    fn orthogonalise(&self, system: &System, mut block: Mat<f64>) -> (Mat<f64>, Mat<f64>) {
        let mut coefficients = Mat::zeros(self.len(), block.ncols());
        for _ in 0..2 {
            let share = product(self.columns.transpose(), system.mass_times(block.as_ref()).as_ref());
            block -= product(self.columns.as_ref(), share.as_ref());
            coefficients += share;
        }
        (block, coefficients)
    }

    /// Makes a block M-orthonormal and appends it; none if the block is rank deficient.
    fn append(&mut self, system: &System, mut block: Mat<f64>) -> Option<Mat<f64>> {
        system.remove_rigid(&mut block);
        orthonormalise(system, &mut block)?;
        let old = self.len();
        self.columns.resize_with(block.nrows(), old + block.ncols(), |i, j| block[(i, j - old)]);
        Some(block)
    }

    /// Eigenpairs of the projected operator; `next` is the part of the last image that is orthogonal to the basis.
    fn ritz(&self, system: &System, next: &Mat<f64>) -> Result<Ritz, SolveError> {
        let dim = self.len();
        let mut h = Mat::<f64>::zeros(dim, dim);
        let mut start = 0;
        for block in &self.projected {
            for (j, i) in (0..block.ncols()).flat_map(|j| (0..block.nrows()).map(move |i| (j, i))) {
                // Rows of later blocks follow by symmetry.
                h[(i, start + j)] = block[(i, j)];
                h[(start + j, i)] = block[(i, j)];
            }
            start += block.ncols();
        }
        // faer's eigensolver wants entries near 1.
        let scale = h.norm_max();
        h *= faer::Scale(1.0 / scale);
        let eigen = avx_section(|| h.self_adjoint_eigen(Side::Lower))
            .map_err(|e| SolveError::DenseEigenproblem(format!("{e:?}")))?;
        let vectors = Mat::from_fn(dim, dim, |i, j| eigen.U()[(i, dim - 1 - j)]);
        let values: Vec<f64> = (0..dim).map(|j| eigen.S()[dim - 1 - j] * scale).collect();
        // |G·M·φ − θφ| = |next·(last rows of y)|, with the Gram matrix of `next`.
        let gram = next.transpose() * system.mass_times(next.as_ref());
        let last = vectors.subrows(dim - next.ncols(), next.ncols());
        let weighted = &gram * last;
        let residuals = (0..dim).map(|j| {
            let square: f64 = (0..next.ncols()).map(|i| last[(i, j)] * weighted[(i, j)]).sum();
            square.max(0.0).sqrt() / values[j].abs()
        });
        Ok(Ritz {
            squares: values.iter().map(|theta| 1.0 / theta).collect(),
            residuals: residuals.collect(),
            vectors,
        })
    }
}

/// Cholesky-QR in the inner product of M, twice for full precision; none if columns are dependent.
fn orthonormalise(system: &System, block: &mut Mat<f64>) -> Option<()> {
    for _ in 0..2 {
        // Columns to unit size first: Krylov blocks shrink by many orders.
        let gram = block.transpose() * system.mass_times(block.as_ref());
        let sizes: Vec<f64> = (0..gram.ncols()).map(|j| gram[(j, j)].max(0.0).sqrt()).collect();
        if sizes.iter().any(|s| !(s.is_finite() && *s > 0.0)) {
            return None;
        }
        let unit = Mat::from_fn(gram.nrows(), gram.ncols(), |i, j| gram[(i, j)] / (sizes[i] * sizes[j]));
        let llt = avx_section(|| unit.llt(Side::Lower)).ok()?;
        // B ← B·D⁻¹·L⁻ᵀ.
        let mut transposed = Mat::from_fn(block.ncols(), block.nrows(), |j, i| block[(i, j)] / sizes[j]);
        solve_lower(llt.L(), transposed.as_mut());
        *block = transposed.transpose().to_owned();
    }
    Some(())
}

fn random_block(system: &System, random: &mut Random) -> Mat<f64> {
    let noise = Mat::from_fn(system.discretisation.dofs(), BLOCK, |_, _| random.next());
    // One application of the operator damps the high-frequency part of the noise.
    system.elastic_compliance(system.mass_times(noise.as_ref()))
}

/// Deterministic random numbers in −½…½ (Marsaglia's xorshift), so that a mesh always gives the same bits.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// The `requested` lowest modes by a dense decomposition of L⁻¹·K·L⁻ᵀ with M = L·Lᵀ: the route for small bodies, and the
/// reference for the sparse one.
///
/// # Errors
/// [`SolveError::DenseEigenproblem`].
pub fn all_modes(
    system: &System,
    requested: usize,
    progress: &mut dyn Progress,
) -> Result<ElasticModes, SolveError> {
    progress.begin("all modes, densely", 1);
    let assembly = &system.assembly;
    let dofs = system.discretisation.dofs();
    let free: Vec<usize> = (0..dofs).filter(|&dof| !system.is_fixed(dof)).collect();
    let mut free_index = vec![usize::MAX; dofs];
    free.iter().enumerate().for_each(|(at, &dof)| free_index[dof] = at);
    let n = free.len();
    let (mut k, mut m) = (Mat::<f64>::zeros(n, n), Mat::<f64>::zeros(n, n));
    for node in 0..assembly.nodes() {
        for at in assembly.offsets[node]..assembly.offsets[node + 1] {
            let other = assembly.columns[at] as usize;
            for (a, b) in (0..3).flat_map(|a| (0..3).map(move |b| (a, b))) {
                let (row, column) = (free_index[3 * node + a], free_index[3 * other + b]);
                if row != usize::MAX && column != usize::MAX {
                    k[(row, column)] = assembly.stiffness[at].col(b)[a];
                    m[(row, column)] = if a == b { assembly.mass[at] } else { 0.0 };
                }
            }
        }
    }
    let failed = |e: &dyn std::fmt::Debug| SolveError::DenseEigenproblem(format!("{e:?}"));
    let llt = avx_section(|| m.llt(Side::Lower)).map_err(|e| failed(&e))?;
    let lower_solve = |x: &mut Mat<f64>| {
        solve_lower(llt.L(), x.as_mut());
    };
    lower_solve(&mut k);
    let mut k = k.transpose().to_owned();
    lower_solve(&mut k);
    let scale = k.norm_max();
    let symmetric = Mat::from_fn(n, n, |i, j| 0.5 * (k[(i, j)] + k[(j, i)]) / scale);
    let eigen = avx_section(|| symmetric.self_adjoint_eigen(Side::Lower)).map_err(|e| failed(&e))?;
    let skip = system.rigid_motions();
    let mut vectors = eigen.U().subcols(skip, requested).to_owned();
    solve_upper(llt.L().transpose(), vectors.as_mut());
    let mut shapes = Mat::zeros(dofs, requested);
    for (j, (at, &dof)) in (0..requested).flat_map(|j| free.iter().enumerate().map(move |f| (j, f))) {
        shapes[(dof, j)] = vectors[(at, j)];
    }
    system.remove_rigid(&mut shapes);
    progress.advance(1);
    Ok(ElasticModes { squares: (0..requested).map(|j| eigen.S()[skip + j] * scale).collect(), shapes })
}

/// Orthonormality error: the largest entry of |ΦᵀMΦ − I|.
pub fn orthonormality_error(system: &System, shapes: MatRef<'_, f64>) -> f64 {
    let gram = shapes.transpose() * system.mass_times(shapes);
    let error = |i: usize, j: usize| (gram[(i, j)] - f64::from(u8::from(i == j))).abs();
    (0..gram.ncols()).flat_map(|j| (0..=j).map(move |i| (i, j))).map(|(i, j)| error(i, j)).fold(0.0, f64::max)
}
