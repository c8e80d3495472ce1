//! Haptic update (paper, section 3.2): the device side, at the device's own rate.

use crate::device::{Device, DeviceSpec, Mount};
use crate::error::Error;
use crate::passivity::PassivityController;
use crate::port::{DevicePort, Effort, Motion};
use crate::safety::{Conditions, Reply, Safety, SafetyCounts};
use crate::safety_limits::ImplausibleMotion;
use crate::timing::DurationHistogram;
use glam::{DQuat, DVec3};
use std::time::Duration;

/// Capacity of the history of send times [motions].
const HISTORY: usize = 1024;

/// Time without a reading [s] after which a device counts as lost. Force then passes only after another press of its button, if it
/// is armed by a button.
const LOST_S: f64 = 0.1;

/// Time constant of the position filter, as a share of the motion-to-force latency. Positions in encoder steps are low-pass filtered:
/// a coupling's damper would turn every step into a blow.
const FILTER_SHARE: f64 = 0.1;

/// Haptic update of one device without its thread: a function of time.
pub struct HapticUpdate {
    device: Box<dyn Device>,
    port: DevicePort,
    mount: Mount,
    safety: Safety,
    passivity: Option<PassivityController>,
    /// Whether a button press arms the force.
    arm_by_button: bool,
    /// Buttons of the last reading; all before the first, so that a button that is held from the start does not count as pressed.
    buttons: u32,
    sequence: u64,
    /// Send times of motions [s], by sequence number modulo [`HISTORY`].
    sent_at: Box<[f64]>,
    /// Newest motion that was replied to.
    replied: u64,
    motion_to_force: DurationHistogram,
    /// First position [m, device frame].
    start: Option<DVec3>,
    /// Time [s] and position [m, world] of the last reading.
    last: Option<(f64, DVec3)>,
    /// Filtered position that was sent last [m, world].
    filtered_position: Option<DVec3>,
    /// Time of the last update [s].
    updated_s: Option<f64>,
    /// First failure of the device.
    failure: Option<Error>,
    /// Force that the device holds [N, world].
    held: DVec3,
    counts: UpdateCounts,
}

/// Counters of a haptic update.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct UpdateCounts {
    /// Updates.
    pub updates: u64,
    /// Failed calls of the device.
    pub failed: u64,
    /// Counters of the safety.
    pub safety: SafetyCounts,
    /// Updates in which the passivity controller changed the force.
    pub passivity_active_updates: u64,
    /// Largest energy deficit that the passivity observer saw [J].
    pub passivity_max_deficit_j: f64,
    /// Largest force on the hand [N].
    pub force_max_n: f64,
    /// Work of the device on the hand since the start [J].
    pub work_on_hand_j: f64,
}

impl HapticUpdate {
    /// Haptic update of a device on a mount; without a passivity controller, the port's energy is not observed. The safety is armed
    /// from the start, or at the first press of a button if `arm_by_button` is set.
    pub fn new(
        device: Box<dyn Device>,
        port: DevicePort,
        mount: Mount,
        mut safety: Safety,
        passivity: Option<PassivityController>,
        arm_by_button: bool,
    ) -> Self {
        safety.arm(!arm_by_button);
        Self {
            device,
            port,
            mount,
            safety,
            passivity,
            arm_by_button,
            buttons: u32::MAX,
            sequence: 0,
            sent_at: vec![0.0; HISTORY].into_boxed_slice(),
            replied: 0,
            motion_to_force: DurationHistogram::default(),
            start: None,
            last: None,
            filtered_position: None,
            updated_s: None,
            failure: None,
            held: DVec3::ZERO,
            counts: UpdateCounts::default(),
        }
    }

    /// Specification of the device.
    pub fn spec(&self) -> DeviceSpec {
        self.device.spec()
    }

    /// Histogram of the motion-to-force latency: from sending a motion to an effort that replies to it or to a later one.
    pub fn motion_to_force(&self) -> &DurationHistogram {
        &self.motion_to_force
    }

    /// Counters since the start.
    pub fn counts(&self) -> UpdateCounts {
        let mut counts = UpdateCounts { safety: self.safety.counts(), ..self.counts };
        if let Some(passivity) = &self.passivity {
            counts.passivity_active_updates = passivity.active_updates();
            counts.passivity_max_deficit_j = passivity.max_deficit_j();
        }
        counts
    }

    /// Whether the force is armed.
    pub fn is_armed(&self) -> bool {
        self.safety.is_armed()
    }

    /// Force that the device holds [N, world].
    pub fn held_force(&self) -> DVec3 {
        self.held
    }

    /// First failure of the device.
    pub fn failure(&self) -> Option<&Error> {
        self.failure.as_ref()
    }

