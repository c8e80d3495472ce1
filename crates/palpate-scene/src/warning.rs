//! Warnings: what a run can do, but its author hardly means.

use serde::Serialize;
use std::fmt;

/// Warning about a part of a scene, before a run or after it.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Warning {
    /// Kind.
    pub kind: WarningKind,
    /// Name of the object, device or obstacle; empty for the whole scene.
    pub part: String,
    /// Message: what was seen, with numbers, and what to do.
    pub message: String,
}

/// Kind of a warning, in JSON in snake case.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum WarningKind {
    /// The stated force error of a recording is large.
    ForceError,
    /// A table knows the response at some surface nodes only.
    PartlyTouchable,
    /// A table ends before the body has come to rest.
    ShortTable,
    /// A table stands alone: contacts are searched for on its undeformed surface.
    UndeformedSurface,
    /// The triangles of an obstacle's mesh face inwards.
    TurnedMesh,
    /// A device starts far from the point that it holds.
    FarStart,
    /// A contact patch is small for the mesh.
    SmallPatch,
    /// An object begins inside an obstacle, or a tip inside an object.
    BeginsInside,
    /// Two objects overlap at the start.
    Overlap,
    /// Numbers look as if given in another unit: millimetres, milliseconds, per cent.
    Units,
    /// Gravity lifts objects off every plane.
    Gravity,
    /// A tip touched nothing.
    NoContact,
    /// An object was pressed into something.
    Penetration,
    /// An object deformed by much of its size.
    LargeDeformation,
    /// Contacts could not be solved.
    Unsolved,
    /// Contacts were left out beyond the limit of contact points.
    DroppedContacts,
    /// Motions of a linked device were not those of a hand.
    RefusedMotions,
    /// Held directions repeat others.
    DependentRows,
}

impl Warning {
    /// Warning about a part.
    pub fn new(kind: WarningKind, part: impl Into<String>, message: impl Into<String>) -> Self {
        Self { kind, part: part.into(), message: message.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}
