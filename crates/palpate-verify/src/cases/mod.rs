//! The cases, one per file.

mod adversarial;
mod aligned_faces;
mod bounce;
mod clamped_bar;
mod closed_loop;
mod compliance;
mod contact_samples;
mod drop_block;
mod fingers_hold;
mod frequencies;
mod friction;
mod hertz_indentation;
mod impulse_response;
mod peak_force;
mod pinch;
mod pinch_lift;
mod prescribed_force;
mod press;
mod residual_relaxation;
mod rigid_motion;
mod shaken_base;
mod shaken_block;
mod sphere;
mod stack;

use crate::case::Case;

/// All cases, quick ones first.
pub const CASES: &[Case] = &[
    Case {
        name: "flight",
        about: "free flight and torque-free spin against conservation laws",
        compute: rigid_motion::flight,
    },
    Case {
        name: "momentum",
        about: "a held force gives momentum f·h and angular momentum r×f·h",
        compute: rigid_motion::momentum,
    },
    Case {
        name: "energy",
        about: "energy balance of every step under random hands that jump, let go and grasp again",
        compute: rigid_motion::energy,
    },
    Case {
        name: "identities",
        about: "ΦᵀMΦ = I, reciprocity, S positive semi-definite, two routes to the modes",
        compute: compliance::identities,
    },
    Case {
        name: "cube",
        about: "the paper's cube with linear elements against the table of its frequencies",
        compute: frequencies::paper_cube,
    },
    Case {
        name: "continuum",
        about: "quadratic elements against the continuum's frequencies and the exact Lamé mode",
        compute: frequencies::continuum,
    },
    Case {
        name: "sphere",
        about: "free spheres against the roots of their frequency equations",
        compute: sphere::free_vibrations,
    },
    Case {
        name: "compliance",
        about: "static and instantaneous compliance of points of the paper's cube",
        compute: compliance::points,
    },
    Case {
        name: "pinch",
        about: "pinching the paper's cube against the solution with all 6585 modes",
        compute: pinch::pinch,
    },
    Case {
        name: "relaxation",
        about: "held points of a damped cube moved quickly, 200 modes and S against all modes",
        compute: residual_relaxation::residual_relaxation,
    },
    Case {
        name: "peak-force",
        about: "certified peak force errors against bodies with all their modes: 54 cases, one to three held places",
        compute: peak_force::peak_force,
    },
    Case {
        name: "impulse",
        about: "a point's impulse response by time integration against all 6585 modes of the paper's cube",
        compute: impulse_response::impulse_response,
    },
    Case {
        name: "shaken-block",
        about: "block with ν = 0 shaken at both ends against 2EAk·tan(kL/2)·u₀",
        compute: shaken_block::shaken_block,
    },
    Case {
        name: "prescribed-force",
        about: "bar with ν = 0, one end fixed, under a force F·sin ωt at the other against F·tan(kL)/(EAk)",
        compute: prescribed_force::prescribed_force,
    },
    Case {
        name: "clamped-bar",
        about: "square bar between two clamps against EA/L·u, GJ/L·θ and EI/L·θ",
        compute: clamped_bar::clamped_bar,
    },
    Case {
        name: "shaken-base",
        about: "bar with ν = 0 whose base is shaken along it against the transmissibility 1/cos(kL)",
        compute: shaken_base::shaken_base,
    },
    Case {
        name: "bounce",
        about: "the paper's cube falls 5 cm on a frictionless floor, against all 6585 modes; and lies on it",
        compute: bounce::bounce,
    },
    Case {
        name: "bounce-many-modes",
        about: "the same fall with 1200 modes, as many as the rebound needs at every step",
        compute: bounce::bounce_many_modes,
    },
    Case {
        name: "places",
        about: "cubes and a ball that lie, fall and lean, and cubes on one another, on fewer places than they have nodes",
        compute: contact_samples::contact_samples,
    },
    Case {
        name: "friction",
        about: "a block begins to slide at tan θ = μ, and stops after v²/(2μg)",
        compute: friction::friction,
    },
    Case {
        name: "press",
        about: "a finger of given radius feels the same on three meshes, as on a finer one",
        compute: press::press,
    },
    Case {
        name: "hertz",
        about: "a rigid ball pressed into an elastic block against Hertz's law",
        compute: hertz_indentation::indentation,
    },
    Case {
        name: "pinch-lift",
        about: "two fingers pinch a cube, lift, shake and throw it",
        compute: pinch_lift::pinch_lift,
    },
    Case {
        name: "drop-block",
        about: "a block with ν = 0 dropped flat: force ρcvA for 2L/c, and it leaves as it came",
        compute: drop_block::drop_block,
    },
    Case { name: "stack", about: "two cubes rest on one another for a minute", compute: stack::stack },
    Case {
        name: "faces",
        about: "flat faces on one another: St Venant's two bars; cubes on cubes, aligned, shifted and turned",
        compute: aligned_faces::aligned_faces,
    },
    Case {
        name: "fingers-hold",
        about: "a finger that sticks against a hand that holds",
        compute: fingers_hold::fingers_hold,
    },
    Case {
        name: "closed-loop",
        about: "device, hand, rate and delay: where the loop begins to swing, and what the controller leaves of it",
        compute: closed_loop::study,
    },
    Case {
        name: "adversarial",
        about: "a million steps of random hands on five bodies: no energy comes out, and nothing gets stuck",
        compute: adversarial::adversarial,
    },
];
