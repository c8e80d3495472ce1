//! Boundaries that touch themselves: made two-manifold, as a surface must be on which one goes around.
//!
//! Where tetrahedra meet at an edge without sharing a face, those of the smaller fan are removed; where they meet at a node, the node
//! becomes two.

use super::smoothing::Stars;
use crate::faces::{EDGES, Sets, sorted_faces};
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};

/// Share of the way to the centroid of its tetrahedra that a doubled node goes, so that no two lie on one point.
const APART: f64 = 0.1;

/// Removes tetrahedra at edges where the boundary touches itself; returns their number.
pub(super) fn open_touching_edges(tets: &mut Vec<[u32; 4]>) -> usize {
    let before = tets.len();
    loop {
        // Boundary faces of each edge: two in a manifold.
        let mut uses: BTreeMap<[u32; 2], u32> = BTreeMap::new();
        let faces = sorted_faces(tets);
        for same in faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1) {
            let [a, b, c] = same[0].0;
            [[a, b], [b, c], [a, c]].into_iter().for_each(|edge| *uses.entry(edge).or_default() += 1);
        }
        uses.retain(|_, faces| *faces > 2);
        if uses.is_empty() {
            return before - tets.len();
        }
        let mut around: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
        for (number, tet) in (0..).zip(tets.iter()) {
            for [a, b] in EDGES.map(|[i, j]| [tet[i].min(tet[j]), tet[i].max(tet[j])]) {
                if uses.contains_key(&[a, b]) {
                    around.entry([a, b]).or_default().push(number);
                }
            }
        }
        let mut removed = BTreeSet::new();
        for (edge, own) in &around {
            let fans = fans(tets, own, edge);
            removed.extend(fans.into_iter().min_by_key(Vec::len).unwrap_or_default());
        }
        let mut number = 0..;
        tets.retain(|_| number.next().is_some_and(|number| !removed.contains(&number)));
    }
}

/// Tetrahedra that share faces with these nodes, in groups, in the order of their first.
fn fans(tets: &[[u32; 4]], own: &[u32], shared: &[u32]) -> Vec<Vec<u32>> {
    let mut sets = Sets::new(own.len());
    for i in 0..own.len() {
        for j in 0..i {
            let other = tets[own[j] as usize];
            let common = tets[own[i] as usize].into_iter().filter(|node| other.contains(node)).count();
            if common == 3 {
                sets.join(i as u32, j as u32);
            }
        }
    }
    debug_assert!(own.iter().all(|&tet| shared.iter().all(|node| tets[tet as usize].contains(node))));
    let mut fans: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    (0..).zip(own).for_each(|(at, &tet)| fans.entry(sets.root(at)).or_default().push(tet));
    fans.into_values().collect()
}

/// Doubles nodes where the boundary touches itself; returns their number.
pub(super) fn split_touching_nodes(nodes: &mut Vec<DVec3>, tets: &mut [[u32; 4]]) -> usize {
    let mut on_boundary = BTreeSet::new();
    let faces = sorted_faces(tets);
    for same in faces.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1) {
        on_boundary.extend(same[0].0);
    }
    let mut stars = Stars::new(std::mem::take(nodes), tets.to_vec());
    let mut split: BTreeMap<u32, Vec<Vec<u32>>> = BTreeMap::new();
    for node in on_boundary {
        let fans = fans(tets, stars.of(node), &[node]);
        if fans.len() > 1 {
            split.insert(node, fans);
        }
    }
    let mut copies = Vec::new();
    for (node, fans) in &split {
        for (at, fan) in fans.iter().enumerate() {
            let copy = if at == 0 { *node } else { (stars.nodes.len()) as u32 };
            if at > 0 {
                stars.nodes.push(stars.nodes[*node as usize]);
            }
            for &tet in fan {
                tets[tet as usize].iter_mut().filter(|own| *own == node).for_each(|own| *own = copy);
            }
            copies.push(copy);
        }
    }
    let count = copies.len() - split.len();
    stars = Stars::new(stars.nodes, tets.to_vec());
    for copy in copies {
        let own = stars.of(copy).iter().flat_map(|&tet| stars.tets[tet as usize]);
        let (sum, corners) = own
            .fold((DVec3::ZERO, 0.0), |(sum, count), node| (sum + stars.nodes[node as usize], count + 1.0));
        let here = stars.nodes[copy as usize];
        let worst = stars.worst(copy);
        let mut share = APART;
        // Quality may fall to half, since smoothing comes after.
        while stars.worst_at(copy, here.lerp(sum / corners, share)) < 0.5 * worst && share > 1e-3 {
            share *= 0.5;
        }
        stars.nodes[copy as usize] = here.lerp(sum / corners, share);
    }
    *nodes = stars.nodes;
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tetrahedra_that_meet_at_a_node_or_an_edge_are_separated() {
        let mut nodes = vec![DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, -DVec3::X, -DVec3::Y, -DVec3::Z];
        let mut tets = vec![[0, 1, 2, 3], [0, 4, 6, 5]];
        assert_eq!(open_touching_edges(&mut tets), 0);
        assert_eq!(split_touching_nodes(&mut nodes, &mut tets), 1);
        assert_eq!(tets, [[0, 1, 2, 3], [7, 4, 6, 5]]);
        assert!((nodes[0] - nodes[7]).length() > 0.08);

        let mut at_an_edge = vec![[0, 1, 2, 3], [0, 1, 5, 6]];
        assert_eq!(open_touching_edges(&mut at_an_edge), 1);
        assert_eq!(at_an_edge.len(), 1);
    }
}
