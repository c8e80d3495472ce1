//! How a series is drawn: colour, dashes and markers, and lines of no more corners than can be seen.

use super::chart::{Series, Style};
use super::text::short;
use glam::DVec2;

/// Dashes of lines and of comparison lines; round caps make each one line width longer.
const LONG_DASHES: [&str; 5] = ["", "14 6", "14 6 1 6", "14 6 1 6 1 6", "26 6"];
const SHORT_DASHES: [&str; 4] = ["5 5", "1 5", "5 5 1 5", "5 5 5 5 1 5"];
/// Marker shapes about the origin: circle, square, triangle up, diamond, triangle down, cross.
const SHAPES: [&str; 6] = [
    "m-4 0a4 4 0 1 0 8 0a4 4 0 1 0-8 0z",
    "m-3.5-3.5h7v7h-7z",
    "m0-5 4.6 8h-9.2z",
    "m0-5 5 5-5 5-5-5z",
    "m0 5 4.6-8h-9.2z",
    "m-1.3-4.5h2.6v3.2h3.2v2.6h-3.2v3.2h-2.6v-3.2h-3.2v-2.6h3.2z",
];
/// Number of `--series-…` colours.
const COLOURS: usize = 6;
/// Columns that a dense line is thinned to, per unit of length.
const COLUMNS: f64 = 2.0;
/// How far a thinned line may be off, in units of length.
const UNSEEN: f64 = 0.15;

/// What tells a series from its neighbours.
pub struct Look {
    style: Style,
    colour: usize,
    dashes: &'static str,
    shape: &'static str,
}

/// Looks in the order of the series: colours and shapes come round, so do dashes among lines of one kind.
pub fn looks(series: &[Series]) -> impl Iterator<Item = Look> {
    series.iter().enumerate().map(|(at, one)| {
        let before = |style| series[..at].iter().filter(|other| other.style == style).count();
        let dashes = match one.style {
            Style::Line => LONG_DASHES[before(Style::Line) % LONG_DASHES.len()],
            Style::Dashed => SHORT_DASHES[before(Style::Dashed) % SHORT_DASHES.len()],
            Style::Markers | Style::LineAndMarkers => "",
        };
        let shape = SHAPES[(before(Style::Markers) + before(Style::LineAndMarkers)) % SHAPES.len()];
        Look { style: one.style, colour: at % COLOURS + 1, dashes, shape }
    })
}

impl Look {
    /// Lines through runs of places, and a marker at each.
    pub fn drawn(&self, runs: &[Vec<DVec2>]) -> String {
        self.line(runs) + &self.markers(runs.iter().flatten())
    }

    /// What the legend shows from one place to another.
    pub fn sample(&self, from: DVec2, to: DVec2) -> String {
        self.line(&[vec![from, to]]) + &self.markers([(from + to) / 2.0].iter())
    }

    fn line(&self, runs: &[Vec<DVec2>]) -> String {
        let path: String = runs.iter().map(|run| polyline(&thinned(run))).collect();
        let class = match self.style {
            Style::Line => "line",
            Style::LineAndMarkers | Style::Dashed => "thin",
            Style::Markers => return String::new(),
        };
        let dashes = match self.dashes {
            "" => String::new(),
            dashes => format!(" stroke-dasharray=\"{dashes}\""),
        };
        format!("<path class=\"{class} s{}\"{dashes} d=\"{path}\"/>\n", self.colour)
    }

    fn markers<'a>(&self, places: impl Iterator<Item = &'a DVec2>) -> String {
        if matches!(self.style, Style::Line | Style::Dashed) {
            return String::new();
        }
        let mut each: Vec<String> =
            places.map(|at| format!("M{} {}{}", short(at.x), short(at.y), self.shape)).collect();
        each.dedup();
        format!("<path class=\"markers s{}\" d=\"{}\"/>\n", self.colour, each.concat())
    }
}

/// A path through places; one alone becomes a dot.
fn polyline(run: &[DVec2]) -> String {
    let corners = run.iter().enumerate().map(|(i, at)| {
        let command = if i == 0 { 'M' } else { 'L' };
        format!("{command}{} {}", short(at.x), short(at.y))
    });
    corners.chain((run.len() == 1).then(|| "h0".to_owned())).collect()
}

