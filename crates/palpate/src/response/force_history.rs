//! Force history of one object over the last T steps, for the paper's convolution; buffers are made once.

use super::fir::Fir;
use crate::surface::SurfacePoint;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Point of unused entries.
const NOWHERE: SurfacePoint = SurfacePoint { triangle: u32::MAX, weights: [0.0; 3] };

/// Surface point that was loaded in the last T steps.
#[derive(Debug, Clone, Copy)]
struct Source {
    point: SurfacePoint,
    /// Age of its first force [steps]; none for a free entry.
    oldest: Option<usize>,
    /// Age of its last force [steps].
    newest: usize,
}

/// Past force on a point for which no source was free.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stray {
    pub(super) point: SurfacePoint,
    /// Force [N, body].
    pub(super) force: DVec3,
}

/// Past forces by loaded point, newest first.
#[derive(Debug, Clone)]
pub(crate) struct ForceHistory {
    /// Number of samples T.
    samples: usize,
    /// Upper limit of forces in a step.
    width: usize,
    steps: u64,
    sources: Vec<Source>,
    /// Forces of each source in the last T steps [N, body], newest first: a ring buffer of length T, written twice, so that T
    /// successive entries always begin at `head`.
    forces: Vec<DVec3>,
    head: usize,
    /// Ring buffer of T steps with at most one stray force per slot; it begins at `head`.
    strays: Vec<Stray>,
    stray_counts: Vec<u32>,
    stray_total: usize,
}

impl ForceHistory {
    /// History of T samples, with at most `width` forces in a step.
    pub(super) fn new(samples: usize, width: usize) -> Self {
        // More sources than simultaneous contacts: a moving contact leaves some behind.
        let sources = (4 * width).max(32).min(width * samples);
        Self {
            samples,
            width,
            steps: 0,
            sources: vec![Source { point: NOWHERE, oldest: None, newest: 0 }; sources],
            forces: vec![DVec3::ZERO; 2 * samples * sources],
            head: 0,
            strays: vec![Stray { point: NOWHERE, force: DVec3::ZERO }; samples * width],
            stray_counts: vec![0; samples],
            stray_total: 0,
        }
    }

    /// Copy another history of equal size.
    ///
    /// # Real time
    pub(super) fn copy_from(&mut self, other: &Self) {
        (self.steps, self.head, self.stray_total) = (other.steps, other.head, other.stray_total);
        self.sources.copy_from_slice(&other.sources);
        self.forces.copy_from_slice(&other.forces);
        self.strays.copy_from_slice(&other.strays);
        self.stray_counts.copy_from_slice(&other.stray_counts);
    }

    /// Steps since the start.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// Number of sources, used or free.
    pub(super) fn sources(&self) -> usize {
        self.sources.len()
    }

    /// Surface point of a source.
    pub(super) fn point(&self, source: usize) -> SurfacePoint {
        self.sources[source].point
    }

    /// Forces of a source [N, body], newest first, and the range of ages outside of which they are zero.
    pub(super) fn window(&self, source: usize) -> Option<(&[DVec3], core::ops::Range<usize>)> {
        let Source { oldest, newest, .. } = self.sources[source];
        let forces = &self.forces[2 * self.samples * source + self.head..][..self.samples];
        Some((forces, newest..(oldest? + 1).min(self.samples)))
    }

    /// Stray forces with their ages [steps].
    pub(super) fn strays(&self) -> impl Iterator<Item = (usize, &Stray)> {
        let ages = if self.stray_total > 0 { self.samples } else { 0 };
        (0..ages).flat_map(move |age| {
            let step = (self.head + age) % self.samples;
            let count = self.stray_counts[step] as usize;
            self.strays[step * self.width..][..count].iter().map(move |stray| (age, stray))
        })
    }

    /// Age a source by a step. Gives whether it becomes free.
    ///
    /// # Real time
    pub(super) fn ages(&mut self, source: usize) -> bool {
        let samples = self.samples;
        let source = &mut self.sources[source];
        let Some(oldest) = &mut source.oldest else { return false };
        *oldest += 1;
        source.newest += 1;
        let free = source.newest == samples;
        if free {
            source.oldest = None;
        }
        free
    }

    /// Begin a step without force, and drop forces older than T steps.
    ///
    /// # Real time
    pub(super) fn begin_step(&mut self) {
        self.steps += 1;
        self.head = (self.head + self.samples - 1) % self.samples;
        (0..self.sources.len()).for_each(|source| self.write(source, DVec3::ZERO));
        let dropped = core::mem::take(&mut self.stray_counts[self.head]) as usize;
        self.stray_total -= dropped;
    }

    /// Add a force [N, body] to the step.
    ///
    /// # Real time
    pub(super) fn add(&mut self, point: &SurfacePoint, force: DVec3) {
        let found = self.sources.iter().position(|s| s.oldest.is_some() && s.point == *point);
        match found.or_else(|| self.sources.iter().position(|s| s.oldest.is_none())) {
            Some(at) => {
                let source = &mut self.sources[at];
                source.point = *point;
                source.newest = 0;
                source.oldest = source.oldest.or(Some(0));
                let before = self.forces[2 * self.samples * at + self.head];
                // Two slots may share a point; the entry of a new source is stale.
                let shared = if found.is_some() { before } else { DVec3::ZERO };
                self.write(at, shared + force);
            }
            None => {
                let count = &mut self.stray_counts[self.head];
                self.strays[self.head * self.width + *count as usize] = Stray { point: *point, force };
                *count += 1;
                self.stray_total += 1;
            }
        }
    }

    fn write(&mut self, source: usize, force: DVec3) {
        let ring = &mut self.forces[2 * self.samples * source..][..2 * self.samples];
        ring[self.head] = force;
        ring[self.head + self.samples] = force;
    }

    /// Displacement of every surface node [m, body], equation (6); zero for nodes that are not observed.
    pub(super) fn surface_displacement(&self, fir: &Fir, gravity: DVec3, out: &mut [DVec3]) {
        let mut sum = vec![0.0; fir.observed_dofs()];
        let mut add = |age: usize, point: &SurfacePoint, force: DVec3| fir.add(age, point, force, &mut sum);
        for (at, source) in self.sources.iter().enumerate() {
            let Some((forces, ages)) = self.window(at) else { continue };
            ages.for_each(|age| add(age, &source.point, forces[age]));
        }
        self.strays().for_each(|(age, stray)| add(age, &stray.point, stray.force));
        for (node, u) in out.iter_mut().enumerate() {
            *u = fir.observed(node, &sum) + fir.sag(node, gravity, self.steps);
        }
    }
}
