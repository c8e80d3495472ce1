//! Line charts as SVG elements of a page.
//!
//! Nothing covers the data: the legend stands below the frame, labels of reference lines beside it. Colours are the page's variables
//! (`--ink`, `--soft`, `--grid`, `--series-1` to `--series-6`), so that charts follow its light and dark theme; dashes and markers tell
//! series apart without them. Lengths are in units of the view box: pixels at full width.

mod axis;
mod curve;

pub use axis::{Range, Scale};

use crate::html::escape;
use curve::looks;
use glam::DVec2;

/// A chart of curves over two axes.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Title above the chart, also for screen readers.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Curves, later ones on top.
    pub series: Vec<Series>,
    /// Reference lines; the axes reach to them.
    pub reference_lines: Vec<ReferenceLine>,
}

/// One axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity with its unit: "time [ms]".
    pub label: String,
    /// Spacing of the values.
    pub scale: Scale,
}

/// One curve.
#[derive(Clone, Debug)]
pub struct Series {
    /// Text in the legend.
    pub label: String,
    /// (x, y) in the axes' units. A point without a position (not finite, or not positive on a logarithmic axis) leaves a gap.
    pub points: Vec<(f64, f64)>,
    /// Look of the curve.
    pub style: Style,
}

/// Look of a curve.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// A line; the first of a chart is solid, further ones have long dashes.
    Line,
    /// A marker at each point and a thin line between them.
    LineAndMarkers,
    /// A thin line with short dashes, for comparison.
    Dashed,
    /// A marker at each point, without a line.
    Markers,
}

/// A thin line at one value of an axis, across the chart.
#[derive(Clone, Debug)]
pub struct ReferenceLine {
    /// The axis that has the value: the line of a y is horizontal.
    pub axis: AxisName,
    /// Value in the axis' unit.
    pub value: f64,
    /// Label beside the frame, for an x above it: "paper: 16 ms".
    pub label: String,
}

/// One of the two axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AxisName {
    /// The horizontal one.
    X,
    /// The vertical one.
    Y,
}

/// Width of the picture, and height of the frame of the data in it.
const WIDTH: f64 = 700.0;
const FRAME_HEIGHT: f64 = 300.0;

/// Height of a line of text, and the advance of a character: that of a wide font, since the reader's is not known.
const LINE: f64 = 19.0;
const ADVANCE: f64 = 8.0;

/// Length of a sample in the legend with the gap after it, and the gap between entries.
const SAMPLE: f64 = 54.0;
const GAP: f64 = 18.0;

/// Largest number of intervals between labelled ticks: horizontal, vertical linear, vertical logarithmic.
const INTERVALS: [usize; 3] = [7, 6, 8];

/// The frame of the data: its edges in the picture, and the ranges of its axes.
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
    x: Range,
    y: Range,
}

impl Frame {
    fn x_at(&self, value: f64) -> Option<f64> {
        Some(self.left + self.x.position(value)? * (self.right - self.left))
    }

    fn y_at(&self, value: f64) -> Option<f64> {
        Some(self.bottom - self.y.position(value)? * (self.bottom - self.top))
    }

    fn at(&self, (x, y): (f64, f64)) -> Option<DVec2> {
        Some(DVec2::new(self.x_at(x)?, self.y_at(y)?))
    }
}

impl Chart {
    /// The chart as an `<svg>` element; needs the page's style sheet.
    pub fn svg(&self) -> String {
        let frame = self.frame();
        let mut body = format!("<title>{}</title>\n", escape(&self.title));
        body += &text("title", "start", (0.0, 16.0), &self.title);
        body += &text("label", "start", (0.0, 36.0), &self.y.label);
        self.draw_axes(&frame, &mut body);
        self.draw_reference_lines(&frame, &mut body);
        self.draw_series(&frame, &mut body);
        let height = self.draw_legend(&frame, &mut body);
        format!("<svg class=\"chart\" role=\"img\" viewBox=\"0 0 {WIDTH} {height}\">\n{body}</svg>\n")
    }

