//! Log reader: scene, initial state and steps of a log, and comparison of a step with a replayed one.

use super::file::START;
use super::messages::{DeviceMessage, EnergyMessage, StartMessage, StepMessage};
use super::record_layout;
use super::record_reader::RecordReader;
use super::scan::{Scan, unreadable};
use super::summary::{step_channel, step_count, summary_of};
use crate::error::{Error, LogError};
use crate::scene_names::SceneNames;
use glam::DVec3;
use mcap::records::{AttachmentIndex, MetadataIndex, Record, op::MESSAGE};
use mcap::{McapError, Summary};
use palpate::{DeviceInput, DeviceMode, EnergyLedger, Input, ObjectSnapshot, Output, Pose, Twist};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// Log in memory, whole or up to the last whole chunk of one that was cut.
pub struct LogReader<'a> {
    bytes: Cow<'a, [u8]>,
    /// Length of what is read [bytes].
    end: usize,
    summary: Summary,
    is_cut: bool,
}

/// Logged step.
#[derive(Debug)]
pub struct LoggedStep {
    /// Number of the step, from 1.
    pub step: u64,
    message: StepMessage,
}

/// Device in a logged step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoggedDevice {
    /// Interface point [m, world].
    pub position: DVec3,
    /// Reaction force on the hand [N, world].
    pub force_on_hand: DVec3,
    /// Proxy [m, world].
    pub proxy: DVec3,
}

impl<'a> LogReader<'a> {
    /// Log from the bytes of its file.
    ///
    /// # Errors
    /// If they are no MCAP file, or have neither a summary nor a whole step.
    pub fn new(bytes: impl Into<Cow<'a, [u8]>>) -> Result<Self, Error> {
        let bytes = bytes.into();
        if let Some(summary) = summary_of(&bytes) {
            return Ok(Self { end: bytes.len(), bytes, summary, is_cut: false });
        }
        let Scan { summary, whole, .. } = Scan::new(&bytes)?;
        if step_count(&summary) == 0 {
            return Err(LogError::NoWholeStep.into());
        }
        Ok(Self { bytes, end: whole, summary, is_cut: true })
    }

    /// Whether the log lacks its summary: its writer was killed, or the disk full.
    pub fn is_cut(&self) -> bool {
        self.is_cut
    }

    fn bytes(&self) -> &[u8] {
        &self.bytes[..self.end]
    }

    /// Metadata about the scene.
    ///
    /// # Errors
    /// If there is none: the file was not written by palpate.
    pub fn metadata(&self) -> Result<BTreeMap<String, String>, Error> {
        Ok(self.metadata_record("palpate")?.ok_or(LogError::NotPalpate)?)
    }

    /// Initial states of the objects; `None` in logs of the first two forms, whose objects start as their scene says.
    ///
    /// # Errors
    /// If an object is missing.
    pub fn start(&self, names: &SceneNames) -> Result<Option<Vec<ObjectSnapshot>>, Error> {
        let Some(starts) = self.metadata_record(START)? else { return Ok(None) };
        let motion = |name: &String| {
            let text = starts.get(name);
            let text = text.ok_or_else(|| LogError::StartMissing { object: name.clone() })?;
            serde_json::from_str::<StartMessage>(text).map(ObjectSnapshot::from).map_err(unreadable)
        };
        names.objects.iter().map(motion).collect::<Result<_, _>>().map(Some)
    }

    fn metadata_record(&self, name: &str) -> Result<Option<BTreeMap<String, String>>, Error> {
        let index = self.summary.metadata_indexes.iter().find(|index| index.name == name);
        let read = |index: &MetadataIndex| match record_layout::record_at(self.bytes(), index.offset) {
            Ok(Record::Metadata(record)) => Ok(record.metadata),
            Ok(_) => Err(unreadable(McapError::BadIndex)),
            Err(error) => Err(unreadable(error)),
        };
        index.map(read).transpose()
    }

