//! Recordings of embedded surfaces.

use palpate::{EMBEDDED_FORMAT_VERSIONS, Recording};
use palpate_fem::{ElementOrder, Precision, RecordParameters};
use palpate_mesh::SurfaceMesh;

use crate::bodies::*;

/// The boundary of a recorded body, as a surface of its own in the frame of the mesh.
fn boundary(recording: &Recording) -> SurfaceMesh {
    let centre = glam::DVec3::from_array(recording.metadata.mass.center_of_mass_m);
    let surface = &recording.surface;
    SurfaceMesh {
        positions: surface.positions.iter().map(|&position| position + centre).collect(),
        triangles: surface.triangles.clone(),
    }
}

#[test]
fn a_surface_that_is_the_boundary_has_the_responses_of_the_boundary() {
    for order in [ElementOrder::Linear, ElementOrder::Quadratic] {
        for precision in [Precision::Full, Precision::Compact] {
            let (mesh, fixed) = fixed_bar(order, 15);
            let parameters = RecordParameters { precision, ..fixed };
            let plain = recorded(mesh.clone(), &parameters).recording;
            let parameters = RecordParameters { surface: Some(boundary(&plain)), ..parameters };
            let embedded = recorded(mesh, &parameters).recording;
            assert_eq!(embedded.surface.positions.len(), plain.surface.positions.len());
            let carried = embedded.embedding.as_ref().expect("an embedding");
            assert_eq!(carried.model_nodes, plain.surface.positions.len());
            let shapes = embedded.modes.mode_shapes.iter().zip(&plain.modes.mode_shapes);
            let largest = plain.modes.mode_shapes.iter().map(|phi| phi.abs()).fold(0.0, f64::max);
            // Positions are off by a rounding, and so the weights of other nodes.
            for (a, b) in shapes {
                assert!((a - b).abs() < 1e-6 * largest, "{a} {b}");
            }
            let scale = plain.residual.block(0, 0).x_axis.x.abs().max(plain.residual.block(5, 5).x_axis.x);
            for (i, j) in [(0, 0), (3, 17), (17, 3), (20, 20)] {
                let (a, b) = (embedded.residual_between(i, j), plain.residual.block(i, j));
                assert!(a.abs_diff_eq(b, 1e-5 * scale), "{i} {j}: {a} {b}");
            }
            let gravity = |recording: &Recording| {
                let response = recording.gravity.as_ref().expect("a fixed body");
                response.residual_displacement(9, glam::DVec3::Y)
            };
            assert!(
                (gravity(&embedded) - gravity(&plain)).length() < 1e-6 * gravity(&plain).length().max(1e-9)
            );
            let error = |recording: &Recording| {
                recording.metadata.certificate.as_ref().expect("a certificate").force_error_max
            };
            assert!((error(&embedded) / error(&plain) - 1.0).abs() < 1e-3, "{}", error(&embedded));
            let version = usize::from(precision == Precision::Compact);
            assert_eq!(embedded.metadata.format_version, EMBEDDED_FORMAT_VERSIONS[version]);
            let bytes = embedded.to_bytes().expect("a file");
            assert!(Recording::from_bytes(&bytes).expect("a recording") == embedded);
        }
    }
}

#[test]
fn an_embedded_body_of_another_material_is_the_recording_of_that() {
    let mesh = block([0.1; 3], [3; 3]);
    let plain = recorded(mesh.clone(), &parameters(ElementOrder::Quadratic, 20));
    let surface = Some(boundary(&plain.recording));
    let parameters = RecordParameters { surface, ..parameters(ElementOrder::Quadratic, 20) };
    let own = recorded(mesh, &parameters).recording;
    let material = &own.metadata.materials[0];
    let other = own.rescaled(2.0 * material.young_pa, 3.0 * material.density_kg_m3).expect("a recording");
    assert!(Recording::from_bytes(&other.to_bytes().expect("a file")).expect("a recording") == other);
    let shapes = own.modes.mode_shapes.iter().zip(&other.modes.mode_shapes);
    for (a, b) in shapes {
        assert!((a / 3.0_f64.sqrt() - b).abs() < 1e-12 * (1.0 + a.abs()), "{a} {b}");
    }
}
