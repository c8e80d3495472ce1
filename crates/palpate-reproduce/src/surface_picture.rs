//! A picture of a deformed triangle surface as SVG text that stands inside a page.
//!
//! Painter's algorithm: triangles that face the viewer, from far to near, each in one colour: that of its
//! mean value times (a + (1 − a) max(0, n·l)), with its normal n, the direction to the light l and the
//! ambient share a. Orthographic, y up. Right where triangles do not pass through each other, as on the
//! surface of a solid.

use crate::chart::{Range, Scale};
use crate::html::escape;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// A surface at one moment.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Deformed positions of the nodes [m].
    pub positions: &'a [DVec3],
    /// Nodes of each triangle, counter-clockwise seen from outside.
    pub triangles: &'a [[u32; 3]],
    /// One value per node, shown as colour; a triangle with one that is not a number is grey.
    pub values: &'a [f64],
    /// Values at the two ends of the colours.
    pub range: (f64, f64),
    /// Direction of view.
    pub view: View,
    /// Visible rectangle; the same in pictures that are compared.
    pub frame: Frame,
    /// Short text below: "t = 16 ms".
    pub caption: String,
}

/// Direction from the object to the viewer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// About the y axis [°]: 0 sees the +z side, 90 the +x side.
    pub azimuth_deg: f64,
    /// Above the horizon [°]: 90 sees the +y side.
    pub elevation_deg: f64,
}

/// A rectangle of the plane of view [m]: x to the right, y up, the world's origin at (0, 0).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Frame {
    /// Left bottom corner [m].
    pub low: DVec2,
    /// Right top corner [m].
    pub high: DVec2,
}

/// Style sheet of pictures.
pub const PICTURE_STYLE: &str = "\
.picture,.colours{display:block;width:100%;height:auto}
.picture{max-width:15rem}
.colours{max-width:22rem;margin-top:.6rem}
.picture text,.colours text{font-size:13px;fill:var(--soft)}
.picture path{fill:currentColor;stroke:currentColor;stroke-width:.9;stroke-linejoin:round}
.mesh .picture{max-width:22rem}
.mesh path{stroke:#1b1f24;stroke-width:.35}
.colours path{fill:none;stroke:var(--soft)}
";

const WIDTH: f64 = 240.0;
/// Height of the caption below a picture.
const CAPTION: f64 = 22.0;
/// Colours by value and shades of each; few enough that neighbours often share a path.
const COLOURS: f64 = 48.0;
const SHADES: f64 = 24.0;
/// Share of light from everywhere.
const AMBIENT: f64 = 0.6;
/// To the light, in axes of the view: right, up, to the viewer.
const LIGHT: DVec3 = DVec3::new(-0.35, 0.75, 0.6);
/// Blue to yellow in evenly rising lightness (L* from 43 to 90), which every kind of colour vision tells
/// apart; sRGB. Its low end is lighter than is usual, so that it is seen in shade and on a dark page.
const MAP: [[f64; 3]; 6] = [
    [88.0, 94.0, 176.0],
    [62.0, 129.0, 194.0],
    [46.0, 163.0, 182.0],
    [83.0, 194.0, 146.0],
    [167.0, 215.0, 97.0],
    [248.0, 228.0, 84.0],
];

impl View {
    /// Axes of the view in world: right, up, towards the viewer.
    fn axes_in_world(self) -> [DVec3; 3] {
        let (a, e) = (self.azimuth_deg.to_radians(), self.elevation_deg.to_radians());
        let right = DVec3::new(a.cos(), 0.0, -a.sin());
        let viewer = DVec3::new(e.cos() * a.sin(), e.sin(), e.cos() * a.cos());
        [right, viewer.cross(right), viewer]
    }

    /// A position in axes of the view [m].
    fn view_from_world(self, position_in_world: DVec3) -> DVec3 {
        DVec3::from_array(self.axes_in_world().map(|axis| axis.dot(position_in_world)))
    }
}

impl Frame {
    /// The rectangle that holds all of some positions [m], with a margin.
    pub fn around<'a>(positions: impl IntoIterator<Item = &'a DVec3>, view: View) -> Self {
        let seen =
            positions.into_iter().map(|&p| view.view_from_world(p).truncate()).filter(|p| p.is_finite());
        let (low, high) =
            seen.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let margin = DVec2::splat(0.02 * (high - low).max_element());
        Self { low: low - margin, high: high + margin }
    }
}

/// A triangle that faces the viewer.
struct Facet {
    /// Corners in hundredths of a unit of the picture, y down.
    corners: [[i32; 2]; 3],
    /// Along the direction to the viewer [m].
    depth: f64,
    colour: [u8; 3],
}

