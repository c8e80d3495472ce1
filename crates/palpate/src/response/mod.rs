//! How a body answers a force: the modal form of its impulse response.

mod modal;

pub use modal::{HeldOscillator, Oscillation};
pub(crate) use modal::{SampledModes, compliance, project_rows};
