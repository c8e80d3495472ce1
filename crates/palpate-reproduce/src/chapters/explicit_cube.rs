//! Independent finite elements of the cube: linear tetrahedra, explicit central differences, consistent or lumped mass.
//!
//! ```text
//! v⁺ = v + Δt·M⁻¹·(f − K·(u + β·v)),    u⁺ = u + Δt·v⁺
//! ```
//!
//! with u [m] the displacement of the free body, motion included; f [N] the load; β [s] the damping. The consistent mass of a tetrahedron is ρV/20·(1 + δ_ab) between its nodes
//! a and b, the lumped one ρV/4 at each. M⁻¹ is by conjugate gradients, which for the lumped mass end after one step.
//!
//! It shares nothing with `palpate-fem` but the mesh: assembly, mass, damping and time integration are its own.

use glam::{DMat3, DVec3};
use palpate_fem::paper_cube::{DENSITY_KG_M3, POISSON, YOUNG_PA};
use palpate_mesh::Mesh;
use std::collections::BTreeMap;

/// Distribution of the mass of an element over its nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MassMatrix {
    /// That of the shape functions; its inverse joins every node with every other.
    Consistent,
    /// A quarter of the element's mass at each node.
    Lumped,
}

/// Residual of a solution with the mass matrix, as a share of the load.
const SOLVED: f64 = 1e-9;

/// Rows of K [N/m] and M [kg] by nodes, and the diagonal of M.
pub struct ExplicitCube {
    rows: Vec<Vec<(usize, DMat3, f64)>>,
    diagonal: Vec<f64>,
}

impl ExplicitCube {
    /// Assembles the paper's material over a mesh.
    pub fn new(mesh: &Mesh, mass: MassMatrix) -> Self {
        let lambda = YOUNG_PA * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
        let mu = YOUNG_PA / (2.0 * (1.0 + POISSON));
        let mut rows: Vec<BTreeMap<usize, (DMat3, f64)>> = vec![BTreeMap::new(); mesh.nodes.len()];
        for tet in &mesh.tets {
            let nodes = tet.map(|node| node as usize);
            let [a, b, c, d] = nodes.map(|node| mesh.nodes[node]);
            let edges = DMat3::from_cols(b - a, c - a, d - a);
            let volume = edges.determinant().abs() / 6.0;
            // Rows of the inverse are the gradients of the last three shape functions.
            let inverse = edges.inverse().transpose();
            let others = [inverse.x_axis, inverse.y_axis, inverse.z_axis];
            let gradients = [-others.iter().sum::<DVec3>(), others[0], others[1], others[2]];
            for (i, gi) in gradients.into_iter().enumerate() {
                for (j, gj) in gradients.into_iter().enumerate() {
                    let outer = |a: DVec3, b: DVec3| DMat3::from_cols(a * b.x, a * b.y, a * b.z);
                    let stiffness =
                        outer(gi, gj) * lambda + outer(gj, gi) * mu + DMat3::IDENTITY * (mu * gi.dot(gj));
                    let share = match (mass, i == j) {
                        (MassMatrix::Consistent, same) => 0.05 * (1.0 + f64::from(u8::from(same))),
                        (MassMatrix::Lumped, same) => 0.25 * f64::from(u8::from(same)),
                    };
                    let entry = rows[nodes[i]].entry(nodes[j]).or_insert((DMat3::ZERO, 0.0));
                    entry.0 += stiffness * volume;
                    entry.1 += DENSITY_KG_M3 * volume * share;
                }
            }
        }
        let diagonal =
            rows.iter().enumerate().map(|(node, row)| row.get(&node).map_or(0.0, |(_, m)| *m)).collect();
        let rows = rows.into_iter().map(|row| row.into_iter().map(|(node, (k, m))| (node, k, m)).collect());
        Self { rows: rows.collect(), diagonal }
    }

