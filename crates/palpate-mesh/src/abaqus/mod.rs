//! Abaqus input files (`.inp`), also of CalculiX: nodes, solid elements, sets, sections and linear materials.
//!
//! ```text
//! *NODE, NSET=n                number, x, y, z
//! *ELEMENT, TYPE=C3D4, ELSET=e  number, nodes…
//! *NSET, *ELSET, GENERATE      members, names of sets, or first, last, step
//! *SOLID SECTION, ELSET=e, MATERIAL=m
//! *MATERIAL, NAME=m; *ELASTIC  E, ν;  *DENSITY  ρ
//! *INCLUDE, INPUT=file         beside this one, in place
//! ```
//!
//! Regions are sections, or without any the sets on `*ELEMENT`. Sets of nodes and of elements are groups of nodes.
//! Numbers have the units that the file was made in: Abaqus states none.
//!
//! Reference: Abaqus Keywords Reference Guide; CalculiX CrunchiX User's Manual, section 7.

mod element_types;
mod keyword;
mod rows;

use self::keyword::Keyword;
use self::rows::{Section, Solid};
use crate::elements::Elements;
use crate::error::MeshError;
use crate::files::{Files, Includes};
use crate::numbering::Numbering;
use crate::rows::Rows;
use crate::sets::{Deck, MOST_REGIONS, Sets};
use crate::volume_mesh::{RegionMaterial, VolumeFile};
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

/// Material, as far as it has been read.
#[derive(Default)]
struct Material {
    name: String,
    young_and_poisson: Option<[f64; 2]>,
    density: Option<f64>,
}

struct Reader<'f> {
    includes: Includes<'f>,
    parts: usize,
    section: Section,
    positions: Vec<DVec3>,
    nodes: Numbering,
    elements: Elements,
    deck: Deck,
    /// Element whose nodes go on in the next row.
    open: Solid,
    node_sets: Sets,
    element_sets: Sets,
    /// Sets on `*ELEMENT`, in their order.
    element_regions: Vec<usize>,
    /// Sets and materials of solid sections.
    sections: Vec<(String, String)>,
    materials: Vec<Material>,
    warnings: Vec<String>,
}

/// Reads the bytes of an Abaqus file at `path`, and the files that it includes.
pub(crate) fn parse(files: Files, bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut reader = Reader {
        includes: Includes::new(files),
        parts: 0,
        section: Section::Skipped,
        positions: Vec::new(),
        nodes: Numbering::new(bytes.len() / 8),
        elements: Elements::default(),
        deck: Deck::new(bytes.len() / 8),
        open: Solid::default(),
        node_sets: Sets::default(),
        element_sets: Sets::default(),
        element_regions: Vec::new(),
        sections: Vec::new(),
        materials: Vec::new(),
        warnings: Vec::new(),
    };
    reader.read(bytes, path)?;
    if reader.positions.is_empty() {
        let scan = Rows::new(bytes, path, "**").scan;
        return Err(scan.error_at(bytes.len(), "the file has no *NODE"));
    }
    Ok(reader.assemble())
}

