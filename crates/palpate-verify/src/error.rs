//! Reasons why a case could not be computed.

use palpate_fem::RecordError;
use palpate_mesh::MeshError;

/// A case that could not be computed; one that was computed and failed is no error.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum VerifyError {
    /// A mesh.
    #[error(transparent)]
    Mesh(#[from] MeshError),
    /// A recording.
    #[error(transparent)]
    Record(#[from] RecordError),
    /// A model.
    #[error(transparent)]
    Model(#[from] palpate::Error),
    /// A built-in scene.
    #[error(transparent)]
    Scene(#[from] palpate_scene::SceneError),
    /// A device or its path.
    #[error(transparent)]
    Haptics(#[from] palpate_haptics::Error),
    /// A factorisation or an eigenvalue problem.
    #[error("{0}")]
    Numerics(String),
    /// A run that never got to what is to be measured.
    #[error("{0}")]
    NotReached(&'static str),
}

/// A name that no case has.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("there is no case {name:?}; the cases are {}", known.join(", "))]
pub struct UnknownCase {
    /// The name that was asked for.
    pub name: String,
    /// Names of all cases.
    pub known: Vec<&'static str>,
}

/// Any error of a matrix computation.
pub(crate) fn numerics(error: impl std::fmt::Display) -> VerifyError {
    VerifyError::Numerics(error.to_string())
}
