//! The recorded surface and the nodes of the finite element model that carry it: the boundary with its own nodes, or a finer surface that is
//! embedded in the elements.
//!
//! A node v of an embedded surface moves with the nodes a of the element that it lies in, or of one that it is near to:
//!
//! ```text
//! w_va = N_a(λ') + (λ − λ')_a
//! ```
//!
//! λ are the barycentric coordinates of v, and λ' the same, or those of a point on the boundary where v is near to it or outside: from there the
//! displacements are continued linearly, by the corners of the element. The weights sum to 1, and translations, rotations and uniform strains of the
//! model are those of the surface. So a surface that follows the boundary is carried by the nodes of the boundary and the corners next to them, and
//! not by the other nodes of quadratic elements, which would make the residual compliance several times larger.
//!
//! Equations: docs/theory.md (C89).

use crate::discretisation::Discretisation;
use crate::element::ShapeFunction;
use crate::record_error::RecordError;
use glam::{DMat3, DVec3};
use palpate::{Embedding, Surface};
use palpate_mesh::SurfaceMesh;
use rayon::prelude::*;
use std::collections::HashMap;

/// Surface of a recording, with the nodes of the model that carry it.
pub(crate) struct Carriers {
    /// Surface in the frame of the mesh.
    pub(crate) surface: Surface,
    /// Nodes of the model that carry the surface, ascending: its own, or those that it is embedded in.
    pub(crate) nodes: Vec<u32>,
    /// Weights of these nodes for an embedded surface; mode shapes and sag are empty.
    pub(crate) embedding: Option<Embedding>,
    /// Mean edge of the model's boundary [m].
    pub(crate) mean_edge: f64,
}

/// Weight below which a node does not carry a surface node [1]: round-off of barycentric coordinates.
const ROUND_OFF: f64 = 1e-9;

/// Distance from an element, in barycentric coordinates, up to which its displacements are continued: its own size.
const REACH: f64 = 1.0;

/// Barycentric distance from a face of the boundary up to which a node is carried by it: on it there is no difference, and at a half of the element
/// the displacements differ by those of mid-edge nodes from the mean of their corners.
const NEAR: f64 = 0.1;

/// Iterations of Newton's method for the coordinates in a curved element; an affine one takes one.
const ITERATIONS: usize = 8;

impl Carriers {
    /// Carriers of an embedded surface, or of the boundary.
    ///
    /// # Errors
    /// [`RecordError::SurfaceOutside`] for a node that is farther from all elements than they are large.
    pub(crate) fn new(
        discretisation: &Discretisation,
        embedded: Option<&SurfaceMesh>,
    ) -> Result<Self, RecordError> {
        embedded.map_or_else(
            || Ok(Self::boundary(discretisation)),
            |surface| Self::embedded(discretisation, surface),
        )
    }

    fn boundary(discretisation: &Discretisation) -> Self {
        let nodes = discretisation.surface_nodes();
        let mut number = vec![0_u32; discretisation.nodes.len()];
        (0..).zip(&nodes).for_each(|(at, &node)| number[node as usize] = at);
        let surface = Surface {
            positions: nodes.iter().map(|&node| discretisation.nodes[node as usize]).collect(),
            triangles: discretisation.triangles.iter().map(|t| t.map(|node| number[node as usize])).collect(),
            source_nodes: nodes.iter().map(|&node| discretisation.source_nodes[node as usize]).collect(),
        };
        let mean_edge = surface.mean_edge();
        Self { surface, nodes, embedding: None, mean_edge }
    }

