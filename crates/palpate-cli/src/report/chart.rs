//! A line chart as SVG text that stands inside a page.
//!
//! Nothing lies over the data: the legend is below, labels of reference lines are outside the frame.
//! Colours come from the page (`--ink`, `--soft`, `--grid`, `--series-1` to `--series-6`); dashes and markers
//! tell series apart without them. Lengths are in units of the view box, pixels where the page has room.

use super::look::looks;
use super::text::{Anchor, LINE, short, text, width, wrapped};
use super::ticks::{Span, Tick};
use super::{Mark, Scale, escape, marks};
use glam::DVec2;

/// A chart of lines or markers over two axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// What stands above the chart, and what a screen reader says.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// What is drawn, later ones on top.
    pub series: Vec<Series>,
    /// Reference lines; the axes reach to them.
    pub notes: Vec<Mark>,
}

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity with its unit: "time [ms]".
    pub label: String,
    /// How values are spread.
    pub scale: Scale,
}

/// Points with one look.
#[derive(Clone, Debug)]
pub struct Series {
    /// What the legend says; left out of it if empty.
    pub label: String,
    /// (x, y) in the axes' units. A point that has no place (not finite, or not positive on a logarithmic
    /// axis) leaves a gap.
    pub points: Vec<(f64, f64)>,
    /// Its look.
    pub style: Style,
}

/// Look of a series.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line; the first is solid, further ones have long dashes.
    Line,
    /// A marker at each point.
    Markers,
    /// A marker at each point and a thin line between them.
    LineAndMarkers,
    /// A thin line with short dashes: what others are compared with.
    Dashed,
}

/// What the page's style sheet needs for charts.
pub const CHART_STYLE: &str = "\
.chart{display:block;width:100%;max-width:44rem;height:auto;overflow:visible}
.chart text{font-size:13px;fill:var(--soft)}
.chart .title{font-size:15px;font-weight:600;fill:var(--ink)}
.chart .label{fill:var(--ink)}
.chart path{fill:none;stroke-linecap:round;stroke-linejoin:round}
.chart .grid{stroke:var(--grid)}
.chart .axis{stroke:var(--soft)}
.chart .mark{stroke:var(--ink);stroke-width:1;stroke-opacity:.65}
.chart .line{stroke:currentColor;stroke-width:2.2}
.chart .thin{stroke:currentColor;stroke-width:1.5}
.chart path.markers{fill:currentColor}
.chart .s1{color:var(--series-1)}.chart .s2{color:var(--series-2)}.chart .s3{color:var(--series-3)}
.chart .s4{color:var(--series-4)}.chart .s5{color:var(--series-5)}.chart .s6{color:var(--series-6)}
";

/// Size of the picture and of the frame in it.
const WIDTH: f64 = 700.0;
const FRAME_HEIGHT: f64 = 300.0;
/// Length of a sample in the legend, and the room after it.
const SAMPLE: f64 = 46.0;
const ROOM: f64 = 8.0;
/// Most numbers along the horizontal axis.
const X_TICKS: usize = 8;

/// The frame of the data: its place in the picture and what its axes span.
pub struct Plot {
    /// Left edge.
    pub left: f64,
    /// Right edge.
    pub right: f64,
    /// Upper edge.
    pub top: f64,
    /// What the horizontal axis spans.
    pub x: Span,
    /// What the vertical axis spans.
    pub y: Span,
}

impl Plot {
    /// Lower edge.
    pub fn bottom(&self) -> f64 {
        self.top + FRAME_HEIGHT
    }

    /// Horizontal place of a share of the axis.
    pub fn across(&self, share: f64) -> f64 {
        self.left + share * (self.right - self.left)
    }

    /// Vertical place of a share of the axis.
    pub fn up(&self, share: f64) -> f64 {
        self.bottom() - share * FRAME_HEIGHT
    }

    /// Place of a point, if it has one.
    fn at(&self, (x, y): (f64, f64)) -> Option<DVec2> {
        Some(DVec2::new(self.across(self.x.share(x)?), self.up(self.y.share(y)?)))
    }
}

