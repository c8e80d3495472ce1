//! A struck bar that a soft hand takes: at a node of its first mode it rings on, at an antinode it is quiet.

use crate::listening::amplitude;
use crate::studio::{Hold, Strike, Studio};
use palpate::Coupling;
use palpate::glam::DVec3;
use palpate_sound::SoundParameters;
use palpate_testkit::{BAR_SIZE_M, aluminium_bar};
use std::f64::consts::TAU;

/// Hand of a soft grip.
const HAND: Coupling = Coupling { stiffness: 200.0, damping: 5.0 };

/// Step [s]: seven to a period of the first mode, so that the hand damps it as a hand does.
const STEP_S: f64 = 0.25e-3;

/// Node of the first mode of a free bar, from its end [1, of its length].
const NODE: f64 = 0.2242;

/// Amplitude of the first partial around 0.5 s after a blow, held at a place along the bar [1, of its length] from 0.1 s on; free without.
fn first_partial(place: Option<f64>) -> f64 {
    let bar = aluminium_bar().expect("a bar");
    let [length, thickness, width] = BAR_SIZE_M;
    let end = DVec3::new(0.5 * length, 0.5 * thickness, 0.0);
    let strike = Strike { at: end, force: DVec3::NEG_Y * 5.0, duration_s: 1e-3 };
    // On the neutral plane of the flank.
    let hold =
        place.map(|place| Hold { at: DVec3::new((place - 0.5) * length, 0.0, 0.5 * width), from_s: 0.1 });
    let mut studio = Studio::new(&bar, STEP_S, &SoundParameters::default(), Some(HAND));
    studio.run(&bar, &strike, hold.as_ref(), 0.6, |_| {});
    amplitude(&studio.samples[19_200..28_800], bar.modes.angular_frequencies[0] / TAU)
}

#[test]
fn held_at_a_node_it_rings_on_and_at_an_antinode_it_is_quiet() {
    let (free, node, middle) = (first_partial(None), first_partial(Some(NODE)), first_partial(Some(0.5)));
    assert!(free > 1e-3, "{free}");
    println!("free {free:.5}, at the node {node:.5}, in the middle {middle:.2e}");
    assert!(node > 0.5 * free, "{free} {node}");
    assert!(middle < 0.02 * free, "{free} {middle}");
}
