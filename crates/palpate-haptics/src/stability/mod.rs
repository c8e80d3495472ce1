//! Which virtual coupling is stable for an object, a device in a hand, a rate and a delay, and by how much.
//!
//! A device's position x, sampled at each update, gives a force of the scene d updates later, which the device holds. In
//! terms of w = 1/z the object gives C, the device in its hand G (both exact for held forces), and the coupling, a
//! compliance within the step, K = k + b·(1 − w)/h. The loop closes where
//!
//! ```text
//! f = x / (C + 1/K)        x = −w^(1+d)·G·f        so        1 + K·H = 0        H = C + w^(1+d)·G
//! ```
//!
//! The coupling is a proportional-derivative controller of H, which has no pole outside the unit circle. So the poles
//! outside are counted by how often 1 + K·H turns about 0 along that circle (Nyquist), and the couplings at which one crosses it
//! are those with real gains and K = −1/H somewhere on the circle (D-decomposition, Neimark 1948). Both are exact for any
//! number of modes. The device's friction and its encoder's steps are left out: friction helps.
//!
//! Passive with any hand it is by Colgate & Schenkel (1997, J. Robot. Syst. 14, 37), eq. (8), with the delay in E = 1/(C + 1/K):
//!
//! ```text
//! device damping ≥ max over θ of  h/2 · Re[(1 − w)·w^d·E] / (1 − cos θ)        = k·h·(d + ½) + b for a wall, C = 0
//! ```

mod closed_loop;
mod gains;
mod place;
mod sampled;

pub use closed_loop::{ClosedLoop, LoopTiming, Margins, SLOWEST_S};
pub use gains::{DefaultCoupling, Limit, default_coupling, stable_damping, stiffest_place, unstable_from};
pub use place::{PlaceResponse, normal_at};
