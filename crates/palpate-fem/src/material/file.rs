//! Material files: TOML with a table per region.

use super::library::library_material;
use super::stiffness::{Orthotropic, VOIGT_PAIRS, anisotropic, rotated_stiffness};
use super::{MaterialError, check};
use glam::DVec3;
use palpate::Material;
use palpate_mesh::{Mesh, Region};
use serde::Deserialize;

/// Schema of a material file.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialFile {
    material: Vec<MaterialEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct MaterialEntry {
    region: RegionKey,
    name: Option<String>,
    young: Option<f64>,
    poisson: Option<f64>,
    density: Option<f64>,
    orthotropic: Option<Orthotropic>,
    stiffness: Option<Vec<f64>>,
    axes: Option<[[f64; 3]; 2]>,
}

#[derive(Deserialize, PartialEq)]
#[serde(untagged, expecting = "a region is a name in quotes or a whole number")]
enum RegionKey {
    Number(i64),
    Name(String),
}

impl RegionKey {
    fn matches(&self, region: &Region) -> bool {
        match self {
            Self::Number(tag) => region.tag == *tag,
            Self::Name(name) => region.name.as_ref() == Some(name) || region.tag.to_string() == *name,
        }
    }

    fn label(&self) -> String {
        match self {
            Self::Number(tag) => tag.to_string(),
            Self::Name(name) => name.clone(),
        }
    }
}

impl MaterialEntry {
    fn material(&self, label: &str) -> Result<Material, MaterialError> {
        let fail = |what| Err(MaterialError::Keys { region: label.to_owned(), what });
        let laws = [
            self.name.is_some(),
            self.young.is_some() || self.poisson.is_some(),
            self.orthotropic.is_some(),
            self.stiffness.is_some(),
        ];
        if laws.into_iter().filter(|given| *given).count() != 1 {
            return fail("give one of: young with poisson, name, orthotropic, stiffness");
        }
        let mut material = if let Some(name) = &self.name {
            library_material(name)?.material()
        } else {
            let Some(density) = self.density else { return fail("density is missing [kg/m³]") };
            match (self.young, self.poisson, &self.orthotropic, &self.stiffness) {
                (Some(young), Some(poisson), ..) => Material::isotropic(young, poisson, density),
                (_, _, Some(orthotropic), _) => anisotropic(orthotropic.stiffness_pa(), density),
                (_, _, _, Some(entries)) => {
                    let Some(stiffness) = symmetric(entries) else {
                        return fail(
                            "stiffness has 21 numbers: the rows of the upper triangle in the order xx, yy, zz, yz, xz, xy",
                        );
                    };
                    anisotropic(stiffness, density)
                }
                _ => return fail("young and poisson go together"),
            }
        };
        if let Some(density) = self.density {
            material.density_kg_m3 = density;
        }
        if let Some(axes) = self.axes {
            let Some(stiffness) = material.stiffness_pa else {
                return fail("axes are for orthotropic and stiffness: an isotropic material has none");
            };
            let Some(rotated) = rotated_stiffness(&stiffness, axes.map(DVec3::from)) else {
                return fail(
                    "axes are two directions that are not parallel: the material's first and second axis",
                );
            };
            material = Material { stiffness_pa: Some(rotated), ..material };
        }
        Ok(material)
    }
}

/// Symmetric matrix of the 21 entries of its upper triangle, row by row.
fn symmetric(entries: &[f64]) -> Option<[[f64; 6]; 6]> {
    let mut matrix = [[0.0; 6]; 6];
    let places = VOIGT_PAIRS.iter().enumerate().flat_map(|(i, _)| (i..6).map(move |j| (i, j)));
    for ((i, j), &entry) in places.zip(<&[f64; 21]>::try_from(entries).ok()?) {
        (matrix[i][j], matrix[j][i]) = (entry, entry);
    }
    Some(matrix)
}

