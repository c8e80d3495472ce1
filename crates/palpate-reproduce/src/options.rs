//! Options of a reproduction.

use palpate_fem::paper_cube::CELLS;
use std::path::PathBuf;

/// A part that can be made by itself; in the order of the paper.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// Table 1: size of the model and cost of recording.
    Recording,
    /// Figures 2 and 3: impulse responses, and the arrival of the wave.
    Impulses,
    /// Passivity of the samples.
    Passivity,
    /// Agreement of both forms of the response and of both ways of recording; contact between nodes.
    Agreement,
    /// Motion: what equation (3) drops, and equations (11) to (14).
    Motion,
    /// Cost of direct convolution (section 2.5), and of finite elements.
    Cost,
    /// Figure 5(a): a fall.
    Fall,
    /// Figure 5(b): two devices that shake the cube.
    Shake,
}

impl Part {
    /// All parts, in the order of the paper.
    pub const ALL: [Self; 8] = [
        Self::Recording,
        Self::Impulses,
        Self::Passivity,
        Self::Agreement,
        Self::Motion,
        Self::Cost,
        Self::Fall,
        Self::Shake,
    ];

    /// Name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Impulses => "impulses",
            Self::Passivity => "passivity",
            Self::Agreement => "agreement",
            Self::Motion => "motion",
            Self::Cost => "cost",
            Self::Fall => "fall",
            Self::Shake => "shake",
        }
    }

    /// Content, as part of a sentence.
    pub fn content(self) -> &'static str {
        match self {
            Self::Recording => "Figure 1, Table 1",
            Self::Impulses => "Figures 2 and 3, and the arrival of the wave",
            Self::Passivity => "Passivity of the samples",
            Self::Agreement => "Both forms of the response, both ways of recording",
            Self::Motion => "Equations (3) and (11) to (14)",
            Self::Cost => "Section 2.5, finite elements beside it",
            Self::Fall => "Figure 5(a)",
            Self::Shake => "Figures 4 and 5(b)",
        }
    }
}

/// Thoroughness of the measurements.
#[derive(Debug, Clone, Copy)]
pub struct Effort {
    /// Cells along a side of the cube; the paper's has 12.
    pub cells: u32,
    /// Columns of the table that are timed.
    pub columns: usize,
    /// Steps that are timed per point of a curve.
    pub steps: usize,
}

impl Default for Effort {
    /// The paper's mesh, and enough columns and steps for three digits.
    fn default() -> Self {
        Self { cells: CELLS, columns: 96, steps: 4000 }
    }
}

/// Options of [`reproduce`](crate::reproduce).
#[derive(Debug, Clone)]
pub struct Options {
    /// Folder of the report and its numbers.
    pub output: PathBuf,
    /// The program `palpate`, which runs scenes and devices in processes of their own.
    pub program: PathBuf,
    /// The browser that draws images; by default the first known one.
    pub browser: Option<PathBuf>,
    /// Thoroughness of the measurements.
    pub effort: Effort,
    /// Commit of the program's sources, if it is known.
    pub commit: Option<&'static str>,
    /// Parts to make; they come in the order of the paper.
    pub parts: Vec<Part>,
}

impl Options {
    /// Folder of the scenes that are run, with all that they need.
    pub(crate) fn scenes(&self) -> PathBuf {
        self.output.join("scenes")
    }
}
