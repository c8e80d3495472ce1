//! Findings: answers to the statements of the paper, the table at the top of the page.

use crate::error::ReproduceError;
use crate::options::Part;
use crate::page::listing;
use crate::statements::Statement;
use crate::verdict::{Outcome, Verdict};

/// Origin of an answer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Origin {
    /// Measured or computed by the run.
    Measured,
    /// Arithmetic on numbers of the paper or of the run; the answer shows it.
    Derived,
}

/// Answer to a statement of the paper.
#[derive(Debug, Clone)]
pub struct Finding {
    /// The statement.
    pub statement: Statement,
    /// The answer.
    pub answer: String,
    /// Its origin.
    pub origin: Origin,
    /// Whether the statement holds here.
    pub verdict: Verdict,
}

impl Finding {
    /// A measured answer.
    pub fn measured(statement: Statement, verdict: Verdict, answer: String) -> Self {
        Self { statement, answer, origin: Origin::Measured, verdict }
    }

    /// A derived answer, with its arithmetic.
    pub fn derived(statement: Statement, verdict: Verdict, answer: String) -> Self {
        Self { statement, answer, origin: Origin::Derived, verdict }
    }
}

impl Origin {
    fn name(self) -> &'static str {
        match self {
            Self::Measured => "measured",
            Self::Derived => "derived",
        }
    }
}

/// A row for each statement that the parts answer, in the order of the paper.
///
/// # Errors
/// If one of the parts left a statement without an answer.
pub fn findings_table(findings: &[Finding], parts: &[Part]) -> Result<String, ReproduceError> {
    let (mut rows, mut anchors) = (Vec::new(), Vec::new());
    for statement in Statement::ALL.into_iter().filter(|statement| parts.contains(&statement.part())) {
        let found = findings.iter().find(|finding| finding.statement == statement);
        let Finding { answer, origin, verdict, .. } = found.ok_or_else(|| {
            let (place, says) = statement.text();
            let part = statement.part().name();
            ReproduceError::Measurement(format!(
                "the part {part} gives no answer to the paper's {place}: {says}"
            ))
        })?;
        let (place, says) = statement.text();
        let part = statement.part().name();
        let command = format!("palpate reproduce --only {part}");
        let answer = format!("{answer} [{}]", origin.name());
        rows.push([place.into(), says.into(), verdict.to_string(), answer, command]);
        anchors.push(part);
    }
    let count = |outcome| {
        let own = findings.iter().filter(|finding| parts.contains(&finding.statement.part()));
        own.filter(|finding| finding.verdict.outcome == outcome).count()
    };
    let caption = format!(
        "Statements and figures of the paper, and what came out here: {} hold, {} fall short, {} are not reproduced. A verdict follows from the numbers of this run beside it. The \
         command measures them again. In brackets: measured or computed by this run; or derived, by the arithmetic that is shown.",
        count(Outcome::Holds),
        count(Outcome::FallsShort),
        count(Outcome::NotReproduced)
    );
    Ok(listing(
        &caption,
        ["the paper", "what it says", "verdict", "what came out", "command"],
        &rows,
        &anchors,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::verdict::quantity;

    #[test]
    fn rows_have_the_place_the_answer_its_origin_and_a_link_to_the_part() {
        let finding = |statement, answer: &str| {
            Finding::measured(statement, quantity("flat to", 0.5, "mm").at_most(0.1), answer.into())
        };
        let mut findings = vec![
            finding(Statement::Figure3, "a plane"),
            Finding::derived(
                Statement::Figure2,
                quantity("arrival", 15.0, "ms").at_most(16.0),
                "0.1 m / 17.64 m/s < 16 ms".into(),
            ),
        ];
        let html = findings_table(&findings, &[Part::Impulses]).expect("all are answered");
        for text in [
            "<a href=\"#impulses\">figure 2</a>",
            "<code>palpate reproduce --only impulses</code>",
            "a plane [measured]",
            "<td class=\"verdict\"><b>falls short</b>: flat to 0.5 &gt; 0.1 mm</td>",
            "<b>holds</b>: arrival 15 ≤ 16 ms",
            "1 hold, 1 fall short, 0 are not reproduced",
            "0.1 m / 17.64 m/s &lt; 16 ms [derived]",
        ] {
            assert!(html.contains(text), "{text} is not in {html}");
        }
        assert!(html.find("figure 2") < html.find("figure 3"), "the order of the paper");
        findings.pop();
        let error = findings_table(&findings, &[Part::Impulses]).expect_err("figure 2 has no answer");
        assert_eq!(
            error.to_string(),
            "the part impulses gives no answer to the paper's figure 2: An impulse by a point: the wave has reached all nodes after \
             approximately 16 ms."
        );
    }
}
