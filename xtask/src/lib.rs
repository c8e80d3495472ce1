//! Checks of the repository that tests and chores share.

pub mod layers;
pub mod words;