impl Picture<'_> {
    /// The picture as an `<svg>` element, 240 units wide; needs [`PICTURE_STYLE`] in the page. Triangles with
    /// positions that are not finite are left out; a frame without area shows nothing.
    pub fn svg(&self) -> String {
        let size = self.frame.high - self.frame.low;
        let is_seen = size.is_finite() && size.min_element() > 0.0;
        let height = if is_seen { WIDTH * (size.y / size.x).clamp(0.1, 4.0) } else { WIDTH };
        let caption = escape(&self.caption);
        let mut out = format!(
            "<svg class=\"picture\" role=\"img\" viewBox=\"0 0 {WIDTH} {:.0}\">\n<title>{caption}</title>\n",
            (height + CAPTION).ceil()
        );
        let facets = if is_seen { self.facets(height) } else { Vec::new() };
        for ([r, g, b], facets) in grouped(facets) {
            let path: String = facets.iter().map(Facet::path).collect();
            out.push_str(&format!("<path color=\"#{r:02x}{g:02x}{b:02x}\" d=\"{path}\"/>\n"));
        }
        let (middle, baseline) = (WIDTH / 2.0, height + CAPTION - 7.0);
        out.push_str(&format!(
            "<text text-anchor=\"middle\" x=\"{middle}\" y=\"{baseline:.0}\">{caption}</text>\n</svg>\n"
        ));
        out
    }

    /// Triangles that face the viewer, from far to near.
    fn facets(&self, height: f64) -> Vec<Facet> {
        let nodes: Vec<DVec3> = self.positions.iter().map(|&p| self.view.view_from_world(p)).collect();
        let size = self.frame.high - self.frame.low;
        let scale = (WIDTH / size.x).min(height / size.y);
        let centre = (self.frame.low + self.frame.high) / 2.0;
        let place = |p: DVec3| {
            let right_and_down = (p.truncate() - centre) * DVec2::new(scale, -scale);
            let hundredths = (right_and_down + DVec2::new(WIDTH, height) / 2.0) * 100.0;
            [hundredths.x.round() as i32, hundredths.y.round() as i32]
        };
        let mut facets: Vec<Facet> = Vec::new();
        for triangle in self.triangles {
            let [Some(a), Some(b), Some(c)] = triangle.map(|node| nodes.get(node as usize).copied()) else {
                continue;
            };
            let normal = (b - a).cross(c - a);
            if !normal.is_finite() || normal.z <= 0.0 {
                continue;
            }
            let value = triangle.map(|node| self.values.get(node as usize).copied().unwrap_or(f64::NAN));
            let lit = normal.normalize_or_zero().dot(LIGHT.normalize()).max(0.0);
            let colour = self.colour(value.iter().sum::<f64>() / 3.0, lit);
            facets.push(Facet { corners: [a, b, c].map(place), depth: (a.z + b.z + c.z) / 3.0, colour });
        }
        facets.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        facets
    }

    /// Colour of a value in light of a strength from 0 to 1, both in steps.
    fn colour(&self, value: f64, lit: f64) -> [u8; 3] {
        let (low, high) = self.range;
        let share = if high > low { (value - low) / (high - low) } else { 0.0 };
        let shade = AMBIENT + (1.0 - AMBIENT) * (lit * SHADES).round() / SHADES;
        let colour = if value.is_nan() { [150.0; 3] } else { map((share * COLOURS).round() / COLOURS) };
        colour.map(|channel| (channel * shade).round() as u8)
    }
}

/// Colour at a share of the range, sRGB from 0 to 255.
fn map(share: f64) -> [f64; 3] {
    let at = share.clamp(0.0, 1.0) * (MAP.len() - 1) as f64;
    let below = (at as usize).min(MAP.len() - 2);
    let part = at - below as f64;
    [0, 1, 2].map(|channel| MAP[below][channel] * (1.0 - part) + MAP[below + 1][channel] * part)
}

/// Facets of one colour together, in an order that paints the same picture: one joins an earlier group if it
/// lies over none of those painted in between.
fn grouped(facets: Vec<Facet>) -> Vec<([u8; 3], Vec<Facet>)> {
    let mut groups: Vec<([u8; 3], Vec<Facet>)> = Vec::new();
    let mut latest: BTreeMap<[u8; 3], usize> = BTreeMap::new();
    for facet in facets {
        let earlier = latest.get(&facet.colour).copied();
        let joined = earlier.filter(|&at| {
            let between = groups[at + 1..].iter().flat_map(|(_, members)| members);
            !between.into_iter().any(|other| facet.overlaps(other))
        });
        match joined {
            Some(at) => groups[at].1.push(facet),
            None => {
                latest.insert(facet.colour, groups.len());
                groups.push((facet.colour, vec![facet]));
            }
        }
    }
    groups
}

impl Facet {
    /// Whether two facets share more than an edge: no edge of either separates them.
    fn overlaps(&self, other: &Self) -> bool {
        !self.is_separated_from(other) && !other.is_separated_from(self)
    }

