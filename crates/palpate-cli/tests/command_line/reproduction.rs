//! Output of `palpate reproduce` on a coarse cube, with or without a browser.

use crate::workplace::{Table, Workplace};

const FALL: [&str; 6] = ["reproduce", "--only", "fall", "--cells", "4", "-o"];

/// Of the cube's 54 mJ: sums of some thousand terms.
const SUMMED_J: f64 = 1e-14;

#[test]
fn without_a_browser_the_report_says_so_and_has_all_else() {
    let mut workplace = Workplace::new();
    workplace.set("PATH", "");
    let output = workplace.palpate(&[&FALL[..], &["report"]].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(0), "{said}");
    assert!(
        said.contains("warning: no pictures of figure5a.mcap: pictures are drawn by a browser"),
        "{said}"
    );
    let page = workplace.text("report/report.html");
    for part in [
        "Here a series of 8 pictures is missing: pictures are drawn by a browser",
        "the cube falls on a floor and bounces",
        "<code>palpate reproduce --only fall</code>",
        "Height of the centre",
        "Force of the floor",
        "Where the energy is",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("Figure 5(b)"), "only what was asked for");

    // The log repeats bit for bit, and tells the same as the page's numbers.
    let replayed = workplace.json(&["replay", "report/figure5a.mcap", "--csv", "steps.csv", "--json"]);
    assert_eq!(replayed["replayed"]["identical"], true);
    let (steps, own) =
        (Table::parse(&workplace.text("steps.csv")), Table::parse(&workplace.text("report/figure5a.csv")));
    assert_eq!(steps.len(), own.len());
    let heights = own.column("height_m");
    let logged = steps.column("cube.py");
    assert!(heights.iter().zip(&logged).all(|(height, y)| *height == y - 0.05));
    assert!(own.column("defect_j").iter().all(|defect| defect.abs() < SUMMED_J));
    assert!(own.column("floor_n").iter().any(|force| *force > 1.0), "it falls on the floor");
}

#[test]
fn a_browser_that_was_named_must_be_there() {
    let workplace = Workplace::new();
    let said = workplace.palpate(&[&FALL[..], &["report", "--browser", "no-browser"]].concat());
    let said = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(said.contains("the browser no-browser can't be started"), "{said}");
    let said = workplace.palpate(&["reproduce", "--only", "figure5a"]);
    assert_eq!(said.status.code(), Some(2), "a part that is not known");
}
