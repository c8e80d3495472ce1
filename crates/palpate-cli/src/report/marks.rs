//! Reference lines of a chart and their labels, which stand outside the frame and do not meet.

use super::chart::Plot;
use super::text::{Anchor, LINE, short, text, width, wrapped};

/// A thin reference line across the chart with its label at the edge.
#[derive(Clone, Debug)]
pub enum Mark {
    /// At one value of the vertical axis.
    Horizontal {
        /// Where, in the axis' unit.
        y: f64,
        /// Such as "paper: 16 ms".
        label: String,
    },
    /// At one value of the horizontal axis.
    Vertical {
        /// Where, in the axis' unit.
        x: f64,
        /// Such as "release".
        label: String,
    },
}

/// Widest label of a horizontal line.
const WIDEST: f64 = 130.0;
/// Room between a label and its line, and between labels.
const ROOM: f64 = 5.0;

/// Label of a vertical line, right of the line and above the frame.
struct Flag<'a> {
    at: f64,
    label: &'a str,
    /// Rows above the frame, from 0.
    row: usize,
}

impl Mark {
    /// Value and label of a vertical line.
    pub fn x(&self) -> Option<(f64, &str)> {
        match self {
            Self::Vertical { x, label } => Some((*x, label)),
            Self::Horizontal { .. } => None,
        }
    }

    /// Value and label of a horizontal line.
    pub fn y(&self) -> Option<(f64, &str)> {
        match self {
            Self::Horizontal { y, label } => Some((*y, label)),
            Self::Vertical { .. } => None,
        }
    }
}

/// Room that labels need right of the frame when it starts at a place of a picture of some width.
pub fn right_margin(marks: &[Mark], share: impl Fn(f64) -> Option<f64>, left: f64, picture: f64) -> f64 {
    let beside = marks.iter().filter_map(Mark::y).flat_map(|(_, label)| wrapped(label, WIDEST));
    let beside = beside.map(|line| width(&line) + 3.0 * ROOM);
    let above = marks.iter().filter_map(Mark::x).filter_map(|(x, label)| {
        // left + share (picture − left − margin) + label = picture, solved for the margin.
        let label = ROOM + width(label);
        Some((picture - left - (picture - left - label) / share(x)?.max(1e-3)).min(picture / 3.0))
    });
    beside.chain(above).fold(0.0, f64::max)
}

/// Room that labels need above the frame.
pub fn top_margin(marks: &[Mark], plot: &Plot) -> f64 {
    LINE * flags(marks, plot).iter().map(|flag| flag.row + 1).max().unwrap_or(0) as f64
}

/// The lines and their labels.
pub fn drawn(marks: &[Mark], plot: &Plot) -> String {
    let (mut lines, mut labels) = (String::new(), String::new());
    for Flag { at, label, row } in flags(marks, plot) {
        let top = plot.top - LINE * (row + 1) as f64;
        lines.push_str(&format!("M{} {}V{}", short(at), short(plot.bottom()), short(top + 2.0)));
        labels.push_str(&text("label", Anchor::Start, (at + ROOM, top + LINE - 5.0), label));
    }
    let (left, right, end) = (short(plot.left), short(plot.right), short(plot.right + 9.0));
    for (at, top, label) in stacked(marks, plot) {
        let middle = short(top + height(&label) / 2.0);
        lines.push_str(&format!("M{left} {}H{right}L{end} {middle}", short(at)));
        for (i, line) in label.iter().enumerate() {
            let baseline = top + LINE * (i + 1) as f64 - 5.0;
            labels.push_str(&text("label", Anchor::Start, (plot.right + 12.0, baseline), line));
        }
    }
    if lines.is_empty() { labels } else { format!("<path class=\"mark\" d=\"{lines}\"/>\n{labels}") }
}

