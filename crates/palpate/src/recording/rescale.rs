//! Recordings of the same body in another material, without FEM.
//!
//! With the same Poisson's ratio the stiffness matrix is proportional to Young's modulus, K′ = a·K, and the mass matrix to the density,
//! M′ = b·M. Then
//!
//! ```text
//! ω′ = ω·√(a/b)    Φ′ = Φ/√b    S′ = S/a
//! ```
//!
//! exactly, and the damping law gives ζ′ = ζ(ω′).

use super::residual::ResidualCompliance;
use super::{
    Certificate, Damping, EMBEDDED_FORMAT_VERSIONS, FORMAT_VERSION, MassProperties, Material, Recording,
    Support,
};
use crate::error::{Error, RecordingError};
use alloc::string::String;
use libm::sqrt;

impl Recording {
    /// Whether [`rescaled`](Self::rescaled) applies: a free body of one isotropic material.
    pub fn is_rescalable(&self) -> bool {
        self.rescalable_material().is_ok()
    }

    /// The one material of a free body.
    fn rescalable_material(&self) -> Result<&Material, RecordingError> {
        let refused = |reason: &str| Err(RecordingError::NotRescalable { reason: String::from(reason) });
        if self.metadata.support != Support::Free {
            return refused("it has fixed nodes, which may stand on springs");
        }
        match self.metadata.materials.as_slice() {
            [material] if material.stiffness_pa.is_none() => Ok(material),
            [_] => refused("its material is anisotropic"),
            _ => refused("it has several materials"),
        }
    }

    /// Recording of the same free body with another Young's modulus [Pa] and density [kg/m³]. Poisson's ratio and the damping law stay. The
    /// certificate stays where the damping is a ratio: there all times scale alike, those of its press too. Mode shapes that are scaled are no
    /// whole steps any more: a compact recording gets full mode shapes.
    ///
    /// # Errors
    /// [`RecordingError::NotRescalable`] for a body with fixed nodes, with springs, of several materials or of an anisotropic one;
    /// [`RecordingError::Inconsistent`] for a number out of its range.
    pub fn rescaled(&self, young_pa: f64, density_kg_m3: f64) -> Result<Self, Error> {
        let material = self.rescalable_material()?;
        let (a, b) = (young_pa / material.young_pa, density_kg_m3 / material.density_kg_m3);
        let mut rescaled = self.clone();
        let metadata = &mut rescaled.metadata;
        (metadata.materials[0].young_pa, metadata.materials[0].density_kg_m3) = (young_pa, density_kg_m3);
        // A number out of its range is refused before it is used.
        metadata.validate()?;
        let MassProperties { mass_kg, inertia_kg_m2, .. } = &mut metadata.mass;
        *mass_kg *= b;
        inertia_kg_m2.iter_mut().flatten().for_each(|entry| *entry *= b);
        let speed = sqrt(a / b);
        metadata.certificate = match metadata.damping {
            Damping::Ratio(_) => metadata.certificate.take().map(|certificate| certificate.faster(speed)),
            Damping::Rayleigh { .. } => None,
        };
        let damping = metadata.damping;
        let modes = &mut rescaled.modes;
        for (omega, zeta) in modes.angular_frequencies.iter_mut().zip(&mut modes.damping_ratios) {
            *omega *= speed;
            *zeta = damping.ratio(*omega);
        }
        if b != 1.0 {
            let [embedded, _] = EMBEDDED_FORMAT_VERSIONS;
            rescaled.metadata.format_version =
                if rescaled.embedding.is_some() { embedded } else { FORMAT_VERSION };
        }
        let modes = &mut rescaled.modes;
        let shape = 1.0 / sqrt(b);
        let of_model = rescaled.embedding.as_mut().map(|embedding| &mut embedding.mode_shapes);
        [Some(&mut modes.mode_shapes), of_model]
            .into_iter()
            .flatten()
            .flatten()
            .for_each(|phi| *phi *= shape);
        rescaled.residual.scale(1.0 / a);
        rescaled.validate()?;
        Ok(rescaled)
    }
}

impl ResidualCompliance {
    /// Multiplies S by a factor.
    fn scale(&mut self, factor: f64) {
        let multiply = |values: &mut [f32], factor: f64| {
            values.iter_mut().for_each(|value| *value = (f64::from(*value) * factor) as f32);
        };
        match self {
            Self::None => {}
            Self::Whole(blocks) => multiply(blocks, factor),
            Self::Quantised(quantised) => multiply(&mut quantised.scales, sqrt(factor)),
            Self::NearField(near) => multiply(&mut near.blocks, factor),
        }
    }
}

impl Certificate {
    /// Certificate of a body whose motion is faster by a factor.
    fn faster(mut self, speed: f64) -> Self {
        self.bandwidth_hz *= speed;
        let event = &mut self.event;
        for time in [&mut event.step_s, &mut event.rise_s, &mut event.duration_s] {
            *time /= speed;
        }
        self
    }
}
