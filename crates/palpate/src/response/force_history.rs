//! The forces of the last T steps on one object, that the paper's convolution runs over: buffers are made once.

use super::fir::Fir;
use crate::surface::SurfacePoint;
use alloc::vec;
use alloc::vec::Vec;
use glam::DVec3;

/// Stands in places that are not used.
const NOWHERE: SurfacePoint = SurfacePoint { triangle: u32::MAX, weights: [0.0; 3] };

/// A point that forces of the last T steps acted on.
#[derive(Debug, Clone, Copy)]
struct Source {
    point: SurfacePoint,
    /// Steps since a force first acted on it; `None` for a free place.
    oldest: Option<usize>,
    /// Steps since one last did.
    newest: usize,
}

/// A force of the past on a point that had no room among the sources.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stray {
    pub(super) point: SurfacePoint,
    /// [N, body].
    pub(super) force: DVec3,
}

/// Forces by the points that they acted on, the newest first.
#[derive(Debug, Clone)]
pub(crate) struct ForceHistory {
    /// T, and how many forces a step has at most.
    samples: usize,
    width: usize,
    steps: u64,
    sources: Vec<Source>,
    /// For each source the forces [N, body] of the last T steps, the newest first: a ring of length T that is
    /// written twice, so that T of them always lie one after the other, from `head` on.
    forces: Vec<DVec3>,
    head: usize,
    /// T steps of at most one stray force per slot, a ring that begins at `head`.
    strays: Vec<Stray>,
    stray_counts: Vec<u32>,
    any_stray: usize,
}

impl ForceHistory {
    /// Of T samples, with at most so many forces a step.
    pub(super) fn new(samples: usize, width: usize) -> Self {
        // Some more sources than can be in contact at once: a contact that moves leaves some behind.
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
            any_stray: 0,
        }
    }

    /// Take over another one of the same size.
    ///
    /// # Real time
    pub(super) fn copy_from(&mut self, other: &Self) {
        (self.steps, self.head, self.any_stray) = (other.steps, other.head, other.any_stray);
        self.sources.copy_from_slice(&other.sources);
        self.forces.copy_from_slice(&other.forces);
        self.strays.copy_from_slice(&other.strays);
        self.stray_counts.copy_from_slice(&other.stray_counts);
    }

    /// Steps since the start.
    pub(super) fn steps(&self) -> u64 {
        self.steps
    }

    /// Places for sources, used or not.
    pub(super) fn sources(&self) -> usize {
        self.sources.len()
    }

    /// Where a source is.
    pub(super) fn point(&self, source: usize) -> SurfacePoint {
        self.sources[source].point
    }

    /// The forces of a source, the newest first, and the ages between which they are not all zero.
    pub(super) fn window(&self, source: usize) -> Option<(&[DVec3], core::ops::Range<usize>)> {
        let Source { oldest, newest, .. } = self.sources[source];
        let forces = &self.forces[2 * self.samples * source + self.head..][..self.samples];
        Some((forces, newest..(oldest? + 1).min(self.samples)))
    }

    /// The stray forces with their ages.
    pub(super) fn strays(&self) -> impl Iterator<Item = (usize, &Stray)> {
        let ages = if self.any_stray > 0 { self.samples } else { 0 };
        (0..ages).flat_map(move |age| {
            let step = (self.head + age) % self.samples;
            let count = self.stray_counts[step] as usize;
            self.strays[step * self.width..][..count].iter().map(move |stray| (age, stray))
        })
    }

    /// Let a source grow older by a step. Says whether its place is free from now on.
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

    /// Begin a step, without force; what is older than T steps is forgotten.
    ///
    /// # Real time
    pub(super) fn begin_step(&mut self) {
        self.steps += 1;
        self.head = (self.head + self.samples - 1) % self.samples;
        (0..self.sources.len()).for_each(|source| self.write(source, DVec3::ZERO));
        let displacement_since_build = core::mem::take(&mut self.stray_counts[self.head]) as usize;
        self.any_stray -= displacement_since_build;
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
                // Two slots may stand for one point; a new source's place holds nothing yet.
                let shared = if found.is_some() { before } else { DVec3::ZERO };
                self.write(at, shared + force);
            }
            None => {
                let count = &mut self.stray_counts[self.head];
                self.strays[self.head * self.width + *count as usize] = Stray { point: *point, force };
                *count += 1;
                self.any_stray += 1;
            }
        }
    }

    fn write(&mut self, source: usize, force: DVec3) {
        let ring = &mut self.forces[2 * self.samples * source..][..2 * self.samples];
        ring[self.head] = force;
        ring[self.head + self.samples] = force;
    }

    /// Displacement of every surface node [m, body], equation (6); nodes that are not observed stay at rest.
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
