//! Number of modes by the certificate: the fewest, doubled from [`FEWEST_MODES`] on, whose recording keeps stated errors.

use crate::body::RecordedBody;
use crate::progress::Progress;
use crate::record::{RecordExtent, RecordParameters};
use crate::record_error::RecordError;
use palpate::Certificate;
use palpate_mesh::Mesh;

/// First number of modes that is tried.
const FEWEST_MODES: usize = 25;

/// Upper limit of the number of modes: beyond it a step takes longer than 100 µs.
const MOST_MODES: usize = 3200;

/// Errors that a recording has to keep, by its certificate.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ErrorTarget {
    /// Upper limit of the peak force error, held and touched, at one, two and three places [1].
    pub force_error: Option<f64>,
    /// Lower limit of the bandwidth [Hz].
    pub bandwidth_hz: Option<f64>,
}

impl ErrorTarget {
    /// Whether a certificate keeps it.
    pub fn is_kept_by(&self, certificate: &Certificate) -> bool {
        let force_error = peak_force_error(certificate);
        self.force_error.is_none_or(|most| force_error <= most)
            && self.bandwidth_hz.is_none_or(|least| certificate.bandwidth_hz >= least)
    }

    fn check(&self) -> Result<(), RecordError> {
        let numbers = [("force error", self.force_error), ("bandwidth [Hz]", self.bandwidth_hz)];
        match numbers
            .into_iter()
            .find(|(_, given)| given.is_some_and(|given| !(given > 0.0 && given.is_finite())))
        {
            Some((what, given)) => Err(RecordError::Target { what, given: given.unwrap_or(f64::NAN) }),
            None => Ok(()),
        }
    }
}

/// Largest peak force error of a certificate [1].
fn peak_force_error(certificate: &Certificate) -> f64 {
    let peak = certificate.peak_force_error_max.iter().flat_map(|peak| peak.held.iter().chain(&peak.touched));
    peak.copied().fold(certificate.force_error_max, f64::max)
}

impl RecordedBody {
    /// Records a mesh like [`Self::new`] with the fewest modes of 25, 50, 100, … whose certificate keeps a target; the parameters' own
    /// number of modes does not count. It costs up to twice the last recording.
    ///
    /// # Errors
    /// As of [`Self::new`], and [`RecordError::TargetMissed`] when 3200 modes, or all of the body, don't keep it.
    pub fn within(
        mesh: &Mesh,
        parameters: &RecordParameters,
        target: &ErrorTarget,
        progress: &mut dyn Progress,
    ) -> Result<Self, RecordError> {
        target.check()?;
        let mut modes = FEWEST_MODES;
        loop {
            let attempt = RecordParameters { modes, extent: RecordExtent::Full, ..parameters.clone() };
            let mut listener = Attempt { progress: &mut *progress, modes, warnings: Vec::new() };
            let body = Self::new(mesh.clone(), &attempt, &mut listener)?;
            let warnings = listener.warnings;
            let Some(certificate) = &body.recording.metadata.certificate else {
                unreachable!("recordings of full extent have a certificate")
            };
            if target.is_kept_by(certificate) {
                warnings.iter().for_each(|warning| progress.warn(warning));
                return Ok(body);
            }
            let [kept, all] = certificate.modes_of;
            if kept >= all || modes >= MOST_MODES {
                return Err(RecordError::TargetMissed {
                    modes: kept,
                    force_error: peak_force_error(certificate),
                    bandwidth_hz: certificate.bandwidth_hz,
                });
            }
            modes *= 2;
        }
    }
}

/// Progress of an attempt, with its number of modes in the stages' names. Its warnings wait until it is kept.
struct Attempt<'a> {
    progress: &'a mut dyn Progress,
    modes: usize,
    warnings: Vec<String>,
}

impl Progress for Attempt<'_> {
    fn begin(&mut self, stage: &str, total: u64) {
        self.progress.begin(&format!("{} modes: {stage}", self.modes), total);
    }

    fn advance(&mut self, units: u64) {
        self.progress.advance(units);
    }

    fn warn(&mut self, text: &str) {
        self.warnings.push(text.to_owned());
    }

    fn is_interrupted(&self) -> bool {
        self.progress.is_interrupted()
    }
}
