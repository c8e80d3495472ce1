//! The elastic cube of the paper (section 3.1): side 0.1 m, E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³.

use crate::material::{ElasticMaterial, undamped};
use palpate::Damping;
use palpate_fem::mesh::{Mesh, MeshError, box_mesh};
use palpate_fem::{ElementOrder, RecordParameters};

/// Side of the cube [m].
pub const PAPER_CUBE_SIDE_M: f64 = 0.1;

/// The cube's material with the damping of the reference solution of its fall, β = 10⁻⁴ s.
pub const PAPER_MATERIAL: ElasticMaterial =
    ElasticMaterial { young_pa: 2000.0, poisson: 0.49, density_kg_m3: 110.0, stiffness_damping_s: 1e-4 };

/// The cube with a number of cells along each side; the paper's has 12.
///
/// # Errors
/// As [`box_mesh`].
pub fn paper_cube_mesh(cells: u32) -> Result<Mesh, MeshError> {
    box_mesh([PAPER_CUBE_SIDE_M; 3], [cells; 3])
}

/// Parameters of a certified recording with linear elements and the damping α = 2 1/s, β = 2·10⁻⁴ s.
pub fn paper_cube_parameters(cells: u32, modes: usize) -> RecordParameters {
    let ElasticMaterial { young_pa, poisson, density_kg_m3, .. } = PAPER_MATERIAL;
    RecordParameters {
        damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        source: format!("box:0.1x0.1x0.1/{cells}x{cells}x{cells}"),
        ..undamped(young_pa, poisson, density_kg_m3, ElementOrder::Linear, modes)
    }
}