impl Chart {
    /// The chart as an `<svg>` element, 700 units wide; needs [`CHART_STYLE`] in the page.
    pub fn svg(&self) -> String {
        let mut body = format!("<title>{}</title>\n", escape(&self.title));
        let head_bottom = self.draw_head(&mut body);
        let plot = self.plot(head_bottom);
        let axes_bottom = self.draw_axes(&plot, &mut body);
        body.push_str(&marks::drawn(&self.notes, &plot));
        self.draw_series(&plot, &mut body);
        let height = self.draw_legend(plot.left, axes_bottom, &mut body);
        format!(
            "<svg class=\"chart\" role=\"img\" viewBox=\"0 0 {WIDTH} {}\">\n{body}</svg>\n",
            height.ceil()
        )
    }

    /// Title and the vertical axis' label; gives where they end.
    fn draw_head(&self, body: &mut String) -> f64 {
        let mut bottom = 0.0;
        // The title's letters are larger.
        for line in wrapped(&self.title, WIDTH / 1.2) {
            bottom += LINE + 2.0;
            body.push_str(&text("title", Anchor::Start, (0.0, bottom - 5.0), &line));
        }
        for line in wrapped(&self.y.label, WIDTH) {
            bottom += LINE;
            body.push_str(&text("label", Anchor::Start, (0.0, bottom - 4.0), &line));
        }
        bottom
    }

    /// What the axes reach, and the frame that leaves room for all labels below a height.
    fn plot(&self, top: f64) -> Plot {
        let points = self.series.iter().flat_map(|series| &series.points);
        let placed = points.filter(|&&(x, y)| self.x.scale.places(x) && self.y.scale.places(y));
        let x = placed
            .clone()
            .map(|point| point.0)
            .chain(self.notes.iter().filter_map(Mark::x).map(|mark| mark.0));
        let y = placed.map(|point| point.1).chain(self.notes.iter().filter_map(Mark::y).map(|mark| mark.0));
        // Markers stay clear of the ends.
        let has_markers =
            self.series.iter().any(|s| matches!(s.style, Style::Markers | Style::LineAndMarkers));
        let x = spanned(x, self.x.scale).padded(if has_markers { 0.03 } else { 0.0 });
        let y = match self.y.scale {
            Scale::Linear => spanned(y, Scale::Linear).rounded(self.y_ticks()),
            Scale::Log => spanned(y, Scale::Log).padded(0.04),
        };
        let numbers = y.ticks(self.y_ticks()).into_iter().filter_map(|tick| tick.label);
        let left = numbers.map(|label| width(&label)).fold(34.0, f64::max) + 10.0;
        let right = WIDTH - marks::right_margin(&self.notes, |at| x.share(at), left, WIDTH).max(32.0);
        let mut plot = Plot { left, right, top: top + 12.0, x, y };
        plot.top += marks::top_margin(&self.notes, &plot);
        plot
    }

    /// Most numbers along the vertical axis.
    fn y_ticks(&self) -> usize {
        if self.y.scale == Scale::Log { 8 } else { 6 }
    }

