//! WebAssembly of palpate: what the npm package `palpate` and the viewer's worker call.
//!
//! ```text
//! JavaScript ─ exports ─ Simulation: a scene that JavaScript steps (npm package)
//!                      └ LiveScene: a scene that follows the clock and speaks the viewer's protocol (worker of the page; feature `page`)
//! ```
//!
//! Text and bytes go through linear memory; arrays are read where they lie. The functions of `exports.rs` are the whole interface of the
//! package, which `memory.ts`, `recording.ts`, `scene.ts` and `simulation.ts` wrap; nothing else of this crate is unsafe but `live_exports.rs` and
//! `log_exports.rs`, which the workers of the page call.

mod description;
#[cfg(target_arch = "wasm32")]
mod exports;
#[cfg(all(target_arch = "wasm32", feature = "page"))]
mod live_exports;
#[cfg(feature = "page")]
mod live_scene;
#[cfg(all(target_arch = "wasm32", feature = "logs"))]
mod log_exports;
#[cfg(all(target_arch = "wasm32", feature = "record"))]
mod record_exports;
mod simulation;

pub use description::{describe_recording, describe_scene};
#[cfg(feature = "page")]
pub use live_scene::{LiveScene, RecordedRun, Rescaled};
pub use simulation::{Array, Simulation};