    /// Displacements [m] of some nodes after each of `steps` steps of `step_s` [s], for a force [N] on one node that acts for `held_s`.
    pub fn response(
        &self,
        (node, force, held_s): (usize, DVec3, f64),
        beta_s: f64,
        (step_s, steps): (f64, usize),
        observed: &[u32],
    ) -> Vec<Vec<DVec3>> {
        let n = self.rows.len();
        let (mut u, mut v, mut acceleration) =
            (vec![DVec3::ZERO; n], vec![DVec3::ZERO; n], vec![DVec3::ZERO; n]);
        let mut frames = Vec::with_capacity(steps);
        for number in 0..steps {
            let lagged: Vec<DVec3> = u.iter().zip(&v).map(|(u, v)| *u + *v * beta_s).collect();
            let mut load: Vec<DVec3> = self
                .rows
                .iter()
                .map(|row| -row.iter().map(|&(node, k, _)| k * lagged[node]).sum::<DVec3>())
                .collect();
            if (number as f64 + 0.5) * step_s < held_s {
                load[node] += force;
            }
            self.divide_by_mass(&load, &mut acceleration);
            for ((u, v), a) in u.iter_mut().zip(&mut v).zip(&acceleration) {
                *v += *a * step_s;
                *u += *v * step_s;
            }
            frames.push(observed.iter().map(|&node| u[node as usize]).collect());
        }
        frames
    }

    /// Solves M·x = load, from the x that is there.
    fn divide_by_mass(&self, load: &[DVec3], x: &mut [DVec3]) {
        let mass_times = |x: &[DVec3]| -> Vec<DVec3> {
            self.rows.iter().map(|row| row.iter().map(|&(node, _, m)| x[node] * m).sum()).collect()
        };
        let dot = |a: &[DVec3], b: &[DVec3]| a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>();
        let scaled =
            |r: &[DVec3]| -> Vec<DVec3> { r.iter().zip(&self.diagonal).map(|(r, m)| *r / *m).collect() };
        let mut residual: Vec<DVec3> = load.iter().zip(mass_times(x)).map(|(f, m)| *f - m).collect();
        let mut z = scaled(&residual);
        let mut direction = z.clone();
        let mut rz = dot(&residual, &z);
        let enough = SOLVED * SOLVED * dot(load, &scaled(load));
        while rz > enough {
            let product = mass_times(&direction);
            let way = rz / dot(&direction, &product);
            for at in 0..x.len() {
                x[at] += direction[at] * way;
                residual[at] -= product[at] * way;
            }
            z = scaled(&residual);
            let next = dot(&residual, &z);
            direction.iter_mut().zip(&z).for_each(|(d, z)| *d = *z + *d * (next / rz));
            rz = next;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palpate_fem::paper_cube;

    const HELD_S: f64 = 2e-3;
    const STEP_S: f64 = 4e-5;

    #[test]
    fn an_impulse_moves_the_whole_cube_by_its_momentum() {
        let mesh = paper_cube::mesh(4).expect("a cube");
        let nodes: Vec<u32> = (0..mesh.nodes.len() as u32).collect();
        let hit = mesh.nodes.iter().position(|p| p.distance(DVec3::Y * 0.05) < 1e-9).expect("its middle");
        for mass in [MassMatrix::Consistent, MassMatrix::Lumped] {
            let cube = ExplicitCube::new(&mesh, mass);
            let weights: Vec<f64> = cube.rows.iter().map(|row| row.iter().map(|(.., m)| m).sum()).collect();
            let total: f64 = weights.iter().sum();
            assert!((total - 0.11).abs() < 1e-12, "{total}");
            let frames = cube.response((hit, DVec3::NEG_Y, HELD_S), 0.0, (STEP_S, 200), &nodes);
            let centre =
                |frame: &[DVec3]| frame.iter().zip(&weights).map(|(u, m)| u.y * m).sum::<f64>() / total;
            let speed = (centre(&frames[199]) - centre(&frames[99])) / (100.0 * STEP_S);
            // Momentum F·t; the mass matrix is solved with to 1e-9 in each step.
            assert!((speed * total + HELD_S).abs() < 1e-7 * HELD_S, "{mass:?}: {speed}");
        }
    }
}
