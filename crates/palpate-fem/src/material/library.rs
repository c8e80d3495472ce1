//! Named materials, with the source of each number.
//!
//! Soft materials scatter: each has a range of what has been measured, and a value in it for a first try.

use super::MaterialError;
use super::stiffness::{Orthotropic, anisotropic};
use palpate::{Damping, Material};

/// Young's modulus [Pa], Poisson's ratio, density [kg/m³] and damping of the paper's cube.
pub(crate) const PAPER_YOUNG_PA: f64 = 2000.0;
pub(crate) const PAPER_POISSON: f64 = 0.49;
pub(crate) const PAPER_DENSITY_KG_M3: f64 = 110.0;
pub(crate) const PAPER_DAMPING: Damping = Damping::Rayleigh { alpha: 2.0, beta: 2e-4 };

/// Elastic law of a named material.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElasticLaw {
    /// Young's modulus [Pa] and Poisson's ratio.
    Isotropic {
        /// Young's modulus [Pa].
        young_pa: f64,
        /// Poisson's ratio.
        poisson: f64,
    },
    /// Three axes: along x, y and z of the mesh.
    Orthotropic(Orthotropic),
}

/// Material of the library.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LibraryMaterial {
    /// Name.
    pub name: &'static str,
    /// Elastic law.
    pub law: ElasticLaw,
    /// Range of Young's moduli in the literature [Pa].
    pub young_range_pa: [f64; 2],
    /// Density [kg/m³].
    pub density_kg_m3: f64,
    /// Damping, where the source states one.
    pub damping: Option<Damping>,
    /// Author, title, year of the values, and of the range.
    pub source: &'static str,
}

const fn isotropic(young_pa: f64, poisson: f64) -> ElasticLaw {
    ElasticLaw::Isotropic { young_pa, poisson }
}

/// Young's modulus of Sitka spruce along the grain [Pa]: that of bending at 12 % moisture and a tenth more, as the handbook says.
const SPRUCE_PA: f64 = 1.1 * 10.8e9;

/// Materials by name. Poisson's ratios of rubber-like ones and tissues are 0.49 in place of nearly 0.5.
pub const MATERIALS: &[LibraryMaterial] = &[
    LibraryMaterial {
        name: "paper",
        law: isotropic(PAPER_YOUNG_PA, PAPER_POISSON),
        young_range_pa: [PAPER_YOUNG_PA; 2],
        density_kg_m3: PAPER_DENSITY_KG_M3,
        damping: Some(PAPER_DAMPING),
        source: "cube of the paper (section 3.1); damping of its reference series",
    },
    LibraryMaterial {
        name: "ecoflex-00-30",
        law: isotropic(6.9e4, 0.49),
        young_range_pa: [5e4, 1.3e5],
        density_kg_m3: 1070.0,
        damping: None,
        source: "Smooth-On, Ecoflex Series, technical bulletin: 10 psi at 100 % strain, specific gravity 1.07. The modulus at small strain scatters",
    },
    LibraryMaterial {
        name: "gelatine",
        law: isotropic(1.2e4, 0.49),
        young_range_pa: [3e3, 5e4],
        density_kg_m3: 1010.0,
        damping: None,
        source: "Hall, Bilgen, Insana, Krouskop, Phantom materials for elastography, 1997: E = 0.0034 kPa·(c/(g/l))^2.09, here 50 g/l; range 25 to 100 g/l",
    },
    LibraryMaterial {
        name: "foam",
        law: isotropic(2.8e4, 0.33),
        young_range_pa: [1e4, 1e5],
        density_kg_m3: 30.0,
        damping: None,
        source: "Gibson, Ashby, Cellular Solids, 1997: flexible polyurethane with open cells, E = 45 MPa·(ρ/1200 kg/m³)², ν = 1/3",
    },
    LibraryMaterial {
        name: "liver",
        law: isotropic(5.5e3, 0.49),
        young_range_pa: [6e2, 2e4],
        density_kg_m3: 1060.0,
        damping: None,
        source: "Roulot et al., Liver stiffness values in apparently healthy subjects, 2008: 5.5 ± 1.6 kPa; range of other methods and of disease. Density: Duck, Physical Properties of Tissue, 1990",
    },
    LibraryMaterial {
        name: "fat",
        law: isotropic(3.25e3, 0.49),
        young_range_pa: [5e2, 2.5e4],
        density_kg_m3: 950.0,
        damping: None,
        source: "Samani, Zubovits, Plewes, Elastic moduli of normal and pathological human breast tissues, 2007: 3.25 ± 0.91 kPa; Krouskop et al. 1998 found about 18 kPa under compression. Density: ICRU Report 44, 1989",
    },
    LibraryMaterial {
        name: "skin",
        law: isotropic(4.2e5, 0.49),
        young_range_pa: [4.5e3, 8.5e5],
        density_kg_m3: 1090.0,
        damping: None,
        source: "Agache, Monneur, Leveque, De Rigal, Mechanical properties and Young's modulus of human skin in vivo, 1980: 0.42 MPa when young, 0.85 MPa when old (torsion); Pailler-Mattei et al. 2008 found 4.5 to 8 kPa by indentation. Density: ICRU Report 44, 1989",
    },
    LibraryMaterial {
        name: "rubber",
        law: isotropic(2.2e6, 0.49),
        young_range_pa: [9.2e5, 7.4e6],
        density_kg_m3: 1100.0,
        damping: None,
        source: "Lindley, Engineering Design with Natural Rubber, 1974: hardness 50 IRHD; range 30 to 70 IRHD",
    },
    LibraryMaterial {
        name: "wood",
        law: ElasticLaw::Orthotropic(Orthotropic {
            young: [SPRUCE_PA, 0.078 * SPRUCE_PA, 0.043 * SPRUCE_PA],
            poisson: [0.372, 0.467, 0.435],
            shear: [0.064 * SPRUCE_PA, 0.061 * SPRUCE_PA, 0.003 * SPRUCE_PA],
        }),
        young_range_pa: [0.043 * SPRUCE_PA, SPRUCE_PA],
        density_kg_m3: 450.0,
        damping: None,
        source: "Forest Products Laboratory, Wood Handbook, 2010, chapter 5: Sitka spruce at 12 % moisture; along the grain x, radial y, tangential z",
    },
    LibraryMaterial {
        name: "aluminium",
        law: isotropic(6.9e10, 0.33),
        young_range_pa: [6.8e10, 7.3e10],
        density_kg_m3: 2700.0,
        damping: None,
        source: "ASM Handbook, volume 2, 1990: alloy 6061; range of alloys",
    },
    LibraryMaterial {
        name: "steel",
        law: isotropic(2.1e11, 0.3),
        young_range_pa: [1.9e11, 2.15e11],
        density_kg_m3: 7850.0,
        damping: None,
        source: "CEN, EN 1993-1-1, Eurocode 3, 2005; range of steels, stainless ones included",
    },
];

