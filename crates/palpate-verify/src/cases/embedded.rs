//! A body between two plates: on a fine surface that is embedded in coarse tetrahedra, on their own boundary, and on tetrahedra of half the size.
//!
//! The surfaces are a ball and a blob, filled with curved quadratic elements. At a contact the elements are as large as the patch that the plate
//! flattens.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{
    Damping, Input, Material, Model, ModelParameters, Obstacle, Pose, Recording, Shape, State, step,
};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, SilentProgress, record};
use palpate_mesh::{MeshingParameters, SurfaceMesh, ball_mesh, tetrahedralise};
use palpate_testkit::{SOFT, floor, object_at, smoothstep};
use std::ops::ControlFlow;
use std::sync::Arc;

const RADIUS: f64 = 0.05;

/// Layers of the ball whose boundary the surfaces are made of: 11,520 triangles.
const LAYERS: u32 = 24;

/// Cells [m]: about 500 tetrahedra, and 4,000.
const COARSE: f64 = 0.024;
const FINE: f64 = 0.012;

const MODES: usize = 60;

/// Compression, as a share of the height.
const COMPRESSION: f64 = 0.15;

/// A blob that is flatter than the ball, with a bulge.
fn blob(p: DVec3) -> DVec3 {
    let bulge = 1.0 + 0.25 * (2.0 * p.x / RADIUS).sin() * (1.5 * p.z / RADIUS + 0.5).cos();
    DVec3::new(1.2 * p.x, 0.8 * p.y * bulge, 0.9 * p.z + 0.15 * p.x)
}

/// Tetrahedra in a surface, with its boundary or the surface itself as what is touched.
fn recorded(surface: &SurfaceMesh, cell: f64, is_embedded: bool) -> Result<Arc<Recording>, VerifyError> {
    let parameters = MeshingParameters { cell_size: Some(cell), nodes: None, curved: true };
    let (mesh, _) = tetrahedralise(surface, &parameters, &mut |_| ControlFlow::Continue(()))?;
    let material = Material::isotropic(SOFT.young_pa, SOFT.poisson, SOFT.density_kg_m3);
    let damping = Damping::Rayleigh { alpha: 0.0, beta: SOFT.stiffness_damping_s };
    let parameters = RecordParameters {
        surface: is_embedded.then(|| surface.clone()),
        extent: RecordExtent::NoCertificate,
        ..RecordParameters::new(vec![material], ElementOrder::Quadratic, MODES, damping)
    };
    Ok(Arc::new(record(mesh, &parameters, &mut SilentProgress)?))
}

/// Force [N] of a plate that comes down on a body on a floor, at rest.
fn squeezed(body: &Arc<Recording>, invariants: &mut RunInvariants) -> Result<f64, VerifyError> {
    let heights = || body.surface.positions.iter().map(|p| p.y);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let plate = |down: f64| Pose { position: DVec3::Y * (high - low - down), ..Pose::IDENTITY };
    let shape = Shape::Plane { normal: DVec3::NEG_Y };
    let parameters = ModelParameters {
        obstacles: vec![floor(0.5), Obstacle { shape, pose: plate(0.0), friction: 0.5 }],
        ..ModelParameters::default()
    };
    let model = Model::new(parameters, vec![object_at(body, DVec3::Y * -low, DVec3::ZERO)])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    for number in 1..=700 {
        let down = COMPRESSION * (high - low) * smoothstep(f64::from(number) / 300.0);
        let obstacles = vec![Pose::IDENTITY, plate(down)];
        invariants.observe(step(&model, &mut state, &Input { obstacles, ..Input::default() }));
    }
    Ok(state.output().obstacles[1].force.y)
}

/// Embedded surfaces, and boundaries of curved elements, against elements of half the size.
pub fn embedded() -> Result<Vec<Check>, VerifyError> {
    /// Discretisation, of an embedded surface; and of the boundary, whose contacts are its nodes, some three across what a plate flattens.
    const EMBEDDED: f64 = 0.02;
    const BOUNDARY: f64 = 0.06;
    /// Mass of tetrahedra, by that of the surface: a curved edge follows it at three points.
    const MASS: f64 = 2e-3;
    let ball = SurfaceMesh::from_boundary(ball_mesh(RADIUS, LAYERS)?)?;
    let positions = ball.positions.iter().map(|&p| blob(p)).collect();
    let blob = SurfaceMesh { positions, ..ball.clone() };
    let (mut checks, mut invariants) = (Vec::new(), RunInvariants::default());
    for (name, surface) in [("ball", ball), ("blob", blob)] {
        let fine = squeezed(&recorded(&surface, FINE, false)?, &mut invariants)?;
        for (touched, is_embedded, allowed) in
            [("embedded surface", true, EMBEDDED), ("boundary", false, BOUNDARY)]
        {
            let body = recorded(&surface, COARSE, is_embedded)?;
            let quantity = format!("{name}, {touched}, force of a plate, by elements of half the size [N]");
            checks.push(Check::new(quantity, squeezed(&body, &mut invariants)?, fine, allowed));
            let mass = SOFT.density_kg_m3 * surface.volume();
            checks.push(Check::new(format!("{name}, {touched}, mass [kg]"), body.mass(), mass, MASS));
        }
    }
    checks.extend(invariants.checks("bodies"));
    Ok(checks)
}
