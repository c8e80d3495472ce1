//! Clamps of a step: their frames, and the held cells of their surfaces.
//!
//! Equations: docs/theory.md (C35), (C63).

use super::moved;
use crate::collision::{CandidateSide, Collider, ContactCandidate, ContactId, ContactLaw, FeatureId};
use crate::io::Input;
use crate::scene::Model;
use crate::state::{State, Workspace};
use glam::DVec3;

/// Frames at the end of the step; unusable ones stay.
pub(super) fn move_frames(state: &mut State, input: &Input) {
    let State { clamps, output, .. } = state;
    for (number, clamp) in clamps.iter_mut().enumerate() {
        clamp.start = clamp.end;
        clamp.end = moved(clamp.start, input.clamps.get(number), &mut output.status);
    }
}

/// Candidates of all cells: each is held at its point of the frame.
pub(super) fn find_contacts(model: &Model, state: &State, workspace: &mut Workspace) {
    for (number, (placed, clamp)) in model.clamps.iter().zip(&state.clamps).enumerate() {
        let object = placed.object;
        for (at, point) in placed.points.iter().enumerate() {
            let cell = placed.first_cell + at;
            let feature = FeatureId::ClampedCell(cell as u32);
            let (start, end) = (clamp.start.world_from_body(*point), clamp.end.world_from_body(*point));
            workspace.collision.candidates.push(ContactCandidate {
                id: ContactId { collider: Collider::Object(object), object, feature },
                location: model.objects[object].body.cell_location(cell),
                other: CandidateSide::Clamp { number, start, end },
                law: ContactLaw::Bilateral,
                normal: DVec3::ZERO,
                distance: 0.0,
            });
        }
    }
}
