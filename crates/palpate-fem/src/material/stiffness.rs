//! Stiffness matrices of anisotropic materials.
//!
//! ```text
//! σ = C·ε,  ε = (ε_xx, ε_yy, ε_zz, 2ε_yz, 2ε_xz, 2ε_xy)        6×6 [Pa], symmetric, positive definite
//! ```
//!
//! An orthotropic material has the compliance S_ii = 1/E_i, S_ij = −ν_ij/E_i, and 1/G_ij for shear.
//!
//! Reference: Jones, *Mechanics of Composite Materials* (1999), 2.

use super::MaterialError;
use faer::{Mat, Side};
use glam::{DMat3, DVec3};
use palpate::Material;
use serde::Deserialize;

/// Axes of the six strains.
pub(crate) const VOIGT_PAIRS: [[usize; 2]; 6] = [[0, 0], [1, 1], [2, 2], [1, 2], [0, 2], [0, 1]];

/// Least eigenvalue of a stiffness matrix over its largest: below it, displacements have no digits left.
const LEAST_EIGENVALUE: f64 = 1e-9;

/// Index of a pair of axes.
pub(crate) fn voigt(i: usize, j: usize) -> usize {
    if i == j { i } else { 6 - i - j }
}

/// Constants of an orthotropic material along its own axes.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Orthotropic {
    /// Young's moduli E1, E2, E3 [Pa].
    pub young: [f64; 3],
    /// Poisson's ratios ν12, ν13, ν23: contraction along the second axis by tension along the first.
    pub poisson: [f64; 3],
    /// Shear moduli G12, G13, G23 [Pa].
    pub shear: [f64; 3],
}

impl Orthotropic {
    /// Stiffness matrix [Pa].
    pub fn stiffness_pa(&self) -> [[f64; 6]; 6] {
        let ([e1, e2, e3], [n12, n13, n23], [g12, g13, g23]) = (self.young, self.poisson, self.shear);
        let compliance = DMat3::from_cols_array_2d(&[
            [1.0 / e1, -n12 / e1, -n13 / e1],
            [-n12 / e1, 1.0 / e2, -n23 / e2],
            [-n13 / e1, -n23 / e2, 1.0 / e3],
        ]);
        let normal = compliance.inverse().to_cols_array_2d();
        let mut stiffness = [[0.0; 6]; 6];
        for i in 0..3 {
            for j in 0..3 {
                stiffness[i][j] = 0.5 * (normal[i][j] + normal[j][i]);
            }
        }
        (stiffness[3][3], stiffness[4][4], stiffness[5][5]) = (g23, g13, g12);
        stiffness
    }
}

/// Material with a stiffness matrix [Pa] and a density [kg/m³]. Its Young's modulus and Poisson's ratio are those of the isotropic
/// material with the same mean bulk and shear modulus (Voigt).
pub fn anisotropic(stiffness_pa: [[f64; 6]; 6], density_kg_m3: f64) -> Material {
    let c = &stiffness_pa;
    let (normal, mixed) = (c[0][0] + c[1][1] + c[2][2], c[0][1] + c[0][2] + c[1][2]);
    let bulk = (normal + 2.0 * mixed) / 9.0;
    let shear = (normal - mixed + 3.0 * (c[3][3] + c[4][4] + c[5][5])) / 15.0;
    let (young, poisson) =
        (9.0 * bulk * shear / (3.0 * bulk + shear), (3.0 * bulk - 2.0 * shear) / (6.0 * bulk + 2.0 * shear));
    Material { stiffness_pa: Some(stiffness_pa), ..Material::isotropic(young, poisson, density_kg_m3) }
}

