//! Bodies of the tests, and matrices of a recording.

use faer::{Mat, Side};
use palpate::{Damping, ResidualCompliance};
use palpate_fem::{ElementOrder, Progress, RecordParameters, RecordedBody};
use palpate_mesh::{Mesh, Region, box_mesh};
use palpate_testkit::undamped;
pub use palpate_testkit::{isotropic, nodes_where};
use std::sync::OnceLock;

/// Solves with a factor of condition up to 1e6 keep ten of sixteen digits.
pub const SOLVED: f64 = 1e-10;

/// Sums and products of a few hundred terms keep all but three digits.
pub const SUMMED: f64 = 1e-12;

/// Largest relative rounding error of f32: half a unit in the 24th binary digit.
pub const F32_ROUNDING: f64 = 1.0 / 16_777_216.0;

pub fn parameters(order: ElementOrder, modes: usize) -> RecordParameters {
    RecordParameters {
        damping: Damping::Rayleigh { alpha: 2.0, beta: 2e-4 },
        ..undamped(2e4, 0.3, 1000.0, order, modes)
    }
}

pub fn block(size: [f64; 3], cells: [u32; 3]) -> Mesh {
    box_mesh(size, cells).expect("a good box")
}

pub fn recorded(mesh: Mesh, parameters: &RecordParameters) -> RecordedBody {
    palpate_testkit::recorded(mesh, parameters).expect("a good recording")
}

pub fn refusal(mesh: Mesh, parameters: &RecordParameters) -> String {
    palpate_testkit::recorded(mesh, parameters).err().expect("an error").to_string()
}

/// Listener that keeps the warnings.
#[derive(Default)]
pub struct Listener(pub Vec<String>);

impl Progress for Listener {
    fn begin(&mut self, _stage: &str, _total: u64) {}
    fn advance(&mut self, _units: u64) {}
    fn warn(&mut self, text: &str) {
        self.0.push(text.into());
    }
}

/// A bar with a soft and a stiff half of other density, with its parameters: 1149 degrees of freedom, so that
/// the modes come by block Krylov.
pub fn two_material_bar(modes: usize) -> (Mesh, RecordParameters) {
    let mut mesh = block([0.2, 0.05, 0.05], [8, 2, 2]);
    mesh.regions.push(Region { tag: 1, ..Region::default() });
    for (tet, region) in mesh.tets.iter().zip(&mut mesh.tet_regions) {
        *region = u32::from(tet.iter().map(|&n| mesh.nodes[n as usize].x).sum::<f64>() > 0.0);
    }
    let materials = vec![isotropic(2e4, 0.45, 1000.0), isotropic(3e5, 0.2, 2500.0)];
    (mesh, RecordParameters { materials, ..parameters(ElementOrder::Quadratic, modes) })
}

/// A bar with its left end fixed.
pub fn fixed_bar(order: ElementOrder, modes: usize) -> (Mesh, RecordParameters) {
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

/// Unit loads [N] on surface degrees of freedom.
pub fn unit_loads(body: &RecordedBody, surface_nodes: &[u32]) -> Vec<Vec<f64>> {
    let load = |touchable: usize| {
        let mut load = vec![0.0; body.dofs()];
        load[row(surface_nodes, touchable)] = 1.0;
        load
    };
    (0..3 * surface_nodes.len()).map(load).collect()
}

/// Largest magnitude in some fields.
pub fn largest(fields: &[Vec<f64>]) -> f64 {
    fields.iter().flatten().fold(0.0, |largest, value| largest.max(value.abs()))
}

/// [`two_material_bar`] with 40 modes, recorded once per test process.
pub fn shared_bar() -> &'static RecordedBody {
    static BODY: OnceLock<RecordedBody> = OnceLock::new();
    BODY.get_or_init(|| {
        let (mesh, parameters) = two_material_bar(40);
        recorded(mesh, &parameters)
    })
}

/// [`fixed_bar`] of quadratic elements with 40 modes, recorded once per test process.
pub fn shared_fixed_bar() -> &'static RecordedBody {
    static BODY: OnceLock<RecordedBody> = OnceLock::new();
    BODY.get_or_init(|| {
        let (mesh, parameters) = fixed_bar(ElementOrder::Quadratic, 40);
        recorded(mesh, &parameters)
    })
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
