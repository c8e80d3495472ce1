//! Direct convolution of a recorded table with the history of forces: equations (2), (4) to (10) of the paper.
//!
//! ```text
//! ũ_c[t] = Σ_{s=1}^{T−1} R_cc[s]·f[t−s]        O(n_c²·T), points in contact only
//! u[t]   = Σ_{s=0}^{T−1} R[s]·f[t−s]           O(n·n_c·T), all observed nodes, on demand
//! ```
//!
//! The history keeps, for each of the last T steps, which surface points a force acted on, so contacts may come,
//! go and move over the surface. In the table two samples of one number lie far apart (all observed degrees of
//! freedom lie between), so the series R[0], R[1], … between a point in contact and a point where forces acted are
//! copied together when the two first meet, weighted with their corners. When no room is left for a copy the table
//! itself is read: the same numbers, more slowly.

use crate::contact::ContactPoint;
use crate::error::Error;
use crate::recording::{ImpulseResponse, Recording};
use crate::surface::SurfacePoint;
use alloc::format;
use alloc::sync::Arc;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// A table as one object of a scene uses it; immutable.
#[derive(Debug, Clone)]
pub(crate) struct Fir {
    recording: Arc<Recording>,
    table: Arc<ImpulseResponse>,
    /// For each surface node, its three columns of the table.
    touchable: Vec<Option<[u32; 3]>>,
    /// For each surface node, its three places among the observed degrees of freedom.
    observed: Vec<Option<[u32; 3]>>,
    /// Displacement [s²] per unit acceleration that has acted since the start, like `ImpulseResponse::gravity`.
    gravity: Option<Arc<[f64]>>,
}

/// Room for copies of series between two points, per object [bytes].
const COPIES_BYTES: usize = 64 << 20;

/// Marks an empty place.
const NONE: u32 = u32::MAX;

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
struct Stray {
    point: SurfacePoint,
    /// [N, body].
    force: DVec3,
}

/// The history of one object; buffers are made once.
#[derive(Debug, Clone)]
pub(crate) struct FirState {
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
    /// The point that each slot stands for.
    contacts: Vec<Option<SurfacePoint>>,
    /// Copies of series, T 3×3 blocks each, and which of them belongs to (slot, source).
    copies: Vec<[f64; 9]>,
    unused: Vec<u32>,
    copy_of: Vec<u32>,
    /// Work [J] of forces on the deformation since the start.
    work: f64,
}

impl Fir {
    pub(crate) fn new(
        recording: Arc<Recording>,
        table: Arc<ImpulseResponse>,
        step_s: f64,
    ) -> Result<Self, Error> {
        table.validate(&recording.surface)?;
        if libm::fabs(table.step_s - step_s) > 1e-9 * step_s {
            return Err(Error::Model(format!(
                "the impulse response was recorded with a step of {} s, the scene's step is {step_s} s",
                table.step_s
            )));
        }
        let touchable = ImpulseResponse::places(&recording.surface, &table.touchable_dofs);
        let observed = ImpulseResponse::places(&recording.surface, &table.observed_dofs);
        let gravity = table.gravity.as_ref().map(|response| {
            let mut sums = response.clone();
            let n = table.observed_dofs.len();
            for axis in sums.chunks_exact_mut(table.samples * n) {
                for at in n..axis.len() {
                    axis[at] += axis[at - n];
                }
            }
            sums.into()
        });
        Ok(Self { recording, table, touchable, observed, gravity })
    }

    /// Whether the table answers to acceleration of the whole body.
    pub(crate) fn knows_gravity(&self) -> bool {
        self.gravity.is_some()
    }

    /// Whether forces may enter at all corners that carry weight.
    pub(crate) fn accepts(&self, point: &SurfacePoint) -> bool {
        let corners = self.recording.surface.corners(point);
        corners.iter().all(|&(node, weight)| weight == 0.0 || self.touchable[node].is_some())
    }

