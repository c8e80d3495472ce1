//! Binary frames: the state of a scene at one step, with modal coordinates or with all surface vertices.

use super::bytes::Bytes;
use super::surface::mode_scales;
use glam::DVec3;
use palpate::{Collider, ContactOutput, DeviceMode, Model, ResidualFieldCache};
use palpate_haptics::Snapshot;
use serde::Deserialize;
use std::sync::Arc;

/// Magic number, `PLPF`.
const MAGIC: u32 = u32::from_le_bytes(*b"PLPF");

/// Maximum number of contacts in a frame, 16 kB; the strongest are kept. The page sums them per pair, so that few of them would show less
/// than the weight of an object that lies on many nodes.
const MAX_CONTACTS: usize = 512;

/// Residual displacements below this are not sent [m].
const MIN_RESIDUAL: f64 = 1e-9;

/// Largest number of an object or a collider in a contact: 15 bits.
const NUMBER: u32 = 0x7fff;

/// Format of the surfaces in a frame.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum FrameFormat {
    /// Modal coordinates and residual displacements; the page reconstructs the surface.
    Modal,
    /// Positions of all surface nodes.
    Vertices,
}

/// Encodes snapshots of a model as frames, with reused buffers.
#[derive(Debug)]
pub struct FrameEncoder {
    model: Arc<Model>,
    generation: u32,
    /// Scale of each mode per object [1/√kg].
    scales: Vec<Vec<f64>>,
    /// Nodal displacements of one object [m, body].
    displacements: Vec<DVec3>,
    residual_caches: Vec<ResidualFieldCache>,
    strongest: Vec<ContactOutput>,
}

impl FrameEncoder {
    /// Encoder for the scene of a generation.
    pub fn new(model: Arc<Model>, generation: u32) -> Self {
        let scales = model.recordings().map(|recording| mode_scales(&recording.modes)).collect();
        let max_nodes = model.recordings().map(|recording| recording.surface.positions.len()).max();
        let displacements = vec![DVec3::ZERO; max_nodes.unwrap_or(0)];
        let residual_caches = vec![ResidualFieldCache::default(); model.recordings().count()];
        Self { model, generation, scales, displacements, residual_caches, strongest: Vec::new() }
    }

    /// Encoded frame of a snapshot. Cost: modes plus nodes near contacts (modal), or nodes × modes (vertices).
    pub fn encode(&mut self, snapshot: &Snapshot, format: FrameFormat) -> Vec<u8> {
        let mut out = Bytes::default();
        out.u32(MAGIC);
        out.u32(match format {
            FrameFormat::Modal => 1,
            FrameFormat::Vertices => 2,
        });
        out.u32(self.generation);
        out.u32(snapshot.step as u32);
        out.f64(snapshot.output.time_s);
        snapshot.output.energy.named().into_iter().for_each(|(_, energy)| out.f32(energy));
        self.select_contacts(&snapshot.output.contacts);
        let (obstacles, devices) = (&snapshot.input.obstacles, &snapshot.input.devices);
        for count in [snapshot.objects.len(), obstacles.len(), devices.len(), self.strongest.len()] {
            out.u32(count as u32);
        }
        let status = &snapshot.output.status;
        let (unsolved, dropped) = (status.unsolved_islands > 0, status.dropped_contacts > 0);
        out.u32(u32::from(unsolved) | u32::from(dropped) << 1);
        out.u32(0);
        for (index, object) in snapshot.objects.iter().enumerate() {
            out.pose(&object.pose());
            let Some(surface) = self.model.recordings().nth(index).map(|recording| &recording.surface) else {
                continue;
            };
            let displacements = &mut self.displacements[..surface.positions.len()];
            let cache = &mut self.residual_caches[index];
            match format {
                FrameFormat::Modal => {
                    let q = object.modal_coordinates();
                    out.u32(q.len() as u32);
                    q.iter().zip(&self.scales[index]).for_each(|(q, scale)| out.f32(q * scale));
                    object.residual_displacements(&self.model, cache, displacements);
                    write_residuals(displacements, &mut out);
                }
                FrameFormat::Vertices => {
                    object.surface_displacement_cached(&self.model, cache, displacements);
                    out.u32(displacements.len() as u32);
                    let nodes = displacements.iter().zip(&surface.positions);
                    nodes.for_each(|(u, rest)| out.vector(*rest + *u));
                }
            }
        }
        obstacles.iter().zip(&self.model.parameters().obstacles).for_each(|(pose, obstacle)| {
            out.pose(&super::description::display_pose(&obstacle.shape, pose));
        });
        for (input, output) in devices.iter().zip(&snapshot.output.devices) {
            out.u32(match input.mode {
                DeviceMode::Inactive | DeviceMode::Suspended => 0,
                DeviceMode::Touch => 1,
                DeviceMode::Held(_) | DeviceMode::Force(_) => 2,
            });
            [input.hand(output), output.proxy, output.force_on_hand].into_iter().for_each(|v| out.vector(v));
        }
        for contact in &self.strongest {
            out.u32(sides(contact.object, contact.against));
            [contact.point, contact.force].into_iter().for_each(|v| out.vector(v));
            out.f32(contact.slip_speed);
        }
        out.0
    }

