//! The energy ledger of one object.
//!
//! ```text
//! kinetic + elastic + residual + potential + coupling
//!     = at the start + input − dissipated − friction − impact + defect
//! ```
//!
//! Input is Σ f·Δx of what the object is in contact with, in world coordinates: devices, obstacles, other objects; for a
//! scene, of devices and obstacles. Friction and impact are what contacts take, across and along their normals.
//! Dissipated is what modal damping takes
//! (a quadratic form, see `response`) and what the residual spring loses when its force jumps,
//! ½·Δfᵀ·S·Δf at least. The defect is what no term explains: round-off of the solver and of the
//! sums; with the paper's update also the error of semi-implicit Euler.

/// Energies [J] of one object, or of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyLedger {
    /// Kinetic energy of rigid motion and modes.
    pub kinetic: f64,
    /// Elastic energy of the modes.
    pub elastic: f64,
    /// Elastic energy of the residual compliance, ½·fᵀ·S·f.
    pub residual: f64,
    /// Energy in the gravity field; 0 at the world's origin.
    pub potential: f64,
    /// Elastic energy of virtual couplings; of a scene, not of an object.
    pub coupling: f64,
    /// Work done on the object at its contacts since the start.
    pub input: f64,
    /// Energy taken by damping since the start.
    pub dissipated: f64,
    /// Energy taken by friction since the start.
    pub friction: f64,
    /// Energy taken by impact since the start: work of contacts that close.
    pub impact: f64,
    /// What the sum above misses since the start.
    pub defect: f64,
}

impl EnergyLedger {
    /// Energy [J] that the object holds now.
    pub fn stored(&self) -> f64 {
        self.kinetic + self.elastic + self.residual + self.potential + self.coupling
    }

    /// Energy [J] that was lost since the start.
    pub fn lost(&self) -> f64 {
        self.dissipated + self.friction + self.impact
    }

    /// All numbers [J] by their names, in the order above.
    pub fn named(&self) -> [(&'static str, f64); 10] {
        [
            ("kinetic", self.kinetic),
            ("elastic", self.elastic),
            ("residual", self.residual),
            ("potential", self.potential),
            ("coupling", self.coupling),
            ("input", self.input),
            ("dissipated", self.dissipated),
            ("friction", self.friction),
            ("impact", self.impact),
            ("defect", self.defect),
        ]
    }

    /// Sum over objects.
    #[must_use]
    pub fn plus(&self, other: &Self) -> Self {
        Self {
            kinetic: self.kinetic + other.kinetic,
            elastic: self.elastic + other.elastic,
            residual: self.residual + other.residual,
            potential: self.potential + other.potential,
            coupling: self.coupling + other.coupling,
            input: self.input + other.input,
            dissipated: self.dissipated + other.dissipated,
            friction: self.friction + other.friction,
            impact: self.impact + other.impact,
            defect: self.defect + other.defect,
        }
    }
}
