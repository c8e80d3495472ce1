//! Snapshot of an object's deformation, from which another thread computes its surface (paper, section 3.2).

use crate::object::Object;
use crate::response::{DeformationData, ResidualFields};
use crate::scene::Model;
use crate::spatial::Pose;
use crate::state::State;
use crate::surface::SurfacePoint;
use glam::DVec3;

/// Pose and deformation of an object at the end of a step: modal coordinates and contact forces, a few hundred numbers, from
/// which another thread computes the whole surface. With a table, the forces of the last T steps.
///
/// ```no_run
/// # fn main() -> Result<(), palpate::Error> {
/// # let (model, mut state): (palpate::Model, palpate::State) = unimplemented!();
/// # let nodes = 0;
/// let mut deformation = state.deformation(0); // allocates once
/// // ... steps ...
/// deformation.copy_from(&state); // does not allocate
/// let mut displacement = vec![glam::DVec3::ZERO; nodes];
/// deformation.surface_displacement(&model, &mut displacement);
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone)]
pub struct DeformationSnapshot {
    pub(crate) object: usize,
    pub(crate) pose: Pose,
    /// Gravity that it feels [m/s², world].
    pub(crate) gravity: DVec3,
    pub(crate) data: DeformationData,
}

/// Cache of the residual displacement fields of contact patches on one object: surfaces that share it cost less where the
/// same patches press.
#[derive(Debug, Clone, Default)]
pub struct ResidualFieldCache(ResidualFields);

impl DeformationSnapshot {
    /// Number of the object in the model.
    pub fn object(&self) -> usize {
        self.object
    }

    /// Placement of the object.
    pub fn pose(&self) -> Pose {
        self.pose
    }

    /// Copy the present state of the same object.
    ///
    /// # Real time
    /// No allocation. Costs modes and contacts; with a table the forces of the last T steps.
    pub fn copy_from(&mut self, state: &State) {
        let own = &state.objects[self.object];
        (self.pose, self.gravity) = (own.rigid.pose, own.felt_gravity(state.gravity));
        self.data.copy_from(&own.response);
    }

    /// Modal coordinates q [m·√kg]; none for an object that uses a table.
    pub fn modal_coordinates(&self) -> &[f64] {
        self.data.coordinates()
    }

    /// Part of the displacement of every surface node beyond the modes, Φ·q [m, body]: residual displacement under the contact
    /// forces, and the sag of a fixed body that its modes miss. With a table, all of the displacement.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn residual_displacements(&self, model: &Model, cache: &mut ResidualFieldCache, out: &mut [DVec3]) {
        let (object, gravity) = self.object_and_gravity(model, out);
        self.data.residual_displacements((&object.response, &object.body), gravity, &mut cache.0, out);
    }

    /// Elastic displacement [m, body] of every surface node. Costs nodes × modes, with a table nodes × forces of the last T
    /// steps.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement(&self, model: &Model, out: &mut [DVec3]) {
        self.surface_displacement_cached(model, &mut ResidualFieldCache::default(), out);
    }

    /// Elastic displacement of every surface node [m, body], with a cache that surfaces of the object share.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement_cached(
        &self,
        model: &Model,
        cache: &mut ResidualFieldCache,
        out: &mut [DVec3],
    ) {
        let (object, gravity) = self.object_and_gravity(model, out);
        let object = (&object.response, &*object.body);
        self.data.surface_displacement(object, gravity, &mut cache.0, out);
    }

    /// Object, and gravity in its body axes [m/s²].
    fn object_and_gravity<'m>(&self, model: &'m Model, out: &[DVec3]) -> (&'m Object, DVec3) {
        let object: &Object = &model.objects[self.object];
        assert_eq!(out.len(), object.body.recording.surface.positions.len(), "one entry per surface node");
        (object, object.gravity_in_body(self.gravity, &self.pose))
    }
}

impl State {
    /// Elastic displacement of every surface node of an object at the end of the last step [m, body]. Costs nodes × modes, with
    /// a table nodes × forces of the last T steps: for rendering, not for the force.
    ///
    /// # Panics
    /// When `out` does not have one entry per surface node.
    pub fn surface_displacement(&self, model: &Model, object: usize, out: &mut [DVec3]) {
        self.deformation(object).surface_displacement(model, out);
    }

    /// Elastic displacement of a surface point of an object at the end of the last step [m, body].
    ///
    /// # Real time
    /// No allocation. Costs modes and contacts; with a table the forces of the last T steps.
    ///
    /// # Panics
    /// When the model has no such object, or the object no such point.
    pub fn point_displacement(&self, model: &Model, object: usize, point: &SurfacePoint) -> DVec3 {
        let (body, own) = (&model.objects[object], &self.objects[object]);
        let gravity = body.gravity_in_body(own.felt_gravity(self.gravity), &own.rigid.pose);
        own.response.displacement_at((&body.response, &body.body), point, gravity)
    }

    /// Snapshot of an object's deformation at the end of the last step.
    pub fn deformation(&self, object: usize) -> DeformationSnapshot {
        let own = &self.objects[object];
        DeformationSnapshot {
            object,
            pose: own.rigid.pose,
            gravity: own.felt_gravity(self.gravity),
            data: own.response.deformation(),
        }
    }
}