    /// J_a·R[sample]·J_bᵀ between two surface points, row by row [m/N]; R_cc[0] of equation (9) for sample 0.
    ///
    /// # Real time
    fn block(&self, sample: usize, a: &SurfacePoint, b: &SurfacePoint) -> [f64; 9] {
        let base = sample * self.table.observed_dofs.len();
        let mut sum = [0.0; 9];
        for (source, wb) in self.recording.surface.corners(b).into_iter().filter(|(_, w)| *w != 0.0) {
            let Some(columns) = self.touchable[source] else { continue };
            let columns = columns.map(|column| self.table.columns.column(column as usize));
            for (node, wa) in self.recording.surface.corners(a).into_iter().filter(|(_, w)| *w != 0.0) {
                let Some(rows) = self.observed[node] else { continue };
                for (at, value) in sum.iter_mut().enumerate() {
                    *value += wa * wb * columns[at % 3].at(base + rows[at / 3] as usize);
                }
            }
        }
        sum
    }

    /// R[0] between two surface points, R_cc[0] of equation (9).
    ///
    /// # Real time
    pub(crate) fn compliance(&self, a: &SurfacePoint, b: &SurfacePoint) -> DMat3 {
        DMat3::from_cols_array(&self.block(0, a, b)).transpose()
    }

    /// Displacement of a point under an acceleration that has acted for `steps` steps [m, body].
    fn sag_of_point(&self, point: &SurfacePoint, acceleration: DVec3, steps: u64) -> DVec3 {
        let corners = self.recording.surface.corners(point);
        corners.iter().map(|&(node, weight)| self.sag(node, acceleration, steps) * weight).sum()
    }

    /// Displacement of a node under an acceleration that has acted for `steps` steps [m, body].
    fn sag(&self, node: usize, acceleration: DVec3, steps: u64) -> DVec3 {
        let (Some(sums), Some(rows), true) = (&self.gravity, self.observed[node], steps > 0) else {
            return DVec3::ZERO;
        };
        let (samples, n) = (self.table.samples, self.table.observed_dofs.len());
        let sample = (steps.min(samples as u64) - 1) as usize;
        let part = |row: u32| {
            let at = |axis: usize| sums[(axis * samples + sample) * n + row as usize];
            acceleration.dot(DVec3::new(at(0), at(1), at(2)))
        };
        DVec3::from_array(rows.map(part))
    }
}

/// Stands in places that are not used.
const NOWHERE: SurfacePoint = SurfacePoint { triangle: NONE, weights: [0.0; 3] };

impl FirState {
    pub(crate) fn new(fir: &Fir, slots: usize) -> Self {
        let samples = fir.table.samples;
        // Some more sources than can be in contact at once: a contact that moves leaves some behind.
        let sources = (4 * slots).max(32).min(slots * samples);
        let copies = (slots * sources).min(COPIES_BYTES / (72 * samples));
        Self {
            steps: 0,
            sources: vec![Source { point: NOWHERE, oldest: None, newest: 0 }; sources],
            forces: vec![DVec3::ZERO; 2 * samples * sources],
            head: 0,
            strays: vec![Stray { point: NOWHERE, force: DVec3::ZERO }; samples * slots],
            stray_counts: vec![0; samples],
            any_stray: 0,
            contacts: vec![None; slots],
            copies: vec![[0.0; 9]; copies * samples],
            unused: (0..copies as u32).rev().collect(),
            copy_of: vec![NONE; slots * sources],
            work: 0.0,
        }
    }

    /// Let a slot stand for a point; gives where the point is now [m, body].
    ///
    /// # Real time
    /// Copies the series between the point and all sources, T samples each.
    pub(crate) fn hold(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, gravity: DVec3) -> DVec3 {
        self.contacts[slot] = Some(*point);
        self.convolve(fir, slot, point, 0) + fir.sag_of_point(point, gravity, self.steps)
    }

