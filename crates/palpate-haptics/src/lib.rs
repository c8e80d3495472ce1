//! palpate in real time: the three processes of the paper (section 3.2) as threads, haptic devices, links and logs.
//!
//! ```text
//! device ⇄ haptic update ⇄ port ⇄ FORCE PROCESS → deformation process → display
//!          (safety, passivity)          ↘ log
//! ```
//!
//! - The **force process** takes the newest device positions, advances the scene by one step and sends forces, at absolute
//!   deadlines. Its cycle makes no allocation, takes no lock, and makes no system call except the clock's wait.
//! - The **deformation process** computes deformed surfaces for display from the newest [`Snapshot`], at its own rate.
//! - The **haptic update** serves one device at the device's own rate. Every force passes the passivity controller and the safety
//!   limits there, whatever the force process sends.
//!
//! The processes exchange values through triple buffers: no process waits for another. Times are in seconds since a common start, and
//! a cycle is a function of time, so that a loop can also be closed in simulated time, without threads.
//!
//! Without the feature `real-time` the crate has what is a function of time, and no thread, clock, driver or link, and without the feature `logs` no
//! log: WebAssembly runs that.
//!
//! | you want to | start with |
//! |---|---|
//! | run a scene with devices in real time | [`Session`] |
//! | close a loop in simulated time | [`ForceProcess`], [`HapticUpdate`], [`port()`] |
//! | write or use a driver | [`device`] |
//! | leave a real device without force on every way out | [`guardian`] |
//! | connect a device over a network | [`link`] |
//! | write, read or replay a log | [`log`] |
//! | choose a stable virtual coupling | [`stability`] |

// Parts that only drivers and links use.
#![cfg_attr(not(feature = "real-time"), allow(dead_code))]

mod attached_device;
mod buffer_pool;
#[cfg(feature = "real-time")]
mod clock;
#[cfg(feature = "real-time")]
mod cycle_channel;
mod deformation_process;
pub mod device;
pub mod error;
mod force_process;
#[cfg(feature = "real-time")]
pub mod guardian;
mod haptic_update;
mod input_record;
#[cfg(feature = "real-time")]
pub mod link;
#[cfg(feature = "logs")]
mod link_messages;
#[cfg(feature = "logs")]
pub mod log;
mod motion_check;
mod motion_path;
mod passivity;
mod playback;
mod port;
mod ramp;
mod safety;
mod safety_limits;
mod scene_names;
#[cfg(feature = "real-time")]
mod scheduling;
#[cfg(feature = "real-time")]
mod session;
mod snapshot;
pub mod stability;
pub mod timing;

pub use attached_device::AttachedDevice;
pub use buffer_pool::{PoolConsumer, PoolProducer, buffer_pool};
#[cfg(feature = "real-time")]
pub use clock::Clock;
#[cfg(feature = "real-time")]
pub use cycle_channel::{CycleReceiver, CycleSender, cycle_channel};
pub use deformation_process::{DeformationProcess, Frame, FrameObject};
#[doc(no_inline)]
pub use error::{Error, LogError};
pub use force_process::{ForceProcess, SceneMotion, StepListener};
pub use haptic_update::{HapticUpdate, UpdateCounts};
pub use input_record::{InputReader, InputRecord};
#[cfg(feature = "logs")]
#[doc(hidden)]
pub use link_messages::decodes_link_message;
pub use motion_path::{Columns, MotionPath, PathError, PoseTrajectory, QuaternionError, unit_quaternion};
pub use passivity::PassivityController;
pub use playback::Playback;
pub use port::{DevicePort, Effort, ForcePort, Motion, port};
pub use ramp::{PoseSender, pose_port};
pub use safety::{Conditions, Reply, Safety, SafetyCounts};
pub use safety_limits::{ImplausibleMotion, LimitError, MotionLimits, RefusedMotions, SafetyLimits};
pub use scene_names::SceneNames;
#[cfg(feature = "real-time")]
pub use scheduling::{GrantedScheduling, Scheduling, steal_time_s};
#[cfg(feature = "real-time")]
pub use session::{DeviceReport, Report, Session, SessionDevice, run_haptic_update};
pub use snapshot::{Snapshot, SnapshotReader, SnapshotWriter, snapshot_buffer, steps_per_frame};
#[doc(no_inline)]
pub use timing::{Cycle, DurationHistogram, Overrun, Percentiles, Timing, percentile_us};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeExamples;
