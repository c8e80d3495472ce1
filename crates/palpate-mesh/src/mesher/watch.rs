//! Progress of the mesher, and its interruption.

use crate::error::MeshError;
use std::ops::ControlFlow;

/// Listener that is told the completed share, and says whether to go on.
pub type WatchFn<'a> = &'a mut dyn FnMut(f64) -> ControlFlow<()>;

/// Share of a whole that a stage of the work is.
pub(super) struct Watch<'a> {
    tell: WatchFn<'a>,
    from: f64,
    to: f64,
}

impl<'a> Watch<'a> {
    pub fn new(tell: WatchFn<'a>) -> Self {
        Self { tell, from: 0.0, to: 0.0 }
    }

    /// Begins a stage that ends at a share of the whole.
    pub fn stage(&mut self, to: f64) -> &mut Self {
        (self.from, self.to) = (self.to, to);
        self
    }

    /// Tells the completed share of the stage.
    pub fn at(&mut self, share: f64) -> Result<(), MeshError> {
        match (self.tell)(self.from + share * (self.to - self.from)) {
            ControlFlow::Continue(()) => Ok(()),
            ControlFlow::Break(()) => Err(MeshError::Interrupted),
        }
    }
}