    /// Grid, axes, ticks, their numbers and the horizontal axis' label; gives where they end.
    fn draw_axes(&self, plot: &Plot, body: &mut String) -> f64 {
        let Plot { left, right, top, .. } = *plot;
        let bottom = plot.bottom();
        let (mut grid, mut axes, mut numbers) = (String::new(), String::new(), String::new());
        for Tick { share, label } in plot.x.ticks_that_fit(X_TICKS, right - left) {
            let at = plot.across(share);
            let length = if label.is_some() { 6 } else { 3 };
            axes.push_str(&format!("M{} {}v{length}", short(at), short(bottom)));
            if let Some(label) = label {
                grid.push_str(&format!("M{} {}V{}", short(at), short(bottom), short(top)));
                numbers.push_str(&text("", Anchor::Middle, (at, bottom + LINE), &label));
            }
        }
        for Tick { share, label } in plot.y.ticks(self.y_ticks()) {
            let at = plot.up(share);
            let length = if label.is_some() { 6 } else { 3 };
            axes.push_str(&format!("M{} {}h-{length}", short(left), short(at)));
            if let Some(label) = label {
                grid.push_str(&format!("M{} {}H{}", short(left), short(at), short(right)));
                numbers.push_str(&text("", Anchor::End, (left - 9.0, at + 4.5), &label));
            }
        }
        axes.push_str(&format!("M{} {}V{}H{}", short(left), short(top), short(bottom), short(right)));
        body.push_str(&format!("<path class=\"grid\" d=\"{grid}\"/>\n<path class=\"axis\" d=\"{axes}\"/>\n"));
        body.push_str(&numbers);
        let mut end = bottom + LINE + 7.0;
        for line in wrapped(&self.x.label, right - left) {
            end += LINE;
            body.push_str(&text("label", Anchor::Middle, ((left + right) / 2.0, end - 5.0), &line));
        }
        end
    }

    /// All series in order, each in runs of points that have a place.
    fn draw_series(&self, plot: &Plot, body: &mut String) {
        let mut is_empty = true;
        for (series, look) in self.series.iter().zip(looks(&self.series)) {
            let places: Vec<Option<DVec2>> = series.points.iter().map(|&point| plot.at(point)).collect();
            let runs: Vec<Vec<DVec2>> =
                places.split(Option::is_none).map(|run| run.iter().flatten().copied().collect()).collect();
            if runs.iter().any(|run| !run.is_empty()) {
                is_empty = false;
                body.push_str(&look.drawn(&runs));
            }
        }
        if is_empty {
            body.push_str(&text("", Anchor::Middle, (plot.across(0.5), plot.up(0.5)), "no data"));
        }
    }

    /// Samples and labels below a height, in as many rows as needed; gives where they end.
    fn draw_legend(&self, left: f64, top: f64, body: &mut String) -> f64 {
        let (mut x, mut y) = (left, top + 8.0);
        let mut bottom = y;
        for (series, look) in self.series.iter().zip(looks(&self.series)) {
            let lines = wrapped(&series.label, WIDTH - left - SAMPLE - ROOM);
            if lines.is_empty() {
                continue;
            }
            let length =
                lines.iter().map(|line| width(line)).fold(SAMPLE + ROOM, |l, w| l.max(SAMPLE + ROOM + w));
            if x > left && x + length > WIDTH {
                (x, y) = (left, bottom);
            }
            let middle = y + LINE / 2.0;
            body.push_str(&look.sample(DVec2::new(x + 2.0, middle), DVec2::new(x + SAMPLE - 2.0, middle)));
            for (i, line) in lines.iter().enumerate() {
                let baseline = y + LINE * (i + 1) as f64 - 5.0;
                body.push_str(&text("label", Anchor::Start, (x + SAMPLE + ROOM, baseline), line));
            }
            bottom = bottom.max(y + LINE * lines.len() as f64);
            x += length + 18.0;
        }
        bottom + 4.0
    }
}

/// The span of some values; of a unit or a decade if there are none.
fn spanned(values: impl Iterator<Item = f64>, scale: Scale) -> Span {
    let (low, high) = if scale == Scale::Log { (1.0, 10.0) } else { (0.0, 1.0) };
    Span::around(values, scale).unwrap_or(Span { scale, low, high })
}

#[cfg(test)]
mod tests {
    use super::super::tests::assert_well_formed;
    use super::*;

    fn series(points: Vec<(f64, f64)>, style: Style) -> Series {
        Series { label: "a < b".into(), points, style }
    }

    fn chart(x: Scale, y: Scale, series: Vec<Series>) -> Chart {
        let axis = |label: &str, scale| Axis { label: label.into(), scale };
        let title = "R[0] & \"sag\"".into();
        Chart { title, x: axis("time [ms]", x), y: axis("sag [mm]", y), series, notes: Vec::new() }
    }

