//! Checks of the repository that tests and chores share.

pub mod bill_of_materials;
pub mod layers;
pub mod site;
pub mod versions;
pub mod words;
