//! JSON messages.

use super::description::{CouplingDescription, SceneDescription};
use super::frame::FrameFormat;
use palpate_haptics::{Percentiles, Timing};
use serde::{Deserialize, Serialize};

/// Version of the protocol.
pub(crate) const PROTOCOL: u32 = 2;

/// Scene that a page can open.
#[derive(Debug, Clone, Serialize)]
pub struct SceneSummary {
    /// Id.
    pub id: String,
    /// Title.
    pub title: String,
    /// One line of description.
    pub about: String,
}

/// Log that a page can play, by file name.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LogEntry {
    pub name: String,
}

/// First message to a page.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename = "hello")]
pub(crate) struct Hello {
    pub protocol: u32,
    pub version: &'static str,
    pub kind: &'static str,
    /// Number of the viewer, for the jobs that it asks for.
    pub viewer: u64,
    /// Whether meshes can be recorded.
    pub records: bool,
    pub scenes: Vec<SceneSummary>,
    pub logs: Vec<LogEntry>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub render: Option<RenderRequest>,
}

/// Images to be drawn by a page in a headless browser.
#[derive(Debug, Clone, Serialize)]
pub struct RenderRequest {
    /// Frame indices of the first log.
    pub frames: Vec<u64>,
    /// Image width [px].
    pub width: u32,
    /// Image height [px].
    pub height: u32,
    /// Camera; `None` is the default view.
    pub camera: Option<CameraView>,
    /// Colour mode: `displacement`, `strain` or `plain`.
    pub colour: String,
    /// Whether to use the dark theme.
    pub dark: bool,
}

/// Camera position and target.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CameraView {
    /// Position [m, world].
    pub from: [f64; 3],
    /// Target [m, world].
    pub to: [f64; 3],
}

/// Timing of the force process.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct ProcessTiming {
    /// Compute time per step [µs].
    pub compute_us: TimePercentiles,
    /// Delay of the start of a step [µs].
    pub lateness_us: TimePercentiles,
    pub overruns: u64,
    /// Overruns caused by the compute time.
    pub compute_overruns: u64,
    /// Whether the operating system granted real-time priority.
    pub realtime_priority: bool,
}

impl ProcessTiming {
    /// Timing so far, and whether the operating system granted real-time priority.
    pub fn new(timing: &Timing, realtime_priority: bool) -> Self {
        Self {
            compute_us: timing.compute_us().into(),
            lateness_us: timing.lateness_us().into(),
            overruns: timing.overruns,
            compute_overruns: timing.own_overruns,
            realtime_priority,
        }
    }
}

/// Percentiles of a time [µs].
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct TimePercentiles {
    p50: f64,
    p99: f64,
    p999: f64,
    max: f64,
}

impl From<Percentiles> for TimePercentiles {
    fn from(Percentiles { p50, p99, p999, max }: Percentiles) -> Self {
        Self { p50, p99, p999, max }
    }
}

/// Periodic status of a live scene.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Status {
    pub generation: u32,
    pub paused: bool,
    pub slowdown: u32,
    pub steps: u64,
    pub viewers: usize,
    pub force_process: ProcessTiming,
    /// Haptic device of a page without a server.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub haptic_device: Option<DeviceStatus>,
}

/// Status of a haptic device.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub(crate) struct DeviceStatus {
    pub force: ForceStatus,
    pub max_force_n: f64,
}

/// Force of a haptic device since the last status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum ForceStatus {
    /// Not armed.
    Off,
    On,
    /// Taken away: an update, or the reply to a motion, came too late.
    LateUpdates,
    /// Taken away: the hand was too fast or too far from its start.
    ImplausibleMotion,
}

/// Message to a page, after [`Hello`].
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "snake_case")]
pub(crate) enum ServerMessage<'a> {
    Scene {
        generation: u32,
        #[serde(flatten)]
        scene: &'a SceneDescription,
    },
    Status(Status),
    Assigned {
        pointer: u64,
        device: Option<usize>,
    },
    Progress {
        job: &'a str,
        phase: &'a str,
        fraction: Option<f64>,
        done: bool,
    },
    Info {
        text: &'a str,
    },
    Error {
        text: &'a str,
    },
}

impl ServerMessage<'_> {
    /// JSON text.
    pub fn to_json(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Target position of a pointer [m, world].
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointerTarget {
    pub pointer: u64,
    pub position: [f64; 3],
}

/// Physics settings that a page changes; `None` keeps a value.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhysicsSettings {
    /// Gravity [m/s², world].
    pub gravity: Option<[f64; 3]>,
    /// Time step [s].
    pub step: Option<f64>,
    /// Coulomb friction coefficient of all contacts [1].
    pub friction: Option<f64>,
    /// Virtual coupling of the pointers.
    pub coupling: Option<CouplingDescription>,
}

impl PhysicsSettings {
    /// Settings, completed with those of an older change.
    pub(crate) fn or(self, older: &Self) -> Self {
        Self {
            gravity: self.gravity.or(older.gravity),
            step: self.step.or(older.step),
            friction: self.friction.or(older.friction),
            coupling: self.coupling.or(older.coupling),
        }
    }
}

/// Whether a text is a message of a page: entry of the fuzzer.
#[doc(hidden)]
pub fn decodes(text: &str) -> bool {
    serde_json::from_str::<ClientMessage>(text).is_ok()
}

/// Message from a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "snake_case", deny_unknown_fields)]
pub(crate) enum ClientMessage {
    Press {
        pointer: u64,
        mode: PressMode,
        position: [f64; 3],
        object: Option<usize>,
        triangle: Option<u32>,
        weights: Option<[f64; 3]>,
    },
    Move {
        pointers: Vec<PointerTarget>,
    },
    Release {
        pointer: u64,
    },
    Pause {
        paused: bool,
    },
    SingleStep,
    SlowMotion {
        slowdown: u32,
    },
    Reset,
    CancelJob,
    OpenScene {
        scene: String,
    },
    SetPhysics(PhysicsSettings),
    SetMaterial {
        object: usize,
        young: f64,
        poisson: f64,
        density: f64,
    },
    Sound {
        on: bool,
    },
    Stream {
        format: FrameFormat,
        stride: u32,
    },
}

/// Action of a press.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum PressMode {
    Touch,
    Hold,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn valid_client_messages_are_parsed_and_others_are_refused() {
        let read =
            |text: &str| serde_json::from_str::<ClientMessage>(text).map_err(|error| error.to_string());
        assert_eq!(
            read(r#"{"type":"move","pointers":[{"pointer":7,"position":[0,1,2]}]}"#),
            Ok(ClientMessage::Move {
                pointers: vec![PointerTarget { pointer: 7, position: [0.0, 1.0, 2.0] }]
            })
        );
        let set =
            read(r#"{"type":"set_physics","coupling":{"stiffness":200,"damping":0.5}}"#).expect("settings");
        let ClientMessage::SetPhysics(settings) = set else { panic!("{set:?}") };
        assert_eq!(
            (settings.coupling.map(|coupling| coupling.stiffness), settings.step),
            (Some(200.0), None)
        );
        for wrong in [
            r#"{"type":"fly"}"#,
            r#"{"type":"pause"}"#,
            r#"{"type":"pause","paused":true,"and":1}"#,
            r#"{"type":"press","pointer":-1,"mode":"touch","position":[0,0,0]}"#,
            r#"{"type":"move","pointers":[{"pointer":7,"position":[0,1]}]}"#,
            "[]",
            "",
        ] {
            assert!(read(wrong).is_err(), "{wrong}");
        }
    }
}
