//! The elastic cube of the paper (section 3.1): side 0.1 m, E = 2000 Pa, ν = 0.49, ρ = 110 kg/m³.

use crate::element::ElementOrder;
use crate::material;
use crate::record::RecordParameters;
use palpate::{Damping, Material};
use palpate_mesh::{Mesh, MeshError, box_mesh};

/// Side [m].
pub const SIDE_M: f64 = 0.1;

/// Young's modulus E [Pa].
pub const YOUNG_PA: f64 = material::PAPER_YOUNG_PA;

/// Poisson's ratio ν [1].
pub const POISSON: f64 = material::PAPER_POISSON;

/// Density ρ [kg/m³].
pub const DENSITY_KG_M3: f64 = material::PAPER_DENSITY_KG_M3;

/// Cells along each side of the paper's mesh.
pub const CELLS: u32 = 12;

/// Damping of the reference series in `data/reference`: α = 2 1/s, β = 2·10⁻⁴ s.
pub const DAMPING: Damping = material::PAPER_DAMPING;

/// Material of the whole cube.
pub fn material() -> Material {
    Material::isotropic(YOUNG_PA, POISSON, DENSITY_KG_M3)
}

/// The cube with a number of cells along each side, as `palpate record` names it.
pub fn source(cells: u32) -> String {
    format!("box:{SIDE_M}x{SIDE_M}x{SIDE_M}/{cells}x{cells}x{cells}")
}

/// Mesh with a number of cells along each side.
///
/// # Errors
/// As [`box_mesh`].
pub fn mesh(cells: u32) -> Result<Mesh, MeshError> {
    box_mesh([SIDE_M; 3], [cells; 3])
}

/// Parameters of a certified recording of a free cube with linear elements.
pub fn parameters(cells: u32, modes: usize) -> RecordParameters {
    RecordParameters {
        source: source(cells),
        ..RecordParameters::new(vec![material()], ElementOrder::Linear, modes, DAMPING)
    }
}
