//! The haptic update (paper, section 3.2): the device side, at the device's own rate.

use crate::device::{Device, Mount, Traits};
use crate::error::Error;
use crate::passivity::PassivityController;
use crate::port::{DevicePort, Motion};
use crate::safety::{Safety, SafetyCounts};
use crate::timing::Spread;
use glam::{DQuat, DVec3};
use std::time::Duration;

/// Motions of which it is remembered when they were told.
const TOLD: usize = 1024;

/// A device that has told nothing for so long [s] is lost: force passes again at a press of its button only, if it has one.
const LOST_S: f64 = 0.1;

/// What is told of an encoder's steps is smoothed over this share of the time that answers take: a coupling's damper would make a
/// blow of every step.
const SMOOTHED: f64 = 0.1;

/// One device's haptic update without its thread: what happens in a cycle.
pub struct HapticUpdate {
    device: Box<dyn Device>,
    port: DevicePort,
    mount: Mount,
    safety: Safety,
    passivity: Option<PassivityController>,
    /// Wait for a button before force passes.
    by_button: bool,
    /// The buttons of the last reading; all of them before the first, so that one that is held does not count as pressed.
    buttons: u32,
    sequence: u64,
    /// When motions were told [s], by their sequence; the newest that was answered, and how long answers took.
    told: Box<[f64]>,
    answered: u64,
    answers: Spread,
    last: Option<(f64, DVec3)>,
    /// The place that was told last [m].
    placed: Option<DVec3>,
    /// When the last update was [s].
    updated: Option<f64>,
    /// Why a reading or a push failed first.
    failure: Option<Error>,
    /// The force that the device holds [N, world].
    held: DVec3,
    counts: UpdateCounts,
}

/// What happened to a device.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UpdateCounts {
    /// Updates.
    pub updates: u64,
    /// Readings and pushes that failed.
    pub failed: u64,
    /// What the safety met.
    pub safety: SafetyCounts,
    /// Updates in which the passivity controller changed the force.
    pub passivity_acted: u64,
    /// Most energy [J] that was missing at once.
    pub passivity_worst_j: f64,
    /// Largest force [N] that went to the device.
    pub force_max_n: f64,
    /// Work [J, world] on the hand since the start.
    pub given_j: f64,
}

impl HapticUpdate {
    /// For a device on a mount. Without a passivity controller the port's energy is not looked at. Force passes when the
    /// safety is armed: at the first press of a button, or from the start.
    pub fn new(
        device: Box<dyn Device>,
        port: DevicePort,
        mount: Mount,
        mut safety: Safety,
        passivity: Option<PassivityController>,
        by_button: bool,
    ) -> Self {
        safety.arm(!by_button);
        Self {
            device,
            port,
            mount,
            safety,
            passivity,
            by_button,
            buttons: u32::MAX,
            sequence: 0,
            told: vec![0.0; TOLD].into_boxed_slice(),
            answered: 0,
            answers: Spread::default(),
            last: None,
            placed: None,
            updated: None,
            failure: None,
            held: DVec3::ZERO,
            counts: UpdateCounts::default(),
        }
    }

    /// What its device is.
    pub fn traits(&self) -> Traits {
        self.device.traits()
    }

    /// How long it took from a motion to an effort that answers it or a later one, as the update saw it.
    pub fn answers(&self) -> &Spread {
        &self.answers
    }

    /// What has happened.
    pub fn counts(&self) -> UpdateCounts {
        let mut counts = UpdateCounts { safety: self.safety.counts(), ..self.counts };
        if let Some(passivity) = &self.passivity {
            counts.passivity_acted = passivity.acted();
            counts.passivity_worst_j = passivity.worst_j();
        }
        counts
    }

    /// Why a reading or a push failed, the first time.
    pub fn failure(&self) -> Option<&Error> {
        self.failure.as_ref()
    }

