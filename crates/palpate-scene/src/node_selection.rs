//! Selection of nodes by text: fixed, touchable, observed.
//!
//! `all`, `surface`, `region:NAME`, `nodes:1,5-9` (numbers in the input mesh, from 0), a named group of the mesh, or a
//! condition such as `x<0.001` on coordinates in metres; parts joined by `&` must all hold. Mid-edge nodes are nodes of the mesh as any
//! other ([`Mesh::add_mid_edge_nodes`]).

use crate::error::{SceneError, SceneErrorKind};
use palpate_fem::RecordedBody;
use palpate_mesh::{Mesh, Region};

/// Nodes of a mesh, selected by a text.
#[derive(Debug, Clone, PartialEq)]
pub struct NodeSelection {
    /// Numbers in the mesh, ascending.
    pub mesh_nodes: Vec<u32>,
}

/// Nodes that a text selects; `option` names it in errors.
///
/// # Errors
/// When the text is not understood, or selects no node.
pub fn select_nodes(mesh: &Mesh, option: &str, text: &str) -> Result<NodeSelection, SceneError> {
    let mut chosen = vec![true; mesh.nodes.len()];
    let parts: Vec<&str> = text.split('&').map(str::trim).collect();
    for part in &parts {
        let Some(holds) = part_of(mesh, part)? else {
            return Err(refused(format!(
                "{option} {part:?} is neither a group of the mesh nor a condition such as 'x<0.001' or 'y>=0.1 & z<0', \
                 nor all, surface, region:NAME or nodes:1,5-9; {}",
                known_groups(mesh)
            )));
        };
        chosen.iter_mut().zip(holds).for_each(|(chosen, holds)| *chosen &= holds);
    }
    let mesh_nodes: Vec<u32> = (0..mesh.nodes.len() as u32).filter(|&node| chosen[node as usize]).collect();
    if mesh_nodes.is_empty() {
        return Err(refused(format!("{option} {text:?} selects no node; {}", extent(mesh))));
    }
    Ok(NodeSelection { mesh_nodes })
}

/// Nodes of a discretisation in the union of selections, ascending.
pub fn union_of_nodes(body: &RecordedBody, selections: &[NodeSelection]) -> Vec<u32> {
    let mut chosen = vec![false; body.nodes().len()];
    for selection in selections {
        let among = body.nodes_in_set(&selection.mesh_nodes);
        chosen.iter_mut().zip(among).for_each(|(chosen, among)| *chosen |= among);
    }
    (0..chosen.len() as u32).filter(|&node| chosen[node as usize]).collect()
}

fn refused(message: String) -> SceneError {
    SceneError::new(SceneErrorKind::Mesh, message)
}

/// Membership by node for one condition; `None` when it is not understood.
fn part_of(mesh: &Mesh, part: &str) -> Result<Option<Vec<bool>>, SceneError> {
    let mut holds = vec![false; mesh.nodes.len()];
    if let Some(group) = mesh.groups.iter().find(|group| group.name == part) {
        group.nodes.iter().for_each(|&node| holds[node as usize] = true);
    } else if part == "all" {
        holds.fill(true);
    } else if part == "surface" {
        mark(mesh, mesh.boundary().iter().map(|triangle| &triangle[..]), &mut holds);
    } else if let Some(name) = part.strip_prefix("region:") {
        let named = |at: u32| {
            let region = &mesh.regions[at as usize];
            region.label() == name || region.tag.to_string() == name
        };
        let tets = mesh.tets.iter().zip(&mesh.tet_regions).filter(|(_, region)| named(**region));
        mark(mesh, tets.map(|(tet, _)| &tet[..]), &mut holds);
        if !holds.contains(&true) {
            let regions: Vec<String> = mesh.regions.iter().map(Region::label).collect();
            return Err(refused(format!("the mesh has no region {name:?}; it has {}", regions.join(", "))));
        }
    } else if let Some(list) = part.strip_prefix("nodes:") {
        for range in list.split(',') {
            let (first, last) = range.split_once('-').unwrap_or((range, range));
            let (Ok(first), Ok(last)) = (first.trim().parse::<usize>(), last.trim().parse::<usize>()) else {
                return Ok(None);
            };
            if last >= holds.len() || first > last {
                return Err(refused(format!(
                    "nodes {range}: the mesh has the nodes 0 to {}",
                    holds.len().saturating_sub(1)
                )));
            }
            holds[first..=last].fill(true);
        }
    } else if let Some(condition) = Condition::parse(part) {
        holds.iter_mut().zip(&mesh.nodes).for_each(|(holds, p)| *holds = condition.holds(p.to_array()));
    } else {
        return Ok(None);
    }
    Ok(Some(holds))
}

/// Marks the corners of triangles or tetrahedra, and the nodes on their edges.
fn mark<'a>(mesh: &Mesh, simplices: impl Iterator<Item = &'a [u32]>, holds: &mut [bool]) {
    for corners in simplices {
        for (at, &a) in corners.iter().enumerate() {
            holds[a as usize] = true;
            let middles = corners[..at].iter().filter_map(|&b| mesh.mid_edge_node(a, b));
            middles.for_each(|node| holds[node as usize] = true);
        }
    }
}

