//! Force history of one object over the last T steps, for the paper's convolution: a force series per touchable node. Buffers are made
//! once.

use super::fir::Fir;
use crate::bounded_vec::BoundedVec;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use core::ops::Range;
use glam::DVec3;

/// Mark of a node that is no source.
const NONE: u32 = u32::MAX;

/// Node that was loaded in the last T steps.
#[derive(Debug, Clone, Copy)]
struct Loaded {
    source: u32,
    /// Number among all sources that were loaded so far, which spreads the work of a blocked convolution.
    phase: usize,
    /// Ages of its first and of its last force [steps].
    oldest: usize,
    newest: usize,
}

/// Past forces by node, newest first.
#[derive(Debug, Clone)]
pub(crate) struct ForceHistory {
    /// Number of samples T.
    samples: usize,
    steps: u64,
    /// Touchable surface nodes, the sources of force, and the source of each surface node.
    nodes: Arc<[u32]>,
    source_of: Arc<[u32]>,
    loaded: BoundedVec<Loaded>,
    /// Sources that were loaded so far.
    loads: usize,
    /// Index in `loaded` of each source, from 1; 0 for unloaded ones.
    at: Vec<u32>,
    /// Forces of each source in the last T steps [N, body], a series per axis, newest first: ring buffers of length T, written twice, so
    /// that T successive entries always begin at `head`.
    forces: Vec<f64>,
    head: usize,
}

/// Force series of a loaded node.
#[derive(Debug, Clone, Copy)]
pub(super) struct ForceSeries<'a> {
    pub(super) node: usize,
    pub(super) phase: usize,
    /// Ages outside of which its forces are zero [steps].
    ages: (usize, usize),
    /// Forces along each axis [N, body], by age.
    axes: [&'a [f64]; 3],
}

impl<'a> ForceSeries<'a> {
    /// Ages of a range with forces, of those that a convolution `ahead` of the last step still needs.
    pub(super) fn ages(&self, ahead: usize, range: Range<usize>) -> Range<usize> {
        let end = (self.ages.1 + 1).min(range.end).min(self.axes[0].len() - ahead);
        self.ages.0.max(range.start).min(end)..end
    }

    /// Forces along an axis [N], by age.
    pub(super) fn along(&self, axis: usize) -> &'a [f64] {
        self.axes[axis]
    }

    /// Force at an age [N, body].
    fn force(&self, age: usize) -> DVec3 {
        DVec3::from_array(self.axes.map(|forces| forces[age]))
    }
}

impl ForceHistory {
    /// History of T samples of forces on touchable nodes; `touchable` tells which surface nodes are.
    pub(super) fn new(samples: usize, touchable: impl Iterator<Item = bool>) -> Self {
        let (mut nodes, mut source_of) = (Vec::new(), Vec::new());
        for (node, is_touchable) in touchable.enumerate() {
            source_of.push(if is_touchable { nodes.len() as u32 } else { NONE });
            if is_touchable {
                nodes.push(node as u32);
            }
        }
        let sources = nodes.len();
        Self {
            samples,
            steps: 0,
            nodes: nodes.into(),
            source_of: source_of.into(),
            loaded: BoundedVec::new(sources),
            loads: 0,
            at: vec![0; sources],
            forces: vec![0.0; 6 * samples * sources],
            head: 0,
        }
    }

    /// Copy another history of equal size: the series of loaded nodes.
    ///
    /// # Real time
    pub(super) fn copy_from(&mut self, other: &Self) {
        (self.steps, self.head, self.loads) = (other.steps, other.head, other.loads);
        self.loaded.clear();
        self.loaded.extend_from_slice(&other.loaded);
        self.at.copy_from_slice(&other.at);
        for loaded in other.loaded.iter() {
            for axis in 0..3 {
                let window = self.window(loaded.source as usize, axis);
                self.forces[window.clone()].copy_from_slice(&other.forces[window]);
            }
        }
    }

    /// Steps since the start.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// Number of samples T.
    pub(super) fn samples(&self) -> usize {
        self.samples
    }

    fn window(&self, source: usize, axis: usize) -> Range<usize> {
        let start = 2 * self.samples * (3 * source + axis) + self.head;
        start..start + self.samples
    }

    /// Series of the nodes that were loaded in the last T steps.
    pub(super) fn series(&self) -> impl Iterator<Item = ForceSeries<'_>> {
        self.loaded.iter().map(|&Loaded { source, phase, oldest, newest }| {
            let source = source as usize;
            ForceSeries {
                node: self.nodes[source] as usize,
                phase,
                ages: (newest, oldest),
                axes: core::array::from_fn(|axis| &self.forces[self.window(source, axis)]),
            }
        })
    }

    /// Forces that the next step makes older than T steps, with their nodes.
    pub(super) fn leaving(&self) -> impl Iterator<Item = (usize, DVec3)> {
        let last = self.samples - 1;
        let has_left = move |series: &ForceSeries| !series.ages(0, last..self.samples).is_empty();
        self.series().filter(has_left).map(move |series| (series.node, series.force(last)))
    }

    /// Begin a step without force, and drop forces older than T steps.
    ///
    /// # Real time
    pub(super) fn begin_step(&mut self) {
        self.steps += 1;
        self.head = (self.head + self.samples - 1) % self.samples;
        let mut index = 0;
        while let Some(loaded) = self.loaded.get_mut(index) {
            loaded.oldest = (loaded.oldest + 1).min(self.samples - 1);
            loaded.newest += 1;
            let source = loaded.source as usize;
            if loaded.newest == self.samples {
                self.at[source] = 0;
                self.loaded.swap_remove(index);
                if let Some(moved) = self.loaded.get(index) {
                    self.at[moved.source as usize] = index as u32 + 1;
                }
                continue;
            }
            self.write(source, DVec3::ZERO);
            index += 1;
        }
    }

    /// Add a force [N, body] on a node to the step; a node that is no source takes none.
    ///
    /// # Real time
    pub(super) fn add(&mut self, node: usize, force: DVec3) {
        let source = self.source_of[node];
        if source == NONE {
            return;
        }
        let at = &mut self.at[source as usize];
        if *at == 0 {
            self.loaded.push(Loaded { source, phase: self.loads, oldest: 0, newest: 0 });
            self.loads += 1;
            *at = self.loaded.len() as u32;
            self.write(source as usize, force);
            return;
        }
        self.loaded[*at as usize - 1].newest = 0;
        let before = |axis: usize| self.forces[self.window(source as usize, axis).start];
        let before = DVec3::new(before(0), before(1), before(2));
        self.write(source as usize, before + force);
    }

    fn write(&mut self, source: usize, force: DVec3) {
        for (axis, force) in force.to_array().into_iter().enumerate() {
            let start = self.window(source, axis).start;
            self.forces[start] = force;
            self.forces[start + self.samples] = force;
        }
    }

    /// Displacement of a surface node, so many steps ahead of the last one without more force [m, body], equations (5) and (6); zero if it is
    /// not observed.
    ///
    /// # Real time
    /// Costs the forces of the last T steps.
    pub(super) fn displacement(&self, fir: &Fir, (node, ahead): (usize, usize), gravity: DVec3) -> DVec3 {
        let by = |forces: ForceSeries| fir.convolve((node, ahead), &forces, 0..self.samples);
        let by_forces: DVec3 = self.series().map(by).sum();
        by_forces + fir.sag(node, gravity, self.steps + ahead as u64)
    }
}
