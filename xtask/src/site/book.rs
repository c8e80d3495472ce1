//! Staging of the book: pages with the addresses of the site, and anchors for the equations.

use super::links::{is_outside, resolve};
use super::markdown::{links, outside_code, prose};
use crate::words::citations::label;
use regex::Regex;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Folder of the pages.
const PAGES: &str = "docs";

/// Theory with the numbered equations.
const THEORY: &str = "docs/theory.md";

/// Table of contents.
const SUMMARY: &str = "docs/SUMMARY.md";

/// Crates without a library whose documentation could be shown.
const WITHOUT_LIBRARY: &[&str] = &["palpate-attack"];

/// Stage the book in a folder, which is emptied: `book.toml`, and the pages under `src`.
///
/// # Errors
/// When a page can't be read, links to a folder or to a page that the table of contents lacks, or is itself missing there.
pub fn stage(root: &Path, to: &Path) -> Result<(), String> {
    let told = |path: &Path, error: std::io::Error| format!("{}: {error}", path.display());
    if to.exists() {
        fs::remove_dir_all(to).map_err(|error| told(to, error))?;
    }
    let read = |name: &str| fs::read_to_string(root.join(name)).map_err(|error| format!("{name}: {error}"));
    let write = |name: &str, content: &[u8]| {
        let path = to.join(name);
        fs::create_dir_all(path.parent().unwrap_or(to)).map_err(|error| told(&path, error))?;
        fs::write(&path, content).map_err(|error| told(&path, error))
    };
    for name in ["book.toml", "site.css"] {
        write(name, read(&format!("{PAGES}/{name}"))?.replace("src = \".\"", "src = \"src\"").as_bytes())?;
    }
    let summary = read(SUMMARY)?;
    let chapters: BTreeSet<String> =
        links(&summary).iter().map(|link| resolve(SUMMARY, &link.target).0).collect();
    complete(root, &chapters)?;
    let equations: BTreeSet<String> = read(THEORY)?.lines().filter_map(label).map(str::to_string).collect();
    let mut files = BTreeSet::new();
    for name in chapters.iter().map(String::as_str).chain([SUMMARY]) {
        let mut text = rewrite(root, name, &read(name)?, &chapters, &mut files)?;
        if name == THEORY {
            text = with_anchors(&text);
        }
        if name != SUMMARY {
            text = link_equations(&text, &equations, name == THEORY)?;
        }
        write(&format!("src/{}", page(name)), text.as_bytes())?;
    }
    for file in files {
        let content = fs::read(root.join(&file)).map_err(|error| format!("{file}: {error}"))?;
        write(&format!("src/{}", copied(&file)), &content)?;
    }
    Ok(())
}

/// Whether every page of `docs/` is a chapter.
fn complete(root: &Path, chapters: &BTreeSet<String>) -> Result<(), String> {
    let entries = fs::read_dir(root.join(PAGES)).map_err(|error| format!("{PAGES}: {error}"))?;
    let names = entries.flatten().map(|entry| format!("{PAGES}/{}", entry.file_name().to_string_lossy()));
    let missing: Vec<_> =
        names.filter(|name| name.ends_with(".md") && name != SUMMARY && !chapters.contains(name)).collect();
    if missing.is_empty() { Ok(()) } else { Err(format!("{SUMMARY} lacks {}", missing.join(", "))) }
}

/// Place of a chapter in the book's source.
fn page(name: &str) -> String {
    name.strip_prefix("docs/").map_or_else(|| name.to_lowercase(), str::to_string)
}

/// Place of a file that is copied as it is: sources as text, which every browser shows.
fn copied(file: &str) -> String {
    // mdBook would take what ends in .md, also before another ending, for a page.
    if let Some(page) = file.strip_suffix(".md") {
        return format!("files/{page}.txt");
    }
    let shown = [".c", ".cpp", ".cs", ".toml", ".py", ".sh", ".rs"];
    if let Some(picture) = file.strip_prefix("docs/pictures/") {
        return format!("pictures/{picture}");
    }
    format!("files/{file}{}", if shown.iter().any(|ending| file.ends_with(ending)) { ".txt" } else { "" })
}

