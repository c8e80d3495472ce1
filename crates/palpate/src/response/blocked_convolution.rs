//! Blocked direct convolution: displacements of nodes in contact, at a fraction of the arithmetic's and the memory's cost of one output at a time.
//!
//! ```text
//! u_i[o] = Σ_j ( Σ_{k<b} R_ij[o−1−k]·f_j[k]  +  Σ_{b≤k<t} R_ij[o−1−k]·f_j[k] )
//!                tail, B outputs at once          head, every step
//! ```
//!
//! t is the number of steps done, o = t or t + 1 the output, and b < o the last boundary of the pair of nodes i and j: boundaries come every B
//! steps. At a boundary the pair's tail is computed for the next B outputs, so that each number of the table is read once per block and meets
//! B forces in registers. Pairs have their boundaries in different steps, so that the work of a step stays even. Head and tail are parts of
//! the same sum: the result is that of equation (5) to round-off, without delay.
//!
//! Block convolution: Oppenheim and Schafer, *Discrete-Time Signal Processing*, 8.7; heads without delay: Gardner, *Efficient convolution
//! without input-output delay*, 1995. Equations: docs/theory.md (C8).

use super::fir::Fir;
use super::force_history::{ForceHistory, ForceSeries};
use crate::bounded_vec::BoundedVec;
use crate::dot_products::BLOCK;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Outputs whose tails are kept per node: those of a block, and that of the last step, which a new contact begins with.
const OUTPUTS: usize = BLOCK + 1;

/// Node whose tails are computed ahead.
#[derive(Debug, Clone, Copy)]
struct Watched {
    node: u32,
    phase: usize,
    /// Last step in which its displacement was asked for.
    asked: u64,
    /// Heads of its displacement one step ahead [m, body], with the step in which they are.
    heads: (u64, DVec3),
}

/// Tails of the displacements of nodes; buffers are made once.
#[derive(Debug, Clone)]
pub(super) struct BlockedConvolution {
    watched: BoundedVec<Watched>,
    /// Index in `watched` of each surface node, from 1; 0 for others.
    at: Vec<u32>,
    /// Tails of the next outputs [m, body], a ring buffer per surface node.
    tails: Vec<[DVec3; OUTPUTS]>,
    /// Nodes watched so far, which spreads their phases.
    count: usize,
    /// Largest number of nodes asked for in a step of the last T, and the step.
    most: (usize, u64),
}

impl BlockedConvolution {
    pub(super) fn new(nodes: usize) -> Self {
        Self {
            watched: BoundedVec::new(nodes),
            at: vec![0; nodes],
            tails: vec![[DVec3::ZERO; OUTPUTS]; nodes],
            count: 0,
            most: (0, 0),
        }
    }

    /// Displacement of a surface node by the forces, at the last step's end or one step ahead without more force [m, body].
    ///
    /// # Real time
    /// Costs the forces since the last boundaries; of a node that was not watched, those of the last T steps.
    pub(super) fn displacement(
        &mut self,
        (fir, history): (&Fir, &ForceHistory),
        (node, ahead): (usize, usize),
    ) -> DVec3 {
        if self.at[node] == 0 {
            self.watch((fir, history), node);
        }
        let watched = &mut self.watched[self.at[node] as usize - 1];
        watched.asked = history.steps();
        let tail = self.tails[node][slot(history.steps() + ahead as u64)];
        let (step, heads) = watched.heads;
        if ahead == 1 && step == history.steps() {
            return tail + heads;
        }
        let phase = watched.phase;
        let head = |forces: ForceSeries| {
            // Of the output of the last step, the boundary is before that step.
            let length = (age_of_boundary(history, phase, &forces) + BLOCK + ahead - 1) % BLOCK + 1 - ahead;
            fir.convolve((node, ahead), &forces, 0..length)
        };
        tail + history.series().map(head).sum::<DVec3>()
    }

