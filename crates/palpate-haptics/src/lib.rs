//! palpate in real time: the three processes of the paper (section 3.2) as threads, devices, and a log.
//!
//! ```text
//! device ⇄ haptic update ⇄ port ⇄ FORCE PROCESS → deformation process → picture
//!          (safety, passivity)          ↘ log
//! ```
//!
//! - The **force process** takes the newest device positions, advances the scene by one step and gives forces, at absolute
//!   deadlines. Its cycle allocates nothing, takes no lock and makes no system call but the clock's wait.
//! - The **deformation process** makes whole surfaces for the eye, at its own pace, from the newest state.
//! - The **haptic update** drives one device at the device's own rate. What goes to the hand passes the passivity controller
//!   and the safety limits there, whatever the force process says.
//!
//! They hand over through triple buffers: nobody waits for anybody. Times are in seconds since a common start, and the
//! cycles are plain functions of them, so that a loop can also be closed in simulated time.

mod clock;
mod deformation_process;
pub mod device;
mod error;
mod force_process;
mod haptic_update;
pub mod link;
pub mod log;
mod motion_path;
mod passivity;
mod playback;
mod port;
mod safety;
mod scheduling;
mod session;
mod snapshot;
pub mod stability;
mod timing;

pub use clock::Clock;
pub use deformation_process::{DeformationProcess, Frame, FrameObject};
pub use error::Error;
pub use force_process::{ForceProcess, ObstacleTrajectory};
pub use haptic_update::{HapticUpdate, UpdateCounts};
pub use motion_path::{Columns, MotionPath, orientation};
pub use passivity::PassivityController;
pub use playback::Playback;
pub use port::{DevicePort, Effort, ForcePort, Motion, port};
pub use safety::{Safety, SafetyCounts, SafetyLimits};
pub use scheduling::{GrantedScheduling, Scheduling, steal_time_s};
pub use session::{AttachedDevice, DeviceReport, Report, Session, SessionDevice, run_update};
pub use snapshot::{Snapshot, SnapshotReader, SnapshotWriter, snapshot_buffer};
pub use timing::{Cycle, CycleReceiver, CycleSender, Percentiles, Spread, Timing, cycles};
