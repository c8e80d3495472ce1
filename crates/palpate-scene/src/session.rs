//! Session of a scene: what its parts do in real time.

use crate::run_check::{no_contact, penetration};
use crate::scene::{Scene, SceneDevice};
use crate::warning::{Warning, WarningKind};
use palpate::DeviceMode;
use palpate_haptics::{Report, Scheduling, Session, SessionDevice};
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

    /// Warnings of a session that has ended.
    pub fn session_warnings(&self, report: &Report) -> Vec<Warning> {
        let mut warnings = Vec::new();
        if report.unsolved_steps > 0 {
            let message =
                format!("in {} steps contacts could not be solved, or were left out", report.unsolved_steps);
            warnings.push(Warning::new(WarningKind::Unsolved, "", message));
        }
        let objects =
            self.object_names.iter().zip(self.model.recordings()).zip(&report.largest_penetration_m);
        warnings
            .extend(objects.filter_map(|((name, recording), depth)| penetration(name, recording, *depth)));
        let refused = self.devices.iter().zip(&report.refused_motions);
        warnings.extend(refused.filter(|(_, refused)| refused.count > 0).map(|(device, refused)| {
            let message = format!("the device {:?}: {refused}", device.name);
            Warning::new(WarningKind::RefusedMotions, &device.name, message)
        }));
        // The path of a tip was meant to touch.
        let is_meant = |device: &SceneDevice| device.mode == DeviceMode::Touch && device.path.is_some();
        let devices = self.devices.iter().zip(&report.touching_steps);
        let silent = devices.filter(|(device, touching)| is_meant(device) && **touching == 0);
        warnings.extend(silent.map(|(device, _)| no_contact(&device.name, f64::INFINITY)));
        warnings
    }
}
