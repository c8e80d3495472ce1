//! Materials of the regions of a mesh: by numbers, by name, from a material file or from the mesh file.

use crate::error::{SceneError, SceneErrorKind};
use palpate::{Damping, Material};
use palpate_fem::{LibraryMaterial, library_material, materials_from_toml};
use palpate_mesh::{Mesh, Region, read_regular_text};
use std::fmt::Display;
use std::path::PathBuf;

/// Choice of the materials of a body.
#[derive(Debug, Clone, PartialEq, Default)]
#[expect(clippy::large_enum_variant, reason = "there is one per recording")]
pub enum MaterialChoice {
    /// Those of the mesh file.
    #[default]
    OfMesh,
    /// One for all regions.
    Uniform(Material),
    /// Materials of the library by `NAME` and `REGION=NAME`, as `--material`; other regions take that of the mesh file.
    Named(Vec<String>),
    /// A material file, as `--materials`.
    File(PathBuf),
    /// Text of a material file, with a name for messages.
    Text(String, String),
}

impl MaterialChoice {
    /// Materials of the regions, and the damping that comes with their names.
    pub(crate) fn of(&self, mesh: &Mesh) -> Result<(Vec<Material>, Option<Damping>), SceneError> {
        let materials = match self {
            Self::Named(choices) => return by_name(choices, mesh),
            Self::OfMesh => mesh.regions.iter().map(of_file).collect::<Result<_, _>>()?,
            Self::Uniform(material) => vec![material.clone(); mesh.regions.len()],
            Self::File(path) => {
                let text =
                    read_regular_text(path).map_err(|e| SceneError::io("read the materials", path, &e))?;
                of_text(&text, path.display(), mesh)?
            }
            Self::Text(text, name) => of_text(text, name, mesh)?,
        };
        Ok((materials, None))
    }
}

/// Materials of a material file's text.
fn of_text(text: &str, name: impl Display, mesh: &Mesh) -> Result<Vec<Material>, SceneError> {
    let refused = |error| SceneError::new(SceneErrorKind::Record, format!("{name}: {error}"));
    materials_from_toml(text, mesh).map_err(refused)
}

fn refused(message: impl Display) -> SceneError {
    SceneError::new(SceneErrorKind::Mesh, message)
}

/// Materials of the library by `NAME` and `REGION=NAME`; other regions take that of the mesh file. Damping is that of the material if all
/// regions have the same.
fn by_name(choices: &[String], mesh: &Mesh) -> Result<(Vec<Material>, Option<Damping>), SceneError> {
    let mut chosen: Vec<Option<&LibraryMaterial>> = vec![None; mesh.regions.len()];
    let (mut of_all, mut of_region) = (None, vec![None; mesh.regions.len()]);
    for choice in choices {
        let (label, name) =
            choice.split_once('=').map_or((None, choice.as_str()), |(r, n)| (Some(r.trim()), n.trim()));
        let found = library_material(name).map_err(|error| refused(format!("--material: {error}")))?;
        let slots: Vec<&mut Option<_>> = match label {
            None => vec![&mut of_all],
            Some(label) => {
                let matches = |region: &Region| region.label() == label || region.tag.to_string() == label;
                of_region
                    .iter_mut()
                    .zip(&mesh.regions)
                    .filter(|(_, region)| matches(region))
                    .map(|(slot, _)| slot)
                    .collect()
            }
        };
        if slots.is_empty() {
            let regions: Vec<String> = mesh.regions.iter().map(Region::label).collect();
            return Err(refused(format!(
                "--material {choice}: the mesh has no such region; it has {}",
                regions.join(", ")
            )));
        }
        for slot in slots {
            if slot.replace(found).is_some() {
                return Err(refused(format!("--material {choice}: there is a material for that already")));
            }
        }
    }
    for (slot, of_region) in chosen.iter_mut().zip(of_region) {
        *slot = of_region.or(of_all);
    }
    let mut materials = Vec::with_capacity(chosen.len());
    for (found, region) in chosen.iter().zip(&mesh.regions) {
        materials.push(match found {
            Some(found) => {
                let label = if mesh.regions.len() > 1 { region.label() } else { String::new() };
                Material { region: label, ..found.material() }
            }
            None => of_file(region)?,
        });
    }
    let first = chosen.first().copied().flatten().and_then(|found| found.damping);
    let is_common = chosen.iter().all(|found| found.and_then(|found| found.damping) == first);
    Ok((materials, first.filter(|_| is_common)))
}

