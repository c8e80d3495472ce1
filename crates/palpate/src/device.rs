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
//! A tip that appears, or ends up, inside an object is let out: the proxy is moved to the surface, and the interface point with
//! it, so that nothing is stretched. The offset o of the interface point from the device then decays, critically damped:
//!
//! ```text
//! o″ + 2/T·o′ + o/T² = 0
//! ```
//!
//! Equations: docs/theory.md (C50), (C51), (C52), (C53), (C71), (C72).

use crate::error::ModelError;
use crate::surface::SurfacePoint;
use alloc::format;
use glam::DVec3;

/// Time constant T with which tips and objects are let out of what they are inside of [s]: that of MuJoCo's contacts by default.
pub(crate) const LET_OUT_S: f64 = 0.02;

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
    /// Radius of the contact patch that a touch is spread over [m]; 0 for a point. From about three mesh edges on
    /// (six with linear elements) the force does not show the mesh.
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
    /// Interface point at the start and at the end of the step [m, world]: the device's position and the offset.
    pub(crate) start: DVec3,
    pub(crate) target: DVec3,
    /// Offset of the interface point from the device, at the start and at the end of the step [m, world], and its rate [m/s].
    pub(crate) offset: [DVec3; 2],
    offset_rate: DVec3,
    /// Whether its proxy may be inside an object without contact, and has to be let out.
    pub(crate) may_be_inside: bool,
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
            offset: [zero; 2],
            offset_rate: zero,
            may_be_inside: false,
            proxy: zero,
            relaxed_stretch: zero,
            compliance: 0.0,
            force: zero,
            last_touch: None,
            prescribed: None,
        }
    }

    /// Activate a device that was inactive, with proxy and interface point at `from` [m, world].
    pub(crate) fn activate(&mut self, from: DVec3) {
        (self.active, self.start, self.proxy) = (true, from, from);
        (self.offset, self.offset_rate) = ([DVec3::ZERO; 2], DVec3::ZERO);
    }

    /// Move proxy and interface point out of an object in a step that has begun [m, world]: the stretch stays.
    pub(crate) fn let_out(&mut self, shift: DVec3) {
        for point in [&mut self.start, &mut self.target, &mut self.proxy] {
            *point += shift;
        }
        self.offset.iter_mut().for_each(|offset| *offset += shift);
    }

    /// Begin a step that ends with the device at `position` [m, world].
    pub(crate) fn begin(&mut self, parameters: &DeviceParameters, step_s: f64, position: DVec3) {
        // o = (a + b·t)·e^(−t/T)
        let (a, b) = (self.offset[1], self.offset_rate + self.offset[1] / LET_OUT_S);
        self.offset = [a; 2];
        if (a, b) != (DVec3::ZERO, DVec3::ZERO) {
            let decay = libm::exp(-step_s / LET_OUT_S);
            self.offset[1] = (a + b * step_s) * decay;
            self.offset_rate = b * decay - self.offset[1] / LET_OUT_S;
        }
        self.target = position + self.offset[1];
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
