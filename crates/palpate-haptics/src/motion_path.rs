//! Path of a device or an obstacle: poses over time, linear between rows, constant before the first and after the last; and the
//! course of a force.

use glam::{DQuat, DVec3};
use palpate::Pose;
use thiserror::Error as ThisError;

/// Bound on times [s], lengths [m] and quaternion components: beyond it the unit is wrong.
const LARGEST: f64 = 1e6;

/// Columns that a path file may have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Columns {
    /// t [s], x, y, z [m].
    Position,
    /// t [s], x, y, z [m], optionally with the orientation qw, qx, qy, qz.
    Pose,
    /// t [s], fx, fy, fz [N].
    Force,
}

/// Path: rows of time [s] and pose [m, world], time ascending. The position may stand for another vector, as a force [N].
#[derive(Debug, Clone, PartialEq)]
pub struct MotionPath {
    rows: Vec<(f64, Pose)>,
    has_orientations: bool,
    repeats: bool,
}

/// Pose of an obstacle or a clamp, asked for at the start and at the end of every step, by its simulated time [s]. It must not allocate.
pub type PoseTrajectory = Box<dyn FnMut(f64) -> Pose + Send>;

const POSITION: [&str; 4] = ["t", "x", "y", "z"];
const FORCE: [&str; 4] = ["t", "fx", "fy", "fz"];
const POSE: [&str; 8] = ["t", "x", "y", "z", "qw", "qx", "qy", "qz"];

impl MotionPath {
    /// Path from CSV text with the given columns. A header line and lines that start with # are skipped.
    ///
    /// # Errors
    /// If a line has other columns, numbers that are not finite or below 10⁶, or a time that does not ascend.
    pub fn parse(text: &str, columns: Columns) -> Result<Self, PathError> {
        let mut rows: Vec<(f64, Pose)> = Vec::new();
        // Number of columns of all rows: that of the first.
        let mut width = None;
        let mut may_be_header = true;
        for (at, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let number = at + 1;
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let numbers: Result<Vec<f64>, _> = cells.iter().map(|cell| cell.parse::<f64>()).collect();
            let header = std::mem::replace(&mut may_be_header, false);
            let numbers = match numbers {
                Ok(numbers) => numbers,
                Err(_) if header && cells.iter().all(|cell| cell.parse::<f64>().is_err()) => {
                    let is_header = match columns {
                        Columns::Position => cells == POSITION,
                        Columns::Pose => cells == POSITION || cells == POSE,
                        Columns::Force => cells == FORCE,
                    };
                    if !is_header {
                        let (found, expected) = (cells.join(","), columns.names());
                        return Err(PathError::Header { line: number, found, expected });
                    }
                    width = Some(cells.len());
                    continue;
                }
                Err(_) => {
                    let (text, expected) = (short(line), columns.numbers(width, " numbers"));
                    return Err(PathError::NotNumbers { line: number, text, expected });
                }
            };
            let whole = numbers.len() == 4 || (columns == Columns::Pose && numbers.len() == 8);
            if !whole || width.is_some_and(|width| width != numbers.len()) {
                let (found, expected) = (numbers.len(), columns.numbers(width, ""));
                return Err(PathError::NumberCount { line: number, found, expected });
            }
            width = Some(numbers.len());
            if !numbers.iter().all(|number| number.abs() < LARGEST) {
                return Err(PathError::OutOfRange { line: number, text: short(line) });
            }
            let t = numbers[0];
            if let Some((last, _)) = rows.last().filter(|(last, _)| *last >= t) {
                return Err(PathError::NotAscending { line: number, t, last: *last });
            }
            let orientation = match numbers[4..] {
                [w, x, y, z] => unit_quaternion(w, x, y, z)
                    .map_err(|source| PathError::Orientation { line: number, source })?,
                _ => DQuat::IDENTITY,
            };
            rows.push((t, Pose { position: DVec3::new(numbers[1], numbers[2], numbers[3]), orientation }));
        }
        if rows.is_empty() {
            return Err(PathError::Empty { expected: columns.names(), unit: columns.unit() });
        }
        Ok(Self { rows, has_orientations: width == Some(POSE.len()), repeats: false })
    }

    /// Whether the rows have orientations.
    pub fn has_orientations(&self) -> bool {
        self.has_orientations
    }

    /// Periodic path, which starts again with its first row at the time of its last.
    #[must_use]
    pub fn repeating(self) -> Self {
        Self { repeats: true, ..self }
    }

    /// Vector of the rows at the middle of the step of `step_s` [s] that ends at a time [s]: its mean over the step, where it is linear
    /// there. For what is held over a step.
    pub fn mid_step(&self, end_s: f64, step_s: f64) -> DVec3 {
        self.at(end_s - 0.5 * step_s).position
    }

    /// Position that a base goes to in the step of `step_s` [s] that ends at a time [s], see `palpate::Input::bases`: that of the path half
    /// a step later, so that the base is not behind it.
    pub fn of_base(&self, end_s: f64, step_s: f64) -> DVec3 {
        self.at(end_s + 0.5 * step_s).position
    }