    /// Let a slot stand for nothing.
    ///
    /// # Real time
    pub(crate) fn release(&mut self, slot: usize) {
        self.contacts[slot] = None;
        (0..self.sources.len()).for_each(|source| self.forget(slot, source));
    }

    fn forget(&mut self, slot: usize, source: usize) {
        let copy = &mut self.copy_of[slot * self.sources.len() + source];
        if *copy != NONE {
            self.unused.push(*copy);
            *copy = NONE;
        }
    }

    /// Where the copy of the series between a slot's point and a source begins, made now if there is room.
    fn copy(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, source: usize) -> Option<usize> {
        let samples = fir.table.samples;
        let entry = slot * self.sources.len() + source;
        if self.copy_of[entry] == NONE {
            let copy = self.unused.pop()?;
            self.copy_of[entry] = copy;
            let series = &mut self.copies[copy as usize * samples..][..samples];
            for (sample, block) in series.iter_mut().enumerate() {
                *block = fir.block(sample, point, &self.sources[source].point);
            }
        }
        Some(self.copy_of[entry] as usize * samples)
    }

    /// The forces of a source, the newest first, and the ages between which they are not all zero.
    fn window(&self, samples: usize, source: usize) -> Option<(&[DVec3], core::ops::Range<usize>)> {
        let Source { oldest, newest, .. } = self.sources[source];
        let forces = &self.forces[2 * samples * source + self.head..][..samples];
        Some((forces, newest..(oldest? + 1).min(samples)))
    }

    /// Σ R[age + ahead]·f over the history at a slot's point [m, body]; age 0 is the last step.
    fn convolve(&mut self, fir: &Fir, slot: usize, point: &SurfacePoint, ahead: usize) -> DVec3 {
        let samples = fir.table.samples;
        let mut sum = [0.0; 3];
        let add = |sum: &mut [f64; 3], block: &[f64; 9], force: &DVec3| {
            sum[0] += block[0] * force.x + block[1] * force.y + block[2] * force.z;
            sum[1] += block[3] * force.x + block[4] * force.y + block[5] * force.z;
            sum[2] += block[6] * force.x + block[7] * force.y + block[8] * force.z;
        };
        for source in 0..self.sources.len() {
            if self.sources[source].oldest.is_none() {
                continue;
            }
            let copy = self.copy(fir, slot, point, source);
            let Some((forces, ages)) = self.window(samples, source) else { continue };
            let ages = ages.start..ages.end.min(samples - ahead);
            match copy {
                Some(start) => {
                    let series = &self.copies[start + ahead..start + samples];
                    for (block, force) in series.iter().zip(forces).take(ages.end).skip(ages.start) {
                        add(&mut sum, block, force);
                    }
                }
                None => {
                    for age in ages {
                        let block = fir.block(age + ahead, point, &self.sources[source].point);
                        add(&mut sum, &block, &forces[age]);
                    }
                }
            }
        }
        for (age, stray) in self.strays(samples).filter(|(age, _)| age + ahead < samples) {
            add(&mut sum, &fir.block(age + ahead, point, &stray.point), &stray.force);
        }
        DVec3::from_array(sum)
    }

    /// The stray forces with their ages.
    fn strays(&self, samples: usize) -> impl Iterator<Item = (usize, &Stray)> {
        let width = self.contacts.len();
        let ages = if self.any_stray > 0 { samples } else { 0 };
        (0..ages).flat_map(move |age| {
            let step = (self.head + age) % samples;
            let count = self.stray_counts[step] as usize;
            self.strays[step * width..][..count].iter().map(move |stray| (age, stray))
        })
    }

    /// ũ of equation (5) for a slot's point [m, body].
    ///
    /// # Real time
    /// Costs the forces of the last T steps.
    pub(crate) fn free(&mut self, fir: &Fir, slot: usize, gravity: DVec3) -> DVec3 {
        let Some(point) = self.contacts[slot] else { return DVec3::ZERO };
        self.convolve(fir, slot, &point, 1) + fir.sag_of_point(&point, gravity, self.steps + 1)
    }

