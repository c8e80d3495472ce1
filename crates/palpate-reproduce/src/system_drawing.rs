//! Figure 4: the experimental system, as a drawing of processes with what was measured on each.

use crate::html::escape;

/// Style sheet of the drawing.
pub const SYSTEM_STYLE: &str = "\
.system{display:block;width:100%;max-width:44rem;height:auto}
.system rect{fill:var(--shade);stroke:var(--soft)}
.system rect.machine{fill:none;stroke-dasharray:6 4}
.system path{fill:none;stroke:var(--ink);stroke-width:1.3}
.system path.head{fill:var(--ink);stroke:none}
.system text{font-size:13px;fill:var(--ink)}
.system .name{font-weight:600}
.system .soft{fill:var(--soft)}
";

/// Texts of the drawing: what was measured.
pub struct System {
    /// Of the links.
    pub link: String,
    /// Of the force process.
    pub force: String,
    /// Of the deformation process.
    pub deformation: String,
}

/// A box with a name and lines below it.
fn labelled((x, y, width, height): (u32, u32, u32, u32), name: &str, lines: &[&str]) -> String {
    let middle = x + width / 2;
    let mut out = format!("<rect x=\"{x}\" y=\"{y}\" width=\"{width}\" height=\"{height}\" rx=\"5\"/>\n");
    out += &text("name", middle, y + 22, name);
    for (at, line) in lines.iter().enumerate() {
        out += &text("soft", middle, y + 42 + 18 * at as u32, line);
    }
    out
}

fn text(class: &str, x: u32, y: u32, content: &str) -> String {
    format!("<text class=\"{class}\" text-anchor=\"middle\" x=\"{x}\" y=\"{y}\">{}</text>\n", escape(content))
}

/// A horizontal double arrow.
fn both_ways(from: u32, to: u32, y: u32) -> String {
    format!(
        "<path d=\"M{} {y}H{}\"/>\n<path class=\"head\" d=\"M{to} {y}l-9-4.5v9zM{from} {y}l9-4.5v9z\"/>\n",
        from + 8,
        to - 8
    )
}

/// The drawing as an `<svg>` element.
pub fn drawing(system: &System) -> String {
    let device = ["a process of its own", "haptic update, 1 kHz", "follows the path of a hand"];
    let mut body = String::new();
    for (name, y) in [("device left", 20), ("device right", 150)] {
        body += &labelled((6, y, 196, 104), name, &device);
        body += &both_ways(202, 306, y + 52);
    }
    body += &text("soft", 254, 128, "links,");
    body += &text("soft", 254, 146, &system.link);
    body += "<rect class=\"machine\" x=\"298\" y=\"8\" width=\"456\" height=\"262\" rx=\"8\"/>\n";
    let force = ["collision, equation (9),", "motion", "500 Hz, real-time priority", system.force.as_str()];
    body += &labelled((306, 20, 196, 234), "force process", &force);
    body += &text("soft", 404, 200, "history of forces,");
    body += &text("soft", 404, 218, "log of every step");
    body += "<path d=\"M502 137H562\"/>\n<path class=\"head\" d=\"M570 137l-9-4.5v9z\"/>\n";
    body += &text("soft", 536, 126, "history");
    let deformation =
        ["displacement of", "the whole surface", "asynchronous, 60 Hz", system.deformation.as_str()];
    body += &labelled((570, 70, 176, 130), "deformation process", &deformation);
    format!(
        "<svg class=\"system\" role=\"img\" viewBox=\"0 0 760 280\">\n<title>Processes of the experimental system</title>\n{body}</svg>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::tests::assert_well_formed;

    #[test]
    fn the_drawing_has_the_papers_processes_and_what_was_measured() {
        let system = System { link: "a < b".into(), force: "22 µs".into(), deformation: "21 ms".into() };
        let svg = drawing(&system);
        assert_well_formed(&svg);
        for part in ["force process", "deformation process", "haptic update", "a &lt; b", "22 µs", "21 ms"] {
            assert!(svg.contains(part), "{part}");
        }
    }
}
