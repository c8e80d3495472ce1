//! Verification: what palpate computes against what must come out, case by case.
//!
//! Each check compares a number with an analytic value, an identity, or an independent solution, and states the error,
//! what is allowed, and, where meshes or steps are refined, the observed order of convergence.

mod adversarial;
mod bounce;
mod closed_loop;
mod compliance;
mod drop;
mod frequencies;
mod friction;
mod grip;
mod hertz;
mod impulse;
mod lift;
mod motion;
mod pinch;
mod places;
mod press;
mod random;
mod scene;
mod spheres;
mod stack;
mod waves;

pub use bounce::{FULL_REBOUND_M, full_fall};

use crate::Failure;
use palpate::{Damping, Material};
use palpate_fem::assembly::Assembly;
use palpate_fem::discretisation::Discretisation;
use palpate_fem::element::Order;
use palpate_fem::mesh::{Mesh, check};
use palpate_fem::modes::{Modes, lowest_modes};
use palpate_fem::progress::{Progress, Silent};
use palpate_fem::record::{Extent, RecordParameters, Recorded, record};
use palpate_fem::residual::ResidualChoice;
use palpate_fem::system::System;

/// One number against another.
pub struct Check {
    /// What is compared.
    pub quantity: String,
    /// What came out.
    pub computed: f64,
    /// What must come out.
    pub expected: f64,
    /// How far apart they are: relative, or absolute where `expected` is 0.
    pub error: f64,
    /// How far apart they may be.
    pub allowed: f64,
    /// Observed and expected order of convergence.
    pub order: Option<[f64; 2]>,
}

impl Check {
    /// The error is relative, or absolute where `expected` is 0.
    pub fn new(quantity: impl Into<String>, computed: f64, expected: f64, allowed: f64) -> Self {
        let error = if expected == 0.0 { computed.abs() } else { (computed / expected - 1.0).abs() };
        Self { quantity: quantity.into(), computed, expected, error, allowed, order: None }
    }

    /// With the order seen between two errors at sizes that differ by `ratio`.
    pub fn with_order(self, coarse: f64, fine: f64, ratio: f64, expected: f64) -> Self {
        let observed = (coarse / fine).ln() / ratio.ln();
        Self { order: Some([observed, expected]), ..self }
    }

    /// Whether error and order are as they must be. An order may be better than expected, and falls short by 0.3 on the
    /// coarse meshes used here.
    pub fn passed(&self) -> bool {
        let order = self.order.is_none_or(|[observed, expected]| observed > expected - 0.3);
        self.error <= self.allowed && order
    }
}

/// A case: its name, what it shows, and how it is computed.
pub struct Case {
    /// Short name.
    pub name: &'static str,
    /// One line on what is compared with what.
    pub about: &'static str,
    /// The computation.
    pub run: fn() -> Result<Vec<Check>, Failure>,
}

