//! The elastic body as one operator: G, its elastic static compliance.
//!
//! For a free body K has six zero modes, the rigid motions Φr. Inertia relief balances a load by the
//! inertia forces of the rigid motion that it causes, constrains six degrees of freedom, and removes the rigid part of
//! the solution:
//!
//! ```text
//! G = (I − Φr·Φrᵀ·M)·K⁻·(I − M·Φr·Φrᵀ)        ΦrᵀMΦr = I
//! ```
//!
//! K⁻ is the inverse of K with the six constrained degrees of freedom removed; any six that prevent all rigid
//! motions give the same G. For a body with fixed nodes G is the inverse of K on the free ones.
//! Reference: Géradin & Rixen, *Mechanical Vibrations*, 3.5.
//!
//! Equations: docs/theory.md (C1), (C2), (C91).

use crate::assembly::{Assembly, SystemMatrix};
use crate::discretisation::Discretisation;
use crate::factor::{Factor, Pattern};
use crate::kernels::{avx_section, use_sequential_kernels};
use crate::memory::check_memory;
use crate::selected_inverse::SelectedInverse;
use crate::solve_error::SolveError;
use crate::supports::SupportedDofs;
use faer::{Mat, MatRef};
use glam::{DMat3, DVec3};
use palpate::MassProperties;

/// Assembled body with its factor.
pub struct System {
    /// Nodes and elements.
    pub discretisation: Discretisation,
    /// Stiffness and mass matrices.
    pub assembly: Assembly,
    /// Mass, centre of mass, inertia.
    pub mass: MassProperties,
    /// Number of nodes that are fixed, held along an axis, or on springs; 0 for a free body.
    pub supported_nodes: usize,
    pattern: Pattern,
    fixed: Vec<bool>,
    factor: Factor,
    rigid: Option<Rigid>,
}

/// Rigid motions of a free body, orthonormal in M.
struct Rigid {
    shapes: Mat<f64>,
    weighted: Mat<f64>,
}

/// G by its entries: those of an inverse, less left·rightᵀ, which have a row per degree of freedom.
pub(crate) struct SelectedCompliance<'a> {
    pub(crate) inverse: SelectedInverse<'a>,
    pub(crate) left: Mat<f64>,
    pub(crate) right: Mat<f64>,
}

impl System {
    /// Factors a body with supports, whose springs the stiffness has.
    ///
    /// # Errors
    /// [`SolveError`] when the supports leave a rigid motion, memory is short, or the stiffness is not positive definite.
    pub fn new(
        discretisation: Discretisation,
        assembly: Assembly,
        supported: SupportedDofs,
    ) -> Result<Self, SolveError> {
        use_sequential_kernels();
        let mass = mass_properties(&discretisation, &assembly);
        let shapes = rigid_shapes(&discretisation, &mass);
        let SupportedDofs { fixed, sprung } = supported;
        let is_supported: Vec<bool> =
            fixed.iter().zip(&sprung).map(|(fixed, sprung)| *fixed || *sprung).collect();
        let supported_nodes = is_supported.chunks_exact(3).filter(|axes| axes.contains(&true)).count();
        let pattern = Pattern::new(&assembly)?;
        // Its own factor and the two shifted ones of the certificate.
        check_memory(3.0 * pattern.factor_bytes() as f64)?;
        let (mut constrained, mut rigid) = (fixed.clone(), None);
        if supported_nodes == 0 {
            for (row, _) in independent_rows(&shapes, 0..shapes.nrows()) {
                constrained[row] = true;
            }
            let weighted = assembly.multiply(SystemMatrix::Mass, shapes.as_ref());
            rigid = Some(Rigid { shapes, weighted });
        } else {
            let rows = (0..is_supported.len()).filter(|&row| is_supported[row]);
            let pivots = independent_rows(&shapes, rows);
            if pivots.len() < 6 || pivots[5].1 < 1e-9 * pivots[0].1 {
                let all_along = fixed.chunks_exact(3).all(|axes| axes.iter().all(|axis| *axis == axes[0]));
                let is_simple = all_along && !sprung.contains(&true);
                return Err(if is_simple { SolveError::RigidMotion } else { SolveError::LooseSupports });
            }
        }
        let factor = pattern.factor(&assembly, &constrained, 0.0)?;
        Ok(Self { discretisation, assembly, mass, supported_nodes, pattern, fixed, factor, rigid })
    }

