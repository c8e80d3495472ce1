//! The paper's table R[s] as a Zarr v3 store that Python opens without us.
//!
//! ```text
//! OUT.zarr/                        a Zarr group; its attributes say step, sampling, hold, units, mesh, material
//!   impulse_response/              (touchable dof, sample, observed dof) [m/N], one shard per block of touchable dofs
//!   touchable_dofs/ observed_dofs/ 3·node + axis, nodes as in the input mesh
//!   observed_positions/            where the observed nodes are at rest
//!   surface_positions/ …           the body's surface, so that the store can stand alone
//!   gravity_response/              for a body with fixed nodes: (axis, sample, observed dof) [s²]
//! ```
//!
//! A shard is one object, written at once under its name or not at all; what stands there is finished. So
//! a recording that was killed goes on where it was, and many machines may write into one store, each its own
//! shards. Within a shard every column is a chunk of its own, compressed and with a checksum, so a reader touches
//! only the columns that it uses.

mod arrays;
mod attributes;
mod error;
mod location;
mod mapped;
mod object_storage;
mod table_store;

pub use attributes::{Compression, Number, STORE_VERSION, TableAttributes, TableContent};
pub use error::StoreError;
pub use location::Location;
pub use table_store::{Part, TableStore};
