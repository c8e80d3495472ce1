//! Buffers of a state's output, in the interface's types.

use crate::types::{
    ClampOutput, ContactOutput, DeviceOutput, Energy, ObjectOutput, ObstacleOutput, StepStatus,
};
use palpate::Output;

/// Output in the interface's types; buffers are made once.
pub(crate) struct Buffers {
    pub devices: Vec<DeviceOutput>,
    pub objects: Vec<ObjectOutput>,
    pub obstacles: Vec<ObstacleOutput>,
    pub clamps: Vec<ClampOutput>,
    pub contacts: Vec<ContactOutput>,
    pub energy: Energy,
    pub status: StepStatus,
}

impl Buffers {
    /// Output of a state, with room for all contacts that it can have.
    pub fn of(output: &Output) -> Self {
        let mut contacts = Vec::with_capacity(output.contacts.capacity());
        contacts.extend(output.contacts.iter().map(ContactOutput::from));
        Self {
            devices: output.devices.iter().map(DeviceOutput::from).collect(),
            objects: output.objects.iter().map(ObjectOutput::from).collect(),
            obstacles: output.obstacles.iter().map(ObstacleOutput::from).collect(),
            clamps: output.clamps.iter().map(ClampOutput::from).collect(),
            contacts,
            energy: (&output.energy).into(),
            status: (&output.status).into(),
        }
    }

    /// Takes the output of a step. No allocation.
    pub fn update(&mut self, output: &Output) {
        refill(&mut self.devices, &output.devices);
        refill(&mut self.objects, &output.objects);
        refill(&mut self.obstacles, &output.obstacles);
        refill(&mut self.clamps, &output.clamps);
        refill(&mut self.contacts, &output.contacts);
        self.energy = (&output.energy).into();
        self.status = (&output.status).into();
    }
}

impl Buffers {
    /// Takes the forces away.
    pub fn release(&mut self) {
        let zero = glam::DVec3::ZERO.into();
        self.devices.iter_mut().for_each(|device| device.force_on_hand = zero);
        self.objects.iter_mut().for_each(|object| (object.force, object.torque) = (zero, zero));
        self.obstacles.iter_mut().for_each(|obstacle| (obstacle.force, obstacle.torque) = (zero, zero));
        self.clamps.iter_mut().for_each(|clamp| (clamp.force, clamp.torque) = (zero, zero));
        self.contacts.clear();
    }
}

fn refill<'a, T: From<&'a S>, S>(own: &mut Vec<T>, from: &'a [S]) {
    own.clear();
    own.extend(from.iter().map(T::from));
}