    /// Cholesky factor of K + `shift`·M with the fixed degrees of freedom removed; `shift` > 0 for a free body.
    ///
    /// # Errors
    /// [`SolveError::NotPositiveDefinite`].
    pub fn shifted_factor(&self, shift: f64) -> Result<Factor, SolveError> {
        self.pattern.factor(&self.assembly, &self.fixed, shift)
    }

    /// Number of elastic modes with ω² below a bound [rad²/s²] above 0, by the inertia of K − bound·M.
    pub fn elastic_modes_below(&self, bound: f64) -> usize {
        self.pattern
            .eigenvalues_below(&self.assembly, &self.fixed, bound)
            .saturating_sub(self.rigid_motions())
    }

    /// Whether a degree of freedom is fixed.
    pub fn is_fixed(&self, dof: usize) -> bool {
        self.fixed[dof]
    }

    /// Whether a node is fixed, or held along an axis.
    pub fn holds_node(&self, node: u32) -> bool {
        self.fixed[3 * node as usize..][..3].contains(&true)
    }

    /// Number of rigid motions: 6 or 0.
    pub fn rigid_motions(&self) -> usize {
        if self.rigid.is_some() { 6 } else { 0 }
    }

    /// Participation of the rigid motions in loads [N], Φrᵀ·B: six rows, or none for a body with fixed nodes.
    pub fn rigid_participation(&self, loads: &Mat<f64>) -> Mat<f64> {
        self.rigid.as_ref().map_or(Mat::zeros(0, loads.ncols()), |rigid| rigid.shapes.transpose() * loads)
    }

    /// Number of elastic modes of the body.
    pub fn elastic_modes(&self) -> usize {
        self.fixed.iter().filter(|fixed| !**fixed).count() - self.rigid_motions()
    }

    /// Elastic displacements G·B [m] for a block of loads B [N], one per column.
    pub fn elastic_compliance(&self, mut loads: Mat<f64>) -> Mat<f64> {
        self.balance(&mut loads);
        self.factor.solve(loads.as_mut());
        self.remove_rigid(&mut loads);
        loads
    }

    /// G by its entries. Of a free body, multiplied out:
    ///
    /// ```text
    /// G = K⁻ − Y·Φrᵀ − Φr·(Y − Φr·C)ᵀ        Y = K⁻·M·Φr,  C = Φrᵀ·M·Y
    /// ```
    pub(crate) fn selected_compliance(&self) -> SelectedCompliance<'_> {
        let inverse = self.factor.inverse();
        let n = self.discretisation.dofs();
        let Some(Rigid { shapes, weighted }) = &self.rigid else {
            return SelectedCompliance { inverse, left: Mat::zeros(n, 0), right: Mat::zeros(n, 0) };
        };
        let mut relief = weighted.clone();
        self.factor.solve(relief.as_mut());
        let other = avx_section(|| &relief - shapes * (weighted.transpose() * &relief));
        let beside = |a: &Mat<f64>, b: &Mat<f64>| {
            Mat::from_fn(n, 12, |i, j| if j < 6 { a[(i, j)] } else { b[(i, j - 6)] })
        };
        SelectedCompliance { inverse, left: beside(&relief, shapes), right: beside(shapes, &other) }
    }

    /// Subtracts from loads the inertia forces of the rigid motion that they cause: (I − M·Φr·Φrᵀ)·B.
    pub fn balance(&self, loads: &mut Mat<f64>) {
        if let Some(Rigid { shapes, weighted }) = &self.rigid {
            avx_section(|| *loads -= weighted * (shapes.transpose() * &*loads));
        }
    }

    /// Subtracts from displacements their rigid part: (I − Φr·Φrᵀ·M)·U; zeroes fixed degrees of freedom.
    pub fn remove_rigid(&self, displacements: &mut Mat<f64>) {
        if let Some(Rigid { shapes, weighted }) = &self.rigid {
            avx_section(|| *displacements -= shapes * (weighted.transpose() * &*displacements));
        }
        for (row, _) in self.fixed.iter().enumerate().filter(|(_, fixed)| **fixed) {
            displacements.row_mut(row).fill(0.0);
        }
    }

    /// Loads [N] of a uniform unit acceleration along each axis, M·e: three columns.
    pub fn uniform_weight(&self) -> Mat<f64> {
        let along = |dof: usize, axis: usize| f64::from(u8::from(dof % 3 == axis));
        self.mass_times(Mat::from_fn(self.discretisation.dofs(), 3, along).as_ref())
    }

    /// Product M·X.
    pub fn mass_times(&self, x: MatRef<'_, f64>) -> Mat<f64> {
        self.assembly.multiply(SystemMatrix::Mass, x)
    }
}