/// Stiffness matrix [Pa] of a material whose first and second axis lie along two directions; the second is made orthogonal to the
/// first. None for parallel directions.
pub fn rotated_stiffness(stiffness_pa: &[[f64; 6]; 6], axes: [DVec3; 2]) -> Option<[[f64; 6]; 6]> {
    let first = axes[0].try_normalize()?;
    let second = axes[1].try_normalize()?.reject_from_normalized(first);
    // Directions within 10⁻³ leave the third axis to rounding of the input.
    let second = (second.length() > 1e-3).then(|| second.normalize())?;
    let r = [first, second, first.cross(second)].map(|axis| axis.to_array());
    // C'_pqrs = Σ R_ip R_jq R_kr R_ls C_ijkl with the material's axes as the rows of R.
    let mut rotated = [[0.0; 6]; 6];
    for (row, &[p, q]) in rotated.iter_mut().zip(&VOIGT_PAIRS) {
        for (entry, &[s, t]) in row.iter_mut().zip(&VOIGT_PAIRS) {
            for at in 0..81 {
                let [i, j, k, l] = [at % 3, at / 3 % 3, at / 9 % 3, at / 27];
                *entry += r[i][p] * r[j][q] * r[k][s] * r[l][t] * stiffness_pa[voigt(i, j)][voigt(k, l)];
            }
        }
    }
    // Rounding leaves the two triangles apart by a bit.
    for (i, j) in (0..6).flat_map(|i| (0..i).map(move |j| (i, j))) {
        rotated[i][j] = 0.5 * (rotated[i][j] + rotated[j][i]);
        rotated[j][i] = rotated[i][j];
    }
    Some(rotated)
}

