//! The path of a device: positions over time, linear between rows, constant before and after.

use crate::Failure;
use crate::scene_file::LARGEST;
use glam::DVec3;
use std::path::Path;

/// Rows (t [s], position [m, world]), t ascending.
#[derive(Debug, Clone, PartialEq)]
pub struct DevicePath {
    rows: Vec<(f64, DVec3)>,
}

impl DevicePath {
    /// Read a CSV file with the columns t, x, y, z; a header line and lines that start with # are passed over.
    pub fn read(path: &Path) -> Result<Self, Failure> {
        let text = std::fs::read_to_string(path).map_err(|e| Failure::file("read the path", path, &e))?;
        Self::parse(&text).map_err(|what| Failure(format!("path {}: {what}", path.display())))
    }

    fn parse(text: &str) -> Result<Self, String> {
        let mut rows: Vec<(f64, DVec3)> = Vec::new();
        let mut may_be_header = true;
        for (at, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let place = format!("line {}", at + 1);
            let cells: Vec<&str> = line.split(',').map(str::trim).collect();
            let numbers: Result<Vec<f64>, _> = cells.iter().map(|cell| cell.parse::<f64>()).collect();
            let header = std::mem::replace(&mut may_be_header, false);
            let numbers = match numbers {
                Ok(numbers) => numbers,
                Err(_) if header && cells.iter().all(|cell| cell.parse::<f64>().is_err()) => {
                    if cells != ["t", "x", "y", "z"] {
                        return Err(format!(
                            "{place}: the columns are {}, expected t,x,y,z",
                            cells.join(",")
                        ));
                    }
                    continue;
                }
                Err(_) => return Err(format!("{place}: {:?} is not four numbers t,x,y,z", short(line))),
            };
            let [t, x, y, z] = numbers[..] else {
                return Err(format!("{place}: {} numbers, expected the four t,x,y,z", numbers.len()));
            };
            if !numbers.iter().all(|number| number.abs() < LARGEST) {
                return Err(format!("{place}: {:?} must be finite and below {LARGEST:e}", short(line)));
            }
            if let Some((last, _)) = rows.last().filter(|(last, _)| *last >= t) {
                return Err(format!("{place}: time {t} s does not come after {last} s"));
            }
            rows.push((t, DVec3::new(x, y, z)));
        }
        if rows.is_empty() {
            return Err("no rows, expected lines t,x,y,z in s and m".into());
        }
        Ok(Self { rows })
    }

    /// Position [m, world] at a time [s].
    pub fn at(&self, t: f64) -> DVec3 {
        let after = self.rows.partition_point(|(time, _)| *time <= t);
        match (after.checked_sub(1).map(|before| self.rows[before]), self.rows.get(after)) {
            (Some((t0, p0)), Some((t1, p1))) => p0 + (*p1 - p0) * ((t - t0) / (t1 - t0)),
            (Some((_, p)), None) => p,
            (None, first) => first.map_or(DVec3::ZERO, |(_, p)| *p),
        }
    }

    /// Time of the last row [s].
    pub fn end(&self) -> f64 {
        self.rows.last().map_or(0.0, |(t, _)| *t)
    }
}

/// A line as it may stand in a message.
fn short(line: &str) -> String {
    if line.chars().count() > 60 { line.chars().take(60).chain(['…']).collect() } else { line.to_string() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_are_linear_between_rows_and_constant_outside() {
        let path = DevicePath::parse("t,x,y,z\n0.5,0,0,0\n1.5,2,0,4\n").expect("a good path");
        assert_eq!(path.at(0.0), DVec3::ZERO);
        assert_eq!(path.at(1.0), DVec3::new(1.0, 0.0, 2.0));
        assert_eq!(path.at(9.0), DVec3::new(2.0, 0.0, 4.0));
        assert_eq!(path.end(), 1.5);
    }

    #[test]
    fn bad_rows_are_named_by_line() {
        let error = |text: &str| DevicePath::parse(text).err().unwrap_or_default();
        assert_eq!(error(""), "no rows, expected lines t,x,y,z in s and m");
        assert_eq!(error("t,x,y\n"), "line 1: the columns are t,x,y, expected t,x,y,z");
        assert_eq!(error("0,0,0,0\n1,2,NaN,0\n"), "line 2: \"1,2,NaN,0\" must be finite and below 1e6");
        assert_eq!(error("0,0,0,0\n1,2,a,0\n"), "line 2: \"1,2,a,0\" is not four numbers t,x,y,z");
        assert_eq!(error("0,0,0\n"), "line 1: 3 numbers, expected the four t,x,y,z");
        assert_eq!(error("1,0,0,0\n1,0,0,0\n"), "line 2: time 1 s does not come after 1 s");
    }
}