    /// Names and contents of the files that the scene was read from.
    ///
    /// # Errors
    /// If one can't be read.
    pub fn files(&self) -> Result<Vec<(String, Vec<u8>)>, Error> {
        let read = |index: &AttachmentIndex| match record_layout::record_at(self.bytes(), index.offset) {
            Ok(Record::Attachment { header, data, .. }) => Ok((header.name, data.into_owned())),
            Ok(_) => Err(unreadable(McapError::BadIndex)),
            Err(error) => Err(unreadable(error)),
        };
        self.summary.attachment_indexes.iter().map(read).collect()
    }

    /// Number of steps.
    pub fn step_count(&self) -> u64 {
        step_count(&self.summary)
    }

    /// Steps in order. After an error there are no more.
    pub fn logged_steps(&self) -> impl Iterator<Item = Result<LoggedStep, Error>> {
        let mut steps = self.step_cursor();
        std::iter::from_fn(move || steps.next(self))
    }

    /// Place before the first step.
    pub fn step_cursor(&self) -> StepCursor {
        StepCursor { records: RecordReader::new(self.bytes()), channel: step_channel(&self.summary) }
    }
}

/// Place among the steps of a log, for a program that reads them bit by bit.
pub struct StepCursor {
    records: RecordReader,
    channel: Option<u16>,
}

impl StepCursor {
    /// Next step of the log that the cursor was made for; `None` at the end, and after an error.
    pub fn next(&mut self, log: &LogReader) -> Option<Result<LoggedStep, Error>> {
        let channel = self.channel?;
        let step = |opcode, data: &[u8]| -> Result<Option<StepMessage>, Error> {
            if opcode != MESSAGE {
                return Ok(None);
            }
            match record_layout::parse(MESSAGE, data).map_err(unreadable)? {
                Record::Message { header, data } if header.channel_id == channel => {
                    serde_json::from_slice(&data).map(Some).map_err(unreadable)
                }
                _ => Ok(None),
            }
        };
        let found = loop {
            match self.records.next(log.bytes(), step)?.map_err(unreadable).and_then(|step| step) {
                Ok(None) => {}
                Ok(Some(message)) => break Ok(LoggedStep { step: message.step, message }),
                Err(error) => break Err(error),
            }
        };
        if found.is_err() {
            self.channel = None;
        }
        Some(found)
    }
}

impl LoggedStep {
    /// Delay of the cycle after its deadline [µs].
    pub fn lateness_us(&self) -> f64 {
        self.message.timing.late_us
    }

    /// Compute time of the cycle [µs].
    pub fn compute_us(&self) -> f64 {
        self.message.timing.compute_us
    }

    /// Devices by name, in no order.
    pub fn devices(&self) -> impl Iterator<Item = (&str, LoggedDevice)> {
        let device = |own: &DeviceMessage| LoggedDevice {
            position: own.position.into(),
            force_on_hand: own.force.into(),
            proxy: own.proxy.into(),
        };
        self.message.devices.iter().map(move |(name, own)| (name.as_str(), device(own)))
    }

    /// Objects by name, in no order: placement and velocity at the end of the step.
    pub fn objects(&self) -> impl Iterator<Item = (&str, Pose, Twist)> {
        self.message.objects.iter().map(|(name, own)| {
            let twist = Twist { linear: own.velocity.into(), angular: own.angular_velocity.into() };
            (name.as_str(), own.pose.into(), twist)
        })
    }

    /// Energy ledger of the scene; its defect is not logged.
    pub fn energy(&self) -> EnergyLedger {
        (&self.message.energy).into()
    }

