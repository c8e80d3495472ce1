//! Rods that slide along x, on springs or held at one end, against the wave equation of a rod.

use crate::bodies::{block, nodes_where, parameters, recorded, refusal};
use palpate_fem::{
    ElementOrder, GroundSprings, HeldNodes, RecordExtent, RecordParameters, ResidualChoice, Supports,
};
use palpate_testkit::isotropic;
use std::f64::consts::{PI, TAU};

const LENGTH: f64 = 0.2;
const YOUNG: f64 = 2e4;
const DENSITY: f64 = 1000.0;

/// Quadratic elements of a sixteenth of the length: (kh)⁴/720 for the second mode, with k the wave number.
const TOLERANCE: f64 = 1e-4;

fn rod(supports: impl Fn(Vec<u32>, Vec<u32>) -> Supports) -> (palpate_mesh::Mesh, RecordParameters) {
    let mesh = block([LENGTH, 0.02, 0.02], [16, 2, 2]);
    let low = nodes_where(&mesh, |p| p.x < -0.499 * LENGTH);
    let all = nodes_where(&mesh, |_| true);
    let parameters = RecordParameters {
        materials: vec![isotropic(YOUNG, 0.0, DENSITY)],
        supports: supports(low, all),
        extent: RecordExtent::NoCertificate,
        residual: ResidualChoice::None,
        ..parameters(ElementOrder::Quadratic, 2)
    };
    (mesh, parameters)
}

/// ωL/c of the two lowest modes.
fn phases((mesh, parameters): (palpate_mesh::Mesh, RecordParameters)) -> Vec<f64> {
    let modes = recorded(mesh, &parameters).recording.modes;
    modes.angular_frequencies.iter().map(|omega| omega * LENGTH / (YOUNG / DENSITY).sqrt()).collect()
}

fn sliding(all: Vec<u32>) -> HeldNodes {
    HeldNodes { nodes: all, axes: [false, true, true] }
}

#[test]
fn a_rod_held_at_one_end_has_odd_quarter_waves() {
    let found = phases(rod(|low, all| Supports {
        held: vec![sliding(all), HeldNodes { nodes: low, axes: [true, false, false] }],
        ..Supports::default()
    }));
    for (found, exact) in found.iter().zip([PI / 2.0, 3.0 * PI / 2.0]) {
        assert!((found / exact - 1.0).abs() < TOLERANCE, "{found} {exact}");
    }
}

#[test]
fn a_rod_on_a_spring_has_the_roots_of_its_frequency_equation() {
    // p·tan(p) = kL/E with p = ωL/c: free at the high end, u = cos(p(1 − x/L)), and E·u' = k·u at the low end.
    for ratio in [0.1, 3.0] {
        let stiffness_n_per_m3 = ratio * YOUNG / LENGTH;
        let found = phases(rod(|nodes, all| Supports {
            held: vec![sliding(all)],
            springs: vec![GroundSprings { nodes, axes: [true, false, false], stiffness_n_per_m3 }],
        }));
        for (mode, found) in found.iter().enumerate() {
            // One root between each zero of p·sin(p) − ratio·cos(p) at n·π and the next at n·π + π/2.
            let (mut low, mut high) = (mode as f64 * PI, mode as f64 * PI + PI / 2.0);
            for _ in 0..60 {
                let p = 0.5 * (low + high);
                if p.sin() * p < ratio * p.cos() && mode == 0 || (p.tan() * p < ratio && mode > 0) {
                    low = p;
                } else {
                    high = p;
                }
            }
            assert!((found / low - 1.0).abs() < TOLERANCE, "{ratio} {found} {low}");
        }
    }
}

#[test]
fn a_stiff_block_bounces_on_its_springs() {
    // Springs under the whole bottom: ω² = k·A/m for the bounce along z, whatever the block turns.
    let mesh = block([0.1, 0.1, 0.05], [4, 4, 2]);
    let nodes = nodes_where(&mesh, |p| p.z < -0.0249);
    let stiffness_n_per_m3 = 1e5;
    let parameters = RecordParameters {
        materials: vec![isotropic(1e10, 0.3, DENSITY)],
        supports: Supports {
            springs: vec![GroundSprings { nodes, axes: [true; 3], stiffness_n_per_m3 }],
            ..Supports::default()
        },
        ..parameters(ElementOrder::Quadratic, 6)
    };
    let recording = recorded(mesh, &parameters).recording;
    let bounce = (stiffness_n_per_m3 / (DENSITY * 0.05)).sqrt();
    let frequencies = &recording.modes.angular_frequencies;
    assert!(frequencies.iter().any(|omega| (omega / bounce - 1.0).abs() < 1e-5), "{frequencies:?} {bounce}");
    // Two sway, two rock, one turns and one bounces; the block itself is far above.
    assert!(frequencies[5] < TAU * 30.0);
    assert_eq!(recording.metadata.support, palpate::Support::Fixed);
    // The whole bottom with its mid-edge nodes: 25 corners, 40 middles of sides and 16 of diagonals.
    assert_eq!(recording.metadata.mesh.fixed_nodes, 81);
}

#[test]
fn supports_that_leave_a_motion_or_hold_nothing_are_refused() {
    let (mesh, parameters) = rod(|low, all| Supports {
        held: vec![
            HeldNodes { nodes: low, axes: [true, false, false] },
            HeldNodes { nodes: all, axes: [false, true, false] },
        ],
        ..Supports::default()
    });
    assert!(
        refusal(mesh, &parameters)
            .starts_with("the supports leave the body free to move or to turn as a whole")
    );
    let springs = |stiffness_n_per_m3: f64, nodes: fn(Vec<u32>) -> Vec<u32>| {
        let (mesh, parameters) = rod(|low, _| Supports {
            springs: vec![GroundSprings { nodes: nodes(low), axes: [true; 3], stiffness_n_per_m3 }],
            ..Supports::default()
        });
        refusal(mesh, &parameters)
    };
    assert_eq!(springs(-1.0, |low| low), "spring stiffness is -1 N/m³, expected a positive number");
    assert!(springs(1.0, |low| low[..2].to_vec()).starts_with("the nodes on springs hold no whole face"));
}
