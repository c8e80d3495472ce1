//! Certificates of bodies with fixed nodes.

use palpate::{Certificate, Damping, Material};
use palpate_fem::mesh::box_mesh;
use palpate_fem::{ElementOrder, RecordExtent, RecordParameters, ResidualChoice, SilentProgress, record};

fn clamped_bar(residual: ResidualChoice, modes: usize) -> Certificate {
    let mesh = box_mesh([0.2, 0.05, 0.05], [8, 2, 2]).expect("a good box");
    let left = mesh.nodes.iter().enumerate().filter(|(_, p)| p.x < -0.099).map(|(node, _)| node as u32);
    let parameters = RecordParameters {
        materials: vec![Material {
            region: String::new(),
            young_pa: 1e5,
            poisson: 0.45,
            density_kg_m3: 1100.0,
        }],
        order: ElementOrder::Quadratic,
        modes,
        damping: Damping::Ratio(0.05),
        residual,
        fixed_nodes: left.collect(),
        source: "bar".into(),
        extent: RecordExtent::Full,
    };
    let recording = record(mesh, &parameters, &mut SilentProgress).expect("a good bar");
    recording.metadata.certificate.expect("a certificate")
}

#[test]
fn fixed_nodes_are_not_sampled() {
    // A sample on the clamp has no compliance: its relative errors would have no bound.
    let certificate = clamped_bar(ResidualChoice::Automatic, 60);
    assert!(certificate.worst_at_m[0] > -0.099, "{certificate:?}");
    assert!(certificate.force_error_max < 0.2, "{certificate:?}");
    assert!(certificate.static_compliance_error_max < 1e-4, "{certificate:?}");
    assert!(certificate.reference_error < certificate.force_error_max, "{certificate:?}");
}

#[test]
fn a_missing_residual_raises_the_errors() {
    let with = clamped_bar(ResidualChoice::Automatic, 20);
    let without = clamped_bar(ResidualChoice::None, 20);
    assert!(without.force_error_max > 3.0 * with.force_error_max, "{with:?} {without:?}");
    assert!(without.static_compliance_error_max > 0.1, "{without:?}");
}