    /// Cycle at a time [s]: reads the device, sends the motion, commands the newest force as far as it is passive and safe.
    ///
    /// # Real time
    /// No allocation, lock or system call except the driver's.
    pub fn cycle(&mut self, now_s: f64) {
        self.counts.updates += 1;
        let effort = self.port.newest();
        let reply = self.reply(&effort, now_s);
        let since_update_s = self.updated_s.replace(now_s).map(|time| now_s - time);
        let mut conditions = Conditions { since_update_s, reply, speed_m_s: 0.0, distance_m: 0.0 };

        // Read. A device that fails gets no force, and is disarmed when it is lost.
        let reading = match self.device.read(now_s) {
            Ok(reading) => reading,
            Err(error) => {
                self.note_failure(error);
                if self.arm_by_button && self.last.is_none_or(|(time, _)| now_s - time > LOST_S) {
                    self.safety.arm(false);
                    self.buttons = u32::MAX;
                }
                conditions.reply = None;
                let force = self.safety.limit(effort.force, &conditions);
                self.set_force(force, now_s);
                return;
            }
        };

        // Send the motion.
        let position = self.mount.world_from_device(reading.position);
        if position.is_finite() {
            self.sequence += 1;
            self.sent_at[(self.sequence % HISTORY as u64) as usize] = now_s;
            let orientation = reading.orientation.unwrap_or(DQuat::IDENTITY);
            let filtered = self.filter(position, now_s, since_update_s.unwrap_or(0.0));
            self.port.send(Motion {
                sequence: self.sequence,
                time_s: now_s,
                position: filtered,
                orientation: self.mount.world_orientation(orientation),
                buttons: reading.buttons,
                ..Motion::default()
            });
        }
        if self.arm_by_button && reading.buttons & !self.buttons != 0 {
            self.safety.arm(true);
        }
        self.buttons = reading.buttons;

        // Work on the hand, and its speed.
        let before = self.last.replace((now_s, position));
        // A clock that goes back gives no time.
        let (dt, moved) =
            before.map_or((0.0, DVec3::ZERO), |(time, last)| ((now_s - time).max(0.0), position - last));
        if moved.is_finite() {
            self.counts.work_on_hand_j += self.held.dot(moved);
        }
        conditions.speed_m_s = if dt > 0.0 { moved.length() / dt / self.mount.scale } else { 0.0 };
        conditions.distance_m = self.distance_from_start(reading.position);

        // Command the force, made passive and safe.
        let is_gap = since_update_s.is_some_and(|gap_s| !self.safety.limits().is_regular(gap_s));
        let wanted = match &mut self.passivity {
            Some(passivity) => {
                if is_gap {
                    passivity.skip_gap();
                }
                passivity.control(self.sequence, position, &effort, dt)
            }
            None => effort.force,
        };
        let force = self.safety.limit(wanted, &conditions);
        self.set_force(force, now_s);
    }

    /// Reply of an effort at a time [s]; `None` for one that replies to no motion, and has no force. Records the latency of a new one.
    fn reply(&mut self, effort: &Effort, now_s: f64) -> Option<Reply> {
        if effort.sequence == 0 || effort.in_reply_to == 0 && effort.force == DVec3::ZERO {
            return None;
        }
        let is_known = effort.in_reply_to > 0 && effort.in_reply_to + HISTORY as u64 > self.sequence;
        let sent_s = self.sent_at[(effort.in_reply_to % HISTORY as u64) as usize];
        let motion_age_s = if is_known { now_s - sent_s } else { f64::INFINITY };
        let is_new = is_known && effort.in_reply_to > self.replied;
        if is_new {
            self.replied = effort.in_reply_to;
            self.motion_to_force.record(Duration::from_secs_f64(motion_age_s.max(0.0)));
        }
        Some(Reply { force_age_s: now_s - effort.time_s, motion_age_s, is_new })
    }

    /// Distance of a position from the first one [m, device frame]. The first that is not plausible is noted.
    fn distance_from_start(&mut self, position: DVec3) -> f64 {
        let start = *self.start.get_or_insert(position);
        if !start.is_finite() {
            self.start = None;
        }
        let (distance_m, range_m) = ((position - start).length(), self.safety.limits().range_m);
        if distance_m.is_finite() && distance_m > range_m {
            self.failure
                .get_or_insert_with(|| ImplausibleMotion::FarFromStart { distance_m, range_m }.into());
        }
        distance_m
    }

    /// Position [m, world], low-pass filtered if the device has an encoder.
    fn filter(&mut self, position: DVec3, now_s: f64, dt_s: f64) -> DVec3 {
        let sent_s = self.sent_at[(self.replied % HISTORY as u64) as usize];
        let time_constant_s = if self.replied > 0 && self.device.spec().resolution_m > 0.0 {
            FILTER_SHARE * (now_s - sent_s).clamp(0.0, LOST_S)
        } else {
            0.0
        };
        let before = self.filtered_position.unwrap_or(position);
        let filtered = if dt_s > 0.0 {
            before + (position - before) * (dt_s / (dt_s + time_constant_s))
        } else {
            position
        };
        *self.filtered_position.insert(filtered)
    }

    /// Port, for another use.
    pub fn into_port(self) -> DevicePort {
        self.port
    }

    /// Commands zero force.
    pub fn release(&mut self, now_s: f64) {
        self.set_force(DVec3::ZERO, now_s);
    }

    fn set_force(&mut self, force: DVec3, now_s: f64) {
        if let Some(passivity) = &mut self.passivity {
            passivity.hold(force);
        }
        self.held = force;
        self.counts.force_max_n = self.counts.force_max_n.max(force.length());
        if let Err(error) = self.device.set_force(self.mount.device_force(force), now_s) {
            self.note_failure(error);
        }
    }

    fn note_failure(&mut self, error: Error) {
        self.counts.failed += 1;
        self.failure.get_or_insert(error);
    }
}
