//! Free vibrations of a sphere.
//!
//! With β = ηR = ωR/c_s and α = ωR/c_p, j the spherical Bessel functions (Lamb 1881; Eringen & Suhubi,
//! *Elastodynamics* II, 8.14):
//!
//! ```text
//! torsional T_l    (l − 1)·j_l(β) − β·j_{l+1}(β) = 0
//! spheroidal S_l   | (l² − l − β²/2)·j_l(α) + 2α·j_{l+1}(α)   l(l+1)·[(l − 1)·j_l(β) − β·j_{l+1}(β)] |
//!                  | (l − 1)·j_l(α) − α·j_{l+1}(α)            (l² − 1 − β²/2)·j_l(β) + β·j_{l+1}(β)  | = 0
//! ```

use crate::check::Check;
use crate::error::VerifyError;
use crate::modal::{frequencies_hz, lowest, mean};
use palpate_fem::ElementOrder;
use palpate_mesh::{MeshingParameters, SurfaceMesh, ball_mesh, tetrahedralise};
use palpate_testkit::undamped;
use std::f64::consts::TAU;
use std::ops::ControlFlow;

const POISSON: f64 = 0.3;
const RADIUS: f64 = 0.05;
const YOUNG: f64 = 5e4;
const DENSITY: f64 = 1000.0;

/// Spherical Bessel function j_l by its ascending series.
fn bessel(l: u32, x: f64) -> f64 {
    let mut term = (1..=l).fold(1.0, |product, k| product * x / f64::from(2 * k + 1));
    let mut sum = 0.0;
    for k in 1.. {
        sum += term;
        term *= -x * x / (2.0 * f64::from(k) * f64::from(2 * l + 2 * k + 1));
        if term.abs() < 1e-18 * sum.abs() {
            break;
        }
    }
    sum
}

fn torsional(l: u32, x: f64) -> f64 {
    f64::from(l - 1) * bessel(l, x) - x * bessel(l + 1, x)
}

fn spheroidal(l: u32, beta: f64) -> f64 {
    let n = f64::from(l);
    let alpha = beta * ((1.0 - 2.0 * POISSON) / (2.0 * (1.0 - POISSON))).sqrt();
    let half = beta * beta / 2.0;
    let a = (n * n - n - half) * bessel(l, alpha) + 2.0 * alpha * bessel(l + 1, alpha);
    let d = (n * n - 1.0 - half) * bessel(l, beta) + beta * bessel(l + 1, beta);
    a * d - n * (n + 1.0) * torsional(l, beta) * torsional(l, alpha)
}

/// The lowest root above 1, by a scan and bisection.
fn lowest_root(f: impl Fn(f64) -> f64) -> f64 {
    let mut low = 1.0;
    while f(low) * f(low + 0.01) > 0.0 {
        low += 0.01;
    }
    let mut high = low + 0.01;
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if f(low) * f(middle) > 0.0 {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Orders of the elements, layers of the coarse and the fine mesh, order of convergence and tolerance of the fine one: chords of so many
/// layers cut about 1/(2·layers²) off the radius of linear elements, which are stiffer on top; the edges of quadratic ones follow the sphere.
const MESHES: [(ElementOrder, [u32; 2], f64, f64); 2] =
    [(ElementOrder::Linear, [6, 12], 2.0, 0.025), (ElementOrder::Quadratic, [4, 8], 4.0, 0.0005)];

/// Linear elements with straight edges, and quadratic ones with curved edges.
pub fn free_vibrations() -> Result<Vec<Check>, VerifyError> {
    // In the order of their frequencies, with 2l + 1 modes each.
    let exact = [
        ("T2", 5, lowest_root(|x| torsional(2, x))),
        ("S2", 5, lowest_root(|x| spheroidal(2, x))),
        ("S1", 3, lowest_root(|x| spheroidal(1, x))),
        ("T3", 7, lowest_root(|x| torsional(3, x))),
        ("S3", 7, lowest_root(|x| spheroidal(3, x))),
    ];
    let shear_speed = (YOUNG / (2.0 * (1.0 + POISSON)) / DENSITY).sqrt();
    let mut checks = Vec::new();
    for (order, layers, convergence, allowed) in MESHES {
        let modes = |layers: u32| -> Result<Vec<f64>, VerifyError> {
            let parameters = undamped(YOUNG, POISSON, DENSITY, order, 27);
            let body = lowest(ball_mesh(RADIUS, layers)?, &parameters)?;
            Ok(frequencies_hz(&body).into_iter().map(|f| f * TAU * RADIUS / shear_speed).collect())
        };
        let (coarse, fine) = (modes(layers[0])?, modes(layers[1])?);
        let mut at = 0;
        for (name, count, exact) in exact {
            let [first, second] = [&coarse, &fine].map(|modes| mean(&modes[at..at + count]));
            let quantity = format!("{name}, ηR, {} layers {order:?}", layers[1]);
            let check = Check::new(quantity, second, exact, allowed);
            checks.push(check.with_order((first - exact).abs(), (second - exact).abs(), 2.0, convergence));
            at += count;
        }
    }
    checks.extend(filled_surface(&exact, shear_speed)?);
    Ok(checks)
}

/// Layers of the ball that gives the surface, cell that it is filled with, as a share of the radius, and tolerance: elements are curved, and chords
/// of a layer cut about 1/8 of their square off the radius, 0.05 to 0.1 %.
const SURFACE_LAYERS: u32 = 16;
const CELL: f64 = 0.25;
const FILLED: f64 = 2e-3;

/// Modes of tetrahedra that a surface is filled with.
fn filled_surface(exact: &[(&str, usize, f64)], shear_speed: f64) -> Result<Vec<Check>, VerifyError> {
    let surface = SurfaceMesh::from_boundary(ball_mesh(RADIUS, SURFACE_LAYERS)?)?;
    let parameters = MeshingParameters { cell_size: Some(CELL * RADIUS), nodes: None, curved: true };
    let (mesh, _) = tetrahedralise(&surface, &parameters, &mut |_| ControlFlow::Continue(()))?;
    let body = lowest(mesh, &undamped(YOUNG, POISSON, DENSITY, ElementOrder::Quadratic, 27))?;
    let modes: Vec<f64> = frequencies_hz(&body).into_iter().map(|f| f * TAU * RADIUS / shear_speed).collect();
    let mut at = 0;
    let check = |&(name, count, exact): &(&str, usize, f64)| {
        let found = mean(&modes[at..at + count]);
        at += count;
        Check::new(format!("{name}, ηR, filled surface"), found, exact, FILLED)
    };
    Ok(exact.iter().map(check).collect())
}
