//! Certificates of bodies with fixed nodes.

use palpate::{Certificate, Damping, Material};
use palpate_fem::{
    ElementOrder, ErrorTarget, RecordError, RecordParameters, RecordedBody, ResidualChoice, SilentProgress,
    record,
};
use palpate_mesh::{Mesh, box_mesh};

fn bar(residual: ResidualChoice, modes: usize) -> (Mesh, RecordParameters) {
    let mesh = box_mesh([0.2, 0.05, 0.05], [8, 2, 2]).expect("a good box");
    let left = mesh.nodes.iter().enumerate().filter(|(_, p)| p.x < -0.099).map(|(node, _)| node as u32);
    let rubber = Material::isotropic(1e5, 0.45, 1100.0);
    let parameters = RecordParameters {
        residual,
        fixed_nodes: left.collect(),
        ..RecordParameters::new(vec![rubber], ElementOrder::Quadratic, modes, Damping::Ratio(0.05))
    };
    (mesh, parameters)
}

fn clamped_bar(residual: ResidualChoice, modes: usize) -> Certificate {
    let (mesh, parameters) = bar(residual, modes);
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

#[test]
fn modes_are_the_fewest_that_keep_the_target() {
    let (mesh, parameters) = bar(ResidualChoice::Automatic, 1);
    let target = ErrorTarget { force_error: Some(0.05), bandwidth_hz: None };
    let body =
        RecordedBody::within(&mesh, &parameters, &target, &mut SilentProgress).expect("it can be kept");
    let modes = body.recording.modes.len();
    let certificate = |modes| {
        let parameters = RecordParameters { modes, ..parameters.clone() };
        let recording = record(mesh.clone(), &parameters, &mut SilentProgress).expect("a good recording");
        recording.metadata.certificate.expect("a certificate")
    };
    assert!(modes >= 100, "the target is too easy to tell anything: {modes}");
    assert!(target.is_kept_by(&certificate(modes)));
    assert!(!target.is_kept_by(&certificate(modes / 2)), "{modes}");

    let mesh = box_mesh([0.1; 3], [2; 3]).expect("a good box");
    let parameters = RecordParameters { fixed_nodes: vec![], order: ElementOrder::Linear, ..parameters };
    let none = ErrorTarget { force_error: None, bandwidth_hz: Some(1e9) };
    let error = RecordedBody::within(&mesh, &parameters, &none, &mut SilentProgress).err();
    assert!(matches!(error, Some(RecordError::TargetMissed { .. })), "{error:?}");
    let wrong = ErrorTarget { force_error: Some(-0.1), bandwidth_hz: None };
    let error = RecordedBody::within(&mesh, &parameters, &wrong, &mut SilentProgress).err();
    assert!(matches!(error, Some(RecordError::Target { .. })), "{error:?}");
}
