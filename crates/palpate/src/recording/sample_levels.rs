//! Levels of contact samples in a recording: selection, checks, and the lists that a file holds.

use super::{LARGEST, Recording};
use crate::error::{RecordingError, RecordingPart};
use crate::surface::{MAX_LEVELS, SampleLevel};
use alloc::borrow::Cow;
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;

/// Levels one after the other, with the start of each.
#[derive(Debug, Default)]
pub(super) struct LevelLists {
    /// Sample spacing of each level [m].
    pub(super) spacings: Vec<f64>,
    /// Index of each level's first sample; length levels + 1.
    pub(super) offsets: Vec<u32>,
    /// Surface node of each sample.
    pub(super) nodes: Vec<u32>,
    /// Index of each level's first triangle; length levels + 1.
    pub(super) triangle_offsets: Vec<u32>,
    /// Three surface nodes of each triangle of the decimated surfaces.
    pub(super) triangles: Vec<u32>,
}

impl LevelLists {
    pub(super) fn new(levels: &[SampleLevel]) -> Self {
        let mut lists = Self { offsets: vec![0], triangle_offsets: vec![0], ..Self::default() };
        for level in levels {
            lists.spacings.push(level.spacing);
            lists.nodes.extend(&level.nodes);
            lists.offsets.push(lists.nodes.len() as u32);
            lists.triangles.extend(level.triangles.iter().flatten());
            lists.triangle_offsets.push((lists.triangles.len() / 3) as u32);
        }
        lists
    }

    /// Levels of the lists; their numbers are checked with the recording.
    pub(super) fn levels(&self) -> Result<Vec<SampleLevel>, RecordingError> {
        let triangles: Vec<[u32; 3]> = self.triangles.as_chunks().0.to_vec();
        let divides = |offsets: &[u32], length: usize| {
            offsets.len() == self.spacings.len() + 1
                && offsets[0] == 0
                && offsets.is_sorted()
                && offsets[offsets.len() - 1] as usize == length
        };
        if !divides(&self.offsets, self.nodes.len()) || !divides(&self.triangle_offsets, triangles.len()) {
            return Err(inconsistent(
                "the offsets of the levels of contact samples do not fit together".into(),
            ));
        }
        let range = |offsets: &[u32], at: usize| offsets[at] as usize..offsets[at + 1] as usize;
        let level = |(at, &spacing)| SampleLevel {
            spacing,
            nodes: self.nodes[range(&self.offsets, at)].to_vec(),
            triangles: triangles[range(&self.triangle_offsets, at)].to_vec(),
        };
        Ok(self.spacings.iter().enumerate().map(level).collect())
    }
}

impl Recording {
    /// Levels of contact samples down to the first with at most `max_samples`; none where the surface has no more nodes. A
    /// recording without levels gets those of its surface, which are the same.
    pub(crate) fn levels_down_to(&self, max_samples: usize) -> Cow<'_, [SampleLevel]> {
        if self.surface.positions.len() <= max_samples {
            return Cow::Borrowed(&[]);
        }
        if self.sample_levels.is_empty() {
            return Cow::Owned(self.surface.sample_levels(max_samples));
        }
        let levels = &self.sample_levels;
        let last = levels.iter().position(|level| level.nodes.len() <= max_samples);
        Cow::Borrowed(&levels[..last.map_or(levels.len(), |last| last + 1)])
    }

    /// Check that the levels are ever fewer samples of the surface, and the ones that the certificate states.
    pub(super) fn validate_sample_levels(&self) -> Result<(), RecordingError> {
        let levels = &self.sample_levels;
        if levels.len() > MAX_LEVELS {
            let what = format!("{} levels of contact samples, expected {MAX_LEVELS} at most", levels.len());
            return Err(inconsistent(what));
        }
        let surface_nodes = self.surface.positions.len();
        let (mut finer_spacing, mut finer_count) = (0.0, surface_nodes);
        for (at, level) in levels.iter().enumerate() {
            let (spacing, count) = (level.spacing, level.nodes.len());
            let fail = |what: String| Err(inconsistent(format!("level {at} of contact samples: {what}")));
            if !(spacing > finer_spacing && spacing < LARGEST) {
                return fail(format!(
                    "the spacing is {spacing:e} m, expected a finite number above {finer_spacing:e}"
                ));
            }
            if count == 0 || count >= finer_count {
                return fail(format!("{count} samples, expected 1 or more and below {finer_count}"));
            }
            check_nodes(level, surface_nodes).or_else(fail)?;
            (finer_spacing, finer_count) = (spacing, count);
        }
        let certificate = self.metadata.certificate.as_ref();
        let stated = certificate.map_or(&[][..], |certificate| &certificate.sample_levels);
        let is_stated = stated.len() == levels.len()
            && stated.iter().zip(levels).all(|(stated, level)| stated.is_of(level));
        // A recording without levels gets them from its surface, one without certificate states none.
        if levels.is_empty() || stated.is_empty() || is_stated {
            return Ok(());
        }
        Err(inconsistent(
            "the certificate states other levels of contact samples than the recording holds".into(),
        ))
    }
}

/// Check that samples are different surface nodes, and that the triangles join all of them and no others.
fn check_nodes(level: &SampleLevel, surface_nodes: usize) -> Result<(), String> {
    let mut is_sample = vec![false; surface_nodes];
    for &node in &level.nodes {
        match is_sample.get_mut(node as usize) {
            None => return Err(format!("sample node {node} is beyond the surface's {surface_nodes} nodes")),
            Some(true) => return Err(format!("node {node} is a sample twice")),
            Some(is_sample) => *is_sample = true,
        }
    }
    if let Some(at) = level.triangles.iter().position(|[a, b, c]| a == b || b == c || c == a) {
        return Err(format!("triangle {at} names a node twice"));
    }
    let mut is_joined = vec![false; surface_nodes];
    for (at, corners) in level.triangles.iter().enumerate() {
        for &node in corners {
            if !is_sample.get(node as usize).is_some_and(|is_sample| *is_sample) {
                return Err(format!("triangle {at} names node {node}, which is no sample"));
            }
            is_joined[node as usize] = true;
        }
    }
    match level.nodes.iter().find(|node| !level.triangles.is_empty() && !is_joined[**node as usize]) {
        Some(node) => Err(format!("sample node {node} is a corner of no triangle")),
        None => Ok(()),
    }
}

fn inconsistent(what: String) -> RecordingError {
    RecordingError::Inconsistent { part: RecordingPart::SampleLevels, what }
}
