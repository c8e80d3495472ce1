//! Checks of a recording's content, all in one place: after them a model can be made of it and a step cannot fail.
//!
//! A hash tells that a file is the one that was written, not that what was written is a body. The checks need no more memory than
//! the recording, and their time grows with its size.

use super::file::EMBEDDED_FORMAT_VERSIONS;
use super::quantised::shape_steps;
use super::{LARGEST, Recording, ResidualCompliance, Support};
use crate::error::{Error, RecordingError, RecordingPart};
use alloc::collections::{BTreeMap, BTreeSet};
use alloc::format;
use alloc::string::String;
use alloc::vec;
use alloc::vec::Vec;
use glam::{DMat3, DVec3};

/// Range of angular frequencies [rad/s]: a body from the size of a planet to that of a molecule. Modal coordinates within it
/// fit into single precision.
const ANGULAR_FREQUENCIES: [f64; 2] = [1e-6, 1e13];

/// Upper limit of mode shapes [1/√kg]: a body of 10⁻²⁴ kg.
const LARGEST_SHAPE: f64 = 1e12;

/// Round-off of sums over elements and of single precision, relative, in identities that a recording keeps.
const ROUND_OFF: f64 = 1e-5;

/// Field of a recording file, with the range of its numbers.
struct Field {
    part: RecordingPart,
    /// Name of the tensor or of the metadata's key.
    name: &'static str,
    /// Unit after a space; empty for a pure number.
    unit: &'static str,
    range: [f64; 2],
}

impl Field {
    fn fail<T>(&self, what: String) -> Result<T, RecordingError> {
        Err(RecordingError::Inconsistent { part: self.part, what: format!("{} {what}", self.name) })
    }

    fn check_length(&self, found: usize, expected: usize) -> Result<(), RecordingError> {
        if found == expected {
            Ok(())
        } else {
            self.fail(format!("holds {found} numbers, expected {expected}"))
        }
    }

    /// Check that numbers are in the range; NaN is not.
    fn check(&self, numbers: impl IntoIterator<Item = f64>) -> Result<(), RecordingError> {
        let [low, high] = self.range;
        match numbers.into_iter().enumerate().find(|(_, number)| !(low..=high).contains(number)) {
            Some((at, number)) => {
                let Self { part, name, unit, .. } = self;
                let what = format!("{name}[{at}] is {number:e}{unit}, expected {low:e} to {high:e}");
                Err(RecordingError::Inconsistent { part: *part, what })
            }
            None => Ok(()),
        }
    }
}

impl Recording {
    /// Check lengths, indices, finite numbers and physical ranges, so that a model can be made of it and a step cannot fail. A
    /// recording from a file has been checked.
    ///
    /// # Errors
    /// [`RecordingError::Inconsistent`] with the part, the field's name, the finding and the expectation.
    pub fn validate(&self) -> Result<(), Error> {
        self.metadata.validate()?;
        self.validate_surface()?;
        self.validate_embedding()?;
        self.validate_modes()?;
        self.validate_mass()?;
        self.residual.validate(self.model_nodes())?;
        self.validate_residual_size()?;
        self.validate_sample_levels()?;
        Ok(self.validate_gravity()?)
    }