fn known_groups(mesh: &Mesh) -> String {
    let groups: Vec<&str> = mesh.groups.iter().map(|group| group.name.as_str()).collect();
    if groups.is_empty() {
        "the mesh names no groups".into()
    } else {
        format!("the mesh has the groups {}", groups.join(", "))
    }
}

fn extent(mesh: &Mesh) -> String {
    let axis = |i: usize| {
        let values = mesh.nodes.iter().map(|p| p.to_array()[i]);
        let (low, high) =
            (values.clone().fold(f64::INFINITY, f64::min), values.fold(f64::NEG_INFINITY, f64::max));
        format!("{low:.6} … {high:.6}")
    };
    format!("the mesh spans x {}, y {}, z {} m", axis(0), axis(1), axis(2))
}

struct Condition {
    axis: usize,
    below: bool,
    or_equal: bool,
    bound: f64,
}

impl Condition {
    fn parse(text: &str) -> Option<Self> {
        let at = text.find(['<', '>'])?;
        let axis = ["x", "y", "z"].iter().position(|axis| *axis == text[..at].trim())?;
        let rest = &text[at + 1..];
        let or_equal = rest.starts_with('=');
        let bound: f64 = rest.trim_start_matches('=').trim().parse().ok()?;
        Some(Self { axis, below: text[at..].starts_with('<'), or_equal, bound })
    }

    fn holds(&self, position: [f64; 3]) -> bool {
        let value = position[self.axis];
        (self.or_equal && value == self.bound)
            || if self.below { value < self.bound } else { value > self.bound }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate::{Damping, Material};
    use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, ResidualChoice, SilentProgress};
    use palpate_mesh::{NodeGroup, box_mesh};

    fn chosen(mesh: &Mesh, text: &str) -> usize {
        select_nodes(mesh, "--fix", text).map_or(0, |selection| selection.mesh_nodes.len())
    }

    fn refusal(mesh: &Mesh, text: &str) -> String {
        select_nodes(mesh, "--fix", text).err().map(|error| error.message).unwrap_or_default()
    }

    #[test]
    fn words_conditions_and_groups_select_nodes() {
        let mut mesh = box_mesh([1.0; 3], [2; 3]).expect("a good box");
        mesh.groups.push(NodeGroup { name: "foot".into(), nodes: vec![3, 4] });
        for (text, nodes) in [
            ("foot", 2),
            ("x<-0.4", 9),
            ("x<=-0.5 & y > 0.4", 3),
            ("all", 27),
            ("surface", 26),
            ("nodes:0,2-4", 4),
            ("surface & nodes:0-12", 13),
        ] {
            assert_eq!(chosen(&mesh, text), nodes, "{text}");
        }
        assert_eq!(
            refusal(&mesh, "x<-4"),
            "--fix \"x<-4\" selects no node; the mesh spans x -0.500000 … 0.500000, y -0.500000 … 0.500000, z -0.500000 … 0.500000 m"
        );
        assert!(refusal(&mesh, "hand").ends_with("; the mesh has the groups foot"));
        assert!(refusal(&mesh, "region:bone").contains("no region \"bone\""));
        assert!(refusal(&mesh, "nodes:5-27").contains("the mesh has the nodes 0 to 26"));
        assert!(refusal(&mesh, "nodes:a").contains("neither a group"));
    }

    #[test]
    fn mid_edge_nodes_are_selected_by_their_own_place() {
        let mut mesh = box_mesh([1.0; 3], [1; 3]).expect("a good box");
        mesh.add_mid_edge_nodes();
        assert_eq!(chosen(&mesh, "all"), 26);
        // Of the low face: four corners, four middles of sides and one of its diagonal.
        assert_eq!(chosen(&mesh, "x<-0.4"), 9);
        // Ends are on no corner, and corners of two edges are no reason for their middle.
        assert_eq!(chosen(&mesh, "x<-0.4 & y>-0.4 & y<0.4"), 3);
        assert_eq!(chosen(&mesh, "nodes:0-3"), 4);
        assert_eq!(chosen(&mesh, "region:0"), 26);
    }

    #[test]
    fn the_surface_of_quadratic_elements_has_no_node_inside() {
        let mut mesh = box_mesh([1.0; 3], [1; 3]).expect("a good box");
        mesh.add_mid_edge_nodes();
        let soft = Material::isotropic(1e4, 0.3, 1e3);
        let parameters = RecordParameters {
            residual: ResidualChoice::None,
            extent: RecordExtent::NoModes,
            ..RecordParameters::new(vec![soft], ElementOrder::Quadratic, 1, Damping::Ratio(0.0))
        };
        let body = RecordedBody::new(mesh.clone(), &parameters, &mut SilentProgress).expect("a body");
        let selection = select_nodes(&mesh, "--touchable", "surface").expect("a surface");
        assert_eq!(union_of_nodes(&body, &[selection]), body.surface_nodes());
    }
}