    fn embedded(discretisation: &Discretisation, surface: &SurfaceMesh) -> Result<Self, RecordError> {
        let tree = ElementTree::new(discretisation);
        let of_node = |(node, &position): (usize, &DVec3)| tree.weights(node, position);
        // The first error, on any number of threads.
        let weights: Vec<_> = surface.positions.par_iter().enumerate().map(of_node).collect();
        let weights: Vec<_> = weights.into_iter().collect::<Result<_, _>>()?;
        let mut nodes: Vec<u32> = weights.iter().flatten().map(|(node, _)| *node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let mut number = vec![0_u32; discretisation.nodes.len()];
        (0..).zip(&nodes).for_each(|(at, &node)| number[node as usize] = at);
        let mean_edge = Self::boundary(discretisation).mean_edge;
        let mut embedding =
            Embedding { model_nodes: nodes.len(), mean_edge, offsets: vec![0], ..Embedding::default() };
        for of_node in weights {
            embedding.nodes.extend(of_node.iter().map(|(node, _)| number[*node as usize]));
            embedding.weights.extend(of_node.iter().map(|(_, weight)| *weight as f32));
            embedding.offsets.push(embedding.nodes.len() as u32);
        }
        let positions = surface.positions.clone();
        let source_nodes = (0..positions.len() as u32).collect();
        let surface = Surface { positions, triangles: surface.triangles.clone(), source_nodes };
        Ok(Self { surface, nodes, embedding: Some(embedding), mean_edge })
    }

    /// Surface in the body frame, whose origin is the centre of mass [m, mesh].
    pub(crate) fn surface_about(&self, centre: DVec3) -> Surface {
        let mut surface = self.surface.clone();
        surface.positions.iter_mut().for_each(|position| *position -= centre);
        surface
    }

    /// Indices of the carriers of a surface node, with their weights.
    pub(crate) fn of(&self, surface_node: usize) -> Vec<(usize, f64)> {
        match &self.embedding {
            None => vec![(surface_node, 1.0)],
            Some(embedding) => embedding.of(surface_node).collect(),
        }
    }
}

/// Tree of bounding boxes over the elements of a model.
struct ElementTree<'a> {
    discretisation: &'a Discretisation,
    /// Whether the face opposite to each corner of an element is on the boundary.
    on_boundary: Vec<[bool; 4]>,
    /// Elements, leaf after leaf.
    order: Vec<u32>,
    boxes: Vec<Part>,
}

/// Part of the tree: a leaf, or one whose first half follows it.
struct Part {
    low: DVec3,
    high: DVec3,
    /// Elements in the order of the tree.
    range: std::ops::Range<usize>,
    /// Index of the second half; none of a leaf.
    second: Option<usize>,
}

impl Part {
    /// Distance of a point from the box [m]; 0 inside.
    fn distance(&self, point: DVec3) -> f64 {
        (point - point.clamp(self.low, self.high)).length()
    }
}

/// Elements in a leaf.
const LEAF: usize = 4;

/// Coordinates of a point in an element.
#[derive(Clone, Copy)]
struct Coordinates {
    element: u32,
    /// λ' and λ.
    within: [f64; 4],
    point: [f64; 4],
    /// Distance of the point from the element [m].
    distance: f64,
}

impl Coordinates {
    /// Distance in barycentric coordinates: how far displacements are continued.
    fn reach(&self) -> f64 {
        self.within.iter().zip(self.point).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    /// Measure of how well an element suits a point [m]: its distance, longer for an element that is flat in this direction.
    fn measure(&self) -> f64 {
        self.distance * (1.0 + self.reach())
    }
}

impl<'a> ElementTree<'a> {
    fn new(discretisation: &'a Discretisation) -> Self {
        let mut order: Vec<u32> = (0..discretisation.regions.len() as u32).collect();
        let extents: Vec<[DVec3; 2]> = discretisation
            .element_nodes()
            .map(|nodes| {
                let at = |node: &u32| discretisation.nodes[*node as usize];
                let all = || nodes.iter().map(at);
                [all().fold(DVec3::INFINITY, DVec3::min), all().fold(DVec3::NEG_INFINITY, DVec3::max)]
            })
            .collect();
        let mut boxes = Vec::new();
        divide(&mut order, 0, &extents, &mut boxes);
        Self { discretisation, on_boundary: boundary_faces(discretisation), order, boxes }
    }

    /// Nodes of the model that a surface node moves with, and their weights.
    fn weights(&self, surface_node: usize, position: DVec3) -> Result<Vec<(u32, f64)>, RecordError> {
        let mut best: Option<Coordinates> = None;
        self.search(0, position, &mut best);
        let outside = |distance: f64| RecordError::SurfaceOutside { node: surface_node, position, distance };
        let found = best.ok_or_else(|| outside(f64::INFINITY))?;
        if found.distance.is_infinite() || found.reach() > REACH {
            return Err(outside(found.distance));
        }
        let faces = self.on_boundary[found.element as usize];
        let nearest = (0..4).filter(|&k| faces[k] && found.within[k] <= NEAR);
        let face = nearest.min_by(|&a, &b| found.within[a].total_cmp(&found.within[b]));
        let mut from = found.within;
        if let Some(face) = face {
            from[face] = 0.0;
            let sum: f64 = from.iter().sum();
            from = from.map(|x| x / sum);
        }
        let shapes = self.discretisation.order.shapes(from).into_iter();
        let weights = shapes
            .enumerate()
            .map(|(at, (value, _))| value + if at < 4 { found.point[at] - from[at] } else { 0.0 });
        let nodes = self.nodes_of(found.element).iter().copied();
        Ok(nodes.zip(weights).filter(|(_, weight)| weight.abs() > ROUND_OFF).collect())
    }

