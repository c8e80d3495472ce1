//! Tables of impulse responses R[s] as Zarr v3 stores, which Python reads without palpate.
//!
//! ```text
//! OUT.zarr/                        Zarr group; attributes: step, sampling, hold, units, mesh, material
//!   impulse_response/              (touchable dof, sample, observed dof) [m/N], one shard per block of touchable dofs
//!   touchable_dofs/ observed_dofs/ 3·node + axis, nodes numbered as in the input mesh
//!   observed_positions/            rest positions of the observed nodes [m]
//!   surface_positions/ …           surface of the body, so that the store can be used without a recording
//!   gravity_response/              for a body with fixed nodes: (axis, sample, observed dof) [s²]
//! ```
//!
//! A shard is one object. It is written at once under its name or not at all, so an existing shard is finished. An
//! interrupted recording continues where it stopped, and many machines can write into one store, each its own shards.
//! Within a shard every column is a chunk with compression and a checksum, so a reader loads only the columns it uses.
#![doc = "\n"]
#![doc = include_str!("../README.md")]

mod arrays;
mod attributes;
mod columns;
mod error;
mod load;
mod location;
mod object_storage;
mod shards;
mod table_store;

pub use attributes::{Compression, Number, STORE_VERSION, TableAttributes, TableContent};
pub use error::{StoreError, StoreOperation, TableDifference};
pub use location::Location;
pub use table_store::{Part, TableStore};