    /// Ranges of the axes, and the frame that leaves room for the labels.
    fn frame(&self) -> Frame {
        let points = || self.series.iter().flat_map(|series| &series.points);
        let placed = || {
            points()
                .filter(|(x, y)| self.x.scale.transform(*x).is_some() && self.y.scale.transform(*y).is_some())
        };
        let (vertical, horizontal) = (|| self.lines_at(AxisName::X), || self.lines_at(AxisName::Y));
        // Markers stay clear of the ends.
        let markers = self.series.iter().any(|series| series.style == Style::LineAndMarkers);
        let x = Range::of(placed().map(|(x, _)| *x).chain(vertical().map(|(x, _)| x)), self.x.scale)
            .padded(if markers { 0.03 } else { 0.0 });
        let y = Range::of(placed().map(|(_, y)| *y).chain(horizontal().map(|(y, _)| y)), self.y.scale);
        let y = match self.y.scale {
            Scale::Linear => y.rounded(INTERVALS[1]),
            Scale::Log => y.padded(0.04),
        };
        let numbers = y.ticks(self.y_intervals()).into_iter().filter_map(|tick| tick.label);
        let left = numbers.map(|label| width(&label)).fold(34.0, f64::max) + 10.0;
        let beside = horizontal().map(|(_, label)| width(label) + 14.0).fold(32.0, f64::max);
        let top = 48.0 + if vertical().count() > 0 { LINE } else { 0.0 };
        Frame { left, right: WIDTH - beside, top, bottom: top + FRAME_HEIGHT, x, y }
    }

    /// Values and labels of the reference lines at one axis.
    fn lines_at(&self, axis: AxisName) -> impl Iterator<Item = (f64, &str)> {
        let lines = self.reference_lines.iter().filter(move |line| line.axis == axis);
        lines.map(|line| (line.value, line.label.as_str()))
    }

    fn y_intervals(&self) -> usize {
        if self.y.scale == Scale::Log { INTERVALS[2] } else { INTERVALS[1] }
    }

    /// Grid, axes, ticks, their numbers, and the label of the horizontal axis.
    fn draw_axes(&self, frame: &Frame, body: &mut String) {
        let [left, right, top, bottom] = [frame.left, frame.right, frame.top, frame.bottom].map(short);
        let (mut grid, mut axes) = (String::new(), format!("M{left} {top}V{bottom}H{right}"));
        let mut numbers = String::new();
        for tick in frame.x.ticks(INTERVALS[0]) {
            let at = frame.left + tick.position * (frame.right - frame.left);
            axes += &format!("M{} {bottom}v{}", short(at), if tick.label.is_some() { 6 } else { 3 });
            if let Some(label) = tick.label {
                grid += &format!("M{} {bottom}V{top}", short(at));
                numbers += &text("number", "middle", (at, frame.bottom + LINE), &label);
            }
        }
        for tick in frame.y.ticks(self.y_intervals()) {
            let at = frame.bottom - tick.position * FRAME_HEIGHT;
            axes += &format!("M{left} {}h-{}", short(at), if tick.label.is_some() { 6 } else { 3 });
            if let Some(label) = tick.label {
                grid += &format!("M{left} {}H{right}", short(at));
                numbers += &text("number", "end", (frame.left - 9.0, at + 4.5), &label);
            }
        }
        *body +=
            &format!("<path class=\"grid\" d=\"{grid}\"/>\n<path class=\"axis\" d=\"{axes}\"/>\n{numbers}");
        let middle = (frame.left + frame.right) / 2.0;
        *body += &text("label", "middle", (middle, frame.bottom + 2.0 * LINE), &self.x.label);
    }

