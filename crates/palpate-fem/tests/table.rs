//! The table R[s], two ways: closed form against time integration, identities, selections.

use palpate::{Damping, Sampling};
use palpate_fem::table::{TableMethod, TableParameters, TableRecorder};
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, RecordedBody, ResidualChoice};
use palpate_mesh::box_mesh;
use palpate_testkit::{nodes_where, recorded, undamped};
use std::sync::OnceLock;

const MODES_OF_ALL: usize = 1_000_000;

/// A block with all its modes, recorded once per test process for each order and support.
fn block(order: ElementOrder, fix: bool) -> &'static RecordedBody {
    static BODIES: [OnceLock<RecordedBody>; 4] = [const { OnceLock::new() }; 4];
    let index = 2 * usize::from(order == ElementOrder::Quadratic) + usize::from(fix);
    BODIES[index].get_or_init(|| body(order, RAYLEIGH, fix))
}

fn body(order: ElementOrder, damping: Damping, fix: bool) -> RecordedBody {
    let mesh = box_mesh([0.1, 0.06, 0.05], [3, 2, 2]).expect("a good box");
    let parameters = RecordParameters {
        damping,
        residual: ResidualChoice::None,
        fixed_nodes: nodes_where(&mesh, |place| fix && place.x < -0.049),
        extent: RecordExtent::NoCertificate,
        ..undamped(2e3, 0.4, 200.0, order, MODES_OF_ALL)
    };
    recorded(mesh, &parameters).expect("a good recording")
}

fn parameters(recorded: &RecordedBody, sampling: Sampling, method: TableMethod) -> TableParameters {
    let nodes: Vec<u32> = (0..recorded.nodes().len() as u32).collect();
    TableParameters {
        step_s: 2e-3,
        samples: 60,
        sampling,
        method,
        touchable_nodes: recorded.surface_nodes(),
        observed_nodes: nodes,
    }
}

fn columns(
    recorded: &RecordedBody,
    parameters: &TableParameters,
    range: std::ops::Range<usize>,
) -> Vec<Vec<f64>> {
    TableRecorder::new(recorded, parameters).expect("good parameters").columns(range, 12, &|_| {})
}

fn largest(values: &[Vec<f64>]) -> f64 {
    values.iter().flatten().fold(0.0, |a, b| a.max(b.abs()))
}

fn difference(a: &[Vec<f64>], b: &[Vec<f64>]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).fold(0.0, |worst, (a, b)| worst.max((a - b).abs()))
}

const TRANSIENT: TableMethod = TableMethod::Transient { substeps: 1 };
const RAYLEIGH: Damping = Damping::Rayleigh { alpha: 2.0, beta: 1e-3 };

/// Relative error of time integration with eight substeps [1].
const INTEGRATED: f64 = 1e-4;

/// Order that errors with four and eight substeps show at least: five, less what higher orders add.
const OBSERVED_ORDER: f64 = 4.7;

/// Relative error of solves with condition up to 1e6 [1]: ten of sixteen digits stay.
const SOLVED: f64 = 1e-10;

/// Relative round-off of sums of a few hundred products [1].
const SUMMED: f64 = 1e-12;

#[test]
fn time_integration_comes_to_the_closed_form_of_all_modes_with_order_five() {
    for (order, fix) in
        [(ElementOrder::Linear, false), (ElementOrder::Linear, true), (ElementOrder::Quadratic, false)]
    {
        for sampling in [Sampling::End, Sampling::Mean] {
            let recorded = block(order, fix);
            let of = |method| TableParameters { samples: 20, ..parameters(recorded, sampling, method) };
            let exact = columns(recorded, &of(TableMethod::ClosedForm), 60..72);
            let errors = [4, 8].map(|substeps| {
                let computed = columns(recorded, &of(TableMethod::Transient { substeps }), 60..72);
                difference(&exact, &computed) / largest(&exact)
            });
            let observed = (errors[0] / errors[1]).log2();
            assert!(
                observed > OBSERVED_ORDER && errors[1] < INTEGRATED,
                "{order:?} {fix} {sampling:?}: {errors:?}, order {observed}"
            );
        }
    }
}

