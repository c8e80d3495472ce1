//! Errors of the factorisation and of the eigenvalue problem.

/// A body that cannot be factored, or modes that cannot be found.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SolveError {
    /// The stiffness matrix is not positive definite: a part of the body moves without resistance.
    #[error(
        "the stiffness matrix is not positive definite to the digits of f64: a part of the body hangs on a hinge, the mesh \
         has slivers, or its materials differ by too many orders"
    )]
    NotPositiveDefinite,
    /// More memory is needed than is free.
    #[error(
        "the mesh needs about {needed_gb:.1} GB of memory for its factors and modes, and {available_gb:.1} GB are free: use \
         fewer elements or modes, or --order 1"
    )]
    Memory {
        /// Estimated need [GB].
        needed_gb: f64,
        /// Free memory [GB].
        available_gb: f64,
    },
    /// The elimination order or the symbolic factorisation failed; most likely memory ran out.
    #[error("the sparse factor cannot be set up ({0})")]
    SymbolicFactor(String),
    /// The fixed nodes leave a rigid motion.
    #[error("the fixed nodes leave the body free to turn: fix at least three nodes that are not on one line")]
    RigidMotion,
    /// The nodes that are held along axes, and the springs, leave a rigid motion.
    #[error(
        "the supports leave the body free to move or to turn as a whole: hold every axis somewhere, at three nodes that are not on one line \
         in all"
    )]
    LooseSupports,
    /// More modes are requested than can be found.
    #[error(
        "{requested} modes are requested, the model has {available} elastic modes: use a finer mesh or --modes {available}"
    )]
    TooManyModes {
        /// Requested number of modes.
        requested: usize,
        /// Number of modes that can be found.
        available: usize,
    },
    /// The eigenvalue iteration did not reach its tolerance.
    #[error(
        "the modes did not converge: {found} of {requested} after a basis of {basis}, largest residual {residual:e}; \
         the mesh may have slivers or materials that differ by many orders"
    )]
    NoConvergence {
        /// Number of modes within tolerance.
        found: usize,
        /// Requested number of modes.
        requested: usize,
        /// Columns of the Krylov basis.
        basis: usize,
        /// Relative residual of the last requested mode.
        residual: f64,
    },
    /// The inertia count and the iteration disagree about the number of modes.
    #[error("{counted} modes lie below {frequency_hz} Hz, but {found} were found")]
    ModeCount {
        /// Number of modes by the inertia count.
        counted: usize,
        /// Number of modes by the iteration.
        found: usize,
        /// Upper frequency of the count [Hz].
        frequency_hz: f64,
    },
    /// A dense decomposition failed.
    #[error("dense eigenproblem: {0}")]
    DenseEigenproblem(String),
    /// The listener interrupted the work, see [`Progress::is_interrupted`](crate::Progress::is_interrupted).
    #[error("interrupted")]
    Interrupted,
}
