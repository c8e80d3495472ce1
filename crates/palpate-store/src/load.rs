//! Loading of a finished store for a scene.

use crate::attributes::TableContent;
use crate::columns::StoredColumns;
use crate::error::StoreError;
use crate::table_store::{Part, TableStore};
use palpate::{GravityResponse, ImpulseResponse, ModalBasis, Recording, ResidualCompliance};

impl TableStore {
    /// Loads the body and its table for a scene: columns are read into memory on first use.
    ///
    /// # Errors
    /// [`StoreError`] when shards are missing, or its content is invalid.
    pub fn load(self) -> Result<(Recording, ImpulseResponse), StoreError> {
        let missing = self.missing(Part::ALL)?.len();
        if missing > 0 {
            return Err(StoreError::Incomplete {
                location: self.location().to_string(),
                missing,
                shards: self.shards(),
            });
        }
        let location = self.location().to_string();
        let invalid = |reason: String| StoreError::Invalid { location: location.clone(), reason };
        let sampling =
            self.content().attributes.sampling().ok_or_else(|| invalid("its sampling is unknown".into()))?;
        let recording = body(self.content());
        recording.validate().map_err(|e| invalid(e.to_string()))?;
        let content = self.content().clone();
        let (step_s, gravity) = (content.attributes.step_s, content.gravity.as_deref().unwrap_or_default());
        if !(step_s > 0.0 && step_s <= 1.0) {
            return Err(invalid(format!("its step is {step_s} s, expected above 0 and at most 1")));
        }
        if let Some(number) = gravity.iter().find(|number| !number.is_finite()) {
            return Err(invalid(format!("its gravity response holds {number}, expected finite numbers")));
        }
        let columns = StoredColumns::new(self)?;
        let table = ImpulseResponse {
            step_s: content.attributes.step_s,
            samples: content.samples,
            sampling,
            touchable_dofs: content.touchable_dofs,
            observed_dofs: content.observed_dofs,
            gravity: content.gravity,
            columns: Box::new(columns),
        };
        Ok((recording, table))
    }
}

/// Body of a table, a recording without modes.
fn body(content: &TableContent) -> Recording {
    let fixed = content.attributes.recording.support == palpate::Support::Fixed;
    let nodes = content.surface.positions.len();
    Recording {
        metadata: content.attributes.recording.clone(),
        surface: content.surface.clone(),
        modes: ModalBasis { angular_frequencies: vec![], damping_ratios: vec![], mode_shapes: vec![] },
        residual: ResidualCompliance::None,
        gravity: fixed
            .then(|| GravityResponse { modal_forces: vec![], residual_displacements: vec![0.0; 9 * nodes] }),
        sample_levels: vec![],
        embedding: None,
    }
}
