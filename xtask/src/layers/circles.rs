//! Import circles: strongly connected parts of a graph, and a shortest circle in each.

use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// Imported nodes of each node.
pub(super) type Graph = BTreeMap<String, BTreeSet<String>>;

/// A shortest circle of every strongly connected part with more than one node, and the nodes of the part.
pub(super) fn circles(graph: &Graph) -> Vec<(Vec<String>, BTreeSet<String>)> {
    let nodes: BTreeSet<&String> = graph.keys().chain(graph.values().flatten()).collect();
    let reached: BTreeMap<&String, BTreeSet<String>> =
        nodes.iter().map(|node| (*node, reachable(graph, node))).collect();
    let mut done = BTreeSet::new();
    let mut found = Vec::new();
    for node in nodes {
        if done.contains(node) || !reached[node].contains(node) {
            continue;
        }
        let part: BTreeSet<String> =
            reached[node].iter().filter(|other| reached[other].contains(node)).cloned().collect();
        done.extend(part.iter().cloned());
        let shortest = part.iter().filter_map(|from| shortest_circle(graph, from)).min_by_key(Vec::len);
        found.extend(shortest.map(|circle| (circle, part)));
    }
    found
}

/// Nodes that a node leads to, in one or more steps.
fn reachable(graph: &Graph, from: &str) -> BTreeSet<String> {
    let mut seen = BTreeSet::new();
    let mut next = vec![from.to_string()];
    while let Some(node) = next.pop() {
        for to in graph.get(&node).into_iter().flatten() {
            if seen.insert(to.clone()) {
                next.push(to.clone());
            }
        }
    }
    seen
}

/// Nodes of a shortest way from a node back to itself.
fn shortest_circle(graph: &Graph, from: &str) -> Option<Vec<String>> {
    let mut before: BTreeMap<&str, &str> = BTreeMap::new();
    let mut queue = VecDeque::from([from]);
    while let Some(node) = queue.pop_front() {
        for to in graph.get(node).into_iter().flatten() {
            if to == from {
                let mut circle = vec![node.to_string()];
                while let Some(previous) = circle.last().and_then(|last| before.get(last.as_str())) {
                    circle.push((*previous).to_string());
                }
                circle.reverse();
                return Some(circle);
            }
            if !before.contains_key(to.as_str()) {
                before.insert(to, node);
                queue.push_back(to);
            }
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    fn graph(edges: &[(&str, &str)]) -> Graph {
        let mut graph = Graph::new();
        for (from, to) in edges {
            graph.entry((*from).into()).or_default().insert((*to).into());
        }
        graph
    }

    #[test]
    fn a_graph_without_circles_has_none() {
        assert!(circles(&graph(&[("a", "b"), ("a", "c"), ("b", "c"), ("c", "d")])).is_empty());
    }

    #[test]
    fn each_part_gives_its_shortest_circle() {
        let edges =
            [("a", "b"), ("b", "c"), ("c", "a"), ("b", "a"), ("c", "d"), ("d", "e"), ("e", "f"), ("f", "d")];
        let found = circles(&graph(&edges));
        let names = |part: &BTreeSet<String>| part.iter().cloned().collect::<Vec<_>>().join("");
        let texts: Vec<_> = found.iter().map(|(circle, part)| (circle.join(""), names(part))).collect();
        assert_eq!(texts, [("ab".into(), "abc".into()), ("def".to_string(), "def".to_string())]);
    }
}
