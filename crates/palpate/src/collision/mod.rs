//! Collision detection: which points of which surfaces are, or may come, in contact within a step.
//!
//! Broad phase → narrow phase (tip, obstacle, pair) → contact cache. The surfaces deform; their bounding spheres follow
//! (`surface::sphere_tree`), and node positions are computed on demand (`deformed_surface`).

mod broad_phase;
mod candidate;
mod contact;
mod contact_cache;
mod context;
mod deformed_surface;
mod level_of_detail;
mod narrow_phase;
mod node_cache;
mod parameters;
mod point_budget;
mod proximity;
mod residual_bounds;
mod triangle_cache;

pub(crate) use candidate::{CandidateSide, ContactCandidate};
pub use contact::{Collider, Grasp};
pub(crate) use contact::{Contact, ContactId, ContactLaw, FeatureId, OtherSide};
pub(crate) use contact_cache::match_contacts;
pub(crate) use context::{CollisionCaches, CollisionContext, CollisionScene, CollisionWorkspace};
pub(crate) use deformed_surface::MAX_TIP_CONTACTS;
pub(crate) use level_of_detail::Levels;
pub(crate) use narrow_phase::TipPair;
