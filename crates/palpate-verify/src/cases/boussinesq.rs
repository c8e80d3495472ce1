//! Touch on a half-space: the mean displacement under a footprint, against Boussinesq's solution.
//!
//! The footprint k(s) = (1 − s²)² of radius a (docs/theory.md (C26)) is a pressure w = 3k/(πa²) per unit force, and the displacement is
//! averaged with the same weights. A force on a half-space displaces its surface by (1 − ν²)/(πE·r) at a distance r (Johnson, *Contact Mechanics*,
//! 3.18). In Hankel space, with ŵ(κ) = 48·J₃(κa)/(κa)³ and 1/r ↔ 2π/κ,
//!
//! ```text
//! u/F = (1 − ν²)/(πE)·∬ w·w'/|x − x'| dA dA' = (1 − ν²)/(πEa)·H        H = ∫₀^∞ (48·J₃(x)/x³)² dx = 131072/(17325π)
//! ```
//!
//! by Weber and Schafheitlin's integral; second route: the integral by Simpson's rule. A block that is fixed at its lower face is no half-space. A
//! layer of thickness t on a rigid ground has (1 − ν²)/(πEa)·∫(48·J₃(x)/x³)²·L(xt/a) dx, with m = 3 − 4ν (Johnson, 5.8; for long waves L leads to
//! the layer's uniaxial compliance, for short ones to 1):
//!
//! ```text
//! L(y) = (2m·sinh 2y − 4y)/(2m·cosh 2y + 4y² + 1 + m²)
//! ```
//!
//! The sides of the block are two thicknesses away. What the ground takes from the compliance is k/t, so two blocks lead to the half-space.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{Damping, DeviceInput, DeviceParameters, Input, Recording, State, step};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters};
use palpate_mesh::{Mesh, box_mesh};
use palpate_testkit::{nodes_where, object_at, recorded, scene, smoothstep, undamped};
use std::f64::consts::PI;
use std::sync::Arc;

const YOUNG: f64 = 1e5;
const POISSON: f64 = 0.3;
const DENSITY: f64 = 1000.0;

/// Patch radius a [m], radius of the tip [m], and depth [m].
const PATCH: f64 = 0.01;
const TIP: f64 = 0.005;
const DEPTH: f64 = 2e-4;

/// Thicknesses t of the blocks in patch radii, and half width over thickness.
const THICKNESSES: [f64; 2] = [3.0, 6.0];
const WIDE: f64 = 2.0;

/// Cells over the width of a coarse and a fine mesh, twice those over the thickness, and the size of the innermost ones in patch radii: surface
/// edges are half as long.
const CELLS: [u32; 2] = [10, 12];
const INNER: f64 = 0.35;

/// H by Weber and Schafheitlin's integral.
const WEBER_SCHAFHEITLIN: f64 = 131_072.0 / (17_325.0 * PI);

/// J₃ by its series, which converges for any x; from 20 on by three terms of Hankel's expansion.
fn bessel_3(x: f64) -> f64 {
    if x > 20.0 {
        let phase = x - 1.75 * PI;
        let (p, q) = (1.0 - 945.0 / (128.0 * x * x), 35.0 / (8.0 * x) - 3465.0 / (1024.0 * x.powi(3)));
        return (2.0 / (PI * x)).sqrt() * (p * phase.cos() - q * phase.sin());
    }
    let mut term = (0.5 * x).powi(3) / 6.0;
    let mut sum = term;
    for k in 1..80 {
        term *= -0.25 * x * x / (f64::from(k) * f64::from(k + 3));
        sum += term;
    }
    sum
}

/// L(y) of a layer on a rigid ground.
fn layer(y: f64) -> f64 {
    let m = 3.0 - 4.0 * POISSON;
    // sinh and cosh of 2y over e^(2y).
    let (decay, square) = ((-2.0 * y).exp(), (-4.0 * y).exp());
    (m * (1.0 - square) - 4.0 * y * decay) / (m * (1.0 + square) + (4.0 * y * y + 1.0 + m * m) * decay)
}

/// ∫(48·J₃(x)/x³)²·L(x·t/a) dx by Simpson's rule up to 200, beyond which 1e-10 are left; t/a may be infinite.
fn hankel(thickness: f64) -> f64 {
    const END: f64 = 200.0;
    const PARTS: u32 = 20_000;
    let h = END / f64::from(PARTS);
    let value = |number: u32| {
        let x = f64::from(number) * h;
        let footprint = if number == 0 { 1.0 } else { (48.0 * bessel_3(x) / x.powi(3)).powi(2) };
        footprint * if thickness.is_finite() { layer(x * thickness) } else { 1.0 }
    };
    let weight = |number: u32| if number % 2 == 1 { 4.0 } else { 2.0 };
    let inner: f64 = (1..PARTS).map(|number| weight(number) * value(number)).sum();
    (value(0) + inner + value(PARTS)) * h / 3.0
}

