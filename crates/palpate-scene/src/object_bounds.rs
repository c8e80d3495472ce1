//! Bounding box of a scene's objects, and positions that are far from it.

use crate::warning::{Warning, WarningKind};
use glam::DVec3;
use palpate_haptics::MotionPath;

/// Distance of a position from the objects, in diagonals of all objects, above which it looks as if given in millimetres: about the
/// geometric mean of 1 and 1000.
const FAR: f64 = 30.0;

/// Number of intervals at which a path is looked at.
const PATH_INTERVALS: usize = 200;

/// Bounding box of all objects of a scene at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObjectBounds {
    /// Corners [m, world].
    low: DVec3,
    high: DVec3,
}

impl ObjectBounds {
    /// Bounding box of the nodes of objects [m, world].
    pub(crate) fn of(nodes: impl Iterator<Item = DVec3>) -> Self {
        let (low, high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        let (low, high) = nodes.fold((low, high), |(low, high), x| (low.min(x), high.max(x)));
        Self { low, high }
    }

    /// Diagonal [m].
    pub(crate) fn diagonal(&self) -> f64 {
        (self.high - self.low).length()
    }

    /// Distance that is far [m].
    pub(crate) fn far(&self) -> f64 {
        FAR * self.diagonal()
    }

    /// Largest distance from the box [m] of those positions that are far from it.
    pub(crate) fn farthest(&self, positions: impl Iterator<Item = DVec3>) -> Option<f64> {
        let farthest = positions.map(|x| (x - x.clamp(self.low, self.high)).length()).fold(0.0, f64::max);
        (farthest > self.far()).then_some(farthest)
    }

    /// Warning about a part, by what of it goes away, and its largest distance [m].
    pub(crate) fn warning(&self, subject: &str, name: &str, farthest: f64) -> Warning {
        let message = format!(
            "{subject} of {name:?} goes {farthest:.1} m away from the objects, which span {:.3} m: positions are in metres; if \
             these are in millimetres, divide them by 1000",
            self.diagonal()
        );
        Warning::new(WarningKind::Units, name, message)
    }

    /// Warning about the path of a part that goes far away.
    pub(crate) fn far_path(&self, name: &str, path: &MotionPath) -> Option<Warning> {
        let at = |k: usize| path.at(path.end() * k as f64 / PATH_INTERVALS as f64).position;
        Some(self.warning("the path", name, self.farthest((0..=PATH_INTERVALS).map(at))?))
    }
}
