//! Haptic devices in a scene: tip, proxy (god-object) and virtual coupling.
//!
//! The proxy is where the device would be if it could not enter an object (Zilles & Salisbury 1995, IROS, 146). A virtual
//! coupling with stiffness k [N/m] and damping d [N·s/m] ties it to the device. It is part of the solver's compliance: with
//! e the stretch, device minus proxy, a force f that is held over the step h gives
//!
//! ```text
//! f = k·e⁺ + d·(e⁺ − e)/h        so        e⁺ = (f + d/h·e) / (k + d/h)
//! ```
//!
//! Equations: docs/theory.md (C50), (C51), (C52), (C53).

use crate::error::ModelError;
use crate::surface::SurfacePoint;
use alloc::format;
use glam::DVec3;

/// Spring and damper between a device and its proxy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coupling {
    /// Stiffness k [N/m], positive.
    pub stiffness: f64,
    /// Damping d [N·s/m], not negative.
    pub damping: f64,
}

/// Parameters of a device.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviceParameters {
    /// Radius of the spherical tip [m]; 0 for a point.
    pub tip_radius: f64,
    /// Radius of the contact patch that a touch is spread over [m]; 0 for a point. From about four mesh edges on
    /// the force does not show the mesh.
    pub patch_radius: f64,
    /// Coulomb's coefficient of friction of the tip [1].
    pub friction: f64,
    /// Virtual coupling between device and proxy; none makes it rigid.
    pub coupling: Option<Coupling>,
}

impl Default for DeviceParameters {
    /// A frictionless point, rigidly coupled.
    fn default() -> Self {
        Self { tip_radius: 0.0, patch_radius: 0.0, friction: 0.0, coupling: None }
    }
}

impl DeviceParameters {
    /// Check the ranges of all numbers.
    pub(crate) fn check(&self, device: usize) -> Result<(), ModelError> {
        let fail = |what| Err(ModelError::Device { device, what });
        for (name, value) in [("tip_radius", self.tip_radius), ("patch_radius", self.patch_radius)] {
            if !(0.0..1e6).contains(&value) {
                return fail(format!("{name} is {value} m, expected a number not below 0"));
            }
        }
        if !(0.0..1e6).contains(&self.friction) {
            return fail(format!("friction is {}, expected a number not below 0", self.friction));
        }
        match self.coupling {
            Some(Coupling { stiffness, .. }) if !(stiffness > 0.0 && stiffness < 1e18) => {
                fail(format!("coupling stiffness is {stiffness} N/m, expected a positive number"))
            }
            Some(Coupling { damping, .. }) if !(0.0..1e18).contains(&damping) => {
                fail(format!("coupling damping is {damping} N·s/m, expected a number not below 0"))
            }
            _ => Ok(()),
        }
    }

    /// Energy [J] that the coupling stores at a stretch [m].
    pub(crate) fn stored(&self, stretch: DVec3) -> f64 {
        0.5 * self.coupling.map_or(0.0, |coupling| coupling.stiffness) * stretch.length_squared()
    }
}

/// State of a device between steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct DeviceState {
    /// Whether it touched or held in the last step.
    pub(crate) active: bool,
    /// Interface point at the start and at the end of the step [m, world].
    pub(crate) start: DVec3,
    pub(crate) target: DVec3,
    /// Proxy at the start of the step [m, world].
    pub(crate) proxy: DVec3,
    /// Stretch of the coupling that its damper leaves at the end of the step without force [m].
    relaxed_stretch: DVec3,
    /// Compliance of the coupling within a step, 1/(k + d/h) [m/N].
    pub(crate) compliance: f64,
    /// Force on the objects [N, world].
    pub(crate) force: DVec3,
    /// Where its tip touched last, until it leaves the surface or the scene.
    pub(crate) last_touch: Option<LastTouch>,
    /// Where its prescribed force acts.
    pub(crate) prescribed: Option<PrescribedForce>,
}

/// Point of an object that a prescribed force acts on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PrescribedForce {
    pub(crate) object: usize,
    /// Slot of its contact point.
    pub(crate) slot: usize,
}

/// Contact of a tip that carried force, the strongest of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct LastTouch {
    pub(crate) object: usize,
    pub(crate) point: SurfacePoint,
    /// Contact force [N].
    pub(crate) force: f64,
}

impl DeviceState {
    pub(crate) fn new() -> Self {
        let zero = DVec3::ZERO;
        Self {
            active: false,
            start: zero,
            target: zero,
            proxy: zero,
            relaxed_stretch: zero,
            compliance: 0.0,
            force: zero,
            last_touch: None,
            prescribed: None,
        }
    }

    /// Begin a step that ends with the device at `target`. A device that was inactive starts at `from`.
    pub(crate) fn begin(&mut self, parameters: &DeviceParameters, step_s: f64, target: DVec3, from: DVec3) {
        if !self.active {
            (self.active, self.start, self.proxy) = (true, from, from);
        }
        self.target = target;
        self.force = DVec3::ZERO;
        (self.relaxed_stretch, self.compliance) = match parameters.coupling {
            Some(coupling) => {
                let rate = coupling.damping / step_s;
                let sum = coupling.stiffness + rate;
                ((self.start - self.proxy) * (rate / sum), 1.0 / sum)
            }
            None => (DVec3::ZERO, 0.0),
        };
    }

    /// Proxy at the end of the step under the present force [m, world].
    pub(crate) fn proxy_under_force(&self) -> DVec3 {
        self.target - self.relaxed_stretch - self.force * self.compliance
    }
}
