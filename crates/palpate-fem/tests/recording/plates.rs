//! Thin plates of one layer of cells against plate theory.

use crate::bodies::{parameters, recorded};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, ResidualChoice};
use palpate_mesh::{CellSplit, split_box_mesh};
use palpate_testkit::isotropic;
use std::f64::consts::TAU;

const SIDE: f64 = 0.2;
const THICKNESS: f64 = 2e-3;

/// λ = ω·a²·√(ρh/D) of a free square plate with ν = 0.3 (Leissa, The free vibration of rectangular plates, J. Sound Vib. 31, 1973, table C4).
const LEISSA: [f64; 5] = [13.489, 19.789, 24.432, 35.024, 35.024];

fn lambdas(split: CellSplit) -> Vec<f64> {
    let (young, poisson, density) = (7e9, 0.3, 2700.0);
    let parameters = RecordParameters {
        materials: vec![isotropic(young, poisson, density)],
        extent: RecordExtent::NoCertificate,
        residual: ResidualChoice::None,
        ..parameters(ElementOrder::Quadratic, 5)
    };
    let mesh = split_box_mesh([SIDE, SIDE, THICKNESS], [16, 16, 1], split).expect("a good plate");
    let modes = recorded(mesh, &parameters).recording.modes;
    let rigidity = young * THICKNESS.powi(3) / (12.0 * (1.0 - poisson * poisson));
    let scale = SIDE * SIDE * (density * THICKNESS / rigidity).sqrt();
    let lambdas: Vec<f64> = modes.angular_frequencies.iter().map(|omega| omega * scale).collect();
    assert!(lambdas[0] < TAU * 10.0);
    lambdas
}

#[test]
fn plates_of_six_tetrahedra_per_cell_vibrate_by_plate_theory_and_those_of_five_do_not() {
    // The two modes that plate theory has at one frequency are apart by the direction of the diagonals: 1.3 % at 16 cells.
    for (found, exact) in lambdas(CellSplit::Six).iter().zip(LEISSA) {
        assert!((found / exact - 1.0).abs() < 0.02, "{found} {exact}");
    }
    let five = lambdas(CellSplit::Five);
    assert!(five[3] / LEISSA[3] > 1.1, "{five:?}");
}