    /// Reference lines; labels beside the frame move down from one another.
    fn draw_reference_lines(&self, frame: &Frame, body: &mut String) {
        let (mut lines, mut labels) = (String::new(), String::new());
        for (x, label) in self.lines_at(AxisName::X) {
            let Some(at) = frame.x_at(x) else { continue };
            lines += &format!("M{} {}V{}", short(at), short(frame.bottom), short(frame.top - LINE + 2.0));
            labels += &text("label", "start", (at + 5.0, frame.top - 5.0), label);
        }
        let horizontal = self.lines_at(AxisName::Y);
        let mut placed: Vec<(f64, &str)> =
            horizontal.filter_map(|(y, label)| Some((frame.y_at(y)?, label))).collect();
        placed.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut free = f64::NEG_INFINITY;
        for (at, label) in placed {
            let middle = at.max(free);
            free = middle + LINE;
            let (left, right, end) = (short(frame.left), short(frame.right), short(frame.right + 9.0));
            lines += &format!("M{left} {}H{right}L{end} {}", short(at), short(middle));
            labels += &text("label", "start", (frame.right + 12.0, middle + 4.5), label);
        }
        if !lines.is_empty() {
            *body += &format!("<path class=\"reference\" d=\"{lines}\"/>\n{labels}");
        }
    }

    /// All curves, each in runs of points that have a position.
    fn draw_series(&self, frame: &Frame, body: &mut String) {
        let mut is_empty = true;
        for (series, look) in self.series.iter().zip(looks(&self.series)) {
            let positions: Vec<Option<DVec2>> = series.points.iter().map(|&point| frame.at(point)).collect();
            let runs = positions.split(Option::is_none).filter(|run| !run.is_empty());
            let runs: Vec<Vec<DVec2>> = runs.map(|run| run.iter().flatten().copied().collect()).collect();
            if !runs.is_empty() {
                is_empty = false;
                *body += &look.draw(&runs);
            }
        }
        if is_empty {
            let middle = ((frame.left + frame.right) / 2.0, (frame.top + frame.bottom) / 2.0);
            *body += &text("number", "middle", middle, "no data");
        }
    }

    /// Samples and labels in as many rows as needed; gives the height of the picture.
    fn draw_legend(&self, frame: &Frame, body: &mut String) -> f64 {
        let (mut x, mut baseline) = (frame.left, frame.bottom + 3.0 * LINE + 8.0);
        for (series, look) in self.series.iter().zip(looks(&self.series)) {
            let length = SAMPLE + width(&series.label);
            if x > frame.left && x + length > WIDTH {
                (x, baseline) = (frame.left, baseline + LINE);
            }
            let middle = baseline - 4.5;
            *body += &look.sample(DVec2::new(x + 2.0, middle), DVec2::new(x + SAMPLE - 10.0, middle));
            *body += &text("label", "start", (x + SAMPLE, baseline), &series.label);
            x += length + GAP;
        }
        (baseline + 9.0).ceil()
    }
}

/// A `<text>` element of a class at a point of its baseline; the anchor is start, middle or end.
fn text(class: &str, anchor: &str, (x, baseline): (f64, f64), content: &str) -> String {
    let (x, y, content) = (short(x), short(baseline), escape(content));
    format!("<text class=\"{class}\" text-anchor=\"{anchor}\" x=\"{x}\" y=\"{y}\">{content}</text>\n")
}

/// Estimated width of a text.
fn width(text: &str) -> f64 {
    ADVANCE * text.chars().count() as f64
}

/// A length with one decimal at most.
fn short(length: f64) -> String {
    // Adding 0 turns −0 into 0.
    format!("{}", (length * 10.0).round() / 10.0 + 0.0)
}

#[cfg(test)]
mod tests {
    use super::AxisName::{X, Y};
    use super::*;
    use crate::html::tests::assert_well_formed;

    fn series(points: Vec<(f64, f64)>, style: Style) -> Series {
        Series { label: "a < b".into(), points, style }
    }

    fn chart(x: Scale, y: Scale, series: Vec<Series>) -> Chart {
        let axis = |label: &str, scale| Axis { label: label.into(), scale };
        let title = "R[0] & \"sag\"".into();
        Chart { title, x: axis("time [ms]", x), y: axis("sag [mm]", y), series, reference_lines: Vec::new() }
    }

