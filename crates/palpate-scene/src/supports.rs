//! Supports by text: `NODES`, `AXES: NODES` and `STIFFNESS [AXES]: NODES`.

use crate::error::{SceneError, SceneErrorKind};
use crate::node_selection::select_nodes;
use palpate_fem::{GroundSprings, HeldNodes, Supports};
use palpate_mesh::Mesh;

/// Fixed nodes, and other supports, by the texts of `--fix` and `--spring`.
///
/// # Errors
/// When a text is not understood, or selects no node.
pub fn read_supports(
    mesh: &Mesh,
    fix: &[String],
    spring: &[String],
) -> Result<(Vec<u32>, Supports), SceneError> {
    let (mut fixed, mut supports) = (Vec::new(), Supports::default());
    for text in fix {
        let is_group = mesh.groups.iter().any(|group| group.name == *text);
        match text.split_once(':').filter(|_| !is_group) {
            Some((prefix, nodes)) if let Some(axes) = axes(prefix) => {
                supports.held.push(HeldNodes { nodes: select_nodes(mesh, "--fix", nodes)?.mesh_nodes, axes });
            }
            _ => fixed.extend(select_nodes(mesh, "--fix", text)?.mesh_nodes),
        }
    }
    for text in spring {
        let parsed = text.split_once(':').and_then(|(prefix, nodes)| {
            let mut words = prefix.split_whitespace();
            let stiffness = words.next()?.parse().ok()?;
            let axes = words.next().map_or(Some([true; 3]), axes)?;
            words.next().is_none().then_some((stiffness, axes, nodes))
        });
        let Some((stiffness_n_per_m3, axes, nodes)) = parsed else {
            let message = format!(
                "--spring {text:?}: expected 'STIFFNESS: NODES' or 'STIFFNESS AXES: NODES', as in '1e6 z: z<-0.049', in N/m³"
            );
            return Err(SceneError::new(SceneErrorKind::Mesh, message));
        };
        let nodes = select_nodes(mesh, "--spring", nodes)?.mesh_nodes;
        supports.springs.push(GroundSprings { nodes, axes, stiffness_n_per_m3 });
    }
    Ok((fixed, supports))
}

/// Axes of a text such as `xz`; none if it has anything else, or an axis twice.
fn axes(text: &str) -> Option<[bool; 3]> {
    let text = text.trim();
    let mut axes = [false; 3];
    for letter in text.chars() {
        let axis = "xyz".find(letter)?;
        if std::mem::replace(&mut axes[axis], true) {
            return None;
        }
    }
    (!text.is_empty()).then_some(axes)
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_mesh::{NodeGroup, box_mesh};

    fn read(fix: &[&str], spring: &[&str]) -> Result<(Vec<u32>, Supports), String> {
        let mut mesh = box_mesh([1.0; 3], [1; 3]).expect("a good box");
        mesh.groups.push(NodeGroup { name: "x: a".into(), nodes: vec![7] });
        let owned = |texts: &[&str]| texts.iter().map(ToString::to_string).collect::<Vec<_>>();
        read_supports(&mesh, &owned(fix), &owned(spring)).map_err(|error| error.message)
    }

    #[test]
    fn fixed_held_and_sprung_nodes_are_told_apart() {
        let (fixed, supports) =
            read(&["x<0", "z: y<0", "xy: nodes:1-2", "region:0", "x: a"], &["1e6: z<0", " 2.5 zx : all"])
                .expect("good texts");
        assert_eq!((fixed.len(), &fixed[..4], fixed.last()), (13, &[0, 1, 2, 3][..], Some(&7)));
        let held: Vec<_> = supports.held.iter().map(|held| (held.nodes.len(), held.axes)).collect();
        assert_eq!(held, [(4, [false, false, true]), (2, [true, true, false])]);
        let springs: Vec<_> =
            supports.springs.iter().map(|one| (one.nodes.len(), one.axes, one.stiffness_n_per_m3)).collect();
        assert_eq!(springs, [(4, [true; 3], 1e6), (8, [true, false, true], 2.5)]);
    }

    #[test]
    fn other_texts_are_explained() {
        for text in ["z<0", "much: z<0", "1e6 w: z<0", "1e6 xx: z<0", "1e6 x y: z<0"] {
            let error = read(&[], &[text]).expect_err("no spring");
            assert!(error.starts_with(&format!("--spring {text:?}: expected 'STIFFNESS: NODES'")), "{error}");
        }
        assert!(read(&["z: y<-4"], &[]).expect_err("no node").contains("selects no node"));
        assert!(read(&["w: y<0"], &[]).expect_err("no axis").contains("neither a group"));
    }
}
