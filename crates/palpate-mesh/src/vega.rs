//! Vega files (`.veg`): vertices, elements, sets, materials and regions, in the file or in others that it includes.
//!
//! ```text
//! *VERTICES      n 3 0 0, then number x y z
//! *ELEMENTS      TET or CUBIC, then m 4 0, then number nodes…
//! *MATERIAL a    ENU, density [kg/m³], E [Pa], ν
//! *SET s         numbers of elements
//! *REGION        s, a
//! *INCLUDE file  beside this one, in place
//! ```
//!
//! A region is a set with a material; the set `allElements` is there without being written.
//!
//! Reference: Sin, Schroeder, Barbič, Vega: Non-Linear FEM Deformable Object Simulator (2013), and its user's manual, section "Mesh format".

use crate::elements::{Elements, Shape};
use crate::error::MeshError;
use crate::files::{Files, Includes};
use crate::numbering::Numbering;
use crate::rows::{Rows, Words};
use crate::scan::quoted;
use crate::sets::{Deck, MOST_REGIONS, Sets};
use crate::volume_mesh::{RegionMaterial, VolumeFile};
use glam::DVec3;
use std::collections::HashMap;
use std::path::Path;

/// Name of the set of all elements.
const ALL: &str = "allElements";

/// Section of the file, and what is known of it.
enum Section {
    None,
    VertexHeader,
    Vertices,
    ElementType,
    ElementHeader(Shape),
    Elements(Shape),
    Material(String),
    Set(usize),
    Region,
}

struct Reader<'f> {
    includes: Includes<'f>,
    section: Section,
    positions: Vec<DVec3>,
    /// Stated numbers of vertices and elements.
    stated: [Option<u64>; 2],
    numbering: Numbering,
    elements: Elements,
    deck: Deck,
    sets: Sets,
    /// Materials by name; none of a kind that isn't linear and isotropic.
    materials: HashMap<String, Option<RegionMaterial>>,
    /// Sets and materials of the regions.
    regions: Vec<(String, String)>,
}

/// Reads the bytes of a Vega file at `path`, and the files that it includes.
pub(crate) fn parse(files: Files, bytes: &[u8], path: &Path) -> Result<VolumeFile, MeshError> {
    let mut reader = Reader {
        includes: Includes::new(files),
        section: Section::None,
        positions: Vec::new(),
        stated: [None; 2],
        numbering: Numbering::new(bytes.len() / 8),
        elements: Elements::default(),
        deck: Deck::new(bytes.len() / 8),
        sets: Sets::default(),
        materials: HashMap::new(),
        regions: Vec::new(),
    };
    reader.read(bytes, path)?;
    let end = Rows::new(bytes, path, "#").scan;
    let found = [reader.numbering.len(), reader.deck.numbering.len()];
    for ((stated, found), what) in reader.stated.into_iter().zip(found).zip(["vertices", "elements"]) {
        match stated {
            Some(stated) if stated == found as u64 => {}
            Some(stated) => {
                return Err(
                    end.error_at(bytes.len(), format!("{found} {what} follow, and {stated} are stated"))
                );
            }
            None => {
                let section = what.to_ascii_uppercase();
                return Err(end.error_at(bytes.len(), format!("the file has no *{section}")));
            }
        }
    }
    reader.assemble(|message| end.error_at(bytes.len(), message))
}

