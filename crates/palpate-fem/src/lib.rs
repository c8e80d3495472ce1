//! Mesh in, recording out: the finite elements behind palpate.
//!
//! The way is [`record::record`]: a checked [`mesh::Mesh`], elements and [`assembly`], the [`system`] with its
//! sparse factor, the lowest [`modes`], the [`residual`] compliance, and the [`certificate`].
//! Small strain, linear isotropic elasticity; SI units throughout.

pub mod assembly;
pub mod certificate;
pub mod discretisation;
pub mod element;
pub mod factor;
pub mod material;
pub mod mesh;
pub mod modes;
pub mod progress;
pub mod record;
pub mod reference;
pub mod residual;
pub mod system;
pub mod table;
pub mod transient;
