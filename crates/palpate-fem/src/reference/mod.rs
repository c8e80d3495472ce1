//! The unreduced finite element solution of a recorded body, to verify recordings against.
//!
//! A recording is a reduced model: a few modes and the residual compliance. This module gives the unreduced one: static
//! displacements under any load, all modes, and substitutes for the truncated modes at single nodes. Fields and loads
//! are vectors of one value per degree of freedom, 3·node + axis, numbered as in [`RecordedBody`](crate::RecordedBody).

mod unreduced;

pub use crate::krylov::LoadedMode;
pub use crate::modes::ElasticModes;
pub use unreduced::{TruncatedResponse, UnreducedModel};
