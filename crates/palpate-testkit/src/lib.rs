//! Fixtures for palpate's tests, verification and benchmarks: bodies, scenes, and random numbers that are the same in every run.
//!
//! [`free_block`] and [`fixed_block`] are the released sample recordings, read once per process. [`scene`], [`floor`], [`finger`] and
//! [`object_at`] build models from them. With the feature `record`, [`ElasticMaterial`] records bodies from meshes, each once per process.

mod random;
mod sample_recordings;
mod scenes;
mod subdivision;

#[cfg(feature = "record")]
mod material;
#[cfg(feature = "record")]
mod paper_cube;
#[cfg(feature = "record")]
mod recording_cache;

pub use random::Random;
pub use sample_recordings::{fixed_block, free_block};
pub use scenes::{
    GRAVITY_M_S2, finger, floor, half_extent, object_at, scene, smoothstep, start_at, touching,
};
pub use subdivision::{subdivided, subdivided_near_field};

#[cfg(feature = "record")]
pub use material::{ElasticMaterial, undamped};
#[cfg(feature = "record")]
pub use paper_cube::{PAPER_CUBE_SIDE_M, PAPER_MATERIAL, paper_cube_mesh, paper_cube_parameters};
#[cfg(feature = "record")]
pub use recording_cache::{recorded, recorded_once};