impl Reader<'_> {
    fn read(&mut self, bytes: &[u8], path: &Path) -> Result<(), MeshError> {
        let mut rows = Rows::new(bytes, path, "**");
        loop {
            let row = rows.next();
            match row.strip_prefix(b"*") {
                _ if row.is_empty() => return self.end_element(&rows),
                Some(_) => {
                    self.end_element(&rows)?;
                    let mut text = row.to_vec();
                    // A keyword goes on behind a comma at the end of its line.
                    while text.ends_with(b",") {
                        match rows.next() {
                            [] => break,
                            more => text.extend(more),
                        }
                    }
                    self.keyword(&rows, &Keyword::parse(&text), path)?;
                }
                None => self.row(&rows, row)?,
            }
        }
    }

    fn keyword(&mut self, rows: &Rows, keyword: &Keyword, path: &Path) -> Result<(), MeshError> {
        let set = |sets: &mut Sets, name: &str| keyword.value(name).map(|name| sets.named(name));
        self.section = match keyword.name.as_str() {
            "INCLUDE" => return self.include(rows, keyword, path),
            "PART" => {
                self.parts += 1;
                if self.parts > 1 && !self.positions.is_empty() {
                    return rows.scan.fail(
                        "the file has several parts, expected one: export each, or merge them into one",
                    );
                }
                Section::Skipped
            }
            "INSTANCE" => Section::Instance,
            "NODE" if keyword.value("SYSTEM").is_some_and(|system| !system.eq_ignore_ascii_case("R")) => {
                return rows.scan.fail("nodes are in a cylindrical or spherical system, expected SYSTEM=R: export them as x, y, z");
            }
            "SYSTEM" => {
                return rows
                    .scan
                    .fail("*SYSTEM turns or moves nodes, which cannot be read: export them as x, y, z");
            }
            "NODE" => Section::Nodes(set(&mut self.node_sets, "NSET")),
            "ELEMENT" => {
                let set = set(&mut self.element_sets, "ELSET");
                if self.element_regions.len() < MOST_REGIONS
                    && let Some(set) = set.filter(|set| !self.element_regions.contains(set))
                {
                    self.element_regions.push(set);
                }
                let kind = keyword.value("TYPE").unwrap_or_default();
                Section::Elements(element_types::solid(kind), set)
            }
            "NSET" => match set(&mut self.node_sets, "NSET") {
                Some(set) => Section::NodeSet(set, keyword.has("GENERATE")),
                None => return rows.scan.fail("*NSET needs a name, NSET=…"),
            },
            "ELSET" => match set(&mut self.element_sets, "ELSET") {
                Some(set) => Section::ElementSet(set, keyword.has("GENERATE")),
                None => return rows.scan.fail("*ELSET needs a name, ELSET=…"),
            },
            "SOLID SECTION" => {
                let value = |name: &str| keyword.value(name).unwrap_or_default().to_owned();
                if self.sections.len() == MOST_REGIONS {
                    return rows.scan.fail(format!("more than {MOST_REGIONS} sections cannot be read"));
                }
                self.sections.push((value("ELSET"), value("MATERIAL")));
                Section::Skipped
            }
            "MATERIAL" => {
                let name = keyword.value("NAME").unwrap_or_default().to_owned();
                self.materials.push(Material { name, ..Material::default() });
                Section::Skipped
            }
            // Of anisotropic materials nothing is read.
            "ELASTIC"
                if keyword.value("TYPE").is_none_or(|kind| kind.to_ascii_uppercase().starts_with("ISO")) =>
            {
                Section::Elastic
            }
            "DENSITY" => Section::Density,
            _ => Section::Skipped,
        };
        Ok(())
    }

    fn include(&mut self, rows: &Rows, keyword: &Keyword, path: &Path) -> Result<(), MeshError> {
        let (bytes, included) =
            self.includes.read(&rows.scan, path, keyword.value("INPUT").unwrap_or_default().as_bytes())?;
        self.read(&bytes, &included)
    }

    fn assemble(mut self) -> VolumeFile {
        let mut warnings = std::mem::take(&mut self.warnings);
        // Regions: the sets of sections, or of elements.
        let mut regions: Vec<(usize, Option<RegionMaterial>)> = Vec::new();
        for (set, material) in &self.sections {
            match self.element_sets.find(set) {
                Some(at) => regions.push((at, self.material(material, &mut warnings))),
                None => warnings.push(format!("section of set '{set}' is ignored: the file has no such set")),
            }
        }
        if regions.is_empty() {
            regions = self.element_regions.iter().map(|&set| (set, None)).collect();
        }
        let mut tags = vec![0; self.deck.numbering.len()];
        for (tag, (set, _)) in (1..).zip(&regions) {
            let members =
                self.element_sets.list.get(*set).map(|set| set.members.as_slice()).unwrap_or_default();
            let elements = members.iter().filter_map(|&number| self.deck.numbering.find(number));
            elements.for_each(|element| tags[element as usize] = tag);
        }
        let (deck, nodes) = (&self.deck, &self.nodes);
        let find = |number: u64, group: &mut Vec<u32>| {
            let node = nodes.find(number);
            group.extend(node);
            node.is_some()
        };
        let mut groups = self.node_sets.groups("node", find, &mut warnings);
        let of_elements =
            self.element_sets.groups("element", |number, group| deck.add_nodes(number, group), &mut warnings);
        let mut by_name: HashMap<String, usize> =
            groups.iter().enumerate().map(|(at, group)| (group.name.to_ascii_lowercase(), at)).collect();
        for group in of_elements {
            let at = *by_name.entry(group.name.to_ascii_lowercase()).or_insert(groups.len());
            let Some(other) = groups.get_mut(at) else {
                groups.push(group);
                continue;
            };
            warnings.push(format!(
                "a set of nodes and one of elements are both called '{}': their nodes are joined",
                group.name
            ));
            other.nodes.extend(group.nodes);
            other.nodes.sort_unstable();
            other.nodes.dedup();
        }
        let region = |tag: i64| usize::try_from(tag - 1).ok().and_then(|at| regions.get(at));
        let sets = &self.element_sets;
        let mut file = std::mem::take(&mut self.elements).into_file(
            "Abaqus".into(),
            std::mem::take(&mut self.positions),
            groups,
            |element| tags.get(element as usize).copied().unwrap_or(0),
            |tag| region(tag).and_then(|(set, _)| sets.list.get(*set)).map(|set| set.name.clone()),
        );
        for entry in &mut file.mesh.regions {
            entry.material = region(entry.tag).and_then(|(_, material)| material.clone());
        }
        file.mesh.warnings.extend(warnings);
        file
    }

    /// Linear isotropic material of a name, if it is whole.
    fn material(&self, name: &str, warnings: &mut Vec<String>) -> Option<RegionMaterial> {
        let known = self.materials.iter().find(|material| material.name.eq_ignore_ascii_case(name))?;
        match (known.young_and_poisson, known.density) {
            (Some([young_pa, poisson]), Some(density_kg_m3)) => {
                Some(RegionMaterial { name: name.to_owned(), young_pa, poisson, density_kg_m3 })
            }
            _ => {
                warnings.push(format!(
                    "material '{name}' has no isotropic *ELASTIC with *DENSITY: give one for its regions"
                ));
                None
            }
        }
    }
}