/// Mass, centre of mass and inertia by the consistent mass matrix, which integrates linear and quadratic
/// functions of position exactly.
fn mass_properties(discretisation: &Discretisation, assembly: &Assembly) -> MassProperties {
    // Moments about a point of the body, so that far-away coordinates lose no digits.
    let origin = discretisation.nodes[0];
    let (mut mass, mut first, mut second) = (0.0, DVec3::ZERO, DMat3::ZERO);
    for node in 0..assembly.nodes() {
        let p = discretisation.nodes[node] - origin;
        for at in assembly.offsets[node]..assembly.offsets[node + 1] {
            let q = discretisation.nodes[assembly.columns[at] as usize] - origin;
            mass += assembly.mass[at];
            first += q * assembly.mass[at];
            second += DMat3::from_cols(p * q.x, p * q.y, p * q.z) * assembly.mass[at];
        }
    }
    let centre = first / mass;
    second -= DMat3::from_cols(centre * centre.x, centre * centre.y, centre * centre.z) * mass;
    second = (second + second.transpose()) * 0.5;
    let trace = second.x_axis.x + second.y_axis.y + second.z_axis.z;
    let inertia = DMat3::from_diagonal(DVec3::splat(trace)) - second;
    MassProperties {
        mass_kg: mass,
        center_of_mass_m: (centre + origin).to_array(),
        inertia_kg_m2: inertia.to_cols_array_2d(),
    }
}

/// Three translations and three rotations about the principal axes through the centre of mass, orthonormal in M.
fn rigid_shapes(discretisation: &Discretisation, mass: &MassProperties) -> Mat<f64> {
    let centre = DVec3::from_array(mass.center_of_mass_m);
    let largest = mass.inertia_kg_m2.iter().flatten().fold(0.0_f64, |a, b| a.max(b.abs()));
    let scaled = Mat::from_fn(3, 3, |i, j| mass.inertia_kg_m2[i][j] / largest);
    let mut shapes = Mat::zeros(discretisation.dofs(), 6);
    let principal = scaled.self_adjoint_eigen(faer::Side::Lower);
    for (node, &p) in discretisation.nodes.iter().enumerate() {
        for axis in 0..3 {
            shapes[(3 * node + axis, axis)] = 1.0 / mass.mass_kg.sqrt();
        }
        let Ok(principal) = &principal else { continue };
        for k in 0..3 {
            let direction = DVec3::new(principal.U()[(0, k)], principal.U()[(1, k)], principal.U()[(2, k)]);
            let inertia = principal.S()[k] * largest;
            let velocity = direction.cross(p - centre) / inertia.sqrt();
            for (axis, value) in velocity.to_array().into_iter().enumerate() {
                shapes[(3 * node + axis, 3 + k)] = value;
            }
        }
    }
    shapes
}

/// Up to six rows of an n×6 matrix that are linearly independent, with their pivots, by Gram-Schmidt with
/// the largest remaining row each time.
fn independent_rows(shapes: &Mat<f64>, candidates: impl Iterator<Item = usize>) -> Vec<(usize, f64)> {
    let mut rows: Vec<(usize, [f64; 6])> =
        candidates.map(|row| (row, std::array::from_fn(|k| shapes[(row, k)]))).collect();
    let dot = |a: &[f64; 6], b: &[f64; 6]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut chosen = Vec::new();
    for _ in 0..6 {
        let best = rows.iter().copied().max_by(|a, b| dot(&a.1, &a.1).total_cmp(&dot(&b.1, &b.1)));
        let Some((row, pivot)) = best else { break };
        let size = dot(&pivot, &pivot);
        if size == 0.0 {
            break;
        }
        chosen.push((row, size.sqrt()));
        for (_, other) in &mut rows {
            let share = dot(other, &pivot) / size;
            other.iter_mut().zip(pivot).for_each(|(o, p)| *o -= share * p);
        }
    }
    chosen
}