    fn attribute<'a>(svg: &'a str, name: &str) -> Vec<&'a str> {
        let key = format!(" {name}=\"");
        svg.split(&key).skip(1).map(|rest| rest.split('"').next().expect("as it was drawn")).collect()
    }

    /// Places of all texts and of the absolute corners of all paths.
    fn places(svg: &str) -> Vec<(f64, f64)> {
        let number = |text: &&str| text.parse::<f64>().expect("as it was drawn");
        let texts = attribute(svg, "x")
            .iter()
            .zip(&attribute(svg, "y"))
            .map(|(x, y)| (number(x), number(y)))
            .collect();
        let mut all: Vec<(f64, f64)> = texts;
        for path in attribute(svg, "d") {
            for corner in path.split(['M', 'L']).skip(1) {
                let corner = corner.split(|c: char| c.is_ascii_alphabetic()).next().expect("as it was drawn");
                let (x, y) = corner.split_once(' ').expect("as it was drawn");
                all.push((number(&x), number(&y)));
            }
        }
        all
    }

    fn assert_inside(svg: &str) {
        let size: Vec<f64> =
            attribute(svg, "viewBox")[0].split(' ').map(|v| v.parse().expect("as it was drawn")).collect();
        for (x, y) in places(svg) {
            assert!((0.0..=size[2]).contains(&x) && (0.0..=size[3]).contains(&y), "{x} {y} outside {size:?}");
        }
    }

    #[test]
    fn everything_stays_within_the_view_box() {
        let wild = vec![
            (1e-9, -1e300),
            (f64::NAN, 1.0),
            (3.0, f64::INFINITY),
            (1e12, 4.0),
            (0.0, 0.0),
            (2.0, 1e-200),
        ];
        for style in [Style::Line, Style::Markers, Style::LineAndMarkers, Style::Dashed] {
            for (x, y) in [(Scale::Linear, Scale::Log), (Scale::Log, Scale::Linear), (Scale::Log, Scale::Log)]
            {
                for points in [wild.clone(), vec![(1.0, 1.0); 3], vec![(5.0, 2.0)], Vec::new()] {
                    let mut chart = chart(x, y, vec![series(points, style); 9]);
                    for at in [0.0, 1.0, 1.001, 1e6, f64::NAN] {
                        chart.notes.push(Mark::Vertical { x: at, label: "a label & more".into() });
                        chart.notes.push(Mark::Horizontal { y: at, label: "a label of many words <".into() });
                    }
                    let svg = chart.svg();
                    assert_inside(&svg);
                    assert_well_formed(&svg);
                    assert_eq!(svg, chart.svg());
                }
            }
        }
    }

    #[test]
    fn what_is_not_finite_leaves_a_gap() {
        let points = vec![
            (0.0, 0.0),
            (1.0, 1.0),
            (2.0, f64::NAN),
            (3.0, 1.0),
            (4.0, 2.0),
            (f64::INFINITY, 1.0),
            (6.0, 3.0),
        ];
        let svg = chart(Scale::Linear, Scale::Linear, vec![series(points, Style::Line)]).svg();
        let line = attribute(&svg, "d")[2];
        assert_eq!(line.matches('M').count(), 3);
        assert_eq!(line.matches('L').count(), 2);
        assert!(line.ends_with("h0"), "a point alone is a dot");
    }

    #[test]
    fn log_axis_skips_what_has_no_logarithm() {
        let points = vec![(1.0, 1.0), (2.0, 0.0), (3.0, -1.0), (4.0, 100.0)];
        let svg = chart(Scale::Log, Scale::Log, vec![series(points, Style::Markers)]).svg();
        assert_eq!(attribute(&svg, "d")[2].matches('z').count(), 2);
    }

    #[test]
    fn nothing_to_draw_is_said() {
        let svg = chart(Scale::Linear, Scale::Log, vec![series(vec![(f64::NAN, 1.0)], Style::Line)]).svg();
        assert!(svg.contains(">no data<"));
    }
}