/// Address on the site, from its root, of a file of the repository; `None` if it is copied.
fn in_api(file: &str) -> Option<String> {
    let (krate, rest) =
        file.strip_prefix("crates/")?.split_once('/').unwrap_or((&file["crates/".len()..], ""));
    if WITHOUT_LIBRARY.contains(&krate) {
        return None;
    }
    let name = krate.replace('-', "_");
    match rest.strip_prefix("src/") {
        Some(source) if source.ends_with(".rs") => Some(format!("api/src/{name}/{source}.html")),
        _ if rest.is_empty() || rest == "README.md" => Some(format!("api/{name}/index.html")),
        _ => None,
    }
}

/// A page with the addresses of the site; files that it links to are added to `files`.
fn rewrite(
    root: &Path,
    name: &str,
    text: &str,
    chapters: &BTreeSet<String>,
    files: &mut BTreeSet<String>,
) -> Result<String, String> {
    let mut text = text.to_string();
    for link in links(&text.clone()).into_iter().rev() {
        if is_outside(&link.target) || link.target.starts_with('#') {
            continue;
        }
        let (file, anchor) = resolve(name, &link.target);
        // GitHub's first page is the README; the site's is the index.
        let file = if file == "README.md" { "docs/index.md".to_string() } else { file };
        let place = if chapters.contains(&file) {
            page(&file)
        } else if let Some(place) = in_api(&file) {
            place
        } else if root.join(&file).is_file() {
            files.insert(file.clone());
            copied(&file)
        } else {
            return Err(format!("{name}:{}: {} is no file that the site can show", link.line, link.target));
        };
        let anchor = if anchor.is_empty() { String::new() } else { format!("#{anchor}") };
        text.replace_range(link.range, &format!("{place}{anchor}"));
    }
    Ok(text)
}

/// Cell of the theory's table with the files that compute an equation, for each equation.
fn code_of(text: &str) -> BTreeMap<String, &str> {
    let mut found = BTreeMap::new();
    for line in text.lines().filter(|line| line.starts_with("| (C")) {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, equations, _, files, ..] = cells.as_slice() else { continue };
        let numbers: Vec<(usize, u32)> = equations
            .match_indices("(C")
            .filter_map(|(at, _)| Some((at, equations[at + 2..].split(')').next()?.parse().ok()?)))
            .collect();
        for (index, &(at, number)) in numbers.iter().enumerate() {
            // `(C9) – (C12)` is a range.
            let is_range = equations[..at].trim_end().ends_with('–') && index > 0;
            let first = if is_range { numbers[index - 1].1 + 1 } else { number };
            found.extend((first..=number).map(|number| (format!("C{number}"), *files)));
        }
    }
    found
}

/// The theory with an anchor before each block of equations, for each of them, and the files that compute them after it.
fn with_anchors(text: &str) -> String {
    let code = code_of(text);
    let mut out = String::new();
    let mut block: Vec<&str> = Vec::new();
    for line in text.lines().chain([""]) {
        if line.starts_with("    ") {
            block.push(line);
            continue;
        }
        let numbers: Vec<&str> = block.iter().filter_map(|line| label(line)).collect();
        for number in &numbers {
            out += &format!("<div id=\"{number}\"></div>\n");
        }
        if !numbers.is_empty() {
            out.push('\n');
        }
        block.drain(..).for_each(|line| out += &format!("{line}\n"));
        let mut files: Vec<&str> = numbers.iter().filter_map(|number| code.get(*number).copied()).collect();
        files.dedup();
        if !files.is_empty() {
            out += &format!("\n<small>Code: {}</small>\n", files.join(", "));
        }
        out += &format!("{line}\n");
    }
    out.truncate(out.trim_end().len());
    out + "\n"
}