    fn select_contacts(&mut self, contacts: &[ContactOutput]) {
        self.strongest.clear();
        self.strongest.extend_from_slice(contacts);
        if self.strongest.len() > MAX_CONTACTS {
            let force = |contact: &ContactOutput| contact.force.length_squared();
            self.strongest.select_nth_unstable_by(MAX_CONTACTS - 1, |a, b| force(b).total_cmp(&force(a)));
            self.strongest.truncate(MAX_CONTACTS);
        }
    }
}

/// Sides of a contact in one word: the collider's kind, the object's number, the collider's number.
fn sides(object: usize, against: Collider) -> u32 {
    let (kind, index) = match against {
        Collider::Device(index) => (0, index),
        Collider::Obstacle(index) => (1, index),
        Collider::Object(index) => (2, index),
    };
    kind | (object as u32 & NUMBER) << 2 | (index as u32) << 17
}

/// Residual displacements of at least half a unit, in units of 1/127 of the largest component.
fn write_residuals(residuals: &[DVec3], out: &mut Bytes) {
    let largest = residuals.iter().map(|residual| residual.abs().max_element()).fold(0.0, f64::max);
    let unit = largest / 127.0;
    let relevant = |residual: &DVec3| largest > MIN_RESIDUAL && residual.abs().max_element() >= 0.5 * unit;
    let mut differences: Vec<u16> = Vec::new();
    let mut values: Vec<i8> = Vec::new();
    let mut last = 0;
    for (node, residual) in residuals.iter().enumerate().filter(|(_, residual)| relevant(residual)) {
        while node - last > usize::from(u16::MAX) {
            differences.push(u16::MAX);
            values.extend([0; 3]);
            last += usize::from(u16::MAX);
        }
        differences.push((node - last) as u16);
        values.extend(residual.to_array().map(|x| (x / unit).round() as i8));
        last = node;
    }
    out.u32(differences.len() as u32);
    out.f32(unit);
    differences.iter().for_each(|d| out.0.extend_from_slice(&d.to_le_bytes()));
    out.pad();
    out.0.extend(values.iter().map(|value| *value as u8));
    out.pad();
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read_residuals(bytes: &[u8], nodes: usize) -> Vec<DVec3> {
        let word = |at: usize| <[u8; 4]>::try_from(&bytes[at..at + 4]).expect("four bytes");
        let (k, unit) = (u32::from_le_bytes(word(0)) as usize, f64::from(f32::from_le_bytes(word(4))));
        let values = 8 + (2 * k).next_multiple_of(4);
        assert_eq!(bytes.len(), values + (3 * k).next_multiple_of(4));
        let mut residuals = vec![DVec3::ZERO; nodes];
        let mut node = 0;
        for at in 0..k {
            node += usize::from(u16::from_le_bytes([bytes[8 + 2 * at], bytes[9 + 2 * at]]));
            let axis = |axis: usize| f64::from(bytes[values + 3 * at + axis] as i8) * unit;
            residuals[node] += DVec3::new(axis(0), axis(1), axis(2));
        }
        residuals
    }

    #[test]
    fn sides_of_a_contact_keep_numbers_beyond_a_byte() {
        // As in viewer/tests/unit/frame.test.ts.
        assert_eq!(sides(300, Collider::Obstacle(5)), 1 | 300 << 2 | 5 << 17);
        assert_eq!(sides(0x7fff, Collider::Object(0x7fff)), 0xffff_fffe);
    }

    #[test]
    fn residuals_are_decoded_within_half_a_unit_also_far_apart() {
        let nodes = 200_000;
        let mut residuals = vec![DVec3::ZERO; nodes];
        residuals[0] = DVec3::new(1e-3, -2e-4, 0.0);
        residuals[7] = DVec3::new(-3e-6, 2e-6, 1e-6);
        residuals[150_000] = DVec3::new(5e-5, 0.0, -1e-3);
        let mut out = Bytes::default();
        write_residuals(&residuals, &mut out);
        for (node, residual) in read_residuals(&out.0, nodes).into_iter().enumerate() {
            assert!(
                (residual - residuals[node]).abs().max_element() <= 0.51e-3 / 127.0,
                "{node}: {residual}"
            );
        }
        assert!(out.0.len() < 64, "{} bytes", out.0.len());
        let mut none = Bytes::default();
        write_residuals(&vec![DVec3::ZERO; 10], &mut none);
        assert_eq!(none.0.len(), 8);
    }
}