/// Materials from the text of a material file, one per region of the mesh, in its order:
///
/// ```toml
/// [[material]]
/// region = "skin"      # name or number in the mesh file
/// young = 5e4          # Pa
/// poisson = 0.45
/// density = 1000.0     # kg/m³
///
/// [[material]]
/// region = "core"
/// name = "liver"       # of `palpate materials`
///
/// [[material]]
/// region = "trunk"
/// density = 450.0
/// orthotropic = { young = [12e9, 0.9e9, 0.5e9], poisson = [0.37, 0.47, 0.44], shear = [0.76e9, 0.73e9, 0.04e9] }
/// axes = [[0, 0, 1], [1, 0, 0]]    # first and second axis of the material in the mesh
/// ```
///
/// Orthotropic constants are E1, E2, E3; ν12, ν13, ν23; G12, G13, G23 [Pa], with ν12 the contraction along 2 by tension along 1. In their place,
/// `stiffness` takes 21 entries [Pa]: the rows of the upper triangle in the order xx, yy, zz, yz, xz, xy, with engineering shear strains.
///
/// # Errors
/// [`MaterialError`] when the text is not of this form, a number is out of range, or regions don't match the mesh.
pub fn materials_from_toml(text: &str, mesh: &Mesh) -> Result<Vec<Material>, MaterialError> {
    let file: MaterialFile = toml::from_str(text)
        .map_err(|e| MaterialError::Syntax { message: e.to_string().trim_end().into() })?;
    for entry in &file.material {
        if !mesh.regions.iter().any(|region| entry.region.matches(region)) {
            let known = mesh.regions.iter().map(Region::label).collect();
            return Err(MaterialError::Unknown { region: entry.region.label(), known });
        }
    }
    let for_region = |region: &Region| {
        if file.material.iter().filter(|entry| entry.region.matches(region)).count() > 1 {
            return Err(MaterialError::Duplicate { region: region.label() });
        }
        let Some(entry) = file.material.iter().find(|entry| entry.region.matches(region)) else {
            let known = file.material.iter().map(|entry| entry.region.label()).collect();
            return Err(MaterialError::Missing { region: region.label(), known });
        };
        let region = region.label();
        let material = Material { region: region.clone(), ..entry.material(&region)? };
        check(&material).map(|()| material)
    };
    mesh.regions.iter().map(for_region).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(entry: &str) -> Result<Material, String> {
        let mesh = Mesh { regions: vec![Region { tag: 1, ..Region::default() }], ..Mesh::default() };
        let text = format!("[[material]]\nregion = 1\n{entry}\n");
        materials_from_toml(&text, &mesh).map(|mut all| all.remove(0)).map_err(|e| e.to_string())
    }

    #[test]
    fn every_way_of_giving_a_material_is_read() {
        let steel = read("name = \"steel\"").expect("a material");
        assert_eq!((steel.young_pa, steel.poisson, steel.stiffness_pa), (210e9, 0.3, None));
        assert_eq!(read("name = \"steel\"\ndensity = 8000.0").map(|m| m.density_kg_m3), Ok(8000.0));
        // Equal constants along all axes: the isotropic stiffness, by λ + 2μ, λ and μ.
        let g = 1e4 / 2.6;
        let orthotropic = format!(
            "density = 1e3\northotropic = {{ young = [1e4, 1e4, 1e4], poisson = [0.3, 0.3, 0.3], shear = [{g}, {g}, {g}] }}"
        );
        let equal = read(&orthotropic).expect("a material");
        assert!((equal.young_pa / 1e4 - 1.0).abs() < 1e-12 && (equal.poisson - 0.3).abs() < 1e-12);
        let (lambda, mu) = super::super::lame_constants(&Material::isotropic(1e4, 0.3, 1e3));
        let entries: Vec<String> = (0..6)
            .flat_map(|i| (i..6).map(move |j| (i, j)))
            .map(|(i, j)| match (i == j, i.max(j) < 3) {
                (true, true) => lambda + 2.0 * mu,
                (false, true) => lambda,
                (true, false) => mu,
                _ => 0.0,
            })
            .map(|entry| format!("{entry:?}"))
            .collect();
        let full = read(&format!("density = 1e3\nstiffness = [{}]", entries.join(", "))).expect("a material");
        let (a, b) = (equal.stiffness_pa.unwrap_or_default(), full.stiffness_pa.unwrap_or_default());
        assert!(a.iter().flatten().zip(b.iter().flatten()).all(|(a, b)| (a - b).abs() < 1e-8), "{a:?} {b:?}");
    }

    #[test]
    fn what_does_not_fit_together_is_named() {
        let orthotropic = "density = 1e3\northotropic = { young = [1e4, 1e3, 1e3], poisson = [0.3, 0.3, 0.3], shear = [1e3, 1e3, 1e3] }";
        assert!(read(orthotropic).is_ok());
        for (entry, expected) in [
            (
                "young = 1e4\npoisson = 0.3\nname = \"steel\"\ndensity = 1.0",
                "material file: region 1: give one of: young with poisson, name, orthotropic, stiffness",
            ),
            ("young = 1e4\npoisson = 0.3", "material file: region 1: density is missing [kg/m³]"),
            ("young = 1e4\ndensity = 1.0", "material file: region 1: young and poisson go together"),
            (
                "name = \"steel\"\naxes = [[1, 0, 0], [0, 1, 0]]",
                "material file: region 1: axes are for orthotropic and stiffness: an isotropic material has none",
            ),
            (
                &format!("{orthotropic}\naxes = [[1, 0, 0], [2, 0, 0]]"),
                "material file: region 1: axes are two directions that are not parallel: the material's first and second axis",
            ),
            (
                "density = 1.0\nstiffness = [1.0]",
                "material file: region 1: stiffness has 21 numbers: the rows of the upper triangle in the order xx, yy, zz, yz, xz, xy",
            ),
        ] {
            assert_eq!(read(entry), Err(expected.to_owned()));
        }
        let unknown = read("name = \"cheese\"").expect_err("no such material");
        assert!(
            unknown.starts_with("there is no material \"cheese\"; `palpate materials` has: paper, "),
            "{unknown}"
        );
        let indefinite = orthotropic.replace("poisson = [0.3, 0.3, 0.3]", "poisson = [4.0, 0.3, 0.3]");
        let text = read(&indefinite).expect_err("indefinite");
        assert!(text.starts_with("region 1: the stiffness matrix is not positive definite (least"), "{text}");
    }
}