    fn nodes_of(&self, element: u32) -> &'a [u32] {
        let count = self.discretisation.order.nodes();
        &self.discretisation.elements[element as usize * count..(element as usize + 1) * count]
    }

    fn search(&self, part: usize, point: DVec3, best: &mut Option<Coordinates>) {
        let Some(own) = self.boxes.get(part) else { return };
        let least = own.distance(point);
        if best.is_some_and(|best| best.measure() <= least) {
            return;
        }
        match own.second {
            None => {
                for &element in &self.order[own.range.clone()] {
                    let found = self.coordinates(element, point);
                    if best.is_none_or(|best| found.measure() < best.measure()) {
                        *best = Some(found);
                    }
                }
            }
            Some(second) => {
                let to = |part: usize| self.boxes[part].distance(point);
                let halves = if to(part + 1) <= to(second) { [part + 1, second] } else { [second, part + 1] };
                halves.into_iter().for_each(|half| self.search(half, point, best));
            }
        }
    }

    /// Coordinates of a point in an element, by Newton's method from its centroid.
    fn coordinates(&self, element: u32, point: DVec3) -> Coordinates {
        let order = self.discretisation.order;
        let nodes = self.nodes_of(element);
        let at = |of: &dyn Fn(&ShapeFunction) -> f64, within: [f64; 4]| -> DVec3 {
            let shapes = order.shapes(within);
            shapes
                .iter()
                .zip(nodes)
                .map(|(shape, node)| self.discretisation.nodes[*node as usize] * of(shape))
                .sum()
        };
        let (mut within, mut coordinates) = ([0.25; 4], [0.25; 4]);
        for _ in 0..ITERATIONS {
            let from = at(&|(value, _)| *value, within);
            let slope = |k: usize| at(&|(_, slopes)| slopes[k], within);
            let last = slope(3);
            let jacobian = DMat3::from_cols(slope(0) - last, slope(1) - last, slope(2) - last);
            let step = jacobian.inverse() * (point - from);
            let by = [step.x, step.y, step.z, -(step.x + step.y + step.z)];
            coordinates = std::array::from_fn(|k| within[k] + by[k]);
            let positive = coordinates.map(|x| x.max(0.0));
            let sum: f64 = positive.iter().sum();
            let next = positive.map(|x| x / sum);
            let change = next.iter().zip(within).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            within = next;
            if change < ROUND_OFF {
                break;
            }
        }
        let distance = (point - at(&|(value, _)| *value, within)).length();
        // NaN of a degenerate element is farther than any other.
        let distance = if distance.is_nan() { f64::INFINITY } else { distance };
        let is_within = coordinates.iter().all(|x| *x >= 0.0);
        Coordinates { element, within, point: coordinates, distance: if is_within { 0.0 } else { distance } }
    }
}

/// Whether the face opposite to each corner of an element is on the boundary: no other element has it.
fn boundary_faces(discretisation: &Discretisation) -> Vec<[bool; 4]> {
    let face = |nodes: &[u32], opposite: usize| {
        let mut corners = [nodes[(opposite + 1) % 4], nodes[(opposite + 2) % 4], nodes[(opposite + 3) % 4]];
        corners.sort_unstable();
        corners
    };
    let mut uses: HashMap<[u32; 3], u32> = HashMap::new();
    for nodes in discretisation.element_nodes() {
        (0..4).for_each(|k| *uses.entry(face(nodes, k)).or_default() += 1);
    }
    let of_element = |nodes: &[u32]| std::array::from_fn(|k| uses[&face(nodes, k)] == 1);
    discretisation.element_nodes().map(of_element).collect()
}

