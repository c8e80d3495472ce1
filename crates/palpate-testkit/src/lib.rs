//! Fixtures for palpate's tests, verification and benchmarks: bodies, scenes, and random numbers that are the same in every run.
//!
//! [`free_block`] and [`fixed_block`] are the released sample recordings, read once per process. [`scene`], [`floor`], [`finger`] and
//! [`object_at`] build models from them. [`made_once_per_run`] keeps what takes long for all processes of a test run. With the feature `record`, [`ElasticMaterial`] records bodies from meshes, each once per process.

mod allocations;
mod closed_form_table;
mod editable_recording;
mod once_per_run;
mod random;
mod random_pointer;
mod sample_recordings;
mod scenes;
mod subdivision;
mod waiting;

#[cfg(feature = "record")]
mod aluminium_bar;
#[cfg(feature = "record")]
mod body_set;
#[cfg(feature = "record")]
mod material;
#[cfg(feature = "record")]
mod recording_cache;

pub use allocations::{CountingAllocator, allocations, largest_allocation};
pub use closed_form_table::{closed_form_table, in_single_precision};
pub use editable_recording::{EditableRecording, EditableTensor};
pub use once_per_run::made_once_per_run;
pub use random::Random;
pub use random_pointer::RandomPointer;
pub use sample_recordings::{
    FIXED_BLOCK_FILE, FREE_BLOCK_FILE, fixed_block, free_block, with_stiffness_damping,
};
pub use scenes::{
    GRAVITY_M_S2, energy_imbalance, finger, floor, grasp, half_extent, holding, model_and_state, object_at,
    scene, smoothstep, start_at, touching,
};
pub use subdivision::{embedded, subdivided, subdivided_near_field};
pub use waiting::wait_until;

#[cfg(feature = "record")]
pub use aluminium_bar::{BAR_DAMPING, BAR_MATERIAL, BAR_SIZE_M, aluminium_bar};
#[cfg(feature = "record")]
pub use body_set::{BodyShape, Fineness, SOFT};
#[cfg(feature = "record")]
pub use material::{ElasticMaterial, PAPER_MATERIAL, isotropic, nodes_where, undamped};
#[cfg(feature = "record")]
pub use recording_cache::recorded;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