    /// Write the step's forces into the history; what is older than T steps is forgotten.
    ///
    /// # Real time
    pub(crate) fn advance(&mut self, fir: &Fir, acting: &[ContactPoint]) {
        let (samples, width) = (fir.table.samples, self.contacts.len());
        self.steps += 1;
        self.head = (self.head + samples - 1) % samples;
        for source in 0..self.sources.len() {
            let Some(oldest) = &mut self.sources[source].oldest else { continue };
            *oldest += 1;
            self.sources[source].newest += 1;
            if self.sources[source].newest == samples {
                self.sources[source].oldest = None;
                (0..width).for_each(|slot| self.forget(slot, source));
            }
            self.write(samples, source, DVec3::ZERO);
        }
        let gone = core::mem::take(&mut self.stray_counts[self.head]) as usize;
        self.any_stray -= gone;
        for acting in acting {
            let (point, force) = (&acting.place.point, acting.force_in_body);
            self.work += force.dot(acting.displacement - acting.placed.displacement);
            if force == DVec3::ZERO {
                continue;
            }
            let found = self.sources.iter().position(|s| s.oldest.is_some() && s.point == *point);
            match found.or_else(|| self.sources.iter().position(|s| s.oldest.is_none())) {
                Some(at) => {
                    let source = &mut self.sources[at];
                    source.point = *point;
                    source.newest = 0;
                    source.oldest = source.oldest.or(Some(0));
                    let before = self.forces[2 * samples * at + self.head];
                    // Two slots may stand for one point; a new source's place holds nothing yet.
                    let shared = if found.is_some() { before } else { DVec3::ZERO };
                    self.write(samples, at, shared + force);
                }
                None => {
                    let count = &mut self.stray_counts[self.head];
                    self.strays[self.head * width + *count as usize] = Stray { point: *point, force };
                    *count += 1;
                    self.any_stray += 1;
                }
            }
        }
    }

    fn write(&mut self, samples: usize, source: usize, force: DVec3) {
        let ring = &mut self.forces[2 * samples * source..][..2 * samples];
        ring[self.head] = force;
        ring[self.head + samples] = force;
    }

    /// Energy [J] that went into the deformation and has not come back: stored or dissipated, which a table
    /// can't tell apart.
    pub(crate) fn work(&self) -> f64 {
        self.work
    }

    /// Displacement of every surface node [m, body], equation (6); nodes that are not observed stay at rest.
    pub(crate) fn surface_displacement(&self, fir: &Fir, gravity: DVec3, out: &mut [DVec3]) {
        let samples = fir.table.samples;
        let mut sum = vec![0.0; fir.table.observed_dofs.len()];
        let mut add = |age: usize, point: &SurfacePoint, force: DVec3| {
            for (node, weight) in fir.recording.surface.corners(point) {
                let Some(columns) = fir.touchable[node].filter(|_| weight != 0.0) else { continue };
                for (column, force) in columns.into_iter().zip(force.to_array()) {
                    let column = fir.table.columns.column(column as usize);
                    column.add_to(age * sum.len(), weight * force, &mut sum);
                }
            }
        };
        for (at, source) in self.sources.iter().enumerate() {
            let Some((forces, ages)) = self.window(samples, at) else { continue };
            ages.for_each(|age| add(age, &source.point, forces[age]));
        }
        self.strays(samples).for_each(|(age, stray)| add(age, &stray.point, stray.force));
        for (node, u) in out.iter_mut().enumerate() {
            let places = fir.observed[node];
            *u = places.map_or(DVec3::ZERO, |rows| DVec3::from_array(rows.map(|row| sum[row as usize])));
            *u += fir.sag(node, gravity, self.steps);
        }
    }
}
