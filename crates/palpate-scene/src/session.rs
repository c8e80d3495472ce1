//! Session of a scene: what its parts do in real time.

use crate::scene::Scene;
use palpate_haptics::{Scheduling, Session, SessionDevice};
use std::sync::Arc;
use std::time::Instant;

/// Time without a motion after which a device is inactive [s].
const DEVICE_TIMEOUT_S: f64 = 0.1;

/// Rate of the deformation process [Hz].
const FRAME_RATE_HZ: f64 = 60.0;

impl Scene {
    /// Session with a device for each of the scene's, without an end: planes, obstacles, clamps, bases and gravity follow their paths in simulated
    /// time.
    pub fn session(&self, devices: Vec<SessionDevice>, start: Instant, scheduling: Scheduling) -> Session {
        Session {
            model: self.model.clone(),
            state: None,
            start,
            devices,
            motion: self.motion()(),
            steps: None,
            frame_rate_hz: FRAME_RATE_HZ,
            scheduling,
            device_timeout_s: DEVICE_TIMEOUT_S,
            playback: Arc::default(),
            cycles: None,
            listener: None,
        }
    }
}