    /// Whether all corners of the other one lie on or beyond one of this one's edges.
    fn is_separated_from(&self, other: &Self) -> bool {
        // Which side of edge a → b a corner c is on, (b − a) × (c − a).
        let side = |a: [i32; 2], b: [i32; 2], c: [i32; 2]| {
            let [ux, uy, vx, vy] = [b[0] - a[0], b[1] - a[1], c[0] - a[0], c[1] - a[1]].map(i64::from);
            ux * vy - uy * vx
        };
        // Counter-clockwise with y up is clockwise with y down: inside is negative.
        (0..3).any(|i| {
            let (a, b) = (self.corners[i], self.corners[(i + 1) % 3]);
            other.corners.iter().all(|&c| side(a, b, c) >= 0)
        })
    }

    /// A closed path.
    fn path(&self) -> String {
        let [a, b, c] = self.corners;
        let step = |from: [i32; 2], to: [i32; 2]| pair(to[0] - from[0], to[1] - from[1]);
        format!("M{}l{} {}z", pair(a[0], a[1]), step(a, b), step(b, c))
    }
}

/// Two lengths in units from hundredths.
fn pair(x: i32, y: i32) -> String {
    let (x, y) = (f64::from(x) / 100.0, f64::from(y) / 100.0);
    if y < 0.0 { format!("{x}{y}") } else { format!("{x} {y}") }
}