/// All cases, quick ones first.
pub const CASES: &[Case] = &[
    Case {
        name: "flight",
        about: "free flight and torque-free spin against conservation laws",
        run: motion::flight,
    },
    Case {
        name: "momentum",
        about: "a held force gives momentum f·h and angular momentum r×f·h",
        run: motion::momentum,
    },
    Case {
        name: "energy",
        about: "energy balance of every step under random hands that jump, let go and grasp again",
        run: motion::energy,
    },
    Case {
        name: "identities",
        about: "ΦᵀMΦ = I, reciprocity, S positive semi-definite, two routes to the modes",
        run: compliance::identities,
    },
    Case {
        name: "cube",
        about: "the paper's cube with linear elements against the table of its frequencies",
        run: frequencies::paper_cube,
    },
    Case {
        name: "continuum",
        about: "quadratic elements against the continuum's frequencies and the exact Lamé mode",
        run: frequencies::continuum,
    },
    Case {
        name: "sphere",
        about: "free spheres against the roots of their frequency equations",
        run: spheres::spheres,
    },
    Case {
        name: "compliance",
        about: "static and instantaneous compliance of points of the paper's cube",
        run: compliance::points,
    },
    Case {
        name: "pinch",
        about: "pinching the paper's cube against the solution with all 6585 modes",
        run: pinch::pinch,
    },
    Case {
        name: "impulse",
        about: "a point's impulse response by time integration against all 6585 modes of the paper's cube",
        run: impulse::impulse,
    },
    Case {
        name: "shaken-block",
        about: "block with ν = 0 shaken at both ends against 2EAk·tan(kL/2)·u₀",
        run: waves::shaken_block,
    },
    Case {
        name: "bounce",
        about: "the paper's cube falls 5 cm on a frictionless floor, against all 6585 modes; and lies on it",
        run: bounce::bounce,
    },
    Case {
        name: "bounce-many-modes",
        about: "the same fall with 1200 modes, as many as the rebound needs at every step",
        run: bounce::bounce_many_modes,
    },
    Case {
        name: "places",
        about: "cubes and a ball that lie, fall and lean, and cubes on one another, on fewer places than they have nodes",
        run: places::places,
    },
    Case {
        name: "friction",
        about: "a block begins to slide at tan θ = μ, and stops after v²/(2μg)",
        run: friction::friction,
    },
    Case {
        name: "press",
        about: "a finger of given radius feels the same on three meshes, as on a finer one",
        run: press::press,
    },
    Case {
        name: "hertz",
        about: "a rigid ball pressed into an elastic block against Hertz's law",
        run: hertz::indentation,
    },
    Case {
        name: "pinch-lift",
        about: "two fingers pinch a cube, lift, shake and throw it",
        run: lift::pinch_lift,
    },
    Case {
        name: "drop-block",
        about: "a block with ν = 0 dropped flat: force ρcvA for 2L/c, and it leaves as it came",
        run: drop::drop_block,
    },
    Case { name: "stack", about: "two cubes rest on one another for a minute", run: stack::stack },
    Case {
        name: "fingers-hold",
        about: "a finger that sticks against a hand that holds",
        run: grip::fingers_hold,
    },
    Case {
        name: "closed-loop",
        about: "device, hand, rate and delay: where the loop begins to swing, and what the controller leaves of it",
        run: closed_loop::study,
    },
    Case {
        name: "adversarial",
        about: "a million steps of random hands on five bodies: no energy comes out, and nothing gets stuck",
        run: adversarial::adversarial,
    },
];

/// Record a mesh without a word.
fn recorded(mesh: Mesh, parameters: &RecordParameters) -> Result<Recorded, Failure> {
    Ok(record(mesh, parameters, &mut Silent as &mut dyn Progress)?)
}

/// An undamped body of one material.
fn undamped(young_pa: f64, poisson: f64, density_kg_m3: f64, order: Order, modes: usize) -> RecordParameters {
    RecordParameters {
        materials: vec![Material { region: String::new(), young_pa, poisson, density_kg_m3 }],
        order,
        modes,
        damping: Damping::Ratio(0.0),
        residual: ResidualChoice::Automatic,
        fixed_nodes: Vec::new(),
        source: "verification".into(),
        extent: Extent::Whole,
    }
}

/// The lowest modes of a mesh, without a recording.
fn lowest(mesh: Mesh, parameters: &RecordParameters) -> Result<(System, Modes), Failure> {
    let failed = |e: &dyn std::fmt::Display| Failure(e.to_string());
    let discretisation = Discretisation::new(&check(mesh)?, parameters.order);
    let assembly = Assembly::new(&discretisation, &parameters.materials);
    let system = System::new(discretisation, assembly, Vec::new()).map_err(|e| failed(&e))?;
    let modes = lowest_modes(&system, parameters.modes, &mut Silent).map_err(|e| failed(&e))?;
    Ok((system, modes))
}

/// Their frequencies [Hz].
fn frequencies_hz(modes: &Modes) -> Vec<f64> {
    modes.squares.iter().map(|square| square.sqrt() / std::f64::consts::TAU).collect()
}

/// 3s² − 2s³, from 0 to 1 as s does, and even at both ends.
pub fn smooth(s: f64) -> f64 {
    let s = s.clamp(0.0, 1.0);
    s * s * (3.0 - 2.0 * s)
}

/// A column of a reference series, by its number; the first row is the header.
fn column(reference: &str, number: usize) -> Vec<f64> {
    reference.lines().skip(1).filter_map(|row| row.split(',').nth(number)?.parse().ok()).collect()
}

/// Mean of a group of equal frequencies, split by the mesh's lesser symmetry.
fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
