//! Links and headings of Markdown pages, as far as the pages of this repository use them.

use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;

/// Link of a page.
#[derive(Debug, PartialEq, Eq)]
pub struct Link {
    /// Line, from 1.
    pub line: usize,
    /// Address as it is written.
    pub target: String,
    /// Bytes of the address within the page.
    pub range: Range<usize>,
}

/// Lines of prose with their numbers and first bytes: without fenced and indented code.
pub fn prose(text: &str) -> impl Iterator<Item = (usize, usize, &str)> {
    let mut fence = None;
    let mut start = 0;
    text.split_inclusive('\n').enumerate().filter_map(move |(at, line)| {
        let own_start = start;
        start += line.len();
        let marks = line.trim_start();
        let length = marks.len() - marks.trim_start_matches('`').len();
        match fence {
            Some(opened) if length >= opened && marks.trim_end().len() == length => {
                fence = None;
                None
            }
            Some(_) => None,
            None if length >= 3 => {
                fence = Some(length);
                None
            }
            None if line.starts_with("    ") => None,
            None => Some((at + 1, own_start, line.trim_end_matches('\n'))),
        }
    })
}

/// Parts of a line outside of code spans, with their first bytes.
pub fn outside_code(line: &str) -> Vec<(usize, &str)> {
    let mut parts = Vec::new();
    let mut start = 0;
    for (number, part) in line.split('`').enumerate() {
        if number % 2 == 0 {
            parts.push((start, part));
        }
        start += part.len() + 1;
    }
    parts
}

/// Links and images of a page.
pub fn links(text: &str) -> Vec<Link> {
    let mut found = Vec::new();
    for (number, line_start, line) in prose(text) {
        for (part_start, part) in outside_code(line) {
            for (at, _) in part.match_indices("](") {
                let from = at + 2;
                let Some(length) = part[from..].find(')') else { continue };
                let start = line_start + part_start + from;
                let target = part[from..from + length].to_string();
                found.push(Link { line: number, target, range: start..start + length });
            }
        }
    }
    found
}

/// Anchors of a page: of its headings, as GitHub makes them, and of `id` attributes.
pub fn anchors(text: &str) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    let mut repeated: BTreeMap<String, usize> = BTreeMap::new();
    for (_, _, line) in prose(text) {
        let ids = line.split(" id=\"").skip(1).filter_map(|rest| rest.split_once('"'));
        found.extend(ids.map(|(id, _)| id.to_string()));
        let title = line.trim_start_matches('#');
        if title.len() == line.len() || !title.starts_with(' ') {
            continue;
        }
        let slug = slug(title.trim());
        let count = repeated.entry(slug.clone()).or_default();
        found.insert(if *count == 0 { slug } else { format!("{slug}-{count}") });
        *count += 1;
    }
    found
}

/// Anchor of a heading.
fn slug(title: &str) -> String {
    let mut visible = String::new();
    // Of a link the text counts.
    let mut rest = title;
    while let Some((before, after)) = rest.split_once("](") {
        visible += before;
        rest = after.split_once(')').map_or("", |(_, rest)| rest);
    }
    visible += rest;
    let kept = |c: &char| c.is_alphanumeric() || matches!(c, ' ' | '-' | '_');
    visible.to_lowercase().chars().filter(kept).map(|c| if c == ' ' { '-' } else { c }).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const PAGE: &str = "# A page\nSee [one](a.md#b), [`two`](c.rs) and `[none](x)`.\n\n    [code](x)\n\n```text\n[code](x)\n# no\n```\n![p](p.png)\n";

    #[test]
    fn links_stand_in_prose_with_their_places() {
        let found = links(PAGE);
        let targets: Vec<_> = found.iter().map(|link| (link.line, link.target.as_str())).collect();
        assert_eq!(targets, [(2, "a.md#b"), (2, "c.rs"), (10, "p.png")]);
        assert!(found.iter().all(|link| PAGE[link.range.clone()] == link.target));
    }

    #[test]
    fn anchors_are_those_of_github() {
        let text = "# The page\n## What `x` is, and [why](a.md)\n## Again\n## Again\n<div id=\"C7\"></div>\n#no\n```sh\n# no\n```\n";
        let expected = ["C7", "again", "again-1", "the-page", "what-x-is-and-why"];
        assert_eq!(anchors(text).into_iter().collect::<Vec<_>>(), expected);
    }
}
