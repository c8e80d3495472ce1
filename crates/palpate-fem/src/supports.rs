//! Supports: nodes that are fixed, nodes that are held along axes, and springs between the surface and the ground.
//!
//! Springs of a stiffness k per area [N/m³] add to the stiffness, along their axes,
//!
//! ```text
//! K_ij += k·∫ N_i·N_j dA        over the boundary faces of their nodes [N/m]
//! ```
//!
//! Reference: Zienkiewicz, Taylor & Zhu, *The Finite Element Method*, 2 (elastic foundation).

use crate::assembly::Assembly;
use crate::discretisation::Discretisation;
use crate::element::triangle_rule;
use crate::record_error::RecordError;
use glam::{DMat3, DVec3};

/// Supports besides fixed nodes. Nodes are those of the mesh; of mid-edge nodes that it lacks, those between two of them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Supports {
    /// Nodes that are held along some axes, as rollers do.
    pub held: Vec<HeldNodes>,
    /// Springs to the ground.
    pub springs: Vec<GroundSprings>,
}

/// Nodes that are held along some axes and slide along the others.
#[derive(Debug, Clone, PartialEq)]
pub struct HeldNodes {
    /// Nodes of the mesh.
    pub nodes: Vec<u32>,
    /// Whether x, y and z are held.
    pub axes: [bool; 3],
}

/// Springs between the ground and all boundary faces whose nodes are in a set.
#[derive(Debug, Clone, PartialEq)]
pub struct GroundSprings {
    /// Nodes of the mesh.
    pub nodes: Vec<u32>,
    /// Whether springs act along x, y and z.
    pub axes: [bool; 3],
    /// Stiffness per area [N/m³].
    pub stiffness_n_per_m3: f64,
}

/// Degrees of freedom that cannot move, and those that springs hold.
pub(crate) struct SupportedDofs {
    pub fixed: Vec<bool>,
    pub sprung: Vec<bool>,
}

/// Finds the supported degrees of freedom, and adds the springs to the stiffness.
pub(crate) fn apply(
    fixed_nodes: &[u32],
    supports: &Supports,
    discretisation: &Discretisation,
    assembly: &mut Assembly,
) -> Result<SupportedDofs, RecordError> {
    let dofs = discretisation.dofs();
    let mut supported = SupportedDofs { fixed: vec![false; dofs], sprung: vec![false; dofs] };
    let held = supports.held.iter().map(|held| (held.nodes.as_slice(), held.axes));
    let fixed = (!fixed_nodes.is_empty()).then_some((fixed_nodes, [true; 3]));
    for (nodes, axes) in fixed.into_iter().chain(held) {
        let selected = discretisation.in_set(nodes);
        if !selected.contains(&true) {
            return Err(RecordError::FixedNodesUnused);
        }
        for (node, _) in selected.iter().enumerate().filter(|(_, selected)| **selected) {
            (0..3).filter(|&axis| axes[axis]).for_each(|axis| supported.fixed[3 * node + axis] = true);
        }
    }
    if !supported.fixed.contains(&false) {
        return Err(RecordError::AllNodesFixed);
    }
    for springs in &supports.springs {
        add_springs(springs, discretisation, assembly, &mut supported.sprung)?;
    }
    Ok(supported)
}

fn add_springs(
    springs: &GroundSprings,
    discretisation: &Discretisation,
    assembly: &mut Assembly,
    sprung: &mut [bool],
) -> Result<(), RecordError> {
    let stiffness = springs.stiffness_n_per_m3;
    if !(stiffness.is_finite() && stiffness > 0.0) {
        return Err(RecordError::SpringStiffness { stiffness });
    }
    let selected = discretisation.in_set(&springs.nodes);
    let along = DVec3::from(springs.axes.map(|axis| if axis { stiffness } else { 0.0 }));
    let mut has_face = false;
    for face in discretisation.faces() {
        if !face.iter().all(|&node| selected[node as usize]) {
            continue;
        }
        has_face = true;
        let positions: Vec<DVec3> = face.iter().map(|&node| discretisation.nodes[node as usize]).collect();
        let products = shape_products(&positions);
        for (i, &node) in face.iter().enumerate() {
            for (j, &other) in face.iter().enumerate() {
                let block = DMat3::from_diagonal(along * products[i * face.len() + j]);
                assembly.add_stiffness(node, other, block);
            }
            (0..3)
                .filter(|&axis| springs.axes[axis])
                .for_each(|axis| sprung[3 * node as usize + axis] = true);
        }
    }
    if has_face { Ok(()) } else { Err(RecordError::SpringsWithoutFace) }
}