    /// Trajectory along the path.
    pub fn into_trajectory(self) -> PoseTrajectory {
        Box::new(move |time_s| self.at(time_s))
    }

    /// Pose [m, world] at a time [s]; the orientation is the identity if the rows have none.
    pub fn at(&self, t: f64) -> Pose {
        let (first, end) = (self.rows.first().map_or(0.0, |(time, _)| *time), self.end());
        let again = self.repeats && t > end && end > first;
        let t = if again { first + (t - first) % (end - first) } else { t };
        let after = self.rows.partition_point(|(time, _)| *time <= t);
        match (after.checked_sub(1).map(|before| self.rows[before]), self.rows.get(after)) {
            (Some((t0, from)), Some((t1, to))) => {
                let share = (t - t0) / (t1 - t0);
                let position = from.position + (to.position - from.position) * share;
                let orientation = if self.has_orientations {
                    // Spherical interpolation along the shorter arc.
                    from.orientation.slerp(to.orientation, share)
                } else {
                    DQuat::IDENTITY
                };
                Pose { position, orientation }
            }
            (Some((_, pose)), None) => pose,
            (None, first) => first.map_or(Pose::IDENTITY, |(_, pose)| *pose),
        }
    }

    /// Path with all times later by a delay [s].
    #[must_use]
    pub fn delayed_by(mut self, delay_s: f64) -> Self {
        self.rows.iter_mut().for_each(|(time, _)| *time += delay_s);
        self
    }

    /// Time of the last row [s].
    pub fn end(&self) -> f64 {
        self.rows.last().map_or(0.0, |(t, _)| *t)
    }
}

impl Columns {
    fn names(self) -> &'static str {
        match self {
            Self::Position => "t,x,y,z",
            Self::Pose => "t,x,y,z or t,x,y,z,qw,qx,qy,qz",
            Self::Force => "t,fx,fy,fz",
        }
    }

    /// Unit of the vectors.
    fn unit(self) -> &'static str {
        match self {
            Self::Position | Self::Pose => "m",
            Self::Force => "N",
        }
    }

    /// Description of a row with a known number of columns, or of all allowed rows.
    fn numbers(self, width: Option<usize>, numbers: &str) -> String {
        let vector = if self == Self::Force { "t,fx,fy,fz" } else { "t,x,y,z" };
        let (four, eight) =
            (format!("four{numbers} {vector}"), format!("eight{numbers} t,x,y,z,qw,qx,qy,qz"));
        match (self, width) {
            (Self::Pose, Some(8)) => eight,
            (Self::Pose, None) => format!("{four} or the {eight}"),
            _ => four,
        }
    }
}

/// Why a path file was refused. Lines count from 1.
#[derive(Debug, Clone, PartialEq, ThisError)]
#[non_exhaustive]
pub enum PathError {
    /// No rows.
    #[error("no rows, expected lines {expected} in s and {unit}")]
    Empty {
        /// Allowed columns.
        expected: &'static str,
        /// Unit of the vectors.
        unit: &'static str,
    },
    /// Header with other columns.
    #[error("line {line}: the columns are {found}, expected {expected}")]
    Header {
        /// Line.
        line: usize,
        /// Columns of the header.
        found: String,
        /// Allowed columns.
        expected: &'static str,
    },
    /// Cells that are no numbers.
    #[error("line {line}: {text:?} is not {expected}")]
    NotNumbers {
        /// Line.
        line: usize,
        /// Text of the line, shortened.
        text: String,
        /// Description of a row.
        expected: String,
    },
    /// Row with another number of columns.
    #[error("line {line}: {found} numbers, expected the {expected}")]
    NumberCount {
        /// Line.
        line: usize,
        /// Numbers of the row.
        found: usize,
        /// Description of a row.
        expected: String,
    },
    /// Number that is not finite, or at least 10⁶ in magnitude.
    #[error("line {line}: {text:?} must be finite and below {LARGEST:e}")]
    OutOfRange {
        /// Line.
        line: usize,
        /// Text of the line, shortened.
        text: String,
    },
    /// Time that does not come after the one before.
    #[error("line {line}: time {t} s does not come after {last} s")]
    NotAscending {
        /// Line.
        line: usize,
        /// Time [s].
        t: f64,
        /// Time of the row before [s].
        last: f64,
    },
    /// Orientation that is no unit quaternion.
    #[error("line {line}: {source}")]
    Orientation {
        /// Line.
        line: usize,
        /// Cause.
        source: QuaternionError,
    },
}

/// Quaternion whose length differs from 1 by more than 1 %.
#[derive(Debug, Clone, Copy, PartialEq, ThisError)]
#[error("orientation has length {length}, expected a unit quaternion w, x, y, z")]
pub struct QuaternionError {
    /// Length of the quaternion.
    pub length: f64,
}

/// Unit quaternion w + x·i + y·j + z·k, normalised.
///
/// # Errors
/// If its length differs from 1 by more than 1 %.
pub fn unit_quaternion(w: f64, x: f64, y: f64, z: f64) -> Result<DQuat, QuaternionError> {
    let orientation = DQuat::from_xyzw(x, y, z, w);
    let length = orientation.length();
    if !(0.99..=1.01).contains(&length) {
        return Err(QuaternionError { length });
    }
    Ok(orientation.normalize())
}

