//! Linear elastic materials, one per region: isotropic, or with a stiffness matrix.
//!
//! λ = E·ν / ((1 + ν)(1 − 2ν)), μ = E / (2(1 + ν)) [Pa].

mod file;
mod library;
mod stiffness;

pub use file::materials_from_toml;
pub use library::{ElasticLaw, LibraryMaterial, MATERIALS, library_material};
pub(crate) use library::{PAPER_DAMPING, PAPER_DENSITY_KG_M3, PAPER_POISSON, PAPER_YOUNG_PA};
pub(crate) use stiffness::voigt;
pub use stiffness::{Orthotropic, anisotropic, rotated_stiffness};

use palpate::Material;

/// A material that is out of range, or a material file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MaterialError {
    /// Young's modulus is out of range.
    #[error("{}Young's modulus is {value:e} Pa, expected {:e} to {:e} Pa", of(region), YOUNG_PA[0], YOUNG_PA[1])]
    Young {
        /// Name of the region; empty if the body has one material.
        region: String,
        /// The given value [Pa].
        value: f64,
    },
    /// Poisson's ratio is that of an incompressible material, or above.
    #[error(
        "{}Poisson's ratio is {value}, expected below 0.5: at 0.5 the material is incompressible and has no \
         displacement-only stiffness; use 0.49 for rubber or soft tissue",
        of(region)
    )]
    Incompressible {
        /// Name of the region; empty if the body has one material.
        region: String,
        /// The given value.
        value: f64,
    },
    /// Poisson's ratio is out of range.
    #[error("{}Poisson's ratio is {value}, expected above -1 and below 0.5", of(region))]
    Poisson {
        /// Name of the region; empty if the body has one material.
        region: String,
        /// The given value.
        value: f64,
    },
    /// The density is out of range.
    #[error("{}density is {value:e} kg/m³, expected {:e} to {:e} kg/m³", of(region), DENSITY_KG_M3[0], DENSITY_KG_M3[1])]
    Density {
        /// Name of the region; empty if the body has one material.
        region: String,
        /// The given value [kg/m³].
        value: f64,
    },
    /// The stiffness matrix is not positive definite.
    #[error(
        "{}the stiffness matrix is not positive definite (least eigenvalue {least:.3e} Pa, largest {largest:.3e} Pa): some strain would cost \
         no energy; check signs and Poisson's ratios: ν_ij² must be below E_i/E_j",
        of(region)
    )]
    Indefinite {
        /// Name of the region; empty if the body has one material.
        region: String,
        /// Least eigenvalue [Pa].
        least: f64,
        /// Largest eigenvalue [Pa].
        largest: f64,
    },
    /// The stiffness matrix is not symmetric.
    #[error("{}the stiffness matrix is not symmetric", of(region))]
    Asymmetric {
        /// Name of the region; empty if the body has one material.
        region: String,
    },
    /// There is no such material in the library.
    #[error("there is no material {name:?}; `palpate materials` has: {}", known.join(", "))]
    NotInLibrary {
        /// The given name.
        name: String,
        /// Names in the library.
        known: Vec<&'static str>,
    },
    /// Keys of a material contradict each other, or are missing.
    #[error("material file: region {region}: {what}")]
    Keys {
        /// Name or number of the region.
        region: String,
        /// Expectation.
        what: &'static str,
    },
    /// The material file is not TOML of the expected form.
    #[error("material file: {message}")]
    Syntax {
        /// Message of the TOML parser, with line and column.
        message: String,
    },
    /// The material file has two materials for one region.
    #[error("material file: region {region} has more than one material")]
    Duplicate {
        /// Name or number of the region.
        region: String,
    },
    /// A region of the mesh has no material.
    #[error("region {region} of the mesh has no material; the file has materials for: {}", known.join(", "))]
    Missing {
        /// Name or number of the region.
        region: String,
        /// Regions in the material file.
        known: Vec<String>,
    },
    /// The material file has a region that the mesh does not have.
    #[error("the material file names region {region}, which the mesh does not have; it has: {}", known.join(", "))]
    Unknown {
        /// Name or number of the region.
        region: String,
        /// Regions of the mesh.
        known: Vec<String>,
    },
}