/// Material of the library with a name.
///
/// # Errors
/// [`MaterialError::NotInLibrary`].
pub fn library_material(name: &str) -> Result<&'static LibraryMaterial, MaterialError> {
    let known = || MATERIALS.iter().map(|material| material.name).collect();
    let found = MATERIALS.iter().find(|material| material.name == name.to_ascii_lowercase());
    found.ok_or_else(|| MaterialError::NotInLibrary { name: name.to_owned(), known: known() })
}

impl LibraryMaterial {
    /// Material of a body without regions.
    pub fn material(&self) -> Material {
        match self.law {
            ElasticLaw::Isotropic { young_pa, poisson } => {
                Material::isotropic(young_pa, poisson, self.density_kg_m3)
            }
            ElasticLaw::Orthotropic(constants) => anisotropic(constants.stiffness_pa(), self.density_kg_m3),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::check;

    #[test]
    fn every_material_can_be_recorded_and_has_a_source_and_a_range() {
        for one in MATERIALS {
            check(&one.material()).unwrap_or_else(|error| panic!("{}: {error}", one.name));
            let [low, high] = one.young_range_pa;
            let young = match one.law {
                ElasticLaw::Isotropic { young_pa, .. } => young_pa,
                ElasticLaw::Orthotropic(Orthotropic { young, .. }) => young[0],
            };
            assert!(low <= young && young <= high, "{}", one.name);
            assert!(one.source.chars().any(|c| c.is_ascii_digit()), "{}", one.name);
        }
        assert!(library_material("Steel").is_ok());
    }

    #[test]
    fn values_by_formulas_are_those_of_the_formulas() {
        let young = |name: &str| match library_material(name).expect("a material").law {
            ElasticLaw::Isotropic { young_pa, .. } => young_pa,
            ElasticLaw::Orthotropic(_) => f64::NAN,
        };
        let gelatine = 3.4 * 50.0_f64.powf(2.09);
        assert!((young("gelatine") / gelatine - 1.0).abs() < 0.02, "{gelatine}");
        let foam = 45e6 * (30.0_f64 / 1200.0).powi(2);
        assert!((young("foam") / foam - 1.0).abs() < 0.02, "{foam}");
        let psi = 4.448_221_6 / 0.0254_f64.powi(2);
        assert!((young("ecoflex-00-30") / (10.0 * psi) - 1.0).abs() < 0.01);
    }
}