    /// Check that the surface is the boundary of a body: nodes that differ and are all used, and triangles that close it.
    fn validate_surface(&self) -> Result<(), RecordingError> {
        let field = |name, unit, range| Field { part: RecordingPart::Surface, name, unit, range };
        let triangles = field("surface.triangles", "", [0.0, 0.0]);
        let sources = field("surface.source_nodes", "", [0.0, 0.0]);
        let nodes = self.surface.positions.len();
        if nodes == 0 || self.surface.triangles.is_empty() {
            return triangles.fail("is empty".into());
        }
        sources.check_length(self.surface.source_nodes.len(), nodes)?;
        let coordinates = self.surface.positions.iter().flat_map(DVec3::to_array);
        field("surface.positions", " m", [-LARGEST, LARGEST]).check(coordinates)?;
        check_triangles(&self.surface.triangles, nodes).or_else(|what| triangles.fail(what))?;
        let mut is_used = vec![false; nodes];
        self.surface.triangles.iter().flatten().for_each(|&node| is_used[node as usize] = true);
        if let Some(node) = is_used.iter().position(|used| !used) {
            return triangles
                .fail(format!("leave out surface node {node}, expected every node in a triangle"));
        }
        let mut sorted = self.surface.source_nodes.clone();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return sources.fail(format!("hold node {} twice, expected different nodes", pair[0]));
        }
        if self.surface.mean_edge() < 1.0 / LARGEST {
            let edge = self.surface.mean_edge();
            return triangles
                .fail(format!("have a mean edge of {edge:e} m, expected a surface with an extent"));
        }
        Ok(())
    }

    /// Check that an embedding fits the surface, and that the format's version tells of it.
    fn validate_embedding(&self) -> Result<(), RecordingError> {
        let version = self.metadata.format_version;
        if self.embedding.is_some() != EMBEDDED_FORMAT_VERSIONS.contains(&version) {
            let given = if self.embedding.is_some() { "an" } else { "no" };
            return Err(RecordingError::Inconsistent {
                part: RecordingPart::Surface,
                what: format!(
                    "{given} embedding is given with format version {version}, expected one with the versions {EMBEDDED_FORMAT_VERSIONS:?} alone"
                ),
            });
        }
        self.embedding.as_ref().map_or(Ok(()), |embedding| embedding.validate(self.surface.positions.len()))
    }

    fn validate_modes(&self) -> Result<(), RecordingError> {
        let field = |name, unit, range| Field { part: RecordingPart::Modes, name, unit, range };
        let (nodes, modes) = (self.surface.positions.len(), self.modes.len());
        let frequencies = field("modes.angular_frequencies", " rad/s", ANGULAR_FREQUENCIES);
        let ratios = field("modes.damping_ratios", "", [0.0, LARGEST]);
        let shapes = field("modes.mode_shapes", " 1/√kg", [-LARGEST_SHAPE, LARGEST_SHAPE]);
        ratios.check_length(self.modes.damping_ratios.len(), modes)?;
        shapes.check_length(self.modes.mode_shapes.len(), 3 * nodes * modes)?;
        frequencies.check(self.modes.angular_frequencies.iter().copied())?;
        ratios.check(self.modes.damping_ratios.iter().copied())?;
        shapes.check(self.modes.mode_shapes.iter().copied())?;
        let of_model = self.model_mode_shapes();
        shapes.check_length(of_model.len(), 3 * self.model_nodes() * modes)?;
        shapes.check(of_model.iter().copied())?;
        if self.metadata.is_compact() {
            let steps = shape_steps(of_model, modes);
            let mut in_steps = of_model.iter().zip(steps.iter().cycle()).map(|(shape, step)| shape / step);
            if let Some(at) = in_steps.position(|steps| steps != libm::rint(steps)) {
                return shapes.fail(format!(
                    "hold a number at {at} that is no whole step of its mode, as compact recordings need"
                ));
            }
        }
        let pairs = self.modes.angular_frequencies.windows(2);
        match pairs.into_iter().position(|pair| pair[0] > pair[1]) {
            Some(at) => {
                let [above, below] = [at, at + 1].map(|at| self.modes.angular_frequencies[at]);
                frequencies.fail(format!(
                    "are {above:e} and {below:e} rad/s at {at} and {}, expected ascending numbers",
                    at + 1
                ))
            }
            None => Ok(()),
        }
    }

    /// Check that mass and inertia are those of a body within the surface.
    fn validate_mass(&self) -> Result<(), RecordingError> {
        let field = |name, unit, range| Field { part: RecordingPart::Mass, name, unit, range };
        field("mass.mass_kg", " kg", [1.0 / LARGEST, LARGEST]).check([self.mass()])?;
        let centre = self.metadata.mass.center_of_mass_m;
        field("mass.center_of_mass_m", " m", [-LARGEST, LARGEST]).check(centre)?;
        let (inertia, tensor) = (field("mass.inertia_kg_m2", " kg·m²", [-LARGEST, LARGEST]), self.inertia());
        inertia.check(tensor.to_cols_array())?;
        if !is_inertia(&tensor) {
            return inertia.fail(
                "is not one of a body: symmetric, positive definite, and no principal value above the sum of the others".into(),
            );
        }
        let radius = self.surface.radius();
        let (found, most) = (tensor.diagonal().element_sum(), 2.0 * self.mass() * radius * radius);
        if found > most * (1.0 + ROUND_OFF) {
            return inertia.fail(format!(
                "has the trace {found:e} kg·m², expected {most:e} at most for this mass within the surface"
            ));
        }
        Ok(())
    }

    /// Check that the residual compliance can be positive semi-definite: |Sᵢⱼ| ≤ √(Sᵢᵢ·Sⱼⱼ) for every pair of directions, but for the
    /// round-off of the compliance G = S + Φ·Λ⁻¹·Φᵀ that it was computed from. Eigenvalues would take the cube of the size.
    fn validate_residual_size(&self) -> Result<(), RecordingError> {
        let (shapes, omegas) = (self.model_mode_shapes(), &self.modes.angular_frequencies);
        let modal = |node: usize, axis: usize| -> f64 {
            let row = shapes[(3 * node + axis) * omegas.len()..].iter().zip(omegas);
            row.map(|(phi, omega)| (phi / omega) * (phi / omega)).sum()
        };
        // √S and √G of every degree of freedom.
        let roots = |node: usize| {
            let own = self.residual.block(node, node).diagonal();
            let whole = own + DVec3::new(modal(node, 0), modal(node, 1), modal(node, 2));
            (own.map(libm::sqrt), whole.map(libm::sqrt))
        };
        let roots: Vec<(DVec3, DVec3)> = (0..self.model_nodes()).map(roots).collect();
        let check = |i: usize, j: usize, block: DMat3| {
            for (row, column) in (0..9).map(|at| (at / 3, at % 3)) {
                let (own, whole) =
                    (roots[i].0[row] * roots[j].0[column], roots[i].1[row] * roots[j].1[column]);
                let (found, most) = (block.col(column)[row].abs(), own + ROUND_OFF * whole);
                if found > most {
                    let what = format!(
                        "residual compliance between the surface nodes {i} and {j} is {found:e} m/N, expected {most:e} at most by their own"
                    );
                    return Err(RecordingError::Inconsistent { part: RecordingPart::Residual, what });
                }
            }
            Ok(())
        };
        match &self.residual {
            ResidualCompliance::None => Ok(()),
            ResidualCompliance::Whole(_) | ResidualCompliance::Quantised(_) => {
                let mut pairs = (0..roots.len()).flat_map(|i| (0..i).map(move |j| (i, j)));
                pairs.try_for_each(|(i, j)| check(i, j, self.residual.block(i, j)))
            }
            ResidualCompliance::NearField(near) => {
                (0..roots.len()).try_for_each(|i| near.row(i).try_for_each(|(j, block)| check(i, j, block)))
            }
        }
    }

    /// Check the response to gravity: none of a free body, and modal forces that are parts of the weight (Bessel's inequality).
    fn validate_gravity(&self) -> Result<(), RecordingError> {
        let field = |name, unit, range| Field { part: RecordingPart::Gravity, name, unit, range };
        let forces = field("gravity.modal_forces", " √kg", [-LARGEST, LARGEST]);
        let displacements = field("gravity.residual_displacements", " s²", [-LARGEST, LARGEST]);
        let gravity = match (&self.gravity, self.metadata.support) {
            (None, Support::Free) => return Ok(()),
            (Some(gravity), Support::Fixed) => gravity,
            (None, Support::Fixed) => return forces.fail("is missing: the body has fixed nodes".into()),
            (Some(_), Support::Free) => {
                return forces.fail("is given, but the body has no fixed nodes".into());
            }
        };
        let modes = self.modes.len();
        forces.check_length(gravity.modal_forces.len(), 3 * modes)?;
        displacements.check_length(gravity.residual_displacements.len(), 9 * self.surface.positions.len())?;
        forces.check(gravity.modal_forces.iter().copied())?;
        displacements.check(gravity.residual_displacements.iter().copied())?;
        if let Some(embedding) = &self.embedding {
            displacements.check_length(embedding.residual_displacements.len(), 9 * embedding.model_nodes)?;
            displacements.check(embedding.residual_displacements.iter().copied())?;
        }
        for axis in 0..3 {
            let found: f64 =
                gravity.modal_forces[axis * modes..][..modes].iter().map(|force| force * force).sum();
            if found > self.mass() * (1.0 + ROUND_OFF) {
                return forces.fail(format!(
                    "of axis {axis} have the squared sum {found:e} kg, expected the mass {:e} kg at most",
                    self.mass()
                ));
            }
        }
        Ok(())
    }
}