    fn attributes<'a>(svg: &'a str, name: &str) -> Vec<&'a str> {
        let key = format!(" {name}=\"");
        svg.split(&key).skip(1).map(|rest| rest.split('"').next().expect("a value")).collect()
    }

    /// Positions of all texts and of the absolute corners of all paths.
    fn positions(svg: &str) -> Vec<(f64, f64)> {
        let number = |text: &str| text.parse::<f64>().expect("a number");
        let texts = attributes(svg, "x").into_iter().zip(attributes(svg, "y"));
        let mut all: Vec<(f64, f64)> = texts.map(|(x, y)| (number(x), number(y))).collect();
        for corner in attributes(svg, "d").iter().flat_map(|path| path.split(['M', 'L']).skip(1)) {
            let corner = corner.split(|c: char| c.is_ascii_alphabetic()).next().expect("a corner");
            let (x, y) = corner.split_once(' ').expect("two numbers");
            all.push((number(x), number(y)));
        }
        all
    }

    #[test]
    fn everything_stays_within_the_view_box_whatever_the_data() {
        let wild = vec![(1e-9, -1e300), (f64::NAN, 1.0), (1e12, f64::INFINITY), (3.0, 4.0), (0.0, 1e-200)];
        for style in [Style::Line, Style::LineAndMarkers, Style::Dashed, Style::Markers] {
            for (x, y) in [(Scale::Linear, Scale::Log), (Scale::Log, Scale::Linear)] {
                for points in [wild.clone(), vec![(1.0, 1.0); 3], vec![(5.0, 2.0)], Vec::new()] {
                    let mut chart = chart(x, y, vec![series(points, style); 9]);
                    for (axis, value) in
                        [X, Y].into_iter().flat_map(|axis| [0.0, 1.0, f64::NAN].map(|v| (axis, v)))
                    {
                        chart.reference_lines.push(ReferenceLine { axis, value, label: "a & b".into() });
                    }
                    let svg = chart.svg();
                    let size: Vec<f64> = attributes(&svg, "viewBox")[0]
                        .split(' ')
                        .map(|v| v.parse().expect("a number"))
                        .collect();
                    for (x, y) in positions(&svg) {
                        let inside = (0.0..=size[2]).contains(&x) && (0.0..=size[3]).contains(&y);
                        assert!(inside, "{x} {y} outside {size:?}");
                    }
                    assert_well_formed(&svg);
                }
            }
        }
    }

    #[test]
    fn points_without_a_position_leave_gaps() {
        let nowhere = f64::NAN;
        let points = vec![(0.0, 0.0), (1.0, 1.0), (2.0, nowhere), (3.0, 1.0), (nowhere, 1.0), (6.0, 3.0)];
        let svg = chart(Scale::Linear, Scale::Linear, vec![series(points, Style::Line)]).svg();
        let curve = attributes(&svg, "d")[2];
        assert_eq!((curve.matches('M').count(), curve.matches('L').count()), (3, 1));
        assert!(curve.ends_with("h0"), "a single point is a dot");
        let points = vec![(1.0, 1.0), (2.0, 0.0), (3.0, -1.0), (4.0, 100.0)];
        let svg = chart(Scale::Log, Scale::Log, vec![series(points, Style::LineAndMarkers)]).svg();
        assert_eq!(attributes(&svg, "d")[3].matches('z').count(), 2);
        let svg = chart(Scale::Linear, Scale::Log, vec![series(vec![(nowhere, 1.0)], Style::Line)]).svg();
        assert!(svg.contains(">no data<"));
    }

    #[test]
    fn labels_of_reference_lines_do_not_meet() {
        let mut chart =
            chart(Scale::Linear, Scale::Linear, vec![series(vec![(0.0, 0.0), (1.0, 9.0)], Style::Line)]);
        let line = |value: f64| ReferenceLine { axis: Y, value, label: format!("reference {value}") };
        chart.reference_lines = [4.0, 4.1, 4.2].map(line).to_vec();
        let svg = chart.svg();
        let baseline = |label: &str| -> f64 {
            let before = svg.split(label).next().expect("a label");
            attributes(before, "y").last().expect("a baseline").parse().expect("a number")
        };
        let heights = ["reference 4.2", "reference 4.1", "reference 4<"].map(baseline);
        assert!(heights.windows(2).all(|pair| pair[1] - pair[0] >= LINE), "{heights:?}");
    }
}
