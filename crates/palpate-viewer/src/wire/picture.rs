//! Pictures: what a moment looks like, in few bytes or as whole surfaces.

use super::bytes::Bytes;
use super::surface::mode_scales;
use glam::DVec3;
use palpate::{Collider, ContactOutput, DeviceMode, Model, ResidualFieldCache};
use palpate_haptics::Snapshot;
use std::sync::Arc;

/// `PLPF`.
const MAGIC: u32 = u32::from_le_bytes(*b"PLPF");

/// Contacts that a picture tells of, the strongest.
const MOST_CONTACTS: usize = 64;

/// Dents below this [m] are none.
const FLAT: f64 = 1e-9;

/// How surfaces are sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FrameFormat {
    /// Modal coordinates and dents: the page makes the surface.
    Modal,
    /// Where every node is.
    Vertices,
}

/// Makes pictures of a model's moments; its buffers are used again.
#[derive(Debug)]
pub struct FrameEncoder {
    model: Arc<Model>,
    generation: u32,
    /// Of every object's modes.
    scales: Vec<Vec<f64>>,
    places: Vec<DVec3>,
    memories: Vec<ResidualFieldCache>,
    strongest: Vec<ContactOutput>,
}

impl FrameEncoder {
    /// For a scene that is known by a number.
    pub fn new(model: Arc<Model>, generation: u32) -> Self {
        let scales = model.recordings().map(|recording| mode_scales(&recording.modes)).collect();
        let most = model.recordings().map(|recording| recording.surface.positions.len()).max();
        let places = vec![DVec3::ZERO; most.unwrap_or(0)];
        let memories = vec![ResidualFieldCache::default(); model.recordings().count()];
        Self { model, generation, scales, places, memories, strongest: Vec::new() }
    }

    /// The picture of a moment. Modal: costs modes, and nodes near contacts; vertices: nodes × modes.
    pub fn make(&mut self, moment: &Snapshot, form: FrameFormat) -> Vec<u8> {
        let mut out = Bytes::default();
        out.u32(MAGIC);
        out.u32(match form {
            FrameFormat::Modal => 1,
            FrameFormat::Vertices => 2,
        });
        out.u32(self.generation);
        out.u32(moment.step as u32);
        out.f64(moment.time_s);
        moment.energy.named().into_iter().for_each(|(_, energy)| out.f32(energy));
        self.choose_contacts(&moment.contacts);
        let (obstacles, devices) = (&moment.input.obstacles, &moment.input.devices);
        for count in [moment.objects.len(), obstacles.len(), devices.len(), self.strongest.len()] {
            out.u32(count as u32);
        }
        let (unsolved, left_out) = (moment.status.unsolved_islands > 0, moment.status.dropped_contacts > 0);
        out.u32(u32::from(unsolved) | u32::from(left_out) << 1);
        out.u32(0);
        for (at, object) in moment.objects.iter().enumerate() {
            out.pose(&object.pose());
            let Some(surface) = self.model.recordings().nth(at).map(|recording| &recording.surface) else {
                continue;
            };
            let places = &mut self.places[..surface.positions.len()];
            let memory = &mut self.memories[at];
            match form {
                FrameFormat::Modal => {
                    let q = object.modal_coordinates();
                    out.u32(q.len() as u32);
                    q.iter().zip(&self.scales[at]).for_each(|(q, scale)| out.f32(q * scale));
                    object.residual_displacements(&self.model, memory, places);
                    write_dents(places, &mut out);
                }
                FrameFormat::Vertices => {
                    object.surface_displacement_cached(&self.model, memory, places);
                    out.u32(places.len() as u32);
                    let moved = places.iter().zip(&surface.positions);
                    moved.for_each(|(u, rest)| out.vector(*rest + *u));
                }
            }
        }
        obstacles.iter().zip(&self.model.parameters().obstacles).for_each(|(pose, obstacle)| {
            out.pose(&super::description::shown_pose(&obstacle.shape, pose));
        });
        for (input, output) in devices.iter().zip(&moment.devices) {
            out.u32(match input.mode {
                DeviceMode::Inactive => 0,
                DeviceMode::Touch => 1,
                DeviceMode::Held(_) => 2,
            });
            [input.position, output.proxy, output.force_on_hand].into_iter().for_each(|v| out.vector(v));
        }
        for contact in &self.strongest {
            let (kind, number) = match contact.against {
                Collider::Device(at) => (0, at),
                Collider::Obstacle(at) => (1, at),
                Collider::Object(at) => (2, at),
            };
            out.u32(contact.object as u32 & 0xff | kind << 8 | (number as u32) << 16);
            [contact.point, contact.force].into_iter().for_each(|v| out.vector(v));
            out.f32(contact.slip_speed);
        }
        out.0
    }