    /// Begin to compute the tails of a node, up to the next boundary of each of its pairs.
    fn watch(&mut self, (fir, history): (&Fir, &ForceHistory), node: usize) {
        let phase = self.count % BLOCK;
        self.count += 1;
        self.watched.push(Watched {
            node: node as u32,
            phase,
            asked: history.steps(),
            heads: (u64::MAX, DVec3::ZERO),
        });
        self.at[node] = self.watched.len() as u32;
        let tails = &mut self.tails[node];
        tails.fill(DVec3::ZERO);
        for forces in history.series() {
            let since = age_of_boundary(history, phase, &forces);
            let tail = Tail { fir, history, forces: &forces, node };
            if since == 0 {
                // The output of the last step belongs to the block before.
                tail.add(tails, BLOCK, 0, 1);
                tail.add(tails, 0, 1, BLOCK);
            } else {
                tail.add(tails, since, 0, BLOCK - since + 1);
            }
        }
    }

    /// Advance to the next step, whose forces are in the history: compute the tails of the pairs that have a boundary.
    ///
    /// # Real time
    /// Costs the B-th part of (nodes watched) × (nodes loaded) × T × B.
    pub(super) fn advance(&mut self, (fir, history): (&Fir, &ForceHistory)) {
        self.forget(history);
        let step = history.steps();
        let Self { watched, tails, .. } = self;
        for watched in watched.iter_mut() {
            tails[watched.node as usize][slot(step + BLOCK as u64)] = DVec3::ZERO;
            watched.heads = (if watched.asked + 1 == step { step } else { u64::MAX }, DVec3::ZERO);
        }
        // Source by source: the first samples of a column lie together.
        for forces in history.series() {
            for watched in watched.iter_mut() {
                let (node, length) =
                    (watched.node as usize, age_of_boundary(history, watched.phase, &forces));
                if length == 0 {
                    let tail = Tail { fir, history, forces: &forces, node };
                    tail.add(&mut tails[node], 0, 1, BLOCK);
                } else if watched.heads.0 == step {
                    watched.heads.1 += fir.convolve((node, 1), &forces, 0..length);
                }
            }
        }
    }

    /// Drop the nodes that were not asked for the longest: as many are kept as were asked for in one of the last T steps, so that a body that
    /// leaves the floor comes down on nodes that are ready.
    fn forget(&mut self, history: &ForceHistory) {
        let step = history.steps();
        let asked = self.watched.iter().filter(|watched| watched.asked + 1 == step).count();
        if asked >= self.most.0 || step - self.most.1 > history.samples() as u64 {
            self.most = (asked, step);
        }
        while self.watched.len() > self.most.0 {
            let longest = self.watched.iter().enumerate().min_by_key(|(_, watched)| watched.asked);
            let Some((index, watched)) = longest else { return };
            self.at[watched.node as usize] = 0;
            self.watched.swap_remove(index);
            if let Some(moved) = self.watched.get(index) {
                self.at[moved.node as usize] = index as u32 + 1;
            }
        }
    }
}

/// Place of an output in a ring buffer.
fn slot(output: u64) -> usize {
    (output % OUTPUTS as u64) as usize
}

/// Steps since the last boundary of a node with a phase and a force series, below B.
fn age_of_boundary(history: &ForceHistory, phase: usize, forces: &ForceSeries) -> usize {
    ((history.steps() % BLOCK as u64) as usize + phase + forces.phase) % BLOCK
}

/// Tails of a node by a force series.
struct Tail<'a> {
    fir: &'a Fir,
    history: &'a ForceHistory,
    forces: &'a ForceSeries<'a>,
    node: usize,
}

impl Tail<'_> {
    /// Add the forces from an age on to a number of outputs from `ahead` on.
    fn add(&self, tails: &mut [DVec3; OUTPUTS], from: usize, ahead: usize, outputs: usize) {
        let mut sums = [[0.0; BLOCK]; 3];
        self.fir.correlate((self.node, ahead), self.forces, from, &mut sums);
        for output in 0..outputs {
            let at = slot(self.history.steps() + (ahead + output) as u64);
            tails[at] += DVec3::from_array(sums.map(|sums| sums[output]));
        }
    }
}
