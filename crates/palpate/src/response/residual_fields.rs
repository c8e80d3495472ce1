//! Cache of residual displacement fields: displacement of every model node per unit force on a contact patch.
//!
//! ```text
//! A_c = Σᵢ wᵢ·S_·ᵢ        S·f = Σ_c A_c·f_c
//! ```
//!
//! w are the weights of the patch about node c, S [m/N] the residual compliance. The patches of a resting face press in every
//! rendered frame, and each loads dozens of nodes of a whole S.

use super::{Body, Footprint, SpringForce};
use alloc::collections::BTreeMap;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Number of cached patches above which unused ones are dropped: some faces in contact, and a moving finger.
const MAX_CACHED: usize = 256;

/// Cached fields by patch index and node: a 3×3 matrix [m/N] for every model node, column by column, and the frame of the
/// last use.
#[derive(Debug, Clone, Default)]
pub(crate) struct ResidualFields {
    fields: BTreeMap<(u32, u32), (Vec<f32>, u64)>,
    /// Number of frames so far.
    frame: u64,
}

impl ResidualFields {
    /// Add the residual displacements of the model's nodes under forces on patches to `out` [m, body]. Gives whether it does: only for a whole S.
    pub(super) fn add(&mut self, body: &Body, patches: &[SpringForce], out: &mut [DVec3]) -> bool {
        if !body.recording.residual.is_whole() {
            return false;
        }
        self.frame += 1;
        for SpringForce { location, force, .. } in patches {
            let Footprint::Patch(index) = location.footprint else { continue };
            for (corner, weight) in body.corners(location).into_iter().filter(|(_, weight)| *weight != 0.0) {
                let entry = self.fields.entry((index, corner as u32));
                let (field, used) =
                    entry.or_insert_with(|| (compliance_field(body, location.footprint, corner), 0));
                *used = self.frame;
                let force = (*force * weight).as_vec3();
                let (blocks, _) = field.as_chunks::<9>();
                for (u, [a, b, c, d, e, f, g, h, i]) in out.iter_mut().zip(blocks) {
                    u.x += f64::from(a * force.x + d * force.y + g * force.z);
                    u.y += f64::from(b * force.x + e * force.y + h * force.z);
                    u.z += f64::from(c * force.x + f * force.y + i * force.z);
                }
            }
        }
        if self.fields.len() > MAX_CACHED {
            let now = self.frame;
            self.fields.retain(|_, (_, used)| *used == now);
        }
        true
    }
}

/// Field A_c of the patch about a node [m/N].
fn compliance_field(body: &Body, footprint: Footprint, corner: usize) -> Vec<f32> {
    let nodes = body.recording.model_nodes();
    let mut field = Vec::with_capacity(9 * nodes);
    let Some(patch) = body.patch(footprint) else { return field };
    let weights: Vec<(usize, f64)> = patch.weights.of(corner).collect();
    for node in 0..nodes {
        let block = |(other, weight): &(usize, f64)| body.recording.residual.block(node, *other) * *weight;
        let sum: DMat3 = weights.iter().map(block).sum();
        field.extend(sum.to_cols_array().map(|x| x as f32));
    }
    field
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Recording;
    use crate::spatial::{Pose, Twist};
    use crate::state::State;
    use crate::{DeviceInput, DeviceParameters, Input, Model, ModelObject, ModelParameters, ObjectStart};
    use alloc::sync::Arc;
    use alloc::vec;

    #[test]
    fn cached_fields_give_the_displacements_of_nodal_forces() {
        let bytes = include_bytes!("../../../../data/recordings/v1/free.palp");
        let recording = Arc::new(Recording::from_bytes(bytes).expect("a released recording"));
        let finger = DeviceParameters { tip_radius: 0.01, patch_radius: 0.04, ..DeviceParameters::default() };
        let parameters = ModelParameters { devices: vec![finger; 2], ..ModelParameters::default() };
        let start = ObjectStart { pose: Pose::IDENTITY, twist: Twist::ZERO };
        let model = Model::new(parameters, vec![ModelObject::new(recording, start)]).expect("a model");
        let mut state = State::new(&model);
        let mut residual_fields = ResidualFields::default();
        for number in 0..40 {
            let inwards = 0.2 * 1e-3 * f64::from(number);
            let tip = |side: f64| DeviceInput::touching(DVec3::new(side * (0.111 - inwards), 0.01, 0.01));
            let input = Input { devices: vec![tip(-1.0), tip(1.0)], ..Input::default() };
            crate::step::step(&model, &mut state, &input);
            let (body, spring_forces) = (&model.objects[0].body, state.objects[0].response.spring_forces());
            let mut displacements = vec![DVec3::ZERO; body.recording.surface.positions.len()];
            assert!(residual_fields.add(body, spring_forces, &mut displacements));
            for (node, displacement) in displacements.into_iter().enumerate() {
                let by_nodes =
                    |applied: &SpringForce| body.residual_of_node(node, &applied.location) * applied.force;
                let expected: DVec3 = spring_forces.iter().map(by_nodes).sum();
                assert!(
                    (displacement - expected).length() <= 1e-6 * expected.length() + 1e-12,
                    "{number}, {node}"
                );
            }
        }
        assert!(state.objects[0].response.spring_forces().len() > 1, "they press");
    }
}
