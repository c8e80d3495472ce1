//! Where a mesh comes from: a primitive's text or a file.

use crate::Failure;
use palpate_fem::mesh::{Mesh, NodeGroup, ball_mesh, box_mesh, gmsh, vtk};
use std::path::Path;

/// Read or make a mesh.
pub fn mesh(source: &str) -> Result<Mesh, Failure> {
    if let Some(text) = source.strip_prefix("box:") {
        let parsed = text.split_once('/').and_then(|(size, cells)| Some((triple(size)?, triple(cells)?)));
        let Some((size, cells)) = parsed else {
            return Err(Failure(format!(
                "{source:?} is no box; write box:LXxLYxLZ/NXxNYxNZ, as in box:0.1x0.1x0.1/12x12x12"
            )));
        };
        return Ok(box_mesh(size, cells)?);
    }
    if let Some(text) = source.strip_prefix("sphere:") {
        let parsed = text.split_once('/').and_then(|(r, n)| Some((r.parse().ok()?, n.parse().ok()?)));
        let Some((radius, layers)) = parsed else {
            return Err(Failure(format!(
                "{source:?} is no sphere; write sphere:RADIUS/N, as in sphere:0.05/8"
            )));
        };
        return Ok(ball_mesh(radius, layers)?);
    }
    let path = Path::new(source);
    let extension = path.extension().and_then(|e| e.to_str()).unwrap_or_default().to_ascii_lowercase();
    match extension.as_str() {
        "msh" => Ok(gmsh::read(path)?),
        "vtk" => Ok(vtk::read(path)?),
        _ => Err(Failure(format!(
            "{source:?} is no mesh that palpate reads: give a Gmsh file (.msh), a VTK legacy file (.vtk), \
             box:LXxLYxLZ/NXxNYxNZ or sphere:RADIUS/N"
        ))),
    }
}

/// What to call the source in a recording: no folders.
pub fn name(source: &str) -> String {
    let file = Path::new(source).file_name().and_then(|name| name.to_str());
    if source.starts_with("box:") || source.starts_with("sphere:") {
        source.to_string()
    } else {
        file.unwrap_or(source).to_string()
    }
}

fn triple<T: std::str::FromStr>(text: &str) -> Option<[T; 3]> {
    let parts: Result<Vec<T>, _> = text.split('x').map(str::parse).collect();
    parts.ok()?.try_into().ok()
}

/// Nodes of the mesh that `--fix` means: a named group, or a condition like `x<0.001 & z>=0`.
pub fn selected_nodes(mesh: &Mesh, selection: &str) -> Result<Vec<u32>, Failure> {
    if let Some(NodeGroup { nodes, .. }) = mesh.groups.iter().find(|group| group.name == selection) {
        return Ok(nodes.clone());
    }
    let conditions: Option<Vec<Condition>> = selection.split('&').map(Condition::parse).collect();
    let Some(conditions) = conditions else {
        let groups: Vec<&str> = mesh.groups.iter().map(|group| group.name.as_str()).collect();
        let known = if groups.is_empty() {
            "the mesh names no groups".into()
        } else {
            format!("the mesh has the groups {}", groups.join(", "))
        };
        return Err(Failure(format!(
            "--fix {selection:?} is neither a group of the mesh nor a condition such as 'x<0.001' or 'y>=0.1 & z<0'; {known}"
        )));
    };
    let holds = |node: &u32| {
        let position = mesh.nodes[*node as usize].to_array();
        conditions.iter().all(|condition| condition.holds(position))
    };
    let nodes: Vec<u32> = (0..mesh.nodes.len() as u32).filter(holds).collect();
    if nodes.is_empty() {
        let axis = |i: usize| {
            let values = mesh.nodes.iter().map(|p| p.to_array()[i]);
            format!(
                "{:.6} … {:.6}",
                values.clone().fold(f64::INFINITY, f64::min),
                values.fold(f64::NEG_INFINITY, f64::max)
            )
        };
        return Err(Failure(format!(
            "--fix {selection:?} selects no node; the mesh spans x {}, y {}, z {} m",
            axis(0),
            axis(1),
            axis(2)
        )));
    }
    Ok(nodes)
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

    fn text<T>(result: Result<T, Failure>) -> String {
        result.err().map(|failure| failure.0).unwrap_or_default()
    }

    #[test]
    fn primitives_are_read_and_misspelt_ones_are_explained() {
        assert_eq!(mesh("box:1x2x3/1x2x3").map(|m| m.tets.len()).ok(), Some(30));
        assert_eq!(mesh("sphere:0.05/2").map(|m| m.tets.len()).ok(), Some(160));
        assert!(
            text(mesh("box:1x2/1x2x3"))
                .starts_with("\"box:1x2/1x2x3\" is no box; write box:LXxLYxLZ/NXxNYxNZ")
        );
        assert!(text(mesh("sphere:x/2")).contains("write sphere:RADIUS/N"));
        assert!(text(mesh("cow.stl")).contains("no mesh that palpate reads"));
        assert!(text(mesh("no-such-file.msh")).starts_with("cannot read mesh no-such-file.msh"));
    }

    #[test]
    fn conditions_and_groups_select_nodes() {
        let mut mesh = mesh("box:1x1x1/2x2x2").expect("a good box");
        mesh.groups.push(NodeGroup { name: "foot".into(), nodes: vec![3, 4] });
        assert_eq!(selected_nodes(&mesh, "foot").ok(), Some(vec![3, 4]));
        assert_eq!(selected_nodes(&mesh, "x<-0.4").map(|n| n.len()).ok(), Some(9));
        assert_eq!(selected_nodes(&mesh, "x<=-0.5 & y > 0.4").map(|n| n.len()).ok(), Some(3));
        assert_eq!(
            text(selected_nodes(&mesh, "x<-4")),
            "--fix \"x<-4\" selects no node; the mesh spans x -0.500000 … 0.500000, y -0.500000 … 0.500000, z -0.500000 … 0.500000 m"
        );
        assert_eq!(
            text(selected_nodes(&mesh, "hand")),
            "--fix \"hand\" is neither a group of the mesh nor a condition such as 'x<0.001' or 'y>=0.1 & z<0'; the mesh has the groups foot"
        );
    }
}
