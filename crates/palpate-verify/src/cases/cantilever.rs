//! Cantilever under its own weight and under a force at its tip, against Timoshenko's beam.
//!
//! With length L, square section of side b, A = b², I = b⁴/12, G = E/(2(1 + ν)), weight per length q = ρgA and the shear coefficient κ of
//! Cowper (1966, J. Appl. Mech. 33, 335):
//!
//! ```text
//! sag of the tip   q·L⁴/(8EI) + q·L²/(2κGA)        tip under a force F   F·L³/(3EI) + F·L/(κGA)
//! κ = 10(1 + ν)/(12 + 11ν)
//! ```
//!
//! Shear is 0.8 and 0.6 % of these for L/b = 10 and ν = 0. A clamped end that cannot contract (ν > 0) makes the beam stiffer by a share of b/L, which
//! beams of two lengths show and take away.

use crate::check::Check;
use crate::error::VerifyError;
use crate::run_invariants::RunInvariants;
use glam::DVec3;
use palpate::{
    Damping, DeviceInput, DeviceParameters, Grasp, InitialDeformation, Input, Model, Recording, State, step,
};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters};
use palpate_mesh::box_mesh;
use palpate_testkit::{GRAVITY_M_S2, nodes_where, object_at, recorded, scene, smoothstep, undamped};
use std::sync::Arc;

/// Lengths L [m]: ten and twenty times the side.
const LENGTHS: [f64; 2] = [0.2, 0.4];
const SIDE: f64 = 0.02;
const YOUNG: f64 = 1e7;
const DENSITY: f64 = 1000.0;

/// Mass damping α [1/s]: the lowest mode of the longer beam, at 12.7 rad/s, is just not overdamped, and all decay with e^(−αt/2).
const MASS_DAMPING: f64 = 24.0;

fn beam(length: f64, poisson: f64) -> Result<Arc<Recording>, VerifyError> {
    let cells = (length / (0.5 * SIDE)).round() as u32;
    let mesh = box_mesh([length, SIDE, SIDE], [cells, 2, 2])?;
    let parameters = RecordParameters {
        damping: Damping::Rayleigh { alpha: MASS_DAMPING, beta: 0.0 },
        fixed_nodes: nodes_where(&mesh, |node| node.x < -0.499 * length),
        extent: RecordExtent::NoCertificate,
        ..undamped(YOUNG, poisson, DENSITY, ElementOrder::Quadratic, 60)
    };
    Ok(Arc::new(recorded(mesh, &parameters)?.recording))
}

/// Compliances of bending, 1/EI [1/(N·m²)], and shear, 1/κGA [1/N].
fn compliances(poisson: f64) -> [f64; 2] {
    let kappa = 10.0 * (1.0 + poisson) / (12.0 + 11.0 * poisson);
    let shear = kappa * YOUNG / (2.0 * (1.0 + poisson)) * SIDE * SIDE;
    [12.0 / (YOUNG * SIDE.powi(4)), 1.0 / shear]
}

/// Surface node at the middle of the tip.
fn tip(beam: &Recording) -> Result<usize, VerifyError> {
    let at = DVec3::X * beam.surface.extent().1.x;
    let near = |node: &usize| (beam.surface.positions[*node] - at).length() < 1e-6 * SIDE;
    (0..beam.surface.positions.len()).find(near).ok_or(VerifyError::NotReached("a node at the tip"))
}

/// Sag [m] of the tip in a state.
fn sag(model: &Model, state: &State, beam: &Recording) -> Result<f64, VerifyError> {
    let mut displacement = vec![DVec3::ZERO; beam.surface.positions.len()];
    state.surface_displacement(model, 0, &mut displacement);
    Ok(-displacement[tip(beam)?].y)
}

/// Sag [m] at the start and after two seconds.
fn hanging(
    beam: &Arc<Recording>,
    deformation: InitialDeformation,
    invariants: &mut RunInvariants,
) -> Result<[f64; 2], VerifyError> {
    const STEPS: usize = 2000;
    let mut object = object_at(beam, DVec3::ZERO, DVec3::ZERO);
    object.deformation = deformation;
    let model = scene(1e-3, DVec3::Y * -GRAVITY_M_S2, Vec::new(), Vec::new(), vec![object])?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    let start = sag(&model, &state, beam)?;
    for _ in 0..STEPS {
        invariants.observe(step(&model, &mut state, &Input::default()));
    }
    Ok([start, sag(&model, &state, beam)?])
}