/// Divide elements at the median of the longest side of their box; gives the index of the part.
fn divide(order: &mut [u32], first: usize, extents: &[[DVec3; 2]], boxes: &mut Vec<Part>) -> usize {
    let own = boxes.len();
    let of = || order.iter().map(|&element| extents[element as usize]);
    let low = of().fold(DVec3::INFINITY, |low, [other, _]| low.min(other));
    let high = of().fold(DVec3::NEG_INFINITY, |high, [_, other]| high.max(other));
    boxes.push(Part { low, high, range: first..first + order.len(), second: None });
    if order.len() > LEAF {
        let size = (high - low).to_array();
        let axis = (0..3).max_by(|&a, &b| size[a].total_cmp(&size[b])).unwrap_or(0);
        let middle = |element: &u32| {
            let [low, high] = extents[*element as usize];
            low[axis] + high[axis]
        };
        let half = order.len() / 2;
        order.select_nth_unstable_by(half, |a, b| middle(a).total_cmp(&middle(b)).then(a.cmp(b)));
        let (a, b) = order.split_at_mut(half);
        divide(a, first, extents, boxes);
        boxes[own].second = Some(divide(b, first + half, extents, boxes));
    }
    own
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementOrder;
    use palpate_mesh::{Mesh, ball_mesh, box_mesh};

    fn cube() -> Mesh {
        box_mesh([0.1; 3], [3; 3]).expect("a good box")
    }

    fn weights(discretisation: &Discretisation, point: DVec3) -> Vec<(u32, f64)> {
        ElementTree::new(discretisation).weights(0, point).expect("a point near the mesh")
    }

    /// Points in the cube and up to a fifth of a cell outside of it.
    fn points() -> impl Iterator<Item = DVec3> {
        let at = |i: u32| -0.056 + 0.112 * f64::from(i) / 8.0;
        (0..729_u32).map(move |i| DVec3::new(at(i % 9), at(i / 9 % 9), at(i / 81)))
    }

    #[test]
    fn translations_rotations_and_uniform_strains_are_those_of_the_model() {
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let model = Discretisation::new(&cube(), order);
            for point in points() {
                let weights = weights(&model, point);
                let sum: f64 = weights.iter().map(|(_, weight)| weight).sum();
                let position: DVec3 =
                    weights.iter().map(|(node, weight)| model.nodes[*node as usize] * *weight).sum();
                assert!((sum - 1.0).abs() < 1e-12, "{point}: {sum}");
                assert!((position - point).length() < 1e-12, "{point}: {position}");
            }
        }
    }

    #[test]
    fn quadratic_fields_are_those_of_the_model_but_within_a_tenth_of_an_element_below_its_boundary() {
        let model = Discretisation::new(&cube(), ElementOrder::Quadratic);
        let field = |x: DVec3| x.x * x.x - 2.0 * x.y * x.z + 0.5 * x.z * x.z;
        let mut deep = 0;
        for point in points().map(|point| point * (0.05 / 0.056)) {
            let of_nodes = weights(&model, point).into_iter();
            let value: f64 = of_nodes.map(|(node, weight)| field(model.nodes[node as usize]) * weight).sum();
            let largest = point.abs().max_element();
            // On the boundary, and deeper than an element, the field is exact. Between them it may be that of the boundary continued by corners: a
            // tenth of an edge of √2/30 m deep, the bubble 4·λ·(1 − λ) over the chord is 0.36 of ⅛·2·(√2/30 m)².
            let bound = if largest < 0.015 || (largest - 0.05).abs() < 1e-12 { 1e-12 } else { 2.1e-4 };
            deep += usize::from(bound < 1e-10);
            assert!((value - field(point)).abs() < bound, "{point}: {value} {}", field(point));
        }
        assert!(deep > 20, "{deep}");
    }

    #[test]
    fn nodes_of_the_model_carry_themselves_in_curved_elements_too() {
        let mut mesh = ball_mesh(0.05, 2).expect("a ball");
        mesh.add_mid_edge_nodes();
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let model = Discretisation::new(&mesh, order);
            for (node, position) in (0..).zip(&model.nodes) {
                let weights = weights(&model, *position);
                let own = weights.iter().find(|(other, _)| *other == node).map_or(0.0, |(_, weight)| *weight);
                assert!((own - 1.0).abs() < 1e-6, "{order:?}, {node}: {weights:?}");
            }
        }
    }

    #[test]
    fn a_surface_far_from_the_elements_is_refused() {
        let model = Discretisation::new(&cube(), ElementOrder::Linear);
        let far = SurfaceMesh {
            positions: vec![DVec3::splat(0.04), DVec3::new(0.0, 0.0, 0.2), DVec3::X * 0.05],
            triangles: vec![[0, 1, 2], [0, 2, 1]],
        };
        match Carriers::new(&model, Some(&far)) {
            Err(RecordError::SurfaceOutside { node: 1, distance, .. }) => {
                assert!((distance - 0.15).abs() < 0.02, "{distance}");
            }
            other => panic!("{:?}", other.map(|carriers| carriers.nodes)),
        }
    }
}