    /// Read the device, tell the force process, push the hand with the newest force as far as it is passive and safe.
    ///
    /// # Real time
    /// No allocation, lock or system call but those of the driver.
    pub fn cycle(&mut self, now_s: f64) {
        self.counts.updates += 1;
        let effort = self.port.newest();
        if effort.answers > self.answered && effort.answers + TOLD as u64 > self.sequence {
            self.answered = effort.answers;
            let told = self.told[(effort.answers % TOLD as u64) as usize];
            self.answers.record(Duration::from_secs_f64((now_s - told).max(0.0)));
        }
        let age_s = if effort.sequence == 0 { f64::INFINITY } else { now_s - effort.time_s };
        let since_update = self.updated.replace(now_s).map_or(0.0, |time| now_s - time);
        let reading = match self.device.read(now_s) {
            Ok(reading) => reading,
            Err(error) => {
                // Whatever it does with that, it is not pushed.
                self.failed(error);
                if self.by_button && self.last.is_none_or(|(time, _)| now_s - time > LOST_S) {
                    self.safety.arm(false);
                    self.buttons = u32::MAX;
                }
                let force = self.safety.limit(effort.force, f64::INFINITY, 0.0, since_update);
                self.push(force, now_s);
                return;
            }
        };
        let position = self.mount.world_from_device(reading.position);
        if position.is_finite() {
            self.sequence += 1;
            self.told[(self.sequence % TOLD as u64) as usize] = now_s;
            let orientation = reading.orientation.unwrap_or(DQuat::IDENTITY);
            let placed = self.smoothed(position, now_s, since_update);
            self.port.tell(Motion {
                sequence: self.sequence,
                time_s: now_s,
                position: placed,
                orientation: self.mount.world_orientation(orientation),
                buttons: reading.buttons,
                mode: None,
            });
        }
        if self.by_button && reading.buttons & !self.buttons != 0 {
            self.safety.arm(true);
        }
        self.buttons = reading.buttons;
        let before = self.last.replace((now_s, position));
        let (dt, moved) = before.map_or((0.0, DVec3::ZERO), |(time, last)| (now_s - time, position - last));
        if moved.is_finite() {
            self.counts.given_j += self.held.dot(moved);
        }
        let speed = if dt > 0.0 { moved.length() / dt / self.mount.scale } else { 0.0 };
        let wanted = match &mut self.passivity {
            Some(passivity) => passivity.control(self.sequence, position, &effort, dt),
            None => effort.force,
        };
        let force = self.safety.limit(wanted, age_s, speed, since_update);
        self.push(force, now_s);
    }

    /// A place that was read [m, world], smoothed if it comes in steps.
    fn smoothed(&mut self, position: DVec3, now_s: f64, dt_s: f64) -> DVec3 {
        let told_s = self.told[(self.answered % TOLD as u64) as usize];
        let over_s = if self.answered > 0 && self.device.traits().resolution_m > 0.0 {
            SMOOTHED * (now_s - told_s).clamp(0.0, LOST_S)
        } else {
            0.0
        };
        let before = self.placed.unwrap_or(position);
        let placed =
            if dt_s > 0.0 { before + (position - before) * (dt_s / (dt_s + over_s)) } else { position };
        *self.placed.insert(placed)
    }

    /// Push the hand no more.
    pub fn let_go(&mut self, now_s: f64) {
        self.push(DVec3::ZERO, now_s);
    }

    fn push(&mut self, force: DVec3, now_s: f64) {
        if let Some(passivity) = &mut self.passivity {
            passivity.hold(force);
        }
        self.held = force;
        self.counts.force_max_n = self.counts.force_max_n.max(force.length());
        if let Err(error) = self.device.push(self.mount.device_force(force), now_s) {
            self.failed(error);
        }
    }

    fn failed(&mut self, error: Error) {
        self.counts.failed += 1;
        self.failure.get_or_insert(error);
    }
}
