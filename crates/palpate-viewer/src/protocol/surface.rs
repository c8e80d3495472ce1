//! Static data of a scene: surfaces and mode shapes.

use super::bytes::Bytes;
use glam::DVec3;
use half::f16;
use palpate::ModalBasis;
use std::f64::consts::TAU;

/// Encoded rest surface: node positions [m, body] and triangles.
pub fn surface_bytes(positions: &[DVec3], triangles: &[[u32; 3]]) -> Vec<u8> {
    let mut bytes = Bytes(Vec::with_capacity(8 + 12 * (positions.len() + triangles.len())));
    bytes.u32(positions.len() as u32);
    bytes.u32(triangles.len() as u32);
    positions.iter().for_each(|position| bytes.vector(*position));
    triangles.iter().flatten().for_each(|corner| bytes.u32(*corner));
    bytes.0
}

/// Largest component [1/√kg] of each mode shape: half floats hold mode shapes scaled to largest component 1.
pub fn mode_scales(modes: &ModalBasis) -> Vec<f64> {
    let mut scales = vec![0.0_f64; modes.len()];
    if !scales.is_empty() {
        for row in modes.mode_shapes.chunks_exact(scales.len()) {
            scales.iter_mut().zip(row).for_each(|(max, phi)| *max = max.max(phi.abs()));
        }
    }
    scales.iter_mut().for_each(|scale| *scale = if *scale > 0.0 { *scale } else { 1.0 });
    scales
}

/// Encoded mode shapes of an object with `nodes` surface nodes, by mode, scaled by [`mode_scales`].
pub fn mode_shapes_bytes(modes: &ModalBasis, nodes: usize) -> Vec<u8> {
    let (m, scales) = (modes.len(), mode_scales(modes));
    let mut bytes = Bytes(Vec::with_capacity(8 + m * (4 + 6 * nodes)));
    bytes.u32(nodes as u32);
    bytes.u32(m as u32);
    modes.angular_frequencies.iter().for_each(|omega| bytes.f32(omega / TAU));
    for (mode, scale) in scales.iter().enumerate() {
        for row in modes.mode_shapes.chunks_exact(m.max(1)) {
            bytes.0.extend_from_slice(&f16::from_f64(row[mode] / scale).to_le_bytes());
        }
    }
    bytes.pad();
    bytes.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mode_shapes_of_heavy_and_light_objects_fit_into_half_floats() {
        for weight in [1e-9, 1e9] {
            let shapes: Vec<f64> = (1..=12).map(|k| f64::from(k) / f64::sqrt(weight)).collect();
            let modes = ModalBasis {
                angular_frequencies: vec![TAU, 2.0 * TAU],
                damping_ratios: vec![0.0; 2],
                mode_shapes: shapes.clone(),
            };
            let bytes = mode_shapes_bytes(&modes, 2);
            assert_eq!(bytes.len(), 8 + 2 * 4 + 2 * 2 * 3 * 2);
            let (halves, _) = bytes[16..].as_chunks::<2>();
            let scales = mode_scales(&modes);
            for (k, half) in halves.iter().enumerate() {
                let (mode, component) = (k / 6, k % 6);
                let sent = f16::from_le_bytes(*half).to_f64() * scales[mode];
                let exact = shapes[2 * component + mode];
                assert!((sent / exact - 1.0).abs() < 5e-4, "{sent} {exact}");
            }
        }
    }
}