/// Coordinate [m] that grows with a share of a length [m] as sinh, from n cells of which the innermost has a size [m].
fn graded(length: f64, cells: f64) -> impl Fn(f64) -> f64 {
    let innermost = |g: f64| length * (g / cells).sinh() / g.sinh();
    let (mut low, mut high) = (1e-3, 30.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if innermost(middle) > INNER * PATCH {
            low = middle;
        } else {
            high = middle;
        }
    }
    move |share: f64| length * (low * share).sinh() / low.sinh()
}

/// A block of thickness t [m] whose cells are small under the patch.
fn graded_block(thickness: f64, cells: u32) -> Result<Mesh, VerifyError> {
    let half = WIDE * thickness;
    let mut mesh = box_mesh([2.0, 1.0, 2.0], [cells, cells / 2, cells])?;
    let per_half = 0.5 * f64::from(cells);
    let (across, down) = (graded(half, per_half), graded(thickness, per_half));
    for node in &mut mesh.nodes {
        *node = DVec3::new(across(node.x), 0.5 * thickness - down(0.5 - node.y), across(node.z));
    }
    Ok(mesh)
}

fn block(thickness: f64, cells: u32) -> Result<Arc<Recording>, VerifyError> {
    let mesh = graded_block(thickness, cells)?;
    let parameters = RecordParameters {
        // Mass damping for the lowest modes, stiffness damping for the others: a press settles within a second.
        damping: Damping::Rayleigh { alpha: 60.0, beta: 5e-3 },
        fixed_nodes: nodes_where(&mesh, |node| node.y < -0.499 * thickness),
        extent: RecordExtent::NoCertificate,
        ..undamped(YOUNG, POISSON, DENSITY, ElementOrder::Quadratic, 60)
    };
    Ok(Arc::new(recorded(mesh, &parameters)?.recording))
}

/// Displacement per force [m/N] of a finger that is pressed in and at rest.
fn pressed(block: &Arc<Recording>, invariants: &mut RunInvariants) -> Result<f64, VerifyError> {
    const RISE: u32 = 200;
    const STEPS: u32 = 1500;
    let top = block.surface.positions.iter().map(|p| p.y).fold(f64::NEG_INFINITY, f64::max);
    let finger = DeviceParameters { tip_radius: TIP, patch_radius: PATCH, ..DeviceParameters::default() };
    let objects = vec![object_at(block, DVec3::ZERO, DVec3::ZERO)];
    let model = scene(1e-3, DVec3::ZERO, Vec::new(), vec![finger], objects)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    for number in 1..=STEPS {
        // From a tenth of the depth above.
        let down = DEPTH * (1.1 * smoothstep(f64::from(number) / f64::from(RISE)) - 0.1);
        let hand = DVec3::Y * (top + TIP - down);
        let input = Input { devices: vec![DeviceInput::touching(hand)], ..Input::default() };
        invariants.observe(step(&model, &mut state, &input));
    }
    Ok(DEPTH / state.output().devices[0].force_on_hand.y)
}

/// Two blocks, and the half-space that they lead to.
pub fn boussinesq() -> Result<Vec<Check>, VerifyError> {
    /// Of Simpson's rule and three terms of Hankel's expansion.
    const ROUTES: f64 = 1e-7;
    /// Mesh error of quadratic elements with four surface edges per patch radius, half of 1 % for ν = 0.3 (docs/contact.md), and as much again
    /// for cells that grow by 1.5 to 2.5 from one to the next; sides are two thicknesses away.
    const LAYER: f64 = 0.015;
    /// Twice the error of the thicker block, less that of the thinner one, by the extrapolation 2·u(2t) − u(t), whose own error is 0.3 %.
    const HALF_SPACE: f64 = 0.03;
    /// Least order of the displacement with the size of the cells: an energy, twice that of the strains of quadratic elements at best.
    const ORDER: f64 = 2.0;
    let unit = (1.0 - POISSON * POISSON) / (PI * YOUNG * PATCH);
    let mut checks = vec![Check::new(
        "H, closed form against Simpson's rule",
        WEBER_SCHAFHEITLIN,
        hankel(f64::INFINITY),
        ROUTES,
    )];
    let mut compliances = Vec::new();
    for thickness in THICKNESSES {
        let mut invariants = RunInvariants::default();
        let exact = unit * hankel(thickness);
        let [coarse, fine] = CELLS.map(|cells| pressed(&block(thickness * PATCH, cells)?, &mut invariants));
        let (coarse, fine) = (coarse?, fine?);
        let name = format!("block of {thickness} patch radii");
        let quantity = format!("{name}: displacement per force, as of a layer [m/N]");
        let refined = f64::from(CELLS[1]) / f64::from(CELLS[0]);
        let check = Check::new(quantity, fine, exact, LAYER);
        checks.push(check.with_order((coarse - exact).abs(), (fine - exact).abs(), refined, ORDER));
        checks.extend(invariants.checks(&name));
        compliances.push(fine);
    }
    let quantity = "displacement per force of a half-space, from both blocks [m/N]";
    let measured = 2.0 * compliances[1] - compliances[0];
    checks.push(Check::new(quantity, measured, unit * WEBER_SCHAFHEITLIN, HALF_SPACE));
    Ok(checks)
}