/// Refuses a stiffness matrix that is not symmetric and positive definite.
pub(super) fn check(region: &str, stiffness: &[[f64; 6]; 6]) -> Result<(), MaterialError> {
    let region = region.to_owned();
    let largest_entry = stiffness.iter().flatten().fold(0.0_f64, |largest, entry| largest.max(entry.abs()));
    // NaN passes no comparison.
    let is_symmetric = (0..36)
        .all(|at| (stiffness[at / 6][at % 6] - stiffness[at % 6][at / 6]).abs() <= 1e-9 * largest_entry);
    if !(is_symmetric && largest_entry.is_finite()) {
        return Err(MaterialError::Asymmetric { region });
    }
    let scaled = Mat::from_fn(6, 6, |i, j| stiffness[i][j] / largest_entry.max(f64::MIN_POSITIVE));
    let eigen = scaled.self_adjoint_eigen(Side::Lower);
    let (least, largest) = eigen.map_or((0.0, 0.0), |eigen| (eigen.S()[0], eigen.S()[5]));
    if least > LEAST_EIGENVALUE * largest {
        return Ok(());
    }
    Err(MaterialError::Indefinite { region, least: least * largest_entry, largest: largest * largest_entry })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::assembly::{Assembly, SystemMatrix};
    use crate::discretisation::Discretisation;
    use crate::element::ElementOrder;
    use palpate_mesh::{Mesh, box_mesh};

    /// Spruce along its own axes, in GPa.
    const WOOD: Orthotropic =
        Orthotropic { young: [11.9, 0.93, 0.51], poisson: [0.37, 0.47, 0.44], shear: [0.76, 0.73, 0.036] };
    const SIZE: [f64; 3] = [0.4, 0.1, 0.2];

    /// Largest force [N] at nodes off the ends of a bar under the stress 1 along x, and the force on its high end.
    fn forces(mesh: &Mesh, order: ElementOrder, material: &Material, strain: DMat3) -> (f64, DVec3) {
        let discretisation = Discretisation::new(mesh, order);
        let assembly = Assembly::new(&discretisation, std::slice::from_ref(material));
        let u = Mat::from_fn(discretisation.dofs(), 1, |dof, _| {
            (strain * discretisation.nodes[dof / 3])[dof % 3]
        });
        let f = assembly.multiply(SystemMatrix::Stiffness, u.as_ref());
        let (mut free, mut end) = (0.0_f64, DVec3::ZERO);
        for (node, p) in discretisation.nodes.iter().enumerate() {
            let force = DVec3::new(f[(3 * node, 0)], f[(3 * node + 1, 0)], f[(3 * node + 2, 0)]);
            if p.x.abs() < 0.499 * SIZE[0] {
                free = free.max(force.length());
            } else if p.x > 0.0 {
                end += force;
            }
        }
        (free, end)
    }

    #[test]
    fn a_bar_under_tension_off_its_axes_strains_by_the_rotated_compliance() {
        // Jones (1999), (2.85): compliances of a lamina whose fibres make an angle with x, about z.
        let angle: f64 = 0.6;
        let (s, c) = angle.sin_cos();
        let ([e1, e2, _], [n12, n13, n23], [g12, ..]) = (WOOD.young, WOOD.poisson, WOOD.shear);
        let (s11, s12, s22, s66) = (1.0 / e1, -n12 / e1, 1.0 / e2, 1.0 / g12);
        let xx = s11 * c.powi(4) + (2.0 * s12 + s66) * s * s * c * c + s22 * s.powi(4);
        let yy = s12 * (s.powi(4) + c.powi(4)) + (s11 + s22 - s66) * s * s * c * c;
        let xy =
            (2.0 * s11 - 2.0 * s12 - s66) * s * c.powi(3) - (2.0 * s22 - 2.0 * s12 - s66) * s.powi(3) * c;
        let zz = -n13 / e1 * c * c - n23 / e2 * s * s;
        let strain = DMat3::from_cols_array_2d(&[[xx, 0.5 * xy, 0.0], [0.5 * xy, yy, 0.0], [0.0, 0.0, zz]]);
        let axes = [DVec3::new(c, s, 0.0), DVec3::new(-s, c, 0.0)];
        let stiffness = rotated_stiffness(&WOOD.stiffness_pa(), axes).expect("two axes");
        let material = anisotropic(stiffness, 450.0);
        super::super::check(&material).expect("a good material");
        let area = SIZE[1] * SIZE[2];
        let mut curved = box_mesh(SIZE, [4, 2, 2]).expect("a good box");
        curved.add_mid_edge_nodes();
        for found in curved.mid_edge_nodes.clone() {
            // Nodes inside are moved off the middle of their edge.
            let p = &mut curved.nodes[found.node as usize];
            let inside = (0..3).map(|axis| 0.5 - (p[axis] / SIZE[axis]).abs()).fold(1.0, f64::min);
            *p += 0.02 * inside * DVec3::new(1.0, 0.5, -0.7);
        }
        assert!(curved.is_curved());
        let straight = box_mesh(SIZE, [4, 2, 2]).expect("a good box");
        for (mesh, order) in [
            (&straight, ElementOrder::Linear),
            (&straight, ElementOrder::Quadratic),
            (&curved, ElementOrder::Quadratic),
        ] {
            let (free, end) = forces(mesh, order, &material, strain);
            assert!(free < 1e-13 * area, "{order:?}: {free:e}");
            assert!((end - DVec3::X * area).length() < 1e-12 * area, "{order:?}: {end}");
        }
    }

    #[test]
    fn equal_moduli_give_the_matrices_of_the_isotropic_law() {
        let isotropic = Material::isotropic(1e4, 0.3, 1e3);
        let g = 1e4 / 2.6;
        let equal = Orthotropic { young: [1e4; 3], poisson: [0.3; 3], shear: [g; 3] };
        let axes = [DVec3::new(1.0, 2.0, 0.5), DVec3::new(0.0, 1.0, 1.0)];
        let turned = rotated_stiffness(&equal.stiffness_pa(), axes).expect("two axes");
        let full = anisotropic(turned, 1e3);
        assert!((full.young_pa / 1e4 - 1.0).abs() < 1e-12 && (full.poisson - 0.3).abs() < 1e-12);
        let mesh = box_mesh(SIZE, [2, 1, 1]).expect("a good box");
        let discretisation = Discretisation::new(&mesh, ElementOrder::Quadratic);
        let [a, b] = [isotropic, full].map(|material| Assembly::new(&discretisation, &[material]));
        let scale = a.stiffness.iter().map(|k| k.x_axis.length()).fold(0.0, f64::max);
        assert!(
            a.stiffness
                .iter()
                .zip(&b.stiffness)
                .all(|(a, b)| { (*a - *b).to_cols_array().iter().all(|entry| entry.abs() < 1e-12 * scale) })
        );
        assert_eq!(a.mass, b.mass);
    }

    #[test]
    fn parallel_axes_and_skew_matrices_are_refused() {
        assert!(rotated_stiffness(&WOOD.stiffness_pa(), [DVec3::X, -2.0 * DVec3::X]).is_none());
        let mut skew = WOOD.stiffness_pa();
        skew[0][1] *= 2.0;
        assert!(
            check("bark", &skew)
                .is_err_and(|e| e.to_string() == "region bark: the stiffness matrix is not symmetric")
        );
        skew[0][1] = f64::NAN;
        assert!(check("", &skew).is_err());
    }
}
