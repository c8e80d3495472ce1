//! Energy ledger of one object.
//!
//! ```text
//! kinetic + elastic + residual + potential + coupling
//!     = at the start + input − dissipated − friction − impact + defect
//! ```
//!
//! Input is the work Σ f·Δx [J] of the other sides of the object's contacts, in world coordinates: devices, obstacles, other
//! objects; for a scene, of devices and obstacles. Friction and impact are the energies that contacts dissipate across and
//! along their normals. Dissipated is the energy loss of modal damping (a quadratic form, `response::oscillator`) and of the
//! residual compliance (`response::sampled_residual`). The defect is the imbalance of these terms: round-off of the
//! solver and of the sums; with the paper's update also the error of semi-implicit Euler.
//!
//! Equations: docs/theory.md (C47), (C48).

/// Energies [J] of one object, or of a scene.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct EnergyLedger {
    /// Kinetic energy of rigid motion and modes [J].
    pub kinetic: f64,
    /// Elastic energy of the modes [J].
    pub elastic: f64,
    /// Elastic energy of the residual compliance [J], ½·fᵀ·S·f under constant forces.
    pub residual: f64,
    /// Potential energy in the gravity field [J]; 0 at the world's origin.
    pub potential: f64,
    /// Elastic energy of virtual couplings [J]; of a scene, not of an object.
    pub coupling: f64,
    /// Work on the object at its contacts since the start [J].
    pub input: f64,
    /// Energy dissipated by damping since the start [J].
    pub dissipated: f64,
    /// Energy dissipated by friction since the start [J].
    pub friction: f64,
    /// Energy dissipated by impact since the start [J]: work of closing contacts.
    pub impact: f64,
    /// Imbalance of the terms above since the start [J].
    pub defect: f64,
}

impl EnergyLedger {
    /// Stored energy [J].
    pub fn stored(&self) -> f64 {
        self.kinetic + self.elastic + self.residual + self.potential + self.coupling
    }

    /// Energy dissipated by damping, friction and impact since the start [J].
    pub fn lost(&self) -> f64 {
        self.dissipated + self.friction + self.impact
    }

    /// All terms [J] with their names, in the order of the fields.
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
