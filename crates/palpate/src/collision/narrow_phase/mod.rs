//! Narrow phase: contact candidates of tips, obstacles and other objects with the deformed surface of an object.

mod obstacle;
mod pair;
mod phong_projection;
mod point_surface;
mod refinement;
mod tip;
mod tip_place;

pub(crate) use tip::TipPair;