/// A page whose citations of equations, `(C7)`, lead to them.
fn link_equations(text: &str, known: &BTreeSet<String>, is_theory: bool) -> Result<String, String> {
    let cited = Regex::new(r"[( ](C[0-9]+)\)").map_err(|error| error.to_string())?;
    let page = if is_theory { "" } else { "theory.md" };
    let mut places: Vec<(usize, String)> = Vec::new();
    for (_, line_start, line) in prose(text).filter(|(_, _, line)| !line.starts_with('#')) {
        for (part_start, part) in outside_code(line) {
            for found in cited.captures_iter(part).filter_map(|found| found.get(1)) {
                let is_in_link = part[..found.start()].rfind('[') > part[..found.start()].rfind(']');
                if known.contains(found.as_str()) && !is_in_link {
                    places.push((line_start + part_start + found.start(), found.as_str().to_string()));
                }
            }
        }
    }
    let mut text = text.to_string();
    for (at, number) in places.into_iter().rev() {
        text.replace_range(at..at + number.len(), &format!("[{number}]({page}#{number})"));
    }
    Ok(text)
}

/// Folder of the staged book, and of the site.
pub fn folders(root: &Path) -> (PathBuf, PathBuf) {
    (root.join("target/site-source"), root.join("target/site"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_have_their_places_on_the_site() {
        assert_eq!(page("docs/theory.md"), "theory.md");
        assert_eq!(page("ARCHITECTURE.md"), "architecture.md");
        assert_eq!(copied("data/logs/README.md"), "files/data/logs/README.txt");
        assert_eq!(copied("bindings/c/examples/press.c"), "files/bindings/c/examples/press.c.txt");
        assert_eq!(
            in_api("crates/palpate-fem/src/residual.rs").as_deref(),
            Some("api/src/palpate_fem/residual.rs.html")
        );
        assert_eq!(in_api("crates/palpate").as_deref(), Some("api/palpate/index.html"));
        assert_eq!(in_api("crates/palpate-mesh/README.md").as_deref(), Some("api/palpate_mesh/index.html"));
        assert_eq!(in_api("crates/palpate/tests/touch.rs"), None);
        assert_eq!(in_api("deny.toml"), None);
    }

    #[test]
    fn equations_have_anchors_and_citations_lead_to_them() {
        let theory = "by\n\n    a = b        (C1)\n    c = d        (C2)\n\nand (C1), or [x (C2)](y).\n\n| (C1) – (C2) (C9) | both | [`a.rs`](a) |\n";
        let known = BTreeSet::from(["C1".to_string(), "C2".to_string()]);
        let linked = link_equations(&with_anchors(theory), &known, true).expect("a page");
        let expected = "by\n\n<div id=\"C1\"></div>\n<div id=\"C2\"></div>\n\n    a = b        (C1)\n    c = d        (C2)\n\n\
                        <small>Code: [`a.rs`](a)</small>\n\nand ([C1](#C1)), or [x (C2)](y).\n\n\
                        | ([C1](#C1)) – ([C2](#C2)) (C9) | both | [`a.rs`](a) |\n";
        assert_eq!(linked, expected);
        let elsewhere = link_equations("([a](b), C2), C1, `(C1)` and (C9)", &known, false).expect("a page");
        assert_eq!(elsewhere, "([a](b), [C2](theory.md#C2)), C1, `(C1)` and (C9)");
    }

    #[test]
    fn every_equation_leads_to_its_code() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a root");
        let theory = fs::read_to_string(root.join(THEORY)).expect("the theory");
        let code = code_of(&theory);
        let equations: Vec<&str> = theory.lines().filter_map(label).collect();
        assert!(equations.len() > 70, "{} equations", equations.len());
        let missing: Vec<_> = equations.iter().filter(|number| !code.contains_key(**number)).collect();
        assert!(missing.is_empty(), "{missing:?}");
    }

    #[test]
    fn the_book_of_the_repository_is_whole() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("a root");
        let folder = tempfile::tempdir().expect("a folder");
        stage(root, folder.path()).expect("pages");
        let theory = fs::read_to_string(folder.path().join("src/theory.md")).expect("the theory");
        assert!(
            theory.contains("<div id=\"C7\"></div>")
                && theory.contains("(api/src/palpate/response/modal.rs.html)")
        );
        let index = fs::read_to_string(folder.path().join("src/index.md")).expect("the first page");
        assert!(index.contains("](my-program.md"));
    }
}
