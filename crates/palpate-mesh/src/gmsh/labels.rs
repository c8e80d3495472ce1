//! The sections `$PhysicalNames` and `$Entities`, and the regions and groups that follow from
//! them.

use std::collections::{BTreeMap, HashMap};

use super::sections::{Version, end_of_section};
use crate::error::MeshError;
use crate::scan::Number::{F64, I32, U64};
use crate::scan::{Scanner, quoted};
use crate::volume_mesh::NodeGroup;

/// The nodes of elements, with repeats, by dimension and entity (2.2: physical tag).
pub(super) type Members = BTreeMap<(u8, i64), Vec<u32>>;

/// Physical groups: their names, and which entities they consist of.
#[derive(Default)]
pub(super) struct Labels {
    /// By dimension and physical tag.
    names: HashMap<(u8, i64), String>,
    /// Physical tags by dimension and entity tag (4).
    entities: HashMap<(u8, i64), Vec<i64>>,
}

impl Labels {
    /// A count, then a row `dimension tag "name"` per physical group; text in binary files too.
    pub fn read_names(&mut self, scan: &mut Scanner) -> Result<(), MeshError> {
        scan.skip_blank();
        let stated: u64 = scan.text_number("the number of physical names")?;
        let count = scan.count(stated, 6, "physical names")?;
        scan.end_of_line()?;
        for _ in 0..count {
            scan.skip_blank();
            let dimension = scan.text_number("the dimension of a physical name")?;
            let tag: i64 = scan.text_number("a physical tag")?;
            let text = scan.rest_of_line();
            let name = text.strip_prefix(b"\"").and_then(|n| n.strip_suffix(b"\""));
            let Some(name) = name else {
                let message = format!("expected a name in quotes, found {}", quoted(text));
                return scan.fail(message);
            };
            let name = String::from_utf8_lossy(name).into_owned();
            self.names.insert((dimension, tag.saturating_abs()), name);
        }
        end_of_section(scan, "PhysicalNames", &format!("after {count} names"))
    }

    /// Four counts, then per entity its tag, its box (a point in 4.1: its position), its physical tags
    /// and the entities that bound it.
    pub fn read_entities(&mut self, scan: &mut Scanner, version: Version) -> Result<(), MeshError> {
        scan.start_of_row();
        let mut counts = [0; 4];
        for count in &mut counts {
            *count = scan.unsigned(U64, "the number of entities")?;
        }
        scan.end_of_row()?;

        let number_bytes = if scan.is_text() { 2 } else { 4 };
        for (dimension, count) in (0_u8..).zip(counts) {
            let coordinates = if dimension == 0 && version == Version::V4 { 3 } else { 6 };
            for _ in 0..count {
                scan.start_of_row();
                let entity = scan.integer(I32, "an entity tag")?;
                for _ in 0..coordinates {
                    scan.real(F64, "a coordinate of an entity's box")?;
                }
                let stated = scan.unsigned(U64, "the number of physical tags")?;
                let mut tags = Vec::with_capacity(scan.count(stated, number_bytes, "tags")?);
                for _ in 0..stated {
                    let tag = scan.integer(I32, "a physical tag")?.saturating_abs();
                    if tag != 0 {
                        tags.push(tag);
                    }
                }
                if dimension > 0 {
                    for _ in 0..scan.unsigned(U64, "the number of bounding entities")? {
                        scan.integer(I32, "the tag of a bounding entity")?;
                    }
                }
                scan.end_of_row()?;
                self.entities.insert((dimension, entity), tags);
            }
        }
        end_of_section(scan, "Entities", "after the entities stated")
    }

    /// The physical tags of an entity. In a 2.2 file elements name a physical tag instead of an
    /// entity, or 0.
    pub fn physical_tags<'a>(&'a self, version: Version, entity: &'a (u8, i64)) -> &'a [i64] {
        match version {
            Version::V1 | Version::V2 if entity.1 == 0 => &[],
            Version::V1 | Version::V2 => std::slice::from_ref(&entity.1),
            Version::V40 | Version::V4 => self.entities.get(entity).map_or(&[], Vec::as_slice),
        }
    }

    /// Whether the file lists entities, but not this one.
    pub fn omits(&self, entity: &(u8, i64)) -> bool {
        !self.entities.is_empty() && !self.entities.contains_key(entity)
    }

    pub fn name(&self, dimension: u8, tag: i64) -> Option<String> {
        self.names.get(&(dimension, tag)).cloned()
    }

    /// The groups, by dimension and tag, and a warning for each two of one name.
    pub fn groups(
        &self,
        scan: &Scanner,
        version: Version,
        members: Members,
    ) -> Result<(Vec<NodeGroup>, Vec<String>), MeshError> {
        // Many tags on the same entities could list far more nodes than the file has bytes.
        let max_members = 4 * scan.file_size();
        let mut member_count = 0;
        let mut by_tag: BTreeMap<(u8, i64), Vec<u32>> = BTreeMap::new();
        for (entity, mut nodes) in members {
            nodes.sort_unstable();
            nodes.dedup();
            for &tag in self.physical_tags(version, &entity) {
                member_count += nodes.len();
                if member_count > max_members {
                    let message = "too many physical tags on the same entities";
                    return scan.fail(message);
                }
                by_tag.entry((entity.0, tag)).or_default().extend(&nodes);
            }
        }

        let mut groups: Vec<NodeGroup> = Vec::new();
        let mut indices: HashMap<String, usize> = HashMap::new();
        let mut warnings = Vec::new();
        for ((dimension, tag), nodes) in by_tag {
            let name = self.name(dimension, tag).unwrap_or_else(|| tag.to_string());
            let index = *indices.entry(name.clone()).or_insert(groups.len());
            match groups.get_mut(index) {
                Some(group) => {
                    warnings.push(format!(
                        "physical group {tag} of dimension {dimension} and another are both \
                         called '{name}': their nodes are joined"
                    ));
                    group.nodes.extend(nodes);
                }
                None => groups.push(NodeGroup { name, nodes }),
            }
        }
        for group in &mut groups {
            group.nodes.sort_unstable();
            group.nodes.dedup();
        }
        Ok((groups, warnings))
    }
}