#[test]
fn time_integration_without_damping_neither_grows_nor_rings() {
    let recorded = &body(ElementOrder::Linear, Damping::Ratio(0.0), false);
    let parameters = TableParameters { samples: 3000, ..parameters(recorded, Sampling::End, TRANSIENT) };
    let column = &columns(recorded, &parameters, 0..1)[0];
    let width = 3 * parameters.observed_nodes.len();
    let size =
        |from: usize| column[from * width..][..200 * width].iter().fold(0.0_f64, |a, b| a.max(b.abs()));
    assert!(size(2800) < size(0), "{} {}", size(2800), size(0));
}

#[test]
fn the_table_is_reciprocal_and_free_of_rigid_motion() {
    let recorded = block(ElementOrder::Linear, false);
    for method in [TRANSIENT, TableMethod::ClosedForm] {
        let nodes: Vec<u32> = (0..recorded.nodes().len() as u32).collect();
        let parameters =
            TableParameters { touchable_nodes: nodes, ..parameters(recorded, Sampling::End, method) };
        let dofs = 3 * parameters.observed_nodes.len();
        let table = columns(recorded, &parameters, 0..dofs);
        let scale = largest(&table);
        for (i, j, s) in (0..dofs).flat_map(|i| (0..dofs).map(move |j| (i, j, (i + 3 * j) % 60))) {
            let apart = (table[i][s * dofs + j] - table[j][s * dofs + i]).abs();
            assert!(apart < SOLVED * scale, "{method:?} {i} {j} {s}: {apart:e}");
        }
        let fields: Vec<Vec<f64>> = table[4].chunks_exact(dofs).map(<[f64]>::to_vec).collect();
        let elastic = recorded.unreduced().without_rigid_motion(&fields);
        let rigid = difference(&fields, &elastic);
        assert!(rigid < SUMMED * scale, "{method:?}: rigid part {rigid:e}");
    }
}

#[test]
fn columns_do_not_depend_on_how_they_are_put_together() {
    let recorded = block(ElementOrder::Linear, false);
    for method in [TRANSIENT, TableMethod::ClosedForm] {
        let parameters = parameters(recorded, Sampling::End, method);
        let together = columns(recorded, &parameters, 0..30);
        let apart = [0..7, 7..8, 8..30].map(|range| columns(recorded, &parameters, range)).concat();
        assert!(together == apart, "{method:?}");
    }
}

#[test]
fn both_methods_give_the_gravity_response_of_a_fixed_body() {
    let recorded = block(ElementOrder::Linear, true);
    let of = |method| {
        let parameters = parameters(recorded, Sampling::End, method);
        let recorder = TableRecorder::new(recorded, &parameters).expect("good parameters");
        recorder.gravity().expect("a body with fixed nodes")
    };
    let (exact, computed) =
        (vec![of(TableMethod::ClosedForm)], vec![of(TableMethod::Transient { substeps: 8 })]);
    assert!(difference(&exact, &computed) < INTEGRATED * largest(&exact));
    let free = block(ElementOrder::Linear, false);
    let parameters = parameters(free, Sampling::End, TRANSIENT);
    assert!(TableRecorder::new(free, &parameters).expect("good parameters").gravity().is_none());
}

#[test]
fn parameters_out_of_range_are_named() {
    let recorded = body(ElementOrder::Linear, Damping::Ratio(0.05), false);
    let refusal = |change: &dyn Fn(&mut TableParameters)| {
        let mut parameters = parameters(&recorded, Sampling::End, TableMethod::ClosedForm);
        change(&mut parameters);
        TableRecorder::new(&recorded, &parameters).err().map(|e| e.to_string()).unwrap_or_default()
    };
    assert_eq!(
        refusal(&|p| p.step_s = f64::NAN),
        "the table's step is NaN s, expected above 0 and at most 1"
    );
    assert_eq!(refusal(&|p| p.samples = 0), "the table has 0 samples: the duration is shorter than a step");
    assert_eq!(
        refusal(&|p| p.method = TRANSIENT),
        "the same damping ratio for every mode is no damping matrix that can be integrated: use Rayleigh damping \
         (--rayleigh), or the closed form"
    );
}
