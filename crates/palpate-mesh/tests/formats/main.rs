//! Files of every format, written here, read through the front door; whole and damaged.

mod body;
mod damage;
mod decks;
mod gltf;
mod meshb;
mod named;
mod repairs;
mod solids;
mod surfaces;
mod vtu;
