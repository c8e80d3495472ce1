//! Check of the positions that a caller gives: whether they look as if given in millimetres.

use crate::motion::Kind;
use crate::warnings::Told;
use glam::DVec3;
use palpate::{DeviceMode, State};
use palpate_scene::{RunCheck, Scene};
use pyo3::prelude::*;

/// Check for the next steps of a state.
pub struct PositionCheck<'a> {
    pub scene: &'a Scene,
    pub check: &'a mut RunCheck,
    pub state: &'a State,
    /// Modes of the devices.
    pub modes: &'a [DeviceMode],
    pub told: &'a Told,
}

/// Numbers of a kind of parts: their rows begin at the number `first`, and again after every `stride` numbers.
pub struct Given<'n> {
    pub kind: Kind,
    pub numbers: &'n [f64],
    pub first: usize,
    pub stride: usize,
}

impl PositionCheck<'_> {
    /// Check where parts go, and warn of those that go far from the objects.
    pub fn check(&mut self, py: Python<'_>, given: &Given<'_>) -> PyResult<()> {
        let (scene, modes) = (self.scene, self.modes);
        match given.kind {
            Kind::Devices => {
                let has_position =
                    |mode: &DeviceMode| matches!(mode, DeviceMode::Touch | DeviceMode::Held(_));
                let devices = scene.devices.iter().zip(modes).enumerate();
                let mut devices = devices.filter(|(_, (_, mode))| has_position(mode));
                devices.try_for_each(|(part, (own, _))| self.check_part(py, given, part, (&own.name, None)))
            }
            Kind::Obstacles => {
                let mut obstacles = scene.obstacles.iter().enumerate();
                obstacles.try_for_each(|(part, own)| {
                    self.check_part(py, given, part, (&own.name, Some(own.start.position)))
                })
            }
            Kind::Clamps => {
                let mut clamps = scene.clamps.iter().enumerate();
                clamps.try_for_each(|(part, own)| self.check_part(py, given, part, (&own.name, None)))
            }
        }
    }

    /// Check of a part, which may be where the scene has put it.
    fn check_part(
        &mut self,
        py: Python<'_>,
        given: &Given<'_>,
        part: usize,
        (name, start): (&str, Option<DVec3>),
    ) -> PyResult<()> {
        let Given { kind, numbers, first, stride } = *given;
        let rows = (first + part * kind.columns()..numbers.len()).step_by(stride.max(1));
        let positions = rows.map(|at| DVec3::from_slice(&numbers[at..]));
        let moved = positions.filter(|position| Some(*position) != start);
        self.told.tell(py, self.check.add_positions(self.scene, name, moved, self.state))
    }
}
