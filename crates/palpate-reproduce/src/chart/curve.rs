//! The look of a series: colour, dashes and marker, so that series differ without colour; and curves subsampled to what can be seen.

use super::{Series, Style, short};
use glam::DVec2;

/// Dash patterns of lines and of comparison lines.
const LINE_DASHES: [&str; 5] = ["", "14 6", "14 6 1 6", "14 6 1 6 1 6", "26 6"];
const COMPARISON_DASHES: [&str; 3] = ["5 5", "1 5", "5 5 1 5"];

/// Marker shapes about the origin: circle, square, triangle, diamond.
const SHAPES: [&str; 4] =
    ["m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z", "m-3.5-3.5h7v7h-7z", "m0-5 4.6 8h-9.2z", "m0-5 5 5-5 5-5-5z"];

/// Marker shapes of series without a line: a slim triangle that points down to the value, and one that points up.
const POINTERS: [&str; 2] = ["m0 0-3.5-11h7z", "m0 0-3.5 11h7z"];

/// Number of `--series-…` colours of the page.
const COLOURS: usize = 6;

/// Columns per unit of length, in each of which a dense curve keeps its first, lowest, highest and last point.
const COLUMNS: f64 = 2.0;

/// Look of one series of a chart.
pub struct Look {
    style: Style,
    colour: usize,
    dashes: &'static str,
    shape: &'static str,
}

/// Looks of the series, in their order.
pub fn looks(series: &[Series]) -> impl Iterator<Item = Look> {
    series.iter().enumerate().map(|(at, one)| {
        let of_its_style = series[..at].iter().filter(|other| other.style == one.style).count();
        let (dashes, shape) = match one.style {
            Style::Line => (LINE_DASHES[of_its_style % LINE_DASHES.len()], ""),
            Style::Dashed => (COMPARISON_DASHES[of_its_style % COMPARISON_DASHES.len()], ""),
            Style::LineAndMarkers => ("", SHAPES[of_its_style % SHAPES.len()]),
            Style::Markers => ("", POINTERS[of_its_style % POINTERS.len()]),
        };
        Look { style: one.style, colour: at % COLOURS + 1, dashes, shape }
    })
}

impl Look {
    /// The curve through runs of points without gaps, with a marker at each point.
    pub fn draw(&self, runs: &[Vec<DVec2>]) -> String {
        self.curve(runs) + &self.markers(runs.iter().flatten())
    }

    /// The sample in the legend, from one point to another.
    pub fn sample(&self, from: DVec2, to: DVec2) -> String {
        self.curve(&[vec![from, to]]) + &self.markers([(from + to) / 2.0].iter())
    }

    fn curve(&self, runs: &[Vec<DVec2>]) -> String {
        if self.style == Style::Markers {
            return String::new();
        }
        let class = if self.style == Style::Line { "line" } else { "thin" };
        let dashes = match self.dashes {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        let path: String = runs.iter().map(|run| polyline(&subsampled(run))).collect();
        format!("<path class=\"{class} s{}\"{dashes} d=\"{path}\"/>\n", self.colour)
    }

    fn markers<'a>(&self, points: impl Iterator<Item = &'a DVec2>) -> String {
        if self.shape.is_empty() {
            return String::new();
        }
        let path: String =
            points.map(|at| format!("M{} {}{}", short(at.x), short(at.y), self.shape)).collect();
        format!("<path class=\"markers s{}\" d=\"{path}\"/>\n", self.colour)
    }
}

/// A path through points; a single one becomes a dot.
fn polyline(run: &[DVec2]) -> String {
    let corners = run.iter().enumerate().map(|(i, at)| {
        let command = if i == 0 { 'M' } else { 'L' };
        format!("{command}{} {}", short(at.x), short(at.y))
    });
    corners.chain((run.len() == 1).then(|| "h0".to_owned())).collect()
}

/// The points of a curve that differ at the size of the chart.
fn subsampled(run: &[DVec2]) -> Vec<DVec2> {
    let mut kept = Vec::new();
    for column in run.chunk_by(|a, b| (a.x * COLUMNS).floor() == (b.x * COLUMNS).floor()) {
        let by_height = |&i: &usize, &j: &usize| column[i].y.total_cmp(&column[j].y);
        let low = (0..column.len()).min_by(by_height).unwrap_or(0);
        let high = (0..column.len()).max_by(by_height).unwrap_or(0);
        let mut picked = [0, low, high, column.len() - 1];
        picked.sort_unstable();
        kept.extend(picked.map(|i| column[i]));
    }
    kept.dedup();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_dense_curve_is_small_and_keeps_its_peak() {
        let at = |i: u32| DVec2::new(6e-3 * f64::from(i), 150.0 + 140.0 * (0.2 * f64::from(i)).sin());
        let mut run: Vec<DVec2> = (0..100_000).map(at).collect();
        run[54_321].y = 1.0;
        let kept = subsampled(&run);
        assert!(kept.len() <= 4 * 1201 && kept.contains(&run[54_321]), "{} points", kept.len());
        assert_eq!(subsampled(&run[..1]), run[..1]);
        assert!(subsampled(&[]).is_empty());
    }

    #[test]
    fn series_differ_without_colour() {
        let one = |style| Series { label: String::new(), points: Vec::new(), style };
        let styles = [Style::Line, Style::Dashed, Style::LineAndMarkers];
        let all: Vec<Series> = styles.into_iter().flat_map(|style| (0..3).map(move |_| one(style))).collect();
        let looks: Vec<(&str, &str)> = looks(&all).map(|look| (look.dashes, look.shape)).collect();
        assert!((1..looks.len()).all(|i| !looks[..i].contains(&looks[i])));
    }
}
