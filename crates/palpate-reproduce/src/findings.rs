//! Findings: statements of the paper beside measured values, the table at the top of the page.

use crate::page::listing;

/// A statement of the paper and the measured value.
#[derive(Debug, Clone)]
pub struct Finding {
    /// Quantity.
    pub what: String,
    /// Place in the paper.
    pub place: &'static str,
    /// Value in the paper; empty where it gives none.
    pub paper: String,
    /// Measured value.
    pub ours: String,
    /// Anchor of the section with details.
    pub section: &'static str,
}

impl Finding {
    /// Command that measures it again.
    fn command(&self) -> String {
        format!("palpate reproduce --only {}", self.section)
    }
}

/// All findings as a table.
pub fn findings_table(findings: &[Finding]) -> String {
    let rows: Vec<[String; 4]> = findings
        .iter()
        .map(|finding| {
            [
                finding.what.clone(),
                match finding.paper.as_str() {
                    "" => "—".into(),
                    paper => format!("{paper} ({})", finding.place),
                },
                finding.ours.clone(),
                finding.command(),
            ]
        })
        .collect();
    let anchors: Vec<&str> = findings.iter().map(|finding| finding.section).collect();
    listing(
        "What the paper reports, what was measured here, and the command that measures it again",
        ["", "the paper", "palpate", "command"],
        &rows,
        &anchors,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_finding_has_its_place_in_the_paper_its_section_and_its_command() {
        let finding = Finding {
            what: "the whole table".into(),
            place: "section 3.1",
            paper: "67 h".into(),
            ours: "2 s < 67 h".into(),
            section: "recording",
        };
        let html = findings_table(&[finding]);
        for text in [
            "<a href=\"#recording\">the whole table</a>",
            "67 h (section 3.1)",
            "2 s &lt; 67 h",
            "<code>palpate reproduce --only recording</code>",
        ] {
            assert!(html.contains(text), "{text} is not in {html}");
        }
    }
}
