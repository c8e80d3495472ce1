//! From a mesh to a recording: identities, closed forms and second routes for the results of `record`.

mod bodies;
mod embedded;
mod plates;
mod records;
mod rescaled;
mod responses;
mod rods;
