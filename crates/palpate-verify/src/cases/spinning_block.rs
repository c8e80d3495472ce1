//! Torque-free spin of a stiff block with three different inertias, against Jacobi's elliptic functions.
//!
//! With the principal inertias I₁ < I₂ < I₃ [kg·m²], the energy E [J] and the angular momentum M [N·m·s], the angular velocity Ω [rad/s] in body
//! axes is periodic (Landau & Lifshitz, *Mechanics*, § 37). For M² > 2E·I₂, where Ω circles about the third axis,
//!
//! ```text
//! Ω₁ = √((2EI₃ − M²)/(I₁(I₃ − I₁)))·cn τ      k² = (I₂ − I₁)(2EI₃ − M²)/((I₃ − I₂)(M² − 2EI₁))
//! Ω₂ = √((2EI₃ − M²)/(I₂(I₃ − I₂)))·sn τ      τ = (t − t₀)·√((I₃ − I₂)(M² − 2EI₁)/(I₁I₂I₃))
//! Ω₃ = √((M² − 2EI₁)/(I₃(I₃ − I₁)))·dn τ      period 4K(k) in τ
//! ```
//!
//! and for M² < 2E·I₂ the same with 1 and 3 exchanged. K is the complete elliptic integral, by the arithmetic-geometric mean:
//! K = π/(2·agm(1, √(1 − k²))). Second route: Euler's equations by Runge and Kutta.

use crate::check::Check;
use crate::error::VerifyError;
use glam::{DQuat, DVec3};
use palpate::{Input, ObjectStart, Pose, Recording, State, Twist, step};
use palpate::{Model, ModelObject, ModelParameters};
use palpate_fem::ElementOrder;
use palpate_mesh::box_mesh;
use palpate_testkit::ElasticMaterial;
use std::f64::consts::PI;
use std::sync::Arc;

const SIZE: [f64; 3] = [0.2, 0.12, 0.06];

/// Hard rubber. The deformation does not feel the rotation (docs/theory.md, section 1), so stiffness does not matter.
const RUBBER: ElasticMaterial =
    ElasticMaterial { young_pa: 2e6, poisson: 0.3, density_kg_m3: 1000.0, stiffness_damping_s: 0.0 };

/// Principal inertias I₁ < I₂ < I₃ of the box about x, y and z [kg·m²].
fn inertias() -> [f64; 3] {
    let [a, b, c] = SIZE;
    let mass = RUBBER.density_kg_m3 * a * b * c;
    [b * b + c * c, a * a + c * c, a * a + b * b].map(|squares| mass * squares / 12.0)
}

/// Arithmetic-geometric mean.
fn agm(a: f64, b: f64) -> f64 {
    // Quadratic convergence: 64 bits after six steps, wherever k is not within 1e-9 of 1.
    let (mean, _) = (0..8).fold((a, b), |(a, b), _| (0.5 * (a + b), (a * b).sqrt()));
    mean
}

/// Period [s] of the body angular velocity that begins with Ω [rad/s], by elliptic integrals.
fn jacobi_period(spin: DVec3) -> f64 {
    let [mut i1, i2, mut i3] = inertias();
    let squares = spin * spin;
    let twice_energy = i1 * squares.x + i2 * squares.y + i3 * squares.z;
    let momentum = i1 * i1 * squares.x + i2 * i2 * squares.y + i3 * i3 * squares.z;
    if momentum < twice_energy * i2 {
        (i1, i3) = (i3, i1);
    }
    let (low, high) = (momentum - twice_energy * i1, twice_energy * i3 - momentum);
    let k2 = (i2 - i1) * high / ((i3 - i2) * low);
    let quarter = PI / (2.0 * agm(1.0, (1.0 - k2).sqrt()));
    4.0 * quarter * (i1 * i2 * i3 / ((i3 - i2) * low)).sqrt()
}

/// Angular acceleration [rad/s²] in body axes: I·Ω̇ = (I·Ω) × Ω.
fn euler(spin: DVec3) -> DVec3 {
    let inertias = DVec3::from_array(inertias());
    (inertias * spin).cross(spin) / inertias
}

/// Times [s] at which Ω₂ rises through zero, between samples by a cubic through values and slopes.
struct Risings {
    last: Option<(f64, DVec3)>,
    times: Vec<f64>,
}

impl Risings {
    fn new() -> Self {
        Self { last: None, times: Vec::new() }
    }