    fn choose_contacts(&mut self, contacts: &[ContactOutput]) {
        self.strongest.clear();
        self.strongest.extend_from_slice(contacts);
        if self.strongest.len() > MOST_CONTACTS {
            let force = |contact: &ContactOutput| contact.force.length_squared();
            self.strongest.select_nth_unstable_by(MOST_CONTACTS - 1, |a, b| force(b).total_cmp(&force(a)));
            self.strongest.truncate(MOST_CONTACTS);
        }
    }
}

/// Nodes that are dented by more than half a 127th of the deepest dent, with their dents in 127ths.
fn write_dents(dents: &[DVec3], out: &mut Bytes) {
    let deepest = dents.iter().map(|dent| dent.abs().max_element()).fold(0.0, f64::max);
    let unit = deepest / 127.0;
    let dented = |dent: &DVec3| deepest > FLAT && dent.abs().max_element() >= 0.5 * unit;
    let mut steps: Vec<u16> = Vec::new();
    let mut values: Vec<i8> = Vec::new();
    let mut last = 0;
    for (node, dent) in dents.iter().enumerate().filter(|(_, dent)| dented(dent)) {
        while node - last > usize::from(u16::MAX) {
            steps.push(u16::MAX);
            values.extend([0; 3]);
            last += usize::from(u16::MAX);
        }
        steps.push((node - last) as u16);
        values.extend(dent.to_array().map(|x| (x / unit).round() as i8));
        last = node;
    }
    out.u32(steps.len() as u32);
    out.f32(unit);
    steps.iter().for_each(|step| out.0.extend_from_slice(&step.to_le_bytes()));
    out.pad();
    out.0.extend(values.iter().map(|value| *value as u8));
    out.pad();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_dents(bytes: &[u8], nodes: usize) -> Vec<DVec3> {
        let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).expect("four bytes");
        let (k, unit) = (u32::from_le_bytes(word(0)) as usize, f64::from(f32::from_le_bytes(word(4))));
        let values = 8 + (2 * k).next_multiple_of(4);
        assert_eq!(bytes.len(), values + (3 * k).next_multiple_of(4));
        let mut dents = vec![DVec3::ZERO; nodes];
        let mut node = 0;
        for at in 0..k {
            node += usize::from(u16::from_le_bytes([bytes[8 + 2 * at], bytes[9 + 2 * at]]));
            let axis = |axis: usize| f64::from(bytes[values + 3 * at + axis] as i8) * unit;
            dents[node] += DVec3::new(axis(0), axis(1), axis(2));
        }
        dents
    }

    #[test]
    fn dents_come_back_within_half_a_unit_also_far_apart() {
        let nodes = 200_000;
        let mut dents = vec![DVec3::ZERO; nodes];
        dents[0] = DVec3::new(1e-3, -2e-4, 0.0);
        dents[7] = DVec3::new(-3e-6, 2e-6, 1e-6);
        dents[150_000] = DVec3::new(5e-5, 0.0, -1e-3);
        let mut out = Bytes::default();
        write_dents(&dents, &mut out);
        for (node, dent) in read_dents(&out.0, nodes).into_iter().enumerate() {
            assert!((dent - dents[node]).abs().max_element() <= 0.51e-3 / 127.0, "{node}: {dent}");
        }
        assert!(out.0.len() < 64, "{} bytes", out.0.len());
        let mut none = Bytes::default();
        write_dents(&vec![DVec3::ZERO; 10], &mut none);
        assert_eq!(none.0.len(), 8);
    }
}