/// Line for a message, shortened to 60 characters.
fn short(line: &str) -> String {
    if line.chars().count() > 60 { line.chars().take(60).chain(['…']).collect() } else { line.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_linear_between_rows_and_constant_outside() {
        let path =
            MotionPath::parse("t,x,y,z\n0.5,0,0,0\n1.5,2,0,4\n", Columns::Position).expect("a good path");
        assert_eq!(path.at(0.0), Pose::IDENTITY);
        assert_eq!(path.at(1.0).position, DVec3::new(1.0, 0.0, 2.0));
        assert_eq!(path.at(9.0).position, DVec3::new(2.0, 0.0, 4.0));
        assert_eq!(path.end(), 1.5);
        assert_eq!(path.clone().delayed_by(2.0).at(3.0), path.at(1.0));
        assert!(!path.has_orientations());
    }

    #[test]
    fn a_repeating_path_begins_again_with_its_first_row() {
        let path = MotionPath::parse("1,0,0,0\n3,4,0,0\n", Columns::Position).expect("a path").repeating();
        for (t, x) in [(0.0, 0.0), (1.0, 0.0), (2.0, 2.0), (3.0, 4.0), (3.5, 1.0), (6.5, 3.0)] {
            assert_eq!(path.at(t).position.x, x, "{t}");
        }
        let still = MotionPath::parse("1,2,0,0\n", Columns::Position).expect("a path").repeating();
        assert_eq!(still.at(9.0).position.x, 2.0);
    }

    #[test]
    fn orientations_are_interpolated_along_the_shorter_arc() {
        // From 0 to 90° about z, the second given with the other sign.
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let text = format!("0,0,0,0,1,0,0,0\n1,0,0,1,-{half},0,0,-{half}\n");
        let path = MotionPath::parse(&text, Columns::Pose).expect("a good path");
        assert!(path.has_orientations());
        for share in [0.0, 0.25, 0.5, 1.0, 2.0] {
            let turned = path.at(share).orientation * DVec3::X;
            let angle = std::f64::consts::FRAC_PI_2 * share.min(1.0);
            assert!(
                (turned - DVec3::new(angle.cos(), angle.sin(), 0.0)).length() < 1e-15,
                "{share}: {turned}"
            );
        }
    }

    #[test]
    fn bad_rows_are_named_by_line() {
        let error =
            |text: &str| MotionPath::parse(text, Columns::Position).expect_err("a bad path").to_string();
        assert_eq!(error(""), "no rows, expected lines t,x,y,z in s and m");
        assert_eq!(error("t,x,y\n"), "line 1: the columns are t,x,y, expected t,x,y,z");
        assert_eq!(error("0,0,0,0\n1,2,NaN,0\n"), "line 2: \"1,2,NaN,0\" must be finite and below 1e6");
        assert_eq!(error("0,0,0,0\n1,2,a,0\n"), "line 2: \"1,2,a,0\" is not four numbers t,x,y,z");
        assert_eq!(error("0,0,0\n"), "line 1: 3 numbers, expected the four t,x,y,z");
        assert_eq!(error("0,0,0,0,1,0,0,0\n"), "line 1: 8 numbers, expected the four t,x,y,z");
        assert_eq!(error("1,0,0,0\n1,0,0,0\n"), "line 2: time 1 s does not come after 1 s");
        let error = |text: &str| MotionPath::parse(text, Columns::Force).expect_err("a bad path").to_string();
        assert_eq!(error("# none\n"), "no rows, expected lines t,fx,fy,fz in s and N");
        assert_eq!(error("t,x,y,z\n"), "line 1: the columns are t,x,y,z, expected t,fx,fy,fz");
        assert_eq!(error("0,0,0\n"), "line 1: 3 numbers, expected the four t,fx,fy,fz");
        let error = |text: &str| MotionPath::parse(text, Columns::Pose).expect_err("a bad path").to_string();
        assert_eq!(error(""), "no rows, expected lines t,x,y,z or t,x,y,z,qw,qx,qy,qz in s and m");
        assert_eq!(
            error("t,x,y,z,q\n"),
            "line 1: the columns are t,x,y,z,q, expected t,x,y,z or t,x,y,z,qw,qx,qy,qz"
        );
        assert_eq!(
            error("0,0,0,0,1\n"),
            "line 1: 5 numbers, expected the four t,x,y,z or the eight t,x,y,z,qw,qx,qy,qz"
        );
        assert_eq!(error("0,0,0,0\n1,0,0,0,1,0,0,0\n"), "line 2: 8 numbers, expected the four t,x,y,z");
        assert_eq!(
            error("t,x,y,z,qw,qx,qy,qz\n0,0,0,0\n"),
            "line 2: 4 numbers, expected the eight t,x,y,z,qw,qx,qy,qz"
        );
        assert_eq!(
            error("0,0,0,0,1,1,0,0\n"),
            "line 1: orientation has length 1.4142135623730951, expected a unit quaternion w, x, y, z"
        );
    }
}