/// The colours of a range as a small horizontal bar with numbers, over its label: "displacement [mm]".
pub fn colour_bar(range: (f64, f64), label: &str) -> String {
    const LEFT: f64 = 30.0;
    const BAR: f64 = 260.0;
    const STEPS: usize = COLOURS as usize;
    let mut out = "<svg class=\"colours\" role=\"img\" viewBox=\"0 0 320 52\">\n".to_owned();
    out.push_str(&format!("<title>{}</title>\n", escape(label)));
    for step in 0..STEPS {
        let [r, g, b] = map(step as f64 / (STEPS - 1) as f64).map(|channel| channel.round() as u8);
        let x = LEFT + BAR * step as f64 / STEPS as f64;
        // Each reaches below the next one, so that no gap shows.
        let width = (2.0 * BAR / STEPS as f64).min(LEFT + BAR - x);
        out.push_str(&format!(
            "<rect fill=\"#{r:02x}{g:02x}{b:02x}\" x=\"{x:.2}\" width=\"{width:.2}\" height=\"12\"/>\n"
        ));
    }
    for tick in Range::of([range.0, range.1].into_iter(), Scale::Linear).ticks(5) {
        let (x, number) = (LEFT + BAR * tick.position, tick.label.unwrap_or_default());
        out.push_str(&format!("<path d=\"M{x:.1} 12v5\"/>\n"));
        out.push_str(&format!("<text text-anchor=\"middle\" x=\"{x:.1}\" y=\"30\">{number}</text>\n"));
    }
    out.push_str(&format!(
        "<text text-anchor=\"middle\" x=\"160\" y=\"47\">{}</text>\n</svg>\n",
        escape(label)
    ));
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::tests::assert_well_formed;

    const VIEW: View = View { azimuth_deg: 30.0, elevation_deg: 25.0 };

    /// Surface of a cube of edge 2 about the origin, n × n squares to a face.
    fn cube(n: u32) -> (Vec<DVec3>, Vec<[u32; 3]>) {
        let (mut positions, mut triangles) = (Vec::new(), Vec::new());
        for normal in [DVec3::X, DVec3::Y, DVec3::Z].into_iter().flat_map(|axis| [axis, -axis]) {
            let u = DVec3::new(normal.y.abs(), normal.z.abs(), normal.x.abs());
            let v = normal.cross(u);
            let first = positions.len() as u32;
            for (i, j) in (0..=n).flat_map(|i| (0..=n).map(move |j| (i, j))) {
                let at = |k: u32| 2.0 * f64::from(k) / f64::from(n) - 1.0;
                positions.push(normal + at(i) * u + at(j) * v);
                if i < n && j < n {
                    let [a, b, c, d] = [0, n + 1, n + 2, 1].map(|k| first + i * (n + 1) + j + k);
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
        (positions, triangles)
    }

    fn picture<'a>(positions: &'a [DVec3], triangles: &'a [[u32; 3]], values: &'a [f64]) -> Picture<'a> {
        let frame = Frame::around(positions, VIEW);
        let caption = "t < 16 ms".into();
        Picture { positions, triangles, values, range: (0.0, 1.0), view: VIEW, frame, caption }
    }

    fn triangles_in(svg: &str) -> usize {
        svg.lines().filter(|line| line.starts_with("<path")).map(|line| line.matches('M').count()).sum()
    }

    #[test]
    fn axes_of_the_view_are_right_handed_with_y_up() {
        let [right, up, viewer] = VIEW.axes_in_world();
        assert!((right.cross(up) - viewer).length() < 1e-15 && up.y > 0.0 && right.y == 0.0);
        let front = View { azimuth_deg: 0.0, elevation_deg: 0.0 };
        assert_eq!(front.view_from_world(DVec3::new(1.0, 2.0, 3.0)), DVec3::new(1.0, 2.0, 3.0));
    }

    #[test]
    fn three_faces_of_a_cube_are_seen_in_three_shades() {
        let (positions, triangles) = cube(12);
        let svg = picture(&positions, &triangles, &vec![0.0; positions.len()]).svg();
        assert_eq!(triangles.len(), 1728);
        assert_eq!(triangles_in(&svg), 864);
        assert_eq!(svg.matches("<path").count(), 3);
    }

    #[test]
    fn the_nearer_of_two_is_painted_last() {
        let square = |z: f64| [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0]].map(|[x, y]| DVec3::new(x, y, z));
        let positions = [square(1.0), square(-1.0)].concat();
        let mut picture = picture(&positions, &[[0, 1, 2], [3, 4, 5]], &[1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
        picture.view = View { azimuth_deg: 0.0, elevation_deg: 0.0 };
        let svg = picture.svg();
        let last = svg.lines().rfind(|line| line.starts_with("<path")).expect("as it was drawn");
        let [r, g, b] = picture.colour(1.0, DVec3::Z.dot(LIGHT.normalize()));
        assert!(last.contains(&format!("#{r:02x}{g:02x}{b:02x}")));
    }

    #[test]
    fn grouping_keeps_what_lies_over_what() {
        let facet = |corners, colour| Facet { corners, depth: 0.0, colour };
        let (one, other) = ([1; 3], [2; 3]);
        let at = |x: i32| [[x, 0], [x, 10], [x + 10, 0]];
        let names = |facets| -> Vec<u8> { grouped(facets).iter().map(|(colour, _)| colour[0]).collect() };
        assert_eq!(names(vec![facet(at(0), one), facet(at(5), other), facet(at(2), one)]), [1, 2, 1]);
        assert_eq!(names(vec![facet(at(0), one), facet(at(20), other), facet(at(2), one)]), [1, 2]);
        assert_eq!(names(vec![facet(at(0), one), facet(at(10), other), facet(at(0), one)]), [1, 2]);
    }

    #[test]
    fn a_cube_of_many_colours_is_small_and_stays_in_its_view_box() {
        let (mut positions, triangles) = cube(12);
        for p in &mut positions {
            *p -= 0.4 * DVec3::Y * (-3.0 * (p.x * p.x + p.z * p.z)).exp() * (p.y + 1.0);
        }
        let values: Vec<f64> = positions.iter().map(|p| (3.0 * p.x).sin() * p.z.cos()).collect();
        let svg = picture(&positions, &triangles, &values).svg();
        assert!(svg.len() < 60_000, "{} bytes", svg.len());
        assert_well_formed(&svg);
        assert_eq!(svg, picture(&positions, &triangles, &values).svg());
        let height: f64 = svg
            .split("240 ")
            .nth(1)
            .expect("as it was drawn")
            .split('"')
            .next()
            .expect("as it was drawn")
            .parse()
            .expect("as it was drawn");
        let picture = picture(&positions, &triangles, &values);
        for [x, y] in picture.facets(height - CAPTION).iter().flat_map(|facet| facet.corners) {
            assert!((0..=24_000).contains(&x) && (0..=(100.0 * (height - CAPTION)) as i32).contains(&y));
        }
    }

    #[test]
    fn broken_input_leaves_triangles_out() {
        let positions = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::NAN];
        let svg = picture(&positions, &[[0, 1, 2], [0, 1, 3], [0, 1, 9]], &[f64::NAN]).svg();
        assert_eq!(triangles_in(&svg), 1);
        assert_eq!(triangles_in(&picture(&[], &[[0, 1, 2]], &[]).svg()), 0);
        assert_well_formed(&colour_bar((f64::NAN, f64::INFINITY), "a < b"));
        assert_well_formed(&colour_bar((0.0, 12.0), "displacement [mm]"));
    }

    #[test]
    fn colours_rise_in_lightness() {
        let luminance = |share: f64| {
            let linear = map(share).map(|channel| (channel / 255.0).powf(2.2));
            0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
        };
        let lightness = |share: f64| luminance(share).cbrt();
        let steps: Vec<f64> =
            (0..20).map(|i| lightness(f64::from(i + 1) / 20.0) - lightness(f64::from(i) / 20.0)).collect();
        let (least, most) = steps.iter().fold((f64::MAX, 0.0_f64), |(l, m), &s| (l.min(s), m.max(s)));
        assert!(least > 0.0 && most < 2.0 * least, "{least} to {most}");
    }
}
