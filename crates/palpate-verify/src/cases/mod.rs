//! The cases, one per file.

mod adversarial;
mod aligned_faces;
mod ball_between_planes;
mod block_impact;
mod bodies;
mod bounce;
mod boussinesq;
mod built_in_scenes;
mod cantilever;
mod clamped_bar;
mod closed_loop;
mod compliance;
mod contact_samples;
mod drop_block;
mod embedded;
mod fingers_hold;
mod frequencies;
mod friction;
mod hertz_indentation;
mod impulse_response;
mod let_out;
mod peak_force;
mod pinch;
mod pinch_lift;
mod prescribed_force;
mod press;
mod residual_relaxation;
mod rigid_motion;
mod rolling_ball;
mod shaken_base;
mod shaken_block;
mod sphere;
mod spinning_block;
mod stack;
mod tables;

use crate::case::Case;

/// All cases, quick ones first: [`run`](crate::run) begins with both ends.
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
        name: "spin",
        about: "a block that spins without torque against Jacobi's elliptic functions",
        compute: spinning_block::spinning_block,
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
        about: "certified peak force errors against bodies with all their modes: free and fixed, one to three held places",
        compute: peak_force::held,
    },
    Case {
        name: "peak-force-touched",
        about: "the same with one to three fingers that press patches in",
        compute: peak_force::touched,
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
        name: "cantilever",
        about: "sag of a cantilever, at once and settled, and the force of its tip, against Timoshenko's beam",
        compute: cantilever::cantilever,
    },
    Case {
        name: "boussinesq",
        about: "a footprint pressed into ever larger blocks against Boussinesq's half-space",
        compute: boussinesq::boussinesq,
    },
    Case {
        name: "ball-between-planes",
        about: "an elastic ball pressed between two planes against Hertz's law with the ball's finite size",
        compute: ball_between_planes::ball_between_planes,
    },
    Case {
        name: "rolling-ball",
        about: "a ball that spins on the spot (3πμNa/16), slides until it rolls (5/7 of its speed), and rolls on",
        compute: rolling_ball::rolling_ball,
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
    Case {
        name: "block-impact",
        about: "blocks with ν = 0 dropped flat with the usual 200 modes: energy that stays, and contacts that begin at a gap of round-off",
        compute: block_impact::block_impact,
    },
    Case { name: "stack", about: "two cubes rest on one another for a minute", compute: stack::stack },
    Case {
        name: "faces",
        about: "flat faces on one another: St Venant's two bars; cubes on cubes and under boxes",
        compute: aligned_faces::aligned_faces,
    },
    Case {
        name: "tables",
        about: "six bodies thrown, on one another and pressed, by convolution with tables against the modal form",
        compute: tables::tables,
    },
    Case {
        name: "embedded",
        about: "fine surfaces embedded in coarse tetrahedra, and curved boundaries, against tetrahedra of half the size",
        compute: embedded::embedded,
    },
    Case {
        name: "let-out",
        about: "600 tips that appear inside five bodies: none stays inside, and none strikes",
        compute: let_out::let_out,
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
        name: "built-in-scenes",
        about: "built-in scenes for a minute alone, and for one with random pointers: in reach, in shape, energies in order",
        compute: built_in_scenes::built_in_scenes,
    },
    Case {
        name: "adversarial",
        about: "a million steps of random hands on five bodies: no energy comes out, and nothing gets stuck",
        compute: adversarial::adversarial,
    },
    Case {
        name: "bodies",
        about: "a set of bodies that rest, slide, roll, land, are punched, pinched and stacked: nothing sinks",
        compute: bodies::bodies,
    },
];