    fn observe(&mut self, time: f64, spin: DVec3) {
        if let Some((before, from)) = self.last
            && from.y < 0.0
            && spin.y >= 0.0
        {
            let h = time - before;
            let (p0, p1, m0, m1) = (from.y, spin.y, h * euler(from).y, h * euler(spin).y);
            let at = |s: f64| {
                let r = 1.0 - s;
                r * r * ((1.0 + 2.0 * s) * p0 + s * m0) + s * s * ((3.0 - 2.0 * s) * p1 - r * m1)
            };
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..50 {
                let middle = 0.5 * (low + high);
                if at(middle) < 0.0 {
                    low = middle;
                } else {
                    high = middle;
                }
            }
            self.times.push(before + low * h);
        }
        self.last = Some((time, spin));
    }

    /// Mean time [s] from one rising to the next; none where there are fewer than two.
    fn period(&self) -> Option<f64> {
        let (first, last) = (self.times.first()?, self.times.last()?);
        (self.times.len() > 1).then(|| (last - first) / (self.times.len() - 1) as f64)
    }
}

/// Turns of Ω that are seen.
const PERIODS: f64 = 3.2;

/// Period [s] by the classical method of Runge and Kutta with steps of a thousandth of it.
fn runge_kutta_period(mut spin: DVec3, about: f64) -> Result<f64, VerifyError> {
    let h = 1e-3 * about;
    let mut risings = Risings::new();
    for number in 0..(1e3 * PERIODS) as usize {
        risings.observe(number as f64 * h, spin);
        let k1 = euler(spin);
        let k2 = euler(spin + k1 * (0.5 * h));
        let k3 = euler(spin + k2 * (0.5 * h));
        let k4 = euler(spin + k3 * h);
        spin += (k1 + (k2 + k3) * 2.0 + k4) * (h / 6.0);
    }
    risings.period().ok_or(VerifyError::NotReached("a period of Euler's equations"))
}

/// Period [s] of the block in the runtime.
fn measured_period(block: &Arc<Recording>, spin: DVec3, step_s: f64, about: f64) -> Result<f64, VerifyError> {
    // Any orientation at the start: the world's axes must not matter.
    let orientation = DQuat::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), 0.7);
    let twist = Twist { linear: DVec3::new(0.3, 0.0, -0.1), angular: orientation * spin };
    let start = ObjectStart { pose: Pose { orientation, ..Pose::IDENTITY }, twist };
    let parameters = ModelParameters { step_s, ..ModelParameters::for_reference() };
    let model = Model::new(parameters, vec![ModelObject::new(block.clone(), start)])?;
    let mut state = State::new(&model);
    let mut risings = Risings::new();
    for number in 0..(PERIODS * about / step_s) as usize {
        let object = &state.output().objects[0];
        risings.observe(number as f64 * step_s, object.pose.orientation.inverse() * object.twist.angular);
        step(&model, &mut state, &Input::default());
    }
    risings.period().ok_or(VerifyError::NotReached("a period of the block"))
}

/// Periods near the middle axis and near both stable ones.
pub fn spinning_block() -> Result<Vec<Check>, VerifyError> {
    /// Of the two routes to the exact period: fourth order with a thousandth of a period is 1e-12, times the nearness to the middle axis.
    const ROUTES: f64 = 1e-8;
    /// The midpoint rule is (Ωh)²/12 slow: 1.2e-5 at 12 rad/s and 1 ms.
    const PERIOD: f64 = 1.2e-5;
    const STEP: f64 = 1e-3;
    let block = RUBBER.free_body(box_mesh(SIZE, [4, 3, 2])?, ElementOrder::Quadratic, 10)?;
    let mut checks = Vec::new();
    for (name, spin) in [
        ("near the middle axis", DVec3::new(0.05, 12.0, 0.08)),
        ("between the middle and the long axis", DVec3::new(9.0, 8.0, 0.5)),
        ("near the short axis", DVec3::new(1.0, 0.5, 12.0)),
        ("near the long axis", DVec3::new(12.0, 0.5, 1.0)),
    ] {
        let exact = jacobi_period(spin);
        let quantity = format!("period {name}, elliptic integral against Runge-Kutta [s]");
        checks.push(Check::new(quantity, runge_kutta_period(spin, exact)?, exact, ROUTES));
        let coarse = measured_period(&block, spin, 2.0 * STEP, exact)?;
        let fine = measured_period(&block, spin, STEP, exact)?;
        let check = Check::new(format!("period {name}, step 1 ms [s]"), fine, exact, PERIOD);
        checks.push(check.with_order((coarse - exact).abs(), (fine - exact).abs(), 2.0, 2.0));
    }
    Ok(checks)
}
