//! Elastic materials, and bodies that are recorded of one.

use crate::recording_cache::recorded_once;
use glam::DVec3;
use palpate::{Damping, Material, Recording};
use palpate_fem::paper_cube::{DENSITY_KG_M3, POISSON, YOUNG_PA};
use palpate_fem::{ElementOrder, RecordError, RecordExtent, RecordParameters};
use palpate_mesh::Mesh;
use std::sync::Arc;

/// An isotropic linear-elastic material with stiffness-proportional damping C = βK.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticMaterial {
    /// Young's modulus E [Pa].
    pub young_pa: f64,
    /// Poisson's ratio ν.
    pub poisson: f64,
    /// Density ρ [kg/m³].
    pub density_kg_m3: f64,
    /// β [s].
    pub stiffness_damping_s: f64,
}

/// Material of the paper's cube with the damping of the reference solution of its fall, β = 10⁻⁴ s.
pub const PAPER_MATERIAL: ElasticMaterial = ElasticMaterial {
    young_pa: YOUNG_PA,
    poisson: POISSON,
    density_kg_m3: DENSITY_KG_M3,
    stiffness_damping_s: 1e-4,
};

impl ElasticMaterial {
    /// Parameters of a recording without certificate.
    pub fn parameters(&self, order: ElementOrder, modes: usize) -> RecordParameters {
        RecordParameters {
            damping: Damping::Rayleigh { alpha: 0.0, beta: self.stiffness_damping_s },
            extent: RecordExtent::NoCertificate,
            ..undamped(self.young_pa, self.poisson, self.density_kg_m3, order, modes)
        }
    }

    /// A body that moves freely.
    ///
    /// # Errors
    /// As [`palpate_fem::record`].
    pub fn free_body(
        &self,
        mesh: Mesh,
        order: ElementOrder,
        modes: usize,
    ) -> Result<Arc<Recording>, RecordError> {
        recorded_once(mesh, &self.parameters(order, modes))
    }

    /// A body whose nodes are fixed where `fixed` holds for their position [m].
    ///
    /// # Errors
    /// As [`palpate_fem::record`].
    pub fn fixed_body(
        &self,
        mesh: Mesh,
        order: ElementOrder,
        modes: usize,
        fixed: impl Fn(DVec3) -> bool,
    ) -> Result<Arc<Recording>, RecordError> {
        let fixed_nodes = nodes_where(&mesh, fixed);
        recorded_once(mesh, &RecordParameters { fixed_nodes, ..self.parameters(order, modes) })
    }
}

/// Nodes of a mesh where a condition holds for their position [m].
pub fn nodes_where(mesh: &Mesh, holds: impl Fn(DVec3) -> bool) -> Vec<u32> {
    (0..mesh.nodes.len() as u32).filter(|&node| holds(mesh.nodes[node as usize])).collect()
}

/// A material of all regions: E [Pa], ν, ρ [kg/m³].
pub const fn isotropic(young_pa: f64, poisson: f64, density_kg_m3: f64) -> Material {
    Material::isotropic(young_pa, poisson, density_kg_m3)
}

/// Parameters of an undamped body of one material: E [Pa], ν, ρ [kg/m³].
pub fn undamped(
    young_pa: f64,
    poisson: f64,
    density_kg_m3: f64,
    order: ElementOrder,
    modes: usize,
) -> RecordParameters {
    let materials = vec![isotropic(young_pa, poisson, density_kg_m3)];
    RecordParameters {
        source: "verification".into(),
        ..RecordParameters::new(materials, order, modes, Damping::Ratio(0.0))
    }
}