/// Check that triangles differ and name three different nodes each, and that every edge is passed as often in both directions, as in the boundary of a body.
pub(super) fn check_triangles(triangles: &[[u32; 3]], nodes: usize) -> Result<(), String> {
    let mut passes: BTreeMap<[u32; 2], i64> = BTreeMap::new();
    let mut different = BTreeSet::new();
    for (at, &[a, b, c]) in triangles.iter().enumerate() {
        if let Some(node) = [a, b, c].into_iter().find(|&node| node as usize >= nodes) {
            return Err(format!("name node {node} in triangle {at}, beyond the surface's {nodes} nodes"));
        }
        if a == b || b == c || c == a {
            return Err(format!("name a node twice in triangle {at}, expected three different ones"));
        }
        let from_least = [[a, b, c], [b, c, a], [c, a, b]].into_iter().min();
        if !different.insert(from_least) {
            return Err(format!("hold triangle {at} twice, expected different ones"));
        }
        for (from, to) in [(a, b), (b, c), (c, a)] {
            *passes.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    match passes.iter().find(|(_, passes)| **passes != 0) {
        Some(([a, b], _)) => {
            Err(format!("leave the edge between the nodes {a} and {b} open, expected a closed surface"))
        }
        None => Ok(()),
    }
}

/// Whether a tensor is the inertia of a body: its second moment of mass ½·tr(I)·1 − I is positive definite.
fn is_inertia(tensor: &DMat3) -> bool {
    let trace = tensor.diagonal().element_sum();
    let asymmetry =
        (*tensor - tensor.transpose()).to_cols_array().into_iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let moment = DMat3::from_diagonal(DVec3::splat(0.5 * trace)) - *tensor;
    let minor = moment.x_axis.x * moment.y_axis.y - moment.x_axis.y * moment.x_axis.y;
    trace >= 1.0 / (LARGEST * LARGEST)
        && asymmetry <= 1e-12 * trace
        && moment.x_axis.x > 0.0
        && minor > 0.0
        && moment.determinant() > 0.0
}
