//! From a mesh to a recording: identities, closed forms and second routes for what `record` gives.

mod bodies;
mod records;
mod responses;