impl Reader<'_> {
    fn read(&mut self, bytes: &[u8], path: &Path) -> Result<(), MeshError> {
        let mut rows = Rows::new(bytes, path, "#");
        loop {
            let row = rows.next();
            if row.is_empty() {
                return Ok(());
            }
            match row.strip_prefix(b"*") {
                Some(keyword) => self.keyword(&rows, keyword, path)?,
                None => self.row(&rows, row)?,
            }
        }
    }

    fn keyword(&mut self, rows: &Rows, row: &[u8], path: &Path) -> Result<(), MeshError> {
        let mut words = Words(row);
        let keyword = words.next().unwrap_or_default().to_ascii_uppercase();
        let name = words.next().map(|word| String::from_utf8_lossy(word).into_owned()).unwrap_or_default();
        self.section = match keyword.as_slice() {
            b"INCLUDE" => return self.include(rows, &name, path),
            b"VERTICES" => Section::VertexHeader,
            b"ELEMENTS" => Section::ElementType,
            b"MATERIAL" => Section::Material(name),
            b"SET" => Section::Set(self.sets.named(&name)),
            b"REGION" => Section::Region,
            _ => Section::None,
        };
        Ok(())
    }

    fn include(&mut self, rows: &Rows, name: &str, path: &Path) -> Result<(), MeshError> {
        let (bytes, included) = self.includes.read(&rows.scan, path, name.as_bytes())?;
        self.read(&bytes, &included)
    }

    fn row<'a>(&mut self, rows: &Rows<'a>, row: &'a [u8]) -> Result<(), MeshError> {
        let mut words = Words(row);
        let next = match &self.section {
            Section::None => return Ok(()),
            Section::VertexHeader => {
                self.stated[0] = Some(rows.number(&mut words, "the number of vertices")?);
                Section::Vertices
            }
            Section::Vertices => return self.vertex(rows, &mut words),
            Section::ElementType => match words.next().unwrap_or_default().to_ascii_uppercase().as_slice() {
                b"TET" | b"TETS" => Section::ElementHeader(Shape::Tetrahedron),
                b"CUBIC" | b"HEX" => Section::ElementHeader(Shape::Hexahedron),
                other => {
                    let found = quoted(other);
                    return rows.scan.fail(format!("elements are of type {found}, expected TET or CUBIC"));
                }
            },
            Section::ElementHeader(shape) => {
                self.stated[1] = Some(rows.number(&mut words, "the number of elements")?);
                let size: usize = rows.number(&mut words, "the number of nodes of an element")?;
                if size != shape.corners() {
                    let (name, corners) = (shape.name(), shape.corners());
                    return rows.scan.fail(format!("{name} have {size} nodes, expected {corners}"));
                }
                Section::Elements(*shape)
            }
            &Section::Elements(shape) => return self.element(rows, &mut words, shape),
            Section::Material(name) => {
                let name = name.clone();
                return self.material(rows, &mut words, name);
            }
            &Section::Set(set) => {
                for word in words {
                    let number: u64 = rows.parse(word, "the number of an element")?;
                    self.sets.extend(set, number, number, 1).or_else(|what| rows.scan.fail(what))?;
                }
                return Ok(());
            }
            Section::Region => {
                let mut name = || words.next().map(|word| String::from_utf8_lossy(word).into_owned());
                let (Some(set), Some(material)) = (name(), name()) else {
                    return rows.scan.fail("a region needs a set and a material, as in 'allElements, soft'");
                };
                if self.regions.len() == MOST_REGIONS {
                    return rows.scan.fail(format!("more than {MOST_REGIONS} regions cannot be read"));
                }
                self.regions.push((set, material));
                Section::None
            }
        };
        self.section = next;
        Ok(())
    }

    fn vertex<'a>(&mut self, rows: &Rows<'a>, words: &mut Words<'a>) -> Result<(), MeshError> {
        let number = rows.number(words, "the number of a vertex")?;
        self.numbering.push(number, "vertex").or_else(|what| rows.scan.fail(what))?;
        let mut coordinate = || rows.number(words, "a coordinate");
        self.positions.push(DVec3::new(coordinate()?, coordinate()?, coordinate()?));
        Ok(())
    }

    fn element<'a>(&mut self, rows: &Rows<'a>, words: &mut Words<'a>, shape: Shape) -> Result<(), MeshError> {
        let number = rows.number(words, "the number of an element")?;
        let mut nodes = [0; 8];
        let nodes = &mut nodes[..shape.corners()];
        for node in nodes.iter_mut() {
            let number = rows.number(words, "a vertex of an element")?;
            let Some(found) = self.numbering.find(number) else {
                return rows.scan.fail(format!("an element has vertex {number}, which is not in the file"));
            };
            *node = found;
        }
        let element = self.deck.push(number, nodes).or_else(|what| rows.scan.fail(what))?;
        self.elements.add(shape, nodes, element);
        Ok(())
    }

    fn material<'a>(
        &mut self,
        rows: &Rows<'a>,
        words: &mut Words<'a>,
        name: String,
    ) -> Result<(), MeshError> {
        let kind = words.next().unwrap_or_default();
        let mut material = None;
        if kind.eq_ignore_ascii_case(b"ENU") {
            let density_kg_m3 = rows.number(words, "a density [kg/m³]")?;
            let young_pa = rows.number(words, "Young's modulus [Pa]")?;
            let poisson = rows.number(words, "Poisson's ratio")?;
            material = Some(RegionMaterial { name: name.clone(), young_pa, poisson, density_kg_m3 });
        }
        self.materials.insert(name, material);
        self.section = Section::None;
        Ok(())
    }

    /// The mesh; `fail` makes an error.
    fn assemble(mut self, fail: impl Fn(String) -> MeshError) -> Result<VolumeFile, MeshError> {
        let mut warnings = Vec::new();
        let mut named = Vec::new();
        for (set, material) in &self.regions {
            let Some(found) = self.materials.get(material) else {
                return Err(fail(format!(
                    "region '{set}' has material '{material}', which is not in the file"
                )));
            };
            if found.is_none() {
                warnings.push(format!(
                    "material '{material}' is not linear and isotropic (ENU): give one for its regions"
                ));
            }
            named.push((set.clone(), found.clone()));
        }
        let members = |name: &str| self.sets.find(name).and_then(|at| self.sets.list.get(at));
        // An element that several regions have is in the last, as in Vega.
        let mut tags = vec![0; self.deck.numbering.len()];
        for (tag, (set, _)) in (1..).zip(&self.regions) {
            match members(set) {
                Some(set) => {
                    let numbers = set.members.iter().filter_map(|&number| self.deck.numbering.find(number));
                    numbers.for_each(|element| tags[element as usize] = tag);
                }
                None if set == ALL => tags.fill(tag),
                None => return Err(fail(format!("region '{set}' is of a set that is not in the file"))),
            }
        }
        let deck = &self.deck;
        let groups =
            self.sets.groups("element", |number, group| deck.add_nodes(number, group), &mut warnings);
        let region = |at: i64| usize::try_from(at - 1).ok().and_then(|at| named.get(at));
        let mut file = std::mem::take(&mut self.elements).into_file(
            "Vega".into(),
            std::mem::take(&mut self.positions),
            groups,
            |element| tags.get(element as usize).copied().unwrap_or(0),
            |tag| region(tag).map(|(name, _)| name.clone()),
        );
        for entry in &mut file.mesh.regions {
            entry.material = region(entry.tag).and_then(|(_, material)| material.clone());
        }
        file.mesh.warnings.extend(warnings);
        Ok(file)
    }
}
