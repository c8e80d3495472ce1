//! What the paper reports beside what was measured: the table at the top of the page.

use crate::page::listing;

/// One thing that the paper reports.
#[derive(Debug, Clone)]
pub struct Finding {
    /// What it is.
    pub what: String,
    /// Where the paper tells of it.
    pub place: &'static str,
    /// What the paper says; empty where it says nothing.
    pub paper: String,
    /// What was measured.
    pub ours: String,
    /// Anchor of the section that tells more.
    pub section: &'static str,
}

impl Finding {
    /// The command that measures it again.
    fn command(&self) -> String {
        format!("palpate reproduce --only {}", self.section)
    }
}

/// All of them as a table.
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