/// Material that the mesh file gives to a region.
fn of_file(region: &Region) -> Result<Material, SceneError> {
    let label = region.label();
    let Some(found) = &region.material else {
        return Err(refused(format!(
            "region '{label}' has no material in the mesh file: give --young, --poisson and --density, --material, or --materials"
        )));
    };
    let material = Material::isotropic(found.young_pa, found.poisson, found.density_kg_m3);
    Ok(Material { region: label, ..material })
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mesh::RegionMaterial;

    fn mesh() -> Mesh {
        let region = |tag, name: &str| Region { tag, name: Some(name.into()), material: None };
        Mesh { regions: vec![region(3, "core"), region(5, "hull")], ..Mesh::default() }
    }

    fn chosen(choices: &[&str], mesh: &Mesh) -> Result<Vec<(String, f64)>, String> {
        let choices: Vec<String> = choices.iter().map(ToString::to_string).collect();
        let (materials, _) = by_name(&choices, mesh).map_err(|error| error.message)?;
        Ok(materials.into_iter().map(|one| (one.region, one.density_kg_m3)).collect())
    }

    #[test]
    fn names_go_to_regions_and_the_rest() {
        let is = |core: f64, hull: f64| Ok(vec![("core".to_owned(), core), ("hull".to_owned(), hull)]);
        assert_eq!(chosen(&["steel"], &mesh()), is(7850.0, 7850.0));
        assert_eq!(chosen(&["core=steel", "rubber"], &mesh()), is(7850.0, 1100.0));
        assert_eq!(chosen(&["5=steel", "core = rubber"], &mesh()), is(1100.0, 7850.0));
        let mut filed = mesh();
        filed.regions[1].material =
            Some(RegionMaterial { name: "x".into(), young_pa: 1.0, poisson: 0.0, density_kg_m3: 7.0 });
        assert_eq!(chosen(&["core=liver"], &filed), is(1060.0, 7.0));
        for (choices, expected) in [
            (&["cheese"][..], "--material: there is no material \"cheese\"; "),
            (&["nut=steel"], "--material nut=steel: the mesh has no such region; it has core, hull"),
            (&["core=steel", "3=liver"], "--material 3=liver: there is a material for that already"),
            (&["core=steel"], "region 'hull' has no material in the mesh file: "),
        ] {
            let error = chosen(choices, &mesh()).expect_err("a mistake");
            assert!(error.starts_with(expected), "{error}");
        }
    }

    #[test]
    fn text_of_a_material_file_is_read() {
        let choose = |text: &str| MaterialChoice::Text(text.into(), "tables".into()).of(&mesh());
        let text = "[[material]]\nregion = \"core\"\nname = \"steel\"\n[[material]]\nregion = \"hull\"\nname = \"rubber\"\n";
        let (materials, damping) = choose(text).expect("two materials");
        let densities: Vec<f64> = materials.iter().map(|one| one.density_kg_m3).collect();
        assert_eq!((densities, damping), (vec![7850.0, 1100.0], None));
        let error = choose("[[material]]\nname = \"cheese\"\n").expect_err("a mistake");
        assert_eq!(error.kind, SceneErrorKind::Record);
        assert!(error.message.starts_with("tables: "), "{error}");
    }

    #[test]
    fn damping_comes_with_a_material_of_the_whole_body() {
        let damping = |choices: &[&str]| {
            let choices: Vec<String> = choices.iter().map(ToString::to_string).collect();
            by_name(&choices, &mesh()).map(|(_, damping)| damping).map_err(|error| error.message)
        };
        assert_eq!(damping(&["paper"]), Ok(Some(Damping::Rayleigh { alpha: 2.0, beta: 2e-4 })));
        assert_eq!(damping(&["core=paper", "steel"]), Ok(None));
        assert_eq!(damping(&["steel"]), Ok(None));
    }
}
