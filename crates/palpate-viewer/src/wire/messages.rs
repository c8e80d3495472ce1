//! Messages as JSON.

use super::description::{CouplingDescription, SceneDescription};
use palpate_haptics::Percentiles;
use serde::{Deserialize, Serialize};

/// A scene that can be opened.
#[derive(Debug, Clone, Serialize)]
pub struct SceneSummary {
    /// By which it is asked for.
    pub id: String,
    /// For people.
    pub title: String,
    /// A line for people: what there is to do.
    pub about: String,
}

/// A log that is shown.
#[derive(Debug, Clone, Serialize)]
pub(crate) struct LogTitle {
    pub name: String,
}

/// What a page is told first.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename = "hello")]
pub(crate) struct Hello {
    pub protocol: u32,
    pub version: &'static str,
    pub kind: &'static str,
    pub scenes: Vec<SceneSummary>,
    pub logs: Vec<LogTitle>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub render: Option<RenderRequest>,
}

/// Pictures that a page in a headless browser is to draw.
#[derive(Debug, Clone, Serialize)]
pub struct RenderRequest {
    /// Which frames of the first log.
    pub frames: Vec<u64>,
    /// Pixels.
    pub width: u32,
    /// See `width`.
    pub height: u32,
    /// Where the camera is and what it looks at [m, world]; none is the usual view.
    pub camera: Option<CameraView>,
    /// What colours tell: `displacement`, `strain` or `plain`.
    pub colour: String,
    /// On a dark ground.
    pub dark: bool,
}

/// A camera.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct CameraView {
    /// Where it is [m, world].
    pub from: [f64; 3],
    /// What it looks at [m, world].
    pub to: [f64; 3],
}

/// How the force process keeps its time [µs].
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct ProcessTiming {
    pub compute_us: Spread,
    pub late_us: Spread,
    pub overruns: u64,
    pub own_overruns: u64,
    /// Whether the system granted a real-time priority.
    pub priority: bool,
}

/// Percentiles.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Spread {
    p50: f64,
    p99: f64,
    p999: f64,
    max: f64,
}

impl From<Percentiles> for Spread {
    fn from(Percentiles { p50, p99, p999, max }: Percentiles) -> Self {
        Self { p50, p99, p999, max }
    }
}

/// What is told twice a second.
#[derive(Debug, Clone, Copy, Serialize)]
pub(crate) struct Status {
    pub generation: u32,
    pub paused: bool,
    pub slowness: u32,
    pub steps: u64,
    pub viewers: usize,
    pub force_process: ProcessTiming,
}

/// Messages to pages.
#[derive(Debug, Clone, Serialize)]
#[serde(tag = "type", rename_all = "lowercase")]
pub(crate) enum Answer<'a> {
    Scene {
        generation: u32,
        #[serde(flatten)]
        scene: &'a SceneDescription,
    },
    Status(Status),
    Granted {
        pointer: u64,
        device: Option<usize>,
    },
    Progress {
        job: &'a str,
        what: &'a str,
        share: Option<f64>,
        done: bool,
    },
    Error {
        text: &'a str,
    },
}

impl Answer<'_> {
    pub fn text(&self) -> String {
        serde_json::to_string(self).unwrap_or_default()
    }
}

/// Where a pointer is.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct PointerAt {
    pub pointer: u64,
    pub position: [f64; 3],
}

/// Rules of a scene that can be changed while it runs; those that are none stay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhysicsSettings {
    /// [m/s², world]
    pub gravity: Option<[f64; 3]>,
    /// [s]
    pub step: Option<f64>,
    /// Coulomb's coefficient of everything [1].
    pub friction: Option<f64>,
    /// Of the pointers.
    pub coupling: Option<CouplingDescription>,
}

/// Messages from a page.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(tag = "type", rename_all = "lowercase", deny_unknown_fields)]
pub(crate) enum Asked {
    Press {
        pointer: u64,
        mode: Doing,
        position: [f64; 3],
        object: Option<usize>,
        triangle: Option<u32>,
        weights: Option<[f64; 3]>,
    },
    Move {
        pointers: Vec<PointerAt>,
    },
    Release {
        pointer: u64,
    },
    Pause {
        paused: bool,
    },
    Step,
    Slow {
        slowness: u32,
    },
    Reset,
    Open {
        scene: String,
    },
    Set(PhysicsSettings),
    Material {
        object: usize,
        young: f64,
        poisson: f64,
        density: f64,
    },
    Stream {
        form: StreamForm,
        every: u32,
    },
}

/// What a pointer does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Doing {
    Touch,
    Hold,
}

/// How a page wants its pictures.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum StreamForm {
    Modal,
    Vertices,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_of_the_page_are_read_and_others_are_refused() {
        let read = |text: &str| serde_json::from_str::<Asked>(text).map_err(|error| error.to_string());
        assert_eq!(
            read(r#"{"type":"move","pointers":[{"pointer":7,"position":[0,1,2]}]}"#),
            Ok(Asked::Move { pointers: vec![PointerAt { pointer: 7, position: [0.0, 1.0, 2.0] }] })
        );
        let set = read(r#"{"type":"set","coupling":{"stiffness":200,"damping":0.5}}"#).expect("rules");
        let Asked::Set(rules) = set else { panic!("{set:?}") };
        assert_eq!((rules.coupling.map(|coupling| coupling.stiffness), rules.step), (Some(200.0), None));
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