/// Labels of vertical lines, from right to left: each above those it would meet, so that no line crosses one.
fn flags<'a>(marks: &'a [Mark], plot: &Plot) -> Vec<Flag<'a>> {
    let placed = marks.iter().filter_map(Mark::x);
    let mut flags: Vec<Flag> = placed
        .filter_map(|(x, label)| Some(Flag { at: plot.across(plot.x.share(x)?), label, row: 0 }))
        .collect();
    flags.sort_by(|a, b| b.at.total_cmp(&a.at));
    for i in 1..flags.len() {
        let end = flags[i].at + width(flags[i].label) + 2.0 * ROOM;
        let met = flags[..i].iter().filter(|other| other.at < end);
        flags[i].row = met.map(|other| other.row + 1).max().unwrap_or(0);
    }
    flags
}

/// Horizontal lines from top to bottom: height, top of the label, label. Labels that would meet move apart.
fn stacked(marks: &[Mark], plot: &Plot) -> Vec<(f64, f64, Vec<String>)> {
    let placed = marks.iter().filter_map(Mark::y);
    let mut labels: Vec<(f64, f64, Vec<String>)> = placed
        .filter_map(|(y, label)| Some((plot.up(plot.y.share(y)?), wrapped(label, WIDEST))))
        .map(|(at, label)| (at, at - height(&label) / 2.0, label))
        .collect();
    labels.sort_by(|a, b| a.0.total_cmp(&b.0));
    // Each below the one before it; then, where the frame ends, back up.
    let mut ceiling = f64::NEG_INFINITY;
    for (_, top, label) in &mut labels {
        *top = top.max(ceiling);
        ceiling = *top + height(label) + ROOM;
    }
    let mut floor = plot.bottom() + LINE / 2.0;
    for (_, top, label) in labels.iter_mut().rev() {
        *top = top.min(floor - height(label));
        floor = *top - ROOM;
    }
    labels
}

fn height(label: &[String]) -> f64 {
    LINE * label.len() as f64
}

#[cfg(test)]
mod tests {
    use super::super::ticks::{Scale, Span};
    use super::*;

    const AT: [f64; 5] = [4.0, 4.1, 0.0, 4.2, 8.9];

    fn plot() -> Plot {
        let span = Span { scale: Scale::Linear, low: 0.0, high: 9.0 };
        Plot { left: 50.0, right: 550.0, top: 100.0, x: span, y: span }
    }

    #[test]
    fn labels_above_do_not_meet_and_no_line_crosses_one() {
        let marks = AT.map(|x| Mark::Vertical { x, label: format!("release at {x} ms") });
        let plot = plot();
        let flags = flags(&marks, &plot);
        assert_eq!(flags.len(), 5);
        let covers = |flag: &Flag, at: f64| (flag.at..flag.at + width(flag.label) + ROOM).contains(&at);
        for (i, right) in flags.iter().enumerate() {
            for left in &flags[i + 1..] {
                assert!(left.row > right.row || !covers(left, right.at));
            }
        }
        assert_eq!(top_margin(&marks, &plot), 3.0 * LINE);
    }

    #[test]
    fn labels_beside_do_not_meet_and_stay_at_the_frame() {
        let marks =
            AT.map(|y| Mark::Horizontal { y, label: format!("{y} mm, as read from the paper's figure") });
        let plot = plot();
        let labels = stacked(&marks, &plot);
        assert_eq!(labels.len(), 5);
        assert!(labels.windows(2).all(|pair| pair[0].1 + height(&pair[0].2) <= pair[1].1));
        assert!(labels.iter().all(|(_, top, label)| top + height(label) <= plot.bottom() + LINE));
    }

    #[test]
    fn the_margin_lets_the_rightmost_label_end_in_the_picture() {
        let mark = [Mark::Vertical { x: 8.5, label: "release".into() }];
        let mut plot = plot();
        plot.right = 700.0 - right_margin(&mark, |x| plot.x.share(x), plot.left, 700.0);
        let end = plot.across(8.5 / 9.0) + ROOM + width("release");
        assert!((end - 700.0).abs() < 1e-9);
    }

    #[test]
    fn what_has_no_place_is_not_drawn() {
        let label = String::from("nowhere");
        let marks = [
            Mark::Vertical { x: f64::NAN, label: label.clone() },
            Mark::Horizontal { y: f64::INFINITY, label },
        ];
        assert_eq!(drawn(&marks, &plot()), "");
    }
}