/// Force [N] on a hand that holds the tip, moves it by a displacement [m] across the beam, and rests.
fn held(
    beam: &Arc<Recording>,
    displacement: f64,
    invariants: &mut RunInvariants,
) -> Result<DVec3, VerifyError> {
    const STEPS: usize = 1500;
    const RISE: usize = 300;
    let at = DVec3::X * beam.surface.extent().1.x;
    let (point, _) = beam.surface.nearest(at).ok_or(VerifyError::NotReached("a surface"))?;
    let objects = vec![object_at(beam, DVec3::ZERO, DVec3::ZERO)];
    let model = scene(1e-3, DVec3::ZERO, Vec::new(), vec![DeviceParameters::default()], objects)?;
    let mut state = State::new(&model);
    invariants.observe(state.output());
    for number in 1..=STEPS {
        let down = displacement * smoothstep(number as f64 / RISE as f64);
        let hand = DeviceInput::held(at - DVec3::Y * down, Grasp { object: 0, point });
        invariants.observe(step(&model, &mut state, &Input { devices: vec![hand], ..Input::default() }));
    }
    Ok(state.output().devices[0].force_on_hand)
}

/// Sag and tip force over those of Timoshenko's beam.
struct OverBeam {
    sag: f64,
    force: f64,
}

/// A beam by both routes; `checks` gets what must be the same in them.
fn over_beam(length: f64, poisson: f64, checks: &mut Vec<Check>) -> Result<OverBeam, VerifyError> {
    /// e^(−αt/2) after two seconds is 4e-11.
    const SETTLED: f64 = 1e-9;
    /// Of a state that is an equilibrium up to round-off.
    const STAYS: f64 = 1e-12;
    /// Axial force over the force across [1]: linear elasticity has none, and the hand's path is vertical to round-off.
    const AXIAL: f64 = 1e-6;
    /// Of the length.
    const DISPLACEMENT: f64 = 0.025;
    let name = format!("ν = {poisson}, L = {:.0} b", length / SIDE);
    let beam = beam(length, poisson)?;
    let [bending, shear] = compliances(poisson);
    let mut invariants = RunInvariants::default();
    let [start, later] = hanging(&beam, InitialDeformation::Equilibrium, &mut invariants)?;
    checks.push(Check::new(
        format!("{name}: sag two seconds after that at the start [m]"),
        later,
        start,
        STAYS,
    ));
    let [_, settled] = hanging(&beam, InitialDeformation::Undeformed, &mut RunInvariants::default())?;
    checks.push(Check::new(format!("{name}: sag of a beam that has settled [m]"), settled, start, SETTLED));
    checks.extend(invariants.checks(&format!("{name}, hanging")));
    let mut invariants = RunInvariants::default();
    let force = held(&beam, DISPLACEMENT * length, &mut invariants)?;
    checks.push(Check::new(format!("{name}: force along the beam over it"), force.x / force.y, 0.0, AXIAL));
    checks.extend(invariants.checks(&format!("{name}, held tip")));
    let weight = DENSITY * GRAVITY_M_S2 * SIDE * SIDE;
    Ok(OverBeam {
        sag: start / (weight * (length.powi(4) * bending / 8.0 + length.powi(2) * shear / 2.0)),
        force: force.y * (length.powi(3) * bending / 3.0 + length * shear) / (DISPLACEMENT * length),
    })
}

/// Sag and tip force for ν = 0 and ν = 0.3.
pub fn cantilever() -> Result<Vec<Check>, VerifyError> {
    /// Two quadratic elements across, and for the tip force the indentation of the point that is held: 1/3000 of the beam's compliance.
    const BEAM: f64 = 0.002;
    /// Stiffening by the clamped end: it is b/L times a number below 1, and extrapolated away to the order (b/L)².
    const EXTRAPOLATED: f64 = 0.003;
    let mut checks = Vec::new();
    let straight = over_beam(LENGTHS[0], 0.0, &mut checks)?;
    checks.push(Check::new("ν = 0: sag over Timoshenko's", straight.sag, 1.0, BEAM));
    checks.push(Check::new("ν = 0: force of the tip over Timoshenko's", straight.force, 1.0, BEAM));
    let short = over_beam(LENGTHS[0], 0.3, &mut checks)?;
    let long = over_beam(LENGTHS[1], 0.3, &mut checks)?;
    for (name, [short, long]) in [("sag", [short.sag, long.sag]), ("force", [short.force, long.force])] {
        let quantity = format!("ν = 0.3: {name} over Timoshenko's, from two lengths (L = 20 b: {long:.4})");
        let check = Check::new(quantity, 2.0 * long - short, 1.0, EXTRAPOLATED);
        checks.push(check.with_order((short - 1.0).abs(), (long - 1.0).abs(), 2.0, 1.0));
    }
    Ok(checks)
}
