//! Bodies to record, and what the tests ask of a recording.

use faer::{Mat, Side};
use glam::DVec3;
use palpate::{Damping, Material, ResidualCompliance};
use palpate_fem::element::Order;
use palpate_fem::mesh::{Mesh, Region, box_mesh};
use palpate_fem::progress::{Progress, Silent};
use palpate_fem::record::{Extent, RecordParameters, Recorded, record};
use palpate_fem::residual::ResidualChoice;
use palpate_fem::system::System;

/// Solves with a factor of condition up to 1e6 keep ten of sixteen digits.
pub const SOLVED: f64 = 1e-10;

/// Sums and products of a few hundred terms keep all but three digits.
pub const SUMMED: f64 = 1e-12;

/// The most that rounding to f32 moves a number, as a share of it: half a unit in the 24th binary digit.
pub const F32_ROUNDING: f64 = 1.0 / 16_777_216.0;

pub fn material(young_pa: f64, poisson: f64, density_kg_m3: f64) -> Material {
    Material { region: String::new(), young_pa, poisson, density_kg_m3 }
}

pub fn parameters(order: Order, modes: usize) -> RecordParameters {
    RecordParameters {
        materials: vec![material(2e4, 0.3, 1000.0)],
        order,
        modes,
        damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        residual: ResidualChoice::Automatic,
        fixed_nodes: Vec::new(),
        source: "test".into(),
        extent: Extent::Whole,
    }
}

pub fn block(size: [f64; 3], cells: [u32; 3]) -> Mesh {
    box_mesh(size, cells).expect("a good box")
}

/// Nodes of a mesh where a condition holds.
pub fn nodes_where(mesh: &Mesh, holds: impl Fn(DVec3) -> bool) -> Vec<u32> {
    (0..mesh.nodes.len() as u32).filter(|&node| holds(mesh.nodes[node as usize])).collect()
}

pub fn recorded(mesh: Mesh, parameters: &RecordParameters) -> Recorded {
    record(mesh, parameters, &mut Silent).expect("a good recording")
}

pub fn refusal(mesh: Mesh, parameters: &RecordParameters) -> String {
    record(mesh, parameters, &mut Silent).err().expect("an error").to_string()
}

/// Keeps the remarks.
#[derive(Default)]
pub struct Listener(pub Vec<String>);

impl Progress for Listener {
    fn begin(&mut self, _stage: &str, _total: u64) {}
    fn advance(&mut self, _units: u64) {}
    fn remark(&mut self, text: &str) {
        self.0.push(text.into());
    }
}

/// A bar with a soft and a stiff half of other density, and what it is recorded with: 1149 degrees of freedom, so that
/// the modes come by block Krylov.
pub fn two_material_bar(modes: usize) -> (Mesh, RecordParameters) {
    let mut mesh = block([0.2, 0.05, 0.05], [8, 2, 2]);
    mesh.regions.push(Region { tag: 1, name: None });
    for (tet, region) in mesh.tets.iter().zip(&mut mesh.tet_regions) {
        *region = u32::from(tet.iter().map(|&n| mesh.nodes[n as usize].x).sum::<f64>() > 0.0);
    }
    let materials = vec![material(2e4, 0.45, 1000.0), material(3e5, 0.2, 2500.0)];
    (mesh, RecordParameters { materials, ..parameters(Order::Quadratic, modes) })
}

/// A bar that is held at its left end.
pub fn fixed_bar(order: Order, modes: usize) -> (Mesh, RecordParameters) {
    let mesh = block([0.2, 0.05, 0.05], [8, 2, 2]);
    let fixed_nodes = nodes_where(&mesh, |p| p.x < -0.0999);
    (mesh, RecordParameters { fixed_nodes, ..parameters(order, modes) })
}

/// A cube of 81 degrees of freedom.
pub fn small_cube() -> Mesh {
    block([0.1; 3], [2; 3])
}

pub fn row(surface_nodes: &[u32], touchable: usize) -> usize {
    3 * surface_nodes[touchable / 3] as usize + touchable % 3
}

/// Unit loads on surface degrees of freedom, one per column.
pub fn unit_loads(system: &System, surface_nodes: &[u32]) -> Mat<f64> {
    let mut loads = Mat::zeros(system.discretisation.dofs(), 3 * surface_nodes.len());
    (0..loads.ncols()).for_each(|column| loads[(row(surface_nodes, column), column)] = 1.0);
    loads
}

/// Entry of the stored residual compliance [m/N].
pub fn stored(residual: &ResidualCompliance, i: usize, j: usize) -> f64 {
    residual.block(i / 3, j / 3).col(j % 3)[i % 3]
}

pub fn dense(residual: &ResidualCompliance, size: usize) -> Mat<f64> {
    Mat::from_fn(size, size, |i, j| stored(residual, i, j))
}

pub fn least_eigenvalue(matrix: &Mat<f64>) -> f64 {
    let scale = matrix.norm_max();
    let scaled = Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| matrix[(i, j)] / scale);
    scaled.self_adjoint_eigen(Side::Lower).expect("a symmetric matrix").S()[0] * scale
}