/// ∫ N_i·N_j dA [m²] over a face of three nodes, or of six: corners, and the nodes between them in their order.
fn shape_products(positions: &[DVec3]) -> Vec<f64> {
    let n = positions.len();
    let mut products = vec![0.0; n * n];
    for point in triangle_rule() {
        let [a, b, c] = point.at;
        // Values and derivatives by the three barycentric coordinates.
        let shapes: Vec<(f64, [f64; 3])> = if n == 3 {
            vec![(a, [1.0, 0.0, 0.0]), (b, [0.0, 1.0, 0.0]), (c, [0.0, 0.0, 1.0])]
        } else {
            vec![
                (a * (2.0 * a - 1.0), [4.0 * a - 1.0, 0.0, 0.0]),
                (b * (2.0 * b - 1.0), [0.0, 4.0 * b - 1.0, 0.0]),
                (c * (2.0 * c - 1.0), [0.0, 0.0, 4.0 * c - 1.0]),
                (4.0 * a * b, [4.0 * b, 4.0 * a, 0.0]),
                (4.0 * b * c, [0.0, 4.0 * c, 4.0 * b]),
                (4.0 * c * a, [4.0 * c, 0.0, 4.0 * a]),
            ]
        };
        let along =
            |k: usize| shapes.iter().zip(positions).map(|((_, by), x)| *x * (by[k] - by[0])).sum::<DVec3>();
        let area = point.weight * along(1).cross(along(2)).length();
        for i in 0..n {
            for j in 0..n {
                products[i * n + j] += area * shapes[i].0 * shapes[j].0;
            }
        }
    }
    products
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::ElementOrder;
    use crate::system::System;
    use faer::Mat;
    use palpate::Material;
    use palpate_mesh::{Mesh, box_mesh};

    const SIZE: [f64; 3] = [0.4, 0.1, 0.2];
    const YOUNG: f64 = 2e4;
    const POISSON: f64 = 0.3;

    fn on_low_side(mesh: &Mesh, axis: usize) -> Vec<u32> {
        let is_low = |p: &DVec3| p[axis] < -0.499 * SIZE[axis];
        (0_u32..).zip(&mesh.nodes).filter(|(_, p)| is_low(p)).map(|(node, _)| node).collect()
    }

    /// Largest deviation [m] of a bar on three sides that slide, or on springs at its low end, from uniform tension by 1 Pa.
    fn deviation(order: ElementOrder, spring: Option<f64>) -> f64 {
        let mesh = box_mesh(SIZE, [4, 2, 2]).expect("a good box");
        let roller = |axis: usize| {
            let mut axes = [false; 3];
            axes[axis] = true;
            HeldNodes { nodes: on_low_side(&mesh, axis), axes }
        };
        let (mut held, mut springs) = (vec![roller(1), roller(2)], Vec::new());
        match spring {
            None => held.push(roller(0)),
            Some(stiffness_n_per_m3) => {
                let HeldNodes { nodes, axes } = roller(0);
                springs.push(GroundSprings { nodes, axes, stiffness_n_per_m3 });
            }
        }
        let supports = Supports { held, springs };
        let discretisation = Discretisation::new(&mesh, order);
        let material = Material::isotropic(YOUNG, POISSON, 1e3);
        let mut assembly = Assembly::new(&discretisation, &[material]);
        let supported = apply(&[], &supports, &discretisation, &mut assembly).expect("good supports");
        let mut loads = Mat::zeros(discretisation.dofs(), 1);
        for face in discretisation.faces() {
            let positions: Vec<DVec3> =
                face.iter().map(|&node| discretisation.nodes[node as usize]).collect();
            if positions.iter().all(|p| p.x > 0.499 * SIZE[0]) {
                let area = (positions[1] - positions[0]).cross(positions[2] - positions[0]).length() / 2.0;
                // Consistent loads: a third of the area at corners of linear faces, or at mid-edge nodes of quadratic ones.
                let loaded = if face.len() == 3 { &face[..] } else { &face[3..] };
                loaded.iter().for_each(|&node| loads[(3 * node as usize, 0)] += area / 3.0);
            }
        }
        let system = System::new(discretisation, assembly, supported).expect("a supported body");
        let found = system.elastic_compliance(loads);
        let nodes = &system.discretisation.nodes;
        let exact = |p: DVec3| {
            let low = p + DVec3::from(SIZE) * 0.5;
            let sag = spring.map_or(0.0, |stiffness| 1.0 / stiffness);
            DVec3::new(sag + low.x / YOUNG, -POISSON * low.y / YOUNG, -POISSON * low.z / YOUNG)
        };
        let off = |(node, p): (usize, &DVec3)| {
            (DVec3::new(found[(3 * node, 0)], found[(3 * node + 1, 0)], found[(3 * node + 2, 0)]) - exact(*p))
                .length()
        };
        nodes.iter().enumerate().map(off).fold(0.0, f64::max)
    }

    #[test]
    fn a_bar_that_slides_on_three_sides_strains_uniformly() {
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            let off = deviation(order, None);
            assert!(off < 1e-11 * SIZE[0] / YOUNG, "{order:?}: {off:e}");
        }
    }

    #[test]
    fn springs_under_a_uniform_stress_give_by_stress_over_stiffness() {
        for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
            for stiffness in [1e3, 1e6] {
                let off = deviation(order, Some(stiffness));
                assert!(off < 1e-11 * (SIZE[0] / YOUNG + 1.0 / stiffness), "{order:?}: {off:e}");
            }
        }
    }

    #[test]
    fn products_of_shape_functions_sum_to_the_area() {
        let flat = [DVec3::ZERO, DVec3::X, DVec3::Y * 2.0];
        let products = shape_products(&flat);
        // A/12·(1 + δ).
        assert!((products[0] - 1.0 / 6.0).abs() < 1e-15 && (products[1] - 1.0 / 12.0).abs() < 1e-15);
        let six: Vec<DVec3> =
            [flat[0], flat[1], flat[2], flat[1] / 2.0, (flat[1] + flat[2]) / 2.0, flat[2] / 2.0].into();
        let products = shape_products(&six);
        assert!((products.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        // A/30 and −A/180 at corners (Zienkiewicz, Taylor & Zhu).
        assert!((products[0] - 1.0 / 30.0).abs() < 1e-15 && (products[1] + 1.0 / 180.0).abs() < 1e-15);
    }
}
