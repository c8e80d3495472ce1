//! What the picture of an object takes, so that it can be made beside the force (paper, section 3.2).

use crate::response::{Answers, Deformed};
use crate::scene::{Model, SceneObject};
use crate::spatial::Pose;
use crate::state::State;
use glam::DVec3;

/// Where an object is and what deforms it, at the end of a step: a few hundred numbers, which another thread can make the
/// whole surface of, at its own pace. A table's is longer: the forces of the last T steps.
///
/// ```no_run
/// # fn main() -> Result<(), palpate::Error> {
/// # let (model, mut state): (palpate::Model, palpate::State) = unimplemented!();
/// # let nodes = 0;
/// let mut deformation = state.deformation(0); // once: allocates
/// // … steps …
/// deformation.copy_from(&state); // beside the steps: does not
/// let mut displacement = vec![glam::DVec3::ZERO; nodes];
/// deformation.surface_displacement(&model, &mut displacement);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct DeformationSnapshot {
    pub(crate) object: usize,
    pub(crate) pose: Pose,
    pub(crate) deformed: Deformed,
}

/// What was computed for the pictures of one object and will be needed again: what contact patches do to its surface.
/// Pictures that share it cost less where the same places press.
#[derive(Debug, Clone, Default)]
pub struct ResidualFieldCache(Answers);

impl DeformationSnapshot {
    /// The object's place in the model.
    pub fn object(&self) -> usize {
        self.object
    }

    /// Where it is.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Take over the same object as it is now.
    ///
    /// # Real time
    /// No allocation. Costs modes and contacts; with a table the forces of the last T steps.
    pub fn copy_from(&mut self, state: &State) {
        let own = &state.objects[self.object];
        self.pose = own.rigid.pose;
        self.deformed.copy_from(&own.response);
    }

    /// Modal coordinates q [m·√kg]; none for an object that uses a table.
    pub fn modal_coordinates(&self) -> &[f64] {
        self.deformed.coordinates()
    }

    /// What [`Self::surface_displacement`] is beside Φ·q [m, body]: the dents that the residual compliance adds where forces
    /// act, and the part of a fixed body's sag that its modes miss. With a table, all of it.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn dents(&self, model: &Model, memory: &mut ResidualFieldCache, out: &mut [DVec3]) {
        let (object, gravity) = self.drawn(model, out);
        self.deformed.dents((&object.response, &object.body), gravity, &mut memory.0, out);
    }

    /// Elastic displacement [m, body] of every surface node. Costs nodes × modes, with a table nodes × forces of the last T
    /// steps.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement(&self, model: &Model, out: &mut [DVec3]) {
        self.surface_displacement_cached(model, &mut ResidualFieldCache::default(), out);
    }

    /// The same with a memory that pictures of the object share.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement_cached(
        &self,
        model: &Model,
        memory: &mut ResidualFieldCache,
        out: &mut [DVec3],
    ) {
        let (object, gravity) = self.drawn(model, out);
        let drawn = (&object.response, &object.body);
        self.deformed.surface_displacement(drawn, gravity, &mut memory.0, out);
    }

    /// The object, and gravity [m/s², body] as it is turned.
    fn drawn<'m>(&self, model: &'m Model, out: &[DVec3]) -> (&'m SceneObject, DVec3) {
        let object: &SceneObject = &model.objects[self.object];
        assert_eq!(out.len(), object.body.recording.surface.positions.len(), "one entry per surface node");
        (object, object.gravity_in_body(model.parameters.gravity, &self.pose))
    }
}