fn of(region: &str) -> String {
    if region.is_empty() { String::new() } else { format!("region {region}: ") }
}

/// Lamé constants (λ, μ) [Pa].
pub(crate) fn lame_constants(material: &Material) -> (f64, f64) {
    let (young, poisson) = (material.young_pa, material.poisson);
    let lambda = young * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson));
    (lambda, young / (2.0 * (1.0 + poisson)))
}

/// Range of Young's moduli [Pa]: wide around foam and diamond, for scaled units, within what f64 squares safely.
const YOUNG_PA: [f64; 2] = [1e-6, 1e18];

/// Range of densities [kg/m³].
const DENSITY_KG_M3: [f64; 2] = [1e-9, 1e12];

/// Refuses a material outside of what linear elasticity allows.
///
/// # Errors
/// [`MaterialError`] with the region, the value and its range.
pub(crate) fn check(material: &Material) -> Result<(), MaterialError> {
    let Material { region, young_pa, poisson, density_kg_m3, stiffness_pa } = material;
    let region = region.clone();
    let within = |value: f64, [low, high]: [f64; 2]| (low..=high).contains(&value);
    if let Some(stiffness) = stiffness_pa {
        stiffness::check(&region, stiffness)?;
    }
    if !within(*young_pa, YOUNG_PA) {
        return Err(MaterialError::Young { region, value: *young_pa });
    }
    if *poisson >= 0.5 {
        return Err(MaterialError::Incompressible { region, value: *poisson });
    }
    if !(*poisson > -1.0 && poisson.is_finite()) {
        return Err(MaterialError::Poisson { region, value: *poisson });
    }
    if !within(*density_kg_m3, DENSITY_KG_M3) {
        return Err(MaterialError::Density { region, value: *density_kg_m3 });
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mesh::{Mesh, Region};

    fn jelly(poisson: f64) -> Material {
        Material::isotropic(2000.0, poisson, 110.0)
    }

    #[test]
    fn lame_constants_of_the_papers_cube() {
        let (lambda, mu) = lame_constants(&jelly(0.49));
        assert!((lambda - 32_885.9).abs() < 0.1 && (mu - 671.1).abs() < 0.1, "{lambda} {mu}");
    }

    #[test]
    fn impossible_numbers_are_named() {
        let text = check(&jelly(0.5)).map_err(|e| e.to_string());
        assert!(
            text.as_ref().is_err_and(|t| t.starts_with("Poisson's ratio is 0.5, expected below 0.5")),
            "{text:?}"
        );
        assert!(check(&jelly(f64::NAN)).is_err() && check(&jelly(-1.0)).is_err());
        assert!(check(&Material { young_pa: 0.0, ..jelly(0.3) }).is_err());
        assert!(check(&Material { density_kg_m3: f64::INFINITY, ..jelly(0.3) }).is_err());
    }

    #[test]
    fn every_region_needs_a_material_and_every_material_a_region() {
        let region = |tag, name: &str| Region { tag, name: Some(name.into()), material: None };
        let mesh = Mesh { regions: vec![region(1, "core"), region(2, "skin")], ..Mesh::default() };
        let entry =
            |r: &str| format!("[[material]]\nregion = {r}\nyoung = 1e4\npoisson = 0.3\ndensity = 1e3\n");
        let read = |text: String| materials_from_toml(&text, &mesh).map_err(|e| e.to_string());
        let both = read(entry("\"skin\"") + &entry("1")).expect("names and numbers both work");
        assert_eq!(both.iter().map(|m| m.region.as_str()).collect::<Vec<_>>(), ["core", "skin"]);
        assert_eq!(
            read(entry("1")).expect_err("skin is missing"),
            "region skin of the mesh has no material; the file has materials for: 1"
        );
        assert_eq!(
            read(entry("7")).expect_err("no region 7"),
            "the material file names region 7, which the mesh does not have; it has: core, skin"
        );
    }
}
