//! Stability of a virtual coupling, with margins, for an object, a device in a hand, an update rate and a delay.
//!
//! The device's position x [m] is sampled at each update. The scene's force f [N] acts d updates later, under a zero-order hold. With
//! w = 1/z, step h [s], the object's compliance C [m/N], the compliance G of device and hand [m/N] (both exact for held forces) and
//! the coupling K = k + b·(1 − w)/h [N/m], the loop is
//!
//! ```text
//! f = x / (C + 1/K)        x = −w^(1+d)·G·f        so        1 + K·H = 0        H = C + w^(1+d)·G
//! ```
//!
//! The coupling is a proportional-derivative controller of H, which has no pole outside the unit circle. The number of unstable
//! closed-loop poles is the winding number of 1 + K·H about 0 along that circle (Nyquist). The couplings at which a pole crosses it
//! have real gains and K = −1/H somewhere on the circle (D-decomposition, Neimark 1948). Both are exact for any number of modes.
//! The device's friction and encoder are left out: friction helps.
//!
//! Passivity with any hand, by Colgate & Schenkel (1997, J. Robot. Syst. 14, 37), eq. (8), with the delay in E = 1/(C + 1/K):
//!
//! ```text
//! device damping ≥ max over θ of  h/2 · Re[(1 − w)·w^d·E] / (1 − cos θ)        = k·h·(d + ½) + b for a wall, C = 0
//! ```

mod closed_loop;
mod discrete_oscillator;
mod gains;
mod point_response;

pub use closed_loop::{ClosedLoop, LoopTiming, Margins, SLOWEST_GROWTH_S};
pub use gains::{
    DefaultCoupling, StiffnessLimit, critical_stiffness, default_coupling, stable_damping, stiffest_point,
};
pub use point_response::{PointResponse, normal_at};
