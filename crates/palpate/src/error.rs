//! Errors of recordings and models. Input is refused at construction: a step cannot fail.

use alloc::boxed::Box;
use alloc::string::String;
use alloc::vec::Vec;

/// Refusal of a recording or a model, with a text for the author of the input.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// Recording that cannot be read, used or written.
    #[error("not a usable recording: {0}")]
    Recording(RecordingError),
    /// Model that cannot be built.
    #[error("{0}")]
    Model(ModelError),
}

/// Kind of a recording's defect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum RecordingError {
    /// Bytes that are no safetensors container, or a truncated or damaged one.
    #[error("the file is damaged, truncated or of another kind ({reason})")]
    Container {
        /// Report of the container's reader.
        reason: String,
    },
    /// Container without the metadata of a recording.
    #[error("a safetensors file, but without the metadata of palpate")]
    NotARecording,
    /// Metadata that is no JSON of the expected form.
    #[error("its metadata cannot be read: {reason}")]
    Metadata {
        /// Report of the JSON reader.
        reason: String,
    },
    /// Format version that this version of palpate does not read.
    #[error(
        "format version {found}, this palpate reads versions up to {supported}: record it again or use a newer palpate"
    )]
    UnsupportedVersion {
        /// Version of the file.
        found: u32,
        /// Version that is read.
        supported: u32,
    },
    /// Content with another hash than the file states.
    #[error("its content does not fit its hash: the file was damaged or changed after it was written")]
    HashMismatch,
    /// Body whose recording in another material needs FEM.
    #[error("this recording cannot be rescaled to another material: {reason}; record it again")]
    NotRescalable {
        /// Reason.
        reason: String,
    },
    /// Tensor that the file lacks.
    #[error("the tensor {name} is missing")]
    MissingTensor {
        /// Name of the tensor.
        name: String,
    },
    /// Tensor with other extents than the recording needs.
    #[error("{name} has the shape {found:?}, expected {expected:?}")]
    WrongShape {
        /// Name of the tensor.
        name: String,
        /// Extents in the file.
        found: Vec<usize>,
        /// Extents by the other tensors.
        expected: Vec<usize>,
    },
    /// Tensor of another number type.
    #[error("{name} holds {found}, expected {expected}")]
    WrongType {
        /// Name of the tensor.
        name: String,
        /// Number type in the file.
        found: String,
        /// Number type of the format.
        expected: String,
    },
    /// Parts whose lengths, indices or numbers contradict one another, or no body has.
    #[error("{what}")]
    Inconsistent {
        /// Part with the defect.
        part: RecordingPart,
        /// Finding and expectation.
        what: String,
    },
    /// Recording that cannot be serialised.
    #[error("{what}")]
    NotWritable {
        /// Report of the writer.
        what: String,
    },
}

/// Part of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum RecordingPart {
    /// Sampling, units and certificate.
    Metadata,
    /// Positions, triangles and source nodes.
    Surface,
    /// Levels of contact samples.
    SampleLevels,
    /// Angular frequencies, damping ratios and mode shapes.
    Modes,
    /// Residual compliance.
    Residual,
    /// Mass and inertia.
    Mass,
    /// Response to gravity.
    Gravity,
}

/// Kind of a model's defect.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Clamp that cannot be placed.
    #[error("clamp {clamp}: {what}")]
    Clamp {
        /// Number of the clamp.
        clamp: usize,
        /// Finding and expectation.
        what: String,
    },
    /// Parameter out of its range.
    #[error("{what}")]
    Parameter {
        /// Name of the parameter, as in the public struct that holds it.
        name: &'static str,
        /// Value and allowed range.
        what: String,
    },
    /// Device with a parameter out of its range.
    #[error("device {device}: {what}")]
    Device {
        /// Number of the device in the model.
        device: usize,
        /// Parameter, value and allowed range.
        what: String,
    },
    /// Obstacle with a parameter out of its range.
    #[error("obstacle {obstacle}: {what}")]
    Obstacle {
        /// Number of the obstacle in the model.
        obstacle: usize,
        /// Parameter, value and allowed range.
        what: String,
    },
    /// Triangle mesh that bounds no solid.
    #[error("{what}")]
    ObstacleMesh {
        /// Defect with its node, edge or triangle.
        what: String,
    },
    /// Impulse response that does not fit its recording, the scene's step or gravity.
    #[error("{what}")]
    ImpulseResponse {
        /// Finding and expectation.
        what: String,
    },
    /// Surface node that is not touchable in an impulse response.
    #[error(
        "the point is not touchable in the impulse response: node {node} was left out when it was recorded"
    )]
    NotTouchable {
        /// Number of the node in the finite element model.
        node: u32,
    },
    /// Surface point whose corners are all fixed.
    #[error("the point lies on fixed nodes: no hand can move it; hold one that is farther from them")]
    FixedPoint,
    /// Point that an object does not have, or where no force may enter.
    #[error("there is no point in triangle {triangle} with such weights where a force may enter")]
    NoSuchPoint {
        /// Index of the triangle.
        triangle: u32,
    },
    /// Object that cannot be put into the scene.
    #[error("object {object}: {error}")]
    Object {
        /// Number of the object in the model.
        object: usize,
        /// Defect of the object.
        error: Box<ModelError>,
    },
}

impl From<RecordingError> for Error {
    fn from(error: RecordingError) -> Self {
        Self::Recording(error)
    }
}

impl From<ModelError> for Error {
    fn from(error: ModelError) -> Self {
        Self::Model(error)
    }
}