    /// Input of the step. `modes` are the modes of active devices that hold nothing.
    ///
    /// # Errors
    /// If a device or an obstacle is missing.
    pub fn input(&self, names: &SceneNames, modes: &[DeviceMode]) -> Result<Input, Error> {
        let step = self.step;
        let missing = |name: &String| LogError::PartMissing { step, name: name.clone() };
        let gravity = self.message.gravity.map(DVec3::from);
        let mut input = Input { gravity, ..Input::default() };
        for (name, mode) in names.devices.iter().zip(modes) {
            let device = self.message.devices.get(name).ok_or_else(|| missing(name))?;
            let mode = match (device.holds, device.exerts) {
                _ if device.suspended => DeviceMode::Suspended,
                _ if !device.present => DeviceMode::Inactive,
                (Some(hold), _) => DeviceMode::Held(hold.into()),
                (None, Some(applied)) => DeviceMode::Force(applied.into()),
                (None, None) => *mode,
            };
            input.devices.push(DeviceInput { position: device.position.into(), mode });
        }
        for name in &names.obstacles {
            input.obstacles.push((*self.message.obstacles.get(name).ok_or_else(|| missing(name))?).into());
        }
        let base = |name: &String| self.message.bases.get(name).map(|position| DVec3::from(*position));
        input.bases = names.objects.iter().map(base).collect();
        for name in &names.clamps {
            let clamp = self.message.clamps.get(name).ok_or_else(|| missing(name))?;
            input.clamps.push(clamp.frame.into());
        }
        Ok(input)
    }

    /// First number of the output that differs in any bit: its name, logged value and replayed value.
    pub fn first_difference(&self, names: &SceneNames, output: &Output) -> Option<(String, f64, f64)> {
        let vector = |name: String, logged: DVec3, now: DVec3| {
            let axes = ["x", "y", "z"].into_iter().zip(logged.to_array()).zip(now.to_array());
            let mut off = axes.filter(|((_, a), b)| a.to_bits() != b.to_bits());
            off.next().map(|((axis, a), b)| (format!("{name}.{axis}"), a, b))
        };
        for (name, now) in names.devices.iter().zip(&output.devices) {
            let Some(logged) = self.message.devices.get(name) else { continue };
            let force = vector(format!("{name}.force"), logged.force.into(), now.force_on_hand);
            let proxy = || vector(format!("{name}.proxy"), logged.proxy.into(), now.proxy);
            if let Some(found) = force.or_else(proxy) {
                return Some(found);
            }
        }
        for (name, now) in names.objects.iter().zip(&output.objects) {
            let Some(logged) = self.message.objects.get(name) else { continue };
            let pose = Pose::from(logged.pose);
            let found = vector(format!("{name}.position"), pose.position, now.pose.position)
                .or_else(|| {
                    let (a, b) = (pose.orientation, now.pose.orientation);
                    let same = a.to_array().map(f64::to_bits) == b.to_array().map(f64::to_bits);
                    (!same).then(|| (format!("{name}.orientation.w"), a.w, b.w))
                })
                .or_else(|| vector(format!("{name}.velocity"), logged.velocity.into(), now.twist.linear))
                .or_else(|| {
                    vector(
                        format!("{name}.angular_velocity"),
                        logged.angular_velocity.into(),
                        now.twist.angular,
                    )
                });
            if found.is_some() {
                return found;
            }
        }
        for (name, now) in names.clamps.iter().zip(&output.clamps) {
            let Some(logged) = self.message.clamps.get(name) else { continue };
            let force = vector(format!("{name}.force"), logged.force.into(), now.force);
            let torque = || vector(format!("{name}.torque"), logged.torque.into(), now.torque);
            if let Some(found) = force.or_else(torque) {
                return Some(found);
            }
        }
        energy_difference(&self.message.energy, &output.energy)
    }
}

fn energy_difference(logged: &EnergyMessage, now: &EnergyLedger) -> Option<(String, f64, f64)> {
    // The defect is round-off of the sums, and is not logged.
    let pairs = EnergyLedger::from(logged).named().into_iter().zip(now.named());
    let mut off = pairs.filter(|((name, a), (_, b))| *name != "defect" && a.to_bits() != b.to_bits());
    off.next().map(|((name, a), (_, b))| (format!("energy.{name}"), a, b))
}