/// The corners that are seen. Of those in one narrow column the first, lowest, highest and last; of these the
/// ones off the line through the others (Ramer 1972, Douglas and Peucker 1973).
fn thinned(run: &[DVec2]) -> Vec<DVec2> {
    let mut corners = Vec::new();
    for column in run.chunk_by(|a, b| (a.x * COLUMNS).floor() == (b.x * COLUMNS).floor()) {
        let by_height = |&i: &usize, &j: &usize| column[i].y.total_cmp(&column[j].y);
        let low = (0..column.len()).min_by(by_height).unwrap_or(0);
        let high = (0..column.len()).max_by(by_height).unwrap_or(0);
        let mut picked = [0, low, high, column.len() - 1];
        picked.sort_unstable();
        corners.extend(picked.map(|i| column[i]));
    }
    corners.dedup();
    let mut kept = Vec::new();
    straighten(&corners, &mut kept);
    kept.extend(corners.last());
    kept
}

/// Keep the corners of a line, without its last one, that its chord or those of its parts do not stand for.
fn straighten(corners: &[DVec2], kept: &mut Vec<DVec2>) {
    let [first, between @ .., last] = corners else { return };
    let chord = *last - *first;
    let distance = |at: &DVec2| {
        let share =
            ((*at - *first).dot(chord) / chord.length_squared().max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        at.distance(*first + share * chord)
    };
    let farthest = between.iter().map(distance).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
    match farthest {
        Some((i, off)) if off > UNSEEN => {
            straighten(&corners[..=i + 1], kept);
            straighten(&corners[i + 1..], kept);
        }
        _ => kept.push(*first),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(n: u32, periods: f64) -> Vec<DVec2> {
        let share = |i| f64::from(i) / f64::from(n - 1);
        (0..n)
            .map(|i| DVec2::new(600.0 * share(i), 150.0 + 140.0 * (share(i) * periods * 6.3).sin()))
            .collect()
    }

    #[test]
    fn a_straight_line_is_two_corners() {
        let run: Vec<DVec2> = (0..500).map(|i| DVec2::new(f64::from(i), 0.5 * f64::from(i))).collect();
        assert_eq!(thinned(&run), [run[0], run[499]]);
        assert_eq!(thinned(&run[..1]), run[..1]);
        assert!(thinned(&[]).is_empty());
    }

    #[test]
    fn a_thinned_curve_stays_within_what_is_unseen() {
        let run = wave(1200, 3.0);
        let kept = thinned(&run);
        assert!(kept.len() < 150, "{} corners", kept.len());
        for at in &run {
            let next = kept.iter().position(|corner| corner.x >= at.x).expect("as it was drawn").max(1);
            let (a, b) = (kept[next - 1], kept[next]);
            let height = a.y + (b.y - a.y) * (at.x - a.x) / (b.x - a.x);
            // Steepest slope of the curve is 4.4.
            assert!((height - at.y).abs() < 4.6 * UNSEEN);
        }
    }

    #[test]
    fn a_dense_curve_is_small_and_keeps_its_peak() {
        let mut run = wave(100_000, 3000.0);
        run[54_321].y = 1.0;
        let path = polyline(&thinned(&run));
        assert!(path.len() < 60_000, "{} bytes", path.len());
        assert!(thinned(&run).contains(&run[54_321]));
    }

    #[test]
    fn a_closed_loop_stays_open_to_the_eye() {
        let run: Vec<DVec2> =
            (0..=90).map(|i| 50.0 * DVec2::from_angle(f64::from(i % 90) * 4_f64.to_radians())).collect();
        assert!(thinned(&run).len() > 20);
    }

    #[test]
    fn lines_differ_without_colour() {
        let one = |style| Series { label: String::new(), points: Vec::new(), style };
        let all: Vec<Series> = [Style::Line, Style::Dashed, Style::LineAndMarkers]
            .into_iter()
            .flat_map(|style| (0..4).map(move |_| one(style)))
            .collect();
        let looks: Vec<(&str, &str)> = looks(&all)
            .map(|look| match look.style {
                Style::LineAndMarkers => (look.dashes, look.shape),
                _ => (look.dashes, ""),
            })
            .collect();
        assert!((1..looks.len()).all(|i| !looks[..i].contains(&looks[i])));
    }
}
