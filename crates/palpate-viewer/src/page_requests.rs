//! Requests of a page, applied to the pointers and the playback of a scene, whoever runs it.

use crate::pointers::{PointerId, Pointers, lock};
use crate::protocol::{
    ClientMessage, FrameFormat, MaterialDescription, PhysicsSettings, PressMode, ServerMessage,
};
use glam::DVec3;
use palpate::{DeviceMode, Grasp, Model, SurfacePoint};
use palpate_haptics::Playback;
use std::sync::Mutex;

/// Largest distance of a pointer from the origin [m].
const MAX_POINTER_DISTANCE_M: f64 = 1e4;

/// Answer to a page whose message cannot be read.
pub(crate) fn unreadable(error: &serde_json::Error) -> String {
    let text = format!("the server cannot read a message of the page: {error}");
    ServerMessage::Error { text: &text }.to_json()
}

/// Scene as far as requests of pages change it.
pub(crate) struct SceneControls<'s> {
    pub model: &'s Model,
    pub pointers: &'s Mutex<Pointers>,
    pub playback: &'s Playback,
}

/// Request to whoever runs the scene.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum SceneRequest {
    /// Open a scene by id.
    Open(String),
    /// Restart the scene.
    Reset,
    /// Change physics settings.
    ChangePhysics(PhysicsSettings),
    /// Change the material of an object, by index.
    ChangeMaterial(usize, MaterialDescription),
    /// Send a status message now.
    SendStatus,
    /// Cancel the job that runs.
    CancelJob,
}

/// Effect of a request that is left to the caller.
pub(crate) enum Effect {
    /// Nothing.
    None,
    /// Message to the page, as JSON.
    Reply(String),
    /// Change of the page's stream of frames.
    Stream(FrameFormat, u32),
    /// Begin or end of the page's sound.
    Sound(bool),
    /// Request to whoever runs the scene.
    Scene(SceneRequest),
}

impl SceneControls<'_> {
    /// Applies a message of a viewer.
    pub fn apply(&self, viewer: u64, message: ClientMessage) -> Effect {
        match message {
            ClientMessage::Press { pointer, mode, position, object, triangle, weights } => {
                let grasp = || self.grasp(object?, triangle?, weights?);
                return Effect::Reply(self.press((viewer, pointer), mode, position, grasp));
            }
            ClientMessage::Move { pointers } => {
                let mut slots = lock(self.pointers);
                for target in pointers {
                    if let Some(position) = valid_position(target.position) {
                        slots.set_target((viewer, target.pointer), position);
                    }
                }
            }
            ClientMessage::Release { pointer } => lock(self.pointers).release((viewer, pointer)),
            ClientMessage::Stream { format, stride } => return Effect::Stream(format, stride),
            ClientMessage::Sound { on } => return Effect::Sound(on),
            ClientMessage::Pause { paused } => {
                self.playback.set_paused(paused);
                return Effect::Scene(SceneRequest::SendStatus);
            }
            ClientMessage::SingleStep => self.playback.request_step(),
            ClientMessage::SlowMotion { slowdown } => {
                self.playback.set_slowdown(slowdown.clamp(1, 1000));
                return Effect::Scene(SceneRequest::SendStatus);
            }
            ClientMessage::CancelJob => return Effect::Scene(SceneRequest::CancelJob),
            ClientMessage::Reset => return Effect::Scene(SceneRequest::Reset),
            ClientMessage::OpenScene { scene } => return Effect::Scene(SceneRequest::Open(scene)),
            ClientMessage::SetPhysics(settings) => {
                return Effect::Scene(SceneRequest::ChangePhysics(settings));
            }
            ClientMessage::SetMaterial { object, young, poisson, density } => {
                let material = MaterialDescription { young, poisson, density };
                return Effect::Scene(SceneRequest::ChangeMaterial(object, material));
            }
        }
        Effect::None
    }

    /// Presses a pointer; returns the answer to the page.
    fn press(
        &self,
        id: PointerId,
        mode: PressMode,
        position: [f64; 3],
        grasp: impl FnOnce() -> Option<Grasp>,
    ) -> String {
        let Some(position) = valid_position(position) else {
            let text = "the position of a pointer is three finite numbers [m]";
            return ServerMessage::Error { text }.to_json();
        };
        let mode = match mode {
            PressMode::Touch => Some(DeviceMode::Touch),
            PressMode::Hold => grasp().map(DeviceMode::Held),
        };
        let Some(mode) = mode else {
            let text = "a hold needs an object, a triangle and barycentric weights, on nodes that can move";
            return ServerMessage::Error { text }.to_json();
        };
        let device = lock(self.pointers).press(id, mode, position);
        ServerMessage::Assigned { pointer: id.1, device }.to_json()
    }

    fn grasp(&self, object: usize, triangle: u32, weights: [f64; 3]) -> Option<Grasp> {
        let recording = self.model.recordings().nth(object)?;
        let sum: f64 = weights.iter().sum();
        let valid = weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0) && sum > 0.0;
        if !valid || triangle as usize >= recording.surface.triangles.len() {
            return None;
        }
        let point = SurfacePoint { triangle, weights: weights.map(|weight| weight / sum) };
        recording.is_movable(&point).then_some(Grasp { object, point })
    }
}

/// Position within range [m, world].
fn valid_position(position: [f64; 3]) -> Option<DVec3> {
    let position = DVec3::from_array(position);
    (position.is_finite() && position.length() < MAX_POINTER_DISTANCE_M).then_some(position)
}
