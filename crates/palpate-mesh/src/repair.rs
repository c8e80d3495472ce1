//! Repair of what a file may get wrong, always told: elements that stand twice, nodes on one point, a body in pieces.

use crate::coincident::{COINCIDENT, bounding_box, coincident_pairs};
use crate::error::{MeshError, Metres};
use crate::volume_mesh::Mesh;
use std::collections::HashSet;

/// Joining of nodes that lie on one point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum MergeNodes {
    /// Where the body falls into fewer pieces by it: a slit through one piece stays open.
    #[default]
    JoiningPieces,
    /// Everywhere.
    Always,
    /// Nowhere.
    Never,
}

/// Piece of a body to keep.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum PieceChoice {
    /// The only one: [`Mesh::checked`] refuses several.
    #[default]
    Only,
    /// That with the largest volume.
    Largest,
    /// One of [`Mesh::pieces`], counted from 1.
    Number(usize),
}

/// Choices of [`Mesh::repair`].
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Repair {
    /// Joining of nodes on one point.
    pub merge_nodes: MergeNodes,
    /// Piece to keep.
    pub piece: PieceChoice,
}

impl Mesh {
    /// Repairs the mesh, and adds to [`Mesh::warnings`] what was done. Nodes keep their numbers.
    ///
    /// # Errors
    /// [`MeshError::NodeNumber`] or [`MeshError::NotFinite`] for nodes that can't be used; [`MeshError::NoPiece`] when there is no piece
    /// of the chosen number.
    pub fn repair(&mut self, choices: &Repair) -> Result<(), MeshError> {
        self.used_nodes()?;
        self.drop_repeated_tets();
        let mut pieces = self.pieces();
        if choices.merge_nodes != MergeNodes::Never {
            let mut merged = self.clone();
            let count = merged.merge_coincident_nodes();
            if count > 0 {
                let [first, other] = self.first_coincident_pair().unwrap_or_default();
                merged.drop_repeated_tets();
                let fewer = merged.pieces();
                if choices.merge_nodes == MergeNodes::Always || fewer.len() < pieces.len() {
                    let joined = match (pieces.len(), fewer.len()) {
                        (before, after) if after < before => {
                            format!(", which joins {before} pieces into {after}")
                        }
                        _ => String::new(),
                    };
                    merged.warnings.push(format!(
                        "{count} nodes lay on others and were merged{joined} (first nodes {first} and {other}, counted from 0, at {}); \
                         --merge-nodes=never keeps them apart",
                        Metres(self.nodes[first as usize])
                    ));
                    (*self, pieces) = (merged, fewer);
                }
            }
        }
        let number = match choices.piece {
            PieceChoice::Only => return Ok(()),
            PieceChoice::Largest => 1,
            PieceChoice::Number(number) => number,
        };
        let Some(piece) = number.checked_sub(1).and_then(|at| pieces.get(at)) else {
            return Err(MeshError::NoPiece { number, pieces: pieces.len() });
        };
        if pieces.len() > 1 {
            let all = self.tets.len();
            *self = self.piece(piece);
            self.warnings.push(format!(
                "piece {number} of {} is kept: {} of {all} tetrahedra, {:.4e} m³, near {}",
                pieces.len(),
                piece.tets.len(),
                piece.volume,
                Metres(piece.near)
            ));
        }
        Ok(())
    }

    /// Leaves out tetrahedra with the four nodes of one before, and warns.
    fn drop_repeated_tets(&mut self) {
        let mut seen = HashSet::with_capacity(self.tets.len());
        let is_first: Vec<bool> = self
            .tets
            .iter()
            .map(|tet| {
                let mut key = *tet;
                key.sort_unstable();
                seen.insert(key)
            })
            .collect();
        let repeats = is_first.iter().filter(|first| !**first).count();
        if repeats == 0 {
            return;
        }
        let mut each = is_first.iter();
        self.tets.retain(|_| each.next().is_some_and(|first| *first));
        let mut each = is_first.iter();
        self.tet_regions.retain(|_| each.next().is_some_and(|first| *first));
        self.warnings.push(format!(
            "{repeats} tetrahedra stood in the mesh twice (the same four nodes) and were left out, each in the region that comes later"
        ));
    }

    /// First two used nodes on one point.
    fn first_coincident_pair(&self) -> Option<[u32; 2]> {
        let used = self.used_nodes().ok()?;
        let (low, high) = bounding_box(self, &used);
        let pairs = coincident_pairs(&self.nodes, &used, COINCIDENT * (high - low).length());
        pairs.first().map(|&(a, b)| [a, b])
    }
}
